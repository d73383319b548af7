//! Quantities at the ends of phases, and constraints between them: boundary conditions and linkages.

use std::sync::{Arc, LazyLock};

use apsides_ad::{NodeFunction, Scalar, VectorFunction, vector_node};

use crate::{OcpError, Phase, Variable};

/// A quantity at an end of a phase, an integral over it, or a static parameter, by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum At<'a> {
    /// Start time of a phase.
    InitialTime(&'a str),
    /// End time of a phase.
    FinalTime(&'a str),
    /// Phase and state, at the start.
    InitialState(&'a str, &'a str),
    /// Phase and state, at the end.
    FinalState(&'a str, &'a str),
    /// Phase and integral: its value over the whole phase.
    Integral(&'a str, &'a str),
    /// A static parameter.
    Parameter(&'a str),
}

/// A quantity at an end of a phase, or a static parameter, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EndpointInput {
    /// Start time of a phase.
    InitialTime {
        /// Index of the phase.
        phase: usize,
    },
    /// End time of a phase.
    FinalTime {
        /// Index of the phase.
        phase: usize,
    },
    /// A state at the start of a phase.
    InitialState {
        /// Index of the phase.
        phase: usize,
        /// Index of the state.
        state: usize,
    },
    /// A state at the end of a phase.
    FinalState {
        /// Index of the phase.
        phase: usize,
        /// Index of the state.
        state: usize,
    },
    /// A static parameter.
    Parameter {
        /// Index of the parameter.
        index: usize,
    },
}

/// `lower <= g(z) <= upper` for quantities `z` at the ends of any phases.
#[derive(Clone)]
pub struct EndpointConstraint {
    /// Name of the whole: `link braking-descent`, `circular orbit`.
    pub name: String,
    /// Name, unit, bounds and scale of each output of the function.
    pub rows: Vec<Variable>,
    /// The inputs of the function, in order.
    pub inputs: Vec<EndpointInput>,
    /// `g`.
    pub function: Arc<dyn NodeFunction>,
}

/// `end of the first - start of the second`: the linkage of one quantity.
pub(crate) struct Difference;

impl VectorFunction<2, 1> for Difference {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] - z[1]]
    }
}

/// One function for all linkages: a flight has dozens.
static DIFFERENCE: LazyLock<Arc<dyn NodeFunction>> = LazyLock::new(|| vector_node(Difference));

impl EndpointConstraint {
    /// The quantity `to` exceeds `from` by a value in the bounds of `row`, negated: `from - to` is bounded.
    pub(crate) fn difference(name: String, row: Variable, from: EndpointInput, to: EndpointInput) -> Self {
        Self { name, rows: vec![row], inputs: vec![from, to], function: Arc::clone(&DIFFERENCE) }
    }

    /// Returns true if it joins phases to one flight: equalities between quantities of different phases.
    #[must_use]
    pub fn joins_phases(&self) -> bool {
        let phase = |i: &EndpointInput| match *i {
            EndpointInput::InitialTime { phase }
            | EndpointInput::FinalTime { phase }
            | EndpointInput::InitialState { phase, .. }
            | EndpointInput::FinalState { phase, .. } => Some(phase),
            EndpointInput::Parameter { .. } => None,
        };
        let mut phases = self.inputs.iter().filter_map(phase);
        let first = phases.next();
        phases.any(|p| Some(p) != first) && self.rows.iter().all(|r| r.bounds.is_fixed())
    }

    pub(crate) fn check(&self) -> Result<(), OcpError> {
        let place = format!("constraint `{}`", self.name);
        for (what, expected, found) in [
            ("inputs", self.function.inputs(), self.inputs.len()),
            ("rows", self.function.outputs(), self.rows.len()),
        ] {
            if expected != found {
                return Err(OcpError::Dimension { place, what, expected, found });
            }
        }
        self.rows.iter().try_for_each(|r| r.check(&place, "row"))
    }
}

/// Names turned into indices.
pub(crate) struct Names<'a> {
    pub(crate) phases: &'a [Phase],
    pub(crate) parameters: &'a [Variable],
}

impl Names<'_> {
    pub(crate) fn phase(&self, place: &str, name: &str) -> Result<usize, OcpError> {
        self.phases
            .iter()
            .position(|p| p.name == name)
            .ok_or_else(|| unknown(place, "phase", name, self.phases.iter().map(|p| &p.name)))
    }

    pub(crate) fn state(&self, place: &str, phase: usize, name: &str) -> Result<usize, OcpError> {
        let p = &self.phases[phase];
        p.state_index(name).ok_or_else(|| {
            let place = format!("{place}, phase `{}`", p.name);
            unknown(&place, "state", name, p.states.iter().map(|s| &s.variable.name))
        })
    }

    pub(crate) fn integral(&self, place: &str, phase: usize, name: &str) -> Result<usize, OcpError> {
        let p = &self.phases[phase];
        p.integral_index(name).ok_or_else(|| {
            let place = format!("{place}, phase `{}`", p.name);
            unknown(&place, "integral", name, p.integrals.iter().map(|s| &s.variable.name))
        })
    }

    pub(crate) fn input(&self, place: &str, at: &At<'_>) -> Result<EndpointInput, OcpError> {
        Ok(match *at {
            At::InitialTime(p) => EndpointInput::InitialTime { phase: self.phase(place, p)? },
            At::FinalTime(p) => EndpointInput::FinalTime { phase: self.phase(place, p)? },
            At::InitialState(p, s) => {
                let phase = self.phase(place, p)?;
                EndpointInput::InitialState { phase, state: self.state(place, phase, s)? }
            }
            At::FinalState(p, s) => {
                let phase = self.phase(place, p)?;
                EndpointInput::FinalState { phase, state: self.state(place, phase, s)? }
            }
            At::Integral(p, q) => {
                let phase = self.phase(place, p)?;
                let integral = self.integral(place, phase, q)?;
                EndpointInput::FinalState { phase, state: self.phases[phase].state_to_be(integral) }
            }
            At::Parameter(name) => EndpointInput::Parameter {
                index: self.parameters.iter().position(|v| v.name == name).ok_or_else(|| {
                    unknown(place, "parameter", name, self.parameters.iter().map(|v| &v.name))
                })?,
            },
        })
    }
}

fn unknown<'a>(
    place: &str,
    kind: &'static str,
    name: &str,
    known: impl Iterator<Item = &'a String>,
) -> OcpError {
    let known: Vec<_> = known.map(|k| format!("`{k}`")).collect();
    let known = if known.is_empty() { "none".into() } else { known.join(", ") };
    OcpError::UnknownName { place: place.into(), kind, name: name.into(), known }
}
