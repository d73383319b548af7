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
pub(crate) fn pretty(unit: &str) -> String {
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

/// Splits a key such as `touchdown_speed_m_s` or `touchdown_speed_m_per_s` into `touchdown speed` and `m/s`; unknown endings
/// stay in the name, which has at least so many tokens.
fn split_tokens<'a>(tokens: &'a [&'a str], least: usize) -> Option<(&'a [&'a str], String)> {
    let (last, name) = tokens.split_last()?;
    let unit = symbol(last)?;
    let (before, per) = match name.split_last() {
        Some((&"per", before)) => (before, true),
        _ => (name, false),
    };
    match before.split_last().and_then(|(top, rest)| Some((rest, symbol(top)?))) {
        Some((rest, top)) if rest.len() >= least => Some((rest, format!("{top}/{unit}"))),
        // `.._per_s` of something that is no unit: the whole is a name.
        _ if per || name.len() < least => None,
        _ => Some((name, unit)),
    }
}

/// Name and unit of a key of the results.
pub(crate) fn split_key(key: &str) -> (String, String) {
    let tokens: Vec<&str> = key.split('_').collect();
    // What has a value at an end is named there, be it as short as a unit: `final_m_t`.
    let end = tokens.iter().position(|token| ["final", "initial"].contains(token));
    match split_tokens(&tokens, end.map_or(1, |k| k + 2)) {
        Some((name, unit)) => (name.join(" "), unit),
        None => (key.replace('_', " "), String::new()),
    }
}

/// The symbol of a unit as it ends a key, with an optional exponent.
fn symbol(token: &str) -> Option<String> {
    let base = token.trim_end_matches(['2', '3']);
    let known = match base {
        "s" | "ms" | "min" | "h" | "d" | "m" | "mm" | "cm" | "km" | "kg" | "g" | "t" | "rad" | "deg"
        | "mrad" | "mol" | "bar" => base,
        "days" | "day" => "d",
        "n" | "N" => "N",
        "kn" | "kN" => "kN",
        "mn" | "mN" => "mN",
        "w" | "W" => "W",
        "kw" | "kW" => "kW",
        "pa" | "Pa" => "Pa",
        "kpa" | "kPa" => "kPa",
        "j" | "J" => "J",
        "mj" | "MJ" => "MJ",
        "k" | "K" => "K",
        "nm" | "Nm" => "N m",
        "hz" | "Hz" => "Hz",
        "au" => "au",
        "percent" => "%",
        _ => return None,
    };
    Some(format!("{known}{}", &token[base.len()..]))
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

    #[test]
    fn keys_end_in_units() {
        let split = |key| {
            let (name, unit) = split_key(key);
            format!("{name}|{unit}")
        };
        assert_eq!(split("flight_time_s"), "flight time|s");
        assert_eq!(split("gate_radial_velocity_m_s"), "gate radial velocity|m/s");
        assert_eq!(split("gravitational_parameter_km3_s2"), "gravitational parameter|km3/s2");
        assert_eq!(split("touchdown_speed_m_per_s"), "touchdown speed|m/s");
        assert_eq!(split("peak_load_m_per_s2"), "peak load|m/s2");
        assert_eq!(split("heat_flux_w_per_m2"), "heat flux|W/m2");
        assert_eq!(split("thrust_n"), "thrust|N");
        assert_eq!(split("final_m_t"), "final m|t");
        assert_eq!(split("first_final_r_km"), "first final r|km");
        assert_eq!(split("final_v_m_s"), "final v|m/s");
        assert_eq!(split("initial_h"), "initial h|");
        assert_eq!(split("eccentricity"), "eccentricity|");
        assert_eq!(split("burns"), "burns|");
        assert_eq!(split("s"), "s|");
        assert_eq!(split("revolutions_per_day"), "revolutions per day|");
    }
}
