//! One stage of an interval: derivatives over `[x, u, xi_a, xi_b, p]`, and what stands at a bound there.

use nalgebra::{DMatrix, DVector};

use super::activity::Activity;
use super::arcs::Span;
use apsides_ocp::{Bounds, State};

use crate::optimality::PhaseConditions;
use crate::worst::relative;

/// A row `r . v = 0` of an active constraint.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) gradient: DVector<f64>,
    pub(super) activity: Activity,
}

/// Multipliers of state bounds come from a derivative of the costate; smaller ones, relative, are not surely different from
/// zero.
const SURE: f64 = 1e-3;

/// Derivatives of the length of an arc by its ends.
const BY_LENGTH: [f64; 2] = [-1.0, 1.0];

/// Jacobian, Hessian and constraints at one stage over `[x, u, xi_a, xi_b, p]`.
pub(super) struct Stage {
    pub(super) rates: DMatrix<f64>,
    pub(super) curvature: DMatrix<f64>,
    pub(super) rows: Vec<Row>,
    pub(super) integrals: DMatrix<f64>,
    pub(super) controls: Vec<Activity>,
    pub(super) legendre: f64,
    pub(super) at_bounds: Vec<Activity>,
}

impl Stage {
    pub(super) fn new(
        conditions: &mut PhaseConditions<'_>,
        parameters: &[f64],
        span: Span,
        time: f64,
        duration: f64,
    ) -> Self {
        conditions.evaluate_within_bounds(span.segment, time);
        let slopes = Slopes::new(conditions, span, time);
        let coordinates = Coordinates::new(conditions, parameters, span, time, duration);
        let curvature = curvature(conditions, &coordinates);
        let (speeds, rates) = rates(conditions, &coordinates);
        let integrals = integrals(conditions, &coordinates);
        let controls = controls(conditions, &slopes, coordinates.length, &rates, &curvature);
        let mut rows = path_rows(conditions, &coordinates);
        let (at_bounds, state_rows) = states(conditions, &coordinates, &slopes, (time, &speeds));
        rows.extend(state_rows);
        let legendre = legendre(&curvature, &rates, &controls, &rows, duration / coordinates.length);
        Self { rates, curvature, rows, integrals, controls, legendre, at_bounds }
    }
}

/// The slopes that multipliers of bounds follow from.
struct Slopes {
    /// Slopes of the costates in time.
    costate_rate: Vec<f64>,
    /// Gradient of the Lagrangian, path constraints included, over `[x, u, p, t]`.
    lagrangian: Vec<f64>,
}

impl Slopes {
    /// At the point as it was evaluated.
    fn new(conditions: &PhaseConditions<'_>, span: Span, time: f64) -> Self {
        let mut costate_rate = vec![f64::NAN; conditions.equations.nx];
        if conditions.costate.segments().len() == conditions.found.control.segments().len() {
            conditions.costate.derivative_in(span.segment, time, &mut costate_rate);
        }
        Self { costate_rate, lagrangian: conditions.point.gradient.clone() }
    }
}

/// `[x, u, xi_a, xi_b, p]` at a time of an arc, to which derivatives over `[x, u, p, t]` are carried.
pub(super) struct Coordinates {
    /// Number of states and controls.
    before_ends: usize,
    /// Number of `[x, u, p]`.
    others: usize,
    scales: Vec<f64>,
    /// Length of the arc.
    length: f64,
    /// Derivatives of the time by the ends of the arc.
    by_time: [f64; 2],
    duration: f64,
}

impl Coordinates {
    pub(super) fn new(
        conditions: &PhaseConditions<'_>,
        parameters: &[f64],
        span: Span,
        time: f64,
        duration: f64,
    ) -> Self {
        let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
        let length = span.arc_end - span.arc_start;
        let theta = (time - span.arc_start) / length;
        let scaling = conditions.scaling;
        let scales = scaling.states[..nx].iter().chain(&conditions.control_scales[..nu]);
        let scales = scales.chain(&[duration, duration]).chain(&parameters[..np]).copied().collect();
        let by_time = [1.0 - theta, theta];
        Self { before_ends: nx + nu, others: nx + nu + np, scales, length, by_time, duration }
    }

    fn len(&self) -> usize {
        self.others + 2
    }

    /// Place of one of `[x, u, p]`.
    fn place(&self, k: usize) -> usize {
        if k < self.before_ends { k } else { k + 2 }
    }

    /// Places of the ends of the arc.
    fn ends(&self) -> [usize; 2] {
        [self.before_ends, self.before_ends + 1]
    }

    /// The gradient of a function of `[x, u, p, t]`, times the length of the arc if it is `timed`.
    pub(super) fn gradient(&self, value: f64, g: &[f64], timed: bool) -> DVector<f64> {
        let t = if timed { self.length } else { 1.0 };
        let mut out = DVector::zeros(self.len());
        for k in 0..self.others {
            out[self.place(k)] = t * g[k] * self.scales[self.place(k)];
        }
        for (a, end) in self.ends().into_iter().enumerate() {
            let through_length = if timed { BY_LENGTH[a] * value } else { 0.0 };
            out[end] = (through_length + t * g[self.others] * self.by_time[a]) * self.duration;
        }
        out
    }

    /// The Hessian of the length of the arc times a function of `[x, u, p, t]`, by its gradient and Hessian.
    fn hessian(&self, slope: &[f64], second: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
        let (t, ends, Self { length, by_time, .. }) = (self.others, self.ends(), self);
        let mut hessian = DMatrix::zeros(self.len(), self.len());
        for i in 0..t {
            for j in 0..t {
                hessian[(self.place(i), self.place(j))] = length * second(i, j);
            }
            for a in 0..2 {
                let mixed = BY_LENGTH[a] * slope[i] + length * second(i, t) * by_time[a];
                hessian[(self.place(i), ends[a])] = mixed;
                hessian[(ends[a], self.place(i))] = mixed;
            }
        }
        for a in 0..2 {
            for b in 0..2 {
                let through_length = (BY_LENGTH[a] * by_time[b] + BY_LENGTH[b] * by_time[a]) * slope[t];
                hessian[(ends[a], ends[b])] =
                    through_length + length * second(t, t) * by_time[a] * by_time[b];
            }
        }
        for i in 0..self.len() {
            for j in 0..self.len() {
                hessian[(i, j)] *= self.scales[i] * self.scales[j];
            }
        }
        hessian
    }
}

/// Hessian of `T H + mu . c`.
fn curvature(conditions: &mut PhaseConditions<'_>, coordinates: &Coordinates) -> DMatrix<f64> {
    let PhaseConditions { equations, point, .. } = conditions;
    let width = coordinates.others + 1;
    let zero = vec![0.0; point.multipliers.len()];
    let mut slope = vec![0.0; width];
    equations.lagrangian(&point.costate, &zero, &mut slope);
    let (mut hh, mut hc) = (vec![0.0; width * width], vec![0.0; width * width]);
    equations.curvature(&point.costate, &point.multipliers, &mut hh, &mut hc);
    coordinates.hessian(&slope, |i, j| hh[i * width + j] + hc[i * width + j])
}

/// The rates of the states, and their Jacobian times the length of the arc.
fn rates(conditions: &mut PhaseConditions<'_>, coordinates: &Coordinates) -> (Vec<f64>, DMatrix<f64>) {
    let (nx, width) = (conditions.equations.nx, coordinates.others + 1);
    let (mut values, mut jacobian) = (vec![0.0; nx], vec![0.0; nx * width]);
    conditions.equations.dynamics_jacobian(&mut values, &mut jacobian);
    let mut rates = DMatrix::zeros(nx, coordinates.len());
    for i in 0..nx {
        let row = coordinates.gradient(values[i], &jacobian[i * width..(i + 1) * width], true);
        rates.set_row(i, &(row / coordinates.scales[i]).transpose());
    }
    (values, rates)
}

/// Jacobian of the integrands times the length of the arc.
fn integrals(conditions: &mut PhaseConditions<'_>, coordinates: &Coordinates) -> DMatrix<f64> {
    let ni = conditions.equations.phase.integrals.len();
    let mut integrals = DMatrix::zeros(ni, coordinates.len());
    let mut gradient = vec![0.0; coordinates.others + 1];
    for q in 0..ni {
        let value = conditions.equations.integrand_gradient(q, &mut gradient);
        integrals.set_row(q, &coordinates.gradient(value, &gradient, true).transpose());
    }
    integrals
}

/// A control that changes states, relative to their scales, or the integral of the Hamiltonian, relative to its size, by less than this has no
/// effect by its derivatives: it gives its direction to a thrust that is zero but for what a barrier leaves.
const NOTHING: f64 = 1e-5;

/// The stand of each control to its bounds and kinks. A control without effect, as the direction of no thrust, is none.
fn controls(
    conditions: &mut PhaseConditions<'_>,
    slopes: &Slopes,
    length: f64,
    rates: &DMatrix<f64>,
    curvature: &DMatrix<f64>,
) -> Vec<Activity> {
    let (nx, nu) = (conditions.equations.nx, conditions.equations.nu);
    let bounds = conditions.equations.phase.controls.iter().map(|c| &c.bounds);
    let stands: Vec<Activity> = bounds
        .enumerate()
        .map(|(j, bounds)| {
            let scale = conditions.scaling.controls[j];
            let slope = relative(slopes.lagrangian[nx + j] * scale, conditions.hamiltonian_size);
            Activity::new(slope, conditions.point.u[j], bounds, scale)
        })
        .collect();
    let mut stands = stands;
    for (j, stand) in stands.iter_mut().enumerate() {
        if *stand == Activity::Strong {
            continue;
        }
        let (scale, of_curvature) = (conditions.scaling.controls[j], conditions.control_scales[j]);
        let bend = curvature[(nx + j, nx + j)] / (length * of_curvature * of_curvature);
        let slope = slopes.lagrangian[nx + j];
        let bounds = &conditions.equations.phase.controls[j].bounds;
        if is_kept_at_bound(slope, bend, conditions.point.u[j], bounds, conditions.hamiltonian_size) {
            *stand = Activity::Strong;
        } else if let Some([left, right]) = conditions.slopes_at_kink(j) {
            let least = relative(right.min(-left) * scale, conditions.hamiltonian_size);
            *stand = Activity::of_kink(least);
        }
    }
    let least_bend = NOTHING * conditions.hamiltonian_size * conditions.scaling.time;
    let has_slope = |j: usize| {
        let moves = (0..nx).any(|i| rates[(i, nx + j)].abs() > NOTHING);
        let bends = |k: usize| {
            let fixed = k >= nx && k < nx + nu && stands[k - nx] == Activity::Strong;
            !fixed && curvature[(nx + j, k)].abs() > least_bend
        };
        moves || (0..curvature.ncols()).any(bends)
    };
    let with_effect = |j: usize| {
        if has_slope(j) || conditions.has_effect(j) { stands[j] } else { Activity::Strong }
    };
    (0..nu).map(with_effect).collect()
}

/// Distance from a bound, relative to the width of the bounds, that a barrier may leave.
const LEFT_BY_BARRIER: f64 = 1e-6;
/// A change of the Hamiltonian over the width of the bounds, relative to its size, that is surely one.
const EVIDENT: f64 = 1e-4;
/// A slope that changes by less than this part up to the bound is the same there.
const CONSTANT: f64 = 1e-2;

/// True if a control is at a bound but for what a barrier leaves and pushes against it, whatever its scale: one that stays there all along
/// has no size but the width of its bounds. Before a stationary point inside, the slope would change up to the bound.
fn is_kept_at_bound(slope: f64, bend: f64, value: f64, bounds: &Bounds, size: f64) -> bool {
    let width = bounds.upper - bounds.lower;
    let room = if slope > 0.0 { value - bounds.lower } else { bounds.upper - value };
    width.is_finite()
        && room <= LEFT_BY_BARRIER * width
        && slope.abs() * width > EVIDENT * size
        && (bend * room).abs() <= CONSTANT * slope.abs()
}

/// The path constraints at a bound.
fn path_rows(conditions: &mut PhaseConditions<'_>, coordinates: &Coordinates) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut gradient = vec![0.0; coordinates.others + 1];
    let variables = conditions.equations.phase.path.iter().flat_map(|p| &p.rows);
    for (r, variable) in variables.enumerate() {
        let size = conditions.row_scales[r];
        let value = conditions.equations.row_gradient(r, &mut gradient);
        let slope = relative(-conditions.point.multipliers[r] * size, conditions.hamiltonian_size);
        let activity = Activity::new(slope, value, &variable.bounds, size);
        if activity != Activity::Free {
            rows.push(Row { gradient: coordinates.gradient(value, &gradient, false) / size, activity });
        }
    }
    rows
}

/// The stand of each state to its bounds, and a row for each that is at one.
fn states(
    conditions: &PhaseConditions<'_>,
    coordinates: &Coordinates,
    slopes: &Slopes,
    (time, speeds): (f64, &[f64]),
) -> (Vec<Activity>, Vec<Row>) {
    let phase_states = &conditions.equations.phase.states;
    let (mut at_bounds, mut rows) = (vec![Activity::Free; phase_states.len()], Vec::new());
    for (i, state) in phase_states.iter().enumerate() {
        let (value, bounds, scale) = (conditions.point.x[i], &state.variable.bounds, coordinates.scales[i]);
        if Activity::new(0.0, value, bounds, scale) == Activity::Free {
            continue;
        }
        // The multiplier is what the costate equation lacks.
        let multiplier = -slopes.costate_rate[i] - slopes.lagrangian[i];
        let slope = relative(-multiplier * scale, conditions.hamiltonian_size);
        let slope = if slope.abs() > SURE { slope } else { 0.0 };
        let activity = Activity::new(slope, value, bounds, scale);
        if activity == Activity::Weak && is_on_its_way(conditions, state, (time, value, speeds[i])) {
            continue;
        }
        let mut gradient = DVector::zeros(coordinates.len());
        gradient[i] = 1.0;
        at_bounds[i] = activity;
        rows.push(Row { gradient, activity: at_bounds[i] });
    }
    (at_bounds, rows)
}

/// Part of its distance from a bound that a state on its way there has to cover at its speed in the time that is left: all of it at a constant speed,
/// more where it slows down.
const LEAST_SHARE: f64 = 0.5;

/// True if a state near a bound comes down to it at the end of the phase, where it has to be at the bound, or leaves it from the start: along a bound
/// it would not move. So many rows as there are stages on the way, of which each next one says less of the controls, hide what curvature there is.
fn is_on_its_way(
    conditions: &PhaseConditions<'_>,
    state: &State,
    (time, value, speed): (f64, f64, f64),
) -> bool {
    let Bounds { lower, upper } = state.variable.bounds;
    let (bound, towards) = if value - lower <= upper - value { (lower, -1.0) } else { (upper, 1.0) };
    let distance = (value - bound).abs();
    let reaches = |end: Bounds, left: f64, sign: f64| {
        end.is_fixed()
            && end.lower == bound
            && sign * towards * speed * left >= LEAST_SHARE * distance
            && distance > 0.0
    };
    let found = conditions.found;
    reaches(state.terminal, found.final_time - time, 1.0)
        || reaches(state.initial, time - found.initial_time, -1.0)
}

/// Rates of a row of states in which a control is looked for.
const MOST_RATES: usize = 3;

/// The direction in the controls in which a row moves: that of the row itself or, for one of states, of its first rate with a control in
/// it. While the row stays at its bound it holds them there.
fn direction(row: &Row, rates: &DMatrix<f64>, nu: usize) -> DVector<f64> {
    let nx = rates.nrows();
    let mut by_states = row.gradient.rows(0, nx).into_owned();
    let mut by_controls = row.gradient.rows(nx, nu).into_owned();
    for _ in 0..MOST_RATES {
        if by_controls.iter().any(|v| *v != 0.0) {
            break;
        }
        by_controls = rates.columns(nx, nu).transpose() * &by_states;
        by_states = rates.columns(0, nx).transpose() * by_states;
    }
    by_controls
}

/// Least eigenvalue of `H_uu` of the whole phase's duration over the controls and along the rows that are not surely active.
fn legendre(
    curvature: &DMatrix<f64>,
    rates: &DMatrix<f64>,
    controls: &[Activity],
    rows: &[Row],
    factor: f64,
) -> f64 {
    let nx = rates.nrows();
    let free: Vec<usize> = (0..controls.len()).filter(|j| controls[*j] != Activity::Strong).collect();
    if free.is_empty() {
        return f64::INFINITY;
    }
    let n = free.len();
    let mut h = DMatrix::from_fn(n, n, |i, j| factor * curvature[(nx + free[i], nx + free[j])]);
    // Rows by Gram-Schmidt; their span is moved out of the way.
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for row in rows.iter().filter(|r| r.activity == Activity::Strong) {
        let along = direction(row, rates, controls.len());
        let mut g = DVector::from_fn(n, |i, _| along[free[i]]);
        let size = g.norm();
        for b in &basis {
            g -= b * b.dot(&g);
        }
        if g.norm() > 1e-8 * size && size > 0.0 {
            basis.push(g.normalize());
        }
    }
    if basis.len() == n {
        return f64::INFINITY;
    }
    let largest = h.amax().max(1.0);
    let mut projector = DMatrix::identity(n, n);
    for b in &basis {
        projector -= b * b.transpose();
    }
    h = &projector * h * &projector;
    for b in &basis {
        h += b * b.transpose() * (2.0 * largest * n as f64);
    }
    h.symmetric_eigenvalues().min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_that_stays_at_its_bound_is_kept_there_whatever_its_scale() {
        let unit = Bounds::new(0.0, 1.0);
        // What a barrier leaves of a part of the thrust, with a constant slope.
        assert!(is_kept_at_bound(7.0, 0.0, 2e-8, &unit, 10.0));
        assert!(is_kept_at_bound(-7.0, 0.0, 1.0 - 2e-8, &unit, 10.0));
        // It pulls away from the bound, or is not at it, or the bound is none.
        assert!(!is_kept_at_bound(-7.0, 0.0, 2e-8, &unit, 10.0));
        assert!(!is_kept_at_bound(7.0, 0.0, 1e-3, &unit, 10.0));
        assert!(!is_kept_at_bound(7.0, 0.0, 2e-8, &Bounds::FREE, 10.0));
        // A stationary point inside bounds far apart: the slope is rounding beside what the curvature makes of the distance.
        assert!(!is_kept_at_bound(1e-9, 2.0, 1.0, &Bounds::new(0.0, 1e8), 10.0));
        // A singular control, whose slope is rounding.
        assert!(!is_kept_at_bound(1e-12, 0.0, 2e-8, &unit, 10.0));
    }
}
