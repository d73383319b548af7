//! Straight lines from start to target at one bank angle, where a direct method starts.

use std::f64::consts::FRAC_PI_4;

use apsides_dynamics::entry::EntryState;
use apsides_ocp::{Guess, Ocp, OcpError, PhaseGuess};

use super::capsule::CapsuleEntry;
use super::steering::Steering;

/// Mean speed over ground relative to that at entry.
const MEAN_SPEED: f64 = 0.6;
/// Shortest time of a guess, s.
const SHORTEST_S: f64 = 60.0;
/// Flight path angle at the end, deg.
const LAST_PATH_ANGLE_DEG: f64 = -50.0;

impl CapsuleEntry {
    pub(super) fn straight_lines(&self, ocp: &Ocp, steering: Steering) -> Result<Guess, OcpError> {
        let start = self.start;
        let range = self.distance_to_target(start.place());
        let time = (range / (MEAN_SPEED * start.speed)).max(SHORTEST_S).min(self.longest_flight);
        let [longitude, latitude] = self.target;
        let end = EntryState {
            altitude: self.target_altitude,
            longitude,
            latitude,
            speed: self.terminal_speed().min(start.speed),
            path_angle: LAST_PATH_ANGLE_DEG.to_radians(),
            azimuth: self.course_to_target(),
        };
        let control = steering.controls_of(FRAC_PI_4);
        let states = vec![start.array().to_vec(), end.array().to_vec()];
        let phase = PhaseGuess::samples(&[0.0, time], states, vec![control; 2])?;
        let mut guess = Guess::from_phases(ocp, vec![phase]);
        // A peak or a factor on the lift begins at one.
        guess.parameters.iter_mut().for_each(|p| *p = 1.0);
        Ok(guess)
    }
}
