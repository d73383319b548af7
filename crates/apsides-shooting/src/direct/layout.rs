//! Places in the decision vector and in the constraint vector.
//!
//! Variables: per phase, segment after segment `[x at its start, its start time if that is an unknown of its own, controls at its
//! points]`, then the end state, the start time and the end time; the static parameters come last. Constraints: per phase, segment
//! after segment `[matching conditions, path rows at its constraint points, state bounds at the inner ones, least length]`, then the
//! integrals with bounds and the duration; the endpoint constraints come last.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use apsides_basis::Barycentric;
use apsides_ocp::{Bounds, Ocp, Phase};
use apsides_transcription::{Layout, PhaseEnds, Places};

use super::plan::{PhasePlan, points_of};
use super::settings::{MultipleShootingSettings, SegmentEnds};
use crate::error::ShootingError;

/// Stages of the elimination order that a segment has.
const STAGES: u32 = 4;

/// Points of a segment, for its controls or for its rows.
#[derive(Clone)]
pub(crate) struct Points {
    /// On [-1, 1].
    pub(crate) basis: Arc<Barycentric>,
    /// Quadrature weights, which sum to 2.
    weights: Arc<Vec<f64>>,
}

impl Points {
    fn new(count: usize) -> Result<Self, ShootingError> {
        let (nodes, weights) = points_of(count)?;
        Ok(Self { basis: Arc::new(Barycentric::new(&nodes)?), weights: Arc::new(weights) })
    }

    pub(crate) fn count(&self) -> usize {
        self.weights.len()
    }

    /// Normalised time of a point in its segment, from 0 to 1.
    pub(crate) fn place(&self, point: usize) -> f64 {
        let tau = self.basis.nodes()[point];
        if tau == 1.0 { 1.0 } else { 0.5 * (tau + 1.0) }
    }

    /// Quadrature weight on that time.
    pub(crate) fn weight(&self, point: usize) -> f64 {
        0.5 * self.weights[point]
    }
}

/// Placement of one segment.
pub(crate) struct SegmentLayout {
    /// Columns of two times, and start and width of the segment as fractions of the time between: those of the phase, or its own.
    pub(crate) times: (usize, usize),
    pub(crate) start: f64,
    pub(crate) width: f64,
    /// Points of the controls, and those at which rows hold.
    pub(crate) controls: Points,
    pub(crate) rows: Points,
    pub(crate) state_column: usize,
    /// First column of the controls of each control point.
    pub(crate) control_columns: Vec<usize>,
    pub(crate) matching_row: usize,
    /// First row after those of the segment.
    pub(crate) end_row: usize,
    /// First row of each path constraint at each constraint point, points by constraints; a point at the end of the segment may
    /// share it with the next segment.
    pub(crate) path_rows: Vec<usize>,
    /// True for a row that is the segment's own.
    pub(crate) owns_path_row: Vec<bool>,
    /// Constraint point, state and row of the bounds between the nodes.
    pub(crate) bound_rows: Vec<(usize, usize, usize)>,
    /// Row of the least length, where the ends are unknowns.
    pub(crate) length_row: Option<usize>,
    /// First of four stages in the elimination order.
    pub(crate) stage: u32,
}

impl SegmentLayout {
    /// Time at a place of the segment, from 0 to 1.
    pub(crate) fn time(&self, x: &[f64], place: f64) -> f64 {
        let fraction = self.start + self.width * place;
        (1.0 - fraction) * x[self.times.0] + fraction * x[self.times.1]
    }

    /// Time from its start to its end.
    pub(crate) fn length(&self, x: &[f64]) -> f64 {
        self.width * (x[self.times.1] - x[self.times.0])
    }

    /// Time that a constraint point stands for.
    pub(crate) fn row_seconds(&self, point: usize, x: &[f64]) -> f64 {
        self.rows.weight(point) * self.length(x)
    }
}

/// The placement of one phase.
pub(crate) struct ShootingPhase {
    /// The ends of the phase.
    pub(crate) ends: PhaseEnds,
    pub(crate) states: usize,
    pub(crate) controls: usize,
    pub(crate) plan: PhasePlan,
    pub(crate) segments: Vec<SegmentLayout>,
    /// Least length of a segment with unknown ends, relative to that which it has in the mesh.
    pub(crate) least_length: f64,
    pub(crate) end_stage: u32,
}

impl ShootingPhase {
    /// First column of the state at a node; `segments` is the end.
    pub(crate) fn state_column(&self, node: usize) -> usize {
        self.segments.get(node).map_or(self.ends.final_state, |s| s.state_column)
    }

    /// Fraction of the phase at a node of the mesh.
    pub(crate) fn fraction(&self, node: usize) -> f64 {
        self.plan.mesh.fractions()[node]
    }

    /// Fraction of the phase at a place of a segment of the mesh.
    pub(crate) fn fraction_in(&self, k: usize, place: f64) -> f64 {
        self.fraction(k) + (self.fraction(k + 1) - self.fraction(k)) * place
    }

    /// Columns of the times of inner nodes, where they are unknowns.
    pub(crate) fn inner_times(&self) -> impl Iterator<Item = usize> + '_ {
        self.segments.iter().skip(1).map(|s| s.times.0).filter(|&c| c != self.ends.initial_time)
    }

    /// Times of all nodes.
    pub(crate) fn node_times(&self, x: &[f64]) -> Vec<f64> {
        let starts = self.segments.iter().map(|s| s.time(x, 0.0));
        starts.chain(std::iter::once(x[self.ends.final_time])).collect()
    }
}

/// The placement of a whole problem, with its division.
pub(crate) type ShootingLayout = Layout<ShootingPhase>;

/// Points shared by segments with the same number of them.
type Bases = BTreeMap<usize, Points>;

/// The placement of a problem on plans of its phases.
pub(crate) fn shooting_layout(
    ocp: &Ocp,
    plans: &[PhasePlan],
    settings: &MultipleShootingSettings,
) -> Result<ShootingLayout, ShootingError> {
    let mut bases = Bases::new();
    let mut places = Places::default();
    let mut phases = Vec::with_capacity(plans.len());
    for (phase, plan) in ocp.phases.iter().zip(plans) {
        for &points in plan.mesh.points().iter().chain(&settings.constraint_points) {
            if let Entry::Vacant(e) = bases.entry(points) {
                e.insert(Points::new(points)?);
            }
        }
        phases.push(ShootingPhase::new(phase, plan, &bases, settings, &mut places));
    }
    Ok(Layout::new(ocp, phases, places))
}

impl ShootingPhase {
    fn new(
        phase: &Phase,
        plan: &PhasePlan,
        bases: &Bases,
        settings: &MultipleShootingSettings,
        places: &mut Places,
    ) -> Self {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let count = plan.mesh.intervals();
        let mut segments: Vec<SegmentLayout> = Vec::with_capacity(count);
        let row_points = |k: usize| settings.constraint_points.unwrap_or(plan.mesh.points()[k]);
        let both =
            |k: usize, points: &dyn Fn(usize) -> usize| k + 1 < count && points(k) > 1 && points(k + 1) > 1;
        let free = count > 1 && settings.segment_ends != SegmentEnds::Fixed;
        for k in 0..count {
            let (controls, rows) = (&bases[&plan.mesh.points()[k]], &bases[&row_points(k)]);
            let points = rows.count();
            let state_column = places.take_columns(nx);
            // Of the phase, to be set when they are placed, or of the segment.
            let start_time = if free && k > 0 { places.take_columns(1) } else { usize::MAX };
            let continuous = settings.continuous_controls && both(k, &|k| plan.mesh.points()[k]);
            let own = controls.count() - usize::from(continuous);
            let control_columns = (0..own).map(|_| places.take_columns(nu)).collect();
            let (start, end) = (plan.mesh.fractions()[k], plan.mesh.fractions()[k + 1]);
            segments.push(SegmentLayout {
                times: (start_time, usize::MAX),
                start: if free { 0.0 } else { start },
                width: if free { 1.0 } else { end - start },
                controls: controls.clone(),
                rows: rows.clone(),
                state_column,
                control_columns,
                matching_row: places.take_rows(nx),
                end_row: 0,
                path_rows: vec![usize::MAX; points * phase.path.len()],
                owns_path_row: vec![true; points * phase.path.len()],
                bound_rows: Vec::new(),
                length_row: None,
                stage: places.take_stages(STAGES),
            });
            let segment = &mut segments[k];
            for point in 0..points {
                for (c, constraint) in phase.path.iter().enumerate() {
                    let on_controls =
                        constraint.function.pattern().columns.iter().any(|c| (nx..nx + nu).contains(c));
                    let shared = point + 1 == points && both(k, &row_points) && (continuous || !on_controls);
                    segment.owns_path_row[point * phase.path.len() + c] = !shared;
                    if !shared {
                        segment.path_rows[point * phase.path.len() + c] =
                            places.take_rows(constraint.rows.len());
                    }
                }
            }
            let inside = (0..points).filter(|p| (1e-12..1.0 - 1e-12).contains(&segment.rows.place(*p)));
            let inside: Vec<usize> = if plan.inner_bounds[k] { inside.collect() } else { Vec::new() };
            for point in inside {
                for (s, state) in phase.states.iter().enumerate() {
                    if state.variable.bounds != Bounds::FREE {
                        segment.bound_rows.push((point, s, places.take_rows(1)));
                    }
                }
            }
            segment.length_row = free.then(|| places.take_rows(1));
            segment.end_row = places.next_row();
        }
        let final_state = places.take_columns(nx);
        share_ends(&mut segments, phase.path.len(), nu);
        let end_stage = places.take_stages(STAGES);
        let initial_time = places.take_columns(2);
        place_times(&mut segments, free, initial_time);
        let initial_state = segments.first().map_or(final_state, |s| s.state_column);
        let times = (initial_time, initial_time + 1);
        Self {
            ends: PhaseEnds::new(phase, (initial_state, final_state), times, places),
            states: nx,
            controls: nu,
            plan: plan.clone(),
            segments,
            least_length: match settings.segment_ends {
                SegmentEnds::Fixed => 0.0,
                SegmentEnds::Free { least_length } => least_length,
            },
            end_stage,
        }
    }
}

/// Gives each segment the times that it lies between: those of the phase, or of its nodes.
fn place_times(segments: &mut [SegmentLayout], free: bool, initial_time: usize) {
    let mut end = initial_time + 1;
    for (k, segment) in segments.iter_mut().enumerate().rev() {
        let start = if free && k > 0 { segment.times.0 } else { initial_time };
        segment.times = (start, end);
        if free {
            end = start;
        }
    }
}

/// Gives the last point of each segment the columns and rows that it shares with the first point of the next.
fn share_ends(segments: &mut [SegmentLayout], constraints: usize, controls: usize) {
    for k in 1..segments.len() {
        let (before, after) = segments.split_at_mut(k);
        let (Some(segment), Some(next)) = (before.last_mut(), after.first()) else { continue };
        let last = segment.controls.count() - 1;
        if segment.control_columns.len() == last && controls > 0 {
            segment.control_columns.push(next.control_columns[0]);
        } else if segment.control_columns.len() == last {
            segment.control_columns.push(segment.state_column);
        }
        let last = segment.rows.count() - 1;
        for c in 0..constraints {
            if !segment.owns_path_row[last * constraints + c] {
                segment.path_rows[last * constraints + c] = next.path_rows[c];
            }
        }
    }
}
