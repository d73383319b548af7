//! Junctions: where an arc along which a path constraint row without controls stays at a bound begins and ends.
//!
//! A row of order `q` has the control in its rate of order `q` first. Along the arc the row is held at its bound at every node, and at
//! its end, where its rates below the order vanish too: without these the last interval keeps a freedom that costs nothing. The time is
//! an unknown, which the cost alone does not determine: any part of the right arc would do as well. Where the controls are continuous the
//! rate of order `q` vanishes on the free side (Jacobson, Lele, Speyer, J. Math. Anal. Appl. 35 (1971) 255,
//! doi 10.1016/0022-247X(71)90219-8), which is the condition that determines the time. Its multiplier is zero at the optimum.

use apsides_ocp::{ArcKind, PathConstraint, Phase, PhaseArc, PhaseMesh};

/// An equality is met at the start of a phase within this, relative to its size.
const MET: f64 = 1e-9;

/// Rows of higher order are left to refinement.
const MOST_ORDER: usize = 2;

/// An end of an arc along a bound, with a free time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Junction {
    /// Index of the interval end.
    pub(crate) end: usize,
    /// Index of the row among those of the phase.
    pub(crate) row: usize,
    /// True at the start of the arc, false at its end.
    pub(crate) is_entry: bool,
    /// True along the upper bound.
    pub(crate) upper: bool,
    /// The least order of a rate of the row that depends on a control.
    pub(crate) order: usize,
    /// True where the controls are continuous.
    pub(crate) is_smooth: bool,
}

/// A path constraint and the index of one of its rows, by the index of the row among those of the phase.
pub(crate) fn row_function(phase: &Phase, row: usize) -> Option<(&PathConstraint, usize)> {
    let mut first = 0;
    let path = phase.path.iter().find(|c| {
        first += c.rows.len();
        row < first
    })?;
    Some((path, row + path.rows.len() - first))
}

/// The slopes of a row without controls by the states, at a state, parameters and a time; parameters that are not given are zero.
pub(crate) fn slopes_by_states(
    phase: &Phase,
    row: usize,
    (state, parameters, time): (&[f64], &[f64], f64),
) -> Vec<f64> {
    let mut slopes = vec![0.0; state.len()];
    let Some((path, output)) = row_function(phase, row) else { return slopes };
    let width = phase.states.len() + phase.controls.len();
    let mut z = vec![0.0; path.function.inputs()];
    let last = z.len() - 1;
    z[..state.len()].copy_from_slice(state);
    z[width..last].iter_mut().zip(parameters).for_each(|(z, p)| *z = *p);
    z[last] = time;
    let pattern = path.function.pattern();
    let (mut values, mut entries) = (vec![0.0; path.function.outputs()], vec![0.0; pattern.jacobian_len()]);
    path.function.jacobian(&z, &mut values, &mut entries);
    for ((r, c), v) in pattern.jacobian_entries().zip(&entries) {
        if r == output && c < slopes.len() {
            slopes[c] += v;
        }
    }
    slopes
}

/// The inputs that a row depends on.
pub(crate) fn columns(phase: &Phase, row: usize) -> Option<&[usize]> {
    let (path, output) = row_function(phase, row)?;
    let pattern = path.function.pattern();
    Some(&pattern.columns[pattern.row_offsets[output]..pattern.row_offsets[output + 1]])
}

/// Says whether a row depends on the time itself.
pub(crate) fn depends_on_time(phase: &Phase, row: usize) -> bool {
    let time = row_function(phase, row).map(|(path, _)| path.function.inputs() - 1);
    columns(phase, row).is_none_or(|columns| columns.iter().any(|c| Some(*c) == time))
}

/// The dependence of the rates of a row without controls.
pub(crate) struct Order {
    /// The least order of a rate that depends on a control.
    pub(crate) order: usize,
    /// The controls that this rate depends on.
    pub(crate) controls: Vec<usize>,
    /// The states that the row and each of its rates below the order depend on.
    states: Vec<Vec<usize>>,
}

/// The order of a row without controls; none where it is too high.
pub(crate) fn order(phase: &Phase, row: usize) -> Option<Order> {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let inputs = columns(phase, row)?;
    if inputs.iter().any(|c| (nx..nx + nu).contains(c)) {
        return None;
    }
    order_of(phase, inputs.iter().copied().filter(|c| *c < nx).collect())
}

/// The order of a function of these states, as [`order`].
pub(crate) fn order_of(phase: &Phase, states: Vec<usize>) -> Option<Order> {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let pattern = phase.dynamics.pattern();
    let mut states = vec![states];
    for order in 1..=MOST_ORDER {
        let last = &states[order - 1];
        let mut next: Vec<usize> = (last.iter())
            .flat_map(|s| &pattern.columns[pattern.row_offsets[*s]..pattern.row_offsets[s + 1]])
            .chain(last)
            .copied()
            .collect();
        next.sort_unstable();
        next.dedup();
        let controls: Vec<usize> =
            (next.iter().filter(|c| (nx..nx + nu).contains(c))).map(|c| c - nx).collect();
        if !controls.is_empty() {
            return Some(Order { order, controls, states });
        }
        next.retain(|c| *c < nx);
        states.push(next);
    }
    None
}

/// The nodes of the first arc, from the start of the phase on, that leave a row out which is held along it or is an equality: the row and its
/// rates below the order say nothing new as far as the initial states are fixed.
pub(crate) fn implied_at_start(phase: &Phase, mesh: &PhaseMesh) -> Vec<(usize, usize)> {
    let held = |row: &usize| held(&mesh.arcs()[0], *row).is_some();
    let nodes = |row: usize| {
        let order = order(phase, row)?;
        let is_fixed = |states: &&Vec<usize>| states.iter().all(|s| phase.states[*s].initial.is_fixed());
        let is_timed = depends_on_time(phase, row) && !phase.initial_time.is_fixed();
        let implied = if is_timed { 0 } else { order.states.iter().take_while(is_fixed).count() };
        (implied < mesh.points()[0]).then(move || (0..implied).map(move |node| (node, row)))
    };
    let along_arc = (0..phase.path_rows()).filter(held).filter_map(nodes).flatten();
    let equalities = (0..phase.path_rows()).filter(|row| !held(row) && is_met_at_start(phase, *row));
    along_arc.chain(equalities.map(|row| (0, row))).collect()
}

/// The rows of those that are left out at the first two nodes which are linear in the states, with their coefficients.
pub(crate) fn implied_rates(phase: &Phase, implied: &[(usize, usize)]) -> Vec<(usize, Vec<(usize, f64)>)> {
    let linear = |&(_, row): &(usize, usize)| {
        let (path, output) = row_function(phase, row)?;
        let pattern = path.function.pattern();
        let here = || pattern.jacobian_entries().zip(0..).filter(|((r, _), _)| *r == output);
        if !pattern.hessian.is_empty() || here().any(|((_, c), _)| c >= phase.states.len()) {
            return None;
        }
        let mut entries = vec![0.0; pattern.jacobian_len()];
        let (z, mut values) = (vec![0.0; path.function.inputs()], vec![0.0; path.function.outputs()]);
        path.function.jacobian(&z, &mut values, &mut entries);
        Some((row, here().map(|((_, c), k)| (c, entries[k])).collect()))
    };
    implied.iter().filter(|(node, _)| *node == 1).filter_map(linear).collect()
}

/// The rows without controls that the initial states do not imply.
pub(crate) fn free_at_start(phase: &Phase, implied: &[(usize, usize)]) -> Vec<usize> {
    let controls = phase.states.len()..phase.states.len() + phase.controls.len();
    let is_free_of_controls = |row: &usize| {
        columns(phase, *row).is_some_and(|columns| !columns.iter().any(|c| controls.contains(c)))
    };
    let is_implied = |row: &usize| implied.iter().any(|(_, r)| r == row);
    (0..phase.path_rows()).filter(|row| is_free_of_controls(row) && !is_implied(row)).collect()
}

/// Says whether a row is an equality of states and of time that are fixed at the start of the phase, and met there.
fn is_met_at_start(phase: &Phase, row: usize) -> bool {
    let Some((path, output)) = row_function(phase, row) else { return false };
    let bounds = path.rows[output].bounds;
    let Some(columns) = columns(phase, row).filter(|_| bounds.is_fixed()) else { return false };
    let mut z = vec![0.0; path.function.inputs()];
    let time = z.len() - 1;
    for &c in columns {
        let at_start = match phase.states.get(c) {
            Some(state) => state.initial,
            None if c == time => phase.initial_time,
            None => return false,
        };
        if !at_start.is_fixed() {
            return false;
        }
        z[c] = at_start.lower;
    }
    let mut values = vec![0.0; path.function.outputs()];
    path.function.value(&z, &mut values);
    let size = path.rows[output].size().unwrap_or(1.0).max(bounds.lower.abs());
    (values[output] - bounds.lower).abs() <= MET * size
}

/// The bound that a row is held at along an arc.
fn held(arc: &PhaseArc, row: usize) -> Option<ArcKind> {
    let course = arc.rows.get(row).copied().flatten();
    course.filter(|c| matches!(c, ArcKind::Lower | ArcKind::Upper))
}

/// The junctions of a mesh, in order of time.
pub(crate) fn junctions(phase: &Phase, mesh: &PhaseMesh) -> Vec<Junction> {
    let mut found = Vec::new();
    for (arcs, at) in mesh.arcs().windows(2).zip(mesh.breaks()).filter(|(_, at)| at.free) {
        for row in 0..phase.path_rows() {
            let sides = [held(&arcs[0], row), held(&arcs[1], row)];
            let (course, free) = match sides {
                [Some(course), None] => (course, &arcs[1]),
                [None, Some(course)] => (course, &arcs[0]),
                _ => continue,
            };
            let Some(Order { order, controls, .. }) = order(phase, row) else { continue };
            let course_of = |arc: &PhaseArc, c: usize| arc.controls.get(c).copied().flatten();
            let is_held = |c: &usize| !matches!(course_of(free, *c), None | Some(ArcKind::Free));
            // A control at its bound that the arc begins with keeps the row from crossing its own.
            let meets = |c: &usize| !is_held(c) || at.is_tangent;
            let is_smooth = controls.iter().all(meets);
            let (is_entry, upper) = (sides[0].is_none(), course == ArcKind::Upper);
            found.push(Junction { end: at.end, row, is_entry, upper, order, is_smooth });
        }
    }
    found
}

/// An arc along a bound that has the first rate of the row at its points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RateArc {
    /// Index of the arc.
    pub(crate) arc: usize,
    /// Index of the row among those of the phase.
    pub(crate) row: usize,
    /// True along the upper bound.
    pub(crate) upper: bool,
    /// Interval ends where it begins and ends.
    pub(crate) ends: [usize; 2],
}

/// The arcs of rows of order two that begin and end within the phase.
pub(crate) fn rate_arcs(phase: &Phase, mesh: &PhaseMesh, junctions: &[Junction]) -> Vec<RateArc> {
    let arcs = (0..mesh.arcs().len()).map(|arc| (arc, mesh.arc_intervals(arc)));
    let at = |end: usize, row: usize| junctions.iter().find(|j| j.end == end && j.row == row);
    let mut found = Vec::new();
    for (arc, intervals) in arcs {
        for entry in
            junctions.iter().filter(|j| j.is_entry && j.end == intervals.start && j.order == MOST_ORDER)
        {
            let ends = [intervals.start, intervals.end];
            let has_rate = row_function(phase, entry.row)
                .is_some_and(|(path, _)| path.function.inputs() == phase.dynamics.inputs());
            if has_rate && at(intervals.end, entry.row).is_some_and(|exit| !exit.is_entry) {
                found.push(RateArc { arc, row: entry.row, upper: entry.upper, ends });
            }
        }
    }
    found
}

/// A condition that a rate of a row vanishes at an end of an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RateRow {
    /// Constraint row.
    pub(crate) at: usize,
    /// Index of the path constraint row.
    pub(crate) row: usize,
    /// Interval whose polynomial has the rate.
    pub(crate) interval: usize,
    /// True at the end of the interval, false at its start.
    pub(crate) at_end: bool,
    /// Order of the rate.
    pub(crate) order: usize,
}

/// The first rates that vanish at the end of the phase, where an arc along the bound of a row of order two lasts to it, with constraint rows
/// from a source of them.
pub(crate) fn rate_rows_at_end(
    phase: &Phase,
    mesh: &PhaseMesh,
    mut take: impl FnMut() -> usize,
) -> Vec<RateRow> {
    let last = &mesh.arcs()[mesh.arcs().len() - 1];
    let rows = (0..phase.path_rows()).filter(|row| held(last, *row).is_some());
    let second = rows.filter(|row| order(phase, *row).is_some_and(|o| o.order == MOST_ORDER));
    let interval = mesh.intervals() - 1;
    second.map(|row| RateRow { at: take(), row, interval, at_end: true, order: 1 }).collect()
}

/// The rates that vanish at a junction, with constraint rows from a source of them.
pub(crate) fn rate_rows(j: &Junction, mut take: impl FnMut() -> usize) -> Vec<RateRow> {
    let interval = if j.is_entry { j.end - 1 } else { j.end };
    let least = if j.is_entry { j.order } else { 1 };
    let most = if j.is_smooth { j.order } else { j.order - 1 };
    let rate = |order| RateRow { at: take(), row: j.row, interval, at_end: j.is_entry, order };
    (least..=most).map(rate).collect()
}
