//! Starts of a guess that meet what is asked of them alone.
//!
//! A velocity after an impulse is a free state that an equation ties to parameters. Left at zero it starts a flight that falls, and what
//! asks for the arrival has no way out from there.

use crate::{Bounds, EndpointConstraint, EndpointInput, Guess, Ocp};

/// Passes over all rows; linear rows that share no states take one.
const SWEEPS: usize = 20;

/// One constraint of starts, its inputs as values and the phase and state of those that may move.
struct Tie<'a> {
    constraint: &'a EndpointConstraint,
    movable: Vec<Option<(usize, usize)>>,
}

impl Guess {
    /// The guess with free states at starts of phases moved, as little as their sizes allow, to where the constraints of starts, times and
    /// parameters alone are met; a state without conditions at its end moves along the whole phase. The guess itself where that leads
    /// nowhere. Phases that stand on an earlier trajectory stay.
    #[must_use]
    pub fn with_starts_that_meet(mut self, ocp: &Ocp) -> Self {
        let ties: Vec<Tie<'_>> = ocp.constraints.iter().filter_map(|c| self.tie(ocp, c)).collect();
        if ties.is_empty() {
            return self;
        }
        let before: Vec<Vec<f64>> = self.starts(ocp);
        let mut starts = before.clone();
        let misses = |starts: &[Vec<f64>]| -> Vec<f64> {
            ties.iter().flat_map(|tie| self.misses(tie, starts)).map(f64::abs).collect()
        };
        let first = misses(&starts);
        for _ in 0..SWEEPS {
            for tie in &ties {
                for row in 0..tie.constraint.rows.len() {
                    self.meet(ocp, tie, row, &mut starts);
                }
            }
        }
        let last = misses(&starts);
        if last.iter().zip(&first).all(|(last, first)| last <= first) && starts != before {
            for (k, phase) in ocp.phases.iter().enumerate() {
                self.phases[k].change_samples(|_, fraction, x, _| {
                    for ((x, state), (from, to)) in
                        x.iter_mut().zip(&phase.states).zip(before[k].iter().zip(&starts[k]))
                    {
                        let part = if state.terminal == Bounds::FREE { 1.0 } else { 1.0 - fraction };
                        *x = state.variable.bounds.clamp(*x + part * (to - from));
                    }
                });
            }
        }
        self
    }

    /// A constraint that starts alone can meet, if some of them may move.
    fn tie<'a>(&self, ocp: &Ocp, constraint: &'a EndpointConstraint) -> Option<Tie<'a>> {
        let movable = constraint.inputs.iter().map(|input| match *input {
            EndpointInput::FinalState { .. } | EndpointInput::FinalTime { .. } => None,
            EndpointInput::InitialState { phase, state } => {
                let is_own = self.phases[phase].as_trajectory().is_none();
                let may_move = is_own && !ocp.phases[phase].states[state].initial.is_fixed();
                Some(may_move.then_some((phase, state)))
            }
            EndpointInput::InitialTime { .. } | EndpointInput::Parameter { .. } => Some(None),
        });
        let movable: Vec<_> = movable.collect::<Option<_>>()?;
        movable.iter().any(Option::is_some).then_some(Tie { constraint, movable })
    }

    /// The states at the start of each phase.
    fn starts(&self, ocp: &Ocp) -> Vec<Vec<f64>> {
        let start = |(phase, guess): (&crate::Phase, &crate::PhaseGuess)| {
            let mut start = vec![0.0; phase.states.len()];
            guess.state(0.0, &mut start);
            start
        };
        ocp.phases.iter().zip(&self.phases).map(start).collect()
    }

    /// The inputs of a constraint of starts.
    fn inputs(&self, tie: &Tie<'_>, starts: &[Vec<f64>]) -> Vec<f64> {
        let value = |input: &EndpointInput| match *input {
            EndpointInput::InitialState { phase, state } => starts[phase][state],
            EndpointInput::InitialTime { phase } => self.phases[phase].initial_time,
            EndpointInput::FinalTime { phase } => self.phases[phase].final_time,
            EndpointInput::FinalState { .. } => f64::NAN,
            EndpointInput::Parameter { index } => self.parameters[index],
        };
        tie.constraint.inputs.iter().map(value).collect()
    }

    /// The amounts by which the rows of a constraint are above, or below, their bounds.
    fn misses(&self, tie: &Tie<'_>, starts: &[Vec<f64>]) -> Vec<f64> {
        let mut values = vec![0.0; tie.constraint.rows.len()];
        tie.constraint.function.value(&self.inputs(tie, starts), &mut values);
        let rows = tie.constraint.rows.iter().zip(&values);
        rows.map(|(row, value)| value - row.bounds.clamp(*value)).collect()
    }

    /// Moves the starts to where one row is met to first order, if it depends on them and the place is finite.
    fn meet(&self, ocp: &Ocp, tie: &Tie<'_>, row: usize, starts: &mut [Vec<f64>]) {
        let function = &tie.constraint.function;
        let miss = self.misses(tie, starts)[row];
        if miss == 0.0 {
            return;
        }
        let pattern = function.pattern();
        let mut values = vec![0.0; tie.constraint.rows.len()];
        let mut entries = vec![0.0; pattern.jacobian_len()];
        function.jacobian(&self.inputs(tie, starts), &mut values, &mut entries);
        let size =
            |phase: usize, state: usize| ocp.phases[phase].states[state].variable.size().unwrap_or(1.0);
        let slopes: Vec<((usize, usize), f64)> = pattern
            .jacobian_entries()
            .zip(&entries)
            .filter(|((k, _), _)| *k == row)
            .filter_map(|((_, input), slope)| Some((tie.movable[input]?, *slope)))
            .collect();
        let square: f64 = slopes.iter().map(|((p, s), slope)| (size(*p, *s) * slope).powi(2)).sum();
        let step = -miss / square;
        if !step.is_finite() {
            return;
        }
        for ((phase, state), slope) in slopes {
            let moved = starts[phase][state] + step * size(phase, state).powi(2) * slope;
            let of = &ocp.phases[phase].states[state];
            starts[phase][state] = of.initial.intersect(&of.variable.bounds).clamp(moved);
        }
    }
}
