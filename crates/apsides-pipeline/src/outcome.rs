//! The outcome of a solve, and its summary for files and scripts.

use std::borrow::Cow;
use std::collections::BTreeMap;

use apsides_nlp::{SolveReport, Status};
use apsides_ocp::{Ocp, Trajectory};
use apsides_verify::Certificate;
use serde::{Deserialize, Serialize};

use crate::explanation::ExplanationSummary;

use crate::site::{ChosenSite, SiteSummary};

/// Name, value and unit of the objective.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectiveValue {
    /// Name, for instance `flight_time`.
    pub name: String,
    /// Value in `unit`.
    pub value: f64,
    /// Unit.
    pub unit: String,
}

/// Work that a solve took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Interior-point iterations over all meshes.
    pub iterations: usize,
    /// Factorisations over all meshes.
    pub factorisations: usize,
    /// Variables of the last discretised problem.
    pub variables: usize,
    /// Constraints of the last discretised problem.
    pub constraints: usize,
    /// Meshes solved.
    pub mesh_iterations: usize,
}

impl From<apsides_ocp::method::Counters> for Counters {
    fn from(work: apsides_ocp::method::Counters) -> Self {
        Self {
            iterations: work.iterations,
            factorisations: work.factorisations,
            variables: work.variables,
            constraints: work.constraints,
            mesh_iterations: work.discretisations,
        }
    }
}

/// Wall-clock times in ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Mission to problem, guess and first mesh.
    pub build: f64,
    /// All solves.
    pub solve: f64,
    /// Verification.
    pub verify: f64,
}

/// The search that a solve began with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchSummary {
    /// Its algorithm.
    pub algorithm: String,
    /// Decision variables of a profile.
    pub variables: usize,
    /// Flights.
    pub evaluations: usize,
    /// Generations.
    pub generations: usize,
    /// Flights that failed.
    pub failures: usize,
    /// The reason for which it ended: `budget`, `time-limit`, `converged`, `interrupted`, `all-failed`.
    pub stop: String,
    /// Objective of the start that it found, without what misses and excesses cost; none where all flights failed.
    pub objective: Option<f64>,
    /// Distance of the end of that start from the target, km.
    pub miss_km: Option<f64>,
    /// Wall-clock time, ms.
    pub time_ms: f64,
    /// Flights so far, and the best objective with what misses and excesses cost.
    pub history: Vec<[f64; 2]>,
    /// A failure beside the search, such as a checkpoint that could not be written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remark: Option<String>,
}

/// The stable summary of a solve: its JSON form is what scripts read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Mission name.
    pub mission: String,
    /// Name of the method that was asked.
    pub method: String,
    /// Name of the method whose solution it is; another one where the method that was asked did not converge.
    #[serde(default)]
    pub solved_by: String,
    /// `optimal`, `acceptable`, `infeasible`, ...
    pub status: String,
    /// One sentence for the reader when the status is not `optimal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// The requirements that conflict, and what helps, when the mission cannot be flown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub explanation: Option<ExplanationSummary>,
    /// The objective.
    pub objective: ObjectiveValue,
    /// Mission scalars; the unit ends the key.
    pub results: BTreeMap<String, f64>,
    /// Work.
    pub counters: Counters,
    /// Times.
    pub timing_ms: Timing,
    /// Verdict and checks.
    pub certificate: Certificate,
    /// The search that the solve began with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchSummary>,
    /// Scales of the statement that do not fit, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Switches along the trajectory, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub switches: Vec<String>,
    /// Sites that were chosen on maps, in the order of the flight.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sites: Vec<SiteSummary>,
    /// Prices of the keys, when they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<Vec<Price>>,
}

/// A curve that a mission wants drawn besides the standard ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Title of the figure.
    pub title: String,
    /// Name and unit of the abscissa.
    pub x: (String, String),
    /// Name and unit of the ordinate.
    pub y: (String, String),
    /// Name and points of each line.
    pub series: Vec<(String, Vec<[f64; 2]>)>,
}

/// The decisions of a mission on the way: sites on maps, the end of a stage that is optimised for itself.
#[derive(Clone, Debug, Default)]
pub struct Decisions {
    /// Numbers of keys that were open, as they were decided.
    pub values: Vec<(Cow<'static, str>, f64)>,
    /// Sites, in the order of the flight.
    pub sites: Vec<ChosenSite>,
}

/// Derivatives with respect to one key, all per unit of the key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Price {
    /// Path of the key.
    pub key: String,
    /// Its value.
    pub value: f64,
    /// Its unit; empty without one.
    pub unit: String,
    /// The derivative of the objective, in the objective's unit. None where the key moves some of the active requirements that depend on each
    /// other, so that more of it and less of it have prices of their own, or no feasible trajectory.
    pub objective: Option<f64>,
    /// The derivatives of the mission's scalars, in the unit that ends each key. Empty where the solution is not an isolated optimum,
    /// so that only the objective has a derivative, and where that has none.
    pub results: BTreeMap<String, f64>,
}

/// A problem that was solved in place of a whole flight, and its solution.
pub struct Reduced {
    /// The problem.
    pub ocp: Ocp,
    /// Its solution, or the best approximation reached.
    pub trajectory: Trajectory,
}

/// Everything that a solve of a mission returns.
pub struct Outcome {
    /// The whole flight as a problem.
    pub ocp: Ocp,
    /// Its solution, or the best approximation reached.
    pub trajectory: Trajectory,
    /// The problem that was solved in its place, if the flight follows from a smaller problem.
    pub reduced: Option<Reduced>,
    /// The status at the end of the solve.
    pub status: Status,
    /// Report of the last discretised problem, if the method solves one.
    pub report: Option<SolveReport>,
    /// The numbers.
    pub summary: Summary,
    /// Keys of the results that name a case in a table, in order.
    pub headline: Vec<String>,
    /// The mission's own figures.
    pub curves: Vec<Curve>,
    /// The mission file that gives this result again, with every value written out.
    pub mission_file: String,
    /// The decisions before the flight was posed.
    pub decisions: Decisions,
    /// One sentence for the reader when the status is not `optimal`.
    pub explanation: Option<String>,
    /// Its name in the open [`record`](crate::record), if there is one.
    pub kept: Option<String>,
}

impl Outcome {
    /// The problem that was solved, and its solution: where a neighbouring case starts.
    #[must_use]
    pub fn solved(&self) -> (&Ocp, &Trajectory) {
        self.reduced.as_ref().map_or((&self.ocp, &self.trajectory), |r| (&r.ocp, &r.trajectory))
    }
}
