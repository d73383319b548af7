//! Layers and limits that hold along a short way, passed by trajectories with nodes and steps far apart; arcs along bounds whose multiplier has
//! the wrong sign.

use super::certify;
use super::parts::{breaks, phase, trajectory};
use crate::Verdict;
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::passed_features::{Among, passed_unseen};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Place and width of the layer, on a way of 100.
const PLACE: f64 = 37.3;
const WIDTH: f64 = 0.02;
/// The layer is less than a thousandth of its height beyond 2.63 widths on both sides; in time, which is far below the distance of nodes.
const SHORT: f64 = 6.0 * WIDTH / 100.0;

/// `x' = u - height exp(-((x - PLACE)/WIDTH)^2)`.
struct Layer {
    height: f64,
}
impl Dynamics<1, 1> for Layer {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        if self.height == 0.0 {
            return [u[0]];
        }
        let layer = (-((x[0] - PLACE) * WIDTH.recip()).square()).exp() * self.height;
        [u[0] - layer]
    }
}

/// `u^2`
struct Effort;
impl PathFunction<1, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0]]
    }
}

/// The layer itself, as a limit.
struct Wall;
impl PathFunction<1, 1, 1> for Wall {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(-((x[0] - PLACE) * WIDTH.recip()).square()).exp()]
    }
}

fn way(height: f64, has_wall: bool) -> Ocp {
    let phase = Phase::new("way", Layer { height })
        .states([State::new("x", "m").starts_at(0.0).ends_at(100.0)])
        .controls([Variable::new("u", "m/s")])
        .integral(Variable::new("effort", "-"), Effort)
        .final_time(Bounds::fixed(1.0));
    let phase = if has_wall { phase.path([Variable::new("wall", "-").at_most(0.5)], Wall) } else { phase };
    Ocp::builder("way").phase(phase).minimize_integral("way", "effort").build().expect("well-posed")
}

/// Through the layer as if there were none.
fn straight() -> Trajectory {
    let ends = breaks(0.0, 1.0, 10);
    let way = phase("way", &ends, 4, |_, t| vec![100.0 * t], |_, _| vec![100.0], |_, _| vec![-200.0]);
    trajectory(vec![way], 1e4)
}

#[test]
fn a_layer_between_nodes_and_steps_is_seen() {
    assert_eq!(certify(&way(0.0, false), &straight()).verdict, Verdict::GlobalOptimum);
    assert_eq!(certify(&way(3000.0, false), &straight()).verdict, Verdict::Rejected);
    // One that holds nothing back is none.
    assert!(certify(&way(1e-9, false), &straight()).verdict >= Verdict::Extremal);
}

#[test]
fn a_wall_between_nodes_is_seen() {
    assert_eq!(certify(&way(0.0, true), &straight()).verdict, Verdict::Rejected);
}

#[test]
fn the_ends_found_enclose_the_layer() {
    for (ocp, among) in [(way(3000.0, false), Among::All), (way(0.0, true), Among::PathConstraints)] {
        let times = &passed_unseen(&ocp, &straight(), among)[0];
        let (first, last) = (times[0], times[times.len() - 1]);
        assert!((first..=last).contains(&(PLACE / 100.0)), "{times:?}");
        assert!(last - first < SHORT, "{times:?}");
        assert!(times.windows(2).all(|w| w[0] < w[1]), "{times:?}");
    }
    assert!(passed_unseen(&way(3000.0, false), &straight(), Among::PathConstraints)[0].is_empty());
    assert!(passed_unseen(&way(0.0, false), &straight(), Among::All)[0].is_empty());
}

/// An oscillator between equal heights, along its ceiling in the middle.
struct Oscillator;
impl Dynamics<2, 1> for Oscillator {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - x[0]]
    }
}

struct HalfEffort;
impl PathFunction<2, 1, 1> for HalfEffort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0] * 0.5]
    }
}

/// Along the ceiling the control that holds the oscillator is 1, its costate -1, and the multiplier of the ceiling -1: the sum of it and of the
/// impulse at the end of the arc, which lasts less than that impulse is large, is positive.
#[test]
fn an_impulse_at_the_end_of_an_arc_hides_no_multiplier_of_the_wrong_sign() {
    // The extremal with u(t) = -lambda_v through x = 1, v = 0 with u = 1: u = cos s + b sin s from the end of the arc on.
    let (arc, beyond, b) = (0.4, 0.5, -1.0);
    let half = 0.5 * arc;
    // x'' = -x + cos s + b sin s: x = cos s + (s sin s + b (sin s - s cos s))/2.
    let x = move |s: f64| s.cos() + 0.5 * (s * s.sin() + b * (s.sin() - s * s.cos()));
    let v = move |s: f64| -s.sin() + 0.5 * (s.sin() + s * s.cos() + b * s * s.sin());
    let u = move |s: f64| s.cos() + b * s.sin();
    // lambda_v' = -lambda_x: lambda_x = u'.
    let lambda_x = move |s: f64| -s.sin() + b * s.cos();
    let ends = [-half - beyond, -half, half, half + beyond];
    let side = move |k: usize, t: f64| match k {
        0 => (-t - half, -1.0),
        1 => (0.0, 0.0),
        _ => (t - half, 1.0),
    };
    let state = move |k: usize, t: f64| {
        let (s, sign) = side(k, t);
        vec![x(s), sign * v(s)]
    };
    let control = move |k: usize, t: f64| vec![u(side(k, t).0)];
    let costate = move |k: usize, t: f64| {
        let (s, sign) = side(k, t);
        vec![sign * lambda_x(s), -u(s)]
    };
    let way = phase("swing", &ends, 12, state, control, costate);
    let (first, last) = (way.state_at(ends[0]), way.final_state());
    let posed = Phase::new("swing", Oscillator)
        .states([
            State::new("x", "-").at_most(1.0).starts_at(first[0]).ends_at(last[0]),
            State::new("v", "-").starts_at(first[1]).ends_at(last[1]),
        ])
        .controls([Variable::new("u", "-")])
        .integral(Variable::new("effort", "-"), HalfEffort)
        .initial_time(Bounds::fixed(ends[0]))
        .final_time(Bounds::fixed(ends[3]));
    let ocp = Ocp::builder("swing").phase(posed).minimize_integral("swing", "effort").build();
    let ocp = ocp.expect("well-posed");
    // The integral of (cos s + b sin s)^2 / 2 over both sides, and of 1/2 over the arc.
    let (sin, cos) = (beyond.sin(), beyond.cos());
    let square = 0.5 * (beyond + sin * cos) + b * sin * sin + 0.5 * b * b * (beyond - sin * cos);
    let certificate = certify(&ocp, &trajectory(vec![way], square + 0.5 * arc));
    assert_eq!(certificate.verdict, Verdict::Feasible);
    let failed: Vec<&str> = certificate.failures().map(|c| c.name.as_str()).collect();
    assert!(failed.contains(&"costate equation along swing"), "{failed:?}");
}
