//! Landings in flat outputs: the missions `lunar-perilune` and `lunar-direct` on B-splines, with their nonlinear programs.

use apsides::dynamics::planar::PlanarFlight;
use apsides::dynamics::planar::flat::FlatConstantThrust;
use apsides::dynamics::{Body, Engine};
use apsides_flatness::{
    BoundRows, Breaks, FlatSystem, Flatness, FlatnessSettings, FlatnessSolution, Placement, SplineSettings,
};
use serde::Serialize;

use crate::landing::{Failure, Landing};
use crate::numbers::Numbers;

/// A mission with constant thrust, and its flat map.
pub struct FlatLanding {
    /// The mission as a problem.
    pub landing: Landing,
    /// The flat map of its one phase.
    pub systems: [FlatSystem; 1],
    mass: f64,
}

/// Splines of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Splines {
    /// Order 6, 10 segments, 15 equally spaced points: 31 variables, 22 constraints.
    Paper,
    /// Order 9, 10 segments, 17 Gauss points over the phase.
    Smooth,
    /// The last ones of the method with its default settings.
    Refined,
}

/// The program for a peer that writes the equations down itself.
#[derive(Debug, Serialize)]
pub struct FlatDump {
    /// The mission file: physical constants.
    pub mission_file: String,
    /// Mass at ignition, kg.
    pub mass_kg: f64,
    /// Order and knots of each output.
    pub splines: Vec<(usize, Vec<f64>)>,
    /// `Uniform`, `Gauss` or `GaussPerSegment`.
    pub placement: String,
    /// Points, of each segment with the last of these.
    pub points: usize,
    /// Start, bounds, units.
    #[serde(flatten)]
    pub numbers: Numbers,
}

impl FlatLanding {
    /// Reads and poses a mission.
    ///
    /// # Errors
    /// When there is no such mission, or constants are out of range.
    pub fn pose(mission: &str) -> Result<Self, Failure> {
        let landing = Landing::of(mission)?;
        // Constants of Jamilnia 2017, Table 1, as in the missions.
        let body = Body::new(4904.8695e9, 1737.1e3)?;
        let engine = Engine::with_exhaust_velocity(440.0, 310.0 * 9.807)?;
        let mass = landing.ocp.phases[0].states[4].initial.lower;
        let flat = FlatConstantThrust { flight: PlanarFlight::new(body, engine), ignition: 0.0, mass };
        Ok(Self { landing, systems: [FlatSystem::new(flat)], mass })
    }

    /// The method on given splines, not refined; without `presolve` a solve starts from the fitted guess.
    ///
    /// # Errors
    /// When the refined splines cannot be found.
    pub fn method(&self, splines: Splines, presolve: bool) -> Result<Flatness, Failure> {
        let spline = match splines {
            Splines::Paper => SplineSettings {
                order: Some(6),
                breaks: Breaks::Uniform(10),
                points: 15,
                placement: Placement::Uniform,
                refine: false,
            },
            Splines::Smooth => SplineSettings {
                order: Some(9),
                breaks: Breaks::Uniform(10),
                points: 17,
                placement: Placement::Gauss,
                refine: false,
            },
            Splines::Refined => {
                let solution = self.solve(&default_method())?;
                let last = solution.solves.last().ok_or("no solve")?;
                let points = last.points / last.segments;
                SplineSettings {
                    order: Some(last.order),
                    breaks: Breaks::Collocation(last.segments),
                    points,
                    placement: Placement::GaussPerSegment,
                    refine: false,
                }
            }
        };
        let default = default_method();
        Ok(Flatness { settings: FlatnessSettings { spline, presolve, ..default.settings } })
    }

    /// The whole call.
    ///
    /// # Errors
    /// When the problem is ill-posed for the method.
    pub fn solve(&self, method: &Flatness) -> Result<FlatnessSolution, Failure> {
        Ok(method.solve(&self.landing.ocp, &self.systems, &self.landing.guess)?)
    }

    /// The nonlinear program of a method that is not refined.
    ///
    /// # Errors
    /// When the problem is ill-posed for the method.
    pub fn program(&self, method: &Flatness) -> Result<apsides_flatness::Transcription, Failure> {
        Ok(method.transcription(&self.landing.ocp, &self.systems, &self.landing.guess)?)
    }

    /// The program for a peer; `solution` is that of the same method.
    ///
    /// # Errors
    /// When the problem is ill-posed for the method.
    pub fn dump(&self, method: &Flatness, solution: &FlatnessSolution) -> Result<FlatDump, Failure> {
        let mut nlp = self.program(method)?;
        let spline = &method.settings.spline;
        Ok(FlatDump {
            mission_file: self.landing.mission_file.clone(),
            mass_kg: self.mass,
            splines: (solution.splines[0].bases.iter()).map(|b| (b.order(), b.knots().to_vec())).collect(),
            placement: format!("{:?}", spline.placement),
            points: spline.points,
            numbers: Numbers::new(&mut nlp),
        })
    }
}

/// The method with the settings of the problem: the missions bound every state, far from the flight.
#[must_use]
pub fn default_method() -> Flatness {
    Flatness {
        settings: FlatnessSettings { bounds: BoundRows::WhereExceeded, ..FlatnessSettings::default() },
    }
}
