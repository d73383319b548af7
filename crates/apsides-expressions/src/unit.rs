//! Units: `m/s2`, `kN`, `J/(kg K)`, each a factor to the coherent SI unit of its dimension.
//!
//! Factors are those of the BIPM's SI brochure (2019) and of NIST Special Publication 811 (2008), appendix B.

use std::fmt;

use crate::dimension::Dimension;
use crate::suggestion::suggested_name;

/// A unit: `1 unit = factor` in the coherent SI unit of its dimension.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Size in the coherent SI unit.
    pub factor: f64,
    /// Dimension.
    pub dimension: Dimension,
    text: String,
    coherent: String,
}

/// The reasons for which a text is no unit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct UnitError {
    /// The first byte of the mistake in the text.
    pub offset: usize,
    /// The mistake, and what is allowed.
    pub reason: String,
}

/// Name, factor, exponents of m, kg, s, K, A, mol, and the coherent SI unit in its place.
type Row = (&'static str, f64, [i8; 6], &'static str);

const LENGTH: [i8; 6] = [1, 0, 0, 0, 0, 0];
const MASS: [i8; 6] = [0, 1, 0, 0, 0, 0];
const TIME: [i8; 6] = [0, 0, 1, 0, 0, 0];
const NUMBER: [i8; 6] = [0; 6];
const FORCE: [i8; 6] = [1, 1, -2, 0, 0, 0];
const PRESSURE: [i8; 6] = [-1, 1, -2, 0, 0, 0];
const ENERGY: [i8; 6] = [2, 1, -2, 0, 0, 0];
const POWER: [i8; 6] = [2, 1, -3, 0, 0, 0];
const RATE: [i8; 6] = [0, 0, -1, 0, 0, 0];
const SPEED: [i8; 6] = [1, 0, -1, 0, 0, 0];
const FLUX_DENSITY: [i8; 6] = [0, 1, -2, 0, -1, 0];

const PI: f64 = std::f64::consts::PI;

/// The units that are known by name.
const UNITS: &[Row] = &[
    ("m", 1.0, LENGTH, "m"),
    ("km", 1e3, LENGTH, "m"),
    ("cm", 1e-2, LENGTH, "m"),
    ("mm", 1e-3, LENGTH, "m"),
    ("um", 1e-6, LENGTH, "m"),
    ("inch", 0.0254, LENGTH, "m"),
    ("ft", 0.3048, LENGTH, "m"),
    ("nmi", 1852.0, LENGTH, "m"),
    ("mi", 1609.344, LENGTH, "m"),
    ("au", 149_597_870_700.0, LENGTH, "m"),
    ("AU", 149_597_870_700.0, LENGTH, "m"),
    ("kt", 1852.0 / 3600.0, SPEED, "(m/s)"),
    ("kn", 1852.0 / 3600.0, SPEED, "(m/s)"),
    ("kg", 1.0, MASS, "kg"),
    ("t", 1e3, MASS, "kg"),
    ("tonne", 1e3, MASS, "kg"),
    ("lb", 0.453_592_37, MASS, "kg"),
    ("lbm", 0.453_592_37, MASS, "kg"),
    ("slug", 0.453_592_37 * 9.80665 / 0.3048, MASS, "kg"),
    ("s", 1.0, TIME, "s"),
    ("sec", 1.0, TIME, "s"),
    ("us", 1e-6, TIME, "s"),
    ("ms", 1e-3, TIME, "s"),
    ("min", 60.0, TIME, "s"),
    ("h", 3600.0, TIME, "s"),
    ("hr", 3600.0, TIME, "s"),
    ("d", 86_400.0, TIME, "s"),
    ("day", 86_400.0, TIME, "s"),
    ("yr", 365.25 * 86_400.0, TIME, "s"),
    ("K", 1.0, [0, 0, 0, 1, 0, 0], "K"),
    ("A", 1.0, [0, 0, 0, 0, 1, 0], "A"),
    ("V", 1.0, [2, 1, -3, 0, -1, 0], "V"),
    ("T", 1.0, FLUX_DENSITY, "T"),
    ("uT", 1e-6, FLUX_DENSITY, "T"),
    ("nT", 1e-9, FLUX_DENSITY, "T"),
    ("mol", 1.0, [0, 0, 0, 0, 0, 1], "mol"),
    ("rad", 1.0, NUMBER, "rad"),
    ("deg", PI / 180.0, NUMBER, "rad"),
    ("arcmin", PI / 10_800.0, NUMBER, "rad"),
    ("arcsec", PI / 648_000.0, NUMBER, "rad"),
    ("mas", PI / 648_000_000.0, NUMBER, "rad"),
    ("mrad", 1e-3, NUMBER, "rad"),
    ("urad", 1e-6, NUMBER, "rad"),
    ("rev", 2.0 * PI, NUMBER, "rad"),
    ("N", 1.0, FORCE, "N"),
    ("kN", 1e3, FORCE, "N"),
    ("mN", 1e-3, FORCE, "N"),
    ("uN", 1e-6, FORCE, "N"),
    ("MN", 1e6, FORCE, "N"),
    ("lbf", 0.453_592_37 * 9.80665, FORCE, "N"),
    ("kgf", 9.80665, FORCE, "N"),
    ("Nm", 1.0, ENERGY, "(N m)"),
    ("Pa", 1.0, PRESSURE, "Pa"),
    ("hPa", 1e2, PRESSURE, "Pa"),
    ("kPa", 1e3, PRESSURE, "Pa"),
    ("MPa", 1e6, PRESSURE, "Pa"),
    ("GPa", 1e9, PRESSURE, "Pa"),
    ("psi", 0.453_592_37 * 9.80665 / (0.0254 * 0.0254), PRESSURE, "Pa"),
    ("atm", 101_325.0, PRESSURE, "Pa"),
    ("bar", 1e5, PRESSURE, "Pa"),
    ("J", 1.0, ENERGY, "J"),
    ("kJ", 1e3, ENERGY, "J"),
    ("MJ", 1e6, ENERGY, "J"),
    ("Wh", 3600.0, ENERGY, "J"),
    ("kWh", 3.6e6, ENERGY, "J"),
    ("W", 1.0, POWER, "W"),
    ("kW", 1e3, POWER, "W"),
    ("MW", 1e6, POWER, "W"),
    ("mW", 1e-3, POWER, "W"),
    ("hp", 550.0 * 0.453_592_37 * 9.80665 * 0.3048, POWER, "W"),
    ("Hz", 1.0, RATE, "Hz"),
    ("kHz", 1e3, RATE, "Hz"),
    ("rpm", 2.0 * PI / 60.0, RATE, "(rad/s)"),
    ("g0", 9.80665, [1, 0, -2, 0, 0, 0], "(m/s2)"),
    ("percent", 1e-2, NUMBER, "1"),
    ("1", 1.0, NUMBER, "1"),
];

/// Names that could be two units, or one that is no multiple of another.
const MISTAKEN: &[(&str, &str)] = &[
    ("g", "write `g0` for 9.80665 m/s2, `kg` for masses"),
    ("nm", "write `nmi` for nautical miles, `m` for lengths as small as nanometres"),
    ("C", "temperatures are in `K`, charges in `A s`"),
    ("degC", "temperatures are in `K`"),
    ("degF", "temperatures are in `K`"),
    ("ton", "write `t` for 1000 kg"),
    ("year", "write `yr` for 365.25 days"),
    ("in", "write `inch`"),
];

impl Unit {
    /// The unit of a pure number, `-`.
    #[must_use]
    pub fn none() -> Self {
        Self { factor: 1.0, dimension: Dimension::NONE, text: "-".into(), coherent: "-".into() }
    }

    /// The second.
    #[must_use]
    pub fn second() -> Self {
        Self { factor: 1.0, dimension: Dimension::TIME, text: "s".into(), coherent: "s".into() }
    }

    /// The unit of the rate of a quantity: `deg/s` of `deg`.
    #[must_use]
    pub fn per_second(&self) -> Self {
        let of = |text: &str| format!("{}/s", if text == "-" { "1" } else { text });
        let dimension = self.dimension / Dimension::TIME;
        Self { factor: self.factor, dimension, text: of(&self.text), coherent: of(&self.coherent) }
    }

    /// Reads a unit: names with exponents, joined by `/`, `*` or a space, and parentheses. An exponent follows its name, with or without
    /// `^`: `m/s2`, `kg m^2/s^2`, `J/(kg K)`. A `-` alone is that of a pure number.
    ///
    /// # Errors
    /// A name that is not known, `J/kg K`, which may be read in two ways, and what is no unit at all.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        let trimmed = text.trim();
        if trimmed == "-" || trimmed.is_empty() {
            return Ok(Self::none());
        }
        let mut reader = Reader { text, at: 0, depth: 0 };
        let unit = reader.product()?;
        reader.spaces();
        if reader.at < text.len() {
            return Err(reader.fail(format!("`{}` cannot follow a unit here", &text[reader.at..])));
        }
        let coherent = unit.coherent.trim();
        let alone = coherent.strip_prefix('(').and_then(|c| c.strip_suffix(')')).filter(|c| !c.contains('('));
        let coherent = alone.unwrap_or(coherent).to_owned();
        Ok(Self { text: trimmed.to_owned(), coherent, ..unit })
    }

    /// The text of the coherent SI unit: `m/s` of `km/h`.
    #[must_use]
    pub fn coherent(&self) -> &str {
        &self.coherent
    }

    /// The coherent SI unit of a dimension, in base units.
    #[must_use]
    pub fn coherent_of(dimension: Dimension) -> Self {
        let text = if dimension.is_none() { "-".to_owned() } else { dimension.to_string() };
        Self { factor: 1.0, dimension, text: text.clone(), coherent: text }
    }

    /// Names of all units.
    pub fn names() -> impl Iterator<Item = &'static str> {
        UNITS.iter().map(|row| row.0)
    }

    fn over(self, other: Self) -> Self {
        Self { factor: self.factor / other.factor, dimension: self.dimension / other.dimension, ..self }
    }

    fn times(self, other: Self) -> Self {
        Self { factor: self.factor * other.factor, dimension: self.dimension * other.dimension, ..self }
    }

    fn power(self, e: f64) -> Self {
        Self { factor: self.factor.powf(e), dimension: self.dimension.power(e), ..self }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Exponents as they are written above a line, in the order of `-0123456789`.
const SUPERSCRIPTS: &str = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹";

/// Parentheses in parentheses: nobody writes more.
const DEEPEST: usize = 16;

struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl Reader<'_> {
    fn fail(&self, reason: impl Into<String>) -> UnitError {
        UnitError { offset: self.at, reason: reason.into() }
    }

    fn peek(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    fn spaces(&mut self) {
        self.skip(char::is_whitespace);
    }

    /// Skips characters, and returns those that were skipped.
    fn skip(&mut self, those: impl Fn(char) -> bool) -> &str {
        let rest = &self.text[self.at..];
        let length = rest.find(|c| !those(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// Factors with `*`, `/` and spaces between them.
    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut product = self.factor()?;
        let mut divided = false;
        loop {
            let before = self.at;
            self.spaces();
            let spaced = self.at > before;
            match self.peek() {
                Some('/') => {
                    self.at += 1;
                    self.spaces();
                    let factor = self.factor()?;
                    let coherent = format!("{}/{}", product.coherent, factor.coherent);
                    product = Unit { coherent, ..product.over(factor) };
                    divided = true;
                }
                Some(c @ ('*' | '·')) => {
                    self.at += c.len_utf8();
                    self.spaces();
                    let factor = self.factor()?;
                    let coherent = format!("{}*{}", product.coherent, factor.coherent);
                    product = Unit { coherent, ..product.times(factor) };
                }
                Some(c) if spaced && c != ')' => {
                    if divided {
                        let reason = "a product after `/` may be read in two ways: put it in parentheses, as in `J/(kg K)`";
                        return Err(self.fail(reason));
                    }
                    let factor = self.factor()?;
                    let coherent = format!("{} {}", product.coherent, factor.coherent);
                    product = Unit { coherent, ..product.times(factor) };
                }
                _ => return Ok(product),
            }
        }
    }

    /// A name or a product in parentheses, with its exponent.
    fn factor(&mut self) -> Result<Unit, UnitError> {
        let base = match self.peek() {
            Some('(') => {
                self.depth += 1;
                if self.depth > DEEPEST {
                    return Err(self.fail(format!("parentheses of a unit are nested deeper than {DEEPEST}")));
                }
                self.at += 1;
                self.spaces();
                let inner = self.product()?;
                if self.peek() != Some(')') {
                    return Err(self.fail("`)` is missing in a unit"));
                }
                self.at += 1;
                self.depth -= 1;
                Unit { coherent: format!("({})", inner.coherent), ..inner }
            }
            Some('1') => {
                self.at += 1;
                return Ok(Unit { coherent: "1".into(), ..Unit::none() });
            }
            Some('%') => {
                self.at += 1;
                Unit { factor: 1e-2, coherent: "1".into(), ..Unit::none() }
            }
            Some(c) if c.is_alphabetic() => self.name()?,
            Some(c) => return Err(self.fail(format!("a unit cannot begin with `{c}`"))),
            None => return Err(self.fail("a unit is missing")),
        };
        self.exponent(base)
    }

    fn name(&mut self) -> Result<Unit, UnitError> {
        let start = self.at;
        // `g0` is the one name with a digit.
        let name = if self.text[start..].starts_with("g0") {
            self.at += 2;
            "g0".to_owned()
        } else {
            self.skip(char::is_alphabetic).to_owned()
        };
        // Both signs of micro, beside the letter that keyboards have.
        let name = name.replace(['µ', 'μ'], "u");
        if let Some((_, meant)) = MISTAKEN.iter().find(|(written, _)| *written == name) {
            return Err(UnitError { offset: start, reason: format!("`{name}` is no unit here: {meant}") });
        }
        let Some((_, factor, exponents, coherent)) = UNITS.iter().find(|row| row.0 == name) else {
            let names: Vec<&str> = Unit::names().collect();
            let reason = format!("no unit is named `{name}`{}", suggested_name(&name, "units", &names));
            return Err(UnitError { offset: start, reason });
        };
        let dimension = Dimension::new(exponents.map(f64::from));
        Ok(Unit { factor: *factor, dimension, text: String::new(), coherent: (*coherent).to_owned() })
    }

    fn exponent(&mut self, base: Unit) -> Result<Unit, UnitError> {
        let start = self.at;
        let raised = self.skip(|c| SUPERSCRIPTS.contains(c)).to_owned();
        if !raised.is_empty() {
            let plain = raised.chars().filter_map(|c| SUPERSCRIPTS.chars().position(|s| s == c));
            let plain: String = plain.filter_map(|k| "-0123456789".chars().nth(k)).collect();
            return raised_to(base, &plain, &plain, start);
        }
        let mark = ["^", "**"].into_iter().find(|mark| self.text[start..].starts_with(mark));
        let marked = mark.is_some();
        self.at += mark.map_or(0, str::len);
        let number = self.at;
        let signed =
            self.peek() == Some('-') && self.text[self.at + 1..].starts_with(|c: char| c.is_ascii_digit());
        self.at += usize::from(signed);
        self.skip(|c| c.is_ascii_digit() || c == '.');
        let written = &self.text[number..self.at];
        if written.is_empty() && !marked {
            return Ok(base);
        }
        raised_to(base, written, &self.text[start..self.at], start)
    }
}

/// A unit with an exponent, which its text shows as `shown`.
fn raised_to(base: Unit, exponent: &str, shown: &str, offset: usize) -> Result<Unit, UnitError> {
    match exponent.parse::<f64>() {
        Ok(e) if e.is_finite() && e.abs() <= 100.0 => {
            Ok(Unit { coherent: format!("{}{shown}", base.coherent), ..base.power(e) })
        }
        _ => Err(UnitError {
            offset,
            reason: "the exponent of a unit must be a number from -100 to 100".into(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    fn of(text: &str) -> (f64, String, String) {
        let unit = Unit::parse(text).unwrap();
        (unit.factor, unit.dimension.to_string(), unit.coherent().to_owned())
    }

    #[test]
    fn the_rate_of_a_unit_is_read_again() {
        for (text, rate, coherent) in [
            ("deg", "deg/s", "rad/s"),
            ("-", "1/s", "1/s"),
            ("J/(kg K)", "J/(kg K)/s", "J/(kg K)/s"),
            ("kg m2/s2", "kg m2/s2/s", "kg m2/s2/s"),
        ] {
            let unit = Unit::parse(text).unwrap().per_second();
            assert_eq!((unit.to_string().as_str(), unit.coherent()), (rate, coherent));
            assert_eq!(Unit::parse(rate).unwrap(), unit);
        }
    }

    #[test]
    fn units_have_factor_dimension_and_coherent_text() {
        let cases = [
            ("m/s2", 1.0, "m/s2", "m/s2"),
            ("km/s^2", 1e3, "m/s2", "m/s^2"),
            ("km3/s2", 1e9, "m3/s2", "m3/s2"),
            ("kN", 1e3, "kg m/s2", "N"),
            ("J/(kg K)", 1.0, "m2/(s2 K)", "J/(kg K)"),
            ("kW/m2", 1e3, "kg/s3", "W/m2"),
            ("kg m2 s-2", 1.0, "kg m2/s2", "kg m2 s-2"),
            ("1/s", 1.0, "1/s", "1/s"),
            ("g0", 9.80665, "m/s2", "m/s2"),
            ("deg/s", PI / 180.0, "1/s", "rad/s"),
            ("-", 1.0, "1", "-"),
            ("m^0.5", 1.0, "m^0.5", "m^0.5"),
            ("m/s²", 1.0, "m/s2", "m/s2"),
            ("kg m² s⁻²", 1.0, "kg m2/s2", "kg m2 s-2"),
            ("deg/s**2", PI / 180.0, "1/s2", "rad/s**2"),
            ("kt", 1852.0 / 3600.0, "m/s", "m/s"),
            ("µm", 1e-6, "m", "m"),
            ("Nm", 1.0, "kg m2/s2", "N m"),
            ("%", 1e-2, "1", "1"),
            ("psi", 6_894.757_293_168_361, "kg/(m s2)", "Pa"),
            ("hp", 745.699_871_582_270_2, "kg m2/s3", "W"),
        ];
        for (text, factor, dimension, coherent) in cases {
            let found = of(text);
            assert!((found.0 - factor).abs() <= ROUNDING * factor, "{text}: {}", found.0);
            assert_eq!((found.1.as_str(), found.2.as_str()), (dimension, coherent), "{text}");
        }
    }

    #[test]
    fn what_is_no_unit_is_refused() {
        let cases = [
            ("metre", "no unit is named `metre`"),
            ("kms", "the nearest is `km`"),
            ("m/g", "write `g0`"),
            ("degC", "temperatures are in `K`"),
            ("m⁻", "exponent"),
            ("m¹²⁷", "exponent"),
            ("J/kg K", "two ways"),
            ("m/", "a unit is missing"),
            ("(m", "`)` is missing"),
            ("m^", "exponent"),
            ("m)", "cannot follow"),
            ("m^1e", "cannot follow"),
            ("3 m", "cannot begin"),
        ];
        for (text, part) in cases {
            let reason = Unit::parse(text).unwrap_err().reason;
            assert!(reason.contains(part), "{text}: {reason}");
        }
        assert!(Unit::parse(&"(".repeat(100_000)).is_err());
    }
}
