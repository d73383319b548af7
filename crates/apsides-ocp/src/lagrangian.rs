//! The slope of the Lagrangian of a phase in its states and controls.
//!
//! ```text
//! L = lambda . f + sum w_q q + mu . c
//! ```
//!
//! `w` are the weights of the integrals in the minimised objective plus the multipliers of their bounds, `mu` the multipliers of the path
//! constraints.

use apsides_ad::NodeFunction;

use crate::{Ocp, Phase, PhaseTrajectory, Sense};

/// Evaluates the slope of the Lagrangian along the trajectory of a phase.
pub struct LagrangianSlope<'a> {
    phase: &'a Phase,
    found: &'a PhaseTrajectory,
    parameters: &'a [f64],
    weights: Vec<f64>,
    inputs: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    costate: Vec<f64>,
    multipliers: Vec<f64>,
}

impl<'a> LagrangianSlope<'a> {
    /// That of the phase with an index; what the trajectory does not have of costates and multipliers counts as zero.
    #[must_use]
    pub fn new(ocp: &'a Ocp, index: usize, found: &'a PhaseTrajectory, parameters: &'a [f64]) -> Self {
        let phase = &ocp.phases[index];
        let sign = if ocp.objective.sense == Sense::Maximize { -1.0 } else { 1.0 };
        let multiplier = |q: usize| found.integral_multipliers.as_ref().map_or(0.0, |m| m[q]);
        let weight = |q: usize| sign * ocp.objective.integral_weight(index, q) + multiplier(q);
        Self {
            phase,
            found,
            parameters,
            weights: (0..phase.integrals.len()).map(weight).collect(),
            inputs: vec![0.0; phase.states.len() + phase.controls.len() + parameters.len() + 1],
            values: vec![0.0; phase.functions().map(|f| f.outputs()).max().unwrap_or(0)],
            entries: vec![0.0; phase.functions().map(|f| f.pattern().jacobian_len()).max().unwrap_or(0)],
            costate: vec![0.0; phase.states.len()],
            multipliers: vec![0.0; phase.path_rows()],
        }
    }

    /// Adds the slope at a time of an interval to `slope`: in the states, and in the controls behind them where it has places for those.
    pub fn add(&mut self, interval: usize, time: f64, slope: &mut [f64]) {
        let (phase, found) = (self.phase, self.found);
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        found.state.evaluate_in(interval, time, &mut self.inputs[..nx]);
        found.control.evaluate_in(interval, time, &mut self.inputs[nx..nx + nu]);
        if let Some(costate) = &found.costate {
            costate.evaluate_in(interval, time, &mut self.costate);
        }
        self.multipliers.fill(0.0);
        if let Some(path) = &found.path_multipliers {
            path.evaluate_in(interval, time, &mut self.multipliers);
        }
        let costate = std::mem::take(&mut self.costate);
        self.add_weighted(phase.dynamics.as_ref(), &costate, time, slope);
        self.costate = costate;
        for (q, integral) in phase.integrals.iter().enumerate() {
            self.add_weighted(integral.function.as_ref(), &[self.weights[q]], time, slope);
        }
        let multipliers = std::mem::take(&mut self.multipliers);
        let mut rest = multipliers.as_slice();
        for constraint in &phase.path {
            let (rows, others) = rest.split_at(constraint.rows.len());
            if rows.iter().any(|m| *m != 0.0) {
                self.add_weighted(constraint.function.as_ref(), rows, time, slope);
            }
            rest = others;
        }
        self.multipliers = multipliers;
    }

    fn add_weighted(&mut self, function: &dyn NodeFunction, weights: &[f64], time: f64, slope: &mut [f64]) {
        let first = self.phase.states.len() + self.phase.controls.len();
        // What is left of the inputs are all parameters or none, then the time.
        let count = function.inputs() - 1 - first;
        self.inputs[first..first + count].copy_from_slice(&self.parameters[..count]);
        self.inputs[first + count] = time;
        let pattern = function.pattern();
        let entries = &mut self.entries[..pattern.jacobian_len()];
        let values = &mut self.values[..function.outputs()];
        function.jacobian(&self.inputs[..function.inputs()], values, entries);
        for ((row, column), entry) in pattern.jacobian_entries().zip(entries) {
            if let Some(s) = slope.get_mut(column) {
                *s += weights[row] * *entry;
            }
        }
    }
}
