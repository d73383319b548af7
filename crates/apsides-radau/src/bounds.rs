//! Bounds of the columns and rows of the nodes, with what the mesh holds along its arcs.

use apsides_ocp::explicit_time::behind;
use apsides_ocp::{ArcKind, Bounds, Kink};
use apsides_transcription::{Limits, PhaseStart};

use crate::layout::CollocationPhase;

/// Least duration of an arc between breaks, as a part of the phase's in the guess.
pub(crate) const LEAST_ARC: f64 = 1e-6;

/// A state that passes a kink is beyond it at the interval end there by this part of its largest value: the node belongs to the interval behind, the
/// rates of which may differ.
const BEYOND: f64 = 1e-14;

/// Sets the bounds of states and controls.
pub(crate) fn set_variables(p: &CollocationPhase, start: &PhaseStart<'_>, limits: &mut Limits) {
    let phase = start.phase;
    let last = p.nodes.len();
    let implied = implied_bounds(p, start);
    for node in 0..=last {
        for (s, state) in phase.states.iter().enumerate() {
            let along = state.variable.bounds;
            let bounds = match node {
                0 => along.intersect(&state.initial),
                n if n == last => along.intersect(&state.terminal),
                n if implied[n * p.states + s] => Bounds::FREE,
                _ => along,
            };
            limits.set(p.state_column(node) + s, bounds);
        }
        if node < last {
            let held = &p.mesh.arcs()[p.arc_of(node)].controls;
            for (c, control) in phase.controls.iter().enumerate() {
                limits.set(p.control_column(node) + c, bounds_along(control.bounds, held, c));
            }
        }
    }
    for (s, value) in states_held_at_end(p, start) {
        limits.set(p.state_column(last) + s, Bounds::fixed(value));
    }
    // A state that starts at a kink is beyond it from there on.
    for kink in &phase.kinks {
        let Kink::State { state, value } = *kink else { continue };
        if phase.states[state].initial != Bounds::fixed(value) {
            continue;
        }
        let mut course = (1..=last).map(|node| start.point[p.state_column(node) + state] - value);
        if let Some(away) = course.find(|away| *away != 0.0) {
            limits.set(p.state_column(0) + state, Bounds::fixed(beyond(p, start, state, value, away > 0.0)));
        }
    }
    for c in p.mesh.crossings() {
        match phase.kinks[c.kink] {
            Kink::State { state, value } => {
                let at = p.state_column(p.interval_start(c.end)) + state;
                limits.set(at, Bounds::fixed(beyond(p, start, state, value, c.rising)));
            }
            Kink::Time(value) => {
                let time = p.break_times().zip(p.mesh.breaks()).find(|(_, b)| b.end == c.end);
                if let Some((column, _)) = time {
                    limits.set(column, Bounds::fixed(behind(value)));
                }
            }
        }
    }
}

/// The value of a state beyond a kink that it passes.
fn beyond(p: &CollocationPhase, start: &PhaseStart<'_>, state: usize, value: f64, rising: bool) -> f64 {
    let along = (0..=p.nodes.len()).map(|node| start.point[p.state_column(node) + state].abs());
    let size = along.fold(value.abs(), f64::max);
    value + if rising { BEYOND * size } else { -BEYOND * size }
}

/// The states that a row holds along the last arc, with their values at the end of the phase, which is no collocation point: nothing else holds
/// them there, and the control would end in an oscillation that costs nothing at the points.
fn states_held_at_end(p: &CollocationPhase, start: &PhaseStart<'_>) -> Vec<(usize, f64)> {
    let PhaseStart { phase, point, parameters, .. } = *start;
    let (Some(last), end) = (p.mesh.arcs().last(), p.nodes.len()) else { return Vec::new() };
    // What costs or bends by the control itself does not oscillate.
    let is_control = |c: &usize| (p.states..p.states + p.controls).contains(c);
    let bends = |(a, b): &(usize, usize)| is_control(a) && is_control(b);
    if phase.functions().any(|f| f.pattern().hessian.iter().any(bends)) {
        return Vec::new();
    }
    let mut found = Vec::new();
    let mut first = 0;
    for path in &phase.path {
        let f = path.function.as_ref();
        let (pattern, mut z) = (f.pattern(), vec![0.0; f.inputs()]);
        let (mut values, mut entries) = (vec![0.0; f.outputs()], vec![0.0; pattern.jacobian_len()]);
        let time = z.len() - 1;
        z[..p.states].copy_from_slice(&point[p.state_column(end)..][..p.states]);
        z[p.states + p.controls..time].copy_from_slice(&parameters[..time - p.states - p.controls]);
        f.jacobian(&z, &mut values, &mut entries);
        for (k, row) in path.rows.iter().enumerate() {
            let places = pattern.row_offsets[k]..pattern.row_offsets[k + 1];
            let [state] = pattern.columns[places.clone()] else { continue };
            let is_line = state < p.states && !pattern.hessian.contains(&(state, state));
            let (Some(bound), slope) = (held(&last.rows, first + k, &row.bounds), entries[places.start])
            else {
                continue;
            };
            if is_line && slope != 0.0 && !phase.states[state].terminal.is_fixed() {
                found.push((state, z[state] + (bound - values[k]) / slope));
            }
        }
        first += path.rows.len();
    }
    found
}

/// Sets the bounds of path constraints and of the durations of arcs.
pub(crate) fn set_rows(p: &CollocationPhase, start: &PhaseStart<'_>, limits: &mut Limits) {
    for node in 0..p.nodes.len() {
        let held = &p.mesh.arcs()[p.arc_of(node)].rows;
        for (k, row) in start.phase.path.iter().flat_map(|c| &c.rows).enumerate() {
            let met = p.touch_at(node, k).map(|t| t.upper).or(p.exit_at(node, k).map(|j| j.upper));
            let bounds = match met {
                Some(upper) => Bounds::fixed(if upper { row.bounds.upper } else { row.bounds.lower }),
                None if p.is_beside_touch(node, k) || p.is_beside_junction(node, k) => Bounds::FREE,
                None if p.implied_rows.contains(&(node, k)) => Bounds::FREE,
                None if p.rate_arc_at(node, k).is_some() => Bounds::fixed(0.0),
                None => bounds_along(row.bounds, held, k),
            };
            limits.set(p.path_row(node) + k, bounds);
        }
    }
    let least = LEAST_ARC * (start.guess.final_time - start.guess.initial_time);
    for r in p.arc_rows() {
        limits.set(r, Bounds::at_least(least));
    }
}

/// Nodes and states, node after node, whose bounds along the phase say nothing new: what cannot change along an arc is bounded
/// at its start, or fixed at the end of the phase. Stated again such a bound would leave no inside where it is active.
fn implied_bounds(p: &CollocationPhase, start: &PhaseStart<'_>) -> Vec<bool> {
    let phase = start.phase;
    let mut implied = vec![false; (p.nodes.len() + 1) * p.states];
    let mut fixed_later: Vec<bool> = phase.states.iter().map(|s| s.terminal.is_fixed()).collect();
    for (k, arc) in p.arcs.iter().enumerate().rev() {
        let constant = constant_states(p, k, start);
        for (s, constant) in constant.into_iter().enumerate() {
            fixed_later[s] &= constant;
            let first = arc.nodes.start + usize::from(!fixed_later[s]);
            for node in first..=arc.nodes.end {
                implied[node * p.states + s] |= constant;
            }
        }
    }
    implied
}

/// The states that have no rate along an arc because of the controls that are held there: neither the rate nor any of its
/// derivatives by what is free differs from zero at the start of the solve.
fn constant_states(p: &CollocationPhase, arc: usize, start: &PhaseStart<'_>) -> Vec<bool> {
    let PhaseStart { phase, point, parameters, .. } = *start;
    let courses = &p.mesh.arcs()[arc].controls;
    let held = |control: usize| held(courses, control, &phase.controls[control].bounds);
    let is_held = |control: usize| held(control).is_some();
    let mut constant = vec![(0..p.controls).any(is_held); p.states];
    if !constant.contains(&true) {
        return constant;
    }
    let pattern = phase.dynamics.pattern();
    let mut z = vec![0.0; phase.dynamics.inputs()];
    let (mut rates, mut entries) = (vec![0.0; p.states], vec![0.0; pattern.jacobian_len()]);
    let width = p.states + p.controls;
    for node in p.arcs[arc].nodes.clone() {
        z[..width].copy_from_slice(&point[p.state_column(node)..][..width]);
        for c in 0..p.controls {
            z[p.states + c] = held(c).unwrap_or(z[p.states + c]);
        }
        let time = z.len() - 1;
        z[width..time].copy_from_slice(&parameters[..time - width]);
        z[time] = p.time(node, point);
        phase.dynamics.jacobian(&z, &mut rates, &mut entries);
        for (c, rate) in constant.iter_mut().zip(&rates) {
            *c &= *rate == 0.0;
        }
        for ((r, c), v) in pattern.jacobian_entries().zip(&entries) {
            let free = c < p.states || c >= width || !is_held(c - p.states);
            constant[r] &= !(free && *v != 0.0);
        }
    }
    constant
}

/// The bounds that the quantity of this index has along an arc.
fn bounds_along(bounds: Bounds, courses: &[Option<ArcKind>], index: usize) -> Bounds {
    match courses.get(index) {
        Some(Some(ArcKind::Free)) => Bounds::FREE,
        _ => held(courses, index, &bounds).map_or(bounds, Bounds::fixed),
    }
}

fn held(courses: &[Option<ArcKind>], index: usize, bounds: &Bounds) -> Option<f64> {
    courses.get(index).copied().flatten().and_then(|course| course.held(bounds))
}
