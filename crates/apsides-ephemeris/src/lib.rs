//! Ephemerides of flights about a body: epochs, axes, states at times of one's choice, and the files that other programs read.
//!
//! A flight of a mission has coordinates and a clock of its own. Given an [`Epoch`] and [`Frames`], its states are positions and velocities
//! in the axes of the ICRF at the centre of the body, and in axes fixed to the body:
//!
//! ```text
//! r_fixed = R(t) r,   v_fixed = R(t) v + R'(t) r,   R = Rz(W) Rx(90 deg - delta) Rz(90 deg + alpha)
//! ```
//!
//! with the right ascension `alpha` and the declination `delta` of the pole and the angle `W` of the prime meridian of the report of the
//! IAU working group on cartographic coordinates and rotational elements.
//!
//! ```
//! use apsides_ephemeris::{CentralBody, Epoch};
//!
//! let epoch: Epoch = "2026-01-01T00:00:00 UTC".parse()?;
//! assert_eq!(epoch.in_scale(apsides_ephemeris::TimeScale::Tai).to_string(), "2026-01-01T00:00:37 TAI");
//! let axes = CentralBody::Moon.orientation(&epoch);
//! let (position, velocity) = axes.to_fixed([1.8e6, 0.0, 0.0], [0.0, 1650.0, 0.0]);
//! assert!((position.iter().map(|c| c * c).sum::<f64>().sqrt() - 1.8e6).abs() < 1e-6 && velocity[1].abs() < 1655.0);
//! # Ok::<(), apsides_ephemeris::EphemerisError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | `scale`, `calendar`, `epoch` | time scales and leap seconds; dates; instants |
//! | `iau` | how Earth, Moon and Mars turn |
//! | `frames` | axes of a mission, of the ICRF, of the body, and of a place on it |
//! | `flight`, `sampling` | a flight that is asked for its state; the times at which it is |
//! | `table`, `quantity` | the rows of an ephemeris, its columns |
//! | `orientation` | matrices with their rates, quaternions |
//! | `format`, `files` | formats by their words; their files: `text` (CSV, JSON), `npz`, `oem`, `opm`, `aem`, `czml`; `kvn` is the common part of messages |
//!
//! References: B. A. Archinal et al., *Celestial Mechanics and Dynamical Astronomy* 130 (2018) 22, doi 10.1007/s10569-017-9805-5;
//! G. H. Kaplan, USNO Circular 179, 2005 (TDB); CCSDS 502.0-B-3, Orbit Data Messages, 2023; CCSDS 504.0-B-2, Attitude Data Messages, 2024.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod aem;
mod calendar;
mod czml;
mod epoch;
mod error;
mod files;
mod flight;
mod format;
mod frames;
mod iau;
mod kvn;
mod npz;
mod oem;
mod opm;
mod orientation;
mod quantity;
mod sampling;
mod scale;
mod table;
mod text;

pub use epoch::Epoch;
pub use error::EphemerisError;
pub use files::{NEEDED, NamedFile};
pub use flight::{About, Axes, Flight, Instant, Motion, Point, Site, Span};
pub use format::Format;
pub use frames::{Frames, Plane, Reference, Topocentric};
pub use iau::CentralBody;
pub use opm::StateVector;
pub use orientation::Orientation;
pub use quantity::{Column, header, header_text};
pub use sampling::{Sampling, Step};
pub use scale::TimeScale;
pub use table::{Ephemeris, PhaseRows, PlacedState, Placing};
