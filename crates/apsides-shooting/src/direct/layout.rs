//! Where everything stands in the decision vector and in the constraint vector.
//!
//! Variables: per phase, segment after segment `[x at its start, controls at its points]`, then the end state, the start time and
//! the end time; the static parameters come last. Constraints: per phase, segment after segment `[matching conditions, path rows at
//! its control points, state bounds at its inner control points]`, then the integrals with bounds and the duration; the endpoint
//! constraints come last.

use std::sync::Arc;

use apsides_basis::Barycentric;
use apsides_ocp::{Bounds, EndpointInput, Ocp, Phase};

use super::plan::{PhasePlan, control_points};
use crate::error::ShootingError;

/// Placement of one segment.
pub(crate) struct SegmentLayout {
    /// Start and width as fractions of the phase.
    pub(crate) start: f64,
    pub(crate) width: f64,
    /// Control points on [-1, 1], and their quadrature weights, which sum to 2.
    pub(crate) basis: Arc<Barycentric>,
    pub(crate) weights: Arc<Vec<f64>>,
    pub(crate) state_column: usize,
    /// First column of the controls of each control point.
    pub(crate) control_columns: Vec<usize>,
    pub(crate) matching_row: usize,
    /// First row after those of the segment.
    pub(crate) end_row: usize,
    /// First row of each path constraint at each control point, points by constraints; a point at the end of the segment may
    /// share it with the next segment.
    pub(crate) path_rows: Vec<usize>,
    /// Whether such a row is the segment's own.
    pub(crate) owns_path_row: Vec<bool>,
    /// Control point, state and row of the bounds between the nodes.
    pub(crate) bound_rows: Vec<(usize, usize, usize)>,
    /// First of four stages in the elimination order.
    pub(crate) stage: u32,
}

impl SegmentLayout {
    pub(crate) fn points(&self) -> usize {
        self.weights.len()
    }

    /// Normalised time of a control point, from 0 to 1.
    pub(crate) fn place(&self, point: usize) -> f64 {
        let tau = self.basis.nodes()[point];
        if tau == 1.0 { 1.0 } else { 0.5 * (tau + 1.0) }
    }

    /// Fraction of the phase at a control point.
    pub(crate) fn fraction(&self, point: usize) -> f64 {
        self.start + self.width * self.place(point)
    }

    /// Quadrature weight of a control point on the normalised time of the phase.
    pub(crate) fn weight(&self, point: usize) -> f64 {
        0.5 * self.width * self.weights[point]
    }
}

/// Placement of one phase.
pub(crate) struct PhaseLayout {
    pub(crate) states: usize,
    pub(crate) controls: usize,
    pub(crate) plan: PhasePlan,
    pub(crate) segments: Vec<SegmentLayout>,
    pub(crate) end_column: usize,
    pub(crate) initial_time: usize,
    pub(crate) final_time: usize,
    /// Row of each integral that has bounds.
    pub(crate) integral_rows: Vec<Option<usize>>,
    /// Row of the duration, when it has bounds that those on the times do not imply.
    pub(crate) duration_row: Option<usize>,
    pub(crate) end_stage: u32,
}

impl PhaseLayout {
    /// First column of the state at a node; `segments` is the end.
    pub(crate) fn state_column(&self, node: usize) -> usize {
        self.segments.get(node).map_or(self.end_column, |s| s.state_column)
    }

    /// Fraction of the phase at a node.
    pub(crate) fn fraction(&self, node: usize) -> f64 {
        self.plan.mesh.fractions()[node]
    }

    pub(crate) fn duration(&self, x: &[f64]) -> f64 {
        x[self.final_time] - x[self.initial_time]
    }
}

/// Placement of a whole problem.
pub(crate) struct Layout {
    pub(crate) phases: Vec<PhaseLayout>,
    pub(crate) first_parameter: usize,
    pub(crate) variables: usize,
    /// First row of each endpoint constraint.
    pub(crate) endpoint_rows: Vec<usize>,
    pub(crate) constraints: usize,
    /// Stage after all segments: times, parameters and everything that joins distant nodes.
    pub(crate) last_stage: u32,
}

/// Bases and weights shared by segments with the same number of control points.
type Bases = std::collections::BTreeMap<usize, (Arc<Barycentric>, Arc<Vec<f64>>)>;

impl Layout {
    pub(crate) fn new(ocp: &Ocp, plans: &[PhasePlan], continuous: bool) -> Result<Self, ShootingError> {
        let mut bases = Bases::new();
        let mut next = Next { column: 0, row: 0, stage: 0 };
        let mut phases = Vec::with_capacity(plans.len());
        for (phase, plan) in ocp.phases.iter().zip(plans) {
            for &points in plan.mesh.points() {
                if let std::collections::btree_map::Entry::Vacant(e) = bases.entry(points) {
                    let (nodes, weights) = control_points(points)?;
                    e.insert((Arc::new(Barycentric::new(&nodes)?), Arc::new(weights)));
                }
            }
            phases.push(next.phase(phase, plan, &bases, continuous));
        }
        let first_parameter = next.column;
        let mut endpoint_rows = Vec::with_capacity(ocp.constraints.len());
        for c in &ocp.constraints {
            endpoint_rows.push(next.row);
            next.row += c.rows.len();
        }
        Ok(Self {
            phases,
            first_parameter,
            variables: first_parameter + ocp.parameters.len(),
            endpoint_rows,
            constraints: next.row,
            last_stage: next.stage,
        })
    }

    /// Column of an end quantity.
    pub(crate) fn endpoint_column(&self, input: EndpointInput) -> usize {
        match input {
            EndpointInput::InitialTime { phase } => self.phases[phase].initial_time,
            EndpointInput::FinalTime { phase } => self.phases[phase].final_time,
            EndpointInput::InitialState { phase, state } => self.phases[phase].state_column(0) + state,
            EndpointInput::FinalState { phase, state } => self.phases[phase].end_column + state,
            EndpointInput::Parameter { index } => self.first_parameter + index,
        }
    }
}

/// First places that are not taken.
struct Next {
    column: usize,
    row: usize,
    stage: u32,
}

impl Next {
    fn phase(&mut self, phase: &Phase, plan: &PhasePlan, bases: &Bases, continuous: bool) -> PhaseLayout {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let count = plan.mesh.intervals();
        let mut segments: Vec<SegmentLayout> = Vec::with_capacity(count);
        let joined = |k: usize| k + 1 < count && plan.mesh.points()[k + 1] > 1 && plan.mesh.points()[k] > 1;
        for k in 0..count {
            let points = plan.mesh.points()[k];
            let (basis, weights) = &bases[&points];
            let state_column = self.take_columns(nx);
            let own = points - usize::from(continuous && joined(k));
            let control_columns = (0..own).map(|_| self.take_columns(nu)).collect();
            segments.push(SegmentLayout {
                start: plan.mesh.fractions()[k],
                width: plan.mesh.fractions()[k + 1] - plan.mesh.fractions()[k],
                basis: Arc::clone(basis),
                weights: Arc::clone(weights),
                state_column,
                control_columns,
                matching_row: self.take_rows(nx),
                end_row: 0,
                path_rows: vec![usize::MAX; points * phase.path.len()],
                owns_path_row: vec![true; points * phase.path.len()],
                bound_rows: Vec::new(),
                stage: self.stage,
            });
            self.stage += 4;
            let segment = &mut segments[k];
            for point in 0..points {
                for (c, constraint) in phase.path.iter().enumerate() {
                    let on_controls =
                        constraint.function.pattern().columns.iter().any(|c| (nx..nx + nu).contains(c));
                    let shared = point + 1 == points && joined(k) && (continuous || !on_controls);
                    segment.owns_path_row[point * phase.path.len() + c] = !shared;
                    if !shared {
                        segment.path_rows[point * phase.path.len() + c] =
                            self.take_rows(constraint.rows.len());
                    }
                }
            }
            let inside = (0..points).filter(|p| (1e-12..1.0 - 1e-12).contains(&segment.place(*p)));
            let inside: Vec<usize> = if plan.inner_bounds[k] { inside.collect() } else { Vec::new() };
            for point in inside {
                for (s, state) in phase.states.iter().enumerate() {
                    if state.variable.bounds != Bounds::FREE {
                        segment.bound_rows.push((point, s, self.take_rows(1)));
                    }
                }
            }
            segment.end_row = self.row;
        }
        let end_column = self.take_columns(nx);
        share_ends(&mut segments, phase.path.len(), nu);
        let end_stage = self.stage;
        self.stage += 4;
        let initial_time = self.take_columns(2);
        let integral_rows =
            phase.integrals.iter().map(|q| (q.variable.bounds != Bounds::FREE).then(|| self.take_rows(1)));
        let integral_rows = integral_rows.collect();
        PhaseLayout {
            states: nx,
            controls: nu,
            plan: plan.clone(),
            segments,
            end_column,
            initial_time,
            final_time: initial_time + 1,
            integral_rows,
            duration_row: phase.needs_duration_row().then(|| self.take_rows(1)),
            end_stage,
        }
    }

    fn take_columns(&mut self, count: usize) -> usize {
        self.column += count;
        self.column - count
    }

    fn take_rows(&mut self, count: usize) -> usize {
        self.row += count;
        self.row - count
    }
}

/// Gives the last point of each segment the columns and rows that it shares with the first point of the next.
fn share_ends(segments: &mut [SegmentLayout], constraints: usize, controls: usize) {
    for k in 1..segments.len() {
        let (before, after) = segments.split_at_mut(k);
        let (Some(segment), Some(next)) = (before.last_mut(), after.first()) else { continue };
        let last = segment.points() - 1;
        if segment.control_columns.len() == last && controls > 0 {
            segment.control_columns.push(next.control_columns[0]);
        } else if segment.control_columns.len() == last {
            segment.control_columns.push(segment.state_column);
        }
        for c in 0..constraints {
            if !segment.owns_path_row[last * constraints + c] {
                segment.path_rows[last * constraints + c] = next.path_rows[c];
            }
        }
    }
}
