//! The part of the program at the nodes and segments of a phase: start, bounds, scales, least lengths, multipliers, names, stages.

use apsides_nlp::{Scaling as NlpScaling, Stages};
use apsides_ocp::{Bounds, Phase, PhaseGuess, PhaseScaling, PhaseTrajectory, RowOrigin};
use apsides_transcription::{ConstantEntry, Limits, PhaseEnds, PhaseLayout, PhaseStart};

use super::layout::ShootingPhase;

impl PhaseLayout for ShootingPhase {
    fn ends(&self) -> &PhaseEnds {
        &self.ends
    }

    fn quantities(&self) -> Vec<Vec<usize>> {
        let nodes = || (0..=self.segments.len()).map(|k| self.state_column(k));
        let points = || self.segments.iter().flat_map(|s| &s.control_columns);
        let states = (0..self.states).map(|s| nodes().map(|c| c + s).collect());
        let controls = (0..self.controls).map(|u| points().map(|c| c + u).collect());
        states.chain(controls).chain([self.inner_times().collect()]).collect()
    }

    fn lasts(&self, x: &[f64]) -> bool {
        self.node_times(x).windows(2).all(|w| w[0] < w[1])
    }

    fn set_start(&self, guess: &PhaseGuess, x: &mut [f64]) {
        for node in 0..=self.segments.len() {
            guess.state(self.fraction(node), &mut x[self.state_column(node)..][..self.states]);
        }
        for (k, s) in self.segments.iter().enumerate() {
            for (j, &c) in s.control_columns.iter().enumerate() {
                let fraction = self.fraction_in(k, s.controls.place(j));
                let (start, end) = (self.fraction(k), self.fraction(k + 1));
                control_inside(guess, start, end, fraction, &mut x[c..][..self.controls]);
            }
        }
        for (k, time) in self.inner_times().enumerate() {
            let fraction = self.fraction(k + 1);
            x[time] = (1.0 - fraction) * guess.initial_time + fraction * guess.final_time;
        }
    }

    fn set_bounds(&self, start: &PhaseStart<'_>, variables: &mut Limits, rows: &mut Limits) {
        let phase = start.phase;
        for node in 0..=self.segments.len() {
            for (s, state) in phase.states.iter().enumerate() {
                let along = state.variable.bounds;
                let bounds = match node {
                    0 => along.intersect(&state.initial),
                    n if n == self.segments.len() => along.intersect(&state.terminal),
                    _ => along,
                };
                variables.set(self.state_column(node) + s, bounds);
            }
        }
        for first in self.segments.iter().flat_map(|s| &s.control_columns) {
            for (c, control) in phase.controls.iter().enumerate() {
                variables.set(first + c, control.bounds);
            }
        }
        for s in &self.segments {
            for firsts in s.path_rows.chunks(phase.path.len().max(1)) {
                for (c, &first) in phase.path.iter().zip(firsts) {
                    c.rows.iter().zip(first..).for_each(|(v, row)| rows.set(row, v.bounds));
                }
            }
            for &(_, state, row) in &s.bound_rows {
                rows.set(row, phase.states[state].variable.bounds);
            }
            if let Some(r) = s.length_row {
                rows.set(r, Bounds::at_least(0.0));
            }
        }
    }

    fn set_scales(&self, phase: &Phase, s: &PhaseScaling, scales: &mut NlpScaling) {
        let NlpScaling { variables, constraints, .. } = scales;
        for node in 0..=self.segments.len() {
            variables[self.state_column(node)..][..self.states].copy_from_slice(&s.states);
        }
        for segment in &self.segments {
            for &c in &segment.control_columns {
                variables[c..][..self.controls].copy_from_slice(&s.controls);
            }
            constraints[segment.matching_row..][..self.states].copy_from_slice(&s.states);
            for rows in segment.path_rows.chunks(phase.path.len().max(1)) {
                for (c, &first) in phase.path.iter().zip(rows) {
                    let sizes = c.rows.iter().map(|row| row.size().unwrap_or(f64::NAN));
                    constraints[first..].iter_mut().zip(sizes).for_each(|(scale, size)| *scale = size);
                }
            }
            for &(_, state, row) in &segment.bound_rows {
                constraints[row] = s.states[state];
            }
            if let Some(r) = segment.length_row {
                constraints[r] = s.time / self.segments.len() as f64;
            }
        }
        for time in self.inner_times() {
            variables[time] = s.time;
        }
    }

    /// The rows are the lengths of the segments with unknown ends, less the least ones.
    fn constant_entries(&self) -> Vec<ConstantEntry> {
        let mut entries = Vec::new();
        for (k, s) in self.segments.iter().enumerate() {
            let Some(r) = s.length_row else { continue };
            let share = self.least_length * (self.fraction(k + 1) - self.fraction(k));
            entries.extend([(r, s.times.0, -1.0), (r, s.times.1, 1.0)]);
            entries.extend([(r, self.ends.initial_time, share), (r, self.ends.final_time, -share)]);
        }
        entries
    }

    fn row_origin(&self, phase: &Phase, row: usize, x: &[f64]) -> Option<RowOrigin> {
        let k = self.segments.iter().position(|s| (s.matching_row..s.end_row).contains(&row))?;
        segment_row_origin(phase, self, k, row, x)
    }

    fn set_multipliers(&self, phase: &Phase, t: &PhaseTrajectory, x: &[f64], y: &mut [f64]) {
        let Some(costate) = &t.costate else { return };
        let path_rows = phase.path_rows();
        let path = t.path_multipliers.as_ref().filter(|m| m.dimension() == path_rows);
        let mut values = vec![0.0; path_rows];
        for (k, segment) in self.segments.iter().enumerate() {
            let end = t.time_at(self.fraction(k + 1));
            // From the left: the costate of the segment that ends here.
            let middle = t.time_at(0.5 * (self.fraction(k) + self.fraction(k + 1)));
            let matching = &mut y[segment.matching_row..][..self.states];
            costate.evaluate_in(costate.segment_at(middle), end, matching);
            matching.iter_mut().for_each(|v| *v = -*v);
            let Some(path) = path else { continue };
            for (point, rows) in segment.path_rows.chunks(phase.path.len().max(1)).enumerate() {
                path.evaluate_in(
                    path.segment_at(middle),
                    t.time_at(self.fraction_in(k, segment.rows.place(point))),
                    &mut values,
                );
                let seconds = segment.row_seconds(point, x);
                let mut first = 0;
                for (c, row) in phase.path.iter().zip(rows) {
                    for (k, mu) in values[first..first + c.rows.len()].iter().enumerate() {
                        y[row + k] += seconds * mu;
                    }
                    first += c.rows.len();
                }
            }
        }
    }

    /// Segment by segment: controls, state, matching conditions.
    fn set_stages(&self, stages: &mut Stages) {
        let Stages { variables, constraints } = stages;
        for s in &self.segments {
            variables[s.state_column..][..self.states].fill(s.stage + 2);
            constraints[s.matching_row..s.end_row].fill(s.stage + 3);
        }
        // Later segments first, so that a shared point belongs to the earlier one.
        for s in self.segments.iter().rev() {
            for &c in &s.control_columns {
                variables[c..][..self.controls].fill(s.stage);
            }
        }
        for (s, time) in self.segments[1..].iter().zip(self.inner_times()) {
            variables[time] = s.stage + 2;
        }
        variables[self.ends.final_state..][..self.states].fill(self.end_stage + 2);
    }
}

/// Control of the guess, at the ends of a segment as it is inside: an earlier trajectory may jump there.
fn control_inside(guess: &PhaseGuess, start: f64, end: f64, fraction: f64, out: &mut [f64]) {
    let Some(earlier) = guess.as_trajectory() else { return guess.control(fraction, out) };
    let middle = earlier.time_at(0.5 * (start + end));
    let (breaks, time) = (earlier.control.breaks(), earlier.time_at(fraction));
    let piece = earlier.control.segment_at(middle);
    // A segment within a piece, up to rounding.
    let slack = 1e-9 * (breaks[breaks.len() - 1] - breaks[0]);
    if earlier.time_at(start) >= breaks[piece] - slack && earlier.time_at(end) <= breaks[piece + 1] + slack {
        earlier.control.evaluate_in(piece, time, out);
    } else {
        guess.control(fraction, out);
    }
}

fn segment_row_origin(
    phase: &Phase,
    p: &ShootingPhase,
    k: usize,
    row: usize,
    x: &[f64],
) -> Option<RowOrigin> {
    let segment = &p.segments[k];
    let at = |place: f64, name: String, unit: &str| RowOrigin {
        phase: Some(phase.name.clone()),
        name,
        unit: unit.into(),
        time: Some(segment.time(x, place)),
    };
    if let Some(v) = phase.states.get(row - segment.matching_row).map(|s| &s.variable) {
        return Some(at(1.0, format!("equation of motion of {}", v.name), &v.unit));
    }
    if let Some(&(point, state, _)) = segment.bound_rows.iter().find(|b| b.2 == row) {
        let v = &phase.states[state].variable;
        return Some(at(segment.rows.place(point), v.name.clone(), &v.unit));
    }
    if segment.length_row == Some(row) {
        return Some(at(0.0, "least length of a segment".into(), &phase.time_unit));
    }
    let rows = segment.path_rows.chunks(phase.path.len().max(1)).enumerate();
    rows.flat_map(|(point, rows)| phase.path.iter().zip(rows).map(move |(c, &first)| (point, c, first)))
        .filter(|(_, _, first)| *first <= row)
        .find_map(|(point, c, first)| {
            let v = c.rows.get(row - first)?;
            Some(at(segment.rows.place(point), v.name.clone(), &v.unit))
        })
}
