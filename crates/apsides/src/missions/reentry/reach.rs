//! Ends of the re-entry over ground, for footprints.

use apsides_dynamics::entry::{LATITUDE, LONGITUDE, STATES};
use apsides_ocp::Trajectory;

use super::capsule::Capsule;
use super::keys;
use crate::key::Values;
use crate::missions::{Ground, Past, Reach};

pub(super) const REACH: Reach = Reach { past, ground, track };

fn past(v: &Values, Past { place, bearing, half_width }: &Past) -> Values {
    v.with_word(keys::GOAL, keys::REACH)
        .with_number(keys::TARGET_LONGITUDE, place[0])
        .with_number(keys::TARGET_LATITUDE, place[1])
        .with_number(keys::REACH_BEARING, *bearing)
        .with_number(keys::REACH_WIDTH, *half_width)
}

fn ground(v: &Values) -> Result<Ground, String> {
    let capsule = Capsule::of(v)?;
    let [_, longitude, latitude, ..] = capsule.start;
    Ok(Ground {
        start: [longitude, latitude].map(f64::to_degrees),
        target: capsule.target.map(f64::to_degrees),
        radius: capsule.flight.planet.body.radius / 1e3,
        altitude: capsule.target_altitude / 1e3,
    })
}

/// At the nodes.
fn track(flight: &Trajectory) -> Vec<[f64; 2]> {
    let index = |quantity| STATES.iter().position(|q| *q == quantity);
    let (Some(longitude), Some(latitude)) = (index(LONGITUDE), index(LATITUDE)) else { return Vec::new() };
    let places = flight.phases.iter().flat_map(|phase| {
        let of = |x: Vec<f64>| [x[longitude], x[latitude]].map(f64::to_degrees);
        phase.nodes().map(move |(time, _)| of(phase.state_at(time)))
    });
    places.collect()
}
