//! Scales of the discretised problem: those of the statement, completed by what the functions do at the start, and warnings
//! where the two are far apart.

use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling};
pub use apsides_ocp::method::ScaleWarning;
use apsides_ocp::{Ocp, RowOrigin, Scaling};

use crate::layout::Layout;
use crate::transcription::Transcription;

/// Ratio of a scale to what it should be that calls for a warning: the tolerance of the solver is then off by as much.
const EXTREME: f64 = 1e6;

impl Transcription {
    /// Scales that the statement leaves open: of a constraint its largest change when a variable moves by its scale from the
    /// start, of the objective its change when all variables of one quantity do, the largest of all quantities.
    pub(crate) fn complete_scales(&mut self) {
        let (rows, objective) = self.changes();
        let usable = |change: f64| change > 0.0 && change.is_finite();
        for (scale, change) in self.scaling.constraints.iter_mut().zip(rows) {
            if scale.is_nan() {
                *scale = if usable(change) { change } else { 1.0 };
            }
        }
        if self.scaling.objective.is_nan() {
            self.scaling.objective = if usable(objective) { objective } else { 1.0 };
        }
    }

    /// The changes of the rows and of the objective that [`complete_scales`](Self::complete_scales) speaks of.
    fn changes(&mut self) -> (Vec<f64>, f64) {
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
        let change = |column: usize| gradient[column].abs() * self.scaling.variables[column];
        let mut objective = 0.0_f64;
        for p in &self.layout.phases {
            let nodes = p.nodes.len();
            for state in 0..p.states {
                objective = objective.max((0..=nodes).map(|k| change(p.state_column(k) + state)).sum());
            }
            for control in 0..p.controls {
                objective = objective.max((0..nodes).map(|k| change(p.control_column(k) + control)).sum());
            }
            objective = (p.initial_time..=p.final_time).map(change).fold(objective, f64::max);
        }
        (rows, (self.layout.first_parameter..self.layout.variables).map(change).fold(objective, f64::max))
    }

    /// Scales that are extreme at the start, the worst row of each constraint.
    pub(crate) fn scale_warnings(&mut self, ocp: &Ocp) -> Vec<ScaleWarning> {
        let (rows, objective) = self.changes();
        let mut warnings = Vec::new();
        let mut add = |warning: ScaleWarning| {
            let comparable = warning.size > 0.0 && warning.size.is_finite();
            if !comparable || warning.factor() < EXTREME {
                return;
            }
            let same = |w: &&mut ScaleWarning| w.subject == warning.subject && w.phase == warning.phase;
            match warnings.iter_mut().find(same) {
                Some(known) if known.factor() < warning.factor() => *known = warning,
                Some(_) => {}
                None => warnings.push(warning),
            }
        };
        for (r, change) in rows.into_iter().enumerate() {
            let scale = self.scaling.constraints[r];
            let bound = largest_bound(self.row_lower[r], self.row_upper[r]);
            let off = |size: f64| size > 0.0 && (size / scale).max(scale / size) >= EXTREME;
            if !off(change) && !off(bound) {
                continue;
            }
            let Some(RowOrigin { phase, name, unit, .. }) = self.row_origin(ocp, r, &self.start) else {
                continue;
            };
            let (size, size_is) = if off(change) {
                (change, "with every variable moved by its scale it changes by")
            } else {
                (bound, "its bound is")
            };
            add(ScaleWarning { subject: format!("constraint `{name}`"), phase, scale, size, size_is, unit });
        }
        self.variable_warnings(ocp, &mut add);
        add(ScaleWarning {
            subject: format!("objective `{}`", ocp.objective.name),
            phase: None,
            scale: self.scaling.objective,
            size: objective,
            size_is: "with every variable moved by its scale it changes by",
            unit: ocp.objective.unit.clone(),
        });
        warnings
    }

    fn variable_warnings(&self, ocp: &Ocp, add: &mut impl FnMut(ScaleWarning)) {
        let largest = |columns: &mut dyn Iterator<Item = usize>| {
            columns.fold(0.0_f64, |largest, c| largest.max(self.start[c].abs()))
        };
        for (phase, p) in ocp.phases.iter().zip(&self.layout.phases) {
            let states = phase.states.iter().map(|s| &s.variable).enumerate();
            let states = states.map(|(s, v)| ("state", v, p.state_column(0) + s, p.nodes.len() + 1));
            let controls = phase.controls.iter().enumerate();
            let controls = controls.map(|(c, v)| ("control", v, p.control_column(0) + c, p.nodes.len()));
            for (kind, variable, first, count) in states.chain(controls) {
                let stride = p.states + p.controls;
                add(ScaleWarning {
                    subject: format!("{kind} `{}`", variable.name),
                    phase: Some(phase.name.clone()),
                    scale: self.scaling.variables[first],
                    size: largest(&mut (0..count).map(|k| first + k * stride)),
                    size_is: "its guess is of the size",
                    unit: variable.unit.clone(),
                });
            }
        }
        for (k, variable) in ocp.parameters.iter().enumerate() {
            let column = self.layout.first_parameter + k;
            add(ScaleWarning {
                subject: format!("parameter `{}`", variable.name),
                phase: None,
                scale: self.scaling.variables[column],
                size: self.start[column].abs(),
                size_is: "its guess is of the size",
                unit: variable.unit.clone(),
            });
        }
    }
}

/// Zero without a finite bound.
fn largest_bound(lower: f64, upper: f64) -> f64 {
    [lower, upper].into_iter().filter(|b| b.is_finite()).fold(0.0, |largest, b| largest.max(b.abs()))
}

/// Scales of what has none of its own are NaN here, to be completed by [`Transcription::complete_scales`].
pub(crate) fn nlp_scaling(ocp: &Ocp, layout: &Layout, scaling: &Scaling) -> NlpScaling {
    let mut variables = vec![1.0; layout.variables];
    let mut constraints = vec![1.0; layout.constraints];
    for ((phase, p), s) in ocp.phases.iter().zip(&layout.phases).zip(&scaling.phases) {
        for node in 0..=p.nodes.len() {
            variables[p.state_column(node)..][..p.states].copy_from_slice(&s.states);
            if node < p.nodes.len() {
                variables[p.control_column(node)..][..p.controls].copy_from_slice(&s.controls);
                constraints[p.defect_row(node)..][..p.states].copy_from_slice(&s.states);
                for (k, row) in phase.path.iter().flat_map(|c| &c.rows).enumerate() {
                    constraints[p.path_row(node) + k] = row.size().unwrap_or(f64::NAN);
                }
            }
        }
        variables[p.initial_time..=p.final_time].fill(s.time);
        for (q, row) in phase.integrals.iter().zip(&p.integral_rows) {
            if let Some(r) = row {
                constraints[*r] = q.variable.size().unwrap_or(f64::NAN);
            }
        }
        if let Some(r) = p.duration_row {
            constraints[r] = s.time;
        }
        if let Some(r) = p.first_arc_row {
            constraints[r..r + p.arcs.len()].fill(s.time);
        }
        for &(row, ..) in &p.pinned_rows {
            constraints[row] = s.time;
        }
        for &(row, _, c) in &p.degree_rows {
            constraints[row] = s.controls[c];
        }
        for (row, touch) in &p.rate_rows {
            constraints[*row] = constraints[p.path_row(p.touch_node(touch)) + touch.row];
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
