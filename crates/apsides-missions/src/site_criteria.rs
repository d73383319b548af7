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
//!
//! The presets `contest-coarse` and `contest-fine` are there to compare; they are unsafe ([`SiteCriteria::unsafe_because`]).

use std::path::Path;

use apsides_pipeline::Error;
use apsides_pipeline::file::{StatedValue, entries, line, read};
use apsides_pipeline::key::{Key, Range, Value};
use apsides_terrain::hazard::{Belly, Normals, SiteCriteria};

/// Headings of the four footpads where neither file nor preset states them.
const HEADINGS: usize = 18;
const ANGLE: Range = Range { least: (0.0, false), most: (90.0, false) };
const PART: Range = Range { least: (0.0, false), most: (1.0, true) };
/// Values of a threshold; infinite for one that is not tested.
const THRESHOLD: Range = Range::POSITIVE_OR_UNLIMITED;

/// Keys of a file of criteria; none has a default.
static KEYS: [Key; 18] = [
    Key::text(
        "preset",
        "",
        "the name of a preset",
        "criteria whose values hold unless the file states others",
    ),
    length("footprint_radius_m", "radius of the disk of a fitted plane, of roughness and of step height"),
    length("footpad_circle_radius_m", "radius of the circle of the four footpads"),
    Key::optional("footpad_radius_m", Range::from(0.0), "radius of a footpad; 0 is a point"),
    Key::count("headings", HEADINGS as u32, 1, 360, "headings of the four footpads in a quarter turn"),
    Key::optional("slope_max_deg", ANGLE, "largest slope of the fitted plane"),
    Key::optional("footpad_slope_max_deg", ANGLE, "largest slope on the footpads, over all headings"),
    threshold("roughness_max_m", "largest distance of a height from the fitted plane"),
    threshold("roughness_rms_max_m", "largest root mean square distance from the fitted plane"),
    threshold("step_max_m", "largest difference of heights within the footprint"),
    threshold("relative_elevation_max_m", "largest height above or below the robust plane of the map"),
    length("normals.radius_m", "radius within which pairs of pixels have their normals, 2 to 10 pixels"),
    Key::optional(
        "normals.slope_max_deg",
        ANGLE,
        "largest median angle between these normals and that of the robust plane of the map",
    ),
    Key::optional(
        "edges_max",
        PART,
        "threshold of Canny's detector from which on an edge is unsafe, a part of the largest gradient",
    ),
    length("belly.radius_m", "radius of the disk under which nothing may come too near"),
    Key::optional("belly.height_m", Range::from(0.0), "height of the underside above the footpads"),
    Key::optional("belly.clearance_min_m", Range::from(0.0), "least distance of underside and ground"),
    Key::optional("clearance_min_m", Range::from(0.0), "least distance from what is not safe"),
];

const fn length(path: &'static str, meaning: &'static str) -> Key {
    Key::optional(path, Range::POSITIVE, meaning)
}

const fn threshold(path: &'static str, meaning: &'static str) -> Key {
    Key::optional(path, THRESHOLD, meaning)
}

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
    let preset = match found.iter().find(|e| e.path == "preset") {
        Some(StatedValue { value: Value::Word(name), place, .. }) => {
            Some(SiteCriteria::preset(name).ok_or_else(|| Error::Value {
                place: place.clone(),
                key: "preset".into(),
                found: format!("\"{name}\""),
                allowed: format!("one of {}", presets()),
            })?)
        }
        _ => None,
    };
    let number = |path: &str| match found.iter().find(|e| e.path == path)?.value {
        Value::Number(v) => Some(v),
        _ => None,
    };
    // What the file does not state is that of the preset, and without one it is missing or not tested.
    let needed = |path: &str, of_preset: Option<f64>| {
        number(path).or(of_preset).ok_or_else(|| Error::Value {
            place: source.into(),
            key: path.into(),
            found: "missing".into(),
            allowed: KEYS.iter().find(|k| k.path == path).map(Key::allowed).unwrap_or_default(),
        })
    };
    let tested = |path: &str, of_preset: fn(&SiteCriteria) -> Option<f64>| match number(path) {
        Some(v) => Some(v).filter(|v| v.is_finite()),
        None => preset.as_ref().and_then(of_preset),
    };
    let belly = preset.and_then(|p| p.belly);
    let normals = preset.and_then(|p| p.normals);
    let states_normals = found.iter().any(|e| e.path.starts_with("normals."));
    let states_belly = found.iter().any(|e| e.path.starts_with("belly."));
    Ok(SiteCriteria {
        footprint_radius_m: needed("footprint_radius_m", preset.map(|p| p.footprint_radius_m))?,
        footpad_circle_radius_m: needed(
            "footpad_circle_radius_m",
            preset.map(|p| p.footpad_circle_radius_m),
        )?,
        clearance_min_m: needed("clearance_min_m", preset.map(|p| p.clearance_min_m))?,
        footpad_radius_m: number("footpad_radius_m").or(preset.map(|p| p.footpad_radius_m)).unwrap_or(0.0),
        headings: number("headings").map(|v| v as usize).or(preset.map(|p| p.headings)).unwrap_or(HEADINGS),
        slope_max_deg: tested("slope_max_deg", |p| p.slope_max_deg),
        footpad_slope_max_deg: tested("footpad_slope_max_deg", |p| p.footpad_slope_max_deg),
        roughness_max_m: tested("roughness_max_m", |p| p.roughness_max_m),
        roughness_rms_max_m: tested("roughness_rms_max_m", |p| p.roughness_rms_max_m),
        step_max_m: tested("step_max_m", |p| p.step_max_m),
        relative_elevation_max_m: tested("relative_elevation_max_m", |p| p.relative_elevation_max_m),
        normals: match states_normals {
            true => Some(Normals {
                radius_m: needed("normals.radius_m", normals.map(|n| n.radius_m))?,
                slope_max_deg: needed("normals.slope_max_deg", normals.map(|n| n.slope_max_deg))?,
            }),
            false => normals,
        },
        edges_max: tested("edges_max", |p| p.edges_max),
        belly: match states_belly {
            true => Some(Belly {
                radius_m: needed("belly.radius_m", belly.map(|b| b.radius_m))?,
                height_m: needed("belly.height_m", belly.map(|b| b.height_m))?,
                clearance_min_m: needed("belly.clearance_min_m", belly.map(|b| b.clearance_min_m))?,
            }),
            false => belly,
        },
    })
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
            normals: Some(Normals { radius_m: 0.4, slope_max_deg: 3.0 }),
            edges_max: Some(0.3),
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
        assert!(
            message("preset = \"alhat\"\n[normals]\nradius_m = 2")
                .contains("`normals.slope_max_deg` is missing")
        );
        assert!(message("preset = \"alhat\"\nedges_max = 1.5").contains("above 0 and at most 1"));
        assert!(message("slope = ").starts_with("file `c.toml`, line 1"));
        assert!(load("no-such").unwrap_err().to_string().contains("`alhat`"));
    }
}
