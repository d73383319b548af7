//! A solution as piecewise polynomials: one piece per step of the integration.

use std::ops::ControlFlow;
use std::sync::Arc;

use apsides_basis::{Barycentric, Lgr};
use apsides_ocp::{Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};
use apsides_ode::{DenseSolution, Observer, Occurrence, Step};

use super::conditions::{Conditions, FailedSegment};
use super::flow::SegmentFlight;
use super::hamiltonian::{ControlSwitch, Hamiltonian};
use crate::ShootingError;

/// Radau points of a piece: with its end enough for the dense output, which has degree 7. Controls have no node at the end, where the
/// next piece may begin with another value.
const POINTS: usize = 9;
/// Where controls are compared with their polynomials, in half lengths of a piece after its start and at its end, and how near they are
/// to be, relative to their size or one.
const UNSEEN: f64 = 0.045;
const CONTROL_TOLERANCE: f64 = 1e-9;
/// Halvings of the time between two nodes in the search for a change of the working set, and how often a step is divided.
const HALVINGS: usize = 45;
const DIVISIONS: usize = 6;

/// The steps of one segment.
struct Steps {
    dense: DenseSolution,
    /// Switches passed before each step.
    switches: Vec<usize>,
    passed: usize,
    /// Switches at the end of the step that is to come.
    at_end: usize,
}

impl Observer for Steps {
    fn step(&mut self, step: &Step<'_>) -> ControlFlow<()> {
        self.switches.push(self.passed);
        self.passed += std::mem::take(&mut self.at_end);
        self.dense.step(step)
    }

    fn event(&mut self, _occurrence: &Occurrence<'_>) -> ControlFlow<()> {
        self.at_end += 1;
        ControlFlow::Continue(())
    }
}

/// The trajectory of a solution, and the switches of its controls per phase.
pub(super) struct Extremal {
    pub(super) trajectory: Trajectory,
    pub(super) switches: Vec<Vec<ControlSwitch>>,
    /// The largest gain per phase, relative to the objective, that another level of a switching control would bring.
    pub(super) wrong_level: f64,
}

/// Flies the solution once more and samples it.
#[expect(clippy::unreachable, reason = "invariant: nine points make a rule")]
pub(super) fn extract(
    ocp: &Ocp,
    equations: &mut Conditions,
    z: &[f64],
    tolerance: f64,
) -> Result<Result<Extremal, FailedSegment>, ShootingError> {
    let Some(nodes) = Nodes::new() else { unreachable!("invariant: nine points make a rule") };
    let layout = equations.layout.clone();
    let parameters = z[layout.first_parameter..layout.first_parameter + layout.parameters].to_vec();
    let mut phases = Vec::with_capacity(ocp.phases.len());
    let mut integrals = Vec::with_capacity(ocp.phases.len());
    let mut all_switches = Vec::with_capacity(ocp.phases.len());
    let mut wrong_level = 0.0_f64;
    for (k, phase) in ocp.phases.iter().enumerate() {
        let p = &layout.phases[k];
        let n = 2 * p.states;
        let flight = &mut equations.phases[k];
        let components = flight.flow.hamiltonian.get_mut().dimension();
        let mut sampler = Sampler {
            phase,
            parameters: &parameters,
            nodes: &nodes,
            pieces: Pieces { breaks: vec![z[p.initial_time]], ..Pieces::default() },
            integrals: vec![0.0; phase.integrals.len()],
            wrong_level: 0.0,
        };
        let mut switches = Vec::new();
        for segment in 0..p.segments() {
            let (times, node) = (p.segment_times(z, segment), p.node(segment));
            let start = &z[node..node + n];
            let mut first = start.to_vec();
            first.resize(components, 0.0);
            let dense = DenseSolution::new(times.0, &first);
            let mut steps = Steps { dense, switches: Vec::new(), passed: 0, at_end: 0 };
            let mut passage = SegmentFlight::default();
            let mut control = flight.controls[segment].clone();
            let flown = flight.flow.pass_observed(
                &parameters,
                times,
                start,
                &mut control,
                false,
                &mut passage,
                &mut steps,
            );
            if let Err(reason) = flown {
                return Ok(Err(FailedSegment { phase: k, segment, reason }));
            }
            let h = flight.flow.hamiltonian.get_mut();
            h.start_control(&control);
            h.choose_levels(times.0, &start[..p.states], &start[p.states..], &parameters);
            let mut done = 0;
            for (ends, &passed) in steps.dense.times().windows(2).zip(&steps.switches) {
                for switch in &passage.switches[done..passed] {
                    h.apply_switch(switch);
                }
                done = passed;
                // A switch right at a step's end leaves a step of no length.
                if ends[1] > ends[0] {
                    sampler.sample(h, &steps.dense, (ends[0], ends[1]), DIVISIONS);
                }
            }
            switches.extend(passage.switches);
        }
        phases.push(sampler.pieces.phase(phase, &nodes, tolerance)?);
        let duration = z[p.final_time] - z[p.initial_time];
        wrong_level = wrong_level.max(sampler.wrong_level * duration / layout.objective);
        integrals.push(sampler.integrals);
        all_switches.push(switches);
    }
    let mut objective = equations.ends.cost(z);
    for &(phase, integral, weight) in &ocp.objective.integrals {
        objective += weight * integrals[phase][integral];
    }
    let mut first = layout.first_multiplier;
    let multipliers = ocp.constraints.iter().map(|c| {
        let rows = z[first..first + c.rows.len()].to_vec();
        first += c.rows.len();
        rows
    });
    let trajectory =
        Trajectory { phases, parameters, objective, constraint_multipliers: Some(multipliers.collect()) };
    Ok(Ok(Extremal { trajectory, switches: all_switches, wrong_level }))
}

/// The nodes of a piece, the same for all.
struct Nodes {
    rule: Arc<Lgr>,
    /// Through the Radau points and the end: states and costates.
    with_end: Arc<Barycentric>,
    /// Through the Radau points: controls and multipliers.
    points: Arc<Barycentric>,
}

impl Nodes {
    fn new() -> Option<Self> {
        let rule = Lgr::shared(POINTS).ok()?;
        let points = Arc::new(Barycentric::new(rule.nodes()).ok()?);
        Some(Self { with_end: Arc::new(rule.support_basis().clone()), points, rule })
    }
}

/// Samples the steps of one phase.
struct Sampler<'a> {
    phase: &'a Phase,
    parameters: &'a [f64],
    nodes: &'a Nodes,
    pieces: Pieces,
    integrals: Vec<f64>,
    /// Largest value of [`Hamiltonian::wrong_level`].
    wrong_level: f64,
}

impl Sampler<'_> {
    /// Adds a piece, or several where the controls have a kink, since the working set of the pointwise minimisation changes, or
    /// bend too much for a polynomial.
    fn sample(
        &mut self,
        h: &mut Hamiltonian,
        dense: &DenseSolution,
        (from, to): (f64, f64),
        divisions: usize,
    ) {
        let nx = self.phase.states.len();
        let mut y = vec![0.0; dense.dimension()];
        let mut look = |h: &mut Hamiltonian, t: f64| {
            // Inside the step there is always a value.
            let _ = dense.evaluate(t.clamp(from, to), &mut y);
            h.find_control(t, &y[..nx], &y[nx..2 * nx], self.parameters);
            (y[..nx].to_vec(), y[nx..2 * nx].to_vec())
        };
        let half = 0.5 * (to - from);
        let times: Vec<f64> = self.nodes.rule.support().iter().map(|x| from + half * (x + 1.0)).collect();
        let mut values: [Vec<f64>; 4] = Default::default();
        let mut sums = vec![0.0; self.integrals.len()];
        let mut rows = vec![0.0; self.phase.path_rows()];
        let mut before = None;
        for (j, &t) in times.iter().enumerate() {
            let (x, costate) = look(h, t);
            let places = h.places();
            if let Some(before) = before.filter(|b| *b != places && divisions > 0) {
                let (mut a, mut b) = (times[j - 1], t);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (a + b);
                    look(h, middle);
                    if h.places() == before { a = middle } else { b = middle }
                }
                if from < a && b < to {
                    look(h, from);
                    self.sample(h, dense, (from, a), 0);
                    look(h, b);
                    return self.sample(h, dense, (a, to), divisions - 1);
                }
            }
            before = Some(places);
            self.wrong_level = self.wrong_level.max(h.wrong_level());
            values[0].extend_from_slice(&x);
            values[1].extend_from_slice(&costate);
            // The end is a node of states and costates alone.
            let Some(weight) = self.nodes.rule.weights().get(j) else { break };
            let weight = half * weight;
            h.write_multipliers(&mut rows);
            for (sum, q) in sums.iter_mut().zip(&self.phase.integrals) {
                let takes = self.phase.takes_parameters(q.function.as_ref());
                let parameters = if takes { self.parameters } else { &[] };
                let mut value = [0.0];
                q.function.value(&[&x, h.control(), parameters, &[t]].concat(), &mut value);
                *sum += weight * value[0];
            }
            values[2].extend_from_slice(h.control());
            values[3].extend_from_slice(&rows);
        }
        // The controls are no polynomials of the degree of the states.
        let nu = self.phase.controls.len();
        let mut between = vec![0.0; nu];
        let rough = [from + UNSEEN * half, to].into_iter().any(|t| {
            look(h, t);
            self.nodes.points.evaluate_all(&values[2], (t - from) / half - 1.0, &mut between);
            let off = |(a, b): (&f64, &f64)| (a - b).abs() > CONTROL_TOLERANCE * b.abs().max(1.0);
            between.iter().zip(h.control()).any(off)
        });
        if rough && divisions > 0 {
            let middle = from + half;
            look(h, from);
            self.sample(h, dense, (from, middle), divisions - 1);
            return self.sample(h, dense, (middle, to), divisions - 1);
        }
        self.integrals.iter_mut().zip(sums).for_each(|(i, s)| *i += s);
        self.pieces.push(to, values);
    }
}

/// Pieces of one phase: states, costates, controls, multipliers of the path constraints.
#[derive(Default)]
struct Pieces {
    breaks: Vec<f64>,
    values: [Vec<Vec<f64>>; 4],
}

impl Pieces {
    fn push(&mut self, end: f64, values: [Vec<f64>; 4]) {
        self.breaks.push(end);
        for (list, piece) in self.values.iter_mut().zip(values) {
            list.push(piece);
        }
    }

    fn phase(self, phase: &Phase, nodes: &Nodes, tolerance: f64) -> Result<PhaseTrajectory, ShootingError> {
        let count = self.values[0].len();
        let (start, end) = (self.breaks[0], self.breaks[count]);
        let mut fractions: Vec<f64> = self.breaks.iter().map(|b| (b - start) / (end - start)).collect();
        fractions[count] = 1.0;
        let polynomial = |dimension: usize, basis: &Arc<Barycentric>, values: Vec<Vec<f64>>| {
            let segments =
                values.into_iter().map(|values| Segment { basis: Arc::clone(basis), values }).collect();
            PiecewisePolynomial::new(dimension, self.breaks.clone(), segments)
        };
        let (nx, rows) = (phase.states.len(), phase.path_rows());
        let [states, costates, controls, multipliers] = self.values;
        Ok(PhaseTrajectory {
            name: phase.name.clone(),
            initial_time: start,
            final_time: end,
            mesh: PhaseMesh::new(fractions, vec![POINTS; count])?,
            state: polynomial(nx, &nodes.with_end, states)?,
            control: polynomial(phase.controls.len(), &nodes.points, controls)?,
            costate: Some(polynomial(nx, &nodes.with_end, costates)?),
            path_multipliers: if rows > 0 {
                Some(polynomial(rows, &nodes.points, multipliers)?)
            } else {
                None
            },
            contacts: Vec::new(),
            integral_multipliers: None,
            interval_errors: vec![tolerance; count],
        })
    }
}
