//! The solve of one mesh: the solution of the nonlinear program and its error between the points.

use std::time::Duration;

use apsides_nlp::{NlpSettings, Observer, SolveReport, Status};
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Mesh, Ocp, PhaseMesh, Trajectory};

use crate::RadauError;
use crate::error_estimate::{Estimate, estimate};
use crate::idle_controls::keep_idle;
use crate::saddle::Watch;
use crate::settings::RadauSettings;
use crate::solver::{MeshRecord, RadauSolution};
use crate::switches::{Known, Structure};
use crate::transcription::Transcription;

/// A mesh that was just solved, with success or without.
pub(crate) struct MeshSolve {
    pub(crate) nlp: Transcription,
    pub(crate) report: SolveReport,
    pub(crate) trajectory: Trajectory,
    pub(crate) estimate: Estimate,
    /// True if nothing shows that the solution is a minimum.
    pub(crate) in_doubt: bool,
}

impl MeshSolve {
    pub(crate) fn new(
        ocp: &Ocp,
        mut nlp: Transcription,
        guess: &Guess,
        settings: &RadauSettings,
        nlp_settings: &NlpSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, RadauError> {
        let mut watch = Watch::new(observer);
        let report = nlp.solve(ocp, guess, nlp_settings, &mut watch)?;
        let in_doubt = watch.is_in_doubt();
        let solve = Self::of_report(ocp, nlp, settings, report)?;
        Ok(Self { in_doubt, ..solve })
    }

    /// The trajectory of a report with its error between the points.
    pub(crate) fn of_report(
        ocp: &Ocp,
        nlp: Transcription,
        settings: &RadauSettings,
        report: SolveReport,
    ) -> Result<Self, RadauError> {
        let mut trajectory = nlp.trajectory(ocp, &report)?;
        keep_idle(ocp, &nlp.quantity_scales, &mut trajectory);
        let estimate = estimate(ocp, &nlp.quantity_scales, settings, &mut trajectory)?;
        Ok(Self { nlp, report, trajectory, estimate, in_doubt: false })
    }

    /// The solution of this mesh alone, which was solved with success.
    pub(crate) fn into_solution(
        mut self,
        ocp: &Ocp,
        settings: &RadauSettings,
        record: MeshRecord,
    ) -> RadauSolution {
        let structure = Structure::of(ocp, &mut self.nlp, &self.report, &self.trajectory, &Known::default());
        RadauSolution {
            status: self.status(),
            accurate: self.is_accurate(settings) && self.is_in_bounds(settings),
            stalled: false,
            adrift: false,
            meshes: vec![record],
            unmet: None,
            warnings: Vec::new(),
            switches: structure.switches(ocp, &self.trajectory),
            trajectory: self.trajectory,
            report: self.report,
        }
    }

    pub(crate) fn record(&self, mesh: &Mesh, time: Duration) -> MeshRecord {
        let layout = &self.nlp.layout;
        MeshRecord {
            intervals: mesh.phases.iter().map(PhaseMesh::intervals).sum(),
            points: total_points(mesh),
            error: self.estimate.error,
            objective: self.trajectory.objective,
            counters: Counters::of(layout.variables, layout.constraints, &self.report),
            restorations: self.report.counters.restorations,
            time,
        }
    }

    pub(crate) fn status(&self) -> Status {
        self.report.status
    }

    /// True if states and integrals meet the tolerance.
    pub(crate) fn is_accurate(&self, settings: &RadauSettings) -> bool {
        self.estimate.error <= settings.tolerance
    }

    /// True if controls, and path constraints with controls, meet the tolerance.
    pub(crate) fn is_in_bounds(&self, settings: &RadauSettings) -> bool {
        self.estimate.controls <= settings.tolerance
    }
}

/// Collocation points of all phases.
pub(crate) fn total_points(mesh: &Mesh) -> usize {
    mesh.phases.iter().map(PhaseMesh::total_points).sum()
}
