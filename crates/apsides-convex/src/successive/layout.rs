//! Places of the unknowns: per phase the nodes `[x, u]`, then its times; static parameters last.

use apsides_ocp::{EndpointInput, Guess, Ocp, Scaling};

#[derive(Clone, Debug)]
pub(crate) struct PhaseLayout {
    pub(crate) states: usize,
    pub(crate) controls: usize,
    first: usize,
    pub(crate) intervals: usize,
}

impl PhaseLayout {
    pub(crate) fn state(&self, node: usize) -> usize {
        self.first + node * (self.states + self.controls)
    }

    pub(crate) fn control(&self, node: usize) -> usize {
        self.state(node) + self.states
    }

    /// Start time; the end time is next.
    pub(crate) fn times(&self) -> usize {
        self.state(self.intervals + 1)
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub(crate) phases: Vec<PhaseLayout>,
    pub(crate) first_parameter: usize,
    pub(crate) parameters: usize,
}

impl Layout {
    pub(crate) fn new(ocp: &Ocp, intervals: usize) -> Self {
        let mut first = 0;
        let phases = ocp.phases.iter().map(|p| {
            let layout = PhaseLayout { states: p.states.len(), controls: p.controls.len(), first, intervals };
            first = layout.times() + 2;
            layout
        });
        let phases = phases.collect();
        Self { phases, first_parameter: first, parameters: ocp.parameters.len() }
    }

    pub(crate) fn unknowns(&self) -> usize {
        self.first_parameter + self.parameters
    }

    pub(crate) fn column(&self, input: EndpointInput) -> usize {
        match input {
            EndpointInput::InitialTime { phase } => self.phases[phase].times(),
            EndpointInput::FinalTime { phase } => self.phases[phase].times() + 1,
            EndpointInput::InitialState { phase, state } => self.phases[phase].state(0) + state,
            EndpointInput::FinalState { phase, state } => {
                self.phases[phase].state(self.phases[phase].intervals) + state
            }
            EndpointInput::Parameter { index } => self.first_parameter + index,
        }
    }

    pub(crate) fn start(&self, guess: &Guess) -> Vec<f64> {
        let mut z = vec![0.0; self.unknowns()];
        for (p, g) in self.phases.iter().zip(&guess.phases) {
            for node in 0..=p.intervals {
                let fraction = node as f64 / p.intervals as f64;
                g.state(fraction, &mut z[p.state(node)..][..p.states]);
                g.control(fraction, &mut z[p.control(node)..][..p.controls]);
            }
            z[p.times()] = g.initial_time;
            z[p.times() + 1] = g.final_time;
        }
        z[self.first_parameter..].copy_from_slice(&guess.parameters);
        z
    }

    pub(crate) fn scales(&self, scaling: &Scaling) -> Vec<f64> {
        let mut scales = vec![1.0; self.unknowns()];
        for (p, s) in self.phases.iter().zip(&scaling.phases) {
            for node in 0..=p.intervals {
                scales[p.state(node)..][..p.states].copy_from_slice(&s.states);
                scales[p.control(node)..][..p.controls].copy_from_slice(&s.controls);
            }
            scales[p.times()..][..2].fill(s.time);
        }
        scales[self.first_parameter..].copy_from_slice(&scaling.parameters);
        scales
    }
}
