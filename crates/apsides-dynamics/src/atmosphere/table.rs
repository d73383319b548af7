//! Atmospheres given as tables.

use apsides_ad::{Outside, Pchip, Scalar};

use super::Gas;
use crate::DynamicsError;
use crate::error::{increasing, positive_column, short};

/// An atmosphere given as a table of densities and temperatures.
///
/// The logarithm of the density is a [shape-preserving cubic](Pchip), so that a density that falls in the table falls everywhere, and
/// goes on with the last scale height beyond the ends; the temperature is one too, constant beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct AtmosphereTable {
    log_density: Pchip,
    temperature: Pchip,
    gas: Gas,
}

/// Largest size of a logarithm of a density: what goes beyond it stays there, finite.
const LIMIT: f64 = 300.0;

impl AtmosphereTable {
    /// A table of densities (kg/m3) and temperatures (K) at altitudes (m) that increase, at least two, of a gas.
    ///
    /// # Errors
    /// When a number is not finite, a density or temperature not positive, or an altitude not above the one before it: names the quantity
    /// and the row, counted from 1. When the columns differ in length or have fewer than two rows.
    pub fn new(
        altitudes: &[f64],
        densities: &[f64],
        temperatures: &[f64],
        gas: Gas,
    ) -> Result<Self, DynamicsError> {
        increasing("altitude", altitudes)?;
        positive_column("density", densities, altitudes.len())?;
        positive_column("temperature", temperatures, altitudes.len())?;
        let logarithms: Vec<f64> = densities.iter().map(|d| d.ln()).collect();
        let table = |values: &[f64], outside| {
            Pchip::new(altitudes, values, outside).map_err(|_| short("altitude", altitudes.len(), 2))
        };
        Ok(Self {
            log_density: table(&logarithms, Outside::Linear)?,
            temperature: table(temperatures, Outside::Constant)?,
            gas,
        })
    }

    /// Density, kg/m3.
    #[inline]
    pub fn density<S: Scalar>(&self, altitude: S) -> S {
        altitude.map(|z| {
            let [l, l1, l2] = self.log_density.derivatives(z);
            if l.abs() > LIMIT {
                return [LIMIT.copysign(l).exp(), 0.0, 0.0];
            }
            let rho = l.exp();
            [rho, rho * l1, rho * (l2 + l1 * l1)]
        })
    }

    /// Temperature, K.
    #[inline]
    pub fn temperature<S: Scalar>(&self, altitude: S) -> S {
        self.temperature.at(altitude)
    }

    /// The gas.
    #[must_use]
    pub fn gas(&self) -> Gas {
        self.gas
    }

    /// Lowest and highest altitude of the table, m.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let altitudes = self.log_density.knots();
        [altitudes[0], altitudes[altitudes.len() - 1]]
    }
}
