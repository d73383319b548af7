//! Explicit Euler steps on the common base: a small method with a closed form, by which all that the base adds is tested.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use apsides_ad::{Dynamics, NodeFunction, PathFunction, Scalar};
use apsides_basis::Barycentric;
use apsides_nlp::{Nlp, NlpSettings, Scaling as NlpScaling, SolveReport, Stages, Status, check_derivatives};
use apsides_ocp::{
    At, Bounds, Guess, Ocp, OcpError, Phase, PhaseGuess, PhaseMesh, PhaseScaling, PhaseTrajectory,
    PiecewisePolynomial, RowOrigin, Segment, State, Trajectory, Variable,
};
use apsides_transcription::{
    ConstantEntry, Discretisation, Layout, Limits, PhaseEnds, PhaseLayout, PhaseStart, Places, StartingPoint,
    Transcribe, Transcription, Workers, write_next,
};

/// Agreement of derivatives with differences.
const DIFFERENCES: f64 = 1e-6;
/// From the tolerance of the solver, 1e-8.
const SOLVER: f64 = 1e-7;

/// A phase of equal steps: columns `[x, u]` per node, `x` alone at the last; a row per state and step.
struct Steps {
    ends: PhaseEnds,
    states: usize,
    controls: usize,
    count: usize,
    first_row: usize,
}

impl Steps {
    fn state(&self, node: usize) -> usize {
        self.ends.initial_state + node * (self.states + self.controls)
    }

    fn row(&self, step: usize) -> usize {
        self.first_row + step * self.states
    }
}

impl PhaseLayout for Steps {
    fn ends(&self) -> &PhaseEnds {
        &self.ends
    }

    fn quantities(&self) -> Vec<Vec<usize>> {
        let states = (0..self.states).map(|s| (0..=self.count).map(|k| self.state(k) + s).collect());
        let first = self.states;
        let controls =
            (0..self.controls).map(|c| (0..self.count).map(|k| self.state(k) + first + c).collect());
        states.chain(controls).collect()
    }

    fn lasts(&self, x: &[f64]) -> bool {
        x[self.ends.initial_time] < x[self.ends.final_time]
    }

    fn set_start(&self, guess: &PhaseGuess, x: &mut [f64]) {
        for node in 0..=self.count {
            let (fraction, column) = (node as f64 / self.count as f64, self.state(node));
            guess.state(fraction, &mut x[column..column + self.states]);
            if node < self.count {
                guess.control(fraction, &mut x[column + self.states..][..self.controls]);
            }
        }
    }

    fn set_bounds(&self, start: &PhaseStart<'_>, variables: &mut Limits, _rows: &mut Limits) {
        for (s, state) in start.phase.states.iter().enumerate() {
            for node in 0..=self.count {
                variables.set(self.state(node) + s, state.variable.bounds);
            }
            variables.intersect(self.state(0) + s, state.initial);
            variables.intersect(self.state(self.count) + s, state.terminal);
        }
        for (c, control) in start.phase.controls.iter().enumerate() {
            for node in 0..self.count {
                variables.set(self.state(node) + self.states + c, control.bounds);
            }
        }
    }

    fn set_scales(&self, _phase: &Phase, scaling: &PhaseScaling, scales: &mut NlpScaling) {
        for node in 0..=self.count {
            scales.variables[self.state(node)..][..self.states].copy_from_slice(&scaling.states);
            if node < self.count {
                scales.constraints[self.row(node)..][..self.states].copy_from_slice(&scaling.states);
            }
        }
    }

    fn constant_entries(&self) -> Vec<ConstantEntry> {
        let steps = (0..self.count).flat_map(|k| (0..self.states).map(move |s| (k, s)));
        let entry = |(k, s)| {
            [(self.row(k) + s, self.state(k) + s, -1.0), (self.row(k) + s, self.state(k + 1) + s, 1.0)]
        };
        steps.flat_map(entry).collect()
    }

    fn row_origin(&self, phase: &Phase, row: usize, x: &[f64]) -> Option<RowOrigin> {
        let offset = row.checked_sub(self.first_row).filter(|o| *o < self.count * self.states)?;
        let v = &phase.states[offset % self.states].variable;
        let fraction = (offset / self.states) as f64 / self.count as f64;
        let time = (1.0 - fraction) * x[self.ends.initial_time] + fraction * x[self.ends.final_time];
        let name = format!("step of {}", v.name);
        Some(RowOrigin { phase: Some(phase.name.clone()), name, unit: v.unit.clone(), time: Some(time) })
    }

    fn set_multipliers(&self, _phase: &Phase, earlier: &PhaseTrajectory, _x: &[f64], y: &mut [f64]) {
        let Some(costate) = &earlier.costate else { return };
        for step in 0..self.count {
            let time = earlier.time_at((step as f64 + 0.5) / self.count as f64);
            let row = self.row(step);
            costate.evaluate(time, &mut y[row..row + self.states]);
            y[row..row + self.states].iter_mut().for_each(|v| *v = -*v);
        }
    }

    fn set_stages(&self, stages: &mut Stages) {
        for step in 0..self.count {
            let (column, width) = (self.state(step), self.states + self.controls);
            stages.variables[column..column + width].fill(2 * step as u32);
            stages.constraints[self.row(step)..][..self.states].fill(2 * step as u32 + 1);
        }
    }
}

/// A function at all nodes that enters rows, or the cost, with a factor times the duration.
struct Sum {
    function: Arc<dyn NodeFunction>,
    /// First column of each node, and its rows.
    nodes: Vec<(usize, Option<usize>)>,
    factor: f64,
    cost: f64,
    times: (usize, usize),
    /// Inputs of a node but the time, on which nothing depends here.
    width: usize,
    values: Vec<Vec<f64>>,
    entries: Vec<Vec<f64>>,
}

impl Sum {
    fn inputs(&self, node: usize, x: &[f64]) -> Vec<f64> {
        let mut z = x[self.nodes[node].0..][..self.width].to_vec();
        z.push(0.0);
        z
    }

    fn duration(&self, x: &[f64]) -> f64 {
        x[self.times.1] - x[self.times.0]
    }

    fn refresh(&mut self, x: &[f64]) {
        for node in 0..self.nodes.len() {
            let z = self.inputs(node, x);
            self.function.jacobian(&z, &mut self.values[node], &mut self.entries[node]);
        }
    }

    /// `emit(node, output, column, value)` for the derivatives of `factor * duration * f`.
    fn each_slope(&self, x: &[f64], mut emit: impl FnMut(usize, usize, usize, f64)) {
        for (node, &(column, _)) in self.nodes.iter().enumerate() {
            for ((r, c), v) in self.function.pattern().jacobian_entries().zip(&self.entries[node]) {
                emit(node, r, column + c, self.factor * self.duration(x) * v);
            }
            for (r, v) in self.values[node].iter().enumerate() {
                emit(node, r, self.times.0, -self.factor * v);
                emit(node, r, self.times.1, self.factor * v);
            }
        }
    }

    fn each_bend(&self, x: &[f64], cost: f64, y: &[f64], mut emit: impl FnMut(usize, usize, f64)) {
        let pattern = self.function.pattern();
        for (node, &(column, row)) in self.nodes.iter().enumerate() {
            let outputs = 0..self.function.outputs();
            let weights: Vec<f64> =
                outputs.map(|r| row.map_or(0.0, |first| y[first + r]) + cost * self.cost).collect();
            let mut hessian = vec![0.0; pattern.hessian_len()];
            self.function.hessian(&self.inputs(node, x), &weights, &mut hessian);
            for (&(i, j), h) in pattern.hessian.iter().zip(&hessian) {
                emit(column + i, column + j, self.factor * self.duration(x) * h);
            }
            for ((r, c), v) in pattern.jacobian_entries().zip(&self.entries[node]) {
                emit(self.times.0, column + c, -self.factor * weights[r] * v);
                emit(self.times.1, column + c, self.factor * weights[r] * v);
            }
        }
    }
}

struct Euler {
    sums: Vec<Sum>,
    refreshed_at: Vec<f64>,
    workers: Workers,
}

impl Discretisation for Euler {
    type Phase = Steps;

    fn share(&mut self, workers: &Workers) {
        self.workers = workers.clone();
    }

    fn add_patterns(&mut self, jacobian: &mut Vec<(usize, usize)>, hessian: &mut Vec<(usize, usize)>) {
        let x = self.refreshed_at.clone();
        let y = vec![0.0; 1000];
        for s in &self.sums {
            s.each_slope(&x, |node, r, c, _| jacobian.extend(s.nodes[node].1.map(|row| (row + r, c))));
            s.each_bend(&x, 0.0, &y, |i, j, _| hessian.push((i.max(j), i.min(j))));
        }
    }

    fn run(&mut self, x: &[f64]) {
        self.refresh(x);
    }

    fn refresh(&mut self, x: &[f64]) -> bool {
        if self.refreshed_at == x {
            return false;
        }
        self.workers.each(&mut self.sums, |s| s.refresh(x));
        self.refreshed_at.copy_from_slice(x);
        true
    }

    fn cost(&mut self, x: &[f64]) -> f64 {
        let of = |s: &Sum| s.cost * s.factor * s.duration(x) * s.values.iter().map(|v| v[0]).sum::<f64>();
        self.sums.iter().map(of).sum()
    }

    fn add_gradient(&self, x: &[f64], gradient: &mut [f64]) {
        for s in &self.sums {
            s.each_slope(x, |_, _, c, v| gradient[c] += s.cost * v);
        }
    }

    fn add_values(&mut self, x: &[f64], rows: &mut [f64]) {
        for s in &self.sums {
            for (values, node) in s.values.iter().zip(&s.nodes) {
                for (k, v) in values.iter().enumerate() {
                    node.1.iter().for_each(|row| rows[row + k] += s.factor * s.duration(x) * v);
                }
            }
        }
    }

    fn fill_jacobian(&mut self, x: &[f64], entries: &mut [f64]) {
        let mut next = entries.iter_mut();
        for s in &self.sums {
            s.each_slope(x, |node, _, _, v| s.nodes[node].1.iter().for_each(|_| write_next(&mut next, v)));
        }
    }

    fn fill_hessian(&mut self, x: &[f64], cost: f64, multipliers: &[f64], entries: &mut [f64]) {
        let mut next = entries.iter_mut();
        for s in &self.sums {
            s.each_bend(x, cost, multipliers, |_, _, v| write_next(&mut next, v));
        }
    }
}

impl Transcribe for Euler {
    type Division = [usize];
    type Error = OcpError;

    fn transcribe(ocp: &Ocp, steps: &[usize], guess: &Guess) -> Result<Transcription<Self>, OcpError> {
        guess.check(ocp)?;
        let mut places = Places::default();
        let mut phases = Vec::new();
        for (phase, &count) in ocp.phases.iter().zip(steps) {
            let (states, controls) = (phase.states.len(), phase.controls.len());
            let first = places.take_columns(count * (states + controls));
            let last = places.take_columns(states);
            let times = places.take_columns(2);
            let first_row = places.take_rows(count * states);
            places.take_stages(2 * count as u32);
            let ends = PhaseEnds::new(phase, (first, last), (times, times + 1), &mut places);
            phases.push(Steps { ends, states, controls, count, first_row });
        }
        let layout = Layout::new(ocp, phases, places);
        let mut sums = Vec::new();
        for (k, (phase, p)) in ocp.phases.iter().zip(&layout.phases).enumerate() {
            let mut add = |function: &Arc<dyn NodeFunction>,
                           row: &dyn Fn(usize) -> Option<usize>,
                           factor: f64,
                           cost| {
                sums.push(Sum {
                    nodes: (0..p.count).map(|node| (p.state(node), row(node))).collect(),
                    factor: factor / p.count as f64,
                    cost,
                    times: (p.ends.initial_time, p.ends.final_time),
                    width: p.states + p.controls,
                    values: vec![vec![0.0; function.outputs()]; p.count],
                    entries: vec![vec![0.0; function.pattern().jacobian_len()]; p.count],
                    function: Arc::clone(function),
                });
            };
            add(&phase.dynamics, &|node| Some(p.row(node)), -1.0, 0.0);
            for (index, q) in phase.integrals.iter().enumerate() {
                let cost = ocp.objective.sense.sign() * ocp.objective.integral_weight(k, index);
                add(&q.function, &|_| p.ends.integral_rows[index], 1.0, cost);
            }
        }
        let (refreshed_at, workers) = (vec![f64::NAN; layout.variables], Workers::default());
        let euler = Self { sums, refreshed_at, workers };
        Ok(Transcription::assemble(ocp, guess, layout, euler, StartingPoint::BetweenBounds))
    }

    /// Straight lines between the nodes, with the costates between them.
    fn trajectory(
        nlp: &Transcription<Self>,
        ocp: &Ocp,
        report: &SolveReport,
    ) -> Result<Trajectory, OcpError> {
        let x = nlp.usable_point(report);
        let (line, point) = (Barycentric::new(&[-1.0, 1.0]).unwrap(), Barycentric::new(&[0.0]).unwrap());
        let (line, point) = (Arc::new(line), Arc::new(point));
        let phases = ocp.phases.iter().zip(&nlp.layout.phases).map(|(phase, p)| {
            let mesh = PhaseMesh::uniform(p.count, 1)?;
            let (initial_time, final_time) = (x[p.ends.initial_time], x[p.ends.final_time]);
            let breaks: Vec<f64> =
                mesh.fractions().iter().map(|f| initial_time + f * (final_time - initial_time)).collect();
            let segments = |basis: &Arc<Barycentric>, values: &dyn Fn(usize) -> Vec<f64>| {
                (0..p.count)
                    .map(|k| Segment { basis: Arc::clone(basis), values: values(k) })
                    .collect::<Vec<_>>()
            };
            let at = |node: usize| &x[p.state(node)..][..p.states];
            let states = segments(&line, &|k| [at(k), at(k + 1)].concat());
            let controls = segments(&point, &|k| x[p.state(k) + p.states..][..p.controls].to_vec());
            let y = &report.constraint_multipliers;
            let costates = segments(&point, &|k| y[p.row(k)..][..p.states].iter().map(|y| -y).collect());
            Ok(PhaseTrajectory {
                name: phase.name.clone(),
                initial_time,
                final_time,
                state: PiecewisePolynomial::new(p.states, breaks.clone(), states)?,
                control: PiecewisePolynomial::new(p.controls, breaks.clone(), controls)?,
                costate: Some(PiecewisePolynomial::new(p.states, breaks, costates)?),
                path_multipliers: None,
                contacts: Vec::new(),
                integral_multipliers: Some(p.ends.integral_multipliers(y)),
                interval_errors: vec![f64::NAN; p.count],
                mesh,
            })
        });
        Ok(nlp.joined(ocp, report, x, phases.collect::<Result<_, OcpError>>()?))
    }
}

struct Drift;

impl Dynamics<1, 1> for Drift {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

impl PathFunction<1, 1, 1> for Drift {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() * 0.5]
    }
}

fn leg(name: &str, first: f64, last: Option<f64>) -> Phase {
    let state = State::new("x", "m").starts_at(first);
    let state = last.map_or(state.clone(), |last| state.ends_at(last));
    Phase::new(name, Drift)
        .states([state])
        .controls([Variable::new("v", "m/s").within(-9.0, 9.0)])
        .integral(Variable::new("effort", "m2/s").at_most(50.0), Drift)
}

/// From 0 to 3 within 2 s at least effort: at constant speed, `3^2 / (2 * 2)`.
fn crossing() -> Ocp {
    let phase =
        leg("cross", 0.0, Some(3.0)).initial_time(Bounds::new(0.0, 1.0)).final_time(Bounds::new(1.5, 9.0));
    let phase = phase.duration(Bounds::new(0.1, 2.0));
    Ocp::builder("crossing").phase(phase).minimize_integral("cross", "effort").build().unwrap()
}

fn transcribed(ocp: &Ocp, steps: &[usize]) -> Transcription<Euler> {
    Transcription::new(ocp, steps, &Guess::linear(ocp)).unwrap()
}

#[test]
fn a_program_is_solved_and_started_again_from_its_own_costates() {
    let ocp = crossing();
    let settings = NlpSettings::default();
    let mut nlp = transcribed(&ocp, &[8]);
    let guess = Guess::linear(&ocp);
    assert!(nlp.warm_start(&ocp, &guess).is_none());
    let report = nlp.solve(&ocp, &guess, &settings, &mut ()).unwrap();
    assert_eq!(report.status, Status::Optimal);
    assert!((report.objective - 2.25).abs() < SOLVER, "{}", report.objective);
    let trajectory = nlp.trajectory(&ocp, &report).unwrap();
    let phase = &trajectory.phases[0];
    assert!((phase.final_time - phase.initial_time - 2.0).abs() < SOLVER);
    assert!((phase.control_at(phase.initial_time + 0.3)[0] - 1.5).abs() < SOLVER);
    // The costate of a constant speed is its negative.
    let mut costate = [0.0];
    phase.costate.as_ref().unwrap().evaluate(phase.initial_time + 0.3, &mut costate);
    assert!((costate[0] + 1.5).abs() < SOLVER, "{costate:?}");
    let again = Guess::earlier(&trajectory);
    let mut nlp = Transcription::<Euler>::new(&ocp, &[8], &again).unwrap();
    assert!(nlp.warm_start(&ocp, &again).is_some());
    let warm = nlp.solve(&ocp, &again, &settings, &mut ()).unwrap();
    assert!((warm.objective - 2.25).abs() < SOLVER);
    assert!(warm.counters.iterations < report.counters.iterations, "{:?}", warm.counters);
}

/// Two phases with a linkage, an end cost by a weight, a largest value wanted.
fn two_legs() -> Ocp {
    let first = leg("one", 0.0, None).final_time(Bounds::new(0.5, 3.0));
    let second = Phase::new("two", Drift)
        .states([State::new("x", "m")])
        .controls([Variable::new("v", "m/s").within(-1.0, 1.0)])
        .initial_time(Bounds::new(0.5, 3.0))
        .final_time(Bounds::new(1.0, 4.0))
        .integral(Variable::new("effort", "m2/s"), Drift);
    Ocp::builder("two legs")
        .phase(first)
        .phase(second)
        .link("one", "two")
        .objective(
            apsides_ocp::Sense::Maximize,
            "reach",
            "m",
            [
                apsides_ocp::Term::End(At::FinalState("two", "x"), 2.0),
                apsides_ocp::Term::Integral("one", "effort", -0.3),
                apsides_ocp::Term::Integral("two", "effort", -1.0),
            ],
        )
        .build()
        .unwrap()
}

#[test]
fn derivatives_agree_with_differences() {
    let mut nlp = transcribed(&two_legs(), &[2, 3]);
    let x: Vec<f64> = (0..nlp.variables()).map(|k| 0.4 + 0.3 * (1.7 * k as f64).sin()).collect();
    let report = check_derivatives(&mut nlp, &x).unwrap();
    assert!(report.is_within(DIFFERENCES), "{report:?}");
}

/// Columns: states 3 + 4, controls 2 + 3, times 4. Rows: steps 2 + 3, the bounded integral, the duration of the second phase whose
/// both times are free, the links of time and state.
#[test]
fn columns_and_rows_are_counted_and_named() {
    let ocp = two_legs();
    let nlp = transcribed(&ocp, &[2, 3]);
    assert_eq!((nlp.variables(), nlp.constraints()), (7 + 5 + 4, 5 + 1 + 1 + 2));
    let name = |row| nlp.row_origin(&ocp, row, &nlp.start).map(|o| o.name);
    assert_eq!(name(1).unwrap(), "step of x");
    assert_eq!(name(2).unwrap(), "effort");
    assert_eq!(name(6).unwrap(), "duration");
    assert!(name(7).unwrap().starts_with("link one-two: "), "{:?}", name(7));
    assert_eq!(name(9), None);
    let integral = nlp.layout.phases[0].ends.integral_rows[0].unwrap();
    assert_eq!((nlp.row_limits.lower[integral], nlp.row_limits.upper[integral]), (f64::NEG_INFINITY, 50.0));
    assert_eq!(nlp.layout.phases[1].ends.integral_rows, [None]);
    assert_eq!(nlp.sign(), -1.0);
    assert_eq!(nlp.integral_weights(&ocp, 0, &[0.5; 9]), [0.3 + 0.5]);
    assert_eq!(nlp.integral_weights(&ocp, 1, &[0.5; 9]), [1.0]);
}

/// The scale of a row that states none is its largest change, those of others are kept.
#[test]
fn open_scales_are_changes_at_the_start() {
    let ocp = crossing();
    let mut nlp = transcribed(&ocp, &[4]);
    let changes = nlp.changes();
    let [step, duration] = [0, nlp.layout.phases[0].ends.duration_row.unwrap()];
    assert_eq!(nlp.scales.constraints[step], nlp.scales.variables[0]);
    assert_eq!(nlp.scales.constraints[duration], nlp.scales.variables[nlp.layout.phases[0].ends.final_time]);
    assert_eq!(nlp.scales.objective, apsides_transcription::as_scale(changes.objective));
    assert!(nlp.scales.constraints.iter().all(|s| *s > 0.0 && s.is_finite()));
}

#[test]
fn the_most_violated_constraint_has_a_name() {
    // 3 m in at most 2 s at 1 m/s at most.
    let mut ocp = crossing();
    ocp.phases[0].controls[0].bounds = Bounds::new(-1.0, 1.0);
    let mut nlp = transcribed(&ocp, &[4]);
    let report = nlp.solve(&ocp, &Guess::linear(&ocp), &NlpSettings::default(), &mut ()).unwrap();
    assert_eq!(report.status, Status::Infeasible);
    let unmet = nlp.unmet(&ocp, &report).unwrap();
    assert!(["step of x", "duration"].contains(&unmet.origin.name.as_str()), "{unmet}");
    assert!(unmet.amount.abs() > 1e-3, "{unmet}");
}

/// A report whose point is no trajectory gives the start.
#[test]
fn a_point_that_is_no_trajectory_is_replaced_by_the_start() {
    let ocp = crossing();
    let mut nlp = transcribed(&ocp, &[4]);
    let mut report = nlp.solve(&ocp, &Guess::linear(&ocp), &NlpSettings::default(), &mut ()).unwrap();
    assert_eq!(nlp.usable_point(&report), report.x);
    report.x[nlp.layout.phases[0].ends.final_time] = -1.0;
    assert_eq!(nlp.usable_point(&report), nlp.start);
    report.x[0] = f64::NAN;
    assert_eq!(nlp.usable_point(&report), nlp.start);
}

#[test]
fn threads_change_no_bit() {
    let evaluate = |threads| {
        let mut nlp = transcribed(&two_legs(), &[3, 3]).with_threads(threads);
        let x: Vec<f64> = (0..nlp.variables()).map(|k| (k as f64).cos()).collect();
        let mut values = vec![0.0; nlp.constraints()];
        nlp.constraint_values(&x, &mut values);
        let mut jacobian = vec![f64::NAN; nlp.jacobian_pattern().len()];
        nlp.jacobian(&x, &mut jacobian);
        values.extend(jacobian);
        values.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(evaluate(3), evaluate(1));
}
