//! Reasons to refuse a program.

use core::fmt;

/// An ill-posed request. A program without a solution is no error but a [`Status`](crate::Status).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StageError {
    /// No stage.
    NoStage,
    /// The workspace has another number of stages than the program.
    Workspace {
        /// Stages of the program.
        stages: usize,
        /// Stages of the workspace.
        workspace: usize,
    },
    /// More rows than there is room for, or a linear row after a cone.
    Rows {
        /// The stage.
        stage: usize,
        /// Most rows.
        most: usize,
    },
    /// An entry of a row is not finite, or outside the columns.
    Row {
        /// The stage.
        stage: usize,
        /// Number of columns.
        columns: usize,
    },
    /// A cost or constant is not finite.
    Value {
        /// The stage.
        stage: usize,
    },
    /// A row has an entry for a control that is no variable there.
    Control {
        /// The stage.
        stage: usize,
    },
    /// Start or end equations are not finite.
    Ends,
    /// A tolerance is not above 0 and below 1, or no iteration is allowed.
    Setting {
        /// Its name.
        setting: &'static str,
    },
}

impl fmt::Display for StageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoStage => write!(f, "the program has no stage; it must have at least one"),
            Self::Workspace { stages, workspace } => {
                write!(f, "the workspace has {workspace} stages, the program {stages}; they must be as many")
            }
            Self::Rows { stage, most } => write!(
                f,
                "stage {stage}: more than {most} rows, or a linear row after a cone; linear rows come first, and `NR` is the most"
            ),
            Self::Row { stage, columns } => {
                write!(
                    f,
                    "stage {stage}: a row has an entry that is not finite or outside the columns 0..{columns}"
                )
            }
            Self::Value { stage } => {
                write!(f, "stage {stage}: a cost, a constant or an offset is not finite")
            }
            Self::Control { stage } => {
                write!(f, "stage {stage}: a row has an entry for a control that is left out there")
            }
            Self::Ends => write!(f, "start or end equations: a number is not finite"),
            Self::Setting { setting } => {
                write!(f, "{setting}: tolerances must be above 0 and below 1, iterations at least 1")
            }
        }
    }
}

impl core::error::Error for StageError {}
