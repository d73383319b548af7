//! One interval of the accessory problem: equations of motion linearised and the second variation, by Gauss collocation.
//!
//! ```text
//! stages     X_i = x + h sum_l a_il F_l [X_l, U_l, xi, p]         next state   x + h sum_i b_i F_i [X_i, U_i, xi, p]
//! curvature  h sum_i b_i [X_i, U_i, xi, p]' K_i [X_i, U_i, xi, p]
//! ```
//!
//! `F` and `K` are Jacobian and Hessian of `T f` and `T H + mu . c` on an arc from `xi_a` to `xi_b = xi_a + T`, with time
//! `t = xi_a + theta T`. Everything is over `v = [x, U_1 .. U_s, xi_a, xi_b, p]`, each quantity divided by its scale.

use apsides_basis::Gauss;
use nalgebra::{DMatrix, DVector};

use super::activity::Activity;
use super::arcs::{STAGES, Span};
use crate::boundary::row_scale;
use crate::optimality::PhaseConditions;
use crate::worst::relative;

/// A row `r . v = 0` of an active constraint.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) gradient: DVector<f64>,
    pub(super) activity: Activity,
}

/// The interval over `v`.
#[derive(Clone, Debug)]
pub(super) struct Interval {
    pub(super) span: Span,
    /// The second variation.
    pub(super) curvature: DMatrix<f64>,
    /// State at the end.
    pub(super) step: DMatrix<f64>,
    /// Constraints at the stages.
    pub(super) rows: Vec<Row>,
    /// The part that the interval adds to each integral.
    pub(super) integrals: DMatrix<f64>,
    /// The stand of each control of each stage to its bounds.
    pub(super) controls: Vec<Activity>,
    /// Weight of each stage in the square norm of the controls: part of the phase's duration.
    pub(super) weights: Vec<f64>,
    /// Least eigenvalue of the Hessian in the controls that do not push against a bound, along the constraints that do;
    /// infinite where none is left.
    pub(super) legendre: f64,
    /// The stand of each state to its bounds at the stage where it is farthest from one.
    pub(super) at_bounds: Vec<Activity>,
}

/// Multipliers of state bounds come from a derivative of the costate; smaller ones, relative, are not surely different from
/// zero.
const SURE: f64 = 1e-3;

/// Points and weights of the rule on `[0, 1]`.
pub(super) struct Rule {
    nodes: Vec<f64>,
    weights: Vec<f64>,
    /// By rows.
    integration: Vec<f64>,
}

impl Rule {
    pub(super) fn new() -> Option<Self> {
        let rule = Gauss::new(STAGES).ok()?;
        Some(Self {
            nodes: rule.nodes().iter().map(|x| 0.5 * (x + 1.0)).collect(),
            weights: rule.weights().iter().map(|w| 0.5 * w).collect(),
            integration: rule.integration().iter().map(|a| 0.5 * a).collect(),
        })
    }
}

/// Jacobian, Hessian and constraints at one stage over `[x, u, xi_a, xi_b, p]`.
struct Stage {
    rates: DMatrix<f64>,
    curvature: DMatrix<f64>,
    rows: Vec<Row>,
    integrals: DMatrix<f64>,
    controls: Vec<Activity>,
    legendre: f64,
    at_bounds: Vec<Activity>,
}

impl Interval {
    pub(super) fn new(
        conditions: &mut PhaseConditions<'_>,
        parameters: &[f64],
        rule: &Rule,
        span: Span,
        duration: f64,
    ) -> Option<Self> {
        let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
        let ni = conditions.equations.phase.integrals.len();
        let length = span.arc_end - span.arc_start;
        let h = (span.end - span.start) / length;
        let stages: Vec<Stage> = (rule.nodes.iter())
            .map(|c| {
                Stage::new(conditions, parameters, span, span.start + c * (span.end - span.start), duration)
            })
            .collect();
        let (first_u, first_time) = (nx, nx + STAGES * nu);
        let nv = first_time + 2 + np;
        let local = nx + nu + 2 + np;
        // Everything but the state of a stage, as a map from v.
        let others = |i: usize| {
            let mut map = DMatrix::zeros(local, nv);
            for j in 0..nu {
                map[(nx + j, first_u + i * nu + j)] = 1.0;
            }
            for k in 0..2 + np {
                map[(nx + nu + k, first_time + k)] = 1.0;
            }
            map
        };
        let mut maps: Vec<DMatrix<f64>> = (0..STAGES).map(others).collect();
        let mut matrix = DMatrix::identity(STAGES * nx, STAGES * nx);
        let mut rhs = DMatrix::zeros(STAGES * nx, nv);
        for i in 0..STAGES {
            for r in 0..nx {
                rhs[(i * nx + r, r)] = 1.0;
            }
            for l in 0..STAGES {
                let a = h * rule.integration[i * STAGES + l];
                let by_others = &stages[l].rates * &maps[l];
                for r in 0..nx {
                    for c in 0..nx {
                        matrix[(i * nx + r, l * nx + c)] -= a * stages[l].rates[(r, c)];
                    }
                    for c in 0..nv {
                        rhs[(i * nx + r, c)] += a * by_others[(r, c)];
                    }
                }
            }
        }
        let states = matrix.lu().solve(&rhs)?;
        let mut curvature = DMatrix::zeros(nv, nv);
        let mut step = DMatrix::zeros(nx, nv);
        step.view_mut((0, 0), (nx, nx)).fill_with_identity();
        let mut integrals = DMatrix::zeros(ni, nv);
        let (mut rows, mut controls, mut legendre) = (Vec::new(), Vec::new(), f64::INFINITY);
        let mut weights = vec![0.0; STAGES];
        let mut at_bounds = vec![Activity::Strong; nx];
        for (i, (stage, map)) in stages.into_iter().zip(&mut maps).enumerate() {
            map.view_mut((0, 0), (nx, nv)).copy_from(&states.view((i * nx, 0), (nx, nv)));
            let weight = h * rule.weights[i];
            curvature += map.transpose() * &stage.curvature * &*map * weight;
            step += &stage.rates * &*map * weight;
            integrals += &stage.integrals * &*map * weight;
            rows.extend(stage.rows.into_iter().map(|r| Row { gradient: map.transpose() * r.gradient, ..r }));
            controls.extend(stage.controls);
            legendre = legendre.min(stage.legendre);
            at_bounds.iter_mut().zip(&stage.at_bounds).for_each(|(a, b)| *a = a.weaker(*b));
            weights[i] = weight * length / duration;
        }
        Some(Self { span, curvature, step, rows, integrals, controls, weights, legendre, at_bounds })
    }
}

impl Interval {
    /// Adds a constraint on `[x, xi_a, xi_b, p]` at the end of the interval.
    pub(super) fn add_end_row(&mut self, row: &[f64], activity: Activity) {
        let nx = self.step.nrows();
        let nv = self.step.ncols();
        let mut gradient = DVector::zeros(nv);
        for i in 0..nx {
            gradient += self.step.row(i).transpose() * row[i];
        }
        let others = nv - (row.len() - nx);
        for (k, v) in row[nx..].iter().enumerate() {
            gradient[others + k] += v;
        }
        self.rows.push(Row { gradient, activity });
    }
}

impl Stage {
    fn new(
        conditions: &mut PhaseConditions<'_>,
        parameters: &[f64],
        span: Span,
        time: f64,
        duration: f64,
    ) -> Self {
        conditions.evaluate_within_bounds(span.segment, time);
        let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
        let (width, local) = (nx + nu + np + 1, nx + nu + 2 + np);
        let length = span.arc_end - span.arc_start;
        let theta = (time - span.arc_start) / length;
        // Derivatives of T and of t by the ends of the arc.
        let (by_length, by_time) = ([-1.0, 1.0], [1.0 - theta, theta]);
        let scale = |k: usize| match k {
            k if k < nx => conditions.scaling.states[k],
            k if k < nx + nu => conditions.scaling.controls[k - nx],
            k if k < nx + nu + 2 => duration,
            k => parameters[k - nx - nu - 2],
        };
        // Place of [x, u, p] among [x, u, xi_a, xi_b, p]; time is last and not among them.
        let place = |k: usize| if k < nx + nu { k } else { k + 2 };
        let ends = [nx + nu, nx + nu + 1];
        // A function of [x, u, p, t] times T, or by itself, over [x, u, xi_a, xi_b, p].
        let gradient_of = |value: f64, g: &[f64], timed: bool| {
            let t = if timed { length } else { 1.0 };
            let mut out = DVector::zeros(local);
            for k in 0..width - 1 {
                out[place(k)] = t * g[k] * scale(place(k));
            }
            for a in 0..2 {
                let through_length = if timed { by_length[a] * value } else { 0.0 };
                out[ends[a]] = (through_length + t * g[width - 1] * by_time[a]) * duration;
            }
            out
        };

        let mut costate_rate = vec![f64::NAN; nx];
        if conditions.costate.segments().len() == conditions.found.control.segments().len() {
            conditions.costate.derivative_in(span.segment, time, &mut costate_rate);
        }
        let zero = vec![0.0; conditions.point.multipliers.len()];
        let slopes_with_path = conditions.point.gradient.clone();
        let size = conditions.hamiltonian_size;
        let PhaseConditions { equations, point, .. } = &mut *conditions;
        let mut slope = vec![0.0; width];
        equations.lagrangian(&point.costate, &zero, &mut slope);
        let (mut hh, mut hc) = (vec![0.0; width * width], vec![0.0; width * width]);
        equations.curvature(&point.costate, &point.multipliers, &mut hh, &mut hc);
        let (mut values, mut jacobian) = (vec![0.0; nx], vec![0.0; nx * width]);
        equations.dynamics_jacobian(&mut values, &mut jacobian);

        let mut rates = DMatrix::zeros(nx, local);
        for i in 0..nx {
            let row = gradient_of(values[i], &jacobian[i * width..(i + 1) * width], true);
            rates.set_row(i, &(row / scale(i)).transpose());
        }
        let ni = equations.phase.integrals.len();
        let mut integrals = DMatrix::zeros(ni, local);
        let mut gradient = vec![0.0; width];
        for q in 0..ni {
            let value = equations.integrand_gradient(q, &mut gradient);
            integrals.set_row(q, &gradient_of(value, &gradient, true).transpose());
        }

        let mut curvature = DMatrix::zeros(local, local);
        let t = width - 1;
        let both = |i: usize, j: usize| hh[i * width + j] + hc[i * width + j];
        for i in 0..t {
            for j in 0..t {
                curvature[(place(i), place(j))] = length * both(i, j);
            }
            for a in 0..2 {
                let mixed = by_length[a] * slope[i] + length * both(i, t) * by_time[a];
                curvature[(place(i), ends[a])] = mixed;
                curvature[(ends[a], place(i))] = mixed;
            }
        }
        for a in 0..2 {
            for b in 0..2 {
                let through_length = (by_length[a] * by_time[b] + by_length[b] * by_time[a]) * slope[t];
                curvature[(ends[a], ends[b])] =
                    through_length + length * both(t, t) * by_time[a] * by_time[b];
            }
        }
        for i in 0..local {
            for j in 0..local {
                curvature[(i, j)] *= scale(i) * scale(j);
            }
        }

        let bounds = conditions.equations.phase.controls.iter().map(|c| &c.bounds);
        let controls: Vec<Activity> = bounds
            .enumerate()
            .map(|(j, bounds)| {
                let scale = conditions.scaling.controls[j];
                let slope = relative(slopes_with_path[nx + j] * scale, size);
                Activity::new(slope, conditions.point.u[j], bounds, scale)
            })
            .collect();
        // A control without effect, as the direction of no thrust, is none.
        let activity = |j: usize, controls: &[Activity]| {
            let moves = (0..nx).any(|i| rates[(i, nx + j)] != 0.0);
            let bends = |k: usize| {
                let fixed = k >= nx && k < nx + nu && controls[k - nx] == Activity::Strong;
                !fixed && curvature[(nx + j, k)] != 0.0
            };
            moves || (0..local).any(bends)
        };
        let has_slope: Vec<bool> = (0..nu).map(|j| activity(j, &controls)).collect();
        let controls: Vec<Activity> =
            (0..nu)
                .map(|j| {
                    if has_slope[j] || conditions.has_effect(time, j) {
                        controls[j]
                    } else {
                        Activity::Strong
                    }
                })
                .collect();
        let mut rows = Vec::new();
        let variables: Vec<_> = conditions.equations.phase.path.iter().flat_map(|p| &p.rows).collect();
        for (r, variable) in variables.into_iter().enumerate() {
            let largest = conditions.nodes.iter().fold(0.0, |m: f64, n| m.max(n.path[r].abs()));
            let row_size = row_scale(variable, largest);
            let value = conditions.equations.row_gradient(r, &mut gradient);
            let slope = relative(-conditions.point.multipliers[r] * row_size, size);
            let activity = Activity::new(slope, value, &variable.bounds, row_size);
            if activity != Activity::Free {
                rows.push(Row { gradient: gradient_of(value, &gradient, false) / row_size, activity });
            }
        }
        let mut at_bounds = vec![Activity::Free; nx];
        for (i, state) in conditions.equations.phase.states.iter().enumerate() {
            let bounds = &state.variable.bounds;
            if Activity::new(0.0, conditions.point.x[i], bounds, scale(i)) != Activity::Free {
                // The multiplier is what the costate equation lacks.
                let multiplier = -costate_rate[i] - slopes_with_path[i];
                let slope = relative(-multiplier * scale(i), size);
                let slope = if slope.abs() > SURE { slope } else { 0.0 };
                let mut gradient = DVector::zeros(local);
                gradient[i] = 1.0;
                at_bounds[i] = Activity::new(slope, conditions.point.x[i], bounds, scale(i));
                rows.push(Row { gradient, activity: at_bounds[i] });
            }
        }
        let legendre = legendre(&curvature, &rates, &controls, &rows, duration / length);
        Self { rates, curvature, rows, integrals, controls, legendre, at_bounds }
    }
}

/// The rate of a state over `[x, xi_a, xi_b, p]` at the end of an interval, of unit length; none where a control occurs in it. A state that
/// stays at its bound from there on has none there.
pub(super) fn rate_row(
    conditions: &mut PhaseConditions<'_>,
    parameters: &[f64],
    span: Span,
    state: usize,
) -> Option<Vec<f64>> {
    conditions.evaluate_within_bounds(span.segment, span.end);
    let (nx, nu, np) = (conditions.equations.nx, conditions.equations.nu, conditions.equations.np);
    let width = nx + nu + np + 1;
    let duration = conditions.found.final_time - conditions.found.initial_time;
    let (mut rates, mut jacobian) = (vec![0.0; nx], vec![0.0; nx * width]);
    conditions.equations.dynamics_jacobian(&mut rates, &mut jacobian);
    let gradient = &jacobian[state * width..(state + 1) * width];
    if gradient[nx..nx + nu].iter().any(|g| *g != 0.0) {
        return None;
    }
    let theta = (span.end - span.arc_start) / (span.arc_end - span.arc_start);
    let by_time = gradient[width - 1] * duration;
    let mut row: Vec<f64> = (0..nx).map(|k| gradient[k] * conditions.scaling.states[k]).collect();
    row.extend([(1.0 - theta) * by_time, theta * by_time]);
    row.extend((0..np).map(|k| gradient[nx + nu + k] * parameters[k]));
    let length = row.iter().map(|v| v * v).sum::<f64>().sqrt();
    (length > 0.0).then(|| row.iter().map(|v| v / length).collect())
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
