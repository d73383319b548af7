//! Constant controls, and a duration, that follow given straight lines of the states best.
//!
//! The middle of the bounds, or zero, is often a point where nothing depends on a control to first order: a direction of length zero,
//! an angle along an axis. Of a few values per control, tried one control after the other, those are taken whose rates differ least from
//! the slopes of the lines, of states that have something stated at both ends, and that miss path constraints least; but only where they
//! do so by far.

use crate::{Bounds, Phase, Variable};

/// Fractions of the phase at which rates and slopes are compared.
const FRACTIONS: [f64; 3] = [0.25, 0.5, 0.75];
/// Passes through all controls.
const SWEEPS: usize = 3;
/// Values tried between two bounds, as parts of the way.
const BETWEEN: [f64; 8] = [0.02, 0.15, 0.3, 0.4, 0.6, 0.7, 0.85, 0.98];
/// Values tried of a control without bounds, or beyond its only one, relative to its scale.
const BEYOND: [f64; 7] = [0.1, 0.3, 0.7, 1.0, 1.5, 2.0, 2.8];
/// Durations tried where nothing bounds them.
const DURATIONS: [f64; 7] = [3.0, 10.0, 30.0, 1e2, 3e2, 1e3, 1e4];
/// Part of the misfit that another value must leave at most.
const GAIN: f64 = 0.9;
/// Part of the misfit that all of them together must leave at most.
const TOTAL_GAIN: f64 = 0.5;

/// Controls, and the final time.
pub(super) fn fitted(
    phase: &Phase,
    parameters: &[f64],
    times: (f64, f64),
    ends: &[Vec<f64>; 2],
) -> (Vec<f64>, f64) {
    let mut controls: Vec<f64> = phase.controls.iter().map(|c| c.bounds.representative()).collect();
    let mut fit = Fit::new(phase, parameters, times.0, ends);
    let mut duration = times.1 - times.0;
    let unbounded = phase.final_time.upper.is_infinite() && phase.duration.upper.is_infinite();
    let own = (controls.clone(), times.1);
    let first = fit.misfit(&controls, duration);
    let mut best = first;
    for _ in 0..SWEEPS {
        for (c, variable) in phase.controls.iter().enumerate() {
            let own = controls[c];
            let mut value = own;
            for candidate in candidates(variable) {
                controls[c] = candidate;
                let misfit = fit.misfit(&controls, duration);
                if misfit < GAIN * best {
                    (best, value) = (misfit, candidate);
                }
            }
            controls[c] = value;
        }
        for candidate in DURATIONS.iter().filter(|_| unbounded) {
            let candidate = candidate * (times.1 - times.0);
            let misfit = fit.misfit(&controls, candidate);
            if misfit < GAIN * best {
                (best, duration) = (misfit, candidate);
            }
        }
    }
    if best <= TOTAL_GAIN * first { (controls, times.0 + duration) } else { own }
}

fn candidates(variable: &Variable) -> Vec<f64> {
    let (lower, upper) = (variable.bounds.lower, variable.bounds.upper);
    let scale = variable.size().unwrap_or(1.0);
    match (lower.is_finite(), upper.is_finite()) {
        (true, true) => BETWEEN.iter().map(|f| lower + f * (upper - lower)).collect(),
        (true, false) => BEYOND.iter().map(|f| lower + f * scale).collect(),
        (false, true) => BEYOND.iter().map(|f| upper - f * scale).collect(),
        (false, false) => BEYOND.iter().flat_map(|f| [f * scale, -f * scale]).collect(),
    }
}

/// The misfit of controls.
struct Fit<'a> {
    phase: &'a Phase,
    parameters: &'a [f64],
    initial_time: f64,
    ends: &'a [Vec<f64>; 2],
    /// Sizes of the states.
    sizes: Vec<f64>,
    inputs: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl<'a> Fit<'a> {
    fn new(phase: &'a Phase, parameters: &'a [f64], initial_time: f64, ends: &'a [Vec<f64>; 2]) -> Self {
        let functions = std::iter::once(&phase.dynamics).chain(phase.path.iter().map(|c| &c.function));
        let outputs = functions.map(|f| f.outputs()).max().unwrap_or(0);
        let sizes = phase.states.iter().zip(ends[0].iter().zip(&ends[1]));
        let size = |(state, (a, b)): (&crate::State, (&f64, &f64))| {
            let met = a.abs().max(b.abs());
            let width = state.variable.bounds.upper - state.variable.bounds.lower;
            let usable = |s: &f64| *s > 0.0 && s.is_finite();
            state.variable.scale.or(Some(met).filter(usable)).or(Some(width).filter(usable)).unwrap_or(1.0)
        };
        Self {
            phase,
            parameters,
            initial_time,
            ends,
            sizes: sizes.map(size).collect(),
            inputs: vec![0.0; phase.states.len() + phase.controls.len() + parameters.len() + 1],
            values: vec![0.0; outputs],
            slopes: Vec::new(),
        }
    }

    /// The sum of the squares; infinite where a function or its slopes are not finite, as those of a root are at zero.
    fn misfit(&mut self, controls: &[f64], duration: f64) -> f64 {
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        let mut sum = 0.0;
        for fraction in FRACTIONS {
            for ((z, a), b) in self.inputs.iter_mut().zip(&self.ends[0]).zip(&self.ends[1]) {
                *z = a + fraction * (b - a);
            }
            self.inputs[nx..nx + nu].copy_from_slice(controls);
            let time = self.initial_time + fraction * duration;
            if !self.evaluate(&*self.phase.dynamics, time) {
                return f64::INFINITY;
            }
            for (s, rate) in self.values[..nx].iter().enumerate() {
                let state = &self.phase.states[s];
                if state.initial == Bounds::FREE || state.terminal == Bounds::FREE {
                    continue;
                }
                let change = self.ends[1][s] - self.ends[0][s];
                sum += ((duration * rate - change) / self.sizes[s]).powi(2);
            }
            for c in &self.phase.path {
                if !self.evaluate(&*c.function, time) {
                    return f64::INFINITY;
                }
                for (row, value) in c.rows.iter().zip(&self.values) {
                    sum += (row.bounds.excess(*value).max(0.0) / row.size().unwrap_or(1.0)).powi(2);
                }
            }
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// The outputs of a function; true if its slopes are finite.
    fn evaluate(&mut self, function: &dyn apsides_ad::NodeFunction, time: f64) -> bool {
        let width = self.phase.states.len() + self.phase.controls.len();
        let last = function.inputs() - 1;
        if last > width {
            self.inputs[width..last].copy_from_slice(self.parameters);
        }
        self.inputs[last] = time;
        self.slopes.resize(function.pattern().jacobian_len(), 0.0);
        let values = &mut self.values[..function.outputs()];
        function.jacobian(&self.inputs[..=last], values, &mut self.slopes);
        self.slopes.iter().all(|slope| slope.is_finite())
    }
}
