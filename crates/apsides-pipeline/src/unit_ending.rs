//! Units at the ends of the names of keys and results: `thrust_n` is in N, `touchdown_speed_m_s` and `touchdown_speed_m_per_s` are in m/s.

use std::borrow::Cow;

/// Words of ends, which a name keeps however short what follows is: `final_m_t` is `m` in t.
const ENDS: [&str; 2] = ["final", "initial"];

/// The name and the unit of a key or a result: `thrust` and `N` of `thrust_n`; all of it, and nothing, where it ends with no unit.
///
/// # Examples
/// ```
/// use apsides_pipeline::unit_ending::split;
///
/// assert_eq!(split("gravitational_parameter_km3_s2"), ("gravitational_parameter", "km3/s2".into()));
/// assert_eq!(split("eccentricity"), ("eccentricity", "".into()));
/// ```
#[must_use]
pub fn split(path: &str) -> (&str, Cow<'static, str>) {
    unit_at_end(path).unwrap_or((path, Cow::Borrowed("")))
}

/// The unit that ends the path of a key or result: `N` of `thrust_n`; empty without one.
#[must_use]
pub fn unit_of(path: &str) -> Cow<'static, str> {
    split(path).1
}

/// The path of a key or result without its unit: `thrust` of `thrust_n`.
#[must_use]
pub fn name_of(path: &str) -> &str {
    split(path).0
}

/// The name of a key or result in words, and its unit: `flight time` and `s`.
#[must_use]
pub fn in_words(path: &str) -> (String, Cow<'static, str>) {
    let (name, unit) = split(path);
    (name.replace('_', " "), unit)
}

/// Name of a quantity with its unit, if it has one: `flight time (s)`.
#[must_use]
pub fn quantity_label(path: &str) -> String {
    let (name, unit) = in_words(path);
    if unit.is_empty() { name } else { format!("{name} ({unit})") }
}

fn unit_at_end(path: &str) -> Option<(&str, Cow<'static, str>)> {
    if let Some(name) = path.strip_suffix("_j_kg_k") {
        return Some((name, "J/(kg K)".into()));
    }
    let (before, last) = path.rsplit_once('_')?;
    let unit = symbol(last)?;
    // The last word of a table of gains is p, i or d.
    if last == "d" && path.contains('.') {
        return None;
    }
    let (before, per) = match before.rsplit_once('_') {
        Some((rest, "per")) => (rest, true),
        _ => (before, false),
    };
    let above = before.rsplit_once('_').and_then(|(rest, top)| Some((rest, symbol(top)?)));
    match above {
        Some((rest, top)) if is_name(rest) && (per || is_quotient(rest, &top)) => {
            Some((rest, format!("{top}/{unit}").into()))
        }
        // `.._per_s` of something that is no unit: the whole is a name.
        _ if per || !is_name(before) => None,
        _ => Some((before, unit)),
    }
}

/// Two units that follow each other are a quotient, unless the first belongs to a number of the name, `with_7500_n_kg`, or means the least,
/// `clearance_min_m`.
fn is_quotient(rest: &str, top: &str) -> bool {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    top != "min" && !rest.rsplit('_').next().is_some_and(is_number)
}

/// Says whether something is named before a unit: what has a value at an end is named there.
fn is_name(name: &str) -> bool {
    name.rsplit('_').next().is_some_and(|word| !word.is_empty() && !ENDS.contains(&word))
}

/// The symbol of a unit as it ends a key, with an optional exponent.
fn symbol(word: &str) -> Option<Cow<'static, str>> {
    let base = word.trim_end_matches(['2', '3']);
    let known = match base {
        "s" => "s",
        "ms" => "ms",
        "min" => "min",
        "h" => "h",
        "d" | "day" | "days" => "d",
        "m" => "m",
        "mm" => "mm",
        "cm" => "cm",
        "km" => "km",
        "kg" => "kg",
        "g" => "g",
        "t" => "t",
        "rad" => "rad",
        "mrad" => "mrad",
        "deg" => "deg",
        "mol" => "mol",
        "bar" => "bar",
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
    let exponent = &word[base.len()..];
    Some(if exponent.is_empty() { known.into() } else { format!("{known}{exponent}").into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_end_keys() {
        for (key, name, unit) in [
            ("thrust_n", "thrust", "N"),
            ("gravitational_parameter_km3_s2", "gravitational_parameter", "km3/s2"),
            ("gas_constant_j_kg_k", "gas_constant", "J/(kg K)"),
            ("touchdown_radial_velocity_m_s", "touchdown_radial_velocity", "m/s"),
            ("touchdown_speed_m_per_s", "touchdown_speed", "m/s"),
            ("standard_gravity_m_s2", "standard_gravity", "m/s2"),
            ("peak_load_m_per_s2", "peak_load", "m/s2"),
            ("heat_flux_w_per_m2", "heat_flux", "W/m2"),
            ("heat_load_mj_m2", "heat_load", "MJ/m2"),
            ("adjustment_path_weight_kg_m", "adjustment_path_weight", "kg/m"),
            ("flight_time_s", "flight_time", "s"),
            ("flight_time_days", "flight_time", "d"),
            ("stage.thrust_n", "stage.thrust", "N"),
            ("median_excess_percent", "median_excess", "%"),
            ("solve_ms", "solve", "ms"),
            // Quantities of a single letter, at an end and with the unit of another one.
            ("final_m_t", "final_m", "t"),
            ("first_final_r_km", "first_final_r", "km"),
            ("final_v_m_s", "final_v", "m/s"),
            ("final_mass_kg", "final_mass", "kg"),
            ("initial_h", "initial_h", ""),
            ("final_s", "final_s", ""),
            // Units in the middle of a name.
            ("less_than_with_7500_n_kg", "less_than_with_7500_n", "kg"),
            ("frequency_at_10_km_hz", "frequency_at_10_km", "Hz"),
            ("clearance_min_m", "clearance_min", "m"),
            ("revolutions_per_day", "revolutions_per_day", ""),
            ("pid.attack_d", "pid.attack_d", ""),
            ("eccentricity", "eccentricity", ""),
            ("burns", "burns", ""),
            ("s", "s", ""),
            ("_s", "_s", ""),
            ("", "", ""),
        ] {
            assert_eq!(split(key), (name, unit.into()), "{key}");
        }
        assert_eq!(quantity_label("flight_time_s"), "flight time (s)");
        assert_eq!(quantity_label("final_m_t"), "final m (t)");
        assert_eq!(quantity_label("eccentricity"), "eccentricity");
        assert_eq!(in_words("peak_load_m_per_s2"), ("peak load".into(), "m/s2".into()));
    }
}
