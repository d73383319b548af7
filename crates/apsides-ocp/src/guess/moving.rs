//! Free states that move the others as a guess has them.
//!
//! Who states where a spacecraft is along the way has said how fast it is. Velocities that nobody states, and that are free at both ends,
//! are zero or in the middle of their bounds otherwise: a guess that jumps from place to place at rest, from which coasts under gravity lead nowhere.

use crate::{Guess, Ocp, Phase, PhaseGuess, State};

/// Passes over all rates; rates of one free state each take one.
const SWEEPS: usize = 30;
/// Part of the misfit of the rates that must be left at most.
const GAIN: f64 = 0.5;

impl Guess {
    /// The guess with states that are free at both ends, and not `stated` by phase and state, such that, within their bounds, the rates of the
    /// others are the slopes that the guess has; the guess as it is in phases where that leads nowhere, or that stand on an earlier trajectory.
    #[must_use]
    pub fn with_free_states_moving(mut self, ocp: &Ocp, stated: impl Fn(usize, usize) -> bool) -> Self {
        for (k, (phase, guess)) in ocp.phases.iter().zip(&mut self.phases).enumerate() {
            let open = open_states(phase, |state| stated(k, state));
            if open.contains(&true) && guess.as_trajectory().is_none() {
                guess.move_free_states(phase, &self.parameters, &open);
            }
        }
        self
    }
}

/// True for each state that is free at both ends, and not stated.
fn open_states(phase: &Phase, stated: impl Fn(usize) -> bool) -> Vec<bool> {
    let is_open = |(k, state): (usize, &State)| state.has_free_ends() && !stated(k);
    phase.states.iter().enumerate().map(is_open).collect()
}

impl PhaseGuess {
    fn move_free_states(&mut self, phase: &Phase, parameters: &[f64], open: &[bool]) {
        let duration = self.final_time - self.initial_time;
        let initial_time = self.initial_time;
        let slopes = self.slopes();
        let moves: Vec<bool> = (0..open.len()).map(|s| slopes.iter().any(|of| of[s] != 0.0)).collect();
        let mut rates = Rates::new(phase, parameters, open, &moves);
        if rates.rows.is_empty() {
            return;
        }
        let (mut before, mut after) = (0.0, 0.0);
        let mut changed = self.clone();
        changed.change_samples(|k, fraction, x, u| {
            let wanted: Vec<f64> = slopes[k].iter().map(|slope| slope / duration).collect();
            let time = initial_time + fraction * duration;
            before += rates.misfit(x, u, time, &wanted);
            for _ in 0..SWEEPS {
                rates.sweep(x, u, time, &wanted);
            }
            after += rates.misfit(x, u, time, &wanted);
        });
        if after <= GAIN * before && before > 0.0 {
            *self = changed;
        }
    }
}

/// The rates of the states that are no free ones, and that the guess has moving: one that stays says nothing.
struct Rates<'a> {
    phase: &'a Phase,
    parameters: &'a [f64],
    inputs: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
    /// Row, free state and place in the entries of each slope of a rate by a free state.
    slopes: Vec<(usize, usize, usize)>,
    /// The rows among them.
    rows: Vec<usize>,
}

impl<'a> Rates<'a> {
    fn new(phase: &'a Phase, parameters: &'a [f64], open: &[bool], moves: &[bool]) -> Self {
        let pattern = phase.dynamics.pattern();
        let slopes = pattern.jacobian_entries().enumerate().filter_map(|(place, (row, input))| {
            let is_one = moves[row] && !open[row] && open.get(input).copied().unwrap_or(false);
            is_one.then_some((row, input, place))
        });
        let slopes: Vec<_> = slopes.collect();
        let mut rows: Vec<usize> = slopes.iter().map(|(row, _, _)| *row).collect();
        rows.sort_unstable();
        rows.dedup();
        Self {
            phase,
            parameters,
            inputs: Vec::new(),
            values: vec![0.0; phase.states.len()],
            entries: vec![0.0; pattern.jacobian_len()],
            slopes,
            rows,
        }
    }

    fn evaluate(&mut self, x: &[f64], u: &[f64], time: f64) {
        self.inputs.clear();
        self.inputs.extend(x.iter().chain(u));
        if self.phase.takes_parameters(self.phase.dynamics.as_ref()) {
            self.inputs.extend_from_slice(self.parameters);
        }
        self.inputs.push(time);
        self.phase.dynamics.jacobian(&self.inputs, &mut self.values, &mut self.entries);
    }

    /// The sum of the squares of what rates that depend on free states miss, relative to what is wanted of them.
    fn misfit(&mut self, x: &[f64], u: &[f64], time: f64, wanted: &[f64]) -> f64 {
        self.evaluate(x, u, time);
        let miss = |row: &usize| {
            let row = *row;
            let size = self.values[row].abs().max(wanted[row].abs());
            if size > 0.0 { ((self.values[row] - wanted[row]) / size).powi(2) } else { 0.0 }
        };
        let sum: f64 = self.rows.iter().map(miss).sum();
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// Moves the free states to where one rate after the other is the one wanted, to first order (S. Kaczmarz, 1937).
    fn sweep(&mut self, x: &mut [f64], u: &[f64], time: f64, wanted: &[f64]) {
        for k in 0..self.rows.len() {
            let row = self.rows[k];
            self.evaluate(x, u, time);
            let own = self.slopes.iter().filter(|(r, _, _)| *r == row);
            let square: f64 = own.clone().map(|(_, _, place)| self.entries[*place].powi(2)).sum();
            let step = (wanted[row] - self.values[row]) / square;
            if step.is_finite() {
                own.for_each(|(_, state, place)| {
                    let bounds = self.phase.states[*state].variable.bounds;
                    x[*state] = bounds.clamp(x[*state] + step * self.entries[*place]);
                });
            }
        }
    }
}
