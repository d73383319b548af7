//! Units: quotients for costates, the units that readers prefer, typography.

use std::f64::consts::PI;

/// The unit of a quantity in `numerator` divided by one in `denominator`: `kg` per `m/s` is `kg s/m`; `-` is no unit.
pub(crate) fn quotient(numerator: &str, denominator: &str) -> String {
    let (mut above, mut below) = fraction(numerator);
    let (divisor_above, divisor_below) = fraction(denominator);
    above.extend(divisor_below);
    below.extend(divisor_above);
    above.retain(|f| match below.iter().position(|g| g == f) {
        Some(k) => {
            below.remove(k); // On both sides: cancels.
            false
        }
        None => true,
    });
    let top = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
    match below.as_slice() {
        [] if above.is_empty() => "-".to_owned(),
        [] => top,
        [one] => format!("{top}/{one}"),
        more => format!("{top}/({})", more.join(" ")),
    }
}

/// Factors above and below the fraction bars of a unit.
fn fraction(unit: &str) -> (Vec<&str>, Vec<&str>) {
    let mut parts = unit.split('/');
    let above = parts.next().map_or_else(Vec::new, factors);
    (above, parts.flat_map(factors).collect())
}

fn factors(part: &str) -> Vec<&str> {
    part.split([' ', '*', '(', ')']).filter(|f| !matches!(*f, "" | "-" | "1")).collect()
}

/// A unit to show: `shown = factor * value`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DisplayUnit {
    pub(crate) factor: f64,
    /// Empty for a quantity without unit.
    pub(crate) name: String,
}

/// The unit in which values up to `largest` (in `unit`) are easiest to read.
pub(crate) fn display_unit(unit: &str, largest: f64) -> DisplayUnit {
    let of = |factor: f64, name: &str| DisplayUnit { factor, name: pretty(name) };
    match unit {
        "" | "-" => return of(1.0, ""),
        "s" if largest >= 3.0 * 86_400.0 => return of(1.0 / 86_400.0, "d"),
        "s" if largest >= 6.0 * 3_600.0 => return of(1.0 / 3_600.0, "h"),
        _ => {}
    }
    let (head, tail) = unit.split_at(unit.find('/').unwrap_or(unit.len()));
    if head == "rad" {
        return of(180.0 / PI, &format!("deg{tail}"));
    }
    if matches!(head, "m" | "N" | "W" | "Pa" | "J" | "Hz") {
        // A quotient keeps its base unit longer: 7800 m/s, but 20 km.
        let mega = head != "m" && largest >= 1e7;
        return match largest {
            _ if mega => of(1e-6, &format!("M{unit}")),
            l if l >= 1e4 => of(1e-3, &format!("k{unit}")),
            l if l > 0.0 && l < 0.1 => of(1e3, &format!("m{unit}")),
            _ => of(1.0, unit),
        };
    }
    of(1.0, unit)
}

/// A unit with raised exponents: `m/s^2` and `m/s2` become `m/s²`.
#[must_use]
pub fn pretty(unit: &str) -> String {
    if unit == "-" {
        return String::new();
    }
    let mut out = String::with_capacity(unit.len());
    let mut raised = false;
    for c in unit.chars() {
        let after_letter = out.chars().next_back().is_some_and(char::is_alphabetic);
        match c {
            '^' => raised = true,
            '*' => out.push('·'),
            '-' | '0'..='9' if raised || (after_letter && c != '-') => {
                out.push(superscript(c));
                raised = true;
            }
            _ => {
                out.push(c);
                raised = false;
            }
        }
    }
    out
}

/// The raised form of a digit or minus sign; other characters as they are.
pub(crate) fn superscript(c: char) -> char {
    match c {
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        '-' => '⁻',
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn quotients_of_units() {
        assert_eq!(quotient("kg", "m/s"), "kg s/m");
        assert_eq!(quotient("kg", "kg"), "-");
        assert_eq!(quotient("s", "m/s"), "s s/m");
        assert_eq!(quotient("-", "rad"), "1/rad");
        assert_eq!(quotient("kg", "-"), "kg");
        assert_eq!(quotient("m/s", "kg"), "m/(s kg)");
        assert_eq!(quotient("kg", "kg/(m s)"), "m s");
    }

    #[test]
    fn display_units() {
        assert_eq!(display_unit("m", 15_000.0), DisplayUnit { factor: 1e-3, name: "km".into() });
        assert_eq!(display_unit("m", 150.0).name, "m");
        assert_eq!(display_unit("N", 2e7).name, "MN");
        assert_eq!(display_unit("rad/s", 1.0).name, "deg/s");
        assert!((display_unit("rad", 1.0).factor * PI - 180.0).abs() < ROUNDING);
        assert_eq!(display_unit("W/m2", 5e5).name, "kW/m²");
        assert_eq!(display_unit("m/s", 1700.0).name, "m/s");
        assert_eq!(display_unit("s", 1e6).name, "d");
        assert_eq!(display_unit("-", 1e9).name, "");
        assert_eq!(pretty("m/s^2"), "m/s²");
        assert_eq!(pretty("s^-1"), "s⁻¹");
    }
}
