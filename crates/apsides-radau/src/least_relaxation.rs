//! The motion that is nearest to all requirements: equations of motion hard, requirements relaxed as little as possible, on a mesh that is
//! refined for that motion.

use std::borrow::Cow;
use std::time::{Duration, Instant};

use apsides_nlp::{Nlp, Observer, Requirement as NlpRequirement, relax};
use apsides_ocp::method::Counters;
use apsides_ocp::{Guess, Mesh, Ocp, PhaseMesh, Scaling};

use crate::RadauError;
use crate::error_estimate::estimate;
use crate::invariants::with_invariants;
use crate::joints::Joints;
use crate::mesh_solve::total_points;
use crate::refinement::refine;
use crate::relaxation::{Item, items};
use crate::settings::RadauSettings;
use crate::solver::{MeshRecord, may_go_on};
use crate::transcription::{Transcription, with_movable_bounds};

/// Tolerance of the solves at least. A relaxation leaves most of a trajectory open: to a smaller one the method moves along what is
/// open for a hundred iterations, with the amounts unchanged to nine digits.
const TOLERANCE: f64 = 1e-6;
/// Largest product of a distance and its multiplier: amounts give way by the sum over all limits.
const COMPLEMENTARITY: f64 = 1e-8;
/// Iterations of each of the solves.
const MAX_ITERATIONS: usize = 300;
/// Amounts below this multiple of the tolerance of a solve, relative to the unit of a requirement, count as zero.
const NEGLIGIBLE: f64 = 10.0;
/// Most meshes of each of the solves.
const MAX_MESHES: usize = 5;
/// Most collocation points of each of the solves: an explanation is worth seconds.
const MAX_TOTAL_POINTS: usize = 2000;
/// Error between the points at which amounts are exact enough.
const MESH_TOLERANCE: f64 = 1e-6;
/// The meshes also end when the weighted amounts have settled to `SETTLED`, relative, over two meshes, or over three where
/// the error between the points is above `COARSE_MESH_TOLERANCE`: what a relaxation leaves open, such as a control far
/// from the conflict, may stay rough on every mesh.
const COARSE_MESH_TOLERANCE: f64 = 1e-2;
const SETTLED: f64 = 5e-5;
/// Difference of the amounts, relative, of a motion from which another relaxation may begin: one that has no solution takes many iterations,
/// which a coarser mesh makes short.
const NEAR: f64 = 1e-2;
/// Error between the points at which a motion is a start.
const START_TOLERANCE: f64 = 1e-4;

/// Most work of an explanation, in iterations on its first mesh, a finer one taken to need as many iterations as the last: where a motion gains by
/// ever faster changes of its controls the amounts fall on every mesh, and each takes hundreds.
const MOST_WORK: usize = 600;

/// A problem whose requirements are relaxed.
pub(crate) struct Relaxer<'a> {
    ocp: Cow<'a, Ocp>,
    settings: RadauSettings,
    /// Most work, in iterations on the first mesh, before no more are solved.
    most_work: usize,
}

/// A relaxation on the mesh that it needed.
pub(crate) struct Relaxed {
    pub(crate) nlp: Transcription,
    pub(crate) items: Vec<Item>,
    pub(crate) result: apsides_nlp::Relaxation,
    /// The motion, as a start.
    pub(crate) guess: Guess,
    pub(crate) mesh: Mesh,
    /// The first motion whose amounts are those of the last one to a percent, and its mesh: from there another relaxation costs less.
    pub(crate) first: (Guess, Mesh),
    /// The meshes on the way.
    pub(crate) meshes: Vec<MeshRecord>,
}

impl<'a> Relaxer<'a> {
    /// Relaxes to amounts of six digits.
    pub(crate) fn new(ocp: &'a Ocp, settings: &RadauSettings) -> Result<Self, RadauError> {
        let mesh_tolerance = MESH_TOLERANCE.max(settings.tolerance);
        let tolerance = settings.nlp.tolerance.max(TOLERANCE);
        let relaxer = Self::to(ocp, settings, tolerance, COMPLEMENTARITY, mesh_tolerance)?;
        Ok(Self { most_work: MOST_WORK, ..relaxer }.keeping_invariants())
    }

    /// The same with what the motion keeps as a statement of the problem.
    fn keeping_invariants(self) -> Self {
        match with_invariants(&self.ocp) {
            Some(ocp) => Self { ocp: Cow::Owned(ocp), ..self },
            None => self,
        }
    }

    /// Error between the points of a mesh at which a motion is one of the problem.
    pub(crate) fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }

    /// The problem that is relaxed.
    pub(crate) fn ocp(&self) -> &Ocp {
        &self.ocp
    }

    /// Relaxes to amounts of six digits, on a mesh that is fine enough for a start.
    pub(crate) fn for_start(ocp: &'a Ocp, settings: &RadauSettings) -> Result<Self, RadauError> {
        Self::to(ocp, settings, settings.nlp.tolerance.max(TOLERANCE), COMPLEMENTARITY, START_TOLERANCE)
    }

    /// Relaxes to the tolerances of a solve, so that amounts of its size are told from none.
    pub(crate) fn exact(ocp: &'a Ocp, settings: &RadauSettings) -> Result<Self, RadauError> {
        let tolerance = settings.nlp.tolerance;
        let complementarity = COMPLEMENTARITY / TOLERANCE * tolerance;
        Ok(Self::to(ocp, settings, tolerance, complementarity, settings.tolerance)?.keeping_invariants())
    }

    fn to(
        ocp: &'a Ocp,
        settings: &RadauSettings,
        tolerance: f64,
        complementarity: f64,
        mesh_tolerance: f64,
    ) -> Result<Self, RadauError> {
        settings.check()?;
        let mut settings = RadauSettings { tolerance: mesh_tolerance, switches: false, ..settings.clone() };
        settings.nlp.tolerance = tolerance;
        settings.nlp.complementarity_tolerance = settings.nlp.complementarity_tolerance.min(complementarity);
        settings.nlp.max_iterations = settings.nlp.max_iterations.min(MAX_ITERATIONS);
        Ok(Self { ocp: Cow::Borrowed(ocp), settings, most_work: usize::MAX })
    }

    /// The same without refinement.
    pub(crate) fn on_one_mesh(&self) -> Self {
        let settings = RadauSettings { max_refinements: 0, ..self.settings.clone() };
        Self { ocp: self.ocp.clone(), settings, most_work: self.most_work }
    }

    /// Relaxes one item, or all that can be. What is held along an arc of the mesh says nothing about a relaxed problem: the mesh has none.
    pub(crate) fn relax(
        &self,
        guess: &Guess,
        mesh: &Mesh,
        only: Option<usize>,
        observer: &mut dyn Observer,
    ) -> Result<Relaxed, RadauError> {
        let (mut guess, mut mesh) = (guess.clone(), mesh.clone());
        let ocp: &Ocp = &self.ocp;
        let joints = Joints::new(ocp);
        let mut meshes: Vec<MeshRecord> = Vec::new();
        let mut motions: Vec<(f64, Guess, Mesh)> = Vec::new();
        let (mut agreements, mut work) = (0, 0);
        let mut solved: Option<Relaxed> = None;
        loop {
            let begin = Instant::now();
            let mut nlp = with_movable_bounds(ocp, &mesh, &guess)?;
            let items = items(ocp, &nlp);
            let limits: Vec<NlpRequirement> = items.iter().map(|i| i.limits.clone()).collect();
            let elastic: Vec<usize> = match only {
                Some(g) => vec![g],
                None => (0..items.len()).filter(|&g| items[g].requirement.is_some()).collect(),
            };
            let mut start = vec![0.0; nlp.variables()];
            nlp.initial_point(&mut start);
            let mut result = relax(&mut nlp, &limits, &elastic, &start, &self.settings.nlp, observer)?;
            result.resolution = NEGLIGIBLE * self.settings.nlp.tolerance;
            let mut trajectory = nlp.trajectory(ocp, &result.report)?;
            let scaling = Scaling::new(ocp, &guess);
            let error = estimate(ocp, &scaling, &self.settings, &mut trajectory)?.error;
            meshes.push(record(&mesh, &nlp, &result, error, begin.elapsed()));
            let iterations = result.report.counters.iterations;
            work += iterations * total_points(&mesh);
            let leads_nowhere = !result.is_success() && may_go_on(result.report.status);
            if let Some(solved) = solved.take_if(|_| leads_nowhere) {
                // The amounts of the mesh before are less exact, and no less true.
                if let (Some(spent), Some(record)) = (meshes.pop(), meshes.last_mut()) {
                    record.add_work_of(&spent);
                }
                return Ok(Relaxed { meshes, ..solved });
            }
            if !result.is_success() {
                let first = (guess.clone(), mesh.clone());
                return Ok(Relaxed { nlp, items, result, guess, mesh, first, meshes });
            }
            let next = refine(ocp, &trajectory, &joints.along(&trajectory), &self.settings)?;
            guess = Guess::earlier(&trajectory);
            let found = result.report.objective;
            let agrees = |earlier: f64, to: f64| (found - earlier).abs() <= to * found.abs();
            agreements =
                if motions.last().is_some_and(|m| agrees(m.0, SETTLED)) { agreements + 1 } else { 0 };
            motions.push((found, guess.clone(), mesh.clone()));
            let settled = agreements >= if error <= COARSE_MESH_TOLERANCE { 1 } else { 2 };
            let last = meshes.len() >= MAX_MESHES.min(self.settings.max_refinements + 1)
                || work + iterations * total_points(&next) > self.most_work.saturating_mul(meshes[0].points)
                || total_points(&next) > MAX_TOTAL_POINTS.min(self.settings.max_total_points);
            let near = motions.iter().find(|m| agrees(m.0, NEAR));
            let first = near.map_or_else(|| (guess.clone(), mesh.clone()), |m| (m.1.clone(), m.2.clone()));
            let relaxed =
                Relaxed { nlp, items, result, guess: guess.clone(), mesh, first, meshes: Vec::new() };
            if error <= self.settings.tolerance || settled || last {
                return Ok(Relaxed { meshes, ..relaxed });
            }
            solved = Some(relaxed);
            mesh = next;
        }
    }
}

fn record(
    mesh: &Mesh,
    nlp: &Transcription,
    result: &apsides_nlp::Relaxation,
    error: f64,
    time: Duration,
) -> MeshRecord {
    let layout = &nlp.layout;
    MeshRecord {
        intervals: mesh.phases.iter().map(PhaseMesh::intervals).sum(),
        points: total_points(mesh),
        error,
        objective: result.report.objective,
        counters: Counters::of(layout.variables, layout.constraints, &result.report),
        restorations: result.report.counters.restorations,
        time,
    }
}

impl Relaxed {
    pub(crate) fn limits(&self) -> Vec<NlpRequirement> {
        self.items.iter().map(|i| i.limits.clone()).collect()
    }

    /// True if the requirements need not give way, to the resolution of the relaxation.
    pub(crate) fn meets_all(&self) -> bool {
        self.result.is_success() && self.result.conflicts(&self.limits()).is_empty()
    }

    /// The sum of the weighted amounts, each relative to its unit.
    pub(crate) fn total(&self) -> f64 {
        let parts = self.items.iter().zip(&self.result.amounts);
        parts.map(|(item, amount)| item.limits.weight * amount / item.limits.unit).sum()
    }

    /// The largest amount, relative to its unit.
    pub(crate) fn largest(&self) -> f64 {
        let parts = self.items.iter().zip(&self.result.amounts);
        parts.map(|(item, amount)| amount / item.limits.unit).fold(0.0, f64::max)
    }

    /// Largest relative amount that would not be seen.
    pub(crate) fn resolution(&self) -> f64 {
        self.result.resolution.max(self.error())
    }

    /// The error of the motion between the points of its mesh, excess of bounds included.
    pub(crate) fn error(&self) -> f64 {
        self.meshes.last().map_or(f64::INFINITY, |m| m.error)
    }
}
