//! States and controls along the splines of one phase.

use apsides_basis::Bspline;

use crate::FlatSystem;

/// Splines of one phase: what a solve returns beside the trajectory.
#[derive(Clone, Debug)]
pub struct PhaseSplines {
    /// One basis per output, on the normalised time from 0 to 1.
    pub bases: Vec<Bspline>,
    /// Coefficients per output.
    pub coefficients: Vec<Vec<f64>>,
    /// Ends of the segments, from 0 to 1.
    pub breaks: Vec<f64>,
}

/// The flat map along the splines of one phase.
pub(crate) struct Curve<'a> {
    system: &'a FlatSystem,
    splines: &'a PhaseSplines,
    initial_time: f64,
    final_time: f64,
    /// Index of the knot at which each segment begins, per output.
    spans: Vec<Vec<usize>>,
    /// Inputs of the map, and their rates of change.
    z: Vec<f64>,
    rates: Vec<f64>,
    values: Vec<f64>,
    entries: Vec<f64>,
}

impl<'a> Curve<'a> {
    pub(crate) fn new(
        system: &'a FlatSystem,
        splines: &'a PhaseSplines,
        times: (f64, f64),
        parameters: &[f64],
    ) -> Self {
        let middles = |w: &[f64]| 0.5 * (w[0] + w[1]);
        let spans =
            splines.bases.iter().map(|b| splines.breaks.windows(2).map(|w| b.span(middles(w))).collect());
        let mut z = vec![0.0; system.map.inputs()];
        let jet = system.outputs * system.jet_rows;
        z[jet..jet + system.parameters].copy_from_slice(&parameters[..system.parameters]);
        let mut rates = vec![0.0; z.len()];
        if let Some(time) = rates.last_mut() {
            *time = 1.0;
        }
        Self {
            spans: spans.collect(),
            system,
            splines,
            initial_time: times.0,
            final_time: times.1,
            z,
            rates,
            values: vec![0.0; system.map.outputs()],
            entries: vec![0.0; system.map.pattern().jacobian_len()],
        }
    }

    pub(crate) fn time(&self, fraction: f64) -> f64 {
        (1.0 - fraction) * self.initial_time + fraction * self.final_time
    }

    /// Inputs of the map and, where wanted, their rates of change.
    fn set(&mut self, segment: usize, fraction: f64, with_rates: bool) {
        let rate = (self.final_time - self.initial_time).recip();
        let rows = self.system.jet_rows;
        for (i, (basis, c)) in self.splines.bases.iter().zip(&self.splines.coefficients).enumerate() {
            let mut power = 1.0;
            for d in 0..rows + usize::from(with_rates) {
                let mut y = [0.0];
                basis.evaluate_in(self.spans[i][segment], c, d, fraction, &mut y);
                let y = y[0] * power;
                if d < rows {
                    self.z[i * rows + d] = y;
                }
                if with_rates && d > 0 {
                    self.rates[i * rows + d - 1] = y;
                }
                power *= rate;
            }
        }
        let t = self.time(fraction);
        if let Some(time) = self.z.last_mut() {
            *time = t;
        }
    }

    /// States, controls and residuals at a fraction of the phase, of one segment.
    pub(crate) fn quantities(&mut self, segment: usize, fraction: f64) -> &[f64] {
        self.set(segment, fraction, false);
        self.system.map.value(&self.z, &mut self.values);
        &self.values
    }

    /// States, controls and residuals, and in `rates` the rate of change of each state.
    pub(crate) fn with_rates(&mut self, segment: usize, fraction: f64, rates: &mut [f64]) -> &[f64] {
        self.set(segment, fraction, true);
        self.system.map.jacobian(&self.z, &mut self.values, &mut self.entries);
        rates.fill(0.0);
        for ((q, input), v) in self.system.map.pattern().jacobian_entries().zip(&self.entries) {
            if let Some(rate) = rates.get_mut(q) {
                *rate += v * self.rates[input];
            }
        }
        &self.values
    }
}
