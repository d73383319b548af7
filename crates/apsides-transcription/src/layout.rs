//! The placement of a whole problem: where everything stands in the decision vector and in the constraint vector.
//!
//! A method lays out the phases one after the other, each with the columns of its states, controls and times; the static
//! parameters come last. Its rows come first in each phase, then those of the integrals and of the duration; the endpoint
//! constraints come last.

use apsides_ocp::{EndpointInput, Ocp};

use crate::phase::PhaseLayout;
use crate::places::Places;

/// The placement of a whole problem.
#[derive(Clone, Debug)]
pub struct Layout<P> {
    /// The phases, in the order of the problem.
    pub phases: Vec<P>,
    /// The column of the first static parameter; those of the others follow, up to the last column.
    pub first_parameter: usize,
    /// The number of columns.
    pub variables: usize,
    /// The first row of each endpoint constraint.
    pub endpoint_rows: Vec<usize>,
    /// The number of rows.
    pub constraints: usize,
    /// The stage after all phases: times, parameters and everything that joins distant nodes.
    pub last_stage: u32,
}

impl<P: PhaseLayout> Layout<P> {
    /// The layout of the phases that have taken `places`, with parameters and endpoint constraints after them.
    #[must_use]
    pub fn new(ocp: &Ocp, phases: Vec<P>, mut places: Places) -> Self {
        let first_parameter = places.take_columns(ocp.parameters.len());
        let endpoint_rows = ocp.constraints.iter().map(|c| places.take_rows(c.rows.len())).collect();
        Self {
            phases,
            first_parameter,
            variables: places.column,
            endpoint_rows,
            constraints: places.row,
            last_stage: places.stage,
        }
    }

    /// The column of an end quantity.
    #[must_use]
    pub fn endpoint_column(&self, input: EndpointInput) -> usize {
        let ends = |phase: usize| self.phases[phase].ends();
        match input {
            EndpointInput::InitialTime { phase } => ends(phase).initial_time,
            EndpointInput::FinalTime { phase } => ends(phase).final_time,
            EndpointInput::InitialState { phase, state } => ends(phase).initial_state + state,
            EndpointInput::FinalState { phase, state } => ends(phase).final_state + state,
            EndpointInput::Parameter { index } => self.first_parameter + index,
        }
    }

    /// The columns of the static parameters.
    #[must_use]
    pub fn parameter_columns(&self) -> std::ops::Range<usize> {
        self.first_parameter..self.variables
    }
}
