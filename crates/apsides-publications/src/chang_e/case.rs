//! The two missions with overrides.

use std::collections::BTreeMap;

use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_verify::Verdict;

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
pub(super) struct Solved {
    pub(super) results: BTreeMap<String, f64>,
    pub(super) trajectory: Trajectory,
    pub(super) verdict: Verdict,
    pub(super) failed_checks: Vec<String>,
}

impl Solved {
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

fn overrides(all: &[&str]) -> Vec<String> {
    all.iter().map(|o| (*o).to_owned()).collect()
}

/// The mission with overrides, and what its solve returns, on one thread.
pub(super) fn outcome(
    mission: &str,
    all: &[&str],
    observer: &mut dyn Observer,
) -> Result<(Pipeline, Outcome), Stop> {
    solve_from(mission, all, None, observer)
}

/// The same from a solution of another case.
pub(super) fn solve_from(
    mission: &str,
    all: &[&str],
    start: Option<&Trajectory>,
    observer: &mut dyn Observer,
) -> Result<(Pipeline, Outcome), Stop> {
    solved(mission, &overrides(all), 1, start, observer)
}

pub(super) fn solve(mission: &str, all: &[&str], observer: &mut dyn Observer) -> Result<Solved, Stop> {
    outcome(mission, all, observer).map(|(_, o)| Solved::of(o))
}

/// The mission with overrides.
pub(super) fn load(mission: &str, all: &[&str]) -> Result<Pipeline, Stop> {
    Ok(crate::load(mission, &overrides(all))?)
}
