//! The solution of a mesh, and which of two is kept.

use apsides_nlp::{SolveReport, Status};
use apsides_ocp::{Mesh, Ocp, Trajectory, Unmet};

use crate::scales::ScaleWarning;
use crate::solver::{MeshRecord, RadauSolution};
use crate::switches::Switch;

/// Least fall of the objective that counts, relative.
const LEAST_FALL: f64 = 1e-10;

/// A mesh that was solved.
#[derive(Clone)]
pub(crate) struct Solved {
    pub(crate) trajectory: Trajectory,
    pub(crate) report: SolveReport,
    pub(crate) switches: Vec<Switch>,
    /// Error between the points.
    pub(crate) error: f64,
    /// Excess of states and of rows without controls.
    pub(crate) beyond: f64,
    pub(crate) accurate: bool,
    /// True if controls are within their bounds between the points too.
    pub(crate) within: bool,
    /// True if the mesh has the arcs that its solution shows.
    pub(crate) has_its_arcs: bool,
    pub(crate) stalled: bool,
    /// The next mesh without any breaks, should those of the next one lead nowhere.
    pub(crate) plain: Mesh,
}

impl Solved {
    /// The solution of a solve that was not followed up.
    pub(crate) fn first(trajectory: Trajectory, report: SolveReport, mesh: Mesh) -> Self {
        let (accurate, within, has_its_arcs, stalled) = (false, false, false, false);
        let (error, beyond) = (f64::INFINITY, f64::INFINITY);
        let switches = Vec::new();
        Self {
            trajectory,
            report,
            switches,
            error,
            beyond,
            accurate,
            within,
            has_its_arcs,
            stalled,
            plain: mesh,
        }
    }

    /// True where of two accurate solutions this one, of a mesh before, is lower, and the mesh of the other has not the arcs that it shows: structures
    /// can take turns. True, too, where the other is solved less exactly and is no lower.
    pub(crate) fn is_preferred_to(&self, later: &Self, ocp: &Ocp) -> bool {
        if !(self.accurate && self.within) {
            return false;
        }
        let (own, other) = (self.trajectory.objective, later.trajectory.objective);
        let is_exact = self.report.status == Status::Optimal;
        if is_exact && self.has_its_arcs && later.report.status != Status::Optimal {
            return !is_lower(ocp, other, own);
        }
        let is_solved = is_exact || self.report.status == later.report.status;
        is_solved && !later.has_its_arcs && is_lower(ocp, own, other)
    }

    pub(crate) fn into_solution(
        self,
        status: Status,
        unmet: Option<Unmet>,
        meshes: Vec<MeshRecord>,
        warnings: Vec<ScaleWarning>,
    ) -> RadauSolution {
        let Self { trajectory, report, switches, accurate, stalled, .. } = self;
        RadauSolution { trajectory, status, accurate, stalled, meshes, unmet, warnings, switches, report }
    }
}

/// True if an objective is better than another one by more than rounding.
pub(crate) fn is_lower(ocp: &Ocp, objective: f64, other: f64) -> bool {
    ocp.objective.sense.sign() * (other - objective) > LEAST_FALL * other.abs().max(objective.abs())
}
