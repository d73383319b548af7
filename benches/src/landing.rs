//! The landing from perilune on a uniform mesh: one nonlinear program, its start and its settings.

use apsides::nlp::{BarrierStrategy, InteriorPoint, Nlp, NlpSettings, Scaling, ScalingMethod};
use apsides::ocp::{Guess, Mesh, Ocp};
use apsides::radau::{RadauSettings, Transcription};
use apsides::{Mission, Posed};
use serde::Serialize;

/// Name of the mission.
pub const MISSION: &str = "lunar-perilune";

/// Intervals of the coarse mesh whose solution starts a fine one.
pub const COARSE_INTERVALS: usize = 20;

/// Intervals from which on [`Start::Auto`] comes from the coarse mesh: from a straight line such fine uniform meshes
/// run into worse local optima.
pub const FINE_INTERVALS: usize = 1000;

/// Where a solve starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Start {
    /// From the coarse mesh on fine meshes, from the mission's straight line on others.
    Auto,
    /// The mission's straight line.
    Line,
    /// The solution on [`COARSE_INTERVALS`] intervals, interpolated.
    Coarse,
}

/// What went wrong, for the programs that print it.
pub type Failure = Box<dyn std::error::Error>;

/// The mission as a problem, with its guess.
pub struct Landing {
    /// The mission file with every value written out.
    pub mission_file: String,
    /// The problem.
    pub ocp: Ocp,
    /// The mission's guess.
    pub guess: Guess,
}

impl Landing {
    /// Reads and poses the mission.
    ///
    /// # Errors
    /// When the mission that comes with the program is not there or cannot be posed.
    pub fn pose() -> Result<Self, Failure> {
        let mission = Mission::load(MISSION, &[])?;
        let Posed { ocp, guess } = mission.pose()?;
        Ok(Self { mission_file: mission.to_file(), ocp, guess })
    }

    /// Guess for a mesh of `intervals` intervals with `points` points each.
    ///
    /// # Errors
    /// When the coarse problem is ill-posed or has no solution.
    pub fn start(&self, start: Start, intervals: usize, points: usize) -> Result<Guess, Failure> {
        let from_coarse = match start {
            Start::Auto => intervals >= FINE_INTERVALS,
            Start::Line => false,
            Start::Coarse => true,
        };
        if !from_coarse {
            return Ok(self.guess.clone());
        }
        let mut coarse = self.transcription(&self.guess, COARSE_INTERVALS, points)?;
        let report = InteriorPoint::new(settings(BarrierStrategy::Monotone)).solve(&mut coarse)?;
        if !report.status.is_success() {
            return Err(format!("coarse mesh: {}", report.status).into());
        }
        Ok(Guess::earlier(&coarse.trajectory(&self.ocp, &report)?))
    }

    /// The nonlinear program on a uniform mesh.
    ///
    /// # Errors
    /// When the mesh is ill-posed.
    pub fn transcription(
        &self,
        guess: &Guess,
        intervals: usize,
        points: usize,
    ) -> Result<Transcription, Failure> {
        let mesh = Mesh::uniform(&self.ocp, intervals, points)?;
        Ok(Transcription::new(&self.ocp, &mesh, guess)?)
    }
}

/// Settings of the comparison: Ipopt's defaults, the problem's own units, tolerance 1e-8.
#[must_use]
pub fn settings(barrier: BarrierStrategy) -> NlpSettings {
    NlpSettings {
        tolerance: 1e-8,
        scaling: ScalingMethod::UserThenGradient { max: 100.0 },
        barrier,
        ..NlpSettings::default()
    }
}

/// Settings that the method itself uses, at the tolerance of the comparison.
#[must_use]
pub fn method_settings() -> NlpSettings {
    NlpSettings { tolerance: 1e-8, ..RadauSettings::default().nlp }
}

/// The discretised problem for a peer: what it starts from and is bounded and scaled by. Bounds of 1e20 stand for none.
#[derive(Debug, Serialize)]
pub struct Dump {
    /// The mission file: physical constants.
    pub mission_file: String,
    /// Intervals of the uniform mesh.
    pub intervals: usize,
    /// Points per interval.
    pub points: usize,
    /// Starting point.
    pub start: Vec<f64>,
    /// Bounds on the variables.
    pub lower: Vec<f64>,
    /// The same.
    pub upper: Vec<f64>,
    /// Bounds on the constraints.
    pub row_lower: Vec<f64>,
    /// The same.
    pub row_upper: Vec<f64>,
    /// Units of the variables.
    pub variable_units: Vec<f64>,
    /// Units of the constraints.
    pub row_units: Vec<f64>,
    /// Unit of the objective.
    pub objective_unit: f64,
    /// Constraints at the starting point: the peer's must be equal.
    pub row_values: Vec<f64>,
    /// Objective at the starting point.
    pub objective: f64,
}

impl Dump {
    /// Reads everything from the nonlinear program.
    ///
    /// # Errors
    /// When the program states no units.
    pub fn new(
        landing: &Landing,
        nlp: &mut Transcription,
        intervals: usize,
        points: usize,
    ) -> Result<Self, Failure> {
        let (n, m) = (nlp.variables(), nlp.constraints());
        let (mut start, mut lower, mut upper) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let (mut row_lower, mut row_upper, mut row_values) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        nlp.initial_point(&mut start);
        nlp.variable_bounds(&mut lower, &mut upper);
        nlp.constraint_bounds(&mut row_lower, &mut row_upper);
        // JSON has no infinity.
        for bound in [&mut lower, &mut upper, &mut row_lower, &mut row_upper].into_iter().flatten() {
            *bound = bound.clamp(-1e20, 1e20);
        }
        nlp.constraint_values(&start, &mut row_values);
        let objective = nlp.objective(&start);
        let Scaling { objective: objective_unit, variables: variable_units, constraints: row_units } =
            nlp.scaling().ok_or("the transcription states no units")?;
        Ok(Self {
            mission_file: landing.mission_file.clone(),
            intervals,
            points,
            start,
            lower,
            upper,
            row_lower,
            row_upper,
            variable_units,
            row_units,
            objective_unit,
            row_values,
            objective,
        })
    }
}
