//! Estimate of the distance of the curves from the problem between the collocation points.
//!
//! On each segment the residual of every equation of motion, `d/dt X(jet) - f(X, U, p, t)`, is integrated by a Gauss rule finer than
//! the collocation, and compared with the size of the state; what a state jumps by at the segment's start is added. So a lost sign
//! is seen too: thrust reversed by a squared residual satisfies the flat residual and not the equations of motion.
//! Integrals are compared with those of a finer rule.

use std::sync::Arc;

use apsides_basis::{BasisError, Gauss, MAX_POINTS};
use apsides_ocp::{Bounds, Ocp, Phase, PhaseScaling};

use crate::curve::{Curve, PhaseSplines};
use crate::rows::Active;
use crate::{FlatSystem, FlatnessError, FlatnessSettings};

/// The errors of one phase, and the bounds that it exceeds.
#[derive(Clone, Debug)]
pub(crate) struct PhaseEstimate {
    /// Relative error of each segment; an excess of a bound at its tolerance counts as much as an error at its own.
    pub(crate) errors: Vec<f64>,
    /// Bounds that are exceeded somewhere.
    pub(crate) exceeded: Active,
}

/// The larger of two errors; a NaN counts as largest.
fn raise(error: &mut f64, found: f64) {
    *error = if found <= *error { *error } else { found };
}

/// Largest of several errors, NaN if one is NaN.
pub(crate) fn largest(errors: impl IntoIterator<Item = f64>) -> f64 {
    errors.into_iter().fold(0.0, |a, e| if e <= a { a } else { e })
}

pub(crate) fn estimate(
    ocp: &Ocp,
    index: usize,
    system: &FlatSystem,
    splines: &PhaseSplines,
    times: (f64, f64),
    parameters: &[f64],
    scales: &PhaseScaling,
    settings: &FlatnessSettings,
) -> Result<PhaseEstimate, FlatnessError> {
    let phase = &ocp.phases[index];
    let order = splines.bases.iter().map(apsides_basis::Bspline::order).max().unwrap_or(1);
    let named = |source| FlatnessError::Basis { place: format!("phase `{}`", phase.name), source };
    let rule = Gauss::shared((order + 2).min(MAX_POINTS)).map_err(named)?;
    let mut curve = Curve::new(system, splines, times, parameters);
    let mut bounds = BoundScan::new(phase, scales, settings);
    let (nx, nu, m) = (phase.states.len(), phase.controls.len(), rule.points());
    let duration = times.1 - times.0;
    let mut sizes = scales.states.clone();
    // Before they are divided by sizes, which the whole phase decides: one row of states per segment.
    let mut misses = vec![0.0_f64; splines.breaks.len().saturating_sub(1) * nx];
    let mut excesses = vec![0.0_f64; splines.breaks.len() - 1];
    let (mut rates, mut f) = (vec![0.0; nx], vec![0.0; nx]);
    let mut inputs = vec![0.0; phase.dynamics.inputs()];
    let mut residuals = vec![0.0; m * nx];
    let mut before = vec![0.0; nx];
    for (k, w) in splines.breaks.windows(2).enumerate() {
        let half = 0.5 * (w[1] - w[0]);
        let miss = &mut misses[k * nx..(k + 1) * nx];
        let start = curve.quantities(k, w[0]);
        if k > 0 {
            miss.iter_mut().zip(start).zip(&before).for_each(|((e, a), b)| raise(e, (a - b).abs()));
        }
        for (node, row) in rule.nodes().iter().zip(residuals.chunks_mut(nx.max(1))) {
            let fraction = w[0] + half * (node + 1.0);
            let t = curve.time(fraction);
            let q = curve.with_rates(k, fraction, &mut rates);
            for (size, v) in sizes.iter_mut().zip(q) {
                *size = size.max(v.abs());
            }
            fill(&mut inputs, &q[..nx + nu], parameters, t);
            phase.dynamics.value(&inputs, &mut f);
            for ((r, rate), f) in row.iter_mut().zip(&rates).zip(&f) {
                *r = rate - f;
            }
            raise(&mut excesses[k], bounds.excess(&q[..nx + nu], parameters, t));
        }
        let ends = rule.integration().chunks(m).chain(std::iter::once(rule.weights()));
        for row in ends {
            for s in 0..nx {
                let sum: f64 = row.iter().enumerate().map(|(l, a)| a * residuals[l * nx + s]).sum();
                raise(&mut miss[s], (half * duration * sum).abs());
            }
        }
        before.copy_from_slice(&curve.quantities(k, w[1])[..nx]);
    }
    let integrals = integral_errors(phase, &mut curve, splines, duration, parameters).map_err(named)?;
    let weight = settings.tolerance / settings.path_tolerance;
    let integral_weight = settings.tolerance / settings.objective_tolerance;
    let errors = excesses.iter().enumerate().map(|(k, excess)| {
        let relative = misses[k * nx..(k + 1) * nx].iter().zip(&sizes).map(|(e, s)| e / s);
        largest(relative.chain([weight * excess, integral_weight * integrals[k]]))
    });
    Ok(PhaseEstimate { errors: errors.collect(), exceeded: bounds.exceeded })
}

/// Difference of each integral on each segment between the rule of the discretised problem and two halves of it, relative to the
/// whole integral of the absolute value; the largest per segment.
fn integral_errors(
    phase: &Phase,
    curve: &mut Curve<'_>,
    splines: &PhaseSplines,
    duration: f64,
    parameters: &[f64],
) -> Result<Vec<f64>, BasisError> {
    let mut errors = vec![0.0_f64; splines.breaks.len() - 1];
    if phase.integrals.is_empty() {
        return Ok(errors);
    }
    let order = splines.bases.iter().map(apsides_basis::Bspline::order).max().unwrap_or(1);
    let rule = quadrature(order)?;
    let base = phase.states.len() + phase.controls.len();
    for integral in &phase.integrals {
        let mut inputs = vec![0.0; integral.function.inputs()];
        // Value and value of the absolute integrand.
        let mut sum = |k: usize, from: f64, to: f64| {
            let half = 0.5 * (to - from);
            let (mut value, mut size, mut g) = (0.0, 0.0, [0.0]);
            for (node, w) in rule.nodes().iter().zip(rule.weights()) {
                let fraction = from + half * (node + 1.0);
                let t = curve.time(fraction);
                fill(&mut inputs, &curve.quantities(k, fraction)[..base], parameters, t);
                integral.function.value(&inputs, &mut g);
                value += half * duration * w * g[0];
                size += half * duration * w * g[0].abs();
            }
            (value, size)
        };
        let mut total = integral.variable.scale.unwrap_or(0.0);
        let mut differences = Vec::with_capacity(errors.len());
        for (k, w) in splines.breaks.windows(2).enumerate() {
            let middle = 0.5 * (w[0] + w[1]);
            let (whole, (a, size_a), (b, size_b)) =
                (sum(k, w[0], w[1]), sum(k, w[0], middle), sum(k, middle, w[1]));
            total += size_a + size_b;
            differences.push((whole.0 - a - b).abs());
        }
        for (error, d) in errors.iter_mut().zip(differences) {
            raise(error, if total > 0.0 { d / total } else { 0.0 });
        }
    }
    Ok(errors)
}

/// The rule for integrals on a segment: exact where the integrand is a polynomial of four times the degree of the splines, since
/// between the points of a coarse one an optimum hides what costs most.
pub(crate) fn quadrature(order: usize) -> Result<Arc<Gauss>, BasisError> {
    Gauss::shared((2 * order).min(MAX_POINTS))
}

/// Inputs `[x, u, p, t]` of a function of the phase, with all parameters or none.
fn fill(inputs: &mut [f64], quantities: &[f64], parameters: &[f64], t: f64) {
    let base = quantities.len();
    inputs[..base].copy_from_slice(quantities);
    let count = inputs.len() - base - 1;
    inputs[base..base + count].copy_from_slice(&parameters[..count]);
    inputs[base + count] = t;
}

/// Bounds and path constraints between the points.
struct BoundScan<'a> {
    phase: &'a Phase,
    scales: &'a PhaseScaling,
    tolerance: f64,
    /// For each path function: true if it is free of controls.
    without_controls: Vec<bool>,
    inputs: Vec<f64>,
    values: Vec<f64>,
    exceeded: Active,
}

impl<'a> BoundScan<'a> {
    fn new(phase: &'a Phase, scales: &'a PhaseScaling, settings: &FlatnessSettings) -> Self {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let path = phase.path.iter();
        let without_controls = path
            .clone()
            .map(|c| !c.function.pattern().columns.iter().any(|i| (nx..nx + nu).contains(i)))
            .collect();
        Self {
            phase,
            scales,
            tolerance: settings.path_tolerance,
            without_controls,
            inputs: Vec::new(),
            values: Vec::new(),
            exceeded: Active {
                states: vec![false; nx],
                controls: vec![false; nu],
                path: path.map(|c| vec![false; c.rows.len()]).collect(),
            },
        }
    }

    /// Largest relative excess at one point of bounds on states and of path rows without controls: next to a jump of a control a
    /// spline oversteps the bounds of controls on any mesh. Notes every bound that is exceeded, those of controls too.
    fn excess(&mut self, quantities: &[f64], parameters: &[f64], t: f64) -> f64 {
        let nx = self.phase.states.len();
        let mut worst = 0.0;
        let tolerance = self.tolerance;
        let relative = |bounds: &Bounds, v: f64, scale: f64| bounds.excess(v) / scale;
        let (x, u) = quantities.split_at(nx);
        for (k, (state, v)) in self.phase.states.iter().zip(x).enumerate() {
            let e = relative(&state.variable.bounds, *v, self.scales.states[k]);
            raise(&mut worst, e);
            self.exceeded.states[k] |= e > tolerance;
        }
        for (k, (control, v)) in self.phase.controls.iter().zip(u).enumerate() {
            self.exceeded.controls[k] |= relative(&control.bounds, *v, self.scales.controls[k]) > tolerance;
        }
        for (c, constraint) in self.phase.path.iter().enumerate() {
            self.inputs.resize(constraint.function.inputs(), 0.0);
            self.values.resize(constraint.rows.len(), 0.0);
            fill(&mut self.inputs, quantities, parameters, t);
            constraint.function.value(&self.inputs, &mut self.values);
            for (r, (row, v)) in constraint.rows.iter().zip(&self.values).enumerate() {
                let e = relative(&row.bounds, *v, row.size().unwrap_or(1.0));
                if self.without_controls[c] {
                    raise(&mut worst, e);
                }
                self.exceeded.path[c][r] |= e > tolerance;
            }
        }
        worst
    }
}
