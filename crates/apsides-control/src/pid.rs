//! The discrete PID law `u = kp e + ki I + kd D` with a filtered derivative, limits and anti-windup.
//!
//! With sample time `T` and filter time `Tf`, at each sample
//!
//! ```text
//! I <- I + T e,    D <- (Tf D + e - e_before) / (Tf + T)
//! ```
//!
//! both backward differences (K. J. Astrom, T. Hagglund, *Advanced PID Control*, ISA 2006, chapter 13). With a measured rate of the
//! error at hand, [`Pid::update_with_rate`] takes that for `D`. The integral must not grow while the output is at a limit; see
//! [`AntiWindup`]. Where what follows the law saturates as a whole, as an allocation to a disk does, [`Pid::track`] says what was
//! reached.

use crate::error::{ControlError, finite, not_negative, ordered, positive};

/// Gains of a PID law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains {
    /// Output per error.
    pub proportional: f64,
    /// Output per integral of the error, 1/s of the proportional one.
    pub integral: f64,
    /// Output per rate of the error, s of the proportional one.
    pub derivative: f64,
}

impl PidGains {
    /// The gains in the order of their name.
    #[must_use]
    pub fn new(proportional: f64, integral: f64, derivative: f64) -> Self {
        Self { proportional, integral, derivative }
    }
}

/// The method that keeps the integral from growing while the output is at a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AntiWindup {
    /// Nothing.
    Off,
    /// No integration of an error that drives the output further beyond its limit.
    Conditional,
    /// The integral follows what was reached with this time constant (s): `ki I <- ki I + T/time (reached - u)`.
    BackCalculation {
        /// Time constant, s.
        time: f64,
    },
}

/// Settings of a PID law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidSettings {
    /// Gains.
    pub gains: PidGains,
    /// Time between samples, s.
    pub sample_time: f64,
    /// Time constant of the filter of the derivative, s; 0 is the plain difference.
    pub filter_time: f64,
    /// Least and largest output; infinite ones are allowed.
    pub limits: [f64; 2],
    /// The treatment of the integral at a limit.
    pub anti_windup: AntiWindup,
}

impl PidSettings {
    /// No filter, no limits, conditional integration.
    #[must_use]
    pub fn new(gains: PidGains, sample_time: f64) -> Self {
        Self {
            gains,
            sample_time,
            filter_time: 0.0,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
            anti_windup: AntiWindup::Conditional,
        }
    }
}

/// Integral and derivative of an error that is seen at sample times: what a law remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorMemory {
    sample_time: f64,
    filter_time: f64,
    integral: f64,
    derivative: f64,
    previous: Option<f64>,
    /// Integral before the last sample.
    integral_before: f64,
    /// Says whether the last sample was taken out of the integral.
    undone: bool,
}

impl ErrorMemory {
    /// Empty memory.
    fn new(sample_time: f64, filter_time: f64) -> Result<Self, ControlError> {
        Ok(Self {
            sample_time: positive("sample time in s", sample_time)?,
            filter_time: not_negative("filter time in s", filter_time)?,
            integral: 0.0,
            derivative: 0.0,
            previous: None,
            integral_before: 0.0,
            undone: false,
        })
    }

    /// The error of the last sample; 0 before the first one.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.previous.unwrap_or(0.0)
    }

    /// Integral of the error.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Integral of the error as it was before the last sample.
    #[must_use]
    pub fn integral_before(&self) -> f64 {
        self.integral_before
    }

    /// Rate of the error, 1/s of it.
    #[must_use]
    pub fn derivative(&self) -> f64 {
        self.derivative
    }

    /// Takes the last sample out of the integral, once.
    pub fn undo_integration(&mut self) {
        if !self.undone {
            self.integral -= self.sample_time * self.error();
            self.undone = true;
        }
    }

    /// Adds to the integral.
    pub fn shift_integral(&mut self, by: f64) {
        self.integral += by;
    }

    /// Takes a sample; the rate is the filtered difference unless it is given. The first difference is zero.
    fn take(&mut self, error: f64, rate: Option<f64>) {
        self.integral_before = self.integral;
        self.integral += self.sample_time * error;
        self.derivative = rate.unwrap_or_else(|| {
            let change = self.previous.map_or(0.0, |before| error - before);
            (self.filter_time * self.derivative + change) / (self.filter_time + self.sample_time)
        });
        self.previous = Some(error);
        self.undone = false;
    }

    /// Sets it back to what it was before the first sample.
    fn clear(&mut self) {
        (self.integral, self.derivative, self.previous) = (0.0, 0.0, None);
        (self.integral_before, self.undone) = (0.0, false);
    }
}

/// The terms of a law: an output of an error, its integral and its rate, with an integral that does not wind up.
pub trait Terms {
    /// The output before its limits.
    fn output(&self, memory: &ErrorMemory) -> f64;

    /// Corrects the integral where the output exceeds what was reached of it by `excess`, which is not 0. Called again for a sample
    /// when less of its output was reached than first said.
    fn correct(&self, memory: &mut ErrorMemory, excess: f64);
}

/// A law of three terms with its memory and the limits of its output: [`Pid`], [`crate::nonlinear_pid::NonlinearPid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidLaw<T> {
    terms: T,
    limits: [f64; 2],
    memory: ErrorMemory,
    /// Output of the last sample before and after the limits.
    unlimited: f64,
    limited: f64,
}

impl<T: Terms> PidLaw<T> {
    /// A law of these terms with empty memory: least and largest output, sample time and time constant of the derivative's filter, s.
    ///
    /// # Errors
    /// [`ControlError::Parameter`], [`ControlError::Limits`]: sample time not positive, filter time negative, limits not in order.
    pub fn of_terms(
        terms: T,
        limits: [f64; 2],
        sample_time: f64,
        filter_time: f64,
    ) -> Result<Self, ControlError> {
        ordered("output of the PID law", limits)?;
        let memory = ErrorMemory::new(sample_time, filter_time)?;
        Ok(Self { terms, limits, memory, unlimited: 0.0, limited: 0.0 })
    }

    /// The terms.
    #[must_use]
    pub fn terms(&self) -> &T {
        &self.terms
    }

    /// Integral of the error.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.memory.integral
    }

    /// Takes the error of this sample and gives the output. An error that is not finite gives NaN and leaves the memory as it was.
    pub fn update(&mut self, error: f64) -> f64 {
        self.take(error, None)
    }

    /// As [`update`](Self::update), with a measured rate of the error instead of its difference.
    ///
    /// # Examples
    /// ```
    /// use apsides_control::pid::{Pid, PidGains, PidSettings};
    ///
    /// // A rate gyro measures 0.5 rad/s: its derivative is not taken from the error.
    /// let gains = PidGains { proportional: 2.0, integral: 0.0, derivative: 4.0 };
    /// let mut law = Pid::new(PidSettings::new(gains, 0.1))?;
    /// assert_eq!(law.update_with_rate(1.0, 0.5), 2.0 * 1.0 + 4.0 * 0.5);
    /// # Ok::<(), apsides_control::ControlError>(())
    /// ```
    pub fn update_with_rate(&mut self, error: f64, rate: f64) -> f64 {
        self.take(error, Some(rate))
    }

    fn take(&mut self, error: f64, rate: Option<f64>) -> f64 {
        if !(error.is_finite() && rate.unwrap_or(0.0).is_finite()) {
            return f64::NAN;
        }
        self.memory.take(error, rate);
        self.unlimited = self.terms.output(&self.memory);
        let [lower, upper] = self.limits;
        self.limited = self.unlimited.clamp(lower, upper);
        self.correct(self.limited);
        self.limited
    }

    /// Says what was reached of the last output, where that differs: the integral is corrected by it once more.
    pub fn track(&mut self, reached: f64) {
        if reached.is_finite() && reached != self.limited {
            self.correct(reached);
            self.limited = reached;
        }
    }

    fn correct(&mut self, reached: f64) {
        let excess = self.unlimited - reached;
        if excess != 0.0 {
            self.terms.correct(&mut self.memory, excess);
        }
    }

    /// Sets it back to what it was before the first sample.
    pub fn reset(&mut self) {
        self.memory.clear();
        (self.unlimited, self.limited) = (0.0, 0.0);
    }
}

/// A linear PID law with its memory.
pub type Pid = PidLaw<PidSettings>;

impl Pid {
    /// The law with empty memory.
    ///
    /// # Errors
    /// [`ControlError::Parameter`], [`ControlError::Limits`]: gains that are not finite, sample time not positive, filter time
    /// negative, limits not in order, time of back-calculation not positive.
    pub fn new(settings: PidSettings) -> Result<Self, ControlError> {
        finite("proportional gain", settings.gains.proportional)?;
        finite("integral gain", settings.gains.integral)?;
        finite("derivative gain", settings.gains.derivative)?;
        if let AntiWindup::BackCalculation { time } = settings.anti_windup {
            positive("time of back-calculation in s", time)?;
        }
        Self::of_terms(settings, settings.limits, settings.sample_time, settings.filter_time)
    }
}

impl Terms for PidSettings {
    fn output(&self, memory: &ErrorMemory) -> f64 {
        let gains = &self.gains;
        gains.proportional * memory.error()
            + gains.integral * memory.integral()
            + gains.derivative * memory.derivative()
    }

    fn correct(&self, memory: &mut ErrorMemory, excess: f64) {
        let integral = self.gains.integral;
        match self.anti_windup {
            AntiWindup::Conditional if integral * memory.error() * excess > 0.0 => memory.undo_integration(),
            AntiWindup::BackCalculation { time } if integral != 0.0 => {
                memory.shift_integral(-(self.sample_time / time * excess / integral));
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of sums of some thousand terms.
    const ROUNDING: f64 = 1e-12;

    fn pid(change: impl Fn(&mut PidSettings)) -> Result<Pid, ControlError> {
        let mut settings = PidSettings::new(PidGains::new(2.0, 1.0, 0.5), 0.1);
        change(&mut settings);
        Pid::new(settings)
    }

    #[test]
    fn terms_by_hand() {
        let mut law = pid(|_| {}).unwrap();
        assert!((law.update(1.0) - (2.0 + 0.1)).abs() < ROUNDING);
        assert!((law.update(2.0) - (4.0 + 0.3 + 0.5 * 10.0)).abs() < ROUNDING);
        law.reset();
        assert!((law.update_with_rate(1.0, -3.0) - (2.1 - 1.5)).abs() < ROUNDING);
    }

    #[test]
    fn filtered_derivative_of_a_ramp_settles_at_its_slope() {
        let mut law = pid(|s| {
            s.gains = PidGains::new(0.0, 0.0, 1.0);
            s.filter_time = 0.3;
        })
        .unwrap();
        // D_n = slope (1 - (Tf/(Tf+T))^n), the step response of the filter.
        for n in 0..40 {
            let expected = 2.0 * (1.0 - 0.75_f64.powi(n));
            assert!((law.update(0.2 * f64::from(n)) - expected).abs() < ROUNDING);
        }
    }

    #[test]
    fn the_integral_does_not_wind_up() {
        let run = |anti_windup| {
            let mut law = pid(|s| {
                s.limits = [-1.0, 1.0];
                s.anti_windup = anti_windup;
            })
            .unwrap();
            for _ in 0..1000 {
                assert_eq!(law.update(3.0), 1.0);
            }
            let wound = law.integral();
            let mut samples = 0;
            while law.update(-0.1) >= 1.0 {
                samples += 1;
            }
            (wound, samples)
        };
        let (wound, samples) = run(AntiWindup::Off);
        assert!((wound - 300.0).abs() < 100.0 * ROUNDING);
        assert!(samples > 1000);
        assert_eq!(run(AntiWindup::Conditional), (0.0, 0));
        // Equilibrium of back-calculation: T e = T/time (u - 1)/ki with u = 6 + I + T e before it, hence I = -4.3 after it.
        let (wound, samples) = run(AntiWindup::BackCalculation { time: 0.5 });
        assert!((wound - (1.0 + 0.5 * 3.0 - 6.0 - 0.3)).abs() < 1e3 * ROUNDING, "{wound}");
        assert_eq!(samples, 0);
    }

    #[test]
    fn tracking_takes_a_sample_out_once() {
        for (limits, reached) in [([-1e9, 1e9], 0.5), ([-1.0, 1.0], 0.5), ([-1.0, 1.0], 1.0)] {
            let mut law = pid(|s| s.limits = limits).unwrap();
            law.update(3.0);
            law.track(reached);
            assert_eq!(law.integral(), 0.0);
        }
        // An error that leads back is integrated.
        let mut law = pid(|s| s.limits = [-1.0, 1.0]).unwrap();
        law.memory.integral = 10.0;
        law.update(-1.0);
        assert!((law.integral() - 9.9).abs() < ROUNDING);
    }

    #[test]
    fn not_finite_in_gives_nan_and_keeps_the_memory() {
        let mut law = pid(|_| {}).unwrap();
        law.update(1.0);
        let before = law;
        assert!(law.update(f64::NAN).is_nan());
        assert!(law.update_with_rate(1.0, f64::INFINITY).is_nan());
        assert_eq!(law, before);
    }

    #[test]
    fn refusals() {
        let refused = |change: fn(&mut PidSettings)| pid(change).unwrap_err();
        assert_eq!(
            refused(|s| s.sample_time = 0.0),
            ControlError::Parameter {
                what: "sample time in s",
                value: 0.0,
                allowed: "a positive finite number"
            }
        );
        assert_eq!(
            refused(|s| s.limits = [1.0, -1.0]),
            ControlError::Limits { what: "output of the PID law", lower: 1.0, upper: -1.0 }
        );
        refused(|s| s.sample_time = -0.1);
        refused(|s| s.sample_time = f64::NAN);
        refused(|s| s.filter_time = -1.0);
        refused(|s| s.limits = [f64::NAN, 1.0]);
        refused(|s| s.gains.derivative = f64::NAN);
        refused(|s| s.anti_windup = AntiWindup::BackCalculation { time: 0.0 });
    }
}
