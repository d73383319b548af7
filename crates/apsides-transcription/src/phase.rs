//! The placement of one phase by a method.

use apsides_nlp::{Scaling as NlpScaling, Stages};
use apsides_ocp::{Phase, PhaseGuess, PhaseScaling, PhaseTrajectory, RowOrigin};

use crate::limits::Limits;
use crate::places::PhaseEnds;

/// A constant entry of the Jacobian: row, column, value.
pub type ConstantEntry = (usize, usize, f64);

/// A phase whose bounds are to be set, and the start of the solve.
#[derive(Clone, Copy)]
pub struct PhaseStart<'a> {
    /// The phase.
    pub phase: &'a Phase,
    /// Its guess.
    pub guess: &'a PhaseGuess,
    /// All variables, not yet moved between their bounds.
    pub point: &'a [f64],
    /// The static parameters among them.
    pub parameters: &'a [f64],
}

/// The placement of one phase by a method.
///
/// [`Transcription`](crate::Transcription) sets what belongs to the ends of a phase (times, integrals, duration, endpoint constraints, parameters); a
/// method sets what stands at its nodes.
pub trait PhaseLayout {
    /// The columns and rows that every method has.
    fn ends(&self) -> &PhaseEnds;

    /// The columns of each quantity along the phase: of a state or a control at all nodes, of times between the ends.
    fn quantities(&self) -> Vec<Vec<usize>>;

    /// Says whether time increases along the phase at the point `x`.
    fn lasts(&self, x: &[f64]) -> bool;

    /// Sets the columns of the nodes to the guess.
    fn set_start(&self, guess: &PhaseGuess, x: &mut [f64]);

    /// Sets the bounds of the columns and rows of the nodes; unset variables are free, unset rows are equal to zero.
    fn set_bounds(&self, start: &PhaseStart<'_>, variables: &mut Limits, rows: &mut Limits);

    /// Sets the scales of the columns and rows of the nodes: NaN for a row that is to be scaled by its changes at the start
    /// ([`Transcription::changes`](crate::Transcription::changes)). Unset scales are 1.
    fn set_scales(&self, phase: &Phase, scaling: &PhaseScaling, scales: &mut NlpScaling);

    /// The constant entries of the Jacobian in the rows of the nodes.
    fn constant_entries(&self) -> Vec<ConstantEntry>;

    /// The origin of a row of the nodes in the words of the problem; the point `x` gives the times.
    fn row_origin(&self, phase: &Phase, row: usize, x: &[f64]) -> Option<RowOrigin>;

    /// Sets the multipliers of the rows of the nodes from the costates and the path multipliers of an earlier trajectory; the
    /// point `x` gives the times.
    fn set_multipliers(&self, phase: &Phase, earlier: &PhaseTrajectory, x: &[f64], y: &mut [f64]);

    /// Sets the stages of the columns and rows of the nodes; unset ones are eliminated last.
    fn set_stages(&self, stages: &mut Stages);
}
