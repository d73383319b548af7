//! Programs for others: from a problem to its program, and from a decision vector and its multipliers back to the problem.

use apsides_nlp::SolveReport;
use apsides_ocp::{Guess, Ocp, PhaseTrajectory, Trajectory};

use crate::discretisation::Discretisation;
use crate::phase::PhaseLayout;
use crate::transcription::Transcription;

impl<D: Discretisation> Transcription<D> {
    /// The point of a report if it is a trajectory, else the start of the solve.
    ///
    /// A point that is none, because a phase does not last or a number is not finite, can come from a solve that failed.
    #[must_use]
    pub fn usable_point<'a>(&'a self, report: &'a SolveReport) -> &'a [f64] {
        let x = &report.x;
        let usable = x.iter().all(|v| v.is_finite()) && self.layout.phases.iter().all(|p| p.lasts(x));
        if usable { x } else { &self.start }
    }

    /// The trajectory of these phases at a point, with objective and multipliers of a report.
    #[must_use]
    pub fn joined(
        &self,
        ocp: &Ocp,
        report: &SolveReport,
        x: &[f64],
        phases: Vec<PhaseTrajectory>,
    ) -> Trajectory {
        let y = &report.constraint_multipliers;
        let constraints = ocp.constraints.iter().zip(&self.layout.endpoint_rows);
        let multipliers = constraints.map(|(c, &first)| y[first..first + c.rows.len()].to_vec());
        Trajectory {
            phases,
            parameters: x[self.layout.parameter_columns()].to_vec(),
            objective: self.sign() * report.objective,
            constraint_multipliers: Some(multipliers.collect()),
        }
    }

    /// The weight of each integral of a phase in the Lagrangian: that in the minimised cost, and the multiplier of its bounds.
    #[must_use]
    pub fn integral_weights(&self, ocp: &Ocp, phase: usize, constraint_multipliers: &[f64]) -> Vec<f64> {
        let rows = self.layout.phases[phase].ends().integral_rows.iter().enumerate();
        rows.map(|(k, row)| {
            let cost = ocp.objective.integral_weight(phase, k);
            self.sign() * cost + row.map_or(0.0, |r| constraint_multipliers[r])
        })
        .collect()
    }
}

/// A discretisation whose programs others may ask for, to hand them to a solver of their own
/// ([`Transcription::new`], [`Transcription::trajectory`]).
pub trait Transcribe: Discretisation {
    /// The division of the phases.
    type Division: ?Sized;
    /// Reasons to refuse a problem.
    type Error;

    /// Discretises a problem.
    ///
    /// # Errors
    /// When division or guess do not fit the problem.
    fn transcribe(
        ocp: &Ocp,
        division: &Self::Division,
        guess: &Guess,
    ) -> Result<Transcription<Self>, Self::Error>;

    /// The trajectory of a point and its multipliers.
    ///
    /// # Errors
    /// When neither the point nor the start of the solve is a trajectory.
    fn trajectory(
        nlp: &Transcription<Self>,
        ocp: &Ocp,
        report: &SolveReport,
    ) -> Result<Trajectory, Self::Error>;
}

impl<D: Transcribe> Transcription<D> {
    /// Discretises a problem.
    ///
    /// # Errors
    /// When division or guess do not fit the problem.
    pub fn new(ocp: &Ocp, division: &D::Division, guess: &Guess) -> Result<Self, D::Error> {
        D::transcribe(ocp, division, guess)
    }

    /// The trajectory of a point and its multipliers, with costates; of the start of the solve where the point is no trajectory.
    ///
    /// # Errors
    /// When the start is no trajectory either.
    pub fn trajectory(&self, ocp: &Ocp, report: &SolveReport) -> Result<Trajectory, D::Error> {
        D::trajectory(self, ocp, report)
    }
}
