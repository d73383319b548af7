//! The upper stage, the orbits in one plane, and the solvers with what ends a table early.

use apsides_dynamics::equinoctial::OrbitalFlight;
use apsides_missions::geo::GeoInjection;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_radau::{Radau, RadauSettings};
use apsides_shooting::indirect::{IndirectShooting, IndirectSolution, IndirectStart};

use crate::change::{Change, number, word};
use crate::stop::solved;
use crate::{Error, Observer, Outcome};

pub(super) use crate::stop::{Stop, ended, keep};

/// Collocation as the missions use it: intervals, points, tolerance of the mesh and of the nonlinear program.
const INTERVALS: usize = 10;
const POINTS: usize = 5;
const MESH_TOLERANCE: f64 = 1e-10;
const NLP_TOLERANCE: f64 = 1e-10;

/// An upper stage in its parking orbit; SI units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    pub(super) flight: OrbitalFlight,
    pub(super) mass: f64,
    pub(super) propellant: f64,
    pub(super) parking_radius: f64,
    pub(super) target_radius: f64,
}

impl Stage {
    /// A vehicle of the program in the orbits of the mission, with its own initial mass or another one (kg).
    pub(super) fn of(vehicle: &str, mass: Option<f64>) -> Result<Self, Error> {
        let mut changes = vec![word("vehicle", vehicle)];
        changes.extend(mass.map(|m| number("initial_mass_kg", m)));
        let mission = crate::load("geo-2-burn", &changes)?;
        let no_injection = || Error::in_mission("the mission is no injection");
        let injection = mission.mission_as::<GeoInjection>().ok_or_else(no_injection)?;
        Ok(Self {
            flight: injection.flight,
            mass: injection.initial_mass,
            propellant: injection.propellant,
            parking_radius: injection.parking_radius,
            target_radius: injection.target_semi_major_axis,
        })
    }

    pub(super) fn mu(&self) -> f64 {
        self.flight.body.gravitational_parameter
    }

    pub(super) fn mass_flow(&self) -> f64 {
        self.flight.engine.mass_flow()
    }

    /// Time in which the propellant is burnt, s.
    pub(super) fn longest_burn(&self) -> f64 {
        self.propellant / self.mass_flow()
    }

    /// Canonical units: of speed, m/s, and of time, s; that of length is the parking radius.
    pub(super) fn canonical(&self) -> (f64, f64) {
        let speed = (self.mu() / self.parking_radius).sqrt();
        (speed, self.parking_radius / speed)
    }
}

/// An orbit with its perigee towards true longitude zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Orbit {
    /// Semi-major axis, m.
    pub(super) axis: f64,
    pub(super) eccentricity: f64,
}

impl Orbit {
    pub(super) fn circle(radius: f64) -> Self {
        Self { axis: radius, eccentricity: 0.0 }
    }

    /// From the semi-latus rectum (m) and the eccentricity.
    pub(super) fn of_latus_rectum(p: f64, eccentricity: f64) -> Self {
        Self { axis: p / (1.0 - eccentricity * eccentricity), eccentricity }
    }

    pub(super) fn latus_rectum(&self) -> f64 {
        self.axis * (1.0 - self.eccentricity * self.eccentricity)
    }

    pub(super) fn apogee(&self) -> f64 {
        self.axis * (1.0 + self.eccentricity)
    }

    pub(super) fn perigee(&self) -> f64 {
        self.axis * (1.0 - self.eccentricity)
    }
}

/// The methods, with the observer of all solves.
pub(super) struct Solver<'a> {
    pub(super) threads: usize,
    pub(super) observer: &'a mut dyn Observer,
}

impl Solver<'_> {
    /// By collocation.
    pub(super) fn radau(&mut self, ocp: &Ocp, guess: &Guess) -> Result<Trajectory, Stop> {
        let mut settings = RadauSettings {
            intervals: INTERVALS,
            points: POINTS,
            tolerance: MESH_TOLERANCE,
            threads: self.threads,
            ..RadauSettings::default()
        };
        settings.nlp.tolerance = NLP_TOLERANCE;
        let mesh = Mesh::uniform(ocp, INTERVALS, POINTS)?;
        let solution = Radau { settings }.solve_on(ocp, guess, mesh, &mut *self.observer)?;
        ended(&ocp.name, "Radau", solution.status)?;
        Ok(solution.trajectory)
    }

    /// By indirect shooting.
    pub(super) fn shoot(
        &mut self,
        method: &IndirectShooting,
        ocp: &Ocp,
        start: &IndirectStart,
    ) -> Result<(IndirectSolution, Trajectory), Stop> {
        let mut solution = method.solve(ocp, start, &mut *self.observer)?;
        ended(&ocp.name, "indirect shooting", solution.status)?;
        match solution.trajectory.take() {
            Some(trajectory) => Ok((solution, trajectory)),
            None => Err(Stop::NotSolved(format!("{}: indirect shooting has no trajectory", ocp.name))),
        }
    }

    /// By indirect shooting from the costates of collocation.
    pub(super) fn both(&mut self, ocp: &Ocp, guess: &Guess) -> Result<Both, Stop> {
        let radau = self.radau(ocp, guess)?;
        let (_, indirect) =
            self.shoot(&IndirectShooting::default(), ocp, &IndirectStart::from_trajectory(&radau, 1)?)?;
        Ok(Both { radau, indirect })
    }

    /// A mission by its own method, from its own guess or from a solution.
    pub(super) fn mission(
        &mut self,
        name: &str,
        changes: &[Change<'_>],
        start: Option<&Trajectory>,
    ) -> Result<Outcome, Stop> {
        let (_, outcome) = solved(name, changes, self.threads, start, &mut *self.observer)?;
        Ok(outcome)
    }
}

/// One problem by both methods.
pub(super) struct Both {
    pub(super) radau: Trajectory,
    pub(super) indirect: Trajectory,
}
