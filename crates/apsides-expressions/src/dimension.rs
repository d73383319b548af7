//! Dimensions: exponents of the base units of the SI.

use std::fmt;
use std::ops::{Div, Mul};

/// The base units in the order of the exponents. An angle has none: a radian is one.
const BASE: [&str; 6] = ["m", "kg", "s", "K", "A", "mol"];

/// Exponents nearer than this are one: roots of roots are not exact.
const NEAR: f64 = 1e-9;

/// The dimension of a quantity: the exponents of m, kg, s, K, A and mol. They may be fractions, as after a square root.
#[derive(Clone, Copy, Debug)]
pub struct Dimension([f64; BASE.len()]);

impl Dimension {
    /// The dimension of a pure number.
    pub const NONE: Self = Self([0.0; BASE.len()]);
    /// The dimension of a length.
    pub const LENGTH: Self = Self([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    /// The dimension of a mass.
    pub const MASS: Self = Self([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    /// The dimension of a time.
    pub const TIME: Self = Self([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);

    /// Exponents of m, kg, s, K, A and mol.
    #[must_use]
    pub const fn new(exponents: [f64; 6]) -> Self {
        Self(exponents)
    }

    /// Returns true for that of a pure number.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Equal for equal dimensions: what a map may compare.
    pub(crate) fn bits(&self) -> [u64; 6] {
        self.0.map(|e| ((e / NEAR).round() * NEAR + 0.0).to_bits())
    }

    /// The dimension of a power.
    #[must_use]
    pub fn power(self, exponent: f64) -> Self {
        Self(self.0.map(|e| e * exponent))
    }
}

impl PartialEq for Dimension {
    fn eq(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(a, b)| (a - b).abs() <= NEAR)
    }
}

impl Mul for Dimension {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Div for Dimension {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl fmt::Display for Dimension {
    /// In base units, `kg m2/s3`; `1` for a pure number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let factor = |(name, e): (&&str, f64)| match e {
            1.0 => (*name).to_owned(),
            e if (e - e.round()).abs() <= NEAR => format!("{name}{}", e.round()),
            e => format!("{name}^{}", (e * 1e6).round() / 1e6),
        };
        let list = |sign: f64| -> Vec<String> {
            let signed = BASE.iter().zip(self.0).map(|(name, e)| (name, e * sign));
            // Mass first, as in J = kg m2/s2.
            let mut factors: Vec<_> = signed.filter(|(_, e)| *e > NEAR).collect();
            factors.sort_by_key(|(name, _)| **name != "kg");
            factors.into_iter().map(factor).collect()
        };
        let (above, below) = (list(1.0), list(-1.0));
        let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match below.len() {
            0 => f.write_str(&above),
            1 => write!(f, "{above}/{}", below[0]),
            _ => write!(f, "{above}/({})", below.join(" ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_are_written_in_base_units() {
        let power = Dimension::MASS * Dimension::LENGTH.power(2.0) / Dimension::TIME.power(3.0);
        assert_eq!(power.to_string(), "kg m2/s3");
        assert_eq!(Dimension::NONE.to_string(), "1");
        assert_eq!((Dimension::NONE / Dimension::TIME).to_string(), "1/s");
        assert_eq!(
            (Dimension::MASS.power(0.5) / (Dimension::LENGTH * Dimension::TIME)).to_string(),
            "kg^0.5/(m s)"
        );
        assert_eq!(Dimension::LENGTH.power(1.0 / 3.0).power(3.0), Dimension::LENGTH);
    }
}
