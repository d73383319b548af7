//! One interval of the accessory problem: equations of motion linearised and the second variation, by Gauss collocation.
//!
//! ```text
//! stages     X_i = x + h sum_l a_il F_l [X_l, U_l, xi, p]         next state   x + h sum_i b_i F_i [X_i, U_i, xi, p]
//! curvature  h sum_i b_i [X_i, U_i, xi, p]' K_i [X_i, U_i, xi, p]  +  c (s_x x + s_xi xi + s_p p)^2 at kinks
//! ```
//!
//! `F` and `K` are Jacobian and Hessian of `T f` and `T H + mu . c` on an arc from `xi_a` to `xi_b = xi_a + T`, with time
//! `t = xi_a + theta T`. Everything is over `v = [x, U_1 .. U_s, xi_a, xi_b, p]`, each quantity divided by its scale.

use apsides_basis::Gauss;
use nalgebra::{DMatrix, DVector};

use super::activity::Activity;
use super::arcs::{STAGES, Span};
use super::stage::{Row, Stage};
use crate::optimality::PhaseConditions;

/// Curvature of an instant: a coefficient times the square of a change over `v`.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    pub(super) gradient: DVector<f64>,
    pub(super) coefficient: f64,
    /// Says whether it counts among the changes that show that there is no minimum: where it is a lower bound alone it does not.
    pub(super) is_exact: bool,
}

/// The end of an interval at which something happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Start,
    Last,
}

/// The interval over `v`.
#[derive(Clone, Debug)]
pub(super) struct Interval {
    pub(super) span: Span,
    /// The second variation.
    pub(super) curvature: DMatrix<f64>,
    /// The second variation of instants at its ends, beside that.
    pub(super) instants: Vec<Instant>,
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

/// Points and weights of the rule on `[0, 1]`.
pub(super) struct Rule {
    nodes: Vec<f64>,
    weights: Vec<f64>,
    /// By rows.
    integration: Vec<f64>,
}

impl Rule {
    pub(super) fn new() -> Option<Self> {
        let rule = Gauss::shared(STAGES).ok()?;
        Some(Self {
            nodes: rule.nodes().iter().map(|x| 0.5 * (x + 1.0)).collect(),
            weights: rule.weights().iter().map(|w| 0.5 * w).collect(),
            integration: rule.integration().iter().map(|a| 0.5 * a).collect(),
        })
    }
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
        let nv = nx + STAGES * nu + 2 + np;
        let mut maps: Vec<DMatrix<f64>> = (0..STAGES).map(|i| others(i, nx, nu, np)).collect();
        let states = stage_states(&stages, &maps, rule, h)?;
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
        let instants = Vec::new();
        Some(Self {
            span,
            curvature,
            instants,
            step,
            rows,
            integrals,
            controls,
            weights,
            legendre,
            at_bounds,
        })
    }
}

/// Everything but the state of stage `i`, as a map from `v`.
fn others(i: usize, nx: usize, nu: usize, np: usize) -> DMatrix<f64> {
    let (first_u, first_time) = (nx, nx + STAGES * nu);
    let mut map = DMatrix::zeros(nx + nu + 2 + np, first_time + 2 + np);
    for j in 0..nu {
        map[(nx + j, first_u + i * nu + j)] = 1.0;
    }
    for k in 0..2 + np {
        map[(nx + nu + k, first_time + k)] = 1.0;
    }
    map
}

/// The states of all stages, one below the other, as a map from `v`; none if the equations have no solution.
fn stage_states(stages: &[Stage], maps: &[DMatrix<f64>], rule: &Rule, h: f64) -> Option<DMatrix<f64>> {
    let (nx, nv) = (stages[0].rates.nrows(), maps[0].ncols());
    let mut matrix = DMatrix::identity(STAGES * nx, STAGES * nx);
    let mut rhs = DMatrix::zeros(STAGES * nx, nv);
    for i in 0..STAGES {
        for r in 0..nx {
            rhs[(i * nx + r, r)] = 1.0;
        }
        for (l, (stage, map)) in stages.iter().zip(maps).enumerate() {
            let a = h * rule.integration[i * STAGES + l];
            let by_others = &stage.rates * map;
            for r in 0..nx {
                for c in 0..nx {
                    matrix[(i * nx + r, l * nx + c)] -= a * stage.rates[(r, c)];
                }
                for c in 0..nv {
                    rhs[(i * nx + r, c)] += a * by_others[(r, c)];
                }
            }
        }
    }
    matrix.lu().solve(&rhs)
}

impl Interval {
    /// Adds a constraint on `[x, xi_a, xi_b, p]` at the end of the interval.
    pub(super) fn add_end_row(&mut self, row: &[f64], activity: Activity) {
        let gradient = self.over_v(End::Last, row);
        self.rows.push(Row { gradient, activity });
    }

    /// A gradient over `[x, xi_a, xi_b, p]` at an end of the interval as one over `v`.
    pub(super) fn over_v(&self, end: End, row: &[f64]) -> DVector<f64> {
        let nx = self.step.nrows();
        let nv = self.step.ncols();
        let mut gradient = DVector::zeros(nv);
        for i in 0..nx {
            match end {
                End::Start => gradient[i] += row[i],
                End::Last => gradient += self.step.row(i).transpose() * row[i],
            }
        }
        let others = nv - (row.len() - nx);
        for (k, v) in row[nx..].iter().enumerate() {
            gradient[others + k] += v;
        }
        gradient
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
