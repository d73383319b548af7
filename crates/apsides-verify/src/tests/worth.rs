//! The worth of what a trajectory misses: multipliers that grow without bound as an end can only just be met.

use super::parts::{breaks, phase, trajectory};
use super::{certify, find};
use crate::Verdict;
use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Trajectory, Variable};

/// The end, and what is allowed of it.
const END: f64 = 1e-10;
const MISS: f64 = 1e-8;
/// The costate is that of the control to rounding.
const LAST_BITS: f64 = 1e-9;
/// Multipliers by least squares of the adjoint equation, relative.
const FOUND: f64 = 1e-7;

/// `x' = u^2`, which is nothing but by its second order.
struct Square;
impl Dynamics<1, 1> for Square {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0]]
    }
}

/// `(u - 1)^2`
struct Distance;
impl PathFunction<1, 1, 1> for Distance {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(u[0] - 1.0).square()]
    }
}

/// The end itself.
struct Same;
impl VectorFunction<1, 1> for Same {
    fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
        [z[0]]
    }
}

/// As near to a control of one as an end near zero allows: `u = sqrt(END)`.
fn way(x: State) -> Phase {
    Phase::new("way", Square)
        .states([x.starts_at(0.0).scaled_by(1.0)])
        .controls([Variable::new("u", "-").within(-1.0, 1.0)])
        .integral(Variable::new("distance", "-"), Distance)
        .final_time(Bounds::fixed(1.0))
}

fn problem() -> Ocp {
    let phase = way(State::new("x", "-").ends_at(END));
    Ocp::builder("only just").phase(phase).minimize_integral("way", "distance").build().expect("well-posed")
}

/// The extremal of an end.
fn extremal(end: f64) -> Trajectory {
    let u = end.sqrt();
    let costate = (1.0 - u) / u;
    let way =
        phase("way", &breaks(0.0, 1.0, 4), 4, |_, t| vec![end * t], |_, _| vec![u], |_, _| vec![costate]);
    trajectory(vec![way], (1.0 - u).powi(2))
}

#[test]
fn what_is_missed_counts_with_its_multiplier() {
    let exact = certify(&problem(), &extremal(END));
    assert_eq!(exact.verdict, Verdict::StrictLocalOptimum, "{:#?}", exact.checks);
    // A tenth of what the end may miss, and ten times what the objective may gain.
    let missed = certify(&problem(), &extremal(END + MISS));
    assert_eq!(missed.verdict, Verdict::Feasible);
    let failed: Vec<_> = missed.failures().map(|check| check.name.as_str()).collect();
    assert_eq!(failed, ["worth of what is missed"]);
    let worth = find(&missed, "worth");
    let u = (END + MISS).sqrt();
    let expected = MISS * (1.0 - u) / u;
    assert!((worth.value / expected - 1.0).abs() < LAST_BITS, "{} of {expected}", worth.value);
    assert!(worth.at.contains("final x"), "{}", worth.at);
}

/// The end as a condition of its own, whose multiplier the adjoint equation gives.
#[test]
fn multipliers_that_are_not_stated_count_too() {
    let end = Variable::new("end", "-").within(END, END).scaled_by(1.0);
    let ocp = Ocp::builder("only just")
        .phase(way(State::new("x", "-")))
        .constrain("end", [end], [At::FinalState("way", "x")], Same)
        .minimize_integral("way", "distance")
        .build()
        .expect("well-posed");
    let mut missed = extremal(END + MISS);
    missed.phases[0].costate = None;
    missed.constraint_multipliers = None;
    let certificate = certify(&ocp, &missed);
    assert_eq!(certificate.verdict, Verdict::Feasible);
    let worth = find(&certificate, "worth");
    let u = (END + MISS).sqrt();
    let expected = MISS * (1.0 - u) / u;
    assert!((worth.value / expected - 1.0).abs() < FOUND, "{} of {expected}", worth.value);
    assert!(worth.at.contains("`end`"), "{}", worth.at);
}
