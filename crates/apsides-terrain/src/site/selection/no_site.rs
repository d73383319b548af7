//! Reasons for which no site of a map is taken, and what comes nearest to one.

use std::fmt;

use super::candidate::{Candidate, place};
use crate::hazard::Layer;

/// The reason for which no site of a map is taken, with what comes nearest to one. Offsets are to the east, to the north and upwards from the ground below the
/// lander, m.
#[derive(Clone, Debug, PartialEq)]
pub enum NoSite {
    /// The middle of the map, below the lander, is a gap.
    NothingBelow,
    /// No pixel has a whole footprint of known heights.
    Unknown,
    /// Every known pixel breaks a threshold.
    Unsafe {
        /// Number of unsafe pixels.
        pixels: u64,
        /// The pixel whose worst threshold is exceeded by the smallest part.
        offset: [f64; 3],
        /// The layer of that threshold.
        layer: Layer,
        /// The value of the layer there, rad or m.
        value: f64,
        /// The threshold, rad or m.
        limit: f64,
    },
    /// Nothing safe has the clearance that is asked for.
    NoRoom {
        /// Part of the known pixels that is safe.
        safe_fraction: f64,
        /// Clearance that is asked for, m.
        required: f64,
        /// The place with the largest clearance.
        offset: [f64; 3],
        /// The clearance there, m.
        widest: f64,
    },
    /// No divert reaches a safe site.
    OutOfReach {
        /// Number of safe sites that were tried.
        candidates: usize,
        /// The one whose divert falls short of it by the smallest distance.
        nearest: Box<Candidate>,
    },
    /// The work was ended before all candidates had a flight.
    Ended {
        /// Number of candidates, none where the hazards of the map were not known yet.
        candidates: usize,
        /// Number of those that a flight was planned to.
        planned: usize,
        /// The best of these within reach.
        best: Option<Box<Candidate>>,
    },
    /// On no candidate within reach does the lander stand on its four pads.
    NoStance {
        /// Number of candidates within reach.
        tried: usize,
        /// Largest tilt at rest that is allowed, rad.
        most: f64,
        /// The least tilt that was found, rad; none where it topples on all of them.
        least: Option<f64>,
    },
}

impl fmt::Display for NoSite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingBelow => {
                f.write_str("its middle, below the lander, is a gap; choose a map with a height there")
            }
            Self::Unknown => f.write_str("no pixel of it has a whole footprint of known heights"),
            Self::Unsafe { pixels, offset, layer, value, limit } => write!(
                f,
                "no safe site among {pixels} pixels; the nearest to one, {}, has {}: thresholds raised by {:.1} % would allow it",
                place(*offset),
                exceeded(*layer, *value, *limit),
                100.0 * (value / limit - 1.0)
            ),
            Self::NoRoom { safe_fraction, required, offset, widest } => write!(
                f,
                "no site: {:.2} % of it is safe, but nothing has {required} m around it that is safe throughout; the widest place, {}, has {widest:.2} m",
                100.0 * safe_fraction,
                place(*offset)
            ),
            Self::OutOfReach { candidates, nearest } => {
                write!(f, "none of {candidates} safe sites is within reach; the nearest to it, {nearest}")
            }
            Self::Ended { candidates: 0, .. } => {
                f.write_str("no site is chosen: the work ended before all of it was assessed")
            }
            Self::Ended { candidates, planned, best } => {
                write!(
                    f,
                    "no site is chosen: {planned} of {candidates} flights to safe sites are planned, "
                )?;
                match best {
                    Some(best) => write!(f, "the best until then {best}"),
                    None => f.write_str("none of them within reach"),
                }
            }
            Self::NoStance { tried, most, least } => {
                write!(
                    f,
                    "on none of the {tried} candidates within reach does the lander stand on its four pads with a tilt of at most {:.1} deg; the least is {:.2} deg",
                    most.to_degrees(),
                    least.unwrap_or(f64::INFINITY).to_degrees()
                )
            }
        }
    }
}

/// A value above its threshold, in the units of criteria.
pub(super) fn exceeded(layer: Layer, value: f64, limit: f64) -> String {
    format!("{} {} where {} is allowed", layer.name(), layer.show(value), layer.in_unit(limit))
}
