//! Where a flight is and when: the keys of epoch and axes, which ephemerides are made with.

use apsides_ephemeris::{Epoch, Placing, Plane, Reference};

use crate::Error;
use crate::key::{Key, Range};
use crate::values::Values;

/// The place of a flight that a mission can say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Whereabouts {
    /// It has none about a body.
    #[default]
    Nowhere,
    /// It has none as it is; the words say what has.
    NotSo(&'static str),
    /// Positions and velocities of a point.
    Point,
    /// Positions, velocities and attitudes.
    Attitude,
}

const EPOCH: &str = "epoch";
const REFERENCE: &str = "frame.reference";
const NODE: &str = "frame.node_deg";
const INCLINATION: &str = "frame.inclination_deg";
const ARGUMENT: &str = "frame.argument_deg";

const BODY: &str = "body";
const ICRF: &str = "icrf";

/// Keys of missions that have a place about a body. They change no flight; in files they stand only where they are stated.
pub const KEYS: &[Key] = &[
    Key::text(
        EPOCH,
        Epoch::DEFAULT,
        "a date, a time of day and a time scale (TAI, TT, TDB, UTC), such as 2030-01-01T00:00:00 TDB",
        "time zero of the flight, for ephemerides",
    ),
    Key::choice(
        REFERENCE,
        &[BODY, ICRF],
        "axes that the next three count from: fixed to the body, as they stand at the epoch, or those of the ICRF; \
         for flights in inertial axes of their own",
    ),
    Key::number(NODE, 0.0, Range::closed(-360.0, 360.0), "longitude of the node of the flight's plane"),
    Key::number(INCLINATION, 0.0, Range::closed(0.0, 180.0), "inclination of the flight's plane"),
    Key::number(
        ARGUMENT,
        0.0,
        Range::closed(-360.0, 360.0),
        "angle from the node to the first axis of the flight's plane",
    ),
];

/// Path of [`INITIAL_STATE`].
pub const INITIAL_STATE_PATH: &str = "initial_state";

/// The value of [`INITIAL_STATE`] where there is no message.
pub const NO_MESSAGE: &str = "none";

/// The key of missions that can start from the state of an orbit parameter message.
pub const INITIAL_STATE: Key = Key::table(
    INITIAL_STATE_PATH,
    NO_MESSAGE,
    "none, or the path of an orbit parameter message (CCSDS 502.0-B) that ends with .opm, or its text",
    "state and epoch of the start by a message, in place of the keys that say them",
);

/// Returns true if a key stands in files only where it is stated: what it says by default is nothing of the flight.
pub(crate) fn is_placing(path: &str) -> bool {
    path == INITIAL_STATE_PATH || KEYS.iter().any(|key| key.path == path)
}

/// Epoch and axes of values, the epoch being that of a message where one states the start.
pub(crate) fn placing_from(values: &Values, start: Option<Epoch>) -> Result<Placing, Error> {
    let placing = placing(values)?;
    let Some(epoch) = start else { return Ok(placing) };
    if values.place(EPOCH).is_some() && placing.epoch.since(&epoch).abs() > SAME {
        return Err(values.conflict(format!(
            "`{EPOCH}` is {}, the message of `{INITIAL_STATE_PATH}` has {epoch}: take `{EPOCH}` off",
            placing.epoch
        )));
    }
    Ok(Placing { epoch, ..placing })
}

/// Difference of two epochs that are the same, s.
const SAME: f64 = 1e-6;

/// Epoch and axes of values; those of the defaults where a mission has no such keys.
///
/// # Errors
/// A text that is no epoch.
pub fn placing(values: &Values) -> Result<Placing, Error> {
    if !values.declares(EPOCH) {
        return placing(&Values::new(String::new(), String::new(), KEYS.into()));
    }
    let epoch = values.word(EPOCH)?.parse::<Epoch>();
    let epoch = epoch.map_err(|e| values.conflict(format!("`{EPOCH}`: {e}")))?;
    let angle = |path| values.number(path).map(f64::to_radians);
    let reference = if values.word(REFERENCE)? == ICRF { Reference::Icrf } else { Reference::Body };
    let plane =
        Plane { reference, node: angle(NODE)?, inclination: angle(INCLINATION)?, argument: angle(ARGUMENT)? };
    Ok(Placing { epoch, plane })
}
