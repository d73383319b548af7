//! The discretised problem: a sparse nonlinear program.
//!
//! Defects in differential form (Garg et al. 2010, eq. 8): at collocation point `i` of an interval of normalised width `h`
//!
//! ```text
//! sum_j D_ij x_j - (h / 2) (tf - t0) f(x_i, u_i, p, t_i) = 0
//! ```
//!
//! Where the mesh has breaks, `t0` and `tf` are the times of the breaks around the interval, which are variables.

use std::sync::Arc;

use apsides_basis::legendre;
use apsides_nlp::{Nlp, Pattern, Scaling as NlpScaling, Stages};
use apsides_ocp::{ArcKind, Bounds, EndpointTerm, Guess, Mesh, Ocp, Scaling, Sense};

use crate::RadauError;
use crate::layout::{Layout, PhaseLayout};
use crate::node_term::{NodeTerm, Target};
use crate::scales::nlp_scaling;
use crate::touch::{RateTerm, rate_terms};
use crate::workers::{pool, within};

/// Least duration of an arc between breaks, as a part of the phase's in the guess.
pub(crate) const LEAST_ARC: f64 = 1e-6;

/// A problem on a mesh, as a nonlinear program that [`apsides_nlp::InteriorPoint`] or any other solver can take.
///
/// The structure is found once; evaluations write into the caller's slices and allocate nothing.
pub struct Transcription {
    pub(crate) layout: Layout,
    pub(crate) sign: f64,
    node_terms: Vec<NodeTerm>,
    endpoint_terms: Vec<EndpointTerm>,
    rate_terms: Vec<RateTerm>,
    /// Columns and weights of the linear part of the cost, sign included.
    linear_cost: Vec<(usize, f64)>,
    /// Constant Jacobian entries, rows and columns first: differentiation matrices and durations.
    constant: Vec<(usize, usize)>,
    constant_values: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    pub(crate) row_lower: Vec<f64>,
    pub(crate) row_upper: Vec<f64>,
    pub(crate) start: Vec<f64>,
    pub(crate) scaling: NlpScaling,
    jacobian_pattern: Pattern,
    hessian_pattern: Pattern,
    /// Point of the last refresh of values and Jacobians at the nodes.
    refreshed_at: Vec<f64>,
    /// Threads for the nodes; none where the caller's does all.
    pool: Option<Arc<rayon::ThreadPool>>,
}

impl Transcription {
    /// Discretises a problem.
    ///
    /// # Errors
    /// When mesh or guess do not fit the problem.
    pub fn new(ocp: &Ocp, mesh: &Mesh, guess: &Guess) -> Result<Self, RadauError> {
        Self::build(ocp, mesh, guess, false)
    }

    /// The same for a relaxation of the bounds: end times have derivatives even where they are fixed, and the start is not
    /// put between the bounds.
    pub(crate) fn with_movable_bounds(ocp: &Ocp, mesh: &Mesh, guess: &Guess) -> Result<Self, RadauError> {
        Self::build(ocp, mesh, guess, true)
    }

    fn build(ocp: &Ocp, mesh: &Mesh, guess: &Guess, movable: bool) -> Result<Self, RadauError> {
        guess.check(ocp)?;
        if mesh.phases.len() != ocp.phases.len() {
            return Err(apsides_ocp::OcpError::Dimension {
                place: format!("mesh of problem `{}`", ocp.name),
                what: "phases",
                expected: ocp.phases.len(),
                found: mesh.phases.len(),
            }
            .into());
        }
        let layout = Layout::new(ocp, mesh)?;
        let sign = match ocp.objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        let scaling = Scaling::new(ocp, guess);
        let start = starting_point(&layout, guess);
        let (lower, upper) = variable_bounds(ocp, &layout, &start);
        let (row_lower, row_upper) = row_bounds(ocp, &layout, guess);
        let (constant, constant_values) = constant_entries(&layout).into_iter().unzip();
        let mut transcription = Self {
            sign,
            node_terms: node_terms(ocp, &layout, sign, movable),
            endpoint_terms: EndpointTerm::all(ocp, &layout.endpoint_rows, |i| layout.endpoint_column(i)),
            rate_terms: rate_terms(ocp, &layout),
            linear_cost: (ocp.objective.linear.iter())
                .map(|&(input, w)| (layout.endpoint_column(input), sign * w))
                .collect(),
            constant,
            constant_values,
            pool: None,
            start: if movable { start } else { clamped(start, &lower, &upper) },
            scaling: nlp_scaling(ocp, &layout, &scaling),
            lower,
            upper,
            row_lower,
            row_upper,
            jacobian_pattern: Pattern::default(),
            hessian_pattern: Pattern::default(),
            refreshed_at: vec![f64::NAN; layout.variables],
            layout,
        };
        transcription.find_patterns();
        transcription.complete_scales();
        Ok(transcription)
    }

    /// Lets so many threads evaluate the nodes of long phases; the numbers are the same for any number of them.
    ///
    /// Where the system gives no threads, and on short phases, the caller's thread does all.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        let pool = pool(threads);
        self.with_pool(threads, pool)
    }

    pub(crate) fn with_pool(mut self, threads: usize, pool: Option<Arc<rayon::ThreadPool>>) -> Self {
        let threads = if pool.is_some() { threads } else { 1 };
        let mut shared = false;
        for t in &mut self.node_terms {
            shared |= t.share(threads);
        }
        self.pool = pool.filter(|_| shared);
        self
    }

    fn find_patterns(&mut self) {
        let y = vec![0.0; self.layout.constraints];
        let mut jacobian = self.constant.clone();
        let mut hessian = Vec::new();
        for t in &mut self.node_terms {
            t.add_patterns(&mut jacobian, &mut hessian);
        }
        for t in &mut self.endpoint_terms {
            t.each_jacobian(|r, c, _| jacobian.push((r, c)));
            t.each_hessian(1.0, &y, |i, j, _| hessian.push((i, j)));
        }
        for t in &mut self.rate_terms {
            t.each_jacobian(|r, c, _| jacobian.push((r, c)));
            t.each_hessian(&y, |i, j, _| hessian.push((i, j)));
        }
        self.jacobian_pattern = Pattern::from_pairs(jacobian);
        self.hessian_pattern = Pattern::from_pairs(hessian);
    }

    /// Values and Jacobians at the nodes, unless they are those of `x` already.
    fn refresh(&mut self, x: &[f64]) {
        if self.refreshed_at == x {
            return;
        }
        let terms = &mut self.node_terms;
        within(self.pool.as_deref(), || terms.iter_mut().for_each(|t| t.refresh(x)));
        for t in &mut self.endpoint_terms {
            t.refresh(x);
        }
        for t in &mut self.rate_terms {
            t.refresh(x);
        }
        self.refreshed_at.copy_from_slice(x);
    }
}

impl Nlp for Transcription {
    fn variables(&self) -> usize {
        self.layout.variables
    }

    fn constraints(&self) -> usize {
        self.layout.constraints
    }

    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }

    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.row_lower);
        upper.copy_from_slice(&self.row_upper);
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
        let linear: f64 = self.linear_cost.iter().map(|&(c, w)| w * x[c]).sum();
        let costs = self.node_terms.iter_mut().filter(|t| t.has_cost());
        let nodes: f64 = within(self.pool.as_deref(), || costs.map(|t| t.add_values(x, &mut [])).sum());
        let ends: f64 =
            self.endpoint_terms.iter_mut().filter(|t| t.has_cost()).map(|t| t.add_values(x, &mut [])).sum();
        linear + nodes + ends
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.refresh(x);
        gradient.fill(0.0);
        for &(c, w) in &self.linear_cost {
            gradient[c] += w;
        }
        for t in self.node_terms.iter().filter(|t| t.has_cost()) {
            t.add_gradient(x, gradient);
        }
        for t in &self.endpoint_terms {
            t.add_gradient(gradient);
        }
    }

    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        values.fill(0.0);
        for (&(r, c), v) in self.constant.iter().zip(&self.constant_values) {
            values[r] += v * x[c];
        }
        let terms = &mut self.node_terms;
        within(self.pool.as_deref(), || {
            for t in terms {
                t.add_values(x, values);
            }
        });
        for t in self.endpoint_terms.iter_mut().filter(|t| !t.has_cost()) {
            t.add_values(x, values);
        }
        for t in &mut self.rate_terms {
            t.add_values(x, values);
        }
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.refresh(x);
        let (constant, rest) = values.split_at_mut(self.constant_values.len());
        constant.copy_from_slice(&self.constant_values);
        let terms = &mut self.node_terms;
        let values = within(self.pool.as_deref(), || {
            terms.iter_mut().fold(rest, |entries, t| t.fill_jacobian(x, entries))
        });
        let mut next = 0;
        let mut push = |v| {
            values[next] = v;
            next += 1;
        };
        for t in &self.endpoint_terms {
            t.each_jacobian(|_, _, v| push(v));
        }
        for t in &self.rate_terms {
            t.each_jacobian(|_, _, v| push(v));
        }
    }

    fn hessian(&mut self, x: &[f64], objective_factor: f64, multipliers: &[f64], values: &mut [f64]) {
        self.refresh(x);
        let terms = &mut self.node_terms;
        let values = within(self.pool.as_deref(), || {
            terms
                .iter_mut()
                .fold(values, |entries, t| t.fill_hessian(x, objective_factor, multipliers, entries))
        });
        let mut next = 0;
        let mut push = |v| {
            values[next] = v;
            next += 1;
        };
        for t in &mut self.endpoint_terms {
            t.each_hessian(objective_factor, multipliers, |_, _, v| push(v));
        }
        for t in &mut self.rate_terms {
            t.each_hessian(multipliers, |_, _, v| push(v));
        }
    }

    fn scaling(&self) -> Option<NlpScaling> {
        Some(self.scaling.clone())
    }

    fn stages(&self) -> Option<Stages> {
        // Interval by interval: controls, inner states, the first state, defects. What couples all points of an interval is
        // eliminated together, with fewer entries in the factor than node by node (the safer rule of `apsides-kkt` for
        // systems close to singular); the landings take the same iterations with both.
        let last = 4 * self.layout.last_stage;
        let mut variables = vec![last; self.layout.variables];
        let mut constraints = vec![last; self.layout.constraints];
        for p in &self.layout.phases {
            for node in 0..=p.nodes.len() {
                let (interval, local) =
                    p.nodes.get(node).map_or((p.mesh.intervals(), 0), |n| (n.interval, n.local));
                let stage = 4 * (p.first_stage + interval as u32);
                variables[p.state_column(node)..][..p.states].fill(stage + if local == 0 { 2 } else { 1 });
                if node < p.nodes.len() {
                    variables[p.control_column(node)..][..p.controls].fill(stage);
                    constraints[p.defect_row(node)..][..p.rows_per_node].fill(stage + 3);
                }
            }
            for &(row, interval, _) in &p.degree_rows {
                constraints[row] = 4 * (p.first_stage + interval as u32) + 3;
            }
            for (row, touch) in &p.rate_rows {
                constraints[*row] = 4 * (p.first_stage + touch.end as u32) + 3;
            }
        }
        Some(Stages { variables, constraints })
    }
}

fn node_terms(ocp: &Ocp, layout: &Layout, sign: f64, movable: bool) -> Vec<NodeTerm> {
    let mut terms = Vec::new();
    for (k, (phase, p)) in ocp.phases.iter().zip(&layout.phases).enumerate() {
        let (start, end) = phase.time_bounds();
        let mut add = |function: &std::sync::Arc<dyn apsides_ad::NodeFunction>,
                       is_rate,
                       target: &dyn Fn(usize) -> Target,
                       factor: &dyn Fn(usize) -> f64| {
            for (index, arc) in p.arcs.iter().enumerate() {
                // The times of breaks are free.
                let fixed =
                    (index == 0 && start.is_fixed(), index + 1 == p.arcs.len() && end.is_fixed() && !movable);
                let function = std::sync::Arc::clone(function);
                let target = target(arc.nodes.start);
                terms.push(NodeTerm::new(
                    function,
                    is_rate,
                    target,
                    p,
                    arc,
                    layout.first_parameter,
                    fixed,
                    factor,
                ));
            }
        };
        let stride = p.rows_per_node;
        let rows = |offset: usize| move |node| Target::Rows { first: p.defect_row(node) + offset, stride };
        add(&phase.dynamics, true, &rows(0), &|i| -0.5 * p.nodes[i].width);
        let mut offset = p.states;
        for c in &phase.path {
            add(&c.function, false, &rows(offset), &|_| 1.0);
            offset += c.rows.len();
        }
        for (index, q) in phase.integrals.iter().enumerate() {
            let weights = ocp.objective.integrals.iter().filter(|w| (w.0, w.1) == (k, index));
            let cost = sign * weights.map(|w| w.2).sum::<f64>();
            let row = p.integral_rows[index];
            if row.is_some() || cost != 0.0 {
                add(&q.function, true, &|_| Target::Sum { row, cost }, &|i| p.nodes[i].weight);
            }
        }
    }
    terms
}

fn constant_entries(layout: &Layout) -> Vec<((usize, usize), f64)> {
    let mut entries = Vec::new();
    for p in &layout.phases {
        for (i, node) in p.nodes.iter().enumerate() {
            let n = p.mesh.points()[node.interval];
            let start = i - node.local;
            let row = &p.rules[node.interval].differentiation()[node.local * (n + 1)..][..n + 1];
            for s in 0..p.states {
                for (j, &d) in row.iter().enumerate() {
                    entries.push(((p.defect_row(i) + s, p.state_column(start + j) + s), d));
                }
            }
        }
        if let Some(r) = p.duration_row {
            entries.push(((r, p.initial_time), -1.0));
            entries.push(((r, p.final_time), 1.0));
        }
        for (r, arc) in p.first_arc_row.map_or(0..0, |r| r..r + p.arcs.len()).zip(&p.arcs) {
            entries.push(((r, arc.start_time), -1.0));
            entries.push(((r, arc.end_time), 1.0));
        }
        for &(r, column, f) in &p.pinned_rows {
            entries.extend([((r, column), 1.0), ((r, p.initial_time), f - 1.0), ((r, p.final_time), -f)]);
        }
        for &(r, interval, c) in &p.degree_rows {
            let (rule, first) = (&p.rules[interval], p.interval_start(interval));
            for (j, (&tau, w)) in rule.nodes().iter().zip(rule.weights()).enumerate() {
                entries.push(((r, p.control_column(first + j) + c), w * legendre(rule.points() - 1, tau).0));
            }
        }
    }
    entries
}

fn variable_bounds(ocp: &Ocp, layout: &Layout, start: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut lower = vec![f64::NEG_INFINITY; layout.variables];
    let mut upper = vec![f64::INFINITY; layout.variables];
    let mut set = |column: usize, b: Bounds| {
        lower[column] = b.lower;
        upper[column] = b.upper;
    };
    for (phase, p) in ocp.phases.iter().zip(&layout.phases) {
        let last = p.nodes.len();
        let implied = implied_bounds(phase, p, layout.first_parameter, start);
        for node in 0..=last {
            for (s, state) in phase.states.iter().enumerate() {
                let along = state.variable.bounds;
                let bounds = match node {
                    0 => along.intersect(&state.initial),
                    n if n == last => along.intersect(&state.terminal),
                    n if implied[n * p.states + s] => Bounds::FREE,
                    _ => along,
                };
                set(p.state_column(node) + s, bounds);
            }
            if node < last {
                let held = &p.mesh.arcs()[p.arc_of(node)].controls;
                for (c, control) in phase.controls.iter().enumerate() {
                    set(p.control_column(node) + c, bounds_along(control.bounds, held, c));
                }
            }
        }
        for c in p.mesh.crossings() {
            let kink = phase.kinks[c.kink];
            set(p.state_column(p.interval_start(c.end)) + kink.state, Bounds::fixed(kink.value));
        }
        let (start, end) = phase.time_bounds();
        set(p.initial_time, start);
        set(p.final_time, end);
    }
    for (k, v) in ocp.parameters.iter().enumerate() {
        set(layout.first_parameter + k, v.bounds);
    }
    (lower, upper)
}

/// Nodes and states, node after node, whose bounds along the phase say nothing new: what cannot change along an arc is bounded
/// at its start, or fixed at the end of the phase. Stated again such a bound would leave no inside where it is active.
fn implied_bounds(
    phase: &apsides_ocp::Phase,
    p: &PhaseLayout,
    first_parameter: usize,
    start: &[f64],
) -> Vec<bool> {
    let mut implied = vec![false; (p.nodes.len() + 1) * p.states];
    let mut fixed_later: Vec<bool> = phase.states.iter().map(|s| s.terminal.is_fixed()).collect();
    for (k, arc) in p.arcs.iter().enumerate().rev() {
        let constant = constant_states(phase, p, k, first_parameter, start);
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

/// Which states have no rate along an arc because of the controls that are held there: neither the rate nor any of its
/// derivatives by what is free differs from zero at the start of the solve.
fn constant_states(
    phase: &apsides_ocp::Phase,
    p: &PhaseLayout,
    arc: usize,
    first_parameter: usize,
    start: &[f64],
) -> Vec<bool> {
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
        z[..width].copy_from_slice(&start[p.state_column(node)..][..width]);
        for c in 0..p.controls {
            z[p.states + c] = held(c).unwrap_or(z[p.states + c]);
        }
        let time = z.len() - 1;
        z[width..time].copy_from_slice(&start[first_parameter..][..time - width]);
        z[time] = p.time(node, start);
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

fn row_bounds(ocp: &Ocp, layout: &Layout, guess: &Guess) -> (Vec<f64>, Vec<f64>) {
    let mut lower = vec![0.0; layout.constraints];
    let mut upper = vec![0.0; layout.constraints];
    let mut set = |row: usize, b: Bounds| {
        lower[row] = b.lower;
        upper[row] = b.upper;
    };
    for ((phase, p), guess) in ocp.phases.iter().zip(&layout.phases).zip(&guess.phases) {
        for node in 0..p.nodes.len() {
            let held = &p.mesh.arcs()[p.arc_of(node)].rows;
            for (k, row) in phase.path.iter().flat_map(|c| &c.rows).enumerate() {
                let bounds = match p.touch_at(node, k) {
                    Some(t) => Bounds::fixed(if t.upper { row.bounds.upper } else { row.bounds.lower }),
                    None if p.is_beside_touch(node, k) => Bounds::FREE,
                    None => bounds_along(row.bounds, held, k),
                };
                set(p.path_row(node) + k, bounds);
            }
        }
        for (q, row) in phase.integrals.iter().zip(&p.integral_rows) {
            if let Some(r) = row {
                set(*r, q.variable.bounds);
            }
        }
        if let Some(r) = p.duration_row {
            set(r, phase.duration);
        }
        let least = LEAST_ARC * (guess.final_time - guess.initial_time);
        for r in p.first_arc_row.map_or(0..0, |r| r..r + p.arcs.len()) {
            set(r, Bounds::at_least(least));
        }
    }
    for (c, &first) in ocp.constraints.iter().zip(&layout.endpoint_rows) {
        for (k, row) in c.rows.iter().enumerate() {
            set(first + k, row.bounds);
        }
    }
    (lower, upper)
}

fn starting_point(layout: &Layout, guess: &Guess) -> Vec<f64> {
    let mut x = vec![0.0; layout.variables];
    for (p, g) in layout.phases.iter().zip(&guess.phases) {
        for node in 0..=p.nodes.len() {
            let fraction = p.nodes.get(node).map_or(1.0, |n| n.fraction);
            let (a, b) = (p.state_column(node), p.control_column(node));
            g.state(fraction, &mut x[a..b]);
            if node < p.nodes.len() {
                g.control(fraction, &mut x[b..b + p.controls]);
            }
        }
        x[p.initial_time] = g.initial_time;
        for (arc, at) in p.arcs.iter().zip(p.mesh.breaks()) {
            let f = p.mesh.fractions()[at.end];
            x[arc.end_time] = (1.0 - f) * g.initial_time + f * g.final_time;
        }
        x[p.final_time] = g.final_time;
    }
    x[layout.first_parameter..].copy_from_slice(&guess.parameters);
    x
}

fn clamped(mut x: Vec<f64>, lower: &[f64], upper: &[f64]) -> Vec<f64> {
    for ((v, l), u) in x.iter_mut().zip(lower).zip(upper) {
        *v = v.max(*l).min(*u);
    }
    x
}
