//! Starts that are left because a condition on an integral, or on a state at both ends, has no gradient there.
//!
//! The length of a curve that begins as a straight line changes by nothing to first order: a method of Newton's kind that must make
//! it longer has no direction to go. The controls that the integrand, or the rate of the state, depends on get a swing then.

use std::f64::consts::PI;

use super::{Guess, PhaseGuess};
use apsides_ad::NodeFunction;

use crate::{Bounds, Integral, Ocp, Phase};

/// Points of the quadrature and of the new samples.
const POINTS: usize = 33;
/// Size of the swing, relative to that of the control.
const SWING: f64 = 0.3;
/// Derivatives, times the size of what they are by and relative to the violation, up to which there is no gradient.
const NO_GRADIENT: f64 = 1e-8;
/// Violation relative to the scale of the integral from which on it is one.
const VIOLATION: f64 = 1e-6;

impl Guess {
    /// The guess with other controls where it violates the bounds of an integral whose integrand has no gradient anywhere along it.
    /// A guess that stands on an earlier trajectory stays.
    #[must_use]
    pub fn off_stationary_integrals(mut self, ocp: &Ocp) -> Self {
        for (phase, guess) in ocp.phases.iter().zip(&mut self.phases) {
            if guess.as_trajectory().is_some() {
                continue;
            }
            let mut swings = vec![false; phase.controls.len()];
            for integral in &phase.integrals {
                if is_stationary(integral, phase, guess, &self.parameters) {
                    let first = phase.states.len();
                    let columns = integral.function.pattern().columns.iter();
                    columns.for_each(|c| {
                        if let Some(swing) = c.checked_sub(first).and_then(|c| swings.get_mut(c)) {
                            *swing = true;
                        }
                    });
                }
            }
            if swings.contains(&true) {
                swing(phase, guess, &swings);
            }
        }
        self
    }

    /// The guess with a swing of the controls of phases in which a state with conditions at both ends does not get from one to the other
    /// along the guess, and its rate changes by controls to second order alone, towards what is missing; none where there are no such
    /// phases, or the guess stands on an earlier trajectory.
    #[must_use]
    pub fn swung(&self, ocp: &Ocp) -> Option<Self> {
        let mut swung = self.clone();
        let mut any = false;
        for (phase, guess) in ocp.phases.iter().zip(&mut swung.phases) {
            if guess.as_trajectory().is_some() {
                return None;
            }
            if has_stationary_rate(phase, guess, &self.parameters) {
                any = true;
                swing(phase, guess, &vec![true; phase.controls.len()]);
            }
        }
        any.then_some(swung)
    }
}

fn fractions() -> impl Iterator<Item = f64> {
    (0..POINTS).map(|k| k as f64 / (POINTS - 1) as f64)
}

/// The inputs of a function along a guess.
pub(crate) struct Along<'a> {
    guess: &'a PhaseGuess,
    states: usize,
    controls: usize,
    /// The parameters that the function takes: all or none.
    parameters: &'a [f64],
}

impl<'a> Along<'a> {
    pub(crate) fn new(
        phase: &Phase,
        guess: &'a PhaseGuess,
        parameters: &'a [f64],
        function: &dyn NodeFunction,
    ) -> Self {
        let taken = if phase.takes_parameters(function) { parameters } else { &[] };
        Self { guess, states: phase.states.len(), controls: phase.controls.len(), parameters: taken }
    }

    fn duration(&self) -> f64 {
        self.guess.final_time - self.guess.initial_time
    }

    /// The inputs `[x, u, p, t]` at a part of the duration.
    pub(crate) fn point(&self, fraction: f64, z: &mut [f64]) {
        let (x, rest) = z.split_at_mut(self.states);
        let (u, rest) = rest.split_at_mut(self.controls);
        let (p, t) = rest.split_at_mut(self.parameters.len());
        self.guess.state(fraction, x);
        self.guess.control(fraction, u);
        p.copy_from_slice(self.parameters);
        t.fill(self.guess.initial_time + fraction * self.duration());
    }
}

/// True if the integral is outside its bounds and no state and no control changes it to first order.
fn is_stationary(integral: &Integral, phase: &Phase, guess: &PhaseGuess, parameters: &[f64]) -> bool {
    let f = &integral.function;
    let sizes: Vec<f64> = phase.states.iter().map(|s| &s.variable).chain(&phase.controls).map(size).collect();
    let along = Along::new(phase, guess, parameters, f.as_ref());
    let mut z = vec![0.0; f.inputs()];
    let (mut value, mut entries) = ([0.0], vec![0.0; f.pattern().jacobian_len()]);
    let (mut sum, mut steepest) = (0.0, 0.0_f64);
    let duration = along.duration();
    for (k, fraction) in fractions().enumerate() {
        along.point(fraction, &mut z);
        f.jacobian(&z, &mut value, &mut entries);
        let weight = if k == 0 || k + 1 == POINTS { 0.5 } else { 1.0 };
        sum += weight * value[0] * duration / (POINTS - 1) as f64;
        for ((_, column), entry) in f.pattern().jacobian_entries().zip(&entries) {
            steepest = sizes.get(column).map_or(steepest, |s| steepest.max((entry * s * duration).abs()));
        }
    }
    let violation = integral.variable.bounds.excess(sum);
    violation > VIOLATION * size(&integral.variable) && steepest <= NO_GRADIENT * violation
}

/// True if there is a state with conditions at both ends whose rate does not take it from one to the other, and changes by controls to
/// second order alone, towards what is missing.
fn has_stationary_rate(phase: &Phase, guess: &PhaseGuess, parameters: &[f64]) -> bool {
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let f = &phase.dynamics;
    let along = Along::new(phase, guess, parameters, f.as_ref());
    let mut z = vec![0.0; f.inputs()];
    let duration = along.duration();
    let (mut value, mut entries) = (vec![0.0; nx], vec![0.0; f.pattern().jacobian_len()]);
    let (mut steepest, mut change) = (vec![0.0_f64; nx], vec![0.0_f64; nx]);
    for fraction in fractions() {
        along.point(fraction, &mut z);
        f.jacobian(&z, &mut value, &mut entries);
        for ((row, column), entry) in f.pattern().jacobian_entries().zip(&entries) {
            if let Some(control) = column.checked_sub(nx).and_then(|c| phase.controls.get(c)) {
                steepest[row] = steepest[row].max((entry * size(control) * duration).abs());
            }
        }
        change.iter_mut().zip(&value).for_each(|(c, v)| *c += v * duration / POINTS as f64);
    }
    let mut curvatures = vec![0.0; f.pattern().hessian_len()];
    phase.states.iter().enumerate().any(|(row, state)| {
        let wanted = state.terminal.representative() - state.initial.representative();
        let missing = wanted - change[row];
        let is_asked = state.initial != Bounds::FREE && state.terminal != Bounds::FREE;
        if !is_asked || steepest[row] > NO_GRADIENT * missing.abs() {
            return false;
        }
        let mut weights = vec![0.0; nx];
        weights[row] = missing;
        fractions().any(|fraction| {
            along.point(fraction, &mut z);
            f.hessian(&z, &weights, &mut curvatures);
            let mut terms = f.pattern().hessian.iter().zip(&curvatures);
            terms.any(|((i, j), h)| i == j && (nx..nx + nu).contains(i) && *h > 0.0)
        })
    })
}

fn size(variable: &crate::Variable) -> f64 {
    variable.size().unwrap_or(1.0)
}

/// Adds half a wave, which leaves the mean as it is.
fn swing(phase: &Phase, guess: &mut PhaseGuess, swings: &[bool]) {
    *guess = guess.with_samples(POINTS, |fraction, _, u| {
        for ((u, control), _) in u.iter_mut().zip(&phase.controls).zip(swings).filter(|(_, s)| **s) {
            *u = control.bounds.clamp(*u + SWING * size(control) * (PI * fraction).cos());
        }
    });
}
