//! A nonlinear PID law: each term has a gain that depends on its argument, and a power of it.
//!
//! ```text
//! u = f(e; P) + f(integral of e; I) + f(e'; D),   f(b; K) = (k1 + k2 / (1 + exp(mu b^2))) |b|^epsilon sign(b)
//! ```
//!
//! with four coefficients a term, twelve an axis. For `k2 = 0`, `epsilon = 1` it is the linear law. Source: A. A. Najm, I. K. Ibraheem,
//! *Eng. Sci. Technol. Int. J.* 22 (2019) 1087, doi 10.1016/j.jestch.2019.02.005.

use crate::error::{ControlError, finite, positive};
use crate::pid::{ErrorMemory, PidGains, PidLaw, Terms};

/// Coefficients of one term, a function of its argument `b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermGain {
    /// Gain far from zero, `k1`.
    pub far: f64,
    /// `k2`: half of it is added at zero.
    pub near: f64,
    /// `mu`: how fast the second part fades, 1 over the square of the argument; not negative.
    pub steepness: f64,
    /// `epsilon`: power of the argument; positive.
    pub power: f64,
}

impl TermGain {
    /// The linear term.
    #[must_use]
    pub fn linear(gain: f64) -> Self {
        Self { far: gain, near: 0.0, steepness: 0.0, power: 1.0 }
    }

    /// The term at the argument `b`.
    #[must_use]
    pub fn term(&self, b: f64) -> f64 {
        if b == 0.0 { 0.0 } else { self.factor(b) * b.abs().powf(self.power).copysign(b) }
    }

    /// The term over its argument, the gain of a linear law that gives the same at the amplitude `b`, which is not zero.
    #[must_use]
    pub fn secant(&self, b: f64) -> f64 {
        self.factor(b) * b.abs().powf(self.power - 1.0)
    }

    fn factor(&self, b: f64) -> f64 {
        self.far + self.near / (1.0 + (self.steepness * b * b).exp())
    }

    fn checked(&self) -> Result<(), ControlError> {
        finite("k1 of a nonlinear gain", self.far)?;
        finite("k2 of a nonlinear gain", self.near)?;
        crate::error::not_negative("mu of a nonlinear gain", self.steepness)?;
        positive("epsilon of a nonlinear gain", self.power).map(|_| ())
    }
}

/// The coefficients of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonlinearGains {
    /// The gain of the error.
    pub proportional: TermGain,
    /// The gain of the integral of the error.
    pub integral: TermGain,
    /// The gain of the rate of the error.
    pub derivative: TermGain,
}

impl NonlinearGains {
    /// From twelve numbers: `k1, k2, mu, epsilon` of the error, of its integral, of its rate.
    #[must_use]
    pub fn from_coefficients(c: &[f64; 12]) -> Self {
        let term = |k: usize| TermGain { far: c[k], near: c[k + 1], steepness: c[k + 2], power: c[k + 3] };
        Self { proportional: term(0), integral: term(4), derivative: term(8) }
    }

    /// The linear law.
    #[must_use]
    pub fn linear(gains: PidGains) -> Self {
        Self {
            proportional: TermGain::linear(gains.proportional),
            integral: TermGain::linear(gains.integral),
            derivative: TermGain::linear(gains.derivative),
        }
    }

    /// Gains of the linear law that gives the same at these amplitudes, none of them zero: what a linear analysis is made with.
    #[must_use]
    pub fn secant(&self, error: f64, integral: f64, rate: f64) -> PidGains {
        PidGains::new(
            self.proportional.secant(error),
            self.integral.secant(integral),
            self.derivative.secant(rate),
        )
    }
}

/// A nonlinear PID law with its memory: differences and integral as in [`crate::pid`], conditional integration at the limits.
pub type NonlinearPid = PidLaw<NonlinearGains>;

impl NonlinearPid {
    /// The law with empty memory; sample and filter time in s.
    ///
    /// # Errors
    /// [`ControlError::Parameter`], [`ControlError::Limits`]: coefficients that are not finite, `mu` negative, `epsilon` not
    /// positive, times and limits as for [`crate::pid::Pid::new`].
    pub fn new(
        gains: NonlinearGains,
        sample_time: f64,
        filter_time: f64,
        limits: [f64; 2],
    ) -> Result<Self, ControlError> {
        for term in [&gains.proportional, &gains.integral, &gains.derivative] {
            term.checked()?;
        }
        Self::of_terms(gains, limits, sample_time, filter_time)
    }
}

impl Terms for NonlinearGains {
    fn output(&self, memory: &ErrorMemory) -> f64 {
        self.proportional.term(memory.error())
            + self.integral.term(memory.integral())
            + self.derivative.term(memory.derivative())
    }

    /// A sample that drove the output further beyond its limit is taken out of the integral.
    fn correct(&self, memory: &mut ErrorMemory, excess: f64) {
        let added = self.integral.term(memory.integral()) - self.integral.term(memory.integral_before());
        if added * excess > 0.0 {
            memory.undo_integration();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pid::{Pid, PidSettings};

    /// A few operations on doubles.
    const ROUNDING: f64 = 1e-14;

    const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    #[test]
    fn term_by_hand() {
        // (1 + 4 / (1 + e^(0.5 * 4))) * 2^0.5
        let gain = TermGain { far: 1.0, near: 4.0, steepness: 0.5, power: 0.5 };
        let expected = (1.0 + 4.0 / (1.0 + 2.0_f64.exp())) * 2.0_f64.sqrt();
        assert!((gain.term(2.0) - expected).abs() < ROUNDING);
        assert!((gain.term(-2.0) + expected).abs() < ROUNDING);
        assert!((gain.secant(2.0) * 2.0 - expected).abs() < ROUNDING);
        assert_eq!(gain.term(0.0), 0.0);
        // The exponential overflows to the far gain, not to NaN.
        assert!((gain.term(1e4) - 100.0).abs() < 100.0 * ROUNDING);
    }

    #[test]
    fn linear_coefficients_give_the_linear_law() {
        let gains = PidGains::new(10.0, 5.0, 4.0);
        let twelve = [10.0, 0.0, 0.0, 1.0, 5.0, 0.0, 0.0, 1.0, 4.0, 0.0, 0.0, 1.0];
        let nonlinear = NonlinearGains::from_coefficients(&twelve);
        assert_eq!(nonlinear, NonlinearGains::linear(gains));
        assert_eq!(nonlinear.secant(0.1, 2.0, 3.0), gains);
        let limits = [-0.7, 0.7];
        let mut law = NonlinearPid::new(nonlinear, 0.01, 0.02, limits).unwrap();
        let mut linear =
            Pid::new(PidSettings { filter_time: 0.02, limits, ..PidSettings::new(gains, 0.01) }).unwrap();
        for k in 0..3000 {
            let error = 0.2 * (0.01 * f64::from(k)).sin();
            assert!((law.update(error) - linear.update(error)).abs() < 100.0 * ROUNDING);
        }
        assert!((law.integral() - linear.integral()).abs() < 100.0 * ROUNDING);
    }

    #[test]
    fn refusals_and_nan() {
        let good = NonlinearGains::linear(PidGains::new(1.0, 1.0, 1.0));
        let with = |far, near, steepness, power| NonlinearGains {
            integral: TermGain { far, near, steepness, power },
            ..good
        };
        for bad in [
            with(f64::NAN, 0.0, 0.0, 1.0),
            with(1.0, f64::INFINITY, 0.0, 1.0),
            with(1.0, 1.0, -1.0, 1.0),
            with(1.0, 1.0, 1.0, 0.0),
        ] {
            assert!(matches!(NonlinearPid::new(bad, 0.1, 0.0, FREE), Err(ControlError::Parameter { .. })));
        }
        assert!(NonlinearPid::new(good, 0.0, 0.0, FREE).is_err());
        assert!(matches!(
            NonlinearPid::new(good, 0.1, 0.0, [1.0, 0.0]),
            Err(ControlError::Limits { lower: 1.0, upper: 0.0, .. })
        ));
        let mut law = NonlinearPid::new(good, 0.1, 0.0, FREE).unwrap();
        assert!(law.update(f64::NAN).is_nan());
        assert_eq!(law.integral(), 0.0);
        law.update(1.0);
        law.reset();
        assert_eq!(law, NonlinearPid::new(good, 0.1, 0.0, FREE).unwrap());
    }
}
