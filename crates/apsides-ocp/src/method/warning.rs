//! Warnings: doubts that remain though a solve succeeds.

use std::fmt;

use super::deficiency::Deficiency;
use crate::Ocp;

/// A doubt about a solve, or a remark on the way it took.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// A scale of the statement does not fit.
    Scale(ScaleWarning),
    /// A method led nowhere from the costates at hand, and began again from the solution of another method.
    StartedAgain {
        /// Iterations that were lost.
        iterations: usize,
        /// The method that gave the second start.
        from: &'static str,
    },
    /// Every flight of a search failed, and the solve began from the guess.
    SearchFailed,
    /// A path equality has no control in it.
    WithoutControl {
        /// The phase.
        phase: String,
        /// The row of the path constraints.
        row: String,
    },
    /// The discretisation is coarser than was asked, and checks that do not depend on it show an optimum.
    Coarse(Deficiency),
}

impl Warning {
    /// The warning as a sentence without full stop. `name` gives the name that the reader knows a setting by, such as the key of a file, from the
    /// name of its field.
    #[must_use]
    pub fn sentence(&self, name: &dyn Fn(&'static str) -> String) -> String {
        match self {
            Self::Coarse(deficiency) => {
                format!("{}; the certificate does not depend on the mesh", deficiency.sentence(name))
            }
            other => other.to_string(),
        }
    }

    /// The path equalities of a problem that contain no control. With the equations of motion they are differential-algebraic equations
    /// of index two or higher, whose costates no collocation gives to the order of its states (U. Ascher and L. Petzold, Computer
    /// Methods for Ordinary Differential Equations and Differential-Algebraic Equations, SIAM 1998, section 10.1).
    #[must_use]
    pub fn without_control(ocp: &Ocp) -> Vec<Self> {
        let mut found = Vec::new();
        for phase in &ocp.phases {
            let controls = phase.states.len()..phase.states.len() + phase.controls.len();
            for c in &phase.path {
                let pattern = c.function.pattern();
                for (row, ends) in c.rows.iter().zip(pattern.row_offsets.windows(2)) {
                    let has_control = pattern.columns[ends[0]..ends[1]].iter().any(|i| controls.contains(i));
                    if row.bounds.is_fixed() && !has_control {
                        found.push(Self::WithoutControl { phase: phase.name.clone(), row: row.name.clone() });
                    }
                }
            }
        }
        found
    }
}

/// A scale that does not fit what it scales. [`crate::Variable::scaled_by`] and [`crate::OcpBuilder::objective_scale`] state others.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleWarning {
    /// The thing that is scaled: a constraint, a variable or the objective.
    pub subject: String,
    /// The phase that it belongs to, if it belongs to one.
    pub phase: Option<String>,
    /// Its scale, in `unit`.
    pub scale: f64,
    /// The size that the scale was compared with, in `unit`.
    pub size: f64,
    /// The meaning of `size`, as it stands in a sentence.
    pub size_is: &'static str,
    /// Unit.
    pub unit: String,
}

impl ScaleWarning {
    /// Ratio of scale and size, at least one.
    #[must_use]
    pub fn factor(&self) -> f64 {
        (self.scale / self.size).max(self.size / self.scale)
    }
}

impl fmt::Display for ScaleWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(phase) = &self.phase {
            write!(f, "phase `{phase}`, ")?;
        }
        let Self { subject, scale, size, size_is, unit, .. } = self;
        write!(
            f,
            "{subject}: scale {scale:.3e} {unit}, but {size_is} {size:.3e} {unit}: a factor of {:.1e}; state a scale \
             or bounds that fit",
            self.factor()
        )
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scale(warning) => warning.fmt(f),
            Self::StartedAgain { iterations, from } => write!(
                f,
                "shooting from the costates at hand gave no flight in {iterations} iterations; it starts from the solution by {from}"
            ),
            Self::WithoutControl { phase, row } => write!(
                f,
                "phase `{phase}`: the path equality `{row}` has no control in it, so that costates come out inaccurate; state its derivative \
                 with respect to time along the path, as often as it takes for a control to appear, and the equality itself at the start"
            ),
            Self::SearchFailed => {
                f.write_str("every flight of the search failed; the solve began from the guess")
            }
            Self::Coarse(_) => f.write_str(&self.sentence(&str::to_owned)),
        }
    }
}
