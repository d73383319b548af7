//! Criteria of landing sites from a preset or a file.
//!
//! ```toml
//! preset = "chang-e-3-fine"   # optional; what follows replaces its values
//! slope_max_deg = 6
//! roughness_max_m = inf       # not tested
//!
//! [belly]
//! radius_m = 1.5
//! height_m = 0.8
//! clearance_min_m = 0.3
//! ```

use std::path::Path;

use apsides_terrain::hazard::{Belly, SiteCriteria};

use crate::Error;
use crate::key::{Key, Range, Value};
use crate::mission_file::{Entry, entries, line, read};

const ANGLE: Range = Range { least: (0.0, false), most: (90.0, false) };
/// Of a threshold; infinite for one that is not tested.
const THRESHOLD: Range = Range::POSITIVE_OR_UNLIMITED;

/// Keys of a file of criteria; none has a default.
const KEYS: [Key; 15] = [
    Key::text(
        "preset",
        "",
        "the name of a preset",
        "criteria whose values hold unless the file states others",
    ),
    length("footprint_radius_m", "radius of the disk of a fitted plane, of roughness and of step height"),
    length("footpad_circle_radius_m", "radius of the circle of the four footpads"),
    Key::number("footpad_radius_m", f64::NAN, Range::from(0.0), "radius of a footpad; 0 is a point"),
    Key::count("headings", 18, 1, 360, "headings of the four footpads in a quarter turn"),
    Key::number("slope_max_deg", f64::NAN, ANGLE, "largest slope of the fitted plane"),
    Key::number("footpad_slope_max_deg", f64::NAN, ANGLE, "largest slope on the footpads, over all headings"),
    threshold("roughness_max_m", "largest distance of a height from the fitted plane"),
    threshold("roughness_rms_max_m", "largest root mean square distance from the fitted plane"),
    threshold("step_max_m", "largest difference of heights within the footprint"),
    threshold("relative_elevation_max_m", "largest height above or below the robust plane of the map"),
    length("belly.radius_m", "radius of the disk under which nothing may come too near"),
    Key::number("belly.height_m", f64::NAN, Range::from(0.0), "height of the underside above the footpads"),
    Key::number(
        "belly.clearance_min_m",
        f64::NAN,
        Range::from(0.0),
        "least distance of underside and ground",
    ),
    Key::number("clearance_min_m", f64::NAN, Range::from(0.0), "least distance from what is not safe"),
];

const fn length(path: &'static str, meaning: &'static str) -> Key {
    Key::number(path, f64::NAN, Range::POSITIVE, meaning)
}

const fn threshold(path: &'static str, meaning: &'static str) -> Key {
    Key::number(path, f64::NAN, THRESHOLD, meaning)
}

/// What a file without a preset starts from: nothing is tested.
const BLANK: SiteCriteria = SiteCriteria {
    footprint_radius_m: f64::NAN,
    footpad_circle_radius_m: f64::NAN,
    footpad_radius_m: 0.0,
    headings: 18,
    slope_max_deg: None,
    footpad_slope_max_deg: None,
    roughness_max_m: None,
    roughness_rms_max_m: None,
    step_max_m: None,
    belly: None,
    relative_elevation_max_m: None,
    clearance_min_m: f64::NAN,
};

/// Criteria of landing sites by the name of a preset or the path of a file.
///
/// # Errors
/// The first mistake, with its place.
pub fn load(file_or_name: &str) -> Result<SiteCriteria, Error> {
    let path = Path::new(file_or_name);
    if let Some(criteria) = SiteCriteria::preset(file_or_name)
        && !path.is_file()
    {
        return Ok(criteria);
    }
    let text = read(path, "preset", &presets())?;
    parse(&text, &format!("file `{file_or_name}`"))
}

/// Criteria from the text of a file; `source` names it in messages.
///
/// # Errors
/// The first mistake, with its place.
pub fn parse(text: &str, source: &str) -> Result<SiteCriteria, Error> {
    let keys: Vec<&Key> = KEYS.iter().collect();
    let found = entries(text, |offset| format!("{source}, line {}", line(text, offset)))?;
    for entry in &found {
        entry.key(&keys, "a file of site criteria")?;
    }
    let mut criteria = match found.iter().find(|e| e.path == "preset") {
        Some(Entry { value: Value::Word(name), place, .. }) => {
            SiteCriteria::preset(name).ok_or_else(|| Error::Value {
                place: place.clone(),
                key: "preset".into(),
                found: format!("\"{name}\""),
                allowed: format!("one of {}", presets()),
            })?
        }
        _ => BLANK,
    };
    let mut belly =
        criteria.belly.unwrap_or(Belly { radius_m: f64::NAN, height_m: f64::NAN, clearance_min_m: f64::NAN });
    for entry in &found {
        let Value::Number(v) = entry.value else { continue };
        let tested = v.is_finite().then_some(v);
        match entry.path.as_str() {
            "footprint_radius_m" => criteria.footprint_radius_m = v,
            "footpad_circle_radius_m" => criteria.footpad_circle_radius_m = v,
            "footpad_radius_m" => criteria.footpad_radius_m = v,
            "headings" => criteria.headings = v as usize,
            "slope_max_deg" => criteria.slope_max_deg = tested,
            "footpad_slope_max_deg" => criteria.footpad_slope_max_deg = tested,
            "roughness_max_m" => criteria.roughness_max_m = tested,
            "roughness_rms_max_m" => criteria.roughness_rms_max_m = tested,
            "step_max_m" => criteria.step_max_m = tested,
            "relative_elevation_max_m" => criteria.relative_elevation_max_m = tested,
            "belly.radius_m" => belly.radius_m = v,
            "belly.height_m" => belly.height_m = v,
            "belly.clearance_min_m" => belly.clearance_min_m = v,
            _ => criteria.clearance_min_m = v,
        }
    }
    if found.iter().any(|e| e.path.starts_with("belly.")) {
        criteria.belly = Some(belly);
    }
    let needed = [
        ("footprint_radius_m", criteria.footprint_radius_m),
        ("footpad_circle_radius_m", criteria.footpad_circle_radius_m),
        ("clearance_min_m", criteria.clearance_min_m),
    ];
    let of_belly = [
        ("belly.radius_m", belly.radius_m),
        ("belly.height_m", belly.height_m),
        ("belly.clearance_min_m", belly.clearance_min_m),
    ];
    let of_belly = of_belly.into_iter().filter(|_| criteria.belly.is_some());
    match needed.into_iter().chain(of_belly).find(|(_, v)| v.is_nan()) {
        Some((key, _)) => Err(Error::Value {
            place: source.into(),
            key: key.into(),
            found: "missing".into(),
            allowed: KEYS.iter().find(|k| k.path == key).map(Key::allowed).unwrap_or_default(),
        }),
        None => Ok(criteria),
    }
}

fn presets() -> String {
    SiteCriteria::presets().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let full = SiteCriteria {
            roughness_rms_max_m: Some(0.1),
            step_max_m: Some(0.4),
            relative_elevation_max_m: Some(2.0),
            belly: Some(Belly { radius_m: 1.5, height_m: 0.8, clearance_min_m: 0.3 }),
            ..SiteCriteria::CHANG_E_3_FINE
        };
        let presets = SiteCriteria::presets().map(|name| load(name).unwrap());
        for criteria in presets.chain([full]) {
            assert_eq!(parse(&toml::to_string(&criteria).unwrap(), "text").unwrap(), criteria);
        }
    }

    #[test]
    fn a_file_changes_a_preset() {
        let text = "preset = \"alhat\"\nslope_max_deg = 3\nroughness_max_m = inf\n";
        let criteria = parse(text, "text").unwrap();
        let expected =
            SiteCriteria { slope_max_deg: Some(3.0), roughness_max_m: None, ..SiteCriteria::ALHAT };
        assert_eq!(criteria, expected);
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str| parse(text, "file `c.toml`").unwrap_err().to_string();
        assert_eq!(
            message("preset = \"alhat\"\nslope_mx_deg = 3"),
            "file `c.toml`, line 2: a file of site criteria has no key `slope_mx_deg`; the nearest is `slope_max_deg`"
        );
        assert!(
            message("preset = \"alhat\"\nslope_max = 3").contains("its unit is missing: `slope_max_deg`")
        );
        assert!(message("preset = \"alhat\"\nslope_max_deg = 95").contains("above 0 and below 90"));
        assert!(message("preset = \"mars\"").contains("one of `chang-e-3-coarse`"));
        assert!(message("footprint_radius_m = 2").contains("`footpad_circle_radius_m` is missing"));
        assert!(message("preset = \"alhat\"\n[belly]\nradius_m = 2").contains("`belly.height_m` is missing"));
        assert!(message("slope = ").starts_with("file `c.toml`, line 1"));
        assert!(load("no-such").unwrap_err().to_string().contains("`alhat`"));
    }
}
