//! Trajectories from closed forms.

use std::sync::Arc;

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_basis::{Barycentric, Lgr};
use apsides_ocp::{PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory, Variable};

/// `x'' = u`.
pub(super) struct DoubleIntegrator;
impl Dynamics<2, 1> for DoubleIntegrator {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// `u^2 / 2`.
pub(super) struct Energy;
impl PathFunction<2, 1, 1> for Energy {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0] * 0.5]
    }
}

pub(super) fn energy() -> Variable {
    Variable::new("energy", "m2/s3")
}

/// Values of `f(interval, t)` at the nodes of each interval.
pub(super) fn polynomial(
    dimension: usize,
    breaks: &[f64],
    nodes: &[f64],
    f: impl Fn(usize, f64) -> Vec<f64>,
) -> PiecewisePolynomial {
    let basis = Arc::new(Barycentric::new(nodes).expect("distinct nodes"));
    let segments = breaks.windows(2).enumerate().map(|(k, w)| {
        let values: Vec<f64> =
            nodes.iter().flat_map(|s| f(k, w[0] + 0.5 * (w[1] - w[0]) * (s + 1.0))).collect();
        Segment { basis: basis.clone(), values }
    });
    PiecewisePolynomial::new(dimension, breaks.to_vec(), segments.collect()).expect("valid pieces")
}

/// A phase on `breaks` with `points` Radau points in each interval; functions of interval and time.
pub(super) fn phase(
    name: &str,
    breaks: &[f64],
    points: usize,
    x: impl Fn(usize, f64) -> Vec<f64>,
    u: impl Fn(usize, f64) -> Vec<f64>,
    costate: impl Fn(usize, f64) -> Vec<f64>,
) -> PhaseTrajectory {
    let lgr = Lgr::new(points).expect("valid points");
    let (t0, tf) = (breaks[0], breaks[breaks.len() - 1]);
    let intervals = breaks.len() - 1;
    PhaseTrajectory {
        name: name.into(),
        initial_time: t0,
        final_time: tf,
        mesh: PhaseMesh::uniform(intervals, points).expect("valid mesh"),
        state: polynomial(x(0, t0).len(), breaks, lgr.support(), &x),
        control: polynomial(u(0, t0).len(), breaks, lgr.nodes(), &u),
        costate: Some(polynomial(x(0, t0).len(), breaks, lgr.support(), &costate)),
        path_multipliers: None,
        contacts: Vec::new(),
        integral_multipliers: None,
        interval_errors: vec![0.0; intervals],
    }
}

/// Multipliers of path constraints on the nodes of the control.
pub(super) fn multipliers(
    trajectory: &PhaseTrajectory,
    rows: usize,
    f: impl Fn(usize, f64) -> Vec<f64>,
) -> PiecewisePolynomial {
    let control = &trajectory.control;
    polynomial(rows, control.breaks(), control.segments()[0].basis.nodes(), f)
}

pub(super) fn trajectory(phases: Vec<PhaseTrajectory>, objective: f64) -> Trajectory {
    Trajectory { phases, parameters: vec![], objective, constraint_multipliers: Some(vec![]) }
}

pub(super) fn breaks(t0: f64, tf: f64, intervals: usize) -> Vec<f64> {
    (0..=intervals)
        .map(|k| if k == intervals { tf } else { t0 + (tf - t0) * k as f64 / intervals as f64 })
        .collect()
}
