//! Equations of motion and integrands of a phase under a profile.

use std::cell::RefCell;

use apsides_ad::NodeFunction;
use apsides_ocp::Phase;
use apsides_ode::OdeSystem;

use super::curve::Profile;
use super::rules::{FlightRules, Independent};

/// A phase under a profile.
#[derive(Clone, Copy)]
pub(crate) struct Motion<'a> {
    pub(crate) phase: &'a Phase,
    pub(crate) rules: &'a FlightRules,
    pub(crate) profile: &'a Profile,
    pub(crate) parameters: &'a [f64],
    /// Start, and end of the abscissa of a profile in time.
    pub(crate) times: [f64; 2],
    /// Energy at the start, of a profile in energy.
    pub(crate) energy: f64,
}

/// Components of a profile, and inputs `[x, u, p, t]` of node functions.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    components: Vec<f64>,
    inputs: Vec<f64>,
}

impl Scratch {
    pub(crate) fn new(phase: &Phase, rules: &FlightRules, parameters: usize) -> Self {
        Self {
            components: vec![0.0; rules.shape.components()],
            inputs: vec![0.0; phase.states.len() + phase.controls.len() + parameters + 1],
        }
    }

    pub(crate) fn controls<'s>(&'s self, phase: &Phase) -> &'s [f64] {
        &self.inputs[phase.states.len()..][..phase.controls.len()]
    }
}

impl Motion<'_> {
    /// The abscissa of a time and state, not cut off.
    #[inline]
    pub(crate) fn abscissa(&self, t: f64, x: &[f64]) -> f64 {
        match &self.rules.independent {
            Independent::Time => (t - self.times[0]) / (self.times[1] - self.times[0]),
            Independent::Energy { energy, end } => {
                (self.energy - energy(&x[..self.phase.states.len()])) / (self.energy - end)
            }
        }
    }

    /// Takes the state and the controls that a sub-interval of the profile gives it.
    #[inline]
    pub(crate) fn take(&self, interval: usize, t: f64, x: &[f64], scratch: &mut Scratch) {
        let n = self.phase.states.len();
        self.profile.at_in(interval, self.abscissa(t, x), &mut scratch.components);
        scratch.inputs[..n].copy_from_slice(&x[..n]);
        let controls = &mut scratch.inputs[n..n + self.phase.controls.len()];
        self.rules.steering.apply(&scratch.components, controls);
    }

    /// A function of what was taken.
    #[inline]
    pub(crate) fn value(&self, function: &dyn NodeFunction, t: f64, scratch: &mut Scratch, out: &mut [f64]) {
        let (size, base) = (function.inputs(), self.phase.states.len() + self.phase.controls.len());
        let z = &mut scratch.inputs[..size];
        if size > base + 1 {
            z[base..size - 1].copy_from_slice(self.parameters);
        }
        z[size - 1] = t;
        function.value(z, out);
    }
}

/// States, then integrals, along one sub-interval of the profile.
pub(crate) struct Piece<'a> {
    pub(crate) motion: Motion<'a>,
    pub(crate) interval: usize,
    pub(crate) scratch: &'a RefCell<Scratch>,
}

impl OdeSystem for Piece<'_> {
    fn dimension(&self) -> usize {
        self.motion.phase.states.len() + self.motion.phase.integrals.len()
    }

    #[inline]
    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        let scratch = &mut *self.scratch.borrow_mut();
        let phase = self.motion.phase;
        self.motion.take(self.interval, t, x, scratch);
        let (states, integrals) = dx.split_at_mut(phase.states.len());
        self.motion.value(phase.dynamics.as_ref(), t, scratch, states);
        for (q, out) in phase.integrals.iter().zip(integrals.chunks_mut(1)) {
            self.motion.value(q.function.as_ref(), t, scratch, out);
        }
    }
}
