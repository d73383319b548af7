//! Controls at a bound whose switching function comes down to zero between nodes or at an end. Closed forms.

use super::parts::{breaks, phase, trajectory};
use super::{assert_failed, certify};
use crate::{Certificate, Verdict};
use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, Sense, State, Term, Variable};

/// `x' = u`.
struct Rate;
impl Dynamics<1, 1> for Rate {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// `fuel (1 + ((t - touch)^2 + margin) u) + slope x`.
#[derive(Clone, Copy, Default)]
struct Cost {
    fuel: f64,
    touch: f64,
    margin: f64,
    slope: f64,
}
impl PathFunction<1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let late = t - self.touch;
        [((late * late + self.margin) * u[0] + 1.0) * self.fuel + x[0] * self.slope]
    }
}

/// `-reward (x - from)^2`.
struct Away {
    reward: f64,
    from: f64,
}
impl VectorFunction<1, 1> for Away {
    fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
        let way = z[0] - self.from;
        [-(way * way) * self.reward]
    }
}

fn problem(cost: Cost, away: Away, control: Bounds) -> Ocp {
    let control = Variable { bounds: control, ..Variable::new("u", "-") };
    let phase = Phase::new("arc", Rate)
        .states([State::new("x", "-").starts_at(0.0).scaled_by(1.0)])
        .controls([control.scaled_by(1.0)])
        .integral(Variable::new("cost", "-"), cost)
        .final_time(Bounds::fixed(1.0));
    let terms = [Term::Integral("arc", "cost", 1.0), Term::function([At::FinalState("arc", "x")], away)];
    Ocp::builder("touch")
        .phase(phase)
        .objective(Sense::Minimize, "cost", "-", terms)
        .build()
        .expect("well-posed")
}

/// No fuel is spent, at a price of `(t - touch)^2 + margin`; a reward for the square of the way. A burn of length `d` at the touch
/// costs `d^3 / 12 + margin d - reward d^2`.
fn without_a_burn(margin: f64, reward: f64) -> Certificate {
    let cost = Cost { fuel: 1.0, touch: 0.4371, margin, slope: 0.0 };
    let ocp = problem(cost, Away { reward, from: 0.0 }, Bounds::new(0.0, 1.0));
    let arc = phase("arc", &breaks(0.0, 1.0, 4), 3, |_, _| vec![0.0], |_, _| vec![0.0], |_, _| vec![0.0]);
    certify(&ocp, &trajectory(vec![arc], 1.0))
}

#[test]
fn a_switching_function_that_touches_zero_between_nodes_is_not_strict() {
    let certificate = without_a_burn(0.0, 1.0);
    assert_eq!(certificate.verdict, Verdict::Extremal, "{certificate:#?}");
    assert!(
        certificate.remarks.iter().any(|r| r.contains("second variation is zero")),
        "{:?}",
        certificate.remarks
    );
}

#[test]
fn a_touch_at_which_a_burn_costs_to_second_order_stays_strict() {
    assert!(without_a_burn(0.0, -1.0).verdict >= Verdict::StrictLocalOptimum);
}

#[test]
fn a_switching_function_that_keeps_away_from_zero_stays_strict() {
    for reward in [1.0, -1.0] {
        assert!(without_a_burn(0.01, reward).verdict >= Verdict::StrictLocalOptimum);
    }
}

#[test]
fn a_switching_function_that_is_negative_between_two_nodes_is_found() {
    let certificate = without_a_burn(-5e-4, -1.0);
    assert_failed(&certificate, &["least Hamiltonian"]);
}

/// `u = 1` with the switching function `t - 1`, zero at the end: turning round for the last time `d` costs `d^2` in the integral of `-x`
/// and gains `4 reward d^2`.
#[test]
fn a_switching_function_that_ends_at_zero_is_judged_by_the_second_variation() {
    for (reward, is_strict) in [(1.0, false), (0.3, false), (0.2, true), (-1.0, true)] {
        let cost = Cost { slope: -1.0, ..Cost::default() };
        let ocp = problem(cost, Away { reward, from: 1.0 }, Bounds::new(-1.0, 1.0));
        let arc =
            phase("arc", &breaks(0.0, 1.0, 4), 5, |_, t| vec![t], |_, _| vec![1.0], |_, t| vec![t - 1.0]);
        let certificate = certify(&ocp, &trajectory(vec![arc], -0.5));
        let expected = certificate.verdict >= Verdict::StrictLocalOptimum;
        assert_eq!(expected, is_strict, "{reward}: {certificate:#?}");
        assert!(certificate.verdict >= Verdict::Extremal);
    }
}
