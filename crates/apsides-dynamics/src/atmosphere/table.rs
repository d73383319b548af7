//! Atmospheres given as tables.

use apsides_ad::{Outside, Pchip, Scalar};

use super::Gas;
use crate::DynamicsError;

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
            Pchip::new(altitudes, values, outside).map_err(|_| short("altitude", altitudes.len()))
        };
        Ok(Self {
            log_density: table(&logarithms, Outside::Linear)?,
            temperature: table(temperatures, Outside::Constant)?,
            gas,
        })
    }

    /// The same at one temperature (K).
    ///
    /// # Errors
    /// As [`AtmosphereTable::new`].
    pub fn isothermal(
        altitudes: &[f64],
        densities: &[f64],
        temperature: f64,
        gas: Gas,
    ) -> Result<Self, DynamicsError> {
        Self::new(altitudes, densities, &vec![temperature; altitudes.len()], gas)
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

/// A refusal of a row, counted from 0.
fn row(what: &'static str, row: usize, reason: String) -> DynamicsError {
    DynamicsError::Table { what, row: row + 1, reason }
}

fn short(what: &'static str, rows: usize) -> DynamicsError {
    row(what, rows, format!("the table has {rows} rows, at least 2 are needed"))
}

/// Finite numbers, each above the one before it.
pub(crate) fn increasing(what: &'static str, column: &[f64]) -> Result<(), DynamicsError> {
    for (k, value) in column.iter().enumerate() {
        if !value.is_finite() {
            return Err(row(what, k, format!("{value} is not finite")));
        }
        if k > 0 && *value <= column[k - 1] {
            return Err(row(what, k, format!("{value} is not above {} of the row before", column[k - 1])));
        }
    }
    if column.len() < 2 { Err(short(what, column.len())) } else { Ok(()) }
}

/// As many finite positive numbers as there are rows.
pub(crate) fn positive_column(what: &'static str, column: &[f64], rows: usize) -> Result<(), DynamicsError> {
    finite_column(what, column, rows)?;
    match column.iter().position(|value| *value <= 0.0) {
        Some(k) => Err(row(what, k, format!("{} is not positive", column[k]))),
        None => Ok(()),
    }
}

/// As many finite numbers as there are rows.
pub(crate) fn finite_column(what: &'static str, column: &[f64], rows: usize) -> Result<(), DynamicsError> {
    if column.len() != rows {
        let reason = format!("{} values for {rows} rows", column.len());
        return Err(row(what, column.len().min(rows), reason));
    }
    match column.iter().position(|value| !value.is_finite()) {
        Some(k) => Err(row(what, k, format!("{} is not finite", column[k]))),
        None => Ok(()),
    }
}
