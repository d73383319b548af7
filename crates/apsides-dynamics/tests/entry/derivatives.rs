//! Derivatives of the rates against `num-dual`, which has its own arithmetic, and against differences where tables are involved.

use apsides_ad::dynamics_node;
use apsides_dynamics::aerodynamics::AttackTable;
use apsides_dynamics::entry::{Banked, BankedAtAttack, EntryFlight, Heading};
use apsides_dynamics::equinoctial::EARTH_J2;
use apsides_dynamics::{Aerodynamics, Atmosphere, Body};
use nalgebra::{SMatrix, SVector};
use num_dual::DualNum;

use crate::{capsule, tabulated_capsule};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-13;

/// Altitude, longitude, latitude, speed, flight path angle, azimuth, bank; then the time.
const POINT: [f64; 8] = [60e3, 0.9, 0.5, 6800.0, -0.04, 2.3, 0.8, 0.0];

/// The equations of model E with oblateness and the azimuth from north, as they are published.
fn oracle<D: DualNum<Primitive = f64>>(z: [D; 7]) -> [D; 6] {
    let [h, _, latitude, v, g, psi, bank] = z;
    let (mu, radius, w) = (Body::EARTH.gravitational_parameter, Body::EARTH.radius, 7.292115e-5);
    let r = h.clone() + radius;
    let q = (-h / 7200.0).exp() * v.clone() * &v * (1.225 * 0.5 * 6.157_521_601_035_993 / 2800.0);
    let (lift, drag) = (q.clone() * 0.40815, q * 1.2569);
    let (sg, cg) = g.sin_cos();
    let (sl, cl) = latitude.sin_cos();
    let (sp, cp) = psi.sin_cos();
    let (sb, cb) = bank.sin_cos();
    let r2 = r.clone() * &r;
    let oblate = r2.recip() * (EARTH_J2 * radius * radius);
    let central = r2.recip() * mu;
    let down = central.clone() * ((sl.clone() * &sl * 3.0 - 1.0) * &oblate * -1.5 + 1.0);
    let northward = -(central * oblate * &sl * &cl * 3.0);
    let spin = r.clone() * &cl * (w * w);
    let vertical = v.clone() * &cg / &r;
    [
        v.clone() * &sg,
        vertical.clone() * &sp / &cl,
        vertical.clone() * &cp,
        -drag - down.clone() * &sg
            + northward.clone() * &cg * &cp
            + spin.clone() * (sg.clone() * &cl - cg.clone() * &sl * &cp),
        (lift.clone() * cb - down * &cg - northward.clone() * &sg * &cp) / &v
            + &vertical
            + cl.clone() * &sp * (2.0 * w)
            + spin.clone() * (cg.clone() * &cl + sg.clone() * &sl * &cp) / &v,
        (lift * sb - northward * &sp) / (v.clone() * &cg) + vertical * &sp * &sl / &cl
            - (sg / &cg * &cl * &cp - &sl) * (2.0 * w)
            + spin * &sl * sp / (v * cg),
    ]
}

fn oblate_capsule() -> EntryFlight {
    let mut flight = capsule(Heading::FromNorth);
    flight.planet.j2 = EARTH_J2;
    flight
}

#[test]
fn jacobian_agrees_with_num_dual() {
    let node = dynamics_node(Banked(oblate_capsule()));
    let at: SVector<f64, 7> = SVector::from_fn(|k, _| POINT[k]);
    let (value, expected) =
        num_dual::jacobian(|z: SVector<_, 7>| SVector::from(oracle(std::array::from_fn(|k| z[k]))), &at);
    let expected: SMatrix<f64, 6, 7> = expected;
    let (mut out, mut entries) = ([0.0; 6], vec![0.0; node.pattern().jacobian_len()]);
    node.jacobian(&POINT, &mut out, &mut entries);
    for k in 0..6 {
        assert!((out[k] - value[k]).abs() < ROUNDING * value[k].abs(), "{out:?} {value}");
    }
    let mut dense = SMatrix::<f64, 6, 7>::zeros();
    for ((r, c), v) in node.pattern().jacobian_entries().zip(&entries) {
        dense[(r, c)] = *v;
    }
    for (found, expected) in dense.iter().zip(expected.iter()) {
        assert!((found - expected).abs() < 10.0 * ROUNDING * expected.abs().max(1e-6), "{dense} {expected}");
    }
}

#[test]
fn hessian_agrees_with_num_dual() {
    let node = dynamics_node(Banked(oblate_capsule()));
    // Weights that bring the rows to one size.
    let weights = [1e-3, 1e3, 1e3, 1e-1, 1e3, 1e3];
    let at: SVector<f64, 7> = SVector::from_fn(|k, _| POINT[k]);
    let (_, _, expected) = num_dual::hessian(
        |z: SVector<_, 7>| {
            let rows = oracle(std::array::from_fn(|k| z[k]));
            rows.into_iter().zip(weights).map(|(v, w)| v * w).reduce(|a, b| a + b).unwrap()
        },
        &at,
    );
    let expected: SMatrix<f64, 7, 7> = expected;
    let mut entries = vec![0.0; node.pattern().hessian_len()];
    node.hessian(&POINT, &weights, &mut entries);
    assert!(node.formula().is_ok(), "elementary functions alone: second derivatives by adjoints");
    let mut dense = SMatrix::<f64, 7, 7>::zeros();
    for (&(i, j), v) in node.pattern().hessian.iter().zip(&entries) {
        dense[(i, j)] = *v;
        dense[(j, i)] = *v;
    }
    for (found, expected) in dense.iter().zip(expected.iter()) {
        assert!((found - expected).abs() < 100.0 * ROUNDING * expected.abs().max(1e-6), "{dense} {expected}");
    }
}

/// Central differences of values against the Jacobian, and of Jacobians against the Hessian, by the inputs that have a size.
fn assert_by_differences(node: &dyn apsides_ad::NodeFunction, at: &[f64], sizes: &[f64]) {
    let pattern = node.pattern();
    let jacobian = |at: &[f64]| {
        let (mut out, mut entries) = ([0.0; 6], vec![0.0; pattern.jacobian_len()]);
        node.jacobian(at, &mut out, &mut entries);
        let mut dense = vec![[0.0; 6]; at.len()];
        for ((row, column), v) in pattern.jacobian_entries().zip(entries) {
            dense[column][row] = v;
        }
        (out, dense)
    };
    let weights = [1e-3, 1e3, 1e3, 1e-1, 1e3, 1e3];
    let mut entries = vec![0.0; pattern.hessian_len()];
    node.hessian(at, &weights, &mut entries);
    let mut hessian = vec![vec![0.0; at.len()]; at.len()];
    for (&(i, j), v) in pattern.hessian.iter().zip(&entries) {
        hessian[i][j] = *v;
        hessian[j][i] = *v;
    }
    let (_, exact) = jacobian(at);
    for j in 0..sizes.len() {
        let moved = |sign: f64| {
            let mut point = at.to_vec();
            point[j] += sign * 1e-5 * sizes[j];
            jacobian(&point)
        };
        let (plus, minus) = (moved(1.0), moved(-1.0));
        let step = 2e-5 * sizes[j];
        for row in 0..6 {
            let difference = (plus.0[row] - minus.0[row]) / step * sizes[j] * weights[row];
            let found = exact[j][row] * sizes[j] * weights[row];
            assert!((difference - found).abs() < DIFFERENCES, "rate {row} by {j}: {found} {difference}");
        }
        for i in 0..sizes.len() {
            let sum = |jacobian: &[[f64; 6]]| -> f64 { (0..6).map(|k| weights[k] * jacobian[i][k]).sum() };
            let difference = (sum(&plus.1) - sum(&minus.1)) / step * sizes[i] * sizes[j];
            let found = hessian[i][j] * sizes[i] * sizes[j];
            assert!((difference - found).abs() < 10.0 * DIFFERENCES, "second {i} {j}: {found} {difference}");
        }
    }
}

#[test]
fn tables_by_differences() {
    let sizes = [1e3, 1.0, 1.0, 1e3, 1.0, 1.0, 1.0];
    for altitude in [55e3, 83e3, 98e3] {
        let mut at = POINT;
        at[0] = altitude;
        let node = dynamics_node(Banked(tabulated_capsule(Heading::FromEast)));
        assert_by_differences(node.as_ref(), &at, &sizes);
    }
    let (mach, attack) = ([0.5, 2.0, 8.0, 30.0], [0.0, 0.2, 0.5, 0.8]);
    let table = |f: fn(f64, f64) -> f64| -> Vec<f64> {
        mach.iter().flat_map(|m: &f64| attack.map(|a| f(m.ln(), a))).collect()
    };
    let (lift, drag) = (table(|x, a| (1.0 + 0.1 * x) * a.sin()), table(|x, a| 0.1 + 0.02 * x + a * a));
    let mut flight = capsule(Heading::FromNorth);
    flight.planet.atmosphere = Atmosphere::UsStandard1976;
    flight.vehicle.aerodynamics =
        Aerodynamics::Attack(AttackTable::new(&mach, &attack, &lift, &drag).unwrap());
    let node = dynamics_node(BankedAtAttack(flight));
    let at = [60e3, 0.9, 0.5, 4800.0, -0.04, 2.3, 0.8, 0.4, 0.0];
    assert_by_differences(node.as_ref(), &at, &[1e3, 1.0, 1.0, 1e3, 1.0, 1.0, 1.0, 1.0]);
}
