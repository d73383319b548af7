//! Convective heating at the stagnation point.

use apsides_ad::Scalar;

use crate::error::positive;
use crate::{DynamicsError, Quantity};

/// Heat flux at the stagnation point.
pub const HEAT_RATE: Quantity = Quantity::new("heat rate", "W/m2");
/// Heat taken up per area: the integral of the heat rate.
pub const HEAT_LOAD: Quantity = Quantity::new("heat load", "J/m2");

/// The law of the heat rate over density and speed, all in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeatingLaw {
    /// `k v^3 sqrt(rho)`, the nose radius being part of the constant.
    Stagnation {
        /// `k`, in units that make W/m2.
        constant: f64,
    },
    /// `k v^3 sqrt(rho / R)` with the nose radius `R` of the vehicle (K. Sutton and R. A. Graves, NASA TR R-376, 1971).
    SuttonGraves {
        /// `k`, in kg^(1/2)/m; a property of the gas.
        constant: f64,
    },
    /// `k rho^a v^b`.
    Power {
        /// `k`.
        constant: f64,
        /// `a`.
        density_exponent: f64,
        /// `b`.
        speed_exponent: f64,
    },
}

impl HeatingLaw {
    /// `1.294e-4 v^3 sqrt(rho)` of A. Alami Naeini and J. Roshanian, Modares Mechanical Engineering 14(13), 2014: that of Sutton and
    /// Graves at a nose radius of 1.81 m.
    pub const CAPSULE: Self = Self::Stagnation { constant: 1.294e-4 };
    /// Sutton and Graves in air: 1.7415e-4.
    pub const SUTTON_GRAVES_EARTH: Self = Self::SuttonGraves { constant: 1.7415e-4 };
    /// Sutton and Graves in the atmosphere of Mars: 1.9027e-4 (C. G. Justus and R. D. Braun, Atmospheric environments for entry, descent
    /// and landing (EDL), 5th International Planetary Probe Workshop, 2007).
    pub const SUTTON_GRAVES_MARS: Self = Self::SuttonGraves { constant: 1.9027e-4 };

    /// Passes a law on whose numbers make sense.
    ///
    /// # Errors
    /// When the constant is not positive and finite, or an exponent is not.
    pub fn checked(self) -> Result<Self, DynamicsError> {
        match self {
            Self::Stagnation { constant } | Self::SuttonGraves { constant } => {
                positive("constant of the heating law", constant, "-")?;
            }
            Self::Power { constant, density_exponent, speed_exponent } => {
                positive("constant of the heating law", constant, "-")?;
                positive("exponent of the density", density_exponent, "-")?;
                positive("exponent of the speed", speed_exponent, "-")?;
            }
        }
        Ok(self)
    }

    /// Heat rate, W/m2, from density (kg/m3), speed (m/s) and nose radius (m). The derivatives are infinite where the density is zero.
    #[inline]
    pub fn rate<S: Scalar>(&self, density: S, speed: S, nose_radius: f64) -> S {
        match *self {
            Self::Stagnation { constant } => speed.powi(3) * density.sqrt() * constant,
            Self::SuttonGraves { constant } => {
                speed.powi(3) * density.sqrt() * (constant / nose_radius.sqrt())
            }
            Self::Power { constant, density_exponent, speed_exponent } => {
                density.powf(density_exponent) * speed.powf(speed_exponent) * constant
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn laws_at_their_published_constants() {
        let (density, speed) = (3e-4, 6500.0_f64);
        let size = speed.powi(3) * density.sqrt();
        let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < ROUNDING, "{found}");
        near(HeatingLaw::CAPSULE.rate(density, speed, 3.36), 1.294e-4 * size);
        // 1.7415e-4 / sqrt(3.36), and the radius that makes 1.294e-4.
        near(HeatingLaw::SUTTON_GRAVES_EARTH.rate(density, speed, 3.36), 9.500661396149519e-5 * size);
        near(HeatingLaw::SUTTON_GRAVES_EARTH.rate(density, speed, 1.8112500268747207), 1.294e-4 * size);
        let power = HeatingLaw::Power { constant: 1.294e-4, density_exponent: 0.5, speed_exponent: 3.0 };
        near(power.rate(density, speed, 1.0), 1.294e-4 * size);
        assert_eq!(power.checked(), Ok(power));
        let refused = |law: HeatingLaw| law.checked().unwrap_err().to_string();
        assert!(
            refused(HeatingLaw::SuttonGraves { constant: f64::NAN }).starts_with("constant of the heating")
        );
        let negative = HeatingLaw::Power { constant: 1.0, density_exponent: 0.5, speed_exponent: -3.0 };
        assert!(refused(negative).starts_with("exponent of the speed is -3"));
    }
}
