//! The solution of a mesh, and which of two is kept.

use apsides_nlp::{SolveReport, Status};
use apsides_ocp::{Mesh, Ocp, Trajectory, Unmet};

use crate::scales::ScaleWarning;
use crate::solver::{MeshRecord, RadauSolution, may_go_on};
use crate::switches::Switch;

/// Least fall of the objective that counts, relative.
const LEAST_FALL: f64 = 1e-10;
/// A gain of the objective, relative, in units of the error of its mesh, from which on it is that of another solution.
const BEYOND_ERROR: f64 = 1e2;

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
    /// True if no mesh came to carry the flight.
    pub(crate) adrift: bool,
    /// The next mesh without any breaks, should those of the next one lead nowhere.
    pub(crate) plain: Mesh,
}

impl Solved {
    /// The solution of a solve that was not followed up.
    pub(crate) fn first(trajectory: Trajectory, report: SolveReport, mesh: Mesh) -> Self {
        let (accurate, within, has_its_arcs, stalled, adrift) = (false, false, false, false, false);
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
            adrift,
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

    /// True if one before, accurate or with a smaller error, is the better answer of a sequence of meshes that ended with this one and a status.
    pub(crate) fn is_left_for(&self, before: &Self, status: Status, ocp: &Ocp) -> bool {
        if !may_go_on(status) || self.accurate && status.is_success() {
            return before.is_preferred_to(self, ocp);
        }
        let [own, other] = [self, before].map(|s| s.trajectory.objective);
        let gains = status.is_success() && is_lower(ocp, own, other);
        let gain = (own - other).abs() / own.abs().max(other.abs());
        let is_another = gains && gain > BEYOND_ERROR * self.error;
        !is_another && (before.accurate && !gains || before.error < self.error)
    }

    pub(crate) fn into_solution(
        self,
        status: Status,
        unmet: Option<Unmet>,
        meshes: Vec<MeshRecord>,
        warnings: Vec<ScaleWarning>,
    ) -> RadauSolution {
        let Self { trajectory, report, switches, accurate, stalled, adrift, .. } = self;
        RadauSolution {
            trajectory,
            status,
            accurate,
            stalled,
            adrift,
            meshes,
            unmet,
            warnings,
            switches,
            report,
        }
    }
}

/// True if an objective is better than another one by more than rounding.
pub(crate) fn is_lower(ocp: &Ocp, objective: f64, other: f64) -> bool {
    ocp.objective.sense.sign() * (other - objective) > LEAST_FALL * other.abs().max(objective.abs())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::{Radau, RadauSettings};

    /// An accurate solution with controls within their bounds.
    fn solved(status: Status, has_its_arcs: bool, objective: f64, from: &RadauSolution) -> Solved {
        let (mut trajectory, mut report) = (from.trajectory.clone(), from.report.clone());
        (trajectory.objective, report.status) = (objective, status);
        let first = Solved::first(trajectory, report, from.trajectory.mesh());
        Solved { accurate: true, within: true, has_its_arcs, ..first }
    }

    #[test]
    fn an_exact_solution_with_its_arcs_is_kept_unless_a_later_one_is_lower() {
        use Status::{Acceptable, Optimal};
        let case = apsides_problems::find("di_min_energy").unwrap().pose().unwrap();
        let ocp = &case.ocp;
        let method = Radau { settings: RadauSettings { max_refinements: 0, ..RadauSettings::default() } };
        let solution = method.solve(ocp, &case.guess).unwrap();
        let solved = |status, has_its_arcs, objective| solved(status, has_its_arcs, objective, &solution);
        let exact = solved(Optimal, true, 12.0);
        let (rounding, fall) = (0.1 * LEAST_FALL, 10.0 * LEAST_FALL);
        // One that is solved less exactly has to be lower by more than rounding.
        assert!(exact.is_preferred_to(&solved(Acceptable, true, 12.0), ocp));
        assert!(exact.is_preferred_to(&solved(Acceptable, true, 12.0 * (1.0 - rounding)), ocp));
        assert!(!exact.is_preferred_to(&solved(Acceptable, true, 12.0 * (1.0 - fall)), ocp));
        // One that is solved as exactly replaces it, unless it is higher and has not the arcs that it shows.
        assert!(!exact.is_preferred_to(&solved(Optimal, true, 12.0 * (1.0 + fall)), ocp));
        assert!(exact.is_preferred_to(&solved(Optimal, false, 12.0 * (1.0 + fall)), ocp));
        assert!(!exact.is_preferred_to(&solved(Optimal, false, 12.0), ocp));
        // Nothing is kept that is not accurate, or beyond its bounds between the points.
        let later = solved(Acceptable, false, 13.0);
        for (accurate, within) in [(false, true), (true, false)] {
            assert!(!Solved { accurate, within, ..exact.clone() }.is_preferred_to(&later, ocp));
        }
        // What fell short of its tolerance is left for what did not, unless it found a better solution.
        let short = |objective, error| Solved { accurate: false, error, ..solved(Optimal, true, objective) };
        assert!(short(12.0, 1e-8).is_left_for(&exact, Optimal, ocp));
        assert!(!short(11.9, 1e-8).is_left_for(&Solved { error: 1e-12, ..exact.clone() }, Optimal, ocp));
        assert!(short(11.9, 1e-3).is_left_for(&Solved { error: 1e-12, ..exact.clone() }, Optimal, ocp));
    }
}
