//! The two missions with changed values.

use std::collections::BTreeMap;

use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_verify::Verdict;

use crate::change::{Change, word};
use crate::sheet::Sheet;
use crate::stop::{Stop, solved};
use crate::{Observer, Outcome, Pipeline};

pub(super) const BRAKING: &str = "chang-e-3-braking";
pub(super) const LANDING: &str = "chang-e-3-flat";
/// Thrust of the vehicle, N.
pub(super) const THRUST: f64 = 7500.0;
/// Mass at the perilune, kg.
pub(super) const MASS: f64 = 2400.0;

/// The solution of one case that the sheets report.
pub(super) struct SolvedCase {
    pub(super) results: BTreeMap<String, f64>,
    pub(super) trajectory: Trajectory,
    pub(super) verdict: Verdict,
    pub(super) failed_checks: Vec<String>,
}

impl SolvedCase {
    pub(super) fn of(outcome: Outcome) -> Self {
        let certificate = &outcome.summary.certificate;
        Self {
            verdict: certificate.verdict,
            failed_checks: certificate.failures().map(|c| c.name.clone()).collect(),
            results: outcome.summary.results,
            trajectory: outcome.trajectory,
        }
    }

    /// A result of the mission; NaN where it has none of this name.
    pub(super) fn get(&self, key: &str) -> f64 {
        self.results.get(key).copied().unwrap_or(f64::NAN)
    }

    pub(super) fn verified(&self) -> bool {
        self.verdict >= Verdict::Extremal
    }

    /// Lists a solution without a verified certificate in the sheet.
    pub(super) fn check(&self, label: &str, sheet: &mut Sheet) {
        if !self.verified() {
            sheet.unverified.push(format!("{label}: {}", self.failed_checks.join(", ")));
        }
    }

    /// Times at which the throttle of the first phase jumps, s.
    pub(super) fn switches(&self) -> Vec<f64> {
        self.trajectory.phases.first().map(breaks).unwrap_or_default()
    }
}

fn breaks(phase: &PhaseTrajectory) -> Vec<f64> {
    let of = |end: usize| phase.time_at(phase.mesh.fractions()[end]);
    phase.mesh.breaks().iter().filter(|b| b.free).map(|b| of(b.end)).collect()
}

/// The motion in the plane of the orbit.
pub(super) const PLANE: Change<'static> = word("motion", "plane");

/// The mission with changed values, and what its solve returns, on one thread.
pub(super) fn outcome(
    mission: &str,
    changes: &[Change<'_>],
    observer: &mut dyn Observer,
) -> Result<(Pipeline, Outcome), Stop> {
    solve_from(mission, changes, None, observer)
}

/// The same from a solution of another case.
pub(super) fn solve_from(
    mission: &str,
    changes: &[Change<'_>],
    start: Option<&Trajectory>,
    observer: &mut dyn Observer,
) -> Result<(Pipeline, Outcome), Stop> {
    solved(mission, changes, 1, start, observer)
}

pub(super) fn solve(
    mission: &str,
    changes: &[Change<'_>],
    observer: &mut dyn Observer,
) -> Result<SolvedCase, Stop> {
    outcome(mission, changes, observer).map(|(_, o)| SolvedCase::of(o))
}

/// The mission with changed values.
pub(super) fn load(mission: &str, changes: &[Change<'_>]) -> Result<Pipeline, Stop> {
    Ok(crate::load(mission, changes)?)
}
