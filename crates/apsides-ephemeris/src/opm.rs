//! Orbit parameter messages: CCSDS 502.0-B-3, section 3, as text of keywords and values; written, and read as a state to start from.

use crate::kvn::Message;
use crate::table::Ephemeris;
use crate::{CentralBody, EphemerisError, Epoch, TimeScale};

/// Names of the files of the start and the end of a flight.
pub(crate) const FILES: [&str; 2] = ["initial.opm", "final.opm"];

/// Keywords of the state vector, km and km/s.
const STATE: [&str; 6] = ["X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT"];

/// The message of a row of an ephemeris with a place.
pub(crate) fn write(table: &Ephemeris, row: usize, created: &Epoch) -> String {
    let mut message = Message::begin("CCSDS_OPM_VERS", "3.0", table, created);
    message.line(format_args!(""));
    message.object(table);
    message.set("CENTER_NAME", table.body.map_or("", |body| body.word()));
    message.set("REF_FRAME", "ICRF");
    message.set("TIME_SYSTEM", table.epoch.scale().word());
    message.line(format_args!(""));
    message.comment(&format!("phase {}", table.phase_of(row)));
    message.set("EPOCH", &table.epoch_of(row).calendar());
    if let Some(state) = table.states.get(row) {
        let [position, velocity] = [state.position, state.velocity].map(|v| v.map(|c| c / 1e3));
        for (key, value) in STATE.iter().zip(position) {
            message.line(format_args!("{key} = {value:.9} [km]"));
        }
        for (key, value) in STATE[3..].iter().zip(velocity) {
            message.line(format_args!("{key} = {value:.12} [km/s]"));
        }
        if let Some(mass) = state.mass {
            message.line(format_args!("\nMASS = {mass:.6} [kg]"));
        }
    }
    message.text()
}

/// A state about a body at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateVector {
    /// The body.
    pub body: CentralBody,
    /// The instant.
    pub epoch: Epoch,
    /// Position in axes of the ICRF at the centre of the body, m.
    pub position: [f64; 3],
    /// Velocity in axes of the ICRF, m/s.
    pub velocity: [f64; 3],
    /// Mass, kg, if the message has one.
    pub mass: Option<f64>,
}

/// Largest message that is read, bytes.
const LARGEST: usize = 1 << 20;

/// Keywords with the line of each and its value.
struct Keywords<'a> {
    entries: Vec<(usize, &'a str, &'a str)>,
    last: usize,
}

impl<'a> Keywords<'a> {
    fn of(text: &'a str) -> Result<Self, EphemerisError> {
        let mut entries: Vec<(usize, &str, &str)> = Vec::new();
        let lines = text.lines().enumerate();
        for (line, text) in lines.map(|(k, text)| (k + 1, text.trim())) {
            if text.is_empty() || text.starts_with("COMMENT") {
                continue;
            }
            let Some((key, value)) = text.split_once('=').map(|(key, value)| (key.trim(), value.trim()))
            else {
                return refuse(line, format!("`{}` is no keyword with a value", shortened(text)));
            };
            if entries.iter().any(|entry| entry.1 == key) && (STATE.contains(&key) || key == "EPOCH") {
                return refuse(line, format!("`{key}` stands twice"));
            }
            entries.push((line, key, value));
        }
        Ok(Self { entries, last: text.lines().count().max(1) })
    }

    fn optional(&self, key: &str) -> Option<(usize, &'a str)> {
        self.entries.iter().find(|entry| entry.1 == key).map(|(line, _, value)| (*line, *value))
    }

    fn required(&self, key: &str) -> Result<(usize, &'a str), EphemerisError> {
        let missing = || refuse(self.last, format!("`{key}` is missing"));
        self.optional(key).map_or_else(missing, Ok)
    }

    /// A number with or without its unit in brackets.
    fn number(&self, key: &str, unit: &str) -> Result<f64, EphemerisError> {
        let (line, text) = self.required(key)?;
        let (value, stated) = text.split_once('[').unwrap_or((text, ""));
        let stated = stated.trim_end_matches(']').trim();
        if !stated.is_empty() && stated != unit {
            return refuse(line, format!("`{key}` is in {stated}, the standard has {unit}"));
        }
        match value.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => refuse(line, format!("`{key}` is `{}`, a finite number is needed", shortened(value.trim()))),
        }
    }

    /// One of several things by its word.
    fn one_of<T: Copy>(&self, key: &str, words: &[(&str, T)]) -> Result<T, EphemerisError> {
        let (line, found) = self.required(key)?;
        let is_it = |(word, _): &&(&str, T)| word.eq_ignore_ascii_case(found);
        let known = || words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", ");
        match words.iter().find(is_it) {
            Some((_, thing)) => Ok(*thing),
            None => refuse(line, format!("`{key}` is `{}`, taken are {}", shortened(found), known())),
        }
    }
}

fn refuse<T>(line: usize, reason: String) -> Result<T, EphemerisError> {
    Err(EphemerisError::Message { line, reason })
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

impl StateVector {
    /// Reads the state vector of a message in axes of the ICRF, or in those fixed to the body (`IAU_MOON`).
    ///
    /// # Errors
    /// [`EphemerisError::Message`] with the line of what is missing, malformed or not taken; [`EphemerisError::Epoch`].
    pub fn read_opm(text: &str) -> Result<Self, EphemerisError> {
        if text.len() > LARGEST {
            return refuse(1, format!("the message has {} bytes, at most {LARGEST} are read", text.len()));
        }
        let keywords = Keywords::of(text)?;
        match keywords.entries.first() {
            Some((_, "CCSDS_OPM_VERS", _)) => {}
            _ => return refuse(1, "an orbit parameter message begins with `CCSDS_OPM_VERS = `".into()),
        }
        let body = keywords.one_of("CENTER_NAME", &CentralBody::ALL.map(|body| (body.word(), body)))?;
        let fixed = format!("IAU_{}", body.word());
        let is_fixed = keywords.one_of("REF_FRAME", &[("ICRF", false), ("GCRF", false), (&fixed, true)])?;
        let scale = keywords.one_of("TIME_SYSTEM", &TimeScale::ALL.map(|scale| (scale.word(), scale)))?;
        let (_, epoch) = keywords.required("EPOCH")?;
        let epoch = Epoch::in_calendar(epoch, scale)?;
        let mut state = [0.0; 6];
        for (k, (key, value)) in STATE.iter().zip(&mut state).enumerate() {
            *value = 1e3 * keywords.number(key, if k < 3 { "km" } else { "km/s" })?;
        }
        let mass = keywords.optional("MASS").map(|_| keywords.number("MASS", "kg")).transpose()?;
        let [x, y, z, u, v, w] = state;
        let (position, velocity) = match is_fixed {
            true => body.orientation(&epoch).to_icrf([x, y, z], [u, v, w]),
            false => ([x, y, z], [u, v, w]),
        };
        Ok(Self { body, epoch, position, velocity, mass })
    }
}
