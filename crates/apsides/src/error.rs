//! Reasons to refuse a mission.

use std::path::PathBuf;

use apsides_control::ControlError;
use apsides_dynamics::DynamicsError;
use apsides_flatness::FlatnessError;
use apsides_metaheuristics::SearchError;
use apsides_ocp::OcpError;
use apsides_radau::RadauError;
use apsides_shooting::ShootingError;
use apsides_verify::VerifyError;

/// An ill-posed request. A mission that cannot be flown is not an error: see [`crate::Outcome`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that cannot be read as a mission.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong and what is allowed.
        reason: String,
    },
    /// Text that is not TOML.
    #[error("{place}: {reason}")]
    Syntax {
        /// File and line.
        place: String,
        /// The parser's message.
        reason: String,
    },
    /// A mission name that is not known.
    #[error("{place}: no mission is named `{name}`; known: {known}")]
    UnknownMission {
        /// Where the name stands.
        place: String,
        /// The name.
        name: String,
        /// Names of all missions.
        known: String,
    },
    /// A key that the mission or the vehicle does not have.
    #[error("{place}: {owner} has no key `{key}`{suggestion}")]
    UnknownKey {
        /// File and line, or `--set`.
        place: String,
        /// Mission or vehicle.
        owner: String,
        /// Path of the key.
        key: String,
        /// The nearest key, as the end of the sentence.
        suggestion: String,
    },
    /// A value that the key does not take.
    #[error("{place}: `{key}` is {found}, allowed is {allowed}")]
    Value {
        /// File and line, or `--set`.
        place: String,
        /// Path of the key.
        key: String,
        /// What was found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// Values that do not go together.
    #[error("{place}: {reason}")]
    Conflict {
        /// Mission and keys.
        place: String,
        /// What contradicts what, with numbers.
        reason: String,
    },
    /// The problem is refused.
    #[error(transparent)]
    Problem(#[from] OcpError),
    /// The vehicle is refused.
    #[error(transparent)]
    Vehicle(#[from] DynamicsError),
    /// A law, an actuator or a simulation is refused.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// Collocation refuses the request.
    #[error(transparent)]
    Radau(#[from] RadauError),
    /// The method of flat outputs refuses the request.
    #[error(transparent)]
    Flatness(#[from] FlatnessError),
    /// Shooting refuses the request.
    #[error(transparent)]
    Shooting(#[from] ShootingError),
    /// The search refuses the request.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// The trajectory cannot be verified because it does not fit the problem.
    #[error(transparent)]
    Verify(#[from] VerifyError),
}

impl Error {
    /// Values of a mission that do not go together, in words.
    pub(crate) fn in_mission(reason: impl Into<String>) -> Self {
        Self::Conflict { place: "mission".into(), reason: reason.into() }
    }
}
