//! Reasons to refuse a verification.

use apsides_ocp::OcpError;

/// A trajectory that does not fit its problem, or a setting that is not allowed.
///
/// A trajectory that fits but is wrong gives failing checks, not an error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// Phases, states, controls or parameters differ in number from the problem's, or a phase has no duration.
    #[error("the trajectory does not fit the problem: {0}")]
    Trajectory(#[from] OcpError),
    /// A costate or multiplier array has the wrong size.
    #[error("{place}: expected {expected} {what}, found {found}")]
    Dimension {
        /// Phase or constraint.
        place: String,
        /// The quantity that is counted.
        what: &'static str,
        /// The size that fits.
        expected: usize,
        /// The size that was given.
        found: usize,
    },
    /// A polynomial does not span its phase.
    #[error("phase `{phase}`: the {what} spans [{first}, {last}], the phase [{initial_time}, {final_time}]")]
    Span {
        /// Name of the phase.
        phase: String,
        /// State, control, costate or path multipliers.
        what: &'static str,
        /// First break of the polynomial.
        first: f64,
        /// Last break of the polynomial.
        last: f64,
        /// Start time of the phase.
        initial_time: f64,
        /// End time of the phase.
        final_time: f64,
    },
    /// A setting that is not allowed.
    #[error("setting `{name}` is {value}, allowed is {allowed}")]
    Setting {
        /// Field of [`VerifySettings`](crate::VerifySettings).
        name: &'static str,
        /// The value given.
        value: f64,
        /// The values that are allowed.
        allowed: &'static str,
    },
}
