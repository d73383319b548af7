//! Times at which the flight of an unstable plant starts anew beside its trajectory, and what its controls can reach until then.
//!
//! ```text
//! M' = A M,  M = 1       W' = A W + W A' + B B',  W = 0       A = S^-1 f_x S,  B = S^-1 f_u R       at a start
//! growth = spectral radius of M,     least mean square of (du / R) that moves the end by S d:   d' W^-1 d / duration
//! ```
//!
//! An error of 1e-9 in its controls grows with an unstable plant beyond every tolerance, whatever the method that found them: no trajectory of it can be
//! flown without feedback. Its parts between times until which errors grow a hundredfold can, and feedback joins them: by as little as a change of the
//! controls (scales `R`) needs that leads from the state flown to the stated one (T. Kailath, Linear Systems, Prentice-Hall 1980, section 9.2: the
//! controllability Gramian `W`). What no small change reaches stays as it is flown.

use std::cell::RefCell;

use apsides_ocp::{PhaseScaling, PhaseTrajectory};
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};
use nalgebra::{DMatrix, DMatrixView, DVector, Schur};

use super::Restart;
use crate::equations::Equations;

/// Growth of an error from which on a flight may start anew.
const GROWN: f64 = 1e2;
/// Accuracy of growth and reach.
const ACCURACY: f64 = 1e-9;
/// Part of the largest eigenvalue of a Gramian below which one is none.
const REACHED: f64 = 1e-6;
const MAX_STEPS: usize = 10_000;
const MAX_EIGENVALUE_STEPS: usize = 1_000;

/// The places at which a flight may start anew.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Places {
    /// Ends of the intervals of the controls.
    Breaks,
    /// Nodes of the states too.
    Nodes,
}

/// A time until which errors have grown, or the end of the phase.
pub(super) struct Start {
    pub(super) time: f64,
    /// The growth since the start before.
    pub(super) growth: f64,
    reach: Reach,
}

/// The changes of states that controls make over a piece.
struct Reach {
    scales: Vec<f64>,
    duration: f64,
    /// Directions, and the eigenvalue of the Gramian for each.
    vectors: DMatrix<f64>,
    values: DVector<f64>,
}

impl Start {
    /// Moves the state flown towards the stated one, as far as changes of the controls of at most `most` can: root of the mean square, relative to
    /// their scales.
    pub(super) fn join(&self, flown: &mut [f64], stated: &[f64], most: f64) -> Restart {
        let before = flown.to_vec();
        let Reach { scales, duration, vectors, values } = &self.reach;
        let missing = flown.iter().zip(stated).zip(scales).map(|((flown, stated), s)| (stated - flown) / s);
        let along = vectors.transpose() * DVector::from_iterator(scales.len(), missing);
        let largest = values.amax();
        let mut squares = 0.0;
        for (k, (part, value)) in along.iter().zip(values.iter()).enumerate() {
            let square = part * part / (value * duration);
            if *value > REACHED * largest && squares + square <= most * most {
                squares += square;
                for ((x, direction), scale) in flown.iter_mut().zip(vectors.column(k).iter()).zip(scales) {
                    *x += part * direction * scale;
                }
            }
        }
        let jump = before.iter().zip(&*flown).map(|(before, after)| before - after).collect();
        Restart { time: self.time, growth: self.growth, jump, change: squares.sqrt() }
    }
}

/// Times of starts beside the first, and the end of the phase; none where errors do not grow so much, or nobody can say.
pub(super) fn starts(
    equations: Equations<'_>,
    found: &PhaseTrajectory,
    scaling: &PhaseScaling,
    places: Places,
) -> Vec<Start> {
    let starts = try_starts(equations, found, scaling, places).unwrap_or_default();
    if starts.len() > 1 { starts } else { Vec::new() }
}

fn try_starts(
    equations: Equations<'_>,
    found: &PhaseTrajectory,
    scaling: &PhaseScaling,
    places: Places,
) -> Option<Vec<Start>> {
    let (nx, nu, width) = (equations.nx, equations.nu, equations.width());
    let settings = OdeSettings {
        relative_tolerance: ACCURACY,
        absolute_tolerance: Tolerance::Scalar(ACCURACY),
        max_steps: MAX_STEPS,
        stiffness_interval: None,
        ..OdeSettings::default()
    };
    let mut integrator = Integrator::new(2 * nx * nx, settings).ok()?;
    let (breaks, legs) = (found.control.breaks(), found.control.segments().len());
    let zeros = |n: usize| vec![0.0; n];
    let point = (zeros(nx), zeros(nu), zeros(nx), zeros(nx * width));
    let linear = (DMatrix::zeros(nx, nx), DMatrix::zeros(nx, nu), DMatrix::zeros(nx, nx));
    let scratch = RefCell::new((point, linear, equations));
    // By columns: M, then W.
    let mut start = zeros(2 * nx * nx);
    (0..nx).for_each(|i| start[i * nx + i] = 1.0);
    let (mut both, mut next) = (start.clone(), start.clone());
    let (mut starts, mut since) = (Vec::new(), breaks[0]);
    for leg in 0..legs {
        let system = FnSystem::new(2 * nx * nx, |t: f64, both: &[f64], rates: &mut [f64]| {
            let ((x, u, f, jacobian), (a, b, rate), equations) = &mut *scratch.borrow_mut();
            let t = found.control.within(leg, t);
            found.control.evaluate_in(leg, t, u);
            found.state.evaluate(t, x);
            equations.set(t, x, u);
            equations.dynamics_jacobian(f, jacobian);
            let (states, controls) = (&scaling.states, &scaling.controls);
            for i in 0..nx {
                let row = &jacobian[i * width..];
                (0..nx).for_each(|j| a[(i, j)] = row[j] * states[j] / states[i]);
                (0..nu).for_each(|j| b[(i, j)] = row[nx + j] * controls[j] / states[i]);
            }
            a.mul_to(&DMatrixView::from_slice(&both[..nx * nx], nx, nx), rate);
            rates[..nx * nx].copy_from_slice(rate.as_slice());
            a.mul_to(&DMatrixView::from_slice(&both[nx * nx..], nx, nx), rate);
            let of_reach = &mut rates[nx * nx..];
            for i in 0..nx {
                for j in 0..nx {
                    of_reach[j * nx + i] = rate[(i, j)] + rate[(j, i)] + b.row(i).dot(&b.row(j));
                }
            }
        });
        let mut at = breaks[leg];
        for t in candidates(found, breaks[leg], breaks[leg + 1], places) {
            let flown = integrator.integrate(&system, at, &both, t, &mut next).ok()?;
            if flown.status != Status::Completed {
                return None;
            }
            both.copy_from_slice(&next);
            at = t;
            let is_last = t >= breaks[legs];
            let growth = growth(DMatrix::from_column_slice(nx, nx, &both[..nx * nx]))?;
            if growth >= GROWN || is_last {
                let gramian = DMatrix::from_column_slice(nx, nx, &both[nx * nx..]);
                let reach = Reach::new(gramian, &scaling.states, t - since)?;
                starts.push(Start { time: t, growth, reach });
                both.copy_from_slice(&start);
                since = t;
            }
        }
    }
    Some(starts)
}

impl Reach {
    fn new(gramian: DMatrix<f64>, scales: &[f64], duration: f64) -> Option<Self> {
        if gramian.iter().any(|w| !w.is_finite()) {
            return None;
        }
        let eigen = gramian.symmetric_eigen();
        Some(Self {
            scales: scales.to_vec(),
            duration,
            vectors: eigen.eigenvectors,
            values: eigen.eigenvalues,
        })
    }
}

/// The spectral radius: a shear, such as that of a place by its speed, is no growth, whatever the scales. One where it is below [`GROWN`] for sure.
fn growth(columns: DMatrix<f64>) -> Option<f64> {
    let norm = columns.row_iter().map(|row| row.iter().map(|m| m.abs()).sum()).fold(0.0, f64::max);
    if norm < GROWN {
        return Some(1.0);
    }
    if columns.iter().any(|m| !m.is_finite()) {
        return None;
    }
    let schur = Schur::try_new(columns, f64::EPSILON, MAX_EIGENVALUE_STEPS)?;
    Some(schur.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max))
}

/// Such places within an interval of the controls, and its end.
fn candidates(found: &PhaseTrajectory, start: f64, end: f64, places: Places) -> Vec<f64> {
    let segments = found.state.segment_at(start)..=found.state.segment_at(end);
    let nodes = segments.flat_map(|s| found.state.node_times(s));
    let inner = nodes.filter(|t| places == Places::Nodes && *t > start && *t < end);
    let mut times: Vec<f64> = inner.chain([end]).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}
