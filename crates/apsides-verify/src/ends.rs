//! Quantities at the ends of phases, functions of them and their gradients.

use apsides_ad::NodeFunction;
use apsides_ocp::{Bounds, EndpointInput, Ocp, Phase, Scaling, Trajectory};

use crate::VerifySettings;
use crate::equations::sign;

/// Times, states and integrals of one phase at its ends.
#[derive(Clone, Debug)]
pub(crate) struct PhaseEnds {
    pub(crate) initial_time: f64,
    pub(crate) final_time: f64,
    pub(crate) initial_state: Vec<f64>,
    pub(crate) final_state: Vec<f64>,
}

/// The ends of all phases, and the static parameters.
#[derive(Clone, Debug)]
pub(crate) struct Ends {
    pub(crate) phases: Vec<PhaseEnds>,
    pub(crate) parameters: Vec<f64>,
}

impl Ends {
    /// The ends as the trajectory states them.
    pub(crate) fn of(trajectory: &Trajectory) -> Self {
        let phases = trajectory
            .phases
            .iter()
            .map(|p| PhaseEnds {
                initial_time: p.initial_time,
                final_time: p.final_time,
                initial_state: p.state_at(p.initial_time),
                final_state: p.final_state(),
            })
            .collect();
        Self { phases, parameters: trajectory.parameters.clone() }
    }

    pub(crate) fn value(&self, input: EndpointInput) -> f64 {
        match input {
            EndpointInput::InitialTime { phase } => self.phases[phase].initial_time,
            EndpointInput::FinalTime { phase } => self.phases[phase].final_time,
            EndpointInput::InitialState { phase, state } => self.phases[phase].initial_state[state],
            EndpointInput::FinalState { phase, state } => self.phases[phase].final_state[state],
            EndpointInput::Parameter { index } => self.parameters[index],
        }
    }

    /// Values of a function of end quantities.
    pub(crate) fn evaluate(&self, function: &dyn NodeFunction, inputs: &[EndpointInput]) -> Vec<f64> {
        let z: Vec<f64> = inputs.iter().map(|i| self.value(*i)).collect();
        let mut out = vec![0.0; function.outputs()];
        function.value(&z, &mut out);
        out
    }

    /// Jacobian entries `(row, input, value)` of a function of end quantities.
    pub(crate) fn jacobian(
        &self,
        function: &dyn NodeFunction,
        inputs: &[EndpointInput],
    ) -> Vec<(usize, EndpointInput, f64)> {
        let z: Vec<f64> = inputs.iter().map(|i| self.value(*i)).collect();
        let mut out = vec![0.0; function.outputs()];
        let mut entries = vec![0.0; function.pattern().jacobian_len()];
        function.jacobian(&z, &mut out, &mut entries);
        let places = function.pattern().jacobian_entries();
        places.zip(entries).map(|((row, column), v)| (row, inputs[column], v)).collect()
    }

    /// Entries `(input, input, value)` of the lower triangle of the weighted Hessian of a function of end quantities.
    pub(crate) fn hessian(
        &self,
        function: &dyn NodeFunction,
        inputs: &[EndpointInput],
        weights: &[f64],
    ) -> Vec<(EndpointInput, EndpointInput, f64)> {
        let z: Vec<f64> = inputs.iter().map(|i| self.value(*i)).collect();
        let mut entries = vec![0.0; function.pattern().hessian_len()];
        function.hessian(&z, weights, &mut entries);
        let places = function.pattern().hessian.iter();
        places.zip(entries).map(|(&(i, j), v)| (inputs[i], inputs[j], v)).collect()
    }

    /// The objective in its own sense from these ends and the integrals of each phase.
    pub(crate) fn objective(&self, ocp: &Ocp, integrals: &[Vec<f64>]) -> f64 {
        let o = &ocp.objective;
        let linear: f64 = o.linear.iter().map(|(input, w)| w * self.value(*input)).sum();
        let integral: f64 = o.integrals.iter().map(|&(p, q, w)| w * integrals[p][q]).sum();
        let functions: f64 = o.functions.iter().map(|(inputs, f)| self.evaluate(f.as_ref(), inputs)[0]).sum();
        linear + integral + functions
    }
}

/// Gradient of a scalar with respect to every end quantity.
#[derive(Clone, Debug)]
pub(crate) struct EndGradient {
    /// Position of each phase's quantities: start time, end time, initial states, final states.
    offsets: Vec<usize>,
    values: Vec<f64>,
    /// Quantities whose entry is not known.
    unknown: Vec<bool>,
}

impl EndGradient {
    fn zero(ocp: &Ocp) -> Self {
        let mut offsets = vec![0];
        for phase in &ocp.phases {
            offsets.push(offsets[offsets.len() - 1] + 2 + 2 * phase.states.len());
        }
        let n = offsets[offsets.len() - 1] + ocp.parameters.len();
        Self { offsets, values: vec![0.0; n], unknown: vec![false; n] }
    }

    fn position(&self, input: EndpointInput) -> usize {
        match input {
            EndpointInput::InitialTime { phase } => self.offsets[phase],
            EndpointInput::FinalTime { phase } => self.offsets[phase] + 1,
            EndpointInput::InitialState { phase, state } => self.offsets[phase] + 2 + state,
            EndpointInput::FinalState { phase, state } => {
                (self.offsets[phase] + self.offsets[phase + 1]) / 2 + 1 + state
            }
            EndpointInput::Parameter { index } => self.offsets[self.offsets.len() - 1] + index,
        }
    }

    /// Gradient of the end cost of the minimised objective.
    pub(crate) fn of_cost(ocp: &Ocp, ends: &Ends) -> Self {
        let mut gradient = Self::zero(ocp);
        let sign = sign(ocp);
        for &(input, weight) in &ocp.objective.linear {
            gradient.add(input, sign * weight);
        }
        for (inputs, f) in &ocp.objective.functions {
            for (_, input, v) in ends.jacobian(f.as_ref(), inputs) {
                gradient.add(input, sign * v);
            }
        }
        gradient
    }

    /// Diagonal of the Hessian of the end cost, without its sign.
    pub(crate) fn curvature_of_cost(ocp: &Ocp, ends: &Ends) -> Self {
        let mut curvature = Self::zero(ocp);
        for (inputs, f) in &ocp.objective.functions {
            for (a, _, v) in ends.hessian(f.as_ref(), inputs, &[1.0]).into_iter().filter(|(a, b, _)| a == b) {
                curvature.add(a, v);
            }
        }
        curvature.values.iter_mut().for_each(|v| *v = v.abs());
        curvature
    }

    /// Adds `nu . b` of the endpoint constraints; without multipliers, what they touch becomes unknown.
    pub(crate) fn add_constraints(&mut self, ocp: &Ocp, ends: &Ends, multipliers: Option<&Vec<Vec<f64>>>) {
        for (k, c) in ocp.constraints.iter().enumerate() {
            match multipliers {
                Some(nu) => {
                    for (row, input, v) in ends.jacobian(c.function.as_ref(), &c.inputs) {
                        self.add(input, nu[k][row] * v);
                    }
                }
                None => {
                    for (_, column) in c.function.pattern().jacobian_entries() {
                        let position = self.position(c.inputs[column]);
                        self.unknown[position] = true;
                    }
                }
            }
        }
    }

    fn add(&mut self, input: EndpointInput, v: f64) {
        let position = self.position(input);
        self.values[position] += v;
    }

    /// The entry of a quantity, if known.
    pub(crate) fn value(&self, input: EndpointInput) -> Option<f64> {
        let position = self.position(input);
        (!self.unknown[position]).then_some(self.values[position])
    }
}

/// The values that an end quantity may have: the bounds of the end, and of the state along the phase.
pub(crate) fn allowed(ocp: &Ocp, input: EndpointInput) -> Bounds {
    let state = |phase: usize, state: usize| &ocp.phases[phase].states[state];
    match input {
        EndpointInput::InitialTime { phase } => ocp.phases[phase].initial_time,
        EndpointInput::FinalTime { phase } => ocp.phases[phase].final_time,
        EndpointInput::InitialState { phase, state: s } => {
            state(phase, s).initial.intersect(&state(phase, s).variable.bounds)
        }
        EndpointInput::FinalState { phase, state: s } => {
            state(phase, s).terminal.intersect(&state(phase, s).variable.bounds)
        }
        EndpointInput::Parameter { index } => ocp.parameters[index].bounds,
    }
}

/// Typical sizes of end quantities and how far each may miss.
pub(crate) struct EndScales<'a> {
    ocp: &'a Ocp,
    scaling: &'a Scaling,
    end_tolerance: f64,
}

impl<'a> EndScales<'a> {
    pub(crate) fn new(ocp: &'a Ocp, scaling: &'a Scaling, settings: &VerifySettings) -> Self {
        Self { ocp, scaling, end_tolerance: settings.end_tolerance }
    }

    pub(crate) fn scale(&self, input: EndpointInput) -> f64 {
        self.scaling.of_end(input)
    }

    /// Allowed miss: the one stated with the state, else the end tolerance times the scale.
    pub(crate) fn tolerance(&self, input: EndpointInput) -> f64 {
        let stated = match input {
            EndpointInput::InitialState { phase, state } | EndpointInput::FinalState { phase, state } => {
                self.ocp.phases[phase].states[state].tolerance
            }
            _ => None,
        };
        stated.unwrap_or(self.end_tolerance * self.scale(input))
    }

    /// Typical size of each row of an endpoint constraint: as stated, else the change that changes of every input by
    /// its own size make, else the larger finite bound, else one.
    pub(crate) fn row_scales(&self, constraint: usize, ends: &Ends) -> Vec<f64> {
        self.rows(constraint, ends, 1.0, |input| self.scale(input))
    }

    /// Allowed miss of each row: the end tolerance times the stated scale, else the change that the allowed misses of
    /// every input make, else the end tolerance times the larger finite bound or one.
    pub(crate) fn row_tolerances(&self, constraint: usize, ends: &Ends) -> Vec<f64> {
        self.rows(constraint, ends, self.end_tolerance, |input| self.tolerance(input))
    }

    fn rows(
        &self,
        constraint: usize,
        ends: &Ends,
        factor: f64,
        size: impl Fn(EndpointInput) -> f64,
    ) -> Vec<f64> {
        let c = &self.ocp.constraints[constraint];
        let mut sizes = vec![0.0; c.rows.len()];
        for (row, input, v) in ends.jacobian(c.function.as_ref(), &c.inputs) {
            sizes[row] += v.abs() * size(input);
        }
        let usable = |s: &f64| *s > 0.0 && s.is_finite();
        let pick = |(row, propagated): (&apsides_ocp::Variable, f64)| {
            let bound = factor * largest_bound(row);
            row.scale
                .map(|s| factor * s)
                .or(Some(propagated).filter(usable))
                .or(Some(bound).filter(usable))
                .unwrap_or(factor)
        };
        c.rows.iter().zip(sizes).map(pick).collect()
    }
}

/// Larger magnitude among the finite bounds; zero without.
pub(crate) fn largest_bound(variable: &apsides_ocp::Variable) -> f64 {
    let finite = |b: f64| if b.is_finite() { b.abs() } else { 0.0 };
    finite(variable.bounds.lower).max(finite(variable.bounds.upper))
}

/// Says whether a duration is at one of its bounds: one that is almost nothing beside the longest that is allowed has no size of its own.
pub(crate) fn is_duration_at_bound(
    phase: &Phase,
    duration: f64,
    own: f64,
    settings: &VerifySettings,
) -> bool {
    let longest = phase.longest();
    let size = if longest.is_finite() { longest } else { own };
    phase.duration.excess(duration) >= -settings.activity_tolerance * size
}
