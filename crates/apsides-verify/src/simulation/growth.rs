//! Times at which the flight of an unstable plant starts anew from its trajectory.
//!
//! ```text
//! M' = S^-1 f_x(x(t), u(t)) S M,  M = 1 at a start;   growth = ||M||,  S the scales of the states
//! ```
//!
//! An error of 1e-9 in its controls grows with an unstable plant beyond every tolerance, whatever the method that found them: no trajectory of it can be
//! flown without feedback. Its parts between times until which errors grow a hundredfold can.

use std::cell::RefCell;

use apsides_ocp::PhaseTrajectory;
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};
use nalgebra::DMatrix;

use crate::equations::Equations;

/// Growth of an error from which on a flight may start anew.
const GROWN: f64 = 1e2;
/// Accuracy of the growth, of which the size alone is asked.
const ACCURACY: f64 = 1e-3;
const MAX_STEPS: usize = 10_000;

/// The places at which a flight may start anew.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Places {
    /// Ends of the intervals of the controls.
    Breaks,
    /// Nodes of the states too.
    Nodes,
}

/// Times of starts beside the first, each with the growth since the earlier one; none where errors do not grow so much, or nobody can say.
pub(super) fn starts(
    equations: Equations<'_>,
    found: &PhaseTrajectory,
    scales: &[f64],
    places: Places,
) -> Vec<(f64, f64)> {
    try_starts(equations, found, scales, places).unwrap_or_default()
}

fn try_starts(
    equations: Equations<'_>,
    found: &PhaseTrajectory,
    scales: &[f64],
    places: Places,
) -> Option<Vec<(f64, f64)>> {
    let (nx, nu, width) = (equations.nx, equations.nu, equations.width());
    let settings = OdeSettings {
        relative_tolerance: ACCURACY,
        absolute_tolerance: Tolerance::Scalar(ACCURACY),
        max_steps: MAX_STEPS,
        stiffness_interval: None,
        ..OdeSettings::default()
    };
    let mut integrator = Integrator::new(nx * nx, settings).ok()?;
    let (breaks, legs) = (found.control.breaks(), found.control.segments().len());
    let zeros = |n: usize| vec![0.0; n];
    let scratch = RefCell::new((zeros(nx), zeros(nu), zeros(nx), zeros(nx * width), equations));
    let identity = DMatrix::<f64>::identity(nx, nx);
    let (mut columns, mut next) = (identity.clone(), identity.clone());
    let mut starts = Vec::new();
    for leg in 0..legs {
        let system = FnSystem::new(nx * nx, |t: f64, m: &[f64], rates: &mut [f64]| {
            let (x, u, f, jacobian, equations) = &mut *scratch.borrow_mut();
            let t = found.control.within(leg, t);
            found.control.evaluate_in(leg, t, u);
            found.state.evaluate(t, x);
            equations.set(t, x, u);
            equations.dynamics_jacobian(f, jacobian);
            for (column, rates) in m.chunks_exact(nx).zip(rates.chunks_exact_mut(nx)) {
                for (i, rate) in rates.iter_mut().enumerate() {
                    let row = jacobian[i * width..].iter().zip(scales).zip(column);
                    *rate = row.map(|((a, scale), m)| a * scale * m).sum::<f64>() / scales[i];
                }
            }
        });
        let mut at = breaks[leg];
        for t in candidates(found, breaks[leg], breaks[leg + 1], places) {
            let flown = integrator.integrate(&system, at, columns.as_slice(), t, next.as_mut_slice()).ok()?;
            if flown.status != Status::Completed {
                return None;
            }
            columns.copy_from(&next);
            at = t;
            let growth = columns.row_iter().map(|row| row.iter().map(|m| m.abs()).sum()).fold(0.0, f64::max);
            if growth >= GROWN && t < breaks[legs] {
                starts.push((t, growth));
                columns.copy_from(&identity);
            }
        }
    }
    Some(starts)
}

/// Such places within an interval of the controls, and its end.
fn candidates(found: &PhaseTrajectory, start: f64, end: f64, places: Places) -> Vec<f64> {
    let nodes = (0..found.state.segments().len()).flat_map(|s| found.state.node_times(s));
    let inner = nodes.filter(|t| places == Places::Nodes && *t > start && *t < end);
    let mut times: Vec<f64> = inner.chain([end]).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}
