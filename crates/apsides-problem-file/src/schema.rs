//! The tables and keys of a file as JSON Schema, by which editors complete and check them.
//!
//! JSON Schema, draft 2020-12, <https://json-schema.org/draft/2020-12>. What stands in formulas, their units and names are checked when a file is
//! read.

use serde_json::{Map, Value, json};

use crate::model::MotionAxes;
use crate::motion::VECTOR;
use crate::motion_table::{KEYS, SITE};

/// The schemas of the keys at the top of a file, by their names.
///
/// # Examples
/// ```
/// use apsides_problem_file::schema::properties;
///
/// assert_eq!(properties()["motion"]["properties"]["axes"]["default"], "inertial");
/// ```
#[must_use]
pub fn properties() -> Map<String, Value> {
    let text = |meaning: &str| json!({"type": "string", "description": meaning});
    let table = |meaning: &str| json!({"type": "object", "description": meaning});
    let known = [
        ("name", text("name of the problem")),
        ("title", text("one line that says what it is")),
        (
            "check_units",
            json!({"type": "boolean", "default": true, "description": "refuse formulas whose units do not fit"}),
        ),
        ("constants", table("numbers with their units, which `--set constants.NAME=VALUE` replaces")),
        ("definitions", table("names and functions for formulas")),
        ("tables", table("functions by samples")),
        ("parameters", table("unknowns that do not change along the flight")),
        ("phase", table("states, controls, equations and constraints of each phase")),
        ("links", table("phases that follow each other")),
        ("boundary", table("constraints on ends, durations, parameters and integrals")),
        ("objective", table("what is minimised or maximised")),
        ("guess", table("where a solve begins")),
        ("motion", motion()),
    ];
    known.into_iter().map(|(name, schema)| (name.to_owned(), schema)).collect()
}

/// The table `[motion]`.
fn motion() -> Value {
    let property = |key: &&str| ((*key).to_owned(), of_motion(key));
    json!({
        "description": "where the flight is about a body, for ephemerides",
        "type": "object",
        "properties": KEYS.iter().map(property).collect::<Map<_, _>>(),
        "required": ["body", "position", "velocity"],
        "additionalProperties": false,
        "if": {"properties": {"axes": {"const": "site"}}, "required": ["axes"]},
        "then": {"required": ["site"]},
        "else": {"properties": {"site": {"not": {}}}},
    })
}

fn of_motion(key: &str) -> Value {
    match key {
        "body" => {
            json!({"type": "string", "description": "a name of `apsides bodies`, or the path of such a file: Earth, Moon or Mars"})
        }
        "axes" => json!({
            "enum": MotionAxes::WORDS.map(|(word, _)| word),
            "default": MotionAxes::WORDS[0].0,
            "description": "axes of position, velocity and thrust: inertial, fixed to the body, or east, north and up from a site",
        }),
        "site" => {
            let [longitude, latitude, _] = SITE;
            let part = |name: &&str| {
                let unit = if [longitude, latitude].contains(name) { "deg" } else { "m" };
                let mut part = formula(&format!("{name} of the site; a number alone is in {unit}"));
                part["x-unit"] = json!(unit);
                ((*name).to_owned(), part)
            };
            json!({
                "type": "object",
                "properties": SITE.iter().map(part).collect::<Map<_, _>>(),
                "required": [longitude, latitude],
                "additionalProperties": false,
                "description": "the place that axes = \"site\" count from",
            })
        }
        "mass" => by_phase(formula("mass of the vehicle"), &["string", "number"]),
        _ => {
            let component = formula("a formula of states, controls, parameters, constants and time");
            let mut vector = json!({"items": component, "minItems": VECTOR, "maxItems": VECTOR});
            vector["description"] = json!(format!("{key} of the vehicle, three components"));
            by_phase(vector, &["array"])
        }
    }
}

/// Text of a formula, or a number.
fn formula(meaning: &str) -> Value {
    json!({"type": ["string", "number"], "minLength": 1, "description": meaning})
}

/// A value of these types for all phases, or a table with one of each. Mistakes are found inside, which alternatives would hide.
fn by_phase(mut value: Value, types: &[&str]) -> Value {
    let mut each = value.clone();
    each["type"] = json!(types);
    value["type"] = types.iter().copied().chain(["object"]).collect();
    value["minProperties"] = json!(1);
    value["additionalProperties"] = each;
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::TOP;

    #[test]
    fn every_key_of_a_file_has_a_schema() {
        let known = properties();
        let missing: Vec<&str> = TOP.into_iter().filter(|key| !known.contains_key(*key)).collect();
        // The word that says what the file is has its schema where files are told apart.
        assert_eq!((missing, known.len()), (vec!["kind"], TOP.len() - 1));
        let motion = &known["motion"];
        for key in KEYS {
            assert!(
                motion["properties"][key]["description"].as_str().is_some_and(|d| !d.is_empty()),
                "{key}"
            );
        }
        assert_eq!(motion["properties"]["thrust"]["additionalProperties"]["type"], json!(["array"]));
        assert_eq!(motion["properties"]["mass"]["type"], json!(["string", "number", "object"]));
        assert_eq!(motion["properties"]["site"]["properties"]["altitude"]["x-unit"], "m");
    }
}
