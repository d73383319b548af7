//! Ends of the re-entry over ground, for footprints.

use std::sync::Arc;

use apsides_dynamics::entry::{LATITUDE, LONGITUDE, STATES};
use apsides_ocp::Trajectory;
use apsides_pipeline::Mission;
use apsides_pipeline::mission::{Ground, Past, Reach};

use super::capsule::{CapsuleEntry, Goal};

impl Reach for CapsuleEntry {
    fn past(&self, Past { place, bearing, half_width }: &Past) -> Arc<dyn Mission> {
        let half_width = half_width.map(|km| km * 1e3);
        Arc::new(Self {
            target: place.map(f64::to_radians),
            goal: Goal::Reach { bearing: bearing.to_radians(), half_width },
            ..self.clone()
        })
    }

    fn ground(&self) -> Ground {
        Ground {
            start: self.start.place().map(f64::to_degrees),
            target: self.target.map(f64::to_degrees),
            radius: self.flight.planet.body.radius / 1e3,
            altitude: self.target_altitude / 1e3,
        }
    }

    /// Places at the nodes.
    fn track(&self, flight: &Trajectory) -> Vec<[f64; 2]> {
        let index = |quantity| STATES.iter().position(|q| *q == quantity);
        let (Some(longitude), Some(latitude)) = (index(LONGITUDE), index(LATITUDE)) else {
            return Vec::new();
        };
        let places = flight.phases.iter().flat_map(|phase| {
            let of = |x: Vec<f64>| [x[longitude], x[latitude]].map(f64::to_degrees);
            phase.nodes().map(move |(time, _)| of(phase.state_at(time)))
        });
        places.collect()
    }
}
