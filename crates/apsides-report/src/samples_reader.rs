//! Reads samples of a trajectory that any program wrote, as CSV or JSON.
//!
//! CSV has a header: `time` (or `t`), one column for each state and control by its name, with or without its unit
//! (`speed`, `speed_m_s`), case and separators apart, and `phase` (name, or number from zero) where there are several. JSON is an
//! object of arrays with the same names, or `{"phases": [..], "parameters": {..}}` of such objects.

use std::io::Read;

use apsides_ocp::{Ocp, Phase};
use apsides_verify::PhaseSamples;
use serde_json::{Map, Value};

use crate::ReportError;
use crate::columns::{COLLOCATED, INTERVAL};

/// The samples of every phase, in the problem's order, and the static parameters that the file states.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Samples of each phase.
    pub phases: Vec<PhaseSamples>,
    /// Static parameters.
    pub parameters: Vec<f64>,
}

/// Reads samples: JSON where the first character is a brace, else CSV.
///
/// # Errors
/// [`ReportError::Trajectory`] with the line, or the first for JSON: a column is missing, a value is no number, a phase has no
/// samples.
pub fn read_samples<R: Read>(mut source: R, ocp: &Ocp) -> Result<Samples, ReportError> {
    let mut text = String::new();
    source.read_to_string(&mut text).map_err(|e| refusal(1, e.to_string()))?;
    let text = text.trim_start_matches('\u{feff}');
    if text.trim_start().starts_with('{') { from_json(text, ocp) } else { from_csv(text, ocp) }
}

fn refusal(line: u64, reason: impl Into<String>) -> ReportError {
    ReportError::Trajectory { line, reason: reason.into() }
}

/// Letters and digits in lower case.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The index of the header of a quantity.
fn find(headers: &[String], name: &str, unit: &str) -> Option<usize> {
    let (bare, with_unit) = (plain(name), plain(&format!("{name}{unit}")));
    // As this crate writes it.
    let spelt = plain(&format!("{name}{}", unit.replace('/', "per")));
    let position = |wanted: &str| headers.iter().position(|h| plain(h) == wanted);
    position(&bare).or_else(|| position(&with_unit)).or_else(|| position(&spelt))
}

fn time_column(headers: &[String], phase: &Phase) -> Option<usize> {
    find(headers, "time", &phase.time_unit).or_else(|| find(headers, "t", &phase.time_unit))
}

/// Columns of time, states and controls of a phase.
fn columns(headers: &[String], phase: &Phase) -> Result<[Vec<usize>; 3], ReportError> {
    let missing = |name: &str, unit: &str| {
        let known = headers.join(", ");
        refusal(1, format!("no column `{name}` ({unit}) for phase `{}`; columns: {known}", phase.name))
    };
    let time = time_column(headers, phase).ok_or_else(|| missing("time", &phase.time_unit))?;
    let of = |name: &str, unit: &str| find(headers, name, unit).ok_or_else(|| missing(name, unit));
    // Integrals that are states follow from the others.
    let own = &phase.states[..phase.model_states()];
    let states = own.iter().map(|s| of(&s.variable.name, &s.variable.unit));
    let controls = phase.controls.iter().map(|c| of(&c.name, &c.unit));
    Ok([vec![time], states.collect::<Result<_, _>>()?, controls.collect::<Result<_, _>>()?])
}

fn empty(ocp: &Ocp) -> Vec<PhaseSamples> {
    let none = PhaseSamples { times: Vec::new(), states: Vec::new(), controls: Vec::new(), nodes: None };
    vec![none; ocp.phases.len()]
}

fn phase_index(ocp: &Ocp, word: &str) -> Option<usize> {
    let wanted = plain(word);
    let by_name = ocp.phases.iter().position(|p| plain(&p.name) == wanted);
    by_name.or_else(|| word.trim().parse().ok().filter(|k| *k < ocp.phases.len()))
}

fn from_csv(text: &str, ocp: &Ocp) -> Result<Samples, ReportError> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let headers: Vec<String> =
        reader.headers().map_err(|e| refusal(1, e.to_string()))?.iter().map(str::to_owned).collect();
    let phase_column = headers.iter().position(|h| plain(h) == "phase");
    if phase_column.is_none() && ocp.phases.len() > 1 {
        let names: Vec<_> = ocp.phases.iter().map(|p| p.name.as_str()).collect();
        return Err(refusal(1, format!("no column `phase`; the problem has several: {}", names.join(", "))));
    }
    let of_nodes = {
        let column = |name: &str| headers.iter().position(|h| h == name);
        column(INTERVAL).zip(column(COLLOCATED))
    };
    let places = ocp.phases.iter().map(|p| columns(&headers, p)).collect::<Result<Vec<_>, _>>()?;
    let mut phases = empty(ocp);
    let mut parameters = vec![None; ocp.parameters.len()];
    for record in reader.records() {
        let record =
            record.map_err(|e| refusal(e.position().map_or(1, csv::Position::line), e.to_string()))?;
        let line = record.position().map_or(1, csv::Position::line);
        let number = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            let value: Option<f64> = text.parse().ok().filter(|v: &f64| v.is_finite());
            value.ok_or_else(|| {
                refusal(line, format!("`{}` is `{text}`, not a finite number", headers[column]))
            })
        };
        let word = phase_column.and_then(|c| record.get(c));
        let k = match word {
            Some(word) => {
                phase_index(ocp, word).ok_or_else(|| refusal(line, format!("no phase `{word}`")))?
            }
            None => 0,
        };
        let [time, states, controls] = &places[k];
        phases[k].times.push(number(time[0])?);
        phases[k].states.push(states.iter().map(|c| number(*c)).collect::<Result<_, _>>()?);
        phases[k].controls.push(controls.iter().map(|c| number(*c)).collect::<Result<_, _>>()?);
        if let Some((interval, collocated)) = of_nodes {
            let interval = record.get(interval).and_then(|text| text.parse().ok());
            let index = interval.ok_or_else(|| refusal(line, "`interval` is no whole number"))?;
            phases[k].nodes.get_or_insert_default().push((index, record.get(collocated) == Some("1")));
        }
        for (value, parameter) in parameters.iter_mut().zip(&ocp.parameters) {
            if let Some(column) = find(&headers, &parameter.name, &parameter.unit)
                .or_else(|| find(&headers, &format!("parameter_{}", parameter.name), &parameter.unit))
            {
                *value = Some(number(column)?);
            }
        }
    }
    finish(ocp, phases, &parameters)
}

fn from_json(text: &str, ocp: &Ocp) -> Result<Samples, ReportError> {
    let value: Value = serde_json::from_str(text).map_err(|e| {
        let column = e.column();
        refusal(e.line() as u64, format!("column {column}: the text is no JSON: a brace, a bracket, a quote or a comma is wrong or missing"))
    })?;
    let Value::Object(object) = value else { return Err(refusal(1, "a JSON object is expected")) };
    let mut phases = empty(ocp);
    match object.get("phases") {
        Some(Value::Array(list)) => {
            for (k, entry) in list.iter().enumerate() {
                let Value::Object(entry) = entry else {
                    return Err(refusal(1, format!("entry {k} of `phases` is no object")));
                };
                let named = entry.get("name").and_then(Value::as_str).and_then(|n| phase_index(ocp, n));
                let index = named.unwrap_or(k);
                if index >= ocp.phases.len() {
                    return Err(refusal(
                        1,
                        format!("`phases` has more entries than the problem: {}", ocp.phases.len()),
                    ));
                }
                phases[index] = json_phase(entry, &ocp.phases[index])?;
            }
        }
        Some(_) => return Err(refusal(1, "`phases` is no array")),
        None => phases[0] = json_phase(&object, &ocp.phases[0])?,
    }
    let given = object.get("parameters").and_then(Value::as_object);
    let parameters = ocp.parameters.iter().map(|p| {
        let value = given.and_then(|g| g.iter().find(|(k, _)| plain(k) == plain(&p.name)));
        value.and_then(|(_, v)| v.as_f64())
    });
    finish(ocp, phases, &parameters.collect::<Vec<_>>())
}

/// Arrays by their names, at the top or in objects such as `states` and `controls`.
fn json_phase(object: &Map<String, Value>, phase: &Phase) -> Result<PhaseSamples, ReportError> {
    let mut headers = Vec::new();
    let mut arrays = Vec::new();
    let nested = object.values().filter_map(Value::as_object).flatten();
    for (name, value) in object.iter().chain(nested) {
        if let Some(list) = value.as_array() {
            headers.push(name.clone());
            arrays.push(list);
        }
    }
    let [time, states, controls] = columns(&headers, phase)?;
    let length = arrays[time[0]].len();
    let read = |column: &usize, k: usize| {
        let value = arrays[*column].get(k).and_then(Value::as_f64);
        value.ok_or_else(|| refusal(1, format!("`{}` has no number at index {k}", headers[*column])))
    };
    let rows = |of: &[usize]| {
        (0..length)
            .map(|k| of.iter().map(|c| read(c, k)).collect::<Result<Vec<f64>, _>>())
            .collect::<Result<Vec<_>, _>>()
    };
    let times = (0..length).map(|k| read(&time[0], k)).collect::<Result<_, _>>()?;
    Ok(PhaseSamples { times, states: rows(&states)?, controls: rows(&controls)?, nodes: None })
}

fn finish(ocp: &Ocp, phases: Vec<PhaseSamples>, parameters: &[Option<f64>]) -> Result<Samples, ReportError> {
    if let Some(k) = phases.iter().position(|p| p.times.is_empty()) {
        return Err(refusal(1, format!("no samples of phase `{}`", ocp.phases[k].name)));
    }
    let stated = parameters.iter().zip(&ocp.parameters).map(|(value, p)| {
        value.ok_or_else(|| refusal(1, format!("the static parameter `{}` ({}) is missing", p.name, p.unit)))
    });
    Ok(Samples { phases, parameters: stated.collect::<Result<_, _>>()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use apsides_ad::{Dynamics, Scalar};
    use apsides_ocp::{At, Bounds, State, Variable};

    struct Cart;
    impl Dynamics<2, 1> for Cart {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            [x[1], u[0]]
        }
    }

    fn problem() -> Ocp {
        let phase = Phase::new("run", Cart)
            .states([State::new("position", "m"), State::new("Speed", "m/s")])
            .controls([Variable::new("acceleration", "m/s2")])
            .final_time(Bounds::new(0.1, 10.0));
        Ocp::builder("run")
            .phase(phase)
            .minimize("time", "s", At::FinalTime("run"))
            .build()
            .expect("well-posed")
    }

    #[test]
    fn csv_and_json_give_the_same_samples() {
        let expected = PhaseSamples {
            times: vec![0.0, 1.0],
            states: vec![vec![0.0, 1.0], vec![1.5, 2.0]],
            controls: vec![vec![1.0], vec![1.0]],
            nodes: None,
        };
        let csv = "Time_s, speed_m_per_s, position, other, acceleration_m_s2\n0,1,0,x,1\n1,2,1.5,y,1\n";
        let flat = r#"{"t": [0, 1], "position": [0, 1.5], "speed": [1, 2], "acceleration": [1, 1]}"#;
        let nested = r#"{"phases": [{"name": "run", "time": [0, 1], "states": {"position": [0, 1.5], "speed": [1, 2]},
            "controls": {"acceleration": [1, 1]}}], "parameters": {}}"#;
        for text in [csv, flat, nested] {
            let found = read_samples(text.as_bytes(), &problem()).expect("readable");
            assert_eq!(found.phases, std::slice::from_ref(&expected), "{text}");
        }
    }

    #[test]
    fn refusals_say_what_is_missing() {
        let cases = [
            ("time,position,acceleration\n0,0,0\n", "no column `Speed` (m/s)"),
            ("time,position,speed,acceleration\n0,0,zero,0\n", "`speed` is `zero`"),
            ("time,position,speed,acceleration\n0,0,NaN,0\n", "`speed` is `NaN`"),
            ("time,position,speed,acceleration\n", "no samples of phase `run`"),
            ("time,position,speed,acceleration\n0,0\n", "found record with 2 fields"),
            ("", "no column `time`"),
            ("{\"t\": [0, 1]", "column 12: the text is no JSON"),
            (
                "{\"t\": [0, 1], \"position\": [0], \"speed\": [1, 2], \"acceleration\": [1, 1]}",
                "no number at index 1",
            ),
        ];
        for (text, part) in cases {
            let message = read_samples(text.as_bytes(), &problem()).expect_err(text).to_string();
            assert!(message.contains(part), "{message}");
        }
    }
}
