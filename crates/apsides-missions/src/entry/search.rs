//! Profiles of the bank angle over energy or time, for a search.

use apsides_dynamics::entry::{ALTITUDE, LATITUDE, LONGITUDE, STATES};
use apsides_ocp::Bounds;
use apsides_shooting::profile::{Independent, Steering as ProfileSteering};
use apsides_two_layer::ProfileModel;

use super::capsule::{CapsuleEntry, Goal};
use super::steering::Steering;

/// Largest bank angle of a profile to either side.
const MOST_BANK_DEG: f64 = 120.0;

impl CapsuleEntry {
    /// Profiles of the bank angle; none where the goal is a static parameter, which no flight has.
    pub(super) fn profiles(&self) -> Option<ProfileModel> {
        if matches!(self.goal, Goal::Peak(_) | Goal::LeastLift) {
            return None;
        }
        let body = self.flight.planet.body;
        let energy = move |altitude: f64, speed: f64| {
            0.5 * speed * speed - body.gravitational_parameter / (body.radius + altitude)
        };
        let end = energy(self.target_altitude, self.terminal_speed());
        let of_state = move |x: &[f64]| match x {
            [altitude, _longitude, _latitude, speed, ..] => energy(*altitude, *speed),
            _ => f64::NAN,
        };
        let km = if self.must_reach_target() { body.radius / 1e3 } else { 0.0 };
        let [_, target_latitude] = self.target;
        let most = MOST_BANK_DEG.to_radians();
        Some(ProfileModel {
            independent: Independent::energy(end, of_state),
            bounds: vec![Bounds::new(-most, most)],
            steering: match self.steering {
                Steering::Angle => ProfileSteering::Controls,
                Steering::Vector => ProfileSteering::CosSin,
            },
            stop: ALTITUDE.name.into(),
            distance_per_unit: STATES
                .map(|quantity| match quantity {
                    ALTITUDE => 1e-3,
                    LONGITUDE => km * target_latitude.cos(),
                    LATITUDE => km,
                    _ => 0.0,
                })
                .into(),
        })
    }
}
