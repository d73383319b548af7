//! The adjoint equation over the intervals of a phase, for every value at their ends.
//!
//! A costate in an interval is linear in the costate at its end, in those of states at their bounds at its nodes ([`mod@super::held`]), in the
//! multipliers of integrals and in one: a matrix over `[inner, end, shared, 1]`, each quantity times or divided by its scale.

use std::cell::RefCell;
use std::sync::Arc;

use apsides_basis::Barycentric;
use apsides_ocp::{PhaseScaling, PhaseTrajectory, PiecewisePolynomial, Segment};
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};
use nalgebra::DMatrix;

use super::held::{ADJOINT_WEIGHT, BoundSide, Course, Held, LinearCondition, driven};
use crate::VerifySettings;
use crate::boundary::row_scales;
use crate::equations::Equations;
use crate::worst::relative;

/// Accuracy of the integration.
const ACCURACY: f64 = 1e-10;
/// Times closer to an end of the phase than this part of its duration are at the end.
const END: f64 = 1e-9;

/// One interval.
pub(super) struct Leg {
    /// Number of the inner unknowns.
    pub(super) inner: usize,
    /// The conditions over `[costates before the start, inner, end, shared, 1]`.
    pub(super) rows: Vec<LinearCondition>,
    /// Costates at the nodes of the states, over `[inner, end, shared, 1]`.
    nodes: Vec<DMatrix<f64>>,
    /// Multipliers of the path rows that follow from the costates, at the nodes of the controls.
    multipliers: Vec<(usize, usize, Vec<f64>)>,
}

/// A place of a phase: interval and time.
pub(super) type LegPoint = (usize, f64);

pub(super) struct Legs<'a> {
    equations: Equations<'a>,
    found: &'a PhaseTrajectory,
    scaling: &'a PhaseScaling,
    /// Shared unknown and index of each integral with an active bound.
    local: Vec<(usize, usize)>,
    shared: usize,
    duration: f64,
    activity: f64,
    max_steps: usize,
    /// Largest magnitude of each path row.
    row_scales: Vec<f64>,
    /// Largest term of the Hamiltonian by the stated costates.
    hamiltonian_size: f64,
}

/// Values and derivatives at one point, over `[x, u, p, t]`.
struct Local {
    rates: Vec<f64>,
    jacobian: Vec<f64>,
    /// Gradient of what does not depend on costates: of each active integral, then of the weighted ones with given multipliers.
    sources: Vec<Vec<f64>>,
    /// Their values without path constraints.
    values: Vec<f64>,
}

impl<'a> Legs<'a> {
    pub(super) fn new(
        mut equations: Equations<'a>,
        found: &'a PhaseTrajectory,
        scaling: &'a PhaseScaling,
        local: Vec<(usize, usize)>,
        shared: usize,
        hamiltonian_size: f64,
        settings: &VerifySettings,
    ) -> Option<Self> {
        let rows = equations.phase.path_rows();
        let mut largest = vec![0.0f64; rows];
        let mut path = vec![0.0; rows];
        let (mut x, mut u) = (vec![0.0; equations.nx], vec![0.0; equations.nu]);
        for (t, segment) in found.nodes() {
            found.state.evaluate(t, &mut x);
            found.control.evaluate_in(segment, t, &mut u);
            equations.set(found.control.within(segment, t), &x, &u);
            equations.path(&mut path);
            largest.iter_mut().zip(&path).for_each(|(l, v)| *l = l.max(v.abs()));
        }
        let row_scales = row_scales(equations.phase, scaling, |r| largest[r]);
        let same = found.state.segments().len() == found.control.segments().len();
        same.then_some(Self {
            duration: found.final_time - found.initial_time,
            activity: settings.activity_tolerance,
            max_steps: settings.max_steps,
            equations,
            found,
            scaling,
            local,
            shared,
            row_scales,
            hamiltonian_size,
        })
    }

    pub(super) fn first_point(&self) -> LegPoint {
        (0, self.found.initial_time)
    }

    pub(super) fn last_point(&self) -> LegPoint {
        (self.found.control.segments().len() - 1, self.found.final_time)
    }

    /// Goes to a point, with the controls within their bounds, and gives them.
    fn go(&mut self, (segment, t): LegPoint) -> Vec<f64> {
        let (mut x, mut u) = (vec![0.0; self.equations.nx], vec![0.0; self.equations.nu]);
        self.found.state.evaluate_in(segment, t, &mut x);
        self.found.control.evaluate_in(segment, t, &mut u);
        for (u, c) in u.iter_mut().zip(&self.equations.phase.controls) {
            *u = if u.is_nan() { *u } else { c.bounds.clamp(*u) };
        }
        self.equations.set(self.found.control.within(segment, t), &x, &u);
        u
    }

    fn local_at(&mut self, (segment, t): LegPoint, given: &[usize]) -> Local {
        self.go((segment, t));
        let (nx, width) = (self.equations.nx, self.equations.width());
        let (mut rates, mut jacobian) = (vec![0.0; nx], vec![0.0; nx * width]);
        self.equations.dynamics_jacobian(&mut rates, &mut jacobian);
        let nl = self.local.len();
        let (mut sources, mut values) = (vec![vec![0.0; width]; nl + 1], vec![0.0; nl + 1]);
        let mut gradient = vec![0.0; width];
        for q in 0..self.equations.phase.integrals.len() {
            let weight = self.equations.weight(q);
            let unknown = self.local.iter().position(|(_, local)| *local == q);
            if weight == 0.0 && unknown.is_none() {
                continue;
            }
            let value = self.equations.integrand_gradient(q, &mut gradient);
            if let Some(l) = unknown {
                sources[l].copy_from_slice(&gradient);
                values[l] = value;
            }
            sources[nl].iter_mut().zip(&gradient).for_each(|(s, g)| *s += weight * g);
            values[nl] += weight * value;
        }
        if self.found.path_multipliers.is_some() && !given.is_empty() {
            let multipliers = self.stated_multipliers((segment, t));
            for &r in given.iter().filter(|r| multipliers[**r] != 0.0) {
                self.equations.row_gradient(r, &mut gradient);
                sources[nl].iter_mut().zip(&gradient).for_each(|(s, g)| *s += multipliers[r] * g);
            }
        }
        Local { rates, jacobian, sources, values }
    }

    /// The multipliers of the path rows that the trajectory states, zero where there are none.
    fn stated_multipliers(&self, (segment, t): LegPoint) -> Vec<f64> {
        let mut multipliers = vec![0.0; self.row_scales.len()];
        if let Some(polynomial) = &self.found.path_multipliers {
            let pieces = self.found.control.segments().len();
            crate::optimality::evaluate_piece(polynomial, pieces, segment, t, &mut multipliers);
        }
        multipliers
    }

    /// The Hamiltonian at a point over `[costate, shared, 1]`.
    pub(super) fn hamiltonian(&mut self, point: &LegPoint) -> (Vec<f64>, Vec<f64>) {
        let local = self.local_at(*point, &[]);
        let row = local.rates.iter().zip(&self.scaling.states).map(|(f, s)| f / s).collect();
        let mut rest = vec![0.0; self.shared + 1];
        for (l, (g, _)) in self.local.iter().enumerate() {
            rest[*g] = local.values[l];
        }
        rest[self.shared] = local.values[self.local.len()];
        (row, rest)
    }

    /// The jump of the Hamiltonian at the start of an interval, over the unknowns of its rows.
    fn jump(&mut self, segment: usize, course: &Course) -> Vec<f64> {
        let nx = self.equations.nx;
        let t = self.found.control.breaks()[segment];
        let (before, rest_before) = self.hamiltonian(&(segment - 1, t));
        let (after, rest_after) = self.hamiltonian(&(segment, t));
        let mut row = self.row_of(course);
        for i in 0..nx {
            row[i] -= before[i];
            let at_start = course.held.iter().find(|h| h.state == i).map_or(i, |h| nx + h.first);
            row[at_start] += after[i];
        }
        let rest = row.len() - rest_after.len();
        for (entry, (after, before)) in row[rest..].iter_mut().zip(rest_after.iter().zip(&rest_before)) {
            *entry = after - before;
        }
        row.iter_mut().for_each(|v| *v *= self.duration);
        row
    }

    /// Zeros over the unknowns of the rows of an interval.
    fn row_of(&self, course: &Course) -> Vec<f64> {
        vec![0.0; 2 * self.equations.nx + course.inner() + self.shared + 1]
    }

    fn course(&mut self, segment: usize, free_at: &[Vec<usize>]) -> Course {
        let control_nodes: Vec<f64> = self.found.control.node_times(segment).collect();
        let always: Vec<usize> =
            (0..self.equations.nu).filter(|j| free_at.iter().all(|f| f.contains(j))).collect();
        let followed = self.followed_rows(segment, &control_nodes, &always);
        let given = (0..self.row_scales.len()).filter(|r| !followed.contains(r)).collect();
        Course { given, followed, always, held: self.held(segment) }
    }

    /// Integrates the adjoint equation over an interval; none if that fails. At a corner of the controls at its start the Hamiltonian is continuous.
    pub(super) fn fly(&mut self, segment: usize, starts_at_corner: bool) -> Option<Leg> {
        let nx = self.equations.nx;
        let breaks = self.found.control.breaks();
        let (a, b) = (breaks[segment], breaks[segment + 1]);
        let control_nodes: Vec<f64> = self.found.control.node_times(segment).collect();
        let state_nodes: Vec<f64> = self.found.state.node_times(segment).collect();
        let free_at: Vec<Vec<usize>> =
            control_nodes.iter().map(|t| self.free_controls((segment, *t))).collect();
        let course = self.course(segment, &free_at);
        let inner = course.inner();
        let nc = nx + inner + self.local.len() + 1;

        // From the end back to each time of interest.
        let mut times: Vec<f64> = control_nodes.iter().chain(&state_nodes).copied().chain([a, b]).collect();
        times.sort_by(|p, q| q.total_cmp(p));
        times.dedup();
        let settings = OdeSettings {
            relative_tolerance: ACCURACY,
            absolute_tolerance: Tolerance::PerComponent(
                self.scaling.states.iter().flat_map(|s| vec![ACCURACY / s; nc]).collect(),
            ),
            max_steps: self.max_steps,
            stiffness_interval: None,
            ..OdeSettings::default()
        };
        let mut integrator = Integrator::new(nx * nc, settings).ok()?;
        // Of a state at its bound the integral of what its equation says is kept, from the end.
        let mut y = vec![0.0; nx * nc];
        for i in (0..nx).filter(|i| course.held.iter().all(|h| h.state != *i)) {
            y[i * nc + i] = 1.0 / self.scaling.states[i];
        }
        let mut solution: Vec<(f64, Vec<f64>)> = Vec::new();
        let mut at = b;
        for t in times {
            let mut next = y.clone();
            if t < at {
                let this = RefCell::new(&mut *self);
                let course = &course;
                let system = FnSystem::new(nx * nc, |t: f64, y: &[f64], rate: &mut [f64]| {
                    this.borrow_mut().adjoint_rate((segment, t), y, course, rate);
                });
                let summary = integrator.integrate(&system, at, &y, t, &mut next).ok()?;
                if summary.status != Status::Completed {
                    return None;
                }
            }
            at = t;
            y = next;
            solution.push((t, y.clone()));
        }
        let value = |t: f64| solution.iter().find(|(s, _)| *s == t).map(|(_, y)| y.clone());
        let integrals: Vec<DMatrix<f64>> =
            state_nodes.iter().map(|t| value(*t).map(|y| self.expand(&y, inner))).collect::<Option<_>>()?;
        let start = self.expand(&value(a)?, inner);
        let mut rows = self.costate_rows(&course, &start, &integrals);
        let mut multipliers = Vec::new();
        for (n, t) in control_nodes.iter().enumerate() {
            let lambda = self.with_held(&course, (segment, *t), &value(*t)?);
            let local = self.local_at((segment, *t), &course.given);
            let slopes = self.control_slopes(&local, &lambda);
            let gradients = self.row_gradients((segment, *t), &course.followed);
            let mu = multipliers_of(&gradients, &slopes, nx, &course.always);
            for (j, slope) in slopes.into_iter().enumerate() {
                let mut row = slope;
                for (gradient, mu) in gradients.iter().zip(&mu) {
                    row.iter_mut().zip(mu).for_each(|(s, m)| *s += m * gradient[nx + j]);
                }
                rows.extend(self.stationarity((segment, *t), j, &self.expand_row(&row, inner), &free_at[n]));
            }
            for (r, row) in course.followed.iter().zip(&mu) {
                multipliers.push((n, *r, self.expand_row(row, inner)));
            }
        }
        if starts_at_corner {
            rows.push(LinearCondition::equation(self.jump(segment, &course), 1.0));
        }
        let times = state_nodes.iter();
        let nodes = times
            .map(|t| value(*t).map(|y| self.expand(&self.with_held(&course, (segment, *t), &y), inner)))
            .collect::<Option<_>>()?;
        Some(Leg { inner, rows, nodes, multipliers })
    }

    /// The slope of the Lagrangian in a control at a node, over `[inner, end, shared, 1]`, is zero where it is free, and else pushes it against its bound.
    fn stationarity(
        &self,
        (segment, t): LegPoint,
        control: usize,
        slope: &[f64],
        free: &[usize],
    ) -> Option<LinearCondition> {
        let bounds = self.equations.phase.controls[control].bounds;
        let factor = self.scaling.controls[control] * self.duration;
        let before = vec![0.0; self.equations.nx];
        let row = |sign: f64| before.iter().copied().chain(slope.iter().map(|v| sign * factor * v)).collect();
        if free.contains(&control) {
            return Some(LinearCondition::equation(row(1.0), 1.0));
        }
        if bounds.is_fixed() {
            return None;
        }
        let mut u = vec![0.0; self.equations.nu];
        self.found.control.evaluate_in(segment, t, &mut u);
        let side = BoundSide::of(u[control], &bounds, self.activity * self.scaling.controls[control])?;
        Some(LinearCondition::at_least_zero(row(-side.sign()), 1.0))
    }

    /// Joins the costates before the start of an interval with those at its end, from the integrals of what the equation says at each node.
    fn costate_rows(
        &self,
        course: &Course,
        start: &DMatrix<f64>,
        integrals: &[DMatrix<f64>],
    ) -> Vec<LinearCondition> {
        let nx = self.equations.nx;
        let mut rows = Vec::new();
        for i in (0..nx).filter(|i| course.held.iter().all(|h| h.state != *i)) {
            let mut row = self.row_of(course);
            row[i] = 1.0;
            row[nx..].iter_mut().zip(start.row(i).iter()).for_each(|(entry, v)| *entry = -v);
            rows.push(LinearCondition::equation(row, ADJOINT_WEIGHT));
        }
        for held in &course.held {
            let last = held.sides.len() - 1;
            let column = |n: usize| nx + if n < last { held.first + n } else { course.inner() + held.state };
            let mut jump = self.row_of(course);
            jump[held.state] = 1.0;
            jump[column(0)] -= 1.0;
            rows.extend(driven(jump, held.sides[0]));
            for n in 0..last {
                // The part of the integral between the nodes is what the equation adds.
                let mut row = self.row_of(course);
                let (from, to) = (integrals[n].row(held.state), integrals[n + 1].row(held.state));
                row[nx..]
                    .iter_mut()
                    .zip(to.iter().zip(from.iter()))
                    .for_each(|(e, (to, from))| *e = to - from);
                row[column(n)] += 1.0;
                row[column(n + 1)] -= 1.0;
                rows.extend(driven(row, held.driven(n)));
            }
        }
        rows
    }

    /// The columns of all costates at a point of an interval, of those that follow their equation as given.
    fn with_held(&self, course: &Course, (segment, t): LegPoint, y: &[f64]) -> Vec<f64> {
        let nc = y.len() / self.equations.nx;
        let mut lambda = y.to_vec();
        if course.held.is_empty() {
            return lambda;
        }
        let breaks = self.found.control.breaks();
        let (a, b) = (breaks[segment], breaks[segment + 1]);
        let basis = &self.found.state.segments()[segment].basis;
        let mut weights = vec![0.0; basis.nodes().len()];
        basis.basis(((t - a) - (b - t)) / (b - a), &mut weights);
        for held in &course.held {
            let row = &mut lambda[held.state * nc..(held.state + 1) * nc];
            row.fill(0.0);
            let last = weights.len() - 1;
            for (n, weight) in weights.iter().enumerate() {
                // Columns of a solution have the end first.
                let column = if n < last { self.equations.nx + held.first + n } else { held.state };
                row[column] = weight / self.scaling.states[held.state];
            }
        }
        lambda
    }

    /// `-H_x - mu . c_x` of every column.
    fn adjoint_rate(&mut self, point: LegPoint, y: &[f64], course: &Course, rate: &mut [f64]) {
        let nx = self.equations.nx;
        let nc = y.len() / nx;
        let width = self.equations.width();
        let local = self.local_at(point, &course.given);
        let lambda = self.with_held(course, point, y);
        let costates = nc - local.sources.len();
        for i in 0..nx {
            for c in 0..nc {
                let through: f64 = (0..nx).map(|k| local.jacobian[k * width + i] * lambda[k * nc + c]).sum();
                let source = if c < costates { 0.0 } else { local.sources[c - costates][i] };
                rate[i * nc + c] = -(through + source);
            }
        }
        if !course.followed.is_empty() {
            let rows = self.row_gradients(point, &course.followed);
            let mu = multipliers_of(&rows, &self.control_slopes(&local, &lambda), nx, &course.always);
            for (gradient, mu) in rows.iter().zip(&mu) {
                for i in 0..nx {
                    for c in 0..nc {
                        rate[i * nc + c] -= mu[c] * gradient[i];
                    }
                }
            }
        }
    }

    /// Slope of the Hamiltonian in each control, of every column.
    fn control_slopes(&self, local: &Local, y: &[f64]) -> Vec<Vec<f64>> {
        let (nx, nu, width) = (self.equations.nx, self.equations.nu, self.equations.width());
        let nc = y.len() / nx;
        let costates = nc - local.sources.len();
        let slope = |j: usize, c: usize| {
            let through: f64 = (0..nx).map(|k| local.jacobian[k * width + nx + j] * y[k * nc + c]).sum();
            through + if c < costates { 0.0 } else { local.sources[c - costates][nx + j] }
        };
        (0..nu).map(|j| (0..nc).map(|c| slope(j, c)).collect()).collect()
    }

    fn row_gradients(&mut self, point: LegPoint, rows: &[usize]) -> Vec<Vec<f64>> {
        self.go(point);
        let width = self.equations.width();
        let gradient = |r: &usize| {
            let mut g = vec![0.0; width];
            self.equations.row_gradient(*r, &mut g);
            g
        };
        rows.iter().map(gradient).collect()
    }

    fn free_controls(&mut self, point: LegPoint) -> Vec<usize> {
        let u = self.go(point);
        let controls = self.equations.phase.controls.iter().enumerate();
        let free =
            controls.filter(|(j, c)| c.bounds.excess(u[*j]) < -self.activity * self.scaling.controls[*j]);
        free.map(|(j, _)| j).collect()
    }

    /// Path rows that are active at all nodes of an interval and in which free controls occur. Where a multiplier comes down to zero, as where a
    /// thrust of given magnitude turns round, a method leaves the row a distance that is no rounding: it is active where the stated multiplier is
    /// larger than that, both relative to their sizes. Whether it is, is asked of the multipliers that are found.
    fn followed_rows(&mut self, segment: usize, nodes: &[f64], always: &[usize]) -> Vec<usize> {
        let rows = self.row_scales.len();
        let mut active = vec![true; rows];
        let mut path = vec![0.0; rows];
        for &t in nodes {
            let stated = self.stated_multipliers((segment, t));
            self.go((segment, t));
            self.equations.path(&mut path);
            let variables = self.equations.phase.path.iter().flat_map(|p| &p.rows);
            for ((r, variable), value) in variables.enumerate().zip(&path) {
                let scale = self.row_scales[r];
                let multiplier = relative(stated[r].abs() * scale, self.hamiltonian_size);
                let near = self.activity.max(multiplier) * scale;
                active[r] &= variable.bounds.is_fixed() || variable.bounds.excess(*value) >= -near;
            }
        }
        let nx = self.equations.nx;
        let Some(&middle) = nodes.get(nodes.len() / 2) else { return Vec::new() };
        let candidates: Vec<usize> = (0..rows).filter(|r| active[*r]).collect();
        let gradients = self.row_gradients((segment, middle), &candidates);
        let moved = candidates.into_iter().zip(gradients);
        moved
            .filter(|(_, g)| always.iter().any(|j| g[nx + j] != 0.0))
            .map(|(r, _)| r)
            .take(always.len())
            .collect()
    }

    /// States that touch a bound in an interval, ends of the phase apart.
    fn held(&self, segment: usize) -> Vec<Held> {
        let (t0, tf) = (self.found.initial_time, self.found.final_time);
        let inner = END * (tf - t0);
        let nodes: Vec<f64> = self.found.state.node_times(segment).collect();
        let places = self.found.state.segments()[segment].basis.nodes();
        if places.first() != Some(&-1.0) || places.last() != Some(&1.0) {
            return Vec::new();
        }
        let mut first = 0;
        let mut all = Vec::new();
        let mut x = vec![0.0; self.equations.nx];
        for (i, state) in self.equations.phase.states.iter().enumerate() {
            let side = |t: &f64| {
                if *t <= t0 + inner || *t >= tf - inner {
                    return None;
                }
                self.found.state.evaluate_in(segment, *t, &mut x);
                BoundSide::of(x[i], &state.variable.bounds, self.activity * self.scaling.states[i])
            };
            let sides: Vec<Option<BoundSide>> = nodes.iter().map(side).collect();
            if sides.iter().any(Option::is_some) {
                all.push(Held { state: i, sides, first });
                first += nodes.len() - 1;
            }
        }
        all
    }

    /// A solution as a matrix of scaled costates over `[inner, end, shared, 1]`.
    fn expand(&self, y: &[f64], inner: usize) -> DMatrix<f64> {
        let nx = self.equations.nx;
        let nc = y.len() / nx;
        let mut matrix = DMatrix::zeros(nx, inner + nx + self.shared + 1);
        for i in 0..nx {
            let row = self.expand_row(&y[i * nc..(i + 1) * nc], inner);
            for (c, v) in row.into_iter().enumerate() {
                matrix[(i, c)] = v * self.scaling.states[i];
            }
        }
        matrix
    }

    /// A row over `[end, inner, integrals of the phase, 1]` as one over `[inner, end, shared, 1]`.
    fn expand_row(&self, row: &[f64], inner: usize) -> Vec<f64> {
        let nx = self.equations.nx;
        let mut full = vec![0.0; inner + nx + self.shared + 1];
        full[..inner].copy_from_slice(&row[nx..nx + inner]);
        full[inner..inner + nx].copy_from_slice(&row[..nx]);
        for (l, (g, _)) in self.local.iter().enumerate() {
            full[inner + nx + g] = row[nx + inner + l];
        }
        full[inner + nx + self.shared] = row[nx + inner + self.local.len()];
        full
    }

    /// Writes costates and path multipliers into a phase, from the unknowns `[current, inner]` of the intervals and the shared ones.
    pub(super) fn write(
        &mut self,
        legs: &[Leg],
        found: &[Vec<f64>],
        shared: &[f64],
        phase: &mut PhaseTrajectory,
    ) -> Option<()> {
        let nx = self.equations.nx;
        let mut segments = Vec::new();
        let mut multipliers = self.found.path_multipliers.clone().map(|p| p.segments().to_vec());
        let rows = self.row_scales.len();
        for (k, leg) in legs.iter().enumerate() {
            let (inner, end) = (&found[k][nx..], &found[k + 1][..nx]);
            let unknowns: Vec<f64> = inner.iter().chain(end).chain(shared).copied().chain([1.0]).collect();
            let basis: &Arc<Barycentric> = &self.found.state.segments()[k].basis;
            let mut values = Vec::with_capacity(leg.nodes.len() * nx);
            for node in &leg.nodes {
                for i in 0..nx {
                    let sum: f64 = node.row(i).iter().zip(&unknowns).map(|(a, v)| a * v).sum();
                    values.push(sum / self.scaling.states[i]);
                }
            }
            segments.push(Segment { basis: Arc::clone(basis), values });
            if rows > 0 {
                let all = multipliers.get_or_insert_with(|| zero_segments(&self.found.control, rows));
                for (n, r, row) in &leg.multipliers {
                    let value: f64 = row.iter().zip(&unknowns).map(|(a, v)| a * v).sum();
                    *all[k].values.get_mut(n * rows + r)? = value;
                }
            }
        }
        let breaks = self.found.control.breaks().to_vec();
        phase.costate = Some(PiecewisePolynomial::new(nx, breaks.clone(), segments).ok()?);
        if let Some(all) = multipliers {
            phase.path_multipliers = Some(PiecewisePolynomial::new(rows, breaks, all).ok()?);
        }
        Some(())
    }
}

fn zero_segments(control: &PiecewisePolynomial, rows: usize) -> Vec<Segment> {
    let zero = |s: &Segment| Segment {
        basis: Arc::clone(&s.basis),
        values: vec![0.0; s.basis.nodes().len() * rows],
    };
    control.segments().iter().map(zero).collect()
}

/// The multipliers by which rows cancel the slopes in the free controls best: one row of columns for each.
fn multipliers_of(rows: &[Vec<f64>], slopes: &[Vec<f64>], nx: usize, free: &[usize]) -> Vec<Vec<f64>> {
    let (nr, nc) = (rows.len(), slopes.first().map_or(0, Vec::len));
    if nr == 0 {
        return Vec::new();
    }
    let c = DMatrix::from_fn(nr, free.len(), |r, j| rows[r][nx + free[j]]);
    let h = DMatrix::from_fn(free.len(), nc, |j, k| slopes[free[j]][k]);
    let rhs = -(&c * h);
    let square = &c * c.transpose();
    let solved = square.lu().solve(&rhs).unwrap_or_else(|| DMatrix::zeros(nr, nc));
    (0..nr).map(|r| solved.row(r).iter().copied().collect()).collect()
}
