//! Reasons to refuse a mission.

use std::path::PathBuf;

use apsides_ocp::OcpError;
use apsides_verify::VerifyError;

/// The error of a model or method of a lower layer.
pub type Source = Box<dyn std::error::Error + Send + Sync>;

/// An ill-posed request. A mission that cannot be flown is not an error: see [`crate::Outcome`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read, or holds something else than it should.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The mistake, and what is allowed.
        reason: String,
    },
    /// A text is not TOML, or not `key=value`.
    #[error("{place}: {reason}")]
    Syntax {
        /// File and line.
        place: String,
        /// The parser's message.
        reason: String,
    },
    /// No mission has this name.
    #[error("{place}: no mission is named `{name}`{suggestion}")]
    UnknownMission {
        /// The place of the name.
        place: String,
        /// The name.
        name: String,
        /// The nearest name, as the end of the sentence.
        suggestion: String,
    },
    /// The mission or the vehicle has no such key.
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
    /// The key does not take this value.
    #[error("{place}: `{key}` is {found}, allowed is {allowed}")]
    Value {
        /// File and line, or `--set`.
        place: String,
        /// Path of the key.
        key: String,
        /// The value that was found.
        found: String,
        /// The allowed values, in words.
        allowed: String,
    },
    /// Values do not go together.
    #[error("{place}: {reason}")]
    Conflict {
        /// Mission and keys.
        place: String,
        /// The contradiction, with numbers.
        reason: String,
    },
    /// The optimal control problem is refused.
    #[error(transparent)]
    Problem(#[from] OcpError),
    /// A vehicle, a law, a map or another model is refused.
    #[error("{place}{source}")]
    Model {
        /// File, line and keys of its parameters, up to the message; empty where it is no key's fault.
        place: String,
        /// The refusal.
        source: Source,
    },
    /// The method refuses the request.
    #[error(transparent)]
    Method(Source),
    /// The trajectory cannot be verified because it does not fit the problem.
    #[error(transparent)]
    Verify(#[from] VerifyError),
}

impl Error {
    /// Values of a mission do not go together; `reason` names the keys and says what to change.
    pub fn in_mission(reason: impl Into<String>) -> Self {
        Self::Conflict { place: "mission".into(), reason: reason.into() }
    }

    /// A model of a lower layer refuses its parameters.
    pub fn model(source: impl Into<Source>) -> Self {
        Self::Model { place: String::new(), source: source.into() }
    }

    /// A method refuses the problem or its settings.
    pub fn method(source: impl Into<Source>) -> Self {
        Self::Method(source.into())
    }
}

/// Errors of methods.
macro_rules! from_method {
    ($($error:ty),*) => {
        $(impl From<$error> for Error {
            fn from(e: $error) -> Self {
                Self::method(e)
            }
        })*
    };
}

from_method!(apsides_metaheuristics::SearchError, apsides_ocp::MethodError, apsides_radau::RadauError);

#[cfg(any(
    feature = "indirect",
    feature = "multiple-shooting",
    feature = "piecewise",
    feature = "two-layer"
))]
from_method!(apsides_shooting::ShootingError);

impl From<apsides_ephemeris::EphemerisError> for Error {
    fn from(e: apsides_ephemeris::EphemerisError) -> Self {
        Self::model(e)
    }
}

impl From<apsides_control::ControlError> for Error {
    fn from(e: apsides_control::ControlError) -> Self {
        Self::model(e)
    }
}
