//! A capsule that is steered by two internal masses: closed-loop descents in six degrees of freedom.
//!
//! ```text
//! CrossMasses, RadialMasses -> Case -> Descent::new (vehicle, law, actuators, checked) -> fly -> Metrics
//! ```
//!
//! A [`Case`] is plain data in SI units: that of a mission, or made without one. [`Descent::fly`] allocates nothing per control step, and a
//! record is used again from flight to flight:
//!
//! ```
//! use apsides_missions::moving_mass::{Case, Descent, Record};
//!
//! let mut record = Record::every(1);
//! let mut case = Case::cross(10.0);
//! for offset in [[0.01, 0.01], [-0.01, 0.0]] {
//!     case.vehicle.offset = offset; // of the centre of mass, m
//!     let metrics = Descent::new(&case)?.fly(&mut record)?;
//!     assert!(metrics.held() && metrics.worst_rms() < 0.01_f64.to_radians());
//! }
//! # Ok::<(), apsides_pipeline::Error>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | `mission`, `keys` | the missions, read from files |
//! | `case` | the vehicle, its masses, law, actuators, sensors, entry |
//! | `law` | the laws and their numbers |
//! | `steering` | what commands the masses |
//! | `drives` | what moves the masses |
//! | `full_masses` | masses whose momentum and inertia the capsule feels |
//! | `descent` | a case ready to fly, and what flights amount to |
//! | `simulation` | the flight of a case as a report |
//! | `dispersion` | flights of a case that deviate at random |
//! | `state` | the states of a rigid body by name |
//! | `margins` | gain, phase and delay margins along a flight |
//! | `root_locus` | poles of the loops over a factor on their gain |
//! | `cases` | sets of descents: directions of the offset, angles at the entry |
//! | `tuning` | gains by a search over a set |
//! | `sizing` | least masses and rates that hold a set |
//! | `steered_entry` | a re-entry whose lift the masses point |
//!
//! Angles: attack `atan2(w, u)` and sideslip `asin(v / V)`, relative to the air. The error of the z axis is the negative angle of attack, that of
//! the y axis the negative sideslip: a centre of mass that is off the axis turns the heat shield towards its own side.
//!
//! Subject: a suborbital capsule whose angles are held by moving masses, after Karimabadeh and Tayefi; masses across the axis or on a rim.

mod case;
mod cases;
mod descent;
mod dispersion;
mod drives;
mod full_masses;
mod keys;
mod law;
mod margins;
mod mission;
mod root_locus;
pub(crate) mod simulation;
mod sizing;
pub(crate) mod state;
mod steered_entry;
mod steering;
#[cfg(test)]
mod tests;
mod tuning;

pub use case::{
    ActuatorLimits, Allocation, AntiWindupBy, Case, DampingSet, Earth, Entry, MassModel, Masses, Run,
    SensorErrors, Vehicle,
};
pub use cases::{CaseSet, SetFlight, worst_flight};
pub use descent::{Descent, Metrics, Record, Window, ending_text, ending_word};
pub use dispersion::{DescentDeviations, Descents};
pub use law::{Law, RegulatorSizes, SlidingSizes};
pub use margins::{LeastMargins, MARGIN_HEIGHTS, MarginRow};
pub use mission::{CrossMasses, RadialMasses, case, case_of};
pub use sizing::{MassRow, RateRow, SizeStudy, Sizing};
pub use steered_entry::{
    BankProfile, JUDGED_PRESSURE, SteeredCondition, SteeredEntry, SteeredFlight, SteeredReady,
};
pub use tuning::{RATE_LIMITED_GAINS, RequiredMargins, Tuned, TunedGains, Tuning, tune};
