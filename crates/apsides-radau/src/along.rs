//! The functions of a phase along its polynomials, at points that lie alike in all intervals of as many nodes.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_basis::{Barycentric, Resampling};
use apsides_ocp::{Phase, PhaseTrajectory, PiecewisePolynomial};

use crate::RadauError;

/// States and controls at some points of the interval that it went to, and the functions of the phase there.
pub(crate) struct Along<'a, P> {
    phase: &'a Phase,
    trajectory: &'a PhaseTrajectory,
    parameters: &'a [f64],
    /// Gives the places of the points on [-1, 1], by the number of an interval.
    places: P,
    /// Those of the last interval, with its bases.
    last: Option<Places>,
    start: f64,
    half: f64,
    states: Vec<f64>,
    controls: Vec<f64>,
    inputs: Vec<f64>,
}

/// The points of intervals with the same bases.
struct Places {
    bases: [Arc<Barycentric>; 2],
    places: Vec<f64>,
    to_states: Resampling,
    to_controls: Resampling,
}

impl<'a, P: Fn(usize) -> Result<Vec<f64>, RadauError>> Along<'a, P> {
    pub(crate) fn new(
        phase: &'a Phase,
        trajectory: &'a PhaseTrajectory,
        parameters: &'a [f64],
        places: P,
    ) -> Self {
        Self {
            phase,
            trajectory,
            parameters,
            places,
            last: None,
            start: 0.0,
            half: 0.0,
            states: Vec::new(),
            controls: Vec::new(),
            inputs: Vec::new(),
        }
    }

    /// Goes to an interval.
    pub(crate) fn go(&mut self, k: usize) -> Result<(), RadauError> {
        let of = |p: &'a PiecewisePolynomial| &p.segments()[k];
        let (state, control) = (of(&self.trajectory.state), of(&self.trajectory.control));
        let is_same = |places: &Places| {
            let [of_state, of_control] = &places.bases;
            Arc::ptr_eq(of_state, &state.basis) && Arc::ptr_eq(of_control, &control.basis)
        };
        let last = match self.last.take().filter(is_same) {
            Some(last) => last,
            None => {
                let places = (self.places)(k)?;
                Places {
                    bases: [Arc::clone(&state.basis), Arc::clone(&control.basis)],
                    to_states: Resampling::new(&state.basis, &places),
                    to_controls: Resampling::new(&control.basis, &places),
                    places,
                }
            }
        };
        let count = last.places.len();
        self.states.resize(count * self.phase.states.len(), 0.0);
        self.controls.resize(count * self.phase.controls.len(), 0.0);
        last.to_states.apply(&state.values, &mut self.states);
        last.to_controls.apply(&control.values, &mut self.controls);
        self.last = Some(last);
        let breaks = self.trajectory.state.breaks();
        self.start = breaks[k];
        self.half = 0.5 * (breaks[k + 1] - breaks[k]);
        Ok(())
    }

    /// Points of the interval.
    pub(crate) fn count(&self) -> usize {
        self.last.as_ref().map_or(0, |last| last.places.len())
    }

    /// Half of the length of the interval.
    pub(crate) fn half(&self) -> f64 {
        self.half
    }

    /// States at the points, `points x states`.
    pub(crate) fn states(&self) -> &[f64] {
        &self.states
    }

    /// Controls at the points, `points x controls`.
    pub(crate) fn controls(&self) -> &[f64] {
        &self.controls
    }

    /// Writes the values of a function at the first points, as many as there is room for.
    pub(crate) fn values(&mut self, function: &dyn NodeFunction, out: &mut [f64]) {
        let Some(last) = &self.last else { return };
        let (nx, nu) = (self.phase.states.len(), self.phase.controls.len());
        let (width, points) = (function.inputs(), out.len() / function.outputs().max(1));
        // What is left are all parameters or none, then the time.
        let taken = &self.parameters[..width - nx - nu - 1];
        self.inputs.clear();
        for (point, place) in last.places[..points].iter().enumerate() {
            self.inputs.extend_from_slice(&self.states[point * nx..(point + 1) * nx]);
            self.inputs.extend_from_slice(&self.controls[point * nu..(point + 1) * nu]);
            self.inputs.extend_from_slice(taken);
            self.inputs.push(self.start + self.half * (place + 1.0));
        }
        function.values(points, &self.inputs, out);
    }
}
