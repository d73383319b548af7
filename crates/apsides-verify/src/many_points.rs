//! The functions of one phase at many points at once: what each has alone, in the lanes of the machine.

use apsides_ad::NodeFunction;

use crate::equations::Equations;

/// Time and states, and the costates by which rates enter the Hamiltonian.
#[derive(Clone, Debug)]
pub(crate) struct AtTime {
    pub(crate) time: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) costate: Vec<f64>,
}

/// Controls at places of a phase.
#[derive(Clone, Copy)]
pub(crate) struct Controls<'p> {
    pub(crate) places: &'p [AtTime],
    /// The place of each control.
    pub(crate) at: &'p [usize],
    /// One control after the other.
    pub(crate) values: &'p [f64],
}

impl Equations<'_> {
    /// The Hamiltonian of each control.
    pub(crate) fn hamiltonians(&self, controls: Controls<'_>) -> Vec<f64> {
        let nx = self.nx;
        let rates = self.values_at(self.phase.dynamics.as_ref(), controls);
        let by_costate = |(k, rates): (&usize, &[f64])| {
            let costate = &controls.places[*k].costate;
            costate.iter().zip(rates).map(|(w, v)| w * v).sum::<f64>()
        };
        let mut sums: Vec<f64> = controls.at.iter().zip(rates.chunks(nx)).map(by_costate).collect();
        for (k, integral) in self.phase.integrals.iter().enumerate() {
            let weight = self.weight(k);
            if weight != 0.0 {
                let values = self.values_at(integral.function.as_ref(), controls);
                sums.iter_mut().zip(&values).for_each(|(sum, v)| *sum += weight * v);
            }
        }
        sums
    }

    /// The value of a path constraint row with each control; NaN where there is no such row.
    pub(crate) fn row_values(&self, row: usize, controls: Controls<'_>) -> Vec<f64> {
        let Some((function, output)) = self.path_row(row) else { return vec![f64::NAN; controls.at.len()] };
        let values = self.values_at(function, controls);
        values.iter().skip(output).step_by(function.outputs()).copied().collect()
    }

    /// The slopes of a path constraint row in the controls, one after the other; NaN where there is no such row.
    pub(crate) fn row_slopes(&self, row: usize, controls: Controls<'_>) -> Vec<f64> {
        let (points, nu) = (controls.at.len(), self.nu);
        let Some((function, output)) = self.path_row(row) else { return vec![f64::NAN; points * nu] };
        let inputs = self.inputs_at(function, controls);
        let (outputs, pattern) = (function.outputs(), function.pattern());
        let length = pattern.jacobian_len();
        let (mut values, mut entries) = (vec![0.0; points * outputs], vec![0.0; points * length]);
        function.jacobians(points, &inputs, &mut values, &mut entries);
        let mut slopes = vec![0.0; points * nu];
        for k in pattern.row_offsets[output]..pattern.row_offsets[output + 1] {
            if let Some(control) = pattern.columns[k].checked_sub(self.nx).filter(|j| *j < nu) {
                for p in 0..points {
                    slopes[p * nu + control] = entries[p * length + k];
                }
            }
        }
        slopes
    }

    fn values_at(&self, function: &dyn NodeFunction, controls: Controls<'_>) -> Vec<f64> {
        let inputs = self.inputs_at(function, controls);
        let points = controls.at.len();
        let mut values = vec![0.0; points * function.outputs()];
        function.values(points, &inputs, &mut values);
        values
    }

    fn inputs_at(&self, function: &dyn NodeFunction, controls: Controls<'_>) -> Vec<f64> {
        let mut inputs = Vec::with_capacity(controls.at.len() * function.inputs());
        let parameters = if self.phase.takes_parameters(function) { self.parameters() } else { &[] };
        for (&k, u) in controls.at.iter().zip(controls.values.chunks(self.nu)) {
            let place = &controls.places[k];
            inputs.extend_from_slice(&place.x);
            inputs.extend_from_slice(u);
            inputs.extend_from_slice(parameters);
            inputs.push(place.time);
        }
        inputs
    }
}
