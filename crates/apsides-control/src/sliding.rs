//! A sliding-mode law with a boundary layer for an axis `e'' = f + b u` of which `f` and `b` are known roughly.
//!
//! With the surface `s = e' + lambda e`, an estimate `f0` of `f` with `|f - f0| <= F` and `b0` of `b` with `1/beta <= b/b0 <= beta`:
//!
//! ```text
//! u = (v - k sat(s / width)) / b0,   v = -f0 - lambda e',   k = beta (F + eta) + (beta - 1) |v|
//! ```
//!
//! Outside the layer `|s| <= width` the distance to it shrinks at least at the rate `eta`; inside the law is continuous, and the error stays
//! within `width / lambda`. J.-J. E. Slotine, S. S. Sastry, *Int. J. Control* 38 (1983) 465, doi 10.1080/00207178308933088; gain bounds:
//! J.-J. E. Slotine, W. Li, *Applied Nonlinear Control*, Prentice-Hall 1991, section 7.1.

use crate::error::{ControlError, finite, not_negative, positive};

/// A sliding-mode law of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlidingMode {
    /// Bandwidth of the surface, 1/s.
    pub lambda: f64,
    /// Rate at which the surface is reached, unit of the error / s^2.
    pub reaching: f64,
    /// Largest error of the estimated acceleration, unit of the error / s^2.
    pub uncertainty: f64,
    /// `b0`, acceleration per control; not zero, its sign is that of `b`.
    pub effectiveness: f64,
    /// `beta`: largest factor between `b` and `b0`, at least 1.
    pub effectiveness_factor: f64,
    /// Half the thickness of the boundary layer, unit of the error / s.
    pub boundary: f64,
}

impl SlidingMode {
    /// Passes a law on whose numbers are in range.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] otherwise.
    pub fn checked(self) -> Result<Self, ControlError> {
        positive("bandwidth of the sliding surface", self.lambda)?;
        positive("reaching rate", self.reaching)?;
        not_negative("uncertainty of the acceleration", self.uncertainty)?;
        positive("boundary layer", self.boundary)?;
        finite("control effectiveness", self.effectiveness)?;
        positive("magnitude of the control effectiveness", self.effectiveness.abs())?;
        if !(self.effectiveness_factor >= 1.0 && self.effectiveness_factor.is_finite()) {
            let value = self.effectiveness_factor;
            return Err(ControlError::Parameter {
                what: "factor of effectiveness",
                value,
                allowed: "at least 1",
            });
        }
        Ok(self)
    }

    /// `s = e' + lambda e`.
    #[must_use]
    pub fn surface(&self, error: f64, rate: f64) -> f64 {
        rate + self.lambda * error
    }

    /// The control at an error, its rate and the estimated acceleration `f0` without control, for a reference at rest.
    #[must_use]
    pub fn control(&self, error: f64, rate: f64, acceleration: f64) -> f64 {
        let equivalent = -acceleration - self.lambda * rate;
        let beta = self.effectiveness_factor;
        let k = beta * (self.uncertainty + self.reaching) + (beta - 1.0) * equivalent.abs();
        let saturated = (self.surface(error, rate) / self.boundary).clamp(-1.0, 1.0);
        (equivalent - k * saturated) / self.effectiveness
    }

    /// Largest error once the layer is reached: `width / lambda`.
    ///
    /// # Examples
    /// ```
    /// use apsides_control::sliding::SlidingMode;
    ///
    /// // An error of 0.1 rad may stay: half the layer is 0.2 rad/s thick.
    /// let law = SlidingMode {
    ///     lambda: 2.0,
    ///     reaching: 1.0,
    ///     uncertainty: 0.5,
    ///     effectiveness: 1.0,
    ///     effectiveness_factor: 1.2,
    ///     boundary: 0.2,
    /// }
    /// .checked()?;
    /// assert_eq!(law.error_bound(), 0.1);
    /// # Ok::<(), apsides_control::ControlError>(())
    /// ```
    #[must_use]
    pub fn error_bound(&self) -> f64 {
        self.boundary / self.lambda
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    const LAW: SlidingMode = SlidingMode {
        lambda: 4.0,
        reaching: 0.5,
        uncertainty: 2.0,
        effectiveness: 3.0,
        effectiveness_factor: 1.5,
        boundary: 0.1,
    };

    #[test]
    fn control_by_hand() {
        // s = 1 + 4*0.5 = 3, beyond the layer; v = -1 - 4 = -5; k = 1.5*2.5 + 0.5*5 = 6.25; u = (-5 - 6.25)/3.
        assert!((LAW.control(0.5, 1.0, 1.0) + 3.75).abs() < ROUNDING);
        // s = 0.05, half the layer, at rest: k = 3.75.
        assert!((LAW.control(0.0125, 0.0, 0.0) + 0.625).abs() < ROUNDING);
        assert_eq!(LAW.error_bound(), 0.025);
    }

    #[test]
    fn reaches_the_layer_in_time_and_stays_within_the_bound() {
        // The worst disturbance that is admitted, and effectiveness at both ends of its range.
        for (b, wave) in [(4.5, 1.0), (2.0, 7.0), (2.0, 0.0)] {
            let (mut e, mut v) = (1.0, 0.0);
            let dt = 1e-4;
            let reach_time = (LAW.surface(e, v) - LAW.boundary) / LAW.reaching;
            let mut reached = f64::INFINITY;
            for k in 0..200_000 {
                let t = dt * f64::from(k);
                let f = 2.0 * (wave * t).cos();
                if LAW.surface(e, v).abs() <= LAW.boundary {
                    reached = reached.min(t);
                }
                v += dt * (f + b * LAW.control(e, v, 0.0));
                e += dt * v;
                // Within the layer the error decays to the bound with the time constant 1/lambda.
                if t > reached + 3.0 {
                    assert!(e.abs() <= LAW.error_bound() * 1.001, "{t} {e}");
                }
            }
            assert!(reached <= reach_time, "{reached} {reach_time}");
        }
    }

    #[test]
    fn refusals() {
        assert!(LAW.checked().is_ok());
        for bad in [
            SlidingMode { lambda: 0.0, ..LAW },
            SlidingMode { boundary: 0.0, ..LAW },
            SlidingMode { reaching: -1.0, ..LAW },
            SlidingMode { uncertainty: f64::NAN, ..LAW },
            SlidingMode { effectiveness: 0.0, ..LAW },
            SlidingMode { effectiveness_factor: 0.9, ..LAW },
        ] {
            assert!(matches!(bad.checked(), Err(ControlError::Parameter { .. })));
        }
    }
}
