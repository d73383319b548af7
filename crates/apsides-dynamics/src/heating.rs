//! Convective heating at the stagnation point, and the temperature of a wall that radiates it.

use apsides_ad::Scalar;

use crate::error::positive;
use crate::{DynamicsError, Quantity};

/// Heat flux at the stagnation point.
pub const HEAT_RATE: Quantity = Quantity::new("heat rate", "W/m2");
/// Heat taken up per area: the integral of the heat rate.
pub const HEAT_LOAD: Quantity = Quantity::new("heat load", "J/m2");

/// Constant of Stefan and Boltzmann, W/(m2 K4) (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// How the heat rate follows from density and speed, all in SI.
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

/// Temperature (K) at which a wall of an emissivity radiates what it takes up (W/m2): `(q / (e sigma))^(1/4)`.
///
/// # Errors
/// When the heat rate is negative or not finite, or the emissivity is not in (0, 1].
pub fn equilibrium_wall_temperature(heat_rate: f64, emissivity: f64) -> Result<f64, DynamicsError> {
    let emissivity = positive("emissivity", emissivity, "-")?;
    if emissivity > 1.0 {
        let allowed = "above 0 and at most 1";
        return Err(DynamicsError::Parameter { what: "emissivity", value: emissivity, unit: "-", allowed });
    }
    if heat_rate >= 0.0 && heat_rate.is_finite() {
        Ok((heat_rate / (emissivity * STEFAN_BOLTZMANN)).powf(0.25))
    } else {
        let allowed = "a finite number not below 0";
        Err(DynamicsError::Parameter { what: "heat rate", value: heat_rate, unit: "W/m2", allowed })
    }
}
