//! Numbers that are not finite, in formats of text that have none: JSON would lose them.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Finite(f64),
    Named(Name),
}

#[derive(Serialize, Deserialize)]
enum Name {
    #[serde(rename = "nan")]
    NotANumber,
    #[serde(rename = "inf")]
    Infinity,
    #[serde(rename = "-inf")]
    MinusInfinity,
}

pub(crate) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if !serializer.is_human_readable() || value.is_finite() {
        return serializer.serialize_f64(*value);
    }
    let name = match value {
        v if v.is_nan() => Name::NotANumber,
        v if *v > 0.0 => Name::Infinity,
        _ => Name::MinusInfinity,
    };
    name.serialize(serializer)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    if !deserializer.is_human_readable() {
        return f64::deserialize(deserializer);
    }
    Ok(match Written::deserialize(deserializer)? {
        Written::Finite(value) => value,
        Written::Named(Name::NotANumber) => f64::NAN,
        Written::Named(Name::Infinity) => f64::INFINITY,
        Written::Named(Name::MinusInfinity) => f64::NEG_INFINITY,
    })
}
