//! The landing from perilune on a uniform mesh: one nonlinear program, its start and its settings.

use apsides::Posed;
use apsides::nlp::{BarrierStrategy, InteriorPoint, NlpSettings, ScalingMethod};
use apsides::ocp::{Guess, Mesh, Ocp};
use apsides::radau::{RadauSettings, Transcription};
use serde::Serialize;

use crate::numbers::Numbers;

/// Name of the mission.
pub const MISSION: &str = "lunar-perilune";

/// Intervals of the coarse mesh whose solution starts a fine one.
pub const COARSE_INTERVALS: usize = 20;

/// Intervals from which on [`Start::Auto`] comes from the coarse mesh: from a straight line such fine uniform meshes
/// run into worse local optima.
pub const FINE_INTERVALS: usize = 1000;

/// The start of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Start {
    /// From the coarse mesh on fine meshes, from the mission's straight line on others.
    Auto,
    /// The mission's straight line.
    Line,
    /// The solution on [`COARSE_INTERVALS`] intervals, interpolated.
    Coarse,
}

/// The error of a program that prints it.
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
    /// Reads and poses the mission [`MISSION`].
    ///
    /// # Errors
    /// When the mission that comes with the program is not there or cannot be posed.
    pub fn pose() -> Result<Self, Failure> {
        Self::of(MISSION)
    }

    /// Reads and poses a mission.
    ///
    /// # Errors
    /// When there is no such mission or it cannot be posed.
    pub fn of(mission: &str) -> Result<Self, Failure> {
        let mission = apsides::load(mission, &[])?;
        let Posed { ocp, guess, .. } = mission.pose()?;
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

/// The start and the strategy of the barrier parameter that the method itself uses, at the tolerance of the comparison, without what no
/// peer does after it: the exact active set, and ways out of saddles.
#[must_use]
pub fn method_settings() -> NlpSettings {
    NlpSettings { tolerance: 1e-8, polish: 0.0, max_saddle_escapes: 0, ..RadauSettings::default().nlp }
}

/// The discretised problem for a peer that writes the equations down itself.
#[derive(Debug, Serialize)]
pub struct Dump {
    /// The mission file: physical constants.
    pub mission_file: String,
    /// Intervals of the uniform mesh.
    pub intervals: usize,
    /// Points per interval.
    pub points: usize,
    /// Start, bounds, units.
    #[serde(flatten)]
    pub numbers: Numbers,
}
