//! The re-entry in the two models of the reference, and its solves.

use apsides_dynamics::Quantity;
use apsides_dynamics::entry::STATES;
use apsides_nlp::{Flow, IterationRecord, Status};

use apsides_ocp::{Guess, Mesh, Ocp};

use super::reference::{
    FINE_E, FINE_U, Fine, MESH, ReferenceRow, TABLE_E, TABLE_U, TOLERANCE_E, TOLERANCE_U,
};
use crate::change::{Change, flag, number, word};
use crate::stop::Stop;
use crate::{Error, Observer, Outcome, Pipeline, SearchProgress};
use apsides_pipeline::method::MethodName;

/// Exponential atmosphere and constant coefficients, or US76 and a trim table over the Mach number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    E,
    U,
}

impl Model {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::E => "E",
            Self::U => "U",
        }
    }

    const fn mission(self) -> &'static str {
        match self {
            Self::E => "capsule-reentry",
            Self::U => "capsule-reentry-us76",
        }
    }

    pub(super) const fn reference(self) -> (&'static [ReferenceRow], f64, Fine) {
        match self {
            Self::E => (TABLE_E, TOLERANCE_E, FINE_E),
            Self::U => (TABLE_U, TOLERANCE_U, FINE_U),
        }
    }
}

/// Limits on dynamic pressure (kPa), acceleration (m/s2) and heat rate (kW/m2); infinite where there is none.
pub(super) type Limits = [f64; 3];

const LIMIT_KEYS: [&str; 3] = ["dynamic_pressure_limit_kpa", "load_limit_m_s2", "heat_rate_limit_kw_m2"];
const PEAK_KEYS: [&str; 3] = ["peak_dynamic_pressure_kpa", "peak_load_m_s2", "peak_heat_rate_kw_m2"];
/// A load this near to its limit makes it an active one.
const ACTIVE: f64 = 1.0 - 1e-4;

/// `15 / - / 800`.
pub(super) fn label(limits: Limits) -> String {
    limits.map(|l| if l.is_finite() { l.to_string() } else { "-".into() }).join(" / ")
}

/// The mission under limits.
pub(super) fn mission(model: Model, limits: Limits, changes: &[Change<'_>]) -> Result<Pipeline, Error> {
    let mut all: Vec<Change<'_>> = LIMIT_KEYS.iter().zip(limits).map(|(key, l)| number(key, l)).collect();
    all.push(flag("margins", false));
    all.extend_from_slice(changes);
    crate::load(model.mission(), &all)
}

/// The numbers of one solve in a table.
#[derive(Clone, Debug)]
pub(super) struct SolveNumbers {
    /// MJ/m2.
    pub(super) heat_load: f64,
    /// s.
    pub(super) flight_time: f64,
    /// Largest loads by their limits.
    pub(super) by_limit: [Option<f64>; 3],
    /// Checks of the certificate that fail.
    pub(super) failed_checks: Vec<String>,
    pub(super) verified: bool,
    /// Iterations on the first mesh; none of a solve that was kept, of which nobody saw the iterations.
    pub(super) first_mesh_iterations: Option<usize>,
    /// Iterations on all meshes.
    pub(super) iterations: usize,
    pub(super) meshes: usize,
    /// Times of the search and of the rest, s.
    pub(super) times: [f64; 2],
    /// Time (s) and bank angle (deg).
    pub(super) bank: Vec<[f64; 2]>,
    /// Dynamic pressure (kPa), acceleration (m/s2) and heat rate (kW/m2) over time (s).
    pub(super) loads: [Vec<[f64; 2]>; 3],
    /// States over time, with their names and units.
    pub(super) states: Vec<Line>,
    /// The optimum on the mesh of the reference, without refinement, if that was asked for; MJ/m2.
    pub(super) same_mesh: Option<f64>,
}

/// A quantity over time, with its name and unit.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) points: Vec<[f64; 2]>,
}

impl SolveNumbers {
    pub(super) fn active(&self) -> [bool; 3] {
        self.by_limit.map(|ratio| ratio.is_some_and(|r| r > ACTIVE))
    }
}

/// Counts iterations mesh by mesh.
struct Meshes<'a> {
    observer: &'a mut dyn Observer,
    last: Vec<usize>,
}

impl Observer for Meshes<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> Flow {
        match self.last.last_mut() {
            Some(last) if record.iteration > 0 => *last = record.iteration,
            _ => self.last.push(record.iteration),
        }
        self.observer.iteration(record)
    }

    fn generation(&mut self, search: &SearchProgress) -> Flow {
        self.observer.generation(search)
    }
}

/// The start of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Begin {
    /// At straight lines.
    Straight,
    /// At the best flight of a search.
    Search,
}

/// Solves a case and flies it again.
pub(super) fn solve(
    model: Model,
    limits: Limits,
    begin: Begin,
    observer: &mut dyn Observer,
) -> Result<SolveNumbers, Stop> {
    let (outcome, iterations) = outcome(model, limits, begin, observer)?;
    Ok(solved(&outcome, limits, &iterations))
}

/// The same with the optimum on the mesh of the reference.
pub(super) fn solve_twice(
    model: Model,
    limits: Limits,
    begin: Begin,
    observer: &mut dyn Observer,
) -> Result<SolveNumbers, Stop> {
    let (outcome, iterations) = outcome(model, limits, begin, observer)?;
    let mission = mission(model, limits, &[])?;
    let ocp = mission.pose()?.ocp;
    let mut method = mission.methods().radau.method();
    method.settings.max_refinements = 0;
    let mesh = Mesh::uniform(&ocp, MESH[0], MESH[1])?;
    let (_, optimum) = outcome.solved();
    let solution = method.solve_on(&ocp, &Guess::earlier(optimum), mesh, observer)?;
    if solution.status == Status::Interrupted {
        return Err(Stop::Interrupted);
    }
    let same_mesh = solution.status.is_success().then_some(solution.trajectory.objective);
    Ok(SolveNumbers { same_mesh, ..solved(&outcome, limits, &iterations) })
}

/// The outcome of a solve, and its iterations mesh by mesh.
fn outcome(
    model: Model,
    limits: Limits,
    begin: Begin,
    observer: &mut dyn Observer,
) -> Result<(Outcome, Vec<usize>), Stop> {
    let method = if begin == Begin::Search { MethodName::TwoLayer } else { MethodName::Radau };
    let mission = mission(model, limits, &[word("method", method.word())])?;
    let mut observer = Meshes { observer, last: Vec::new() };
    let outcome = mission.solve(None, &mut observer)?;
    if outcome.status == Status::Interrupted {
        return Err(Stop::Interrupted);
    }
    if !outcome.status.is_success() {
        let why = outcome.explanation.as_deref().unwrap_or(&outcome.summary.status);
        return Err(Stop::NotSolved(format!("{}, {}: {why}", model.name(), label(limits))));
    }
    Ok((outcome, observer.last))
}

fn solved(outcome: &Outcome, limits: Limits, iterations: &[usize]) -> SolveNumbers {
    let summary = &outcome.summary;
    let result = |key: &str| summary.results.get(key).copied().unwrap_or(f64::NAN);
    let ratio = |k: usize| limits[k].is_finite().then(|| result(PEAK_KEYS[k]) / limits[k]);
    let search = summary.search.as_ref().map_or(0.0, |s| s.time_ms);
    SolveNumbers {
        heat_load: result("heat_load_mj_m2"),
        flight_time: result("flight_time_s"),
        by_limit: [0, 1, 2].map(ratio),
        // A mesh that stays too coarse is one more.
        failed_checks: (summary.certificate.failures().map(|c| c.name.clone()))
            .chain(outcome.explanation.as_ref().map(|_| summary.status.clone()))
            .collect(),
        verified: summary.certificate.is_verified() && outcome.explanation.is_none(),
        first_mesh_iterations: iterations.first().copied(),
        iterations: summary.counters.iterations,
        meshes: summary.counters.mesh_iterations,
        times: [search / 1e3, (summary.timing_ms.solve - search) / 1e3],
        bank: bank(&outcome.trajectory),
        loads: [0, 1, 2].map(|k| load(outcome, k, limits[k])),
        states: states(&outcome.ocp, &outcome.trajectory),
        same_mesh: None,
    }
}

/// The figure of a mission with its loads by their limits, or by their peaks where they have none.
const LOADS: &str = "Loads relative to their limits, or to their peaks";
const LOAD_NAMES: [&str; 3] = ["dynamic pressure", "aerodynamic acceleration", "heat rate"];

/// A load over time, in the unit of its limit.
fn load(outcome: &Outcome, k: usize, limit: f64) -> Vec<[f64; 2]> {
    let size = match limit.is_finite() {
        true => limit,
        false => outcome.summary.results.get(PEAK_KEYS[k]).copied().unwrap_or(f64::NAN),
    };
    let curve = outcome.curves.iter().find(|c| c.title == LOADS);
    let series = curve.and_then(|c| c.series.iter().find(|(name, _)| name == LOAD_NAMES[k]));
    let points = series.map_or(&[][..], |(_, points)| points);
    points.iter().map(|[time, part]| [*time, part * size]).collect()
}

/// The six states over time: lengths in km, angles in deg, speeds in m/s.
pub(super) fn states(ocp: &Ocp, trajectory: &apsides_ocp::Trajectory) -> Vec<Line> {
    let (Some(phase), Some(flown)) = (ocp.phases.first(), trajectory.phases.first()) else {
        return Vec::new();
    };
    let line = |quantity: &Quantity| {
        let k = phase.states.iter().position(|s| s.variable.name == quantity.name)?;
        let (factor, unit) = match quantity.unit {
            "m" => (1e-3, "km"),
            "rad" => (1_f64.to_degrees(), "deg"),
            unit => (1.0, unit),
        };
        let at = |n: usize| {
            let time = sampled(flown, n);
            [time, flown.state_at(time).get(k).map_or(f64::NAN, |v| v * factor)]
        };
        Some(Line { name: quantity.name, unit, points: (0..=SAMPLES).map(at).collect() })
    };
    STATES.iter().filter_map(line).collect()
}

/// The time of a sample of a flight.
fn sampled(phase: &apsides_ocp::PhaseTrajectory, k: usize) -> f64 {
    let part = k as f64 / SAMPLES as f64;
    phase.initial_time * (1.0 - part) + phase.final_time * part
}

/// Samples of a curve of the bank angle.
const SAMPLES: usize = 400;

/// Bank angle over time.
pub(super) fn bank(t: &apsides_ocp::Trajectory) -> Vec<[f64; 2]> {
    let Some(phase) = t.phases.first() else { return Vec::new() };
    let at = |k: usize| {
        let time = sampled(phase, k);
        [time, bank_of(&phase.control_at(time))]
    };
    (0..=SAMPLES).map(at).collect()
}

/// Bank angle at the nodes of a flight along a profile: between them the polynomials of a mesh swing where the profile jumps.
pub(super) fn bank_at_nodes(t: &apsides_ocp::Trajectory) -> Vec<[f64; 2]> {
    let Some(phase) = t.phases.first() else { return Vec::new() };
    let control = &phase.control;
    let mut value = vec![0.0; control.dimension()];
    let nodes = (0..control.segments().len()).flat_map(|k| control.node_times(k).map(move |time| (k, time)));
    nodes
        .map(|(k, time)| {
            control.evaluate_in(k, time, &mut value);
            [time, bank_of(&value)]
        })
        .collect()
}

/// Bank angle (deg) of a control: the angle, or its cosine and sine.
fn bank_of(control: &[f64]) -> f64 {
    let bank = match *control {
        [cos, sin] => sin.atan2(cos),
        ref angle => angle.first().copied().unwrap_or(f64::NAN),
    };
    bank.to_degrees()
}
