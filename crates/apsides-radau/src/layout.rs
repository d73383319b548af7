//! Places in the decision vector and in the constraint vector.
//!
//! Variables: per phase, node after node `[x, u]`, the end node with `[x]` alone, then the start time, the times of the
//! breaks and the end time; the static parameters come last. Constraints: per phase, node after node `[defects, path
//! rows]`, then the integrals with bounds, the duration, the durations of the arcs if there are several, the times of breaks
//! that are not free, the degrees of singular controls, the rates at touch points and junctions; the endpoint constraints come last.

use std::ops::Range;
use std::sync::Arc;

use apsides_basis::Lgr;
use apsides_ocp::{ArcKind, Break, Mesh, Ocp, Phase, PhaseMesh, TouchPoint};
use apsides_transcription::{Layout, PhaseEnds, Places};

use crate::RadauError;
use crate::elimination;
use crate::junction::{
    Junction, RateArc, RateRow, free_at_start, implied_at_start, implied_rates, junctions, rate_arcs,
    rate_rows as rate_rows_of, rate_rows_at_end,
};

/// One collocation point.
pub(crate) struct Node {
    /// Interval that it belongs to.
    pub(crate) interval: usize,
    /// Index within the interval.
    pub(crate) local: usize,
    /// Normalised time of the phase on its mesh, from 0 to 1.
    pub(crate) fraction: f64,
    /// Normalised time of the arc, from 0 to 1.
    pub(crate) share: f64,
    /// Width of the interval on the normalised time of the arc.
    pub(crate) width: f64,
    /// Quadrature weight on the normalised time of the arc; the weights of an arc sum to 1.
    pub(crate) weight: f64,
}

/// Part of a phase between two times that are unknowns or bounded: the whole phase when its mesh has no breaks.
pub(crate) struct ArcLayout {
    pub(crate) nodes: Range<usize>,
    /// Column of its start time.
    pub(crate) start_time: usize,
    /// Column of its end time.
    pub(crate) end_time: usize,
}

/// The placement of one phase on its mesh.
pub struct CollocationPhase {
    /// The ends of the phase. The times of the breaks stand between those of start and end.
    pub(crate) ends: PhaseEnds,
    pub(crate) states: usize,
    pub(crate) controls: usize,
    /// The mesh with breaks of free time at its touch points and crossings.
    pub(crate) mesh: PhaseMesh,
    /// The mesh as it was given.
    pub(crate) stated_mesh: PhaseMesh,
    /// One rule per interval, shared by intervals with the same number of points.
    pub(crate) rules: Vec<Arc<Lgr>>,
    /// Collocation points; the end node is not among them.
    pub(crate) nodes: Vec<Node>,
    /// Parts between the breaks of the mesh.
    pub(crate) arcs: Vec<ArcLayout>,
    /// First constraint row.
    pub(crate) first_row: usize,
    /// Rows per node: defects and path constraints.
    pub(crate) rows_per_node: usize,
    /// Row of the duration of the first of several arcs; those of the others follow.
    pub(crate) first_arc_row: Option<usize>,
    /// Row, column and fraction of the phase of the time of each break that is not free.
    pub(crate) pinned_rows: Vec<(usize, usize, f64)>,
    /// Row, interval and control of each condition that the highest degree of a control vanishes.
    pub(crate) degree_rows: Vec<(usize, usize, usize)>,
    /// Rates that vanish at touch points and junctions with free times.
    pub(crate) rate_rows: Vec<RateRow>,
    /// Ends of arcs along bounds of path rows without controls.
    pub(crate) junctions: Vec<Junction>,
    /// Arcs along bounds of path rows of order two, where the first rates of the rows stand in the places of the rows.
    pub(crate) rate_arcs: Vec<RateArc>,
    /// Nodes and path rows that are held along the first arc and implied by the initial states.
    pub(crate) implied_rows: Vec<(usize, usize)>,
    /// Path rows that are linear in the states and whose first rate the initial states imply too, with their coefficients.
    pub(crate) implied_rates: Vec<(usize, Vec<(usize, f64)>)>,
    /// Path rows without controls whose multiplier may be an impulse at the first node: the initial states do not imply them.
    pub(crate) rows_at_start: Vec<usize>,
    /// The first stage of the phase in the elimination order.
    pub(crate) first_stage: u32,
}

impl CollocationPhase {
    /// First state column of a node; `nodes.len()` is the end node.
    pub(crate) fn state_column(&self, node: usize) -> usize {
        self.ends.initial_state + node * (self.states + self.controls)
    }

    /// First control column of a collocation point.
    pub(crate) fn control_column(&self, node: usize) -> usize {
        self.state_column(node) + self.states
    }

    /// First defect row of a collocation point.
    pub(crate) fn defect_row(&self, node: usize) -> usize {
        self.first_row + node * self.rows_per_node
    }

    /// First path row of a collocation point.
    pub(crate) fn path_row(&self, node: usize) -> usize {
        self.defect_row(node) + self.states
    }

    /// Index of the first node of an interval; for `intervals` the end node.
    pub(crate) fn interval_start(&self, interval: usize) -> usize {
        self.mesh.points()[..interval].iter().sum()
    }

    /// Index of the node that carries the bound of a touch point.
    pub(crate) fn touch_node(&self, touch: &TouchPoint) -> usize {
        self.interval_start(touch.end)
    }

    /// Says whether the bounds of a path row are left out at a node since it is beside a touch point of the row.
    pub(crate) fn is_beside_touch(&self, node: usize, row: usize) -> bool {
        let interval = self.nodes[node].interval;
        let beside = |t: &TouchPoint| t.row == row && (t.end == interval || t.end == interval + 1);
        self.mesh.touch_points().iter().any(beside) && self.touch_at(node, row).is_none()
    }

    /// The touch point of a path row at a node.
    pub(crate) fn touch_at(&self, node: usize, row: usize) -> Option<&TouchPoint> {
        self.mesh.touch_points().iter().find(|t| t.row == row && self.touch_node(t) == node)
    }

    /// The end of an arc along a bound of a path row that begins the interval of a node.
    pub(crate) fn exit_at(&self, node: usize, row: usize) -> Option<&Junction> {
        let exits = self.junctions.iter().filter(|j| !j.is_entry && j.row == row);
        exits.into_iter().find(|j| self.interval_start(j.end) == node)
    }

    /// Says whether a node is in the interval beside a smooth junction of a row, where its bounds are left out: the rate that vanishes
    /// there keeps the row within them, once the junction has its place.
    pub(crate) fn is_beside_junction(&self, node: usize, row: usize) -> bool {
        let interval = self.nodes[node].interval;
        let beside = |j: &Junction| interval == if j.is_entry { j.end - 1 } else { j.end };
        self.junctions.iter().any(|j| j.is_smooth && j.row == row && beside(j))
    }

    /// The arc along the bound of a row that has the first rate of the row at a node.
    pub(crate) fn rate_arc_at(&self, node: usize, row: usize) -> Option<&RateArc> {
        self.rate_arcs.iter().find(|a| a.row == row && self.arcs[a.arc].nodes.contains(&node))
    }

    /// Rows of the durations of the arcs, if there are several.
    pub(crate) fn arc_rows(&self) -> Range<usize> {
        self.first_arc_row.map_or(0..0, |r| r..r + self.arcs.len())
    }

    /// Columns of the times of the breaks.
    pub(crate) fn break_times(&self) -> Range<usize> {
        self.ends.initial_time + 1..self.ends.final_time
    }

    /// Index of the arc that a node belongs to.
    pub(crate) fn arc_of(&self, node: usize) -> usize {
        self.arcs.partition_point(|a| a.nodes.end <= node)
    }

    /// Duration of an arc at the point `x`.
    pub(crate) fn arc_duration(&self, arc: usize, x: &[f64]) -> f64 {
        x[self.arcs[arc].end_time] - x[self.arcs[arc].start_time]
    }

    /// Time of a node at the point `x`.
    pub(crate) fn time(&self, node: usize, x: &[f64]) -> f64 {
        let arc = &self.arcs[self.arc_of(node)];
        let s = self.nodes[node].share;
        (1.0 - s) * x[arc.start_time] + s * x[arc.end_time]
    }
}

/// The placement of a whole problem on a mesh.
pub(crate) fn collocation_layout(ocp: &Ocp, mesh: &Mesh) -> Result<Layout<CollocationPhase>, RadauError> {
    let mut places = Places::default();
    let phases = ocp.phases.iter().zip(&mesh.phases);
    let phases = phases.map(|(phase, mesh)| CollocationPhase::new(phase, mesh, &mut places));
    let phases = phases.collect::<Result<_, _>>()?;
    Ok(Layout::new(ocp, phases, places))
}

impl CollocationPhase {
    fn new(phase: &Phase, stated_mesh: &PhaseMesh, places: &mut Places) -> Result<Self, RadauError> {
        let mesh = freed(stated_mesh)?;
        let rules = mesh.points().iter().map(|&n| Lgr::shared(n)).collect::<Result<Vec<_>, _>>()?;
        let nodes = collocation_points(&mesh, &rules);
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let rows_per_node = nx + phase.path_rows();
        let initial_state = places.take_columns(nodes.len() * (nx + nu));
        let final_state = places.take_columns(nx);
        let initial_time = places.take_columns(mesh.arcs().len() + 1);
        let arcs = arcs(&mesh, initial_time);
        let first_row = places.take_rows(nodes.len() * rows_per_node);
        let times = (initial_time, initial_time + arcs.len());
        let ends = PhaseEnds::new(phase, (initial_state, final_state), times, places);
        let first_arc_row = (arcs.len() > 1).then(|| places.take_rows(arcs.len()));
        let pinned = mesh.breaks().iter().zip(initial_time + 1..).filter(|(b, _)| !b.free);
        let pinned_rows =
            pinned.map(|(b, column)| (places.take_rows(1), column, mesh.fractions()[b.end])).collect();
        let degree_rows = singular(&mesh).map(|(interval, c)| (places.take_rows(1), interval, c)).collect();
        let is_free = |t: &&TouchPoint| mesh.breaks().iter().any(|b| b.end == t.end && b.free);
        let touch_points = mesh.touch_points().iter().filter(is_free);
        let mut rate_rows: Vec<RateRow> = touch_points
            .map(|t| RateRow {
                at: places.take_rows(1),
                row: t.row,
                interval: t.end,
                at_end: false,
                order: 1,
            })
            .collect();
        let (junctions, implied_rows) = (junctions(phase, &mesh), implied_at_start(phase, &mesh));
        rate_rows.extend(junctions.iter().flat_map(|j| rate_rows_of(j, || places.take_rows(1))));
        rate_rows.extend(rate_rows_at_end(phase, &mesh, || places.take_rows(1)));
        Ok(Self {
            ends,
            states: nx,
            controls: nu,
            stated_mesh: stated_mesh.clone(),
            rules,
            nodes,
            arcs,
            first_row,
            rows_per_node,
            first_arc_row,
            pinned_rows,
            degree_rows,
            rate_rows,
            rate_arcs: rate_arcs(phase, &mesh, &junctions),
            junctions,
            implied_rates: implied_rates(phase, &implied_rows),
            rows_at_start: free_at_start(phase, &implied_rows),
            implied_rows,
            first_stage: places.take_stages(elimination::stages(mesh.intervals())),
            mesh,
        })
    }
}

/// The mesh with breaks of free time at its touch points and crossings.
fn freed(mesh: &PhaseMesh) -> Result<PhaseMesh, RadauError> {
    let (mut breaks, mut arcs) = (mesh.breaks().to_vec(), mesh.arcs().to_vec());
    let touched = mesh.touch_points().iter().map(|t| t.end);
    for end in touched.chain(mesh.crossings().iter().map(|c| c.end)) {
        let k = breaks.partition_point(|b| b.end < end);
        match breaks.get_mut(k).filter(|b| b.end == end) {
            Some(b) => b.free = true,
            None => {
                breaks.insert(k, Break { end, free: true, is_tangent: false });
                arcs.insert(k, arcs[k].clone());
            }
        }
    }
    Ok(mesh.clone().with_arcs(breaks, arcs)?)
}

fn collocation_points(mesh: &PhaseMesh, rules: &[Arc<Lgr>]) -> Vec<Node> {
    let mut nodes = Vec::with_capacity(mesh.total_points());
    for arc in 0..mesh.arcs().len() {
        let intervals = mesh.arc_intervals(arc);
        let (first, last) = (mesh.fractions()[intervals.start], mesh.fractions()[intervals.end]);
        let share = |fraction: f64| (fraction - first) / (last - first);
        for interval in intervals {
            let rule = &rules[interval];
            let (start, end) = (mesh.fractions()[interval], mesh.fractions()[interval + 1]);
            let (a, b) = (share(start), share(end));
            for (local, (tau, w)) in rule.nodes().iter().zip(rule.weights()).enumerate() {
                nodes.push(Node {
                    interval,
                    local,
                    fraction: start + 0.5 * (end - start) * (tau + 1.0),
                    share: a + 0.5 * (b - a) * (tau + 1.0),
                    width: b - a,
                    weight: 0.5 * (b - a) * w,
                });
            }
        }
    }
    nodes
}

fn arcs(mesh: &PhaseMesh, first_time: usize) -> Vec<ArcLayout> {
    let first_node = |interval: usize| mesh.points()[..interval].iter().sum::<usize>();
    (0..mesh.arcs().len())
        .map(|k| {
            let intervals = mesh.arc_intervals(k);
            ArcLayout {
                nodes: first_node(intervals.start)..first_node(intervals.end),
                start_time: first_time + k,
                end_time: first_time + k + 1,
            }
        })
        .collect()
}

/// Intervals and controls along singular arcs.
fn singular(mesh: &PhaseMesh) -> impl Iterator<Item = (usize, usize)> + '_ {
    mesh.arcs().iter().enumerate().flat_map(move |(k, arc)| {
        let controls = arc.controls.iter().enumerate();
        controls.filter(|(_, course)| **course == Some(ArcKind::Singular)).flat_map(move |(c, _)| {
            let several = move |interval: &usize| mesh.points()[*interval] > 1;
            mesh.arc_intervals(k).filter(several).map(move |interval| (interval, c))
        })
    })
}
