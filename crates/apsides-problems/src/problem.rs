//! An entry of the gallery: a named problem, how to pose it, and the optimum that a method must find.

use apsides_ocp::{Guess, Ocp, OcpError};

/// A benchmark problem with its optimum.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Name of the module, unique in the gallery.
    pub name: &'static str,
    /// One line on what is optimised.
    pub title: &'static str,
    /// Structure of the optimal control, which decides how accurate a plain transcription gets.
    pub structure: Structure,
    /// The optimum.
    pub optimum: Optimum,
    pub(crate) pose: fn() -> Result<Case, OcpError>,
}

impl Problem {
    /// The problem and where a method starts.
    ///
    /// # Errors
    /// None for the problems of this crate; the type is that of [`apsides_ocp::OcpBuilder::build`].
    pub fn pose(&self) -> Result<Case, OcpError> {
        (self.pose)()
    }
}

/// A problem ready to be solved.
#[derive(Clone)]
pub struct Case {
    /// The problem.
    pub ocp: Ocp,
    /// A simple start: straight lines unless the module says otherwise.
    pub guess: Guess,
}

impl Case {
    /// A problem that starts in motion where it may, and from straight lines between its bounds where it may not.
    pub(crate) fn from_bounds(ocp: Ocp) -> Self {
        let guess = Guess::linear(&ocp).in_motion(&ocp);
        Self { ocp, guess }
    }

    /// A problem of one phase that starts from straight lines between two rows `(time, states, controls)`.
    pub(crate) fn from_ends(
        ocp: Ocp,
        start: (f64, &[f64], &[f64]),
        end: (f64, &[f64], &[f64]),
    ) -> Result<Self, OcpError> {
        let phase = apsides_ocp::PhaseGuess::samples(
            &[start.0, end.0],
            vec![start.1.to_vec(), end.1.to_vec()],
            vec![start.2.to_vec(), end.2.to_vec()],
        )?;
        let guess = Guess::from_phases(&ocp, vec![phase]);
        Ok(Self { ocp, guess })
    }
}

/// The best value of the objective, in its own sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimum {
    /// Value in `unit`.
    pub value: f64,
    /// Unit, `-` for none.
    pub unit: &'static str,
    /// Largest relative difference from `value` that the reference supports.
    pub relative_tolerance: f64,
    /// Evidence for the value.
    pub evidence: Evidence,
    /// Source of statement and value.
    pub source: &'static str,
}

impl Optimum {
    /// `(objective - value) / |value|`: negative when the objective is below the optimum.
    #[must_use]
    pub fn relative_difference(&self, objective: f64) -> f64 {
        (objective - self.value) / self.value.abs()
    }

    /// Returns true if an objective agrees with the optimum to its tolerance.
    #[must_use]
    pub fn agrees_with(&self, objective: f64) -> bool {
        self.relative_difference(objective).abs() <= self.relative_tolerance
    }
}

/// The evidence for the value of an optimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// A formula, or quadrature and root finding to double precision.
    ClosedForm,
    /// A printed or asserted value of one source.
    Published,
    /// Several programs that agree to the tolerance.
    SeveralPrograms,
}

/// The structure of an optimal control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Structure {
    /// Analytic along the phase.
    Smooth,
    /// Continuous or smooth between the ends of constrained arcs: kinks that a mesh must find.
    Constrained,
    /// Jumps between bounds.
    BangBang,
    /// Arcs inside the bounds where the Hamiltonian does not depend on the control.
    Singular,
}
