//! Where a direct method starts: straight lines from start to target at one bank angle.

use std::f64::consts::FRAC_PI_4;

use apsides_ocp::{Guess, Ocp, OcpError, PhaseGuess};

use super::capsule::Capsule;
use super::problem::Steering;

/// Mean speed over ground relative to that at entry.
const MEAN_SPEED: f64 = 0.6;
/// Flight path angle at the end, deg.
const LAST_PATH_ANGLE_DEG: f64 = -50.0;

impl Capsule {
    pub(super) fn straight_lines(&self, ocp: &Ocp, steering: Steering) -> Result<Guess, OcpError> {
        let start = self.start;
        let range = self.distance_to_target([start[1], start[2]]);
        let time = (range / (MEAN_SPEED * start[3])).clamp(60.0, self.longest_flight);
        let end = [
            self.target_altitude,
            self.target[0],
            self.target[1],
            self.terminal_speed().min(start[3]),
            LAST_PATH_ANGLE_DEG.to_radians(),
            self.course_to_target(),
        ];
        let control = steering.controls_of(FRAC_PI_4);
        let states = vec![start.to_vec(), end.to_vec()];
        let phase = PhaseGuess::samples(&[0.0, time], states, vec![control; 2])?;
        let mut guess = Guess::from_phases(ocp, vec![phase]);
        // A peak or a factor on the lift begins at one.
        guess.parameters.iter_mut().for_each(|p| *p = 1.0);
        Ok(guess)
    }

    /// Speed (m/s) at which the drag carries the weight at the end.
    pub(super) fn terminal_speed(&self) -> f64 {
        let planet = &self.flight.planet;
        let (sin, cos) = self.target[1].sin_cos();
        let (gravity, _) = planet.gravity(planet.body.radius + self.target_altitude, sin, cos);
        let density = planet.atmosphere.density(self.target_altitude);
        (2.0 * gravity * self.flight.vehicle.ballistic_coefficient(1.0) / density).sqrt()
    }
}

impl Steering {
    /// The controls of a bank angle.
    pub(super) fn controls_of(self, bank: f64) -> Vec<f64> {
        match self {
            Self::Angle => vec![bank],
            Self::Vector => vec![bank.cos(), bank.sin()],
        }
    }

    /// The bank angle of controls, rad.
    pub(super) fn bank_of(self, controls: &[f64]) -> f64 {
        match self {
            Self::Angle => controls[0],
            Self::Vector => controls[1].atan2(controls[0]),
        }
    }
}
