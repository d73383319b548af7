//! Atmospheres: density, temperature, pressure and speed of sound as functions of the altitude, in SI units.
//!
//! Every function is generic in the scalar and defined at every altitude, so that an iteration may stray: what a model is beyond its
//! range, its documentation says. [`Atmosphere::state`] is the checked function of plain numbers, which refuses these altitudes.

use apsides_ad::Scalar;

use crate::DynamicsError;
use crate::engine::STANDARD_GRAVITY;
use crate::error::{finite, positive};

mod constants;
mod layers;
mod panels;
mod printed;
mod standard;
mod table;
mod thermosphere;

pub use table::AtmosphereTable;

/// A perfect gas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas {
    /// Gas constant, J/(kg K).
    pub constant: f64,
    /// Ratio of the specific heats.
    pub heat_ratio: f64,
}

impl Gas {
    /// Dry air of the US Standard Atmosphere 1976: 8314.32 J/(kmol K) by 28.9644 kg/kmol, and 1.4.
    pub const AIR: Self = Self { constant: 8314.32 / 28.9644, heat_ratio: 1.4 };
    /// The atmosphere of Mars: 8314.46 J/(kmol K) by 43.34 kg/kmol, and 1.29 (NASA Mars Fact Sheet; carbon dioxide at 230 K).
    pub const MARS: Self = Self { constant: 8314.46 / 43.34, heat_ratio: 1.29 };

    /// A gas of a gas constant (J/(kg K)) and a ratio of specific heats.
    ///
    /// # Errors
    /// When either is not finite, the constant not positive or the ratio not above 1.
    pub fn new(constant: f64, heat_ratio: f64) -> Result<Self, DynamicsError> {
        let constant = positive("gas constant", constant, "J/(kg K)")?;
        if heat_ratio > 1.0 && heat_ratio.is_finite() {
            return Ok(Self { constant, heat_ratio });
        }
        let (what, allowed) = ("ratio of the specific heats", "a finite number above 1");
        Err(DynamicsError::Parameter { what, value: heat_ratio, unit: "-", allowed })
    }

    /// Speed of sound at a temperature (K), m/s.
    #[inline]
    pub fn speed_of_sound<S: Scalar>(&self, temperature: S) -> S {
        (temperature * (self.heat_ratio * self.constant)).sqrt()
    }
}

/// A density that falls by a factor e with every scale height: the isothermal atmosphere in a uniform field.
///
/// The law holds above and below the reference altitude alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponential {
    /// Density at the reference altitude, kg/m3.
    pub reference_density: f64,
    /// Reference altitude, m.
    pub reference_altitude: f64,
    /// Scale height, m.
    pub scale_height: f64,
    /// The temperature, K.
    pub temperature: f64,
    /// The gas.
    pub gas: Gas,
}

impl Exponential {
    /// Model E of the capsule's reference: 1.225 kg/m3 at the surface of the Earth and 7200 m.
    pub const EARTH: Self = Self {
        reference_density: 1.225,
        reference_altitude: 0.0,
        scale_height: 7200.0,
        temperature: STANDARD_GRAVITY * 7200.0 / Gas::AIR.constant,
        gas: Gas::AIR,
    };

    /// Mars: 0.0158 kg/m3 at the surface and 9354.5 m (J. Benito and K. D. Mease, J. Guidance 33(3), 2010, doi 10.2514/1.47577).
    pub const MARS: Self = Self {
        reference_density: 0.0158,
        reference_altitude: 0.0,
        scale_height: 9354.5,
        temperature: 3.71 * 9354.5 / Gas::MARS.constant,
        gas: Gas::MARS,
    };

    /// A density (kg/m3) at an altitude (m), a scale height (m) and a gas, under a gravity (m/s2): hydrostatic equilibrium makes the
    /// temperature that gravity times the scale height by the gas constant.
    ///
    /// # Errors
    /// When the altitude is not finite or another value is not positive and finite.
    pub fn new(
        reference_density: f64,
        reference_altitude: f64,
        scale_height: f64,
        gas: Gas,
        gravity: f64,
    ) -> Result<Self, DynamicsError> {
        let reference_density = positive("reference density", reference_density, "kg/m3")?;
        let reference_altitude = finite("reference altitude", reference_altitude, "m")?;
        let scale_height = positive("scale height", scale_height, "m")?;
        let temperature = positive("gravity", gravity, "m/s2")? * scale_height / gas.constant;
        Ok(Self { reference_density, reference_altitude, scale_height, temperature, gas })
    }

    /// Density, kg/m3.
    #[inline]
    pub fn density<S: Scalar>(&self, altitude: S) -> S {
        ((altitude - self.reference_altitude) / -self.scale_height).exp() * self.reference_density
    }
}

/// An atmosphere.
#[derive(Clone, Debug, PartialEq)]
pub enum Atmosphere {
    /// None.
    Vacuum,
    /// One scale height; covers every altitude.
    Exponential(Exponential),
    /// The US Standard Atmosphere 1976 (NASA-TM-X-74335) of geometric altitudes, which covers -5 km to 1000 km.
    ///
    /// Up to 86 km its seven layers; above the density that follows from its equations of diffusion for six species, within 0.1 % of its
    /// printed table. The speed of sound, which the standard gives up to 86 km, goes on by the mean molar mass. Below its range the
    /// density and the temperature go on along their tangents; above it the temperature stays and the density falls with the last scale
    /// height.
    UsStandard1976,
    /// The same up to 86 km; above, up to 200 km, the standard's printed densities with straight lines between their logarithms, as many
    /// flight programs have it.
    UsStandard1976Printed,
    /// A table; covers its altitudes.
    Table(AtmosphereTable),
}

/// The state of an atmosphere at an altitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtmosphericState {
    /// Density, kg/m3.
    pub density: f64,
    /// Kinetic temperature, K.
    pub temperature: f64,
    /// Pressure, Pa.
    pub pressure: f64,
    /// Speed of sound, m/s.
    pub speed_of_sound: f64,
}

impl Atmosphere {
    /// Density, kg/m3, at an altitude (m).
    #[inline]
    pub fn density<S: Scalar>(&self, altitude: S) -> S {
        match self {
            Self::Vacuum => S::from(0.0),
            Self::Exponential(law) => law.density(altitude),
            Self::UsStandard1976 => altitude.map(standard::density),
            Self::UsStandard1976Printed => altitude.map(printed::density),
            Self::Table(table) => table.density(altitude),
        }
    }

    /// Kinetic temperature, K, at an altitude (m); 0 in the vacuum.
    #[inline]
    pub fn temperature<S: Scalar>(&self, altitude: S) -> S {
        match self {
            Self::Vacuum => S::from(0.0),
            Self::Exponential(law) => S::from(law.temperature),
            Self::UsStandard1976 | Self::UsStandard1976Printed => altitude.map(standard::temperature),
            Self::Table(table) => table.temperature(altitude),
        }
    }

    /// The gas, and the temperature that makes its equation of state hold: of a mixture that changes with altitude, the molecular one.
    #[inline]
    fn gas<S: Scalar>(&self, altitude: S) -> Option<(Gas, S)> {
        match self {
            Self::Vacuum => None,
            Self::Exponential(law) => Some((law.gas, S::from(law.temperature))),
            Self::UsStandard1976 | Self::UsStandard1976Printed => {
                Some((Gas::AIR, altitude.map(standard::molecular_temperature)))
            }
            Self::Table(table) => Some((table.gas(), table.temperature(altitude))),
        }
    }

    /// Pressure, Pa, at an altitude (m).
    #[inline]
    pub fn pressure<S: Scalar>(&self, altitude: S) -> S {
        match self.gas(altitude) {
            Some((gas, temperature)) => self.density(altitude) * temperature * gas.constant,
            None => S::from(0.0),
        }
    }

    /// Speed of sound, m/s, at an altitude (m); infinite in the vacuum, where every Mach number is zero.
    #[inline]
    pub fn speed_of_sound<S: Scalar>(&self, altitude: S) -> S {
        match self.gas(altitude) {
            Some((gas, temperature)) => gas.speed_of_sound(temperature),
            None => S::from(f64::INFINITY),
        }
    }

    /// [Density](Self::density), kg/m3, and [speed of sound](Self::speed_of_sound), m/s, at an altitude (m), for less than both one by one.
    #[inline(always)]
    pub fn density_and_sound<S: Scalar>(&self, altitude: S) -> [S; 2] {
        match self {
            Self::UsStandard1976 => altitude.map_all(|z| standard::density_and_sound(z, S::ORDER)),
            _ => [self.density(altitude), self.speed_of_sound(altitude)],
        }
    }

    /// Lowest and highest altitude that the model covers, m.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        match self {
            Self::Vacuum | Self::Exponential(_) => [f64::NEG_INFINITY, f64::INFINITY],
            Self::UsStandard1976 => [constants::BOTTOM, constants::TOP],
            Self::UsStandard1976Printed => [constants::BOTTOM, printed::TOP],
            Self::Table(table) => table.range(),
        }
    }

    /// Altitudes, m, in increasing order, at which a first derivative of the density or of the speed of sound jumps.
    #[must_use]
    pub fn kinks(&self) -> Vec<f64> {
        match self {
            Self::Vacuum | Self::Exponential(_) => Vec::new(),
            Self::UsStandard1976 => standard::kinks().collect(),
            Self::UsStandard1976Printed => printed::kinks().collect(),
            Self::Table(table) => table.range().to_vec(),
        }
    }

    /// The atmosphere at an altitude (m).
    ///
    /// # Errors
    /// When the altitude is not finite or not in the [range](Self::range) of the model.
    pub fn state(&self, altitude: f64) -> Result<AtmosphericState, DynamicsError> {
        let value = finite("altitude in the atmosphere", altitude, "m")?;
        let [lowest, highest] = self.range();
        if !(lowest..=highest).contains(&value) {
            let allowed = "the range of the model of the atmosphere";
            return Err(DynamicsError::Parameter {
                what: "altitude in the atmosphere",
                value,
                unit: "m",
                allowed,
            });
        }
        Ok(AtmosphericState {
            density: self.density(altitude),
            temperature: self.temperature(altitude),
            pressure: self.pressure(altitude),
            speed_of_sound: self.speed_of_sound(altitude),
        })
    }
}

#[cfg(test)]
mod tests;
