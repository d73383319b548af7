//! Profiles of the bank angle over energy or time, for a search.

use apsides_dynamics::entry::ALTITUDE;
use apsides_ocp::Bounds;
use apsides_shooting::profile::{Independent, Steering as ProfileSteering};

use super::capsule::{Capsule, Goal};
use super::problem::Steering;
use crate::missions::ProfileSearch;

/// Largest bank angle of a profile to either side.
const MOST_BANK_DEG: f64 = 120.0;

impl Capsule {
    /// Profiles of the bank angle; none where the goal is a static parameter, which no flight has.
    pub(super) fn profiles(&self) -> Option<ProfileSearch> {
        if matches!(self.goal, Goal::Peak(_) | Goal::LeastLift) {
            return None;
        }
        let body = self.flight.planet.body;
        let energy = move |altitude: f64, speed: f64| {
            0.5 * speed * speed - body.gravitational_parameter / (body.radius + altitude)
        };
        let end = energy(self.target_altitude, self.terminal_speed());
        let km = if self.must_reach_target() { body.radius / 1e3 } else { 0.0 };
        let most = MOST_BANK_DEG.to_radians();
        Some(ProfileSearch {
            energy: Independent::energy(end, move |x| energy(x[0], x[3])),
            bounds: vec![Bounds::new(-most, most)],
            steering: match self.steering {
                Steering::Angle => ProfileSteering::Controls,
                Steering::Vector => ProfileSteering::CosSin,
            },
            stop: ALTITUDE.name,
            km_per_unit: vec![1e-3, km * self.target[1].cos(), km, 0.0, 0.0, 0.0],
        })
    }
}
