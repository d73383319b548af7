//! Sensors: noise, bias, sample time and delay of what a law sees of the state.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use crate::error::{ControlError, finite, not_negative, positive, steps_of};

/// Settings of a sensor of `N` quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSettings<const N: usize> {
    /// Standard deviation of the noise of each quantity, in its unit; independent from sample to sample. Default 0.
    pub noise: [f64; N],
    /// The bias that is added to each quantity, in its unit. Default 0.
    pub bias: [f64; N],
    /// Control steps from one measurement to the next, which is held between them; default 1.
    pub interval: usize,
    /// Control steps by which a measurement is late; until the first arrives, that of the start is seen. Default 0.
    pub delay: usize,
    /// Seed of the noise.
    pub seed: u64,
}

impl<const N: usize> Default for SensorSettings<N> {
    fn default() -> Self {
        Self { noise: [0.0; N], bias: [0.0; N], interval: 1, delay: 0, seed: 0 }
    }
}

/// Control steps of a time (s), for the interval and the delay of a sensor: the least whole number that is not shorter.
///
/// # Errors
/// [`ControlError::Parameter`] where the time is negative, above a million control steps, or the control step not positive.
pub fn control_steps(time: f64, control_step: f64) -> Result<usize, ControlError> {
    not_negative("time in s", time)?;
    positive("control step in s", control_step)?;
    steps_of("time in s", time, control_step)
}

/// A sensor with its state.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor<const N: usize> {
    settings: SensorSettings<N>,
    generator: Xoshiro256PlusPlus,
    steps: usize,
    held: [f64; N],
    /// Measurements on their way; the place of the oldest.
    waiting: Vec<[f64; N]>,
    oldest: usize,
}

impl<const N: usize> Sensor<N> {
    /// A sensor before its first measurement.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where a deviation is negative, a bias not finite or the interval zero.
    pub fn new(settings: SensorSettings<N>) -> Result<Self, ControlError> {
        for k in 0..N {
            not_negative("standard deviation of a sensor", settings.noise[k])?;
            finite("bias of a sensor", settings.bias[k])?;
        }
        if settings.interval == 0 {
            let what = "interval of a sensor in control steps";
            return Err(ControlError::Parameter { what, value: 0.0, allowed: "at least 1" });
        }
        Ok(Self {
            settings,
            generator: Xoshiro256PlusPlus::seed_from_u64(settings.seed),
            steps: 0,
            held: [0.0; N],
            waiting: vec![[0.0; N]; settings.delay],
            oldest: 0,
        })
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &SensorSettings<N> {
        &self.settings
    }

    /// The measurement at this control step, of which the truth is given.
    pub fn measure(&mut self, truth: &[f64; N]) -> [f64; N] {
        let first = self.steps == 0;
        if self.steps.is_multiple_of(self.settings.interval) {
            for k in 0..N {
                let sigma = self.settings.noise[k];
                let draw: f64 = if sigma > 0.0 { StandardNormal.sample(&mut self.generator) } else { 0.0 };
                self.held[k] = truth[k] + self.settings.bias[k] + sigma * draw;
            }
        }
        self.steps += 1;
        if self.waiting.is_empty() {
            return self.held;
        }
        if first {
            self.waiting.fill(self.held);
        }
        let seen = std::mem::replace(&mut self.waiting[self.oldest], self.held);
        self.oldest = (self.oldest + 1) % self.waiting.len();
        seen
    }

    /// Sets it back to what it was before the first measurement, with the noise of the seed again.
    pub fn reset(&mut self) {
        self.generator = Xoshiro256PlusPlus::seed_from_u64(self.settings.seed);
        (self.steps, self.oldest) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ideal_one_shows_the_truth() {
        let mut ideal = Sensor::new(SensorSettings::default()).unwrap();
        assert_eq!(ideal.measure(&[1.0, -2.0]), [1.0, -2.0]);
    }

    #[test]
    fn noise_has_its_mean_and_deviation() {
        let settings = SensorSettings { noise: [0.5, 0.0], bias: [0.2, -1.0], seed: 7, ..Default::default() };
        let mut noisy = Sensor::new(settings).unwrap();
        let n = 20_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let [a, b] = noisy.measure(&[1.0, 1.0]);
            assert_eq!(b, 0.0);
            sum += a - 1.2;
            squares += (a - 1.2).powi(2);
        }
        // Four standard deviations of mean and variance of a normal sample.
        let n = f64::from(n);
        assert!((sum / n).abs() < 4.0 * 0.5 / n.sqrt());
        assert!((squares / n / 0.25 - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
    }

    #[test]
    fn interval_and_delay() {
        let mut slow = Sensor::new(SensorSettings { interval: 3, delay: 2, ..Default::default() }).unwrap();
        let seen: Vec<f64> = (0..10).map(|k| slow.measure(&[f64::from(k)])[0]).collect();
        assert_eq!(seen, [0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 3.0, 3.0, 6.0, 6.0]);
        assert_eq!(control_steps(0.3, 0.1).unwrap(), 3);
        assert_eq!(control_steps(0.05, 0.1).unwrap(), 1);
        assert!(control_steps(0.1, 0.0).is_err());
    }

    #[test]
    fn the_same_seed_gives_the_same_noise() {
        let settings = SensorSettings { noise: [1.0], seed: 3, delay: 1, ..Default::default() };
        let mut sensor = Sensor::new(settings).unwrap();
        let run =
            |sensor: &mut Sensor<1>| -> Vec<f64> { (0..50).map(|_| sensor.measure(&[0.0])[0]).collect() };
        let first = run(&mut sensor);
        sensor.reset();
        assert_eq!(run(&mut sensor), first);
        let mut other = Sensor::new(SensorSettings { seed: 4, ..settings }).unwrap();
        assert_ne!(run(&mut other), first);
    }

    #[test]
    fn refusals() {
        let refused = |s: SensorSettings<1>| assert!(Sensor::new(s).is_err());
        refused(SensorSettings { noise: [-1.0], ..Default::default() });
        refused(SensorSettings { noise: [f64::NAN], ..Default::default() });
        refused(SensorSettings { bias: [f64::INFINITY], ..Default::default() });
        refused(SensorSettings { interval: 0, ..Default::default() });
    }
}
