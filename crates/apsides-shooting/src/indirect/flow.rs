//! The canonical system over one segment, with its sensitivities, across switches of the controls.

use std::cell::RefCell;

use apsides_ode::{Direction, Event, Integrator, Observer, OdeError, OdeSettings, Status, Tolerance};

use super::canonical::Canonical;
use super::hamiltonian::{ControlSwitch, Hamiltonian, Place};

/// Switches in one segment beyond which a control chatters.
const MAX_SWITCHES: usize = 200;

/// The reason that a segment has no end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlowFailure {
    /// The integration stopped: a singularity, or no minimising control.
    Stopped(Status),
    /// A control switches again and again: a singular arc.
    Chattering,
}

/// State, costate and rates at one time.
#[derive(Clone, Debug, Default)]
pub(super) struct EndPoint {
    /// Rates of `y`.
    pub(super) rates: Vec<f64>,
    /// Hamiltonian.
    pub(super) hamiltonian: f64,
    /// Its explicit derivative with respect to time.
    pub(super) time_slope: f64,
}

/// One segment, flown.
#[derive(Clone, Debug, Default)]
pub(super) struct SegmentFlight {
    /// `y` at the end.
    pub(super) end: Vec<f64>,
    /// `[dy/dy0, dy/dp]`, row-major `n x (n + np)`, of the last flight with sensitivities.
    pub(super) moved: Vec<f64>,
    pub(super) first: EndPoint,
    pub(super) last: EndPoint,
    pub(super) switches: Vec<ControlSwitch>,
}

/// Absolute tolerances of the components; sensitivities are not controlled, any positive number will do.
fn absolute(scales: &[f64], tolerance: f64, dimension: usize) -> Tolerance {
    let mut absolute: Vec<f64> = scales.iter().map(|s| tolerance * s).collect();
    absolute.resize(dimension, 1.0);
    Tolerance::PerComponent(absolute)
}

/// Integrators of one phase.
pub(super) struct Flow {
    pub(super) hamiltonian: RefCell<Hamiltonian>,
    alone: Integrator,
    with_sensitivities: Integrator,
    components: usize,
    /// Typical size of each component.
    scales: Vec<f64>,
    tolerance: f64,
    start: Vec<f64>,
    end: Vec<f64>,
    slopes: Vec<f64>,
}

impl Flow {
    /// With relative tolerance and the typical size of each component of `y`.
    pub(super) fn new(hamiltonian: Hamiltonian, tolerance: f64, scales: &[f64]) -> Result<Self, OdeError> {
        let (n, np) = (hamiltonian.dimension(), hamiltonian.parameters);
        let augmented = n * (1 + n + np);
        let integrator = |dimension: usize| {
            let settings = OdeSettings {
                relative_tolerance: tolerance,
                absolute_tolerance: absolute(scales, tolerance, dimension),
                controlled_components: Some(n),
                max_steps: 3000,
                ..OdeSettings::default()
            };
            Integrator::new(dimension, settings)
        };
        Ok(Self {
            alone: integrator(n)?,
            with_sensitivities: integrator(augmented)?,
            components: n,
            scales: scales.to_vec(),
            tolerance,
            start: vec![0.0; augmented],
            end: vec![0.0; augmented],
            slopes: vec![0.0; n * (n + np)],
            hamiltonian: RefCell::new(hamiltonian),
        })
    }

    /// Relative tolerance from now on; one that is not positive is left alone.
    pub(super) fn set_tolerance(&mut self, tolerance: f64) {
        if tolerance == self.tolerance {
            return;
        }
        for integrator in [&mut self.alone, &mut self.with_sensitivities] {
            let absolute = absolute(&self.scales, tolerance, integrator.dimension());
            if integrator.set_tolerance(tolerance, absolute).is_err() {
                return;
            }
        }
        self.tolerance = tolerance;
    }

    /// Flies from `y` (states and costates) at `t0` to `t1`. The control search starts at `control`, which is replaced by the
    /// control at `t0`.
    pub(super) fn pass(
        &mut self,
        p: &[f64],
        (t0, t1): (f64, f64),
        y: &[f64],
        control: &mut [f64],
        sensitivities: bool,
        passage: &mut SegmentFlight,
    ) -> Result<(), FlowFailure> {
        self.pass_observed(p, (t0, t1), y, control, sensitivities, passage, &mut ())
    }

    /// The same with an observer of the steps.
    pub(super) fn pass_observed<O: Observer>(
        &mut self,
        p: &[f64],
        (t0, t1): (f64, f64),
        y: &[f64],
        control: &mut [f64],
        sensitivities: bool,
        passage: &mut SegmentFlight,
        observer: &mut O,
    ) -> Result<(), FlowFailure> {
        let n = self.components;
        let (nx, np) = {
            let h = self.hamiltonian.get_mut();
            (h.states, h.parameters)
        };
        let width = n + np;
        self.start.fill(0.0);
        self.start[..2 * nx].copy_from_slice(&y[..2 * nx]);
        for i in 0..n {
            self.start[n + i * width + i] = 1.0;
        }
        {
            let h = self.hamiltonian.get_mut();
            h.start_control(control);
            h.choose_levels(t0, &y[..nx], &y[nx..2 * nx], p);
            h.end_point(t0, &self.start[..n], p, &mut passage.first);
            control.copy_from_slice(h.control());
        }
        if passage.first.rates.iter().any(|r| !r.is_finite()) {
            return Err(FlowFailure::Stopped(Status::NotFinite));
        }
        passage.switches.clear();
        let switching = self.hamiltonian.get_mut().switching();
        let dimension = if sensitivities { n * (1 + width) } else { n };
        let mut t = t0;
        loop {
            let status = {
                let hamiltonian = &self.hamiltonian;
                let system = Canonical::new(hamiltonian, p, sensitivities);
                let function = |u: usize| {
                    move |t: f64, z: &[f64]| {
                        hamiltonian.borrow_mut().switching_function(t, &z[..nx], &z[nx..2 * nx], p, u)
                    }
                };
                let functions: Vec<_> = switching.iter().map(|&u| function(u)).collect();
                let events: Vec<Event<'_>> = functions
                    .iter()
                    .zip(&switching)
                    .map(|(f, &u)| {
                        let low = hamiltonian.borrow().level(u) == Place::Lower;
                        let direction = if low { Direction::Falling } else { Direction::Rising };
                        Event::new(f).directed(direction).terminal()
                    })
                    .collect();
                let integrator = if sensitivities { &mut self.with_sensitivities } else { &mut self.alone };
                let (start, end) = (&self.start[..dimension], &mut self.end[..dimension]);
                let summary = integrator
                    .integrate_observed(&system, t, start, t1, end, &events, observer)
                    .map_err(|_| FlowFailure::Stopped(Status::NotFinite))?;
                t = summary.time;
                summary.status
            };
            match status {
                Status::Completed => break,
                Status::Event(k) => {
                    if passage.switches.len() == MAX_SWITCHES {
                        return Err(FlowFailure::Chattering);
                    }
                    let u = switching[k];
                    let rises = self.switch(t, p, u, sensitivities);
                    passage.switches.push(ControlSwitch { time: t, control: u, rises });
                    self.start[..dimension].copy_from_slice(&self.end[..dimension]);
                }
                status => return Err(FlowFailure::Stopped(status)),
            }
        }
        passage.end.clear();
        passage.end.extend_from_slice(&self.end[..n]);
        if sensitivities {
            passage.moved.clear();
            passage.moved.extend_from_slice(&self.end[n..dimension]);
        }
        self.hamiltonian.get_mut().end_point(t1, &self.end[..n], p, &mut passage.last);
        Ok(())
    }

    /// Moves a control to its other bound at the end reached; the sensitivities jump by `(F+ - F-) grad(S)^T / S'`, since the time
    /// of the switch moves.
    fn switch(&mut self, t: f64, p: &[f64], u: usize, sensitivities: bool) -> bool {
        let n = self.components;
        let h = self.hamiltonian.get_mut();
        let width = n + h.parameters;
        let (y, moved) = self.end.split_at_mut(n);
        let (mut before, mut after) = (vec![0.0; n], vec![0.0; n]);
        let mut gradient = vec![0.0; width];
        h.rates_and_slopes(t, y, p, &mut before, &mut self.slopes);
        let speed = h.switching_slopes(u, &before, &mut gradient);
        let rises = h.level(u) == Place::Lower;
        h.set_level(u, if rises { Place::Upper } else { Place::Lower });
        if sensitivities {
            h.rates(t, y, p, &mut after);
            for c in 0..width {
                let along: f64 = (0..n).map(|k| gradient[k] * moved[k * width + c]).sum();
                let explicit = if c >= n { gradient[c] } else { 0.0 };
                let delay = (along + explicit) / speed;
                for i in 0..n {
                    moved[i * width + c] += (after[i] - before[i]) * delay;
                }
            }
        }
        rises
    }
}

impl Hamiltonian {
    /// Rates, Hamiltonian and its explicit change at a point.
    pub(super) fn end_point(&mut self, t: f64, y: &[f64], p: &[f64], out: &mut EndPoint) {
        out.rates.resize(self.dimension(), 0.0);
        self.rates(t, y, p, &mut out.rates);
        out.hamiltonian = self.value;
        out.time_slope = self.gradient[self.inputs() - 1];
    }
}

#[cfg(test)]
mod tests;
