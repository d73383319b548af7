//! Scales of the discretised problem: those of the statement, completed by what the functions do at the start.

use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling};
use apsides_ocp::{Ocp, Scaling};

use super::layout::Layout;
use super::transcription::Transcription;

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
        let objective = self.objective_change(&gradient);
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

    fn objective_change(&self, gradient: &[f64]) -> f64 {
        let change = |column: usize| gradient[column].abs() * self.scaling.variables[column];
        let mut largest = 0.0_f64;
        for p in &self.layout.phases {
            for state in 0..p.states {
                let nodes = 0..=p.segments.len();
                largest = largest.max(nodes.map(|k| change(p.state_column(k) + state)).sum());
            }
            for control in 0..p.controls {
                let columns = p.segments.iter().flat_map(|s| &s.control_columns);
                largest = largest.max(columns.map(|c| change(c + control)).sum());
            }
            largest = largest.max(change(p.initial_time)).max(change(p.final_time));
        }
        (self.layout.first_parameter..self.layout.variables).map(change).fold(largest, f64::max)
    }
}
