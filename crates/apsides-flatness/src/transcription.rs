//! The discretised problem: a nonlinear program in spline coefficients, times and parameters.

use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling};
use apsides_ocp::{Bounds, EndpointInput, Ocp, Phase, Scaling};
use apsides_transcription::{Limits, as_scale, row_changes, write_next};

use crate::estimate::quadrature;
use crate::flat_point::FlatPoint;
use crate::layout::{Layout, Time};
use crate::redundant;
use crate::rows::{Active, Row};
use crate::spline_mesh::SplineMesh;
use crate::start::Start;
use crate::terms::{EndQuantity, EndTerm, PathTerm};
use crate::{FlatSystem, FlatnessError};

/// A quantity of a point that is a row.
pub(crate) struct Direct {
    pub(crate) flat_point: usize,
    pub(crate) quantity: usize,
    pub(crate) row: Option<usize>,
}

/// A problem on splines, as a nonlinear program.
///
/// The structure is found once; evaluations write into the caller's slices and allocate nothing after the first.
pub struct Transcription {
    pub(crate) layout: Layout,
    pub(crate) sign: f64,
    pub(crate) rows: Vec<Row>,
    pub(crate) flat_points: Vec<FlatPoint>,
    pub(crate) direct: Vec<Direct>,
    pub(crate) terms: Vec<PathTerm>,
    pub(crate) ends: Vec<EndTerm>,
    linear_cost: Vec<(EndQuantity, f64)>,
    /// Points at start and end of each phase.
    phase_ends: Vec<(usize, usize)>,
    limits: Limits,
    pub(crate) start: Vec<f64>,
    pub(crate) scaling: NlpScaling,
    jacobian_pattern: Pattern,
    hessian_pattern: Pattern,
    /// Entry of the pattern that each second derivative of ends and points adds to, in their order.
    hessian_places: Vec<usize>,
    values_at: Vec<f64>,
    derivatives_at: Vec<f64>,
}

impl std::fmt::Debug for Transcription {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Transcription {{ variables: {}, constraints: {} }}",
            self.layout.variables,
            self.rows.len()
        )
    }
}

impl Transcription {
    /// Discretises a problem whose sizes have been checked.
    ///
    /// # Errors
    /// More equality constraints than variables, or constraints on constants that are not met.
    pub(crate) fn new(
        ocp: &Ocp,
        systems: &[FlatSystem],
        meshes: &[SplineMesh],
        start: &Start,
        scaling: &Scaling,
        active: &[Active],
    ) -> Result<Self, FlatnessError> {
        let layout = Layout::new(ocp, meshes);
        let sign = ocp.objective.sense.sign();
        let limits = variable_limits(ocp, &layout);
        let mut x = start.vector(&layout);
        limits.clamp(&mut x);
        let mut nlp = Self {
            sign,
            rows: Vec::new(),
            flat_points: Vec::new(),
            direct: Vec::new(),
            terms: Vec::new(),
            ends: Vec::new(),
            linear_cost: Vec::new(),
            phase_ends: Vec::new(),
            limits,
            start: x,
            scaling: NlpScaling {
                objective: scaling.objective.unwrap_or(f64::NAN),
                variables: start.scales(&layout, scaling),
                constraints: Vec::new(),
            },
            jacobian_pattern: Pattern::default(),
            hessian_pattern: Pattern::default(),
            hessian_places: Vec::new(),
            values_at: vec![f64::NAN; layout.variables],
            derivatives_at: vec![f64::NAN; layout.variables],
            layout,
        };
        for (k, phase) in ocp.phases.iter().enumerate() {
            nlp.add_phase(ocp, phase, k, &systems[k], &meshes[k], scaling, &active[k])?;
        }
        nlp.add_ends(ocp);
        nlp.find_jacobian();
        let dropped = nlp.redundant_rows()?;
        nlp.drop_rows(&dropped);
        nlp.find_jacobian();
        nlp.find_hessian();
        nlp.check_counts(ocp, systems, meshes)?;
        nlp.complete_scales();
        Ok(nlp)
    }

    /// Finds the rows that say nothing new.
    fn redundant_rows(&mut self) -> Result<Vec<bool>, FlatnessError> {
        let own_times = self.layout.phases.iter().flat_map(|p| p.own_times());
        let global = (self.layout.first_parameter..self.layout.variables).chain(own_times).collect();
        let (rows, start, scales) = (self.rows.clone(), self.start.clone(), self.scaling.variables.clone());
        redundant::rows(self, &rows, &global, &start, &scales)
    }

    fn add_row(&mut self, row: Row) -> usize {
        self.rows.push(row);
        self.rows.len() - 1
    }

    fn add_direct(&mut self, flat_point: usize, quantity: usize, row: Row) {
        let row = Some(self.add_row(row));
        self.direct.push(Direct { flat_point, quantity, row });
    }

    fn add_phase(
        &mut self,
        ocp: &Ocp,
        phase: &Phase,
        index: usize,
        system: &FlatSystem,
        mesh: &SplineMesh,
        scaling: &Scaling,
        active: &Active,
    ) -> Result<(), FlatnessError> {
        let first = self.flat_points.len();
        let scales = &scaling.phases[index];
        for fraction in [0.0, 1.0].iter().chain(&mesh.points) {
            self.flat_points.push(FlatPoint::new(system, mesh, &self.layout, index, *fraction));
        }
        self.phase_ends.push((first, first + 1));
        let q = self.flat_points[first].quantities;
        for (s, &fraction) in (first + 2..).zip(&mesh.points) {
            for k in 0..system.residuals {
                let name = format!("flat residual {k}");
                let row = Row::new(Some(phase), name, "", Some(fraction), Bounds::fixed(0.0), f64::NAN);
                self.add_direct(s, q.residual(k), row);
            }
            let inside = fraction > 0.0 && fraction < 1.0;
            for (k, state) in phase.states.iter().enumerate().filter(|(k, _)| inside && active.states[*k]) {
                let v = &state.variable;
                let row = Row::new(
                    Some(phase),
                    v.name.clone(),
                    &v.unit,
                    Some(fraction),
                    v.bounds,
                    scales.states[k],
                );
                self.add_direct(s, k, row);
            }
            for (k, v) in phase.controls.iter().enumerate().filter(|(k, _)| active.controls[*k]) {
                let row = Row::new(
                    Some(phase),
                    v.name.clone(),
                    &v.unit,
                    Some(fraction),
                    v.bounds,
                    scales.controls[k],
                );
                self.add_direct(s, q.control(k), row);
            }
            for (c, active) in phase.path.iter().zip(&active.path) {
                if !active.contains(&true) {
                    continue;
                }
                let rows = c.rows.iter().zip(active).map(|(v, active)| {
                    let size = v.size().unwrap_or(f64::NAN);
                    active.then(|| {
                        self.add_row(Row::new(
                            Some(phase),
                            v.name.clone(),
                            &v.unit,
                            Some(fraction),
                            v.bounds,
                            size,
                        ))
                    })
                });
                let rows = rows.collect();
                self.terms.push(PathTerm::path(&c.function, s, q.inputs(c.function.as_ref()), rows));
            }
        }
        for (flat_point, end, fraction) in [(first, "start", 0.0), (first + 1, "end", 1.0)] {
            for (k, state) in phase.states.iter().enumerate() {
                let stated = if fraction == 0.0 { state.initial } else { state.terminal };
                let along = if active.states[k] { state.variable.bounds } else { Bounds::FREE };
                let bounds = stated.intersect(&along);
                if bounds != Bounds::FREE {
                    let name = format!("{} at the {end}", state.variable.name);
                    let unit = &state.variable.unit;
                    let row = Row::new(Some(phase), name, unit, Some(fraction), bounds, scales.states[k]);
                    self.add_direct(flat_point, k, row);
                }
            }
        }
        if phase.needs_duration_row() {
            let row =
                Row::new(Some(phase), "duration".into(), &phase.time_unit, None, phase.duration, scales.time);
            self.add_direct(first, q.duration(), row);
        }
        self.add_integrals(ocp, phase, index, system, mesh)
    }

    /// Integrals by a Gauss rule in each segment.
    fn add_integrals(
        &mut self,
        ocp: &Ocp,
        phase: &Phase,
        index: usize,
        system: &FlatSystem,
        mesh: &SplineMesh,
    ) -> Result<(), FlatnessError> {
        let mut wanted = Vec::new();
        for (k, integral) in phase.integrals.iter().enumerate() {
            let cost = self.sign * ocp.objective.integral_weight(index, k);
            let v = &integral.variable;
            let row = (v.bounds != Bounds::FREE).then(|| {
                let size = v.size().unwrap_or(f64::NAN);
                self.add_row(Row::new(Some(phase), v.name.clone(), &v.unit, None, v.bounds, size))
            });
            if row.is_some() || cost != 0.0 {
                wanted.push((integral, row, cost));
            }
        }
        if wanted.is_empty() {
            return Ok(());
        }
        let named = |source| FlatnessError::Basis { place: format!("phase `{}`", phase.name), source };
        let rule = quadrature(mesh.order()).map_err(named)?;
        for segment in mesh.breaks.windows(2) {
            let half = 0.5 * (segment[1] - segment[0]);
            for (node, weight) in rule.nodes().iter().zip(rule.weights()) {
                let fraction = segment[0] + half * (node + 1.0);
                let flat_point = FlatPoint::new(system, mesh, &self.layout, index, fraction);
                for &(integral, row, cost) in &wanted {
                    let f = &integral.function;
                    let inputs = flat_point.quantities.inputs(f.as_ref());
                    let s = self.flat_points.len();
                    self.terms.push(PathTerm::integrand(f, s, inputs, half * weight, row, cost));
                }
                self.flat_points.push(flat_point);
            }
        }
        Ok(())
    }

    fn add_ends(&mut self, ocp: &Ocp) {
        for c in &ocp.constraints {
            let rows = c.rows.iter().map(|v| {
                let name = format!("{}: {}", c.name, v.name);
                let row = Row::new(None, name, &v.unit, None, v.bounds, v.size().unwrap_or(f64::NAN));
                (v.bounds != Bounds::FREE).then(|| self.add_row(row))
            });
            let rows = rows.collect();
            let inputs = c.inputs.iter().map(|i| self.end_quantity(*i)).collect();
            self.ends.push(EndTerm::new(&c.function, inputs, rows, 0.0));
        }
        for (inputs, f) in &ocp.objective.functions {
            let inputs = inputs.iter().map(|i| self.end_quantity(*i)).collect();
            self.ends.push(EndTerm::new(f, inputs, vec![None], self.sign));
        }
        let linear = ocp.objective.linear.iter();
        self.linear_cost = linear.map(|&(input, w)| (self.end_quantity(input), self.sign * w)).collect();
    }

    fn end_quantity(&self, input: EndpointInput) -> EndQuantity {
        let time = |t: Time| match t {
            Time::Column(c) => EndQuantity::Column(c),
            Time::Fixed(t) => EndQuantity::Constant(t),
        };
        match input {
            EndpointInput::InitialTime { phase } => time(self.layout.phases[phase].initial_time),
            EndpointInput::FinalTime { phase } => time(self.layout.phases[phase].final_time),
            EndpointInput::InitialState { phase, state } => EndQuantity::At(self.phase_ends[phase].0, state),
            EndpointInput::FinalState { phase, state } => EndQuantity::At(self.phase_ends[phase].1, state),
            EndpointInput::Parameter { index } => EndQuantity::Column(self.layout.first_parameter + index),
        }
    }

    fn find_jacobian(&mut self) {
        let mut jacobian = Vec::new();
        for d in self.direct.iter().filter_map(|d| d.row.map(|r| (r, d))) {
            jacobian.extend(self.flat_points[d.1.flat_point].gradient(d.1.quantity).map(|(c, _)| (d.0, c)));
        }
        for t in &self.terms {
            t.each_jacobian(&self.flat_points[t.flat_point], |r, c, _| jacobian.push((r, c)));
        }
        for t in &self.ends {
            t.each_jacobian(&self.flat_points, |r, c, _| jacobian.push((r, c)));
        }
        self.jacobian_pattern = Pattern::from_pairs(jacobian);
        self.values_at.fill(f64::NAN);
        self.derivatives_at.fill(f64::NAN);
    }

    /// Points share coefficients: each position stands once in the pattern.
    fn find_hessian(&mut self) {
        let multipliers = vec![0.0; self.rows.len()];
        let mut hessian = Vec::new();
        for t in &mut self.ends {
            t.each_hessian(&mut self.flat_points, 0.0, &multipliers, |i, j, _| hessian.push((i, j)));
        }
        for s in &self.flat_points {
            hessian.extend(s.hessian_positions());
        }
        (self.hessian_pattern, self.hessian_places) = merged(self.layout.variables, &hessian);
        self.values_at.fill(f64::NAN);
        self.derivatives_at.fill(f64::NAN);
    }

    /// Takes rows away; what is left moves up.
    fn drop_rows(&mut self, dropped: &[bool]) {
        let mut next = 0;
        let moved: Vec<Option<usize>> = dropped
            .iter()
            .map(|d| {
                next += usize::from(!d);
                (!d).then(|| next - 1)
            })
            .collect();
        let follow = |row: &mut Option<usize>| *row = row.and_then(|r| moved[r]);
        self.direct.iter_mut().for_each(|d| follow(&mut d.row));
        self.terms.iter_mut().flat_map(|t| &mut t.evaluated.rows).for_each(follow);
        self.ends.iter_mut().flat_map(|t| &mut t.evaluated.rows).for_each(follow);
        let mut keep = dropped.iter().map(|d| !d);
        self.rows.retain(|_| keep.next().unwrap_or(true));
    }

    fn check_counts(
        &self,
        ocp: &Ocp,
        systems: &[FlatSystem],
        meshes: &[SplineMesh],
    ) -> Result<(), FlatnessError> {
        let equalities = self.rows.iter().filter(|r| r.bounds.is_fixed()).count();
        let variables = self.limits.lower.iter().zip(&self.limits.upper).filter(|(l, u)| l < u).count();
        if equalities <= variables {
            return Ok(());
        }
        let share = |k: &usize| systems[*k].residuals * meshes[*k].points.len();
        let most = (0..meshes.len()).max_by_key(share).unwrap_or(0);
        let per_point = systems[most].residuals.max(1);
        let points = meshes[most].points.len();
        Err(FlatnessError::TooManyConstraints {
            place: format!("phase `{}`", ocp.phases[most].name),
            points,
            equalities,
            variables,
            least: meshes[most].least,
            most: points.saturating_sub((equalities - variables).div_ceil(per_point)),
        })
    }

    /// Scales that the statement leaves open: of a constraint its largest change when every variable moves by its scale from the
    /// start, of the objective its value there.
    fn complete_scales(&mut self) {
        let start = self.start.clone();
        let mut entries = vec![0.0; self.jacobian_pattern.len()];
        self.jacobian(&start, &mut entries);
        let changes = row_changes(self.rows.len(), &self.jacobian_pattern, &entries, &self.scaling.variables);
        let stated = self.rows.iter().map(|r| r.scale).zip(changes);
        self.scaling.constraints = stated.map(|(s, c)| if s.is_nan() { as_scale(c) } else { s }).collect();
        if self.scaling.objective.is_nan() {
            let size = self.objective(&start).abs();
            let mut gradient = vec![0.0; self.layout.variables];
            self.gradient(&start, &mut gradient);
            let change = gradient.iter().zip(&self.scaling.variables).map(|(g, s)| g.abs() * s).sum();
            // One coefficient alone moves the derivatives of an output far: what the objective is says more than its changes.
            self.scaling.objective = if size > 0.0 && size.is_finite() { size } else { as_scale(change) };
        }
    }

    fn set_values(&mut self, x: &[f64]) {
        if self.values_at != x {
            self.flat_points.iter_mut().for_each(|s| s.set_values(x));
            self.values_at.copy_from_slice(x);
        }
    }

    fn set_derivatives(&mut self, x: &[f64]) {
        if self.derivatives_at != x || self.values_at != x {
            self.flat_points.iter_mut().for_each(|s| s.set_derivatives(x));
            self.terms.iter_mut().for_each(|t| t.refresh(&self.flat_points[t.flat_point]));
            self.ends.iter_mut().for_each(|t| t.refresh(&self.flat_points, x));
            self.values_at.copy_from_slice(x);
            self.derivatives_at.copy_from_slice(x);
        }
    }
}

impl Nlp for Transcription {
    fn variables(&self) -> usize {
        self.layout.variables
    }

    fn constraints(&self) -> usize {
        self.rows.len()
    }

    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.limits.copy_to(lower, upper);
    }

    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        for ((l, u), row) in lower.iter_mut().zip(upper).zip(&self.rows) {
            (*l, *u) = (row.bounds.lower, row.bounds.upper);
        }
    }

    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.start);
    }

    fn jacobian_pattern(&self) -> Pattern {
        self.jacobian_pattern.clone()
    }

    fn hessian_pattern(&self) -> Pattern {
        self.hessian_pattern.clone()
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.set_values(x);
        let linear: f64 = self.linear_cost.iter().map(|(q, w)| w * q.value(&self.flat_points, x)).sum();
        let terms = self.terms.iter_mut().filter(|t| t.has_cost());
        let integrals: f64 = terms.map(|t| t.add_values(&self.flat_points[t.flat_point], &mut [])).sum();
        let ends = self.ends.iter_mut().filter(|t| t.has_cost());
        let ends: f64 = ends.map(|t| t.add_values(&self.flat_points, x, &mut [])).sum();
        linear + integrals + ends
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.set_derivatives(x);
        gradient.fill(0.0);
        for (q, w) in &self.linear_cost {
            q.each(&self.flat_points, |c, v| gradient[c] += w * v);
        }
        for t in self.terms.iter().filter(|t| t.has_cost()) {
            t.add_gradient(&self.flat_points[t.flat_point], gradient);
        }
        for t in self.ends.iter().filter(|t| t.has_cost()) {
            t.add_gradient(&self.flat_points, gradient);
        }
    }

    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        self.set_values(x);
        values.fill(0.0);
        for d in &self.direct {
            if let Some(r) = d.row {
                values[r] = self.flat_points[d.flat_point].values[d.quantity];
            }
        }
        for t in &mut self.terms {
            t.add_values(&self.flat_points[t.flat_point], values);
        }
        for t in &mut self.ends {
            t.add_values(&self.flat_points, x, values);
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.set_derivatives(x);
        let mut next = values.iter_mut();
        let mut push = |v| write_next(&mut next, v);
        for d in self.direct.iter().filter(|d| d.row.is_some()) {
            self.flat_points[d.flat_point].gradient(d.quantity).for_each(|(_, v)| push(v));
        }
        for t in &self.terms {
            t.each_jacobian(&self.flat_points[t.flat_point], |_, _, v| push(v));
        }
        for t in &self.ends {
            t.each_jacobian(&self.flat_points, |_, _, v| push(v));
        }
    }

    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        self.set_derivatives(x);
        self.flat_points.iter_mut().for_each(FlatPoint::clear);
        for d in &self.direct {
            if let Some(r) = d.row {
                self.flat_points[d.flat_point].add_weight(d.quantity, multipliers[r]);
            }
        }
        for &(q, w) in &self.linear_cost {
            if let EndQuantity::At(s, q) = q {
                self.flat_points[s].add_weight(q, objective_factor * w);
            }
        }
        for t in &mut self.terms {
            t.add_curvature(&mut self.flat_points[t.flat_point], objective_factor, multipliers);
        }
        values.fill(0.0);
        let mut places = self.hessian_places.iter();
        // As many places as there are entries.
        let mut add = |v| {
            if let Some(&place) = places.next() {
                values[place] += v;
            }
        };
        for t in &mut self.ends {
            t.each_hessian(&mut self.flat_points, objective_factor, multipliers, |_, _, v| add(v));
        }
        for s in &mut self.flat_points {
            s.hessian(&mut add);
        }
    }

    fn scaling(&self) -> Option<NlpScaling> {
        Some(self.scaling.clone())
    }
}

/// The different positions among `entries` of a matrix of `size` rows, and which of them each entry has.
fn merged(size: usize, entries: &[(usize, usize)]) -> (Pattern, Vec<usize>) {
    // Entries by rows: a counting sort.
    let mut next = vec![0; size + 1];
    entries.iter().for_each(|e| next[e.0 + 1] += 1);
    (0..size).for_each(|r| next[r + 1] += next[r]);
    let mut by_rows = vec![0; entries.len()];
    for (k, e) in entries.iter().enumerate() {
        by_rows[next[e.0]] = k;
        next[e.0] += 1;
    }
    let mut pattern = Pattern::default();
    let mut places = vec![0; entries.len()];
    // Last row in which each column was met, and its position there.
    let mut met = vec![(usize::MAX, 0); size];
    for k in by_rows {
        let (row, column) = entries[k];
        if met[column].0 != row {
            met[column] = (row, pattern.len());
            pattern.rows.push(row);
            pattern.cols.push(column);
        }
        places[k] = met[column].1;
    }
    (pattern, places)
}

fn variable_limits(ocp: &Ocp, layout: &Layout) -> Limits {
    let mut limits = Limits::new(layout.variables, Bounds::FREE);
    for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
        let (start, end) = phase.time_bounds();
        for (time, bounds) in [(p.initial_time, start), (p.final_time, end)] {
            if let Time::Column(c) = time {
                // Both phases bound a time that they share.
                limits.intersect(c, bounds);
            }
        }
    }
    for (k, v) in ocp.parameters.iter().enumerate() {
        limits.intersect(layout.first_parameter + k, v.bounds);
    }
    limits
}

#[cfg(test)]
mod tests;
