//! A path constraint that touches its bound in one instant: Bryson and Denham's turn below the ceiling `l = 1/5`.
//!
//! `u = 24 l - 8 + 24 (1 - 4l) t` for `t <= 1/2`, mirrored after; `lambda_x = u'`, `lambda_v = -u`, multiplier of the contact
//! `48 (1 - 4l)`. A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 3.11, example 2.

use super::parts::{self, DoubleIntegrator, Energy, energy, trajectory};
use super::{assert_exact, assert_failed, certify, find};
use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{Bounds, Contact, Ocp, Phase, State, Trajectory, Variable};

const L: f64 = 0.2;
const SLOPE: f64 = 24.0 * (1.0 - 4.0 * L);

/// `x` and `x + u`.
struct Rows;
impl PathFunction<2, 1, 2> for Rows {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[0], x[0] + u[0]]
    }
}

fn problem() -> Ocp {
    let phase = Phase::new("turn", DoubleIntegrator)
        .states([
            State::new("position", "m").within(-1.0, 1.0).starts_at(0.0).ends_at(0.0),
            State::new("speed", "m/s").within(-2.0, 2.0).starts_at(1.0).ends_at(-1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-20.0, 20.0)])
        .path([Variable::new("ceiling", "m").at_most(L), Variable::new("sum", "-").at_most(10.0)], Rows)
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("turn").phase(phase).minimize_integral("turn", "energy").build().expect("well-posed")
}

fn solution(contacts: &[Contact]) -> Trajectory {
    let half = |t: f64| {
        let a = 24.0 * L - 8.0;
        [t + a * t * t / 2.0 + SLOPE * t.powi(3) / 6.0, 1.0 + a * t + SLOPE * t * t / 2.0, a + SLOPE * t]
    };
    let at = |k: usize, t: f64| {
        let [x, v, u] = half(if k < 2 { t } else { 1.0 - t });
        if k < 2 { [x, v, u, SLOPE] } else { [x, -v, u, -SLOPE] }
    };
    let mut found = parts::phase(
        "turn",
        &parts::breaks(0.0, 1.0, 4),
        4,
        |k, t| at(k, t)[..2].to_vec(),
        |k, t| vec![at(k, t)[2]],
        |k, t| vec![at(k, t)[3], -at(k, t)[2]],
    );
    found.path_multipliers = Some(parts::multipliers(&found, 2, |_, _| vec![0.0, 0.0]));
    found.contacts = contacts.to_vec();
    trajectory(vec![found], 2.24)
}

fn contact(end: usize, row: usize, multiplier: f64) -> Contact {
    Contact { end, row, multiplier }
}

#[test]
fn costates_jump_at_a_contact() {
    let certificate = certify(&problem(), &solution(&[contact(2, 0, 2.0 * SLOPE)]));
    assert_exact(&certificate);
    let check = find(&certificate, "rates of the path constraints");
    assert_eq!((check.limit, check.at.as_str()), (1e-4, "contact of ceiling, phase `turn`, t = 0.5 s"));
}

#[test]
fn jumps_without_their_contact_are_found() {
    let failed = |contacts: &[Contact], parts: &[&str]| {
        assert_failed(&certify(&problem(), &solution(contacts)), parts);
    };
    failed(&[], &["costate equation"]);
    failed(&[contact(2, 0, 1.9 * SLOPE)], &["costate equation"]);
    failed(&[contact(2, 0, -2.0 * SLOPE)], &["costate equation", "signs"]);
    // Where the row is inside its bound, and rises.
    failed(&[contact(2, 0, 2.0 * SLOPE), contact(1, 0, 0.1)], &["costate equation", "signs", "rates"]);
}

#[test]
fn contacts_that_cannot_be_fail() {
    let good = contact(2, 0, 2.0 * SLOPE);
    // Beyond the ends of the phase, of a row that does not exist, of one with a control.
    for bad in [contact(9, 0, 0.0), contact(1, 7, 0.0), contact(0, 1, 0.0), contact(4, 7, 0.0)] {
        let certificate = certify(&problem(), &solution(&[good, bad]));
        for part in ["signs", "rates", "Hamiltonian across"] {
            let check = find(&certificate, part);
            assert!(check.value.is_nan() && !check.passed, "{bad:?} {check:?}");
        }
    }
    let certificate = certify(&problem(), &solution(&[good, contact(1, 1, 0.0)]));
    assert!(find(&certificate, "signs").value.is_nan() && find(&certificate, "costate").value.is_nan());
}

/// Where the row is away from its bound at an end of the phase it gives the costates there nothing.
#[test]
fn impulses_at_the_ends_are_multipliers_of_constraints_there() {
    let good = contact(2, 0, 2.0 * SLOPE);
    let none = certify(&problem(), &solution(&[good, contact(0, 0, 0.0), contact(4, 0, 0.0)]));
    assert!(none.checks.iter().all(|c| c.passed), "{:#?}", none.checks);
    for end in [0, 4] {
        let certificate = certify(&problem(), &solution(&[good, contact(end, 0, 0.1)]));
        assert!(!find(&certificate, "signs of the endpoint").passed, "{end}");
    }
}
