//! Laws and actuators as the simulator sees them: they stand between the state of a vehicle and its controls.

use crate::actuator::{Actuator, RimPair};

/// A discrete law: what is seen of `NX` states at a sample time makes `NU` commands.
pub trait Controller<const NX: usize, const NU: usize> {
    /// Command at a time (s) from what is measured. Called once per control step, in order of time.
    fn command(&mut self, t: f64, measured: &[f64; NX]) -> [f64; NU];

    /// Takes the controls that the actuators made of the last command, for laws with integrals; called after each [`command`](Self::command).
    fn reached(&mut self, _control: &[f64; NU]) {}
}

/// A closure `(t, measured) -> command` is a law.
impl<F, const NX: usize, const NU: usize> Controller<NX, NU> for F
where
    F: FnMut(f64, &[f64; NX]) -> [f64; NU],
{
    fn command(&mut self, t: f64, measured: &[f64; NX]) -> [f64; NU] {
        self(t, measured)
    }
}

/// Actuators: they make controls of commands, once per control step.
pub trait Actuation<const NU: usize> {
    /// Controls of the plant over the control step that begins.
    fn advance(&mut self, command: &[f64; NU]) -> [f64; NU];

    /// Tells whether a control was at a limit of travel or rate in the last step.
    fn saturated(&self) -> bool {
        false
    }

    /// Tells whether moving masses touched in the last step.
    fn met(&self) -> bool {
        false
    }
}

/// Commands as controls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ideal;

impl<const NU: usize> Actuation<NU> for Ideal {
    fn advance(&mut self, command: &[f64; NU]) -> [f64; NU] {
        *command
    }
}

/// An actuator per control.
impl<const NU: usize> Actuation<NU> for [Actuator; NU] {
    fn advance(&mut self, command: &[f64; NU]) -> [f64; NU] {
        std::array::from_fn(|k| self[k].advance(command[k]))
    }

    fn saturated(&self) -> bool {
        self.iter().any(|a| a.saturation().travel || a.saturation().rate)
    }
}

impl Actuation<2> for RimPair {
    fn advance(&mut self, command: &[f64; 2]) -> [f64; 2] {
        RimPair::advance(self, command)
    }

    fn saturated(&self) -> bool {
        self.actuators().saturated()
    }

    fn met(&self) -> bool {
        RimPair::met(self)
    }
}
