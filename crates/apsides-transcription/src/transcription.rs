//! The discretised problem: a sparse nonlinear program of constant entries, the terms of a method, and functions of end quantities.

use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling, Stages};
use apsides_ocp::{Bounds, EndpointTerm, Guess, Ocp, Phase, Scaling};

use crate::discretisation::Discretisation;
use crate::layout::Layout;
use crate::limits::Limits;
use crate::phase::{ConstantEntry, PhaseLayout, PhaseStart};
use crate::workers::Workers;

/// Part of the longest duration, as far as it is known, that a phase has at least.
const LEAST_DURATION: f64 = 3e-10;

/// The point that a solve starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartingPoint {
    /// The guess, moved between the bounds on the variables.
    BetweenBounds,
    /// The guess as it is: for a solve that relaxes bounds.
    AsGuessed,
}

/// A problem as a nonlinear program that [`apsides_nlp::InteriorPoint`] or any other solver can take.
///
/// The structure is found once; evaluations write into the caller's slices. Bounds, start and scales may be changed before a
/// solve.
pub struct Transcription<D: Discretisation> {
    /// The places of variables and rows.
    pub layout: Layout<D::Phase>,
    /// The terms along the phases.
    pub discretisation: D,
    /// The bounds on the variables.
    pub variable_limits: Limits,
    /// The bounds on the rows.
    pub row_limits: Limits,
    /// The point that a solve starts from.
    pub start: Vec<f64>,
    /// The scales of objective, variables and rows.
    pub scales: NlpScaling,
    /// Those of the quantities of the problem that the guess gives.
    pub quantity_scales: Scaling,
    /// True if the second derivatives tell the scale of the objective where its gradient is rounding: not after an earlier solution,
    /// which is stationary by its nature.
    pub(crate) weighs_curvature: bool,
    sign: f64,
    endpoint_terms: Vec<EndpointTerm>,
    /// Columns and weights of the linear part of the cost, sign included.
    linear_cost: Vec<(usize, f64)>,
    constant: Vec<ConstantEntry>,
    jacobian_pattern: Pattern,
    hessian_pattern: Pattern,
    /// Entries of the discretisation in Jacobian and Hessian.
    entries: (usize, usize),
}

impl<D: Discretisation> Transcription<D> {
    /// Puts a program together from the layout and the terms of a method. The guess must fit the problem ([`Guess::check`]).
    #[must_use]
    pub fn assemble(
        ocp: &Ocp,
        guess: &Guess,
        layout: Layout<D::Phase>,
        discretisation: D,
        start: StartingPoint,
    ) -> Self {
        let sign = ocp.objective.sense.sign();
        let Guessed { point, variable_limits, row_limits, scaling, scales } =
            guessed(ocp, guess, &layout, start);
        let linear = ocp.objective.linear.iter();
        let mut transcription = Self {
            linear_cost: linear.map(|&(input, w)| (layout.endpoint_column(input), sign * w)).collect(),
            endpoint_terms: EndpointTerm::all(ocp, &layout.endpoint_rows, |i| layout.endpoint_column(i)),
            constant: constant_entries(&layout),
            weighs_curvature: guess.phases.iter().all(|g| g.as_trajectory().is_none()),
            scales,
            quantity_scales: scaling,
            start: point,
            variable_limits,
            row_limits,
            sign,
            jacobian_pattern: Pattern::default(),
            hessian_pattern: Pattern::default(),
            entries: (0, 0),
            discretisation,
            layout,
        };
        transcription.find_patterns();
        transcription.complete_scales();
        transcription
    }

    /// The sign of the objective in the minimised cost: -1 where the problem maximises.
    #[must_use]
    pub fn sign(&self) -> f64 {
        self.sign
    }

    /// Lets so many threads evaluate the terms; the numbers are the same for any number of them.
    ///
    /// Where the system gives no threads, and where there is too little to share, the caller's thread does all.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        self.with_workers(&Workers::new(threads))
    }

    /// The same with workers that several programs share.
    #[must_use]
    pub fn with_workers(mut self, workers: &Workers) -> Self {
        self.discretisation.share(workers);
        self
    }

    fn find_patterns(&mut self) {
        let y = vec![0.0; self.layout.constraints];
        let mut jacobian: Vec<_> = self.constant.iter().map(|&(r, c, _)| (r, c)).collect();
        let mut hessian = Vec::new();
        self.discretisation.add_patterns(&mut jacobian, &mut hessian);
        self.entries = (jacobian.len() - self.constant.len(), hessian.len());
        for t in &mut self.endpoint_terms {
            t.each_jacobian(|r, c, _| jacobian.push((r, c)));
            t.each_hessian(1.0, &y, |i, j, _| hessian.push((i, j)));
        }
        self.jacobian_pattern = Pattern::from_pairs(jacobian);
        self.hessian_pattern = Pattern::from_pairs(hessian);
    }

    /// Makes values and first derivatives known at `x`, unless they are already.
    pub fn refresh(&mut self, x: &[f64]) {
        if self.discretisation.refresh(x) {
            self.endpoint_terms.iter_mut().for_each(|t| t.refresh(x));
        }
    }
}

impl<D: Discretisation> Nlp for Transcription<D> {
    fn variables(&self) -> usize {
        self.layout.variables
    }

    fn constraints(&self) -> usize {
        self.layout.constraints
    }

    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.variable_limits.copy_to(lower, upper);
    }

    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        self.row_limits.copy_to(lower, upper);
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
        self.discretisation.run(x);
        let linear: f64 = self.linear_cost.iter().map(|&(c, w)| w * x[c]).sum();
        let costs = self.endpoint_terms.iter_mut().filter(|t| t.has_cost());
        let ends: f64 = costs.map(|t| t.add_values(x, &mut [])).sum();
        linear + self.discretisation.cost(x) + ends
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.refresh(x);
        gradient.fill(0.0);
        for &(c, w) in &self.linear_cost {
            gradient[c] += w;
        }
        self.discretisation.add_gradient(x, gradient);
        for t in &self.endpoint_terms {
            t.add_gradient(gradient);
        }
    }

    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        self.discretisation.run(x);
        values.fill(0.0);
        // Entries of a row follow each other: their sum need not go through memory.
        let (mut row, mut sum) = (0, 0.0);
        for &(r, c, v) in &self.constant {
            if r != row {
                values[row] = sum;
                (row, sum) = (r, values[r]);
            }
            sum += v * x[c];
        }
        if let Some(last) = values.get_mut(row) {
            *last = sum;
        }
        self.discretisation.add_values(x, values);
        for t in self.endpoint_terms.iter_mut().filter(|t| !t.has_cost()) {
            t.add_values(x, values);
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.refresh(x);
        let (constant, rest) = values.split_at_mut(self.constant.len());
        for (entry, &(_, _, v)) in constant.iter_mut().zip(&self.constant) {
            *entry = v;
        }
        let (terms, ends) = rest.split_at_mut(self.entries.0);
        self.discretisation.fill_jacobian(x, terms);
        let mut next = ends.iter_mut();
        for t in &self.endpoint_terms {
            t.each_jacobian(|_, _, v| write_next(&mut next, v));
        }
    }

    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        self.refresh(x);
        let (terms, ends) = values.split_at_mut(self.entries.1);
        self.discretisation.fill_hessian(x, objective_factor, multipliers, terms);
        let mut next = ends.iter_mut();
        for t in &mut self.endpoint_terms {
            t.each_hessian(objective_factor, multipliers, |_, _, v| write_next(&mut next, v));
        }
    }

    fn scaling(&self) -> Option<NlpScaling> {
        Some(self.scales.clone())
    }

    fn stages(&self) -> Option<Stages> {
        let last = self.layout.last_stage;
        let mut stages = Stages {
            variables: vec![last; self.layout.variables],
            constraints: vec![last; self.layout.constraints],
        };
        for p in &self.layout.phases {
            p.set_stages(&mut stages);
        }
        Some(stages)
    }
}

/// Writes the next of a list of entries, which are as many as the pattern says.
#[inline]
pub fn write_next<'a>(entries: &mut impl Iterator<Item = &'a mut f64>, value: f64) {
    if let Some(entry) = entries.next() {
        *entry = value;
    }
}

/// The point that a solve starts from, and the scales of the variables there.
#[must_use]
pub fn starting_point<P: PhaseLayout>(
    ocp: &Ocp,
    guess: &Guess,
    layout: &Layout<P>,
    start: StartingPoint,
) -> (Vec<f64>, Vec<f64>) {
    let Guessed { point, scales, .. } = guessed(ocp, guess, layout, start);
    (point, scales.variables)
}

/// All that the guess alone tells of a program: the start, the limits, and the scales as far as they are stated.
struct Guessed {
    point: Vec<f64>,
    variable_limits: Limits,
    row_limits: Limits,
    scaling: Scaling,
    scales: NlpScaling,
}

fn guessed<P: PhaseLayout>(ocp: &Ocp, guess: &Guess, layout: &Layout<P>, start: StartingPoint) -> Guessed {
    let mut point = guessed_point(layout, guess);
    let (variable_limits, row_limits) = limits(ocp, layout, guess, &point);
    if start == StartingPoint::BetweenBounds {
        variable_limits.clamp(&mut point);
    }
    let scaling = Scaling::new(ocp, guess);
    let scales = stated_scales(ocp, layout, &scaling);
    Guessed { point, variable_limits, row_limits, scaling, scales }
}

fn guessed_point<P: PhaseLayout>(layout: &Layout<P>, guess: &Guess) -> Vec<f64> {
    let mut x = vec![0.0; layout.variables];
    for (p, g) in layout.phases.iter().zip(&guess.phases) {
        p.set_start(g, &mut x);
        x[p.ends().initial_time] = g.initial_time;
        x[p.ends().final_time] = g.final_time;
    }
    x[layout.first_parameter..].copy_from_slice(&guess.parameters);
    x
}

fn limits<P: PhaseLayout>(ocp: &Ocp, layout: &Layout<P>, guess: &Guess, point: &[f64]) -> (Limits, Limits) {
    let mut variables = Limits::new(layout.variables, Bounds::FREE);
    let mut rows = Limits::new(layout.constraints, Bounds::fixed(0.0));
    let parameters = &point[layout.parameter_columns()];
    for ((phase, p), of_phase) in ocp.phases.iter().zip(&layout.phases).zip(&guess.phases) {
        let start = PhaseStart { phase, guess: of_phase, point, parameters };
        p.set_bounds(&start, &mut variables, &mut rows);
        let ends = p.ends();
        let phase = &lasting(phase, guess);
        let (initial, terminal) = phase.time_bounds();
        variables.set(ends.initial_time, initial);
        variables.set(ends.final_time, terminal);
        for (q, row) in phase.integrals.iter().zip(&ends.integral_rows) {
            if let Some(r) = row {
                rows.set(*r, q.variable.bounds);
            }
        }
        if let Some(r) = ends.duration_row {
            rows.set(r, phase.duration);
        }
    }
    for (v, column) in ocp.parameters.iter().zip(layout.parameter_columns()) {
        variables.set(column, v.bounds);
    }
    for (c, &first) in ocp.constraints.iter().zip(&layout.endpoint_rows) {
        for (v, row) in c.rows.iter().zip(first..) {
            rows.set(row, v.bounds);
        }
    }
    (variables, rows)
}

/// The phase with a duration above zero: without, it has no trajectory.
fn lasting(phase: &Phase, guess: &Guess) -> Phase {
    let mut lasting = phase.clone();
    if phase.duration.lower >= 0.0 {
        let durations = guess.phases.iter().map(|g| g.final_time - g.initial_time);
        let longest = phase.longest().min(durations.fold(0.0, f64::max));
        lasting.duration.lower =
            phase.duration.lower.max((LEAST_DURATION * longest).min(phase.duration.upper));
    }
    lasting
}

/// The scales of the statement. Those of rows and objective that have none are NaN, to be completed by what the functions do.
fn stated_scales<P: PhaseLayout>(ocp: &Ocp, layout: &Layout<P>, scaling: &Scaling) -> NlpScaling {
    let mut scales = NlpScaling {
        objective: scaling.objective.unwrap_or(f64::NAN),
        variables: vec![1.0; layout.variables],
        constraints: vec![1.0; layout.constraints],
    };
    for ((phase, p), s) in ocp.phases.iter().zip(&layout.phases).zip(&scaling.phases) {
        p.set_scales(phase, s, &mut scales);
        let ends = p.ends();
        scales.variables[ends.initial_time] = s.time;
        scales.variables[ends.final_time] = s.time;
        for (q, row) in phase.integrals.iter().zip(&ends.integral_rows) {
            if let Some(r) = row {
                scales.constraints[*r] = q.variable.size().unwrap_or(f64::NAN);
            }
        }
        if let Some(r) = ends.duration_row {
            scales.constraints[r] = s.time;
        }
    }
    scales.variables[layout.first_parameter..].copy_from_slice(&scaling.parameters);
    for (c, &first) in ocp.constraints.iter().zip(&layout.endpoint_rows) {
        for (v, row) in c.rows.iter().zip(first..) {
            scales.constraints[row] = v.size().unwrap_or(f64::NAN);
        }
    }
    scales
}

fn constant_entries<P: PhaseLayout>(layout: &Layout<P>) -> Vec<ConstantEntry> {
    let mut entries = Vec::new();
    for p in &layout.phases {
        entries.extend(p.constant_entries());
        let ends = p.ends();
        if let Some(r) = ends.duration_row {
            entries.extend([(r, ends.initial_time, -1.0), (r, ends.final_time, 1.0)]);
        }
    }
    entries
}
