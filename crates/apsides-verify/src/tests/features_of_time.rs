//! Pulses and jumps of the equations in time, on meshes that are wide beside them.

use super::certify;
use super::parts::{breaks, phase, trajectory};
use crate::{Verdict, VerifySettings, verify};
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Time and width of the pulse, time of the jump.
const PULSE: f64 = 0.323;
const WIDTH: f64 = 1e-5;
const JUMP: f64 = 0.3;

/// `x' = u`, or twice that from the jump on.
struct Gain {
    jumps: bool,
}
impl Dynamics<1, 1> for Gain {
    fn rate<S: Scalar>(&self, t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [if self.jumps { ((t - JUMP).sign() * 0.5 + 1.5) * u[0] } else { u[0] }]
    }
}

/// `(1 + height exp(-((t - PULSE)/WIDTH)^2)) u^2`
struct Cost {
    height: f64,
}
impl PathFunction<1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let pulse = (-((t - PULSE) * WIDTH.recip()).square()).exp() * self.height;
        [(pulse + 1.0) * u[0] * u[0]]
    }
}

/// The pulse as a path constraint: not above `least`.
struct Pulse;
impl PathFunction<1, 1, 1> for Pulse {
    fn evaluate<S: Scalar>(&self, t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(-((t - PULSE) * WIDTH.recip()).square()).exp() + u[0] * 0.0]
    }
}

/// From 0 to 1 in one unit of time.
fn arc(gain: Gain, cost: Cost) -> Phase {
    Phase::new("arc", gain)
        .states([State::new("x", "-").starts_at(0.0).ends_at(1.0).scaled_by(1.0)])
        .controls([Variable::new("u", "-").within(-10.0, 10.0).scaled_by(1.0)])
        .integral(Variable::new("cost", "-"), cost)
        .initial_time(Bounds::fixed(0.0))
        .final_time(Bounds::fixed(1.0))
}

fn ocp(arc: Phase) -> Ocp {
    Ocp::builder("features").phase(arc).minimize_integral("arc", "cost").build().expect("well-posed")
}

/// A constant rate, which is optimal without a pulse; with the objective as it is with one of this height.
fn straight(height: f64) -> Trajectory {
    let breaks = breaks(0.0, 1.0, 10);
    let arc = phase("arc", &breaks, 4, |_, t| vec![t], |_, _| vec![1.0], |_, _| vec![-2.0]);
    trajectory(vec![arc], 1.0 + height * WIDTH * std::f64::consts::PI.sqrt())
}

#[test]
fn a_cost_between_the_nodes_is_seen() {
    let no_pulse = ocp(arc(Gain { jumps: false }, Cost { height: 0.0 }));
    assert!(certify(&no_pulse, &straight(0.0)).verdict >= Verdict::StrictLocalOptimum);
    let pulse = ocp(arc(Gain { jumps: false }, Cost { height: 1e4 }));
    let certificate = certify(&pulse, &straight(1e4));
    // The integral is that with the pulse, and another control would cost less there.
    assert_eq!(certificate.verdict, Verdict::Feasible, "{certificate:#?}");
    let unseen = certify(&pulse, &straight(0.0));
    assert_eq!(unseen.verdict, Verdict::Rejected);
}

#[test]
fn a_limit_between_the_nodes_is_seen() {
    let limited = |most| {
        let row = Variable::new("pulse", "-").at_most(most).scaled_by(1.0);
        ocp(arc(Gain { jumps: false }, Cost { height: 0.0 }).path([row], Pulse))
    };
    let settings = VerifySettings::default();
    let worst = |most| {
        let found = verify(&limited(most), &straight(0.0), &settings).expect("it fits").certificate;
        let check = found.checks.into_iter().find(|c| c.name.starts_with("pulse along")).expect("a check");
        (check.passed, check.value)
    };
    assert!(worst(1.0 + settings.path_tolerance).0);
    let (passed, value) = worst(0.5);
    assert!(!passed && (value - 0.5).abs() < settings.path_tolerance, "{value}");
}

#[test]
fn both_sides_of_a_jump_are_looked_at_on_their_own() {
    let ocp = ocp(arc(Gain { jumps: true }, Cost { height: 0.0 }));
    // u is as the gain g, and x(1) = 1 is its integral of g^2.
    let most = 1.0 / (JUMP + 4.0 * (1.0 - JUMP));
    let with_corner_at = |corner: f64| {
        let breaks = [0.0, 0.5 * corner, corner, 0.6, 0.8, 1.0];
        let behind = |k: usize| k >= 2;
        let arc = phase(
            "arc",
            &breaks,
            3,
            |_, t| vec![most * (t.min(JUMP) + 4.0 * (t - JUMP).max(0.0))],
            |k, _| vec![if behind(k) { 2.0 * most } else { most }],
            |_, _| vec![-2.0 * most],
        );
        certify(&ocp, &trajectory(vec![arc], most)).verdict
    };
    assert!(with_corner_at(JUMP) >= Verdict::StrictLocalOptimum);
    // Rounding of the time of the corner is none.
    for rounding in [1e-15, -1e-15] {
        assert!(with_corner_at(JUMP + rounding) >= Verdict::StrictLocalOptimum);
    }
    assert_eq!(with_corner_at(JUMP + 0.05), Verdict::Rejected);
}
