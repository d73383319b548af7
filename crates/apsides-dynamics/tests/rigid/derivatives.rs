//! Derivatives of the rates against `num-dual`, and against differences where tables are involved.

use apsides_ad::{Dynamics, dynamics_node};
use apsides_dynamics::aerodynamics::{
    AxisymmetricAerodynamics, Damping, Interpolation, MachAlphaTable, MachLaw,
};
use apsides_dynamics::atmosphere::{Atmosphere, Exponential};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia, RigidBody, Start};
use apsides_dynamics::{Ellipsoid, MovingMassVehicle};
use nalgebra::{SMatrix, SVector};
use num_dual::DualNum;

use crate::{ENTRY, INERTIA, capsule, flat};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// A body with a constant axial force and normal force and moment that are proportional to the angle.
fn proportional() -> MovingMassVehicle {
    let (mach, attack) = ([0.4, 1.0, 2.0, 9.0], [0.0, 0.1, 0.2, 0.5]);
    let rows = |f: fn(f64) -> f64| -> Vec<f64> { (0..16).map(|k| f(attack[k % 4])).collect() };
    let (axial, normal, moment) = (rows(|_| 1.4), rows(|a| 0.25 * a), rows(|a| -0.15 * a));
    let table =
        MachAlphaTable::new(&mach, &attack, [&axial, &normal, &moment], Interpolation::Linear).unwrap();
    let damping = Damping { pitch: MachLaw::Constant(-0.25), roll: MachLaw::Constant(-0.02) };
    let aerodynamics = AxisymmetricAerodynamics::new(table, 1.5, 0.2406, damping).unwrap();
    let atmosphere = Atmosphere::Exponential(Exponential::EARTH);
    let ground = Ground::Flat(FlatEarth::uniform(9.8).unwrap());
    let inertia = Inertia::principal(INERTIA).unwrap();
    let body = RigidBody::new(ground, atmosphere, aerodynamics, 500.0, inertia, [0.0, 0.01, 0.005]).unwrap();
    MovingMassVehicle::new(body, Layout::CROSS, [10.0, 5.0], 0.2).unwrap()
}

/// Its quasi-static equations, with the rotation of unit quaternions by vectors instead of a matrix.
fn oracle<D: DualNum<Primitive = f64>>(z: [D; 15]) -> [D; 13] {
    let cross = |a: &[D; 3], b: &[D; 3]| -> [D; 3] {
        std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            a[i].clone() * &b[j] - a[j].clone() * &b[i]
        })
    };
    // v + 2 s (e x v) + 2 e x (e x v), of q / |q|.
    let norm = (6..10).map(|k| z[k].clone() * &z[k]).reduce(|a, b| a + b).unwrap();
    let turned = |v: &[D; 3], sign: f64| -> [D; 3] {
        let e: [D; 3] = std::array::from_fn(|k| z[7 + k].clone() * sign);
        let once = cross(&e, v);
        let twice = cross(&e, &once);
        std::array::from_fn(|k| v[k].clone() + (once[k].clone() * &z[6] + &twice[k]) * 2.0 / norm.clone())
    };
    let v: [D; 3] = std::array::from_fn(|k| z[3 + k].clone());
    let spin: [D; 3] = std::array::from_fn(|k| z[10 + k].clone());
    let [u, b, c] = turned(&v, -1.0);
    let across = (b.clone() * &b + c.clone() * &c).sqrt();
    let speed = (across.clone() * &across + u.clone() * &u).sqrt();
    let angle = across.atan2(u) / &across;
    let area = 0.25 * std::f64::consts::PI * 2.25;
    let pressure = (z[2].clone() / 7200.0).exp() * 0.5 * 1.225 * area * &speed;
    let q = pressure.clone() * &speed;
    let force = [q.clone() * -1.4, q.clone() * &angle * &b * -0.25, q.clone() * &angle * &c * -0.25];
    let slope = -0.15 + 0.2406 * 0.25;
    let damping = pressure * (0.5 * 2.25);
    let mut moment = [
        damping.clone() * &spin[0] * -0.02,
        q.clone() * &angle * &c * (1.5 * slope) + damping.clone() * &spin[1] * -0.25,
        q * &angle * &b * (-1.5 * slope) + damping * &spin[2] * -0.25,
    ];
    let centre = [D::from(0.0), z[13].clone() * 0.02 + 0.01, z[14].clone() * 0.01 + 0.005];
    let lever = cross(&centre, &force);
    for k in 0..3 {
        moment[k] -= lever[k].clone();
    }
    let push = turned(&force, 1.0);
    let (s, e): (D, [D; 3]) = (z[6].clone(), std::array::from_fn(|k| z[7 + k].clone()));
    let turn = cross(&e, &spin);
    let scalar = (0..3).map(|k| e[k].clone() * &spin[k]).reduce(|a, b| a + b).unwrap() * -0.5;
    let gyroscopic = cross(&spin, &std::array::from_fn(|k| spin[k].clone() * INERTIA[k]));
    let angular: [D; 3] = std::array::from_fn(|k| (moment[k].clone() - &gyroscopic[k]) / INERTIA[k]);
    let quaternion: [D; 3] = std::array::from_fn(|k| (s.clone() * &spin[k] + &turn[k]) * 0.5);
    let acceleration: [D; 3] =
        std::array::from_fn(|k| push[k].clone() / 500.0 + if k == 2 { 9.8 } else { 0.0 });
    let [v0, v1, v2] = v;
    let [a0, a1, a2] = acceleration;
    let [q1, q2, q3] = quaternion;
    let [w0, w1, w2] = angular;
    [v0, v1, v2, a0, a1, a2, scalar, q1, q2, q3, w0, w1, w2]
}

/// States, two positions, time. The quaternion is not of length one.
fn point() -> [f64; 16] {
    let ground = Ground::Flat(FlatEarth::uniform(9.8).unwrap());
    let start =
        Start { altitude: 25e3, speed: 800.0, attack: 0.1, sideslip: -0.05, spin: [0.2, -0.1, 0.3], ..ENTRY };
    let x = ground.state(&start).unwrap();
    std::array::from_fn(|k| match k {
        0..6 | 10..13 => x[k],
        6..10 => 1.02 * x[k],
        13 => 0.3,
        14 => -0.2,
        _ => 0.0,
    })
}

struct Quasi(MovingMassVehicle);

impl Dynamics<13, 2> for Quasi {
    fn rate<S: apsides_ad::Scalar>(&self, t: S, x: &[S; 13], u: &[S; 2], p: &[S; 0]) -> [S; 13] {
        self.0.rate(t, x, u, p)
    }
}

#[test]
fn jacobian_agrees_with_num_dual() {
    let node = dynamics_node(Quasi(proportional()));
    let at: SVector<f64, 15> = SVector::from_fn(|k, _| point()[k]);
    let (value, expected) =
        num_dual::jacobian(|z: SVector<_, 15>| SVector::from(oracle(std::array::from_fn(|k| z[k]))), &at);
    let expected: SMatrix<f64, 13, 15> = expected;
    let (mut out, mut entries) = ([0.0; 13], vec![0.0; node.pattern().jacobian_len()]);
    node.jacobian(&point(), &mut out, &mut entries);
    for k in 0..13 {
        assert!(
            (out[k] - value[k]).abs() < ROUNDING * (1.0 + value[k].abs()),
            "{k}: {} {}",
            out[k],
            value[k]
        );
    }
    let mut dense = SMatrix::<f64, 13, 15>::zeros();
    for ((r, c), v) in node.pattern().jacobian_entries().zip(&entries) {
        dense[(r, c)] = *v;
    }
    for (found, expected) in dense.iter().zip(expected.iter()) {
        assert!((found - expected).abs() < 10.0 * ROUNDING * expected.abs().max(1e-2), "{found} {expected}");
    }
}

#[test]
fn hessian_agrees_with_num_dual() {
    let node = dynamics_node(Quasi(proportional()));
    let weights: [f64; 13] = std::array::from_fn(|k| 1.0 + 0.3 * k as f64);
    let at: SVector<f64, 15> = SVector::from_fn(|k, _| point()[k]);
    let (_, _, expected) = num_dual::hessian(
        |z: SVector<_, 15>| {
            let rows = oracle(std::array::from_fn(|k| z[k]));
            rows.into_iter().zip(weights).map(|(v, w)| v * w).reduce(|a, b| a + b).unwrap()
        },
        &at,
    );
    let expected: SMatrix<f64, 15, 15> = expected;
    let mut entries = vec![0.0; node.pattern().hessian_len()];
    node.hessian(&point(), &weights, &mut entries);
    let mut dense = SMatrix::<f64, 15, 15>::zeros();
    for (&(i, j), v) in node.pattern().hessian.iter().zip(&entries) {
        dense[(i, j)] = *v;
        dense[(j, i)] = *v;
    }
    for (found, expected) in dense.iter().zip(expected.iter()) {
        assert!((found - expected).abs() < 1e3 * ROUNDING * expected.abs().max(1e-2), "{found} {expected}");
    }
}

/// The full model with the smooth table over the ellipsoid: Jacobian against differences of the rates.
#[test]
fn full_model_by_differences() {
    for (ground, layout) in [(flat(), Layout::CROSS), (Ground::Ellipsoid(Ellipsoid::WGS84), Layout::RADIAL)] {
        let body = capsule(
            ground,
            Atmosphere::UsStandard1976,
            Interpolation::Smooth,
            Damping::constant(),
            [0.01, 0.0],
        );
        let vehicle = MovingMassVehicle::new(body.unwrap(), layout, [10.0, 5.0], 0.2).unwrap();
        let start = Start { altitude: 25e3, speed: 800.0, attack: 0.1, spin: [0.2, -0.1, 0.3], ..ENTRY };
        let x = ground.state(&start).unwrap();
        let z: Vec<f64> = x.into_iter().chain([0.3, -0.2, 0.5, 0.8, -1.0, 2.0, 0.0]).collect();
        let rate = |z: &[f64]| -> [f64; 13] {
            let (x, u): ([f64; 13], [f64; 6]) = (z[..13].try_into().unwrap(), z[13..19].try_into().unwrap());
            Dynamics::<13, 6>::rate(&vehicle, 0.0, &x, &u, &[])
        };
        let node = dynamics_node(Full(vehicle.clone()));
        let (mut out, mut entries) = ([0.0; 13], vec![0.0; node.pattern().jacobian_len()]);
        node.jacobian(&z, &mut out, &mut entries);
        assert_eq!(out, rate(&z));
        let mut dense = vec![[0.0; 13]; 20];
        for ((row, column), v) in node.pattern().jacobian_entries().zip(entries) {
            dense[column][row] = v;
        }
        for column in 0..19 {
            let h = 1e-5 * if column < 3 { 1e4 } else { z[column].abs().max(1.0) };
            let moved = |s: f64| {
                let mut z = z.clone();
                z[column] += s * h;
                rate(&z)
            };
            let (a, b) = (moved(-1.0), moved(1.0));
            for row in 0..13 {
                let slope = (b[row] - a[row]) / (2.0 * h);
                let found = dense[column][row];
                assert!(
                    (found - slope).abs() < DIFFERENCES * slope.abs().max(1e-2),
                    "{row} {column}: {found} {slope}"
                );
            }
        }
    }
}

struct Full(MovingMassVehicle);

impl Dynamics<13, 6> for Full {
    fn rate<S: apsides_ad::Scalar>(&self, t: S, x: &[S; 13], u: &[S; 6], p: &[S; 0]) -> [S; 13] {
        self.0.rate(t, x, u, p)
    }
}
