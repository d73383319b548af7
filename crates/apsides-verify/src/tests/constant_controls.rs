//! Rest to rest in one second with the least integral of `u^2 / 2` among controls that are constant on `n` given intervals `h_k` about `m_k`:
//!
//! ```text
//! c_k = a (1 - 2 m_k),   a sum_k h_k (1 - 2 m_k)(1 - m_k) = 1,   lambda = (-2 a, -a (1 - 2 t))
//! ```
//!
//! The mean of `lambda_2 + c_k` over each interval vanishes. Where two intervals are equally long the Hamiltonian is continuous between
//! them: equal lengths are the best ones. Without steps it is the problem of `minimum_energy`.

use super::certify;
use super::parts::{self, DoubleIntegrator, Energy, breaks, energy, trajectory};
use crate::{Certificate, Verdict};
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

fn problem(bound: f64) -> Ocp {
    let phase = Phase::new("push", DoubleIntegrator)
        .states([
            State::new("position", "m").starts_at(0.0).ends_at(1.0).scaled_by(1.0),
            State::new("speed", "m/s").starts_at(0.0).ends_at(0.0).scaled_by(1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-bound, bound).scaled_by(1.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("steps").phase(phase).minimize_integral("push", "energy").build().expect("well-posed")
}

/// The flight under constant accelerations between breaks.
fn flight(ends: &[f64], steps: &[f64], costate: impl Fn(f64) -> Vec<f64>) -> Trajectory {
    let lengths = || ends.windows(2).map(|w| w[1] - w[0]);
    let mut starts = vec![[0.0, 0.0]];
    for (c, h) in steps.iter().zip(lengths()) {
        let [x, v] = starts[starts.len() - 1];
        starts.push([x + h * v + 0.5 * h * h * c, v + h * c]);
    }
    let state = |k: usize, t: f64| {
        let ([x, v], dt) = (starts[k], t - ends[k]);
        vec![x + v * dt + 0.5 * steps[k] * dt * dt, v + steps[k] * dt]
    };
    let energy: f64 = steps.iter().zip(lengths()).map(|(c, h)| 0.5 * h * c * c).sum();
    let phase = parts::phase("push", ends, 4, state, |k, _| vec![steps[k]], |_, t| costate(t));
    trajectory(vec![phase], energy)
}

/// The best steps between breaks that are the same seen from both ends, and their costates, with a change of the first four steps that keeps
/// both ends where their lengths are equal.
fn steps(ends: &[f64], change: f64) -> Trajectory {
    let of = |w: &[f64]| (w[1] - w[0], 0.5 * (w[0] + w[1]));
    let sum: f64 = ends.windows(2).map(of).map(|(h, m)| h * (1.0 - 2.0 * m) * (1.0 - m)).sum();
    let a = 1.0 / sum;
    let mut steps: Vec<f64> = ends.windows(2).map(of).map(|(_, m)| a * (1.0 - 2.0 * m)).collect();
    for (step, sign) in steps.iter_mut().zip([1.0, -3.0, 3.0, -1.0]) {
        *step += sign * change;
    }
    flight(ends, &steps, |t| vec![-2.0 * a, -a * (1.0 - 2.0 * t)])
}

fn claimed(certificate: &Certificate) -> Option<(Verdict, &str)> {
    certificate.claim.as_ref().map(|c| (c.verdict, c.among.as_str()))
}

#[test]
fn the_best_steps_are_claimed_to_be_so_and_no_more() {
    let symmetric = vec![0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0];
    for (ends, of) in [
        (breaks(0.0, 1.0, 4), "intervals of any lengths"),
        (breaks(0.0, 1.0, 30), "intervals of any lengths"),
        (symmetric, "intervals that are given parts of their phases"),
    ] {
        let n = ends.len() - 1;
        let certificate = certify(&problem(100.0), &steps(&ends, 0.0));
        assert_eq!(certificate.verdict, Verdict::Feasible, "{n}: {certificate:#?}");
        let among = format!("controls constant on each of {n} {of}");
        assert_eq!(
            claimed(&certificate),
            Some((Verdict::StrictLocalOptimum, among.as_str())),
            "{certificate:#?}"
        );
        assert!(certificate.is_verified());
        let claim = certificate.claim.as_ref().expect("claimed");
        for check in &claim.checks {
            assert!(check.meaning().is_some(), "no sentence for `{}`", check.name);
        }
        let stationarity =
            claim.checks.iter().find(|c| c.name.contains("mean stationarity")).expect("checked");
        assert!(stationarity.value < ROUNDING, "{stationarity:#?}");
    }
}

#[test]
fn other_steps_between_the_same_ends_are_not() {
    let certificate = certify(&problem(100.0), &steps(&breaks(0.0, 1.0, 6), 0.01));
    assert_eq!(certificate.verdict, Verdict::Feasible);
    assert_eq!(claimed(&certificate), None);
    assert!(!certificate.is_verified());
}

#[test]
fn steps_outside_their_bounds_are_rejected_whatever_is_claimed() {
    let certificate = certify(&problem(4.0), &steps(&breaks(0.0, 1.0, 6), 0.0));
    assert_eq!((certificate.verdict, claimed(&certificate)), (Verdict::Rejected, None));
    let good = certify(&problem(100.0), &steps(&breaks(0.0, 1.0, 6), 0.0));
    let wrong = crate::Check::new("of a mission", crate::CheckKind::Feasibility, 1.0, 0.0, "m", "");
    assert!(!good.with_checks([wrong]).is_verified());
}

/// Full ahead, full astern: from rest to rest over 1 m in 2 s, and with a third step between that is not zero.
fn two_or_three(u: [f64; 3], ends: [f64; 4]) -> Trajectory {
    let state = |k: usize, t: f64| {
        let (mut x, mut v) = (0.0, 0.0);
        for j in 0..=k {
            let dt = if j == k { t - ends[j] } else { ends[j + 1] - ends[j] };
            x += v * dt + 0.5 * u[j] * dt * dt;
            v += u[j] * dt;
        }
        vec![x, v]
    };
    let phase = parts::phase("push", &ends, 4, state, |k, _| vec![u[k]], |_, t| vec![-1.0, t - 1.0]);
    trajectory(vec![phase], ends[3])
}

#[test]
fn the_best_controls_of_all_need_no_claim() {
    let phase = Phase::new("push", DoubleIntegrator)
        .states([
            State::new("position", "m").starts_at(0.0).ends_at(1.0).scaled_by(1.0),
            State::new("speed", "m/s").starts_at(0.0).ends_at(0.0).scaled_by(1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.1, 10.0));
    let ocp = Ocp::builder("cart").phase(phase).minimize("time", "s", At::FinalTime("push")).build();
    let certificate =
        certify(&ocp.expect("well-posed"), &two_or_three([1.0, 1.0, -1.0], [0.0, 0.5, 1.0, 2.0]));
    assert!(certificate.verdict >= Verdict::StrictLocalOptimum && certificate.claim.is_none());
}

/// `x' = u` with the integrand `u^2 - x^2`.
struct Oscillator;
impl Dynamics<1, 1> for Oscillator {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}
impl PathFunction<1, 1, 1> for Oscillator {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0] - x[0] * x[0]]
    }
}

#[test]
fn steps_beyond_the_conjugate_point_are_no_minimum_among_steps() {
    for (duration, expected) in [(3.0, true), (3.5, false), (5.0, false)] {
        let phase = Phase::new("arc", Oscillator)
            .states([State::new("x", "-").within(-1.0, 1.0).starts_at(0.0).ends_at(0.0).scaled_by(1.0)])
            .controls([Variable::new("u", "-").within(-2.0, 2.0).scaled_by(1.0)])
            .integral(Variable::new("cost", "-"), Oscillator)
            .final_time(Bounds::fixed(duration));
        let ocp = Ocp::builder("oscillator").phase(phase).minimize_integral("arc", "cost").build();
        let zero = |_: usize, _: f64| vec![0.0];
        let phase = parts::phase("arc", &breaks(0.0, duration, 20), 1, zero, zero, zero);
        let certificate = certify(&ocp.expect("well-posed"), &trajectory(vec![phase], 0.0));
        assert_eq!(certificate.is_verified(), expected, "{duration}: {certificate:#?}");
    }
}

/// `u^2` with a well of width 0.1 and depth 90 about `u = 9`: the least value of it is that of the well.
struct Well;
impl PathFunction<1, 1, 1> for Well {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let off = (u[0] - 9.0) * 10.0;
        [u[0] * u[0] - (-(off * off)).exp() * 90.0]
    }
}

/// A constant in the wrong well is stationary, and another constant is better.
#[test]
fn a_constant_in_the_wrong_well_is_not_claimed() {
    let phase = Phase::new("well", Oscillator)
        .states([State::new("x", "-").starts_at(0.0).scaled_by(1.0)])
        .controls([Variable::new("u", "-").within(-10.0, 10.0).scaled_by(1.0)])
        .integral(Variable::new("cost", "-"), Well)
        .final_time(Bounds::fixed(1.0));
    let ocp = Ocp::builder("well").phase(phase).minimize_integral("well", "cost").build();
    let zero = |_: usize, _: f64| vec![0.0];
    let phase = parts::phase("well", &breaks(0.0, 1.0, 10), 1, zero, zero, zero);
    let certificate = certify(&ocp.expect("well-posed"), &trajectory(vec![phase], 0.0));
    assert_eq!((certificate.verdict, claimed(&certificate)), (Verdict::Feasible, None));
    assert!(!certificate.is_verified());
    let reason = certificate.remarks.iter().find(|r| r.contains("no optimum among")).expect("said");
    assert!(reason.contains("another constant") && reason.contains("u 8.99"), "{reason}");
}
