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
use nalgebra::{DMatrix, DMatrixView, DVector};

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
        let others: [Vec<usize>; STAGES] = std::array::from_fn(|i| others(i, nx, nu, np));
        let states = stage_states(&stages, &others, nv, rule, h)?;
        let mut curvature = DMatrix::zeros(nv, nv);
        let mut step = DMatrix::zeros(nx, nv);
        step.view_mut((0, 0), (nx, nx)).fill_with_identity();
        let mut integrals = DMatrix::zeros(ni, nv);
        let (mut rows, mut controls, mut legendre) = (Vec::new(), Vec::new(), f64::INFINITY);
        let mut weights = vec![0.0; STAGES];
        let mut at_bounds = vec![Activity::Strong; nx];
        for (i, (stage, others)) in stages.into_iter().zip(&others).enumerate() {
            let map = Map { states: states.rows(i * nx, nx), others };
            let weight = h * rule.weights[i];
            map.add_both(&mut curvature, weight, &stage.curvature);
            map.add(&mut step, weight, &stage.rates);
            map.add(&mut integrals, weight, &stage.integrals);
            rows.extend(
                stage
                    .rows
                    .into_iter()
                    .map(|r| Row { gradient: map.gradient(&r.gradient), activity: r.activity }),
            );
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

/// Places in `v` of what stage `i` has beside its state: its controls, the ends of the arc and the parameters.
fn others(i: usize, nx: usize, nu: usize, np: usize) -> Vec<usize> {
    let times = nx + STAGES * nu;
    (nx + i * nu..nx + (i + 1) * nu).chain(times..times + 2 + np).collect()
}

/// `[x, u, xi_a, xi_b, p]` of a stage as a map from `v`: the state is a matrix times `v`, what is beside it are entries of `v`.
struct Map<'m> {
    states: DMatrixView<'m, f64>,
    others: &'m [usize],
}

impl Map<'_> {
    /// Adds `weight` times a matrix times the map.
    fn add(&self, out: &mut DMatrix<f64>, weight: f64, matrix: &DMatrix<f64>) {
        let nx = self.states.nrows();
        out.gemm(weight, &matrix.columns(0, nx), &self.states, 1.0);
        for (k, place) in self.others.iter().enumerate() {
            out.column_mut(*place).axpy(weight, &matrix.column(nx + k), 1.0);
        }
    }

    /// Adds `weight` times a matrix with the map on both its sides.
    fn add_both(&self, out: &mut DMatrix<f64>, weight: f64, matrix: &DMatrix<f64>) {
        let nx = self.states.nrows();
        let mut half = DMatrix::zeros(matrix.nrows(), self.states.ncols());
        self.add(&mut half, weight, matrix);
        out.gemm_tr(1.0, &self.states, &half.rows(0, nx), 1.0);
        for (k, place) in self.others.iter().enumerate() {
            let mut row = out.row_mut(*place);
            row += half.row(nx + k);
        }
    }

    /// A gradient at the stage as one over `v`.
    fn gradient(&self, of_stage: &DVector<f64>) -> DVector<f64> {
        let nx = self.states.nrows();
        let mut gradient = self.states.tr_mul(&of_stage.rows(0, nx));
        for (k, place) in self.others.iter().enumerate() {
            gradient[*place] += of_stage[nx + k];
        }
        gradient
    }
}

/// The states of all stages, one below the other, as a map from `v`; none if the equations have no solution.
fn stage_states(
    stages: &[Stage],
    others: &[Vec<usize>],
    nv: usize,
    rule: &Rule,
    h: f64,
) -> Option<DMatrix<f64>> {
    let nx = stages[0].rates.nrows();
    let mut matrix = DMatrix::identity(STAGES * nx, STAGES * nx);
    let mut rhs = DMatrix::zeros(STAGES * nx, nv);
    for i in 0..STAGES {
        rhs.view_mut((i * nx, 0), (nx, nx)).fill_with_identity();
        for (l, (stage, others)) in stages.iter().zip(others).enumerate() {
            let a = h * rule.integration[i * STAGES + l];
            for c in 0..nx {
                let mut rows = matrix.view_mut((i * nx, l * nx + c), (nx, 1));
                rows.column_mut(0).axpy(-a, &stage.rates.column(c), 1.0);
            }
            for (k, place) in others.iter().enumerate() {
                let mut rows = rhs.view_mut((i * nx, *place), (nx, 1));
                rows.column_mut(0).axpy(a, &stage.rates.column(nx + k), 1.0);
            }
        }
    }
    matrix.lu().solve_mut(&mut rhs).then_some(rhs)
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
