//! The JSON Schema of mission files, from the declarations of their keys: editors complete and check files by it.
//!
//! JSON Schema, draft 2020-12, <https://json-schema.org/draft/2020-12>. What does not follow from one key alone, such as two altitudes that
//! must follow each other, is checked when a mission is read.

use serde_json::{Map, Value, json};

use crate::key::{Key, KeyKind, Range};
use crate::method::Methods;
use crate::mission::Kind;
use crate::placing;
use crate::registry::{Registry, SchemaOfFile};

/// The schema of the files that a registry reads.
///
/// # Examples
/// ```
/// use apsides_pipeline::Registry;
/// use apsides_pipeline::schema::schema;
///
/// let schema = schema(&Registry::new());
/// assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
/// ```
#[must_use]
pub fn schema(registry: &Registry) -> Value {
    let kinds = registry.kinds();
    let mut of_files: Vec<(&str, SchemaOfFile)> = registry.kinds_of_files().collect();
    of_files.sort_unstable_by_key(|(word, _)| *word);
    let words: Vec<&str> = of_files.iter().map(|(word, _)| *word).collect();
    let name = |kind: &Kind| kind.name.to_string();
    let of_kind = |kind: &Kind| {
        json!({
            "if": {"properties": {"mission": {"const": kind.name}}, "required": ["mission"]},
            "then": {"$ref": format!("#/$defs/{}", kind.name)},
        })
    };
    let mut definitions: Map<String, Value> =
        kinds.iter().map(|kind| (name(kind), definition(kind))).collect();
    let mut cases: Vec<Value> = kinds.iter().map(of_kind).collect();
    for (word, schema) in of_files {
        let name = format!("kind-{word}");
        cases.push(json!({
            "if": {"properties": {"kind": {"const": word}}, "required": ["kind"]},
            "then": {"$ref": format!("#/$defs/{name}")},
        }));
        let mut header = Map::from_iter([("kind".to_owned(), json!({"const": word}))]);
        header.extend(schema());
        definitions.insert(name, object(placing::KEYS.iter().chain(Methods::keys()), header));
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Mission file of apsides",
        "type": "object",
        "properties": {
            "mission": {
                "description": "kind of mission",
                "enum": kinds.iter().map(name).collect::<Vec<_>>(),
            },
            "kind": {"description": "a file with equations of its own, in place of `mission`", "enum": words},
        },
        "oneOf": [{"required": ["mission"]}, {"required": ["kind"]}],
        "allOf": cases,
        "$defs": definitions,
    })
}

fn definition(kind: &Kind) -> Value {
    let keys = kind.all_keys();
    let header = Map::from_iter([("mission".to_owned(), json!({"const": kind.name}))]);
    let mut object = object(keys.iter(), header);
    object["title"] = json!(kind.title);
    object
}

/// An object with these keys, those of a table in an object of its own.
fn object<'a>(keys: impl Iterator<Item = &'a Key>, header: Map<String, Value>) -> Value {
    let mut properties = header;
    let mut tables: Map<String, Value> = Map::new();
    for key in keys {
        match key.path.split_once('.') {
            None => _ = properties.insert(key.path.to_string(), of_key(key)),
            Some((table, name)) => {
                let table = tables.entry(table).or_insert_with(
                    || json!({"type": "object", "properties": {}, "additionalProperties": false}),
                );
                insert(&mut table["properties"], name, of_key(key));
            }
        }
    }
    properties.extend(tables);
    json!({"type": "object", "properties": properties, "additionalProperties": false})
}

/// Inserts a key below an object of properties, in tables of tables where its name has dots.
fn insert(properties: &mut Value, name: &str, value: Value) {
    match name.split_once('.') {
        None => properties[name] = value,
        Some((table, rest)) => {
            if properties[table].is_null() {
                properties[table] =
                    json!({"type": "object", "properties": {}, "additionalProperties": false});
            }
            insert(&mut properties[table]["properties"], rest, value);
        }
    }
}

/// The values of a key, its default and its unit.
fn of_key(key: &Key) -> Value {
    let mut value = match key.kind {
        KeyKind::Number(_, range) | KeyKind::Optional(range) | KeyKind::Named(_, range) => number(range),
        KeyKind::Count(_, least, most) => json!({"type": "integer", "minimum": least, "maximum": most}),
        KeyKind::Choice(words) => json!({"enum": words}),
        KeyKind::Flag(_) => json!({"type": "boolean"}),
        KeyKind::Text(..) | KeyKind::Path(..) | KeyKind::Table(..) => json!({"type": "string"}),
    };
    let from = match key.kind {
        KeyKind::Named(data, _) => format!("; by default that of `{data}`"),
        KeyKind::Optional(_) => "; open by default".into(),
        KeyKind::Number(default, _) if !default.is_finite() => format!("; {default} by default"),
        _ => String::new(),
    };
    value["description"] = json!(format!("{} ({}{from})", key.meaning, key.allowed()));
    if !key.unit().is_empty() {
        value["x-unit"] = json!(key.unit());
    }
    let default = match (&key.kind, key.default()) {
        (KeyKind::Count(default, ..), _) => Some(json!(default)),
        (_, Some(crate::key::Value::Number(v))) if v.is_finite() => Some(json!(v)),
        (_, Some(crate::key::Value::Word(word))) => Some(json!(word)),
        (_, Some(crate::key::Value::Flag(flag))) => Some(json!(flag)),
        // JSON has no infinite numbers.
        _ => None,
    };
    if let Some(default) = default {
        value["default"] = default;
    }
    value
}

fn number(range: Range) -> Value {
    let mut value = json!({"type": "number"});
    let ends =
        [(range.least, ["exclusiveMinimum", "minimum"]), (range.most, ["exclusiveMaximum", "maximum"])];
    for ((end, included), words) in ends {
        if end.is_finite() {
            value[words[usize::from(included)]] = json!(end);
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_says_its_values_unit_and_default() {
        let thrust = Key::number("thrust_n", 440.0, Range::POSITIVE, "full thrust");
        assert_eq!(
            of_key(&thrust),
            json!({"type": "number", "exclusiveMinimum": 0.0, "default": 440.0, "x-unit": "N",
                   "description": "full thrust (a number above 0)"})
        );
        let limit = Key::number("limit_s", f64::INFINITY, Range::POSITIVE_OR_UNLIMITED, "longest time");
        let limit = of_key(&limit);
        assert!(limit.get("default").is_none() && limit.get("maximum").is_none());
        assert!(limit["description"].as_str().is_some_and(|d| d.contains("inf by default")));
        let count = of_key(&Key::count("radau.points", 4, 1, 60, "points"));
        assert_eq!(
            (&count["type"], &count["maximum"], &count["default"]),
            (&json!("integer"), &json!(60), &json!(4))
        );
        let choice = of_key(&Key::choice("throttle", &["full", "free"], "size of the thrust"));
        assert_eq!((&choice["enum"], &choice["default"]), (&json!(["full", "free"]), &json!("full")));
    }

    #[test]
    fn tables_are_objects_that_are_closed() {
        let keys = [
            Key::flag("fast", true, "fast"),
            Key::number("steered.limit.rate_s", 1.0, Range::closed(0.0, 2.0), "rate"),
            Key::count("steered.points", 1, 1, 9, "points"),
        ];
        let object = object(keys.iter(), Map::new());
        assert_eq!(object["additionalProperties"], false);
        let steered = &object["properties"]["steered"];
        assert_eq!(steered["additionalProperties"], false);
        assert_eq!(steered["properties"]["limit"]["properties"]["rate_s"]["maximum"], 2.0);
        assert_eq!(steered["properties"]["points"]["type"], "integer");
    }
}
