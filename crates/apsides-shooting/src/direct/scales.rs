//! Scales of the discretised problem: those of the statement, completed by what the functions do at the start.

use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling};
use apsides_ocp::{Ocp, Scaling};

use super::layout::Layout;
use super::transcription::Transcription;

/// A change by the gradient that is less than this part of that by the second derivatives is rounding.
const STATIONARY: f64 = 1e-8;

/// Scales of what has none of its own are NaN here, to be completed by [`Transcription::complete_scales`].
pub(crate) fn nlp_scaling(ocp: &Ocp, layout: &Layout, scaling: &Scaling) -> NlpScaling {
    let mut variables = vec![1.0; layout.variables];
    let mut constraints = vec![1.0; layout.constraints];
    for ((phase, p), s) in ocp.phases.iter().zip(&layout.phases).zip(&scaling.phases) {
        for node in 0..=p.segments.len() {
            variables[p.state_column(node)..][..p.states].copy_from_slice(&s.states);
        }
        for segment in &p.segments {
            for &c in &segment.control_columns {
                variables[c..][..p.controls].copy_from_slice(&s.controls);
            }
            constraints[segment.matching_row..][..p.states].copy_from_slice(&s.states);
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
                constraints[r] = s.time / p.segments.len() as f64;
            }
        }
        for time in p.inner_times() {
            variables[time] = s.time;
        }
        variables[p.initial_time] = s.time;
        variables[p.final_time] = s.time;
        for (q, row) in phase.integrals.iter().zip(&p.integral_rows) {
            if let Some(r) = row {
                constraints[*r] = q.variable.size().unwrap_or(f64::NAN);
            }
        }
        if let Some(r) = p.duration_row {
            constraints[r] = s.time;
        }
    }
    variables[layout.first_parameter..].copy_from_slice(&scaling.parameters);
    for (c, &first) in ocp.constraints.iter().zip(&layout.endpoint_rows) {
        for (k, row) in c.rows.iter().enumerate() {
            constraints[first + k] = row.size().unwrap_or(f64::NAN);
        }
    }
    NlpScaling { objective: scaling.objective.unwrap_or(f64::NAN), variables, constraints }
}

impl Transcription {
    /// Scales that the statement leaves open: of a constraint its largest change when a variable moves by its scale from the
    /// start, of the objective its change when all variables of one quantity do, the largest of all quantities.
    pub(crate) fn complete_scales(&mut self) {
        let pattern = self.jacobian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        let start = self.start.clone();
        self.jacobian(&start, &mut entries);
        let mut rows = vec![0.0_f64; self.layout.constraints];
        let Pattern { rows: row, cols: col } = &pattern;
        for ((&r, &c), v) in row.iter().zip(col).zip(&entries) {
            rows[r] = rows[r].max(v.abs() * self.scaling.variables[c]);
        }
        let mut gradient = vec![0.0; self.layout.variables];
        self.gradient(&start, &mut gradient);
        let objective = self.objective_change(&start, &gradient);
        let usable = |change: f64| if change > 0.0 && change.is_finite() { change } else { 1.0 };
        for (scale, change) in self.scaling.constraints.iter_mut().zip(rows) {
            if scale.is_nan() {
                *scale = usable(change);
            }
        }
        if self.scaling.objective.is_nan() {
            self.scaling.objective = usable(objective);
        }
    }

    /// By the gradient; where the start is stationary but for rounding, by the second derivatives.
    fn objective_change(&mut self, start: &[f64], gradient: &[f64]) -> f64 {
        let groups = self.quantities();
        let mut group_of = vec![usize::MAX; self.layout.variables];
        let mut slopes = vec![0.0; groups.len()];
        for (k, group) in groups.iter().enumerate() {
            for &c in group {
                slopes[k] += gradient[c].abs() * self.scaling.variables[c];
                group_of[c] = k;
            }
        }
        let pattern = self.hessian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        let none = vec![0.0; self.layout.constraints];
        self.hessian(start, 1.0, &none, &mut entries);
        let mut bends = vec![0.0; groups.len()];
        for ((&i, &j), h) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
            if group_of[i] == group_of[j] {
                let times = if i == j { 0.5 } else { 1.0 };
                bends[group_of[i]] += times * h.abs() * self.scaling.variables[i] * self.scaling.variables[j];
            }
        }
        let largest = |changes: &[f64]| changes.iter().copied().filter(|c| c.is_finite()).fold(0.0, f64::max);
        let (slope, bend) = (largest(&slopes), largest(&bends));
        if slope < STATIONARY * bend { bend } else { slope }
    }

    /// Columns of each quantity: a state or a control of a phase, a time, a parameter.
    fn quantities(&self) -> Vec<Vec<usize>> {
        let mut groups = Vec::new();
        for p in &self.layout.phases {
            let nodes = || (0..=p.segments.len()).map(|k| p.state_column(k));
            groups.extend((0..p.states).map(|s| nodes().map(|c| c + s).collect()));
            let points = || p.segments.iter().flat_map(|s| &s.control_columns);
            groups.extend((0..p.controls).map(|u| points().map(|c| c + u).collect()));
            groups.extend([vec![p.initial_time], vec![p.final_time], p.inner_times().collect()]);
        }
        groups.extend((self.layout.first_parameter..self.layout.variables).map(|c| vec![c]));
        groups
    }
}
