//! A solution as piecewise polynomials: one piece per step of the integration.

use std::ops::ControlFlow;
use std::sync::Arc;

use apsides_basis::{Barycentric, Lobatto};
use apsides_ocp::{Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};
use apsides_ode::{Observer, Occurrence, Step};

use super::conditions::{Conditions, FailedSegment};
use super::flow::{ControlSwitch, Passage};
use crate::ShootingError;

/// Nodes of a piece: enough for the dense output, which has degree 7.
const NODES: usize = 9;

/// Samples of the steps of one segment.
struct Sampler<'a> {
    nodes: &'a [f64],
    components: usize,
    /// Ends of the pieces, and the samples of each: `nodes x components`.
    ends: Vec<f64>,
    samples: Vec<Vec<f64>>,
    /// Switches passed before each piece.
    switches: Vec<usize>,
    passed: usize,
    /// Switches at the end of the step that is to come.
    at_end: usize,
}

impl Observer for Sampler<'_> {
    fn step(&mut self, step: &Step<'_>) -> ControlFlow<()> {
        let (a, b) = (step.start(), step.end());
        // A switch right at a step's end leaves a step of no length.
        if b > a {
            let mut rows = vec![0.0; self.nodes.len() * self.components];
            for (x, row) in self.nodes.iter().zip(rows.chunks_mut(self.components)) {
                step.evaluate(a + 0.5 * (b - a) * (x + 1.0), row);
            }
            self.ends.push(b);
            self.samples.push(rows);
            self.switches.push(self.passed);
        }
        self.passed += std::mem::take(&mut self.at_end);
        ControlFlow::Continue(())
    }

    fn event(&mut self, _occurrence: &Occurrence<'_>) -> ControlFlow<()> {
        self.at_end += 1;
        ControlFlow::Continue(())
    }
}

/// The trajectory of a solution, and the switches of its controls per phase.
pub(super) struct Extracted {
    pub(super) trajectory: Trajectory,
    pub(super) switches: Vec<Vec<ControlSwitch>>,
}

/// Flies the solution once more and samples it.
pub(super) fn extract(
    ocp: &Ocp,
    equations: &mut Conditions,
    z: &[f64],
    tolerance: f64,
) -> Result<Result<Extracted, FailedSegment>, ShootingError> {
    let Some(rule) = Lobatto::new(NODES).ok() else { unreachable!("nine points make a rule") };
    let basis = rule.support_basis().clone();
    let basis = Arc::new(basis);
    let layout = equations.layout.clone();
    let parameters = z[layout.first_parameter..layout.first_parameter + layout.parameters].to_vec();
    let mut phases = Vec::with_capacity(ocp.phases.len());
    let mut integrals = Vec::with_capacity(ocp.phases.len());
    let mut all_switches = Vec::with_capacity(ocp.phases.len());
    for (k, phase) in ocp.phases.iter().enumerate() {
        let p = &layout.phases[k];
        let (nx, nu) = (p.states, phase.controls.len());
        let components = equations.flows[k].hamiltonian.borrow().dimension();
        let mut pieces = Pieces { breaks: vec![z[p.initial_time]], ..Pieces::default() };
        let mut switches = Vec::new();
        let mut sums = vec![0.0; phase.integrals.len()];
        for segment in 0..p.segments() {
            let mut sampler = Sampler {
                nodes: basis.nodes(),
                components,
                ends: Vec::new(),
                samples: Vec::new(),
                switches: Vec::new(),
                passed: 0,
                at_end: 0,
            };
            let mut passage = Passage::default();
            let node = p.node(segment);
            let times = p.segment_times(z, segment);
            let mut control = equations.controls[k][segment].clone();
            let flown = equations.flows[k].pass_observed(
                &parameters,
                times,
                &z[node..node + 2 * nx],
                &mut control,
                false,
                &mut passage,
                &mut sampler,
            );
            if let Err(reason) = flown {
                return Ok(Err(FailedSegment { phase: k, segment, reason }));
            }
            let mut h = equations.flows[k].hamiltonian.borrow_mut();
            h.start_control(&control);
            h.choose_levels(times.0, &z[node..node + nx], &z[node + nx..node + 2 * nx], &parameters);
            let mut done = 0;
            let mut from = times.0;
            for ((&to, samples), &passed) in sampler.ends.iter().zip(&sampler.samples).zip(&sampler.switches)
            {
                for s in &passage.switches[done..passed.min(passage.switches.len())] {
                    h.apply_switch(s);
                }
                done = done.max(passed.min(passage.switches.len()));
                let mut controls = Vec::with_capacity(NODES * nu);
                let (mut states, mut costates, mut multipliers) = (Vec::new(), Vec::new(), Vec::new());
                let mut rows = vec![0.0; phase.path_rows()];
                for (j, y) in samples.chunks(components).enumerate() {
                    let t = from + 0.5 * (to - from) * (basis.nodes()[j] + 1.0);
                    h.find_control(t, &y[..nx], &y[nx..2 * nx], &parameters);
                    controls.extend_from_slice(h.control());
                    h.write_multipliers(&mut rows);
                    multipliers.extend_from_slice(&rows);
                    states.extend_from_slice(&y[..nx]);
                    costates.extend_from_slice(&y[nx..2 * nx]);
                    let inputs = [&y[..nx], h.control()].concat();
                    add_integrals(
                        ocp,
                        k,
                        &inputs,
                        &parameters,
                        t,
                        0.5 * (to - from) * rule.weights()[j],
                        &mut sums,
                    );
                }
                pieces.push(to, [states, costates, controls, multipliers]);
                from = to;
            }
            switches.extend(passage.switches);
        }
        phases.push(pieces.phase(phase, &basis, tolerance)?);
        integrals.push(sums);
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
    Ok(Ok(Extracted { trajectory, switches: all_switches }))
}

fn add_integrals(ocp: &Ocp, k: usize, xu: &[f64], p: &[f64], t: f64, weight: f64, sums: &mut [f64]) {
    let phase = &ocp.phases[k];
    for (sum, q) in sums.iter_mut().zip(&phase.integrals) {
        let parameters = if phase.takes_parameters(q.function.as_ref()) { p } else { &[] };
        let inputs = [xu, parameters, &[t]].concat();
        let mut value = [0.0];
        q.function.value(&inputs, &mut value);
        *sum += weight * value[0];
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

    fn phase(
        self,
        phase: &Phase,
        basis: &Arc<Barycentric>,
        tolerance: f64,
    ) -> Result<PhaseTrajectory, ShootingError> {
        let count = self.values[0].len();
        let (start, end) = (self.breaks[0], self.breaks[count]);
        let mut fractions: Vec<f64> = self.breaks.iter().map(|b| (b - start) / (end - start)).collect();
        fractions[count] = 1.0;
        let polynomial = |dimension: usize, values: Vec<Vec<f64>>| {
            let segments =
                values.into_iter().map(|values| Segment { basis: basis.clone(), values }).collect();
            PiecewisePolynomial::new(dimension, self.breaks.clone(), segments)
        };
        let (nx, rows) = (phase.states.len(), phase.path_rows());
        let [states, costates, controls, multipliers] = self.values;
        Ok(PhaseTrajectory {
            name: phase.name.clone(),
            initial_time: start,
            final_time: end,
            mesh: PhaseMesh::new(fractions, vec![NODES - 1; count])?,
            state: polynomial(nx, states)?,
            control: polynomial(phase.controls.len(), controls)?,
            costate: Some(polynomial(nx, costates)?),
            path_multipliers: if rows > 0 { Some(polynomial(rows, multipliers)?) } else { None },
            integral_multipliers: None,
            interval_errors: vec![tolerance; count],
        })
    }
}
