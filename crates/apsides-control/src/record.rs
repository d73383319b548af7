//! Records of a run, and statistics of a signal while another one is in a window.

use crate::error::ControlError;

/// A moment of a run: a control step, or its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const NX: usize, const NU: usize> {
    /// Time, s.
    pub time: f64,
    /// State.
    pub state: [f64; NX],
    /// Command of the law for the control step that begins here; at the end of a run that of the last one.
    pub command: [f64; NU],
    /// Control over that step.
    pub control: [f64; NU],
}

/// Samples of a run. Room for the longest run is made before it starts, and is kept from run to run.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording<const NX: usize, const NU: usize> {
    interval: usize,
    samples: Vec<Sample<NX, NU>>,
}

impl<const NX: usize, const NU: usize> Recording<NX, NU> {
    /// An empty record of every `interval`-th control step and of the end; 0 keeps the end alone.
    #[must_use]
    pub fn every(interval: usize) -> Self {
        Self { interval, samples: Vec::new() }
    }

    /// Control steps from one sample to the next; 0 keeps the end of a run alone.
    #[must_use]
    pub fn interval(&self) -> usize {
        self.interval
    }

    /// The samples in order of time.
    #[must_use]
    pub fn samples(&self) -> &[Sample<NX, NU>] {
        &self.samples
    }

    /// Empties the record and fills it with samples in order of time, such as those of a record of another form.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where memory has no room for them.
    pub fn refill(
        &mut self,
        samples: impl ExactSizeIterator<Item = Sample<NX, NU>>,
    ) -> Result<(), ControlError> {
        self.samples.clear();
        self.reserve(samples.len())?;
        self.samples.extend(samples);
        Ok(())
    }

    /// Empties the record and makes room for a run of so many control steps.
    pub(crate) fn prepare(&mut self, steps: usize) -> Result<(), ControlError> {
        self.samples.clear();
        self.reserve(steps.checked_div(self.interval).unwrap_or(0) + 2)
    }

    fn reserve(&mut self, expected: usize) -> Result<(), ControlError> {
        let found = self.samples.capacity();
        let what = "samples of a record that memory has room for";
        self.samples.try_reserve(expected).map_err(|_| ControlError::Dimension { what, expected, found })
    }

    /// Tells whether control step number `step` is kept.
    pub(crate) fn wants(&self, step: usize) -> bool {
        self.interval > 0 && step.is_multiple_of(self.interval)
    }

    pub(crate) fn push(&mut self, sample: Sample<NX, NU>) {
        self.samples.push(sample);
    }

    /// Statistics of a signal over the samples at which another one is in a range, ends included: of the angle of attack from 20 to
    /// 3 km of altitude. `None` where no sample is.
    pub fn statistics(
        &self,
        signal: impl Fn(&Sample<NX, NU>) -> f64,
        window: impl Fn(&Sample<NX, NU>) -> f64,
        range: [f64; 2],
    ) -> Option<Statistics> {
        let (mut sum, mut squares, mut peak, mut count) = (0.0, 0.0, 0.0_f64, 0_usize);
        for sample in &self.samples {
            if (range[0]..=range[1]).contains(&window(sample)) {
                let value = signal(sample);
                sum += value;
                squares += value * value;
                // Unlike `f64::max`, this keeps NaN.
                peak = if value.abs() <= peak { peak } else { value.abs() };
                count += 1;
            }
        }
        let n = count as f64;
        (count > 0).then(|| Statistics { mean: sum / n, rms: (squares / n).sqrt(), peak, count })
    }
}

/// Statistics of a signal over samples of equal weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub peak: f64,
    /// Number of samples.
    pub count: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn statistics_in_a_window() {
        let mut record = Recording::<2, 1>::every(1);
        for k in 0..=20 {
            let altitude = 20.0 - f64::from(k);
            let signal = if (5.0..=10.0).contains(&altitude) { altitude - 7.0 } else { 1e9 };
            let state = [altitude, signal];
            record.push(Sample { time: 0.0, state, command: [0.0], control: [0.0] });
        }
        // -2, -1, 0, 1, 2, 3.
        let found = record.statistics(|s| s.state[1], |s| s.state[0], [5.0, 10.0]).unwrap();
        assert_eq!((found.mean, found.peak, found.count), (0.5, 3.0, 6));
        assert!((found.rms - (19.0_f64 / 6.0).sqrt()).abs() < ROUNDING);
        assert!(record.statistics(|s| s.state[1], |s| s.state[0], [50.0, 60.0]).is_none());
        assert!(record.statistics(|_| f64::NAN, |s| s.state[0], [5.0, 10.0]).unwrap().peak.is_nan());
    }
}
