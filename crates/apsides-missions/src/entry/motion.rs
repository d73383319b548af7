//! The motion of a re-entry over its planet, with its loads.

use apsides_ad::PathFunction;
use apsides_dynamics::entry::{Banked, EntryState};
use apsides_dynamics::frames::Local;
use apsides_ephemeris::{About, Axes, Column, Motion, Point, Site};

use super::capsule::CapsuleEntry;
use super::load::LoadOf;
use super::steering::Steering;

/// A re-entry with the functions of its loads.
pub(super) struct EntryMotion<'a> {
    capsule: &'a CapsuleEntry,
    loads: [LoadOf<Banked>; 3],
}

impl<'a> EntryMotion<'a> {
    pub(super) fn of(capsule: &'a CapsuleEntry) -> Self {
        let model = Banked(capsule.flight.clone());
        Self { capsule, loads: capsule.loads().map(|load| LoadOf::new(&model, load)) }
    }
}

impl Motion for EntryMotion<'_> {
    fn about(&self) -> About {
        let capsule = self.capsule;
        let planet = &capsule.flight.planet;
        let load = |load: &LoadOf<Banked>| {
            let quantity = load.load.quantity();
            Column::new(quantity.name, quantity.unit)
        };
        let [longitude, latitude] = capsule.target;
        About {
            gravitational_parameter: planet.body.gravitational_parameter,
            surface: planet.surface(),
            // On a planet that does not turn the coordinates are inertial.
            axes: if planet.rotation_rate == 0.0 { Axes::Inertial } else { Axes::Fixed },
            loads: self.loads.iter().map(load).collect(),
            site: Some(Site { longitude, latitude, altitude: capsule.target_altitude }),
        }
    }

    fn point(&self, _phase: usize, time: f64, state: &[f64], control: &[f64]) -> Option<Point> {
        let x: [f64; 6] = state.try_into().ok()?;
        let EntryState { altitude, longitude, latitude, speed, path_angle, azimuth } = x.into();
        let flight = &self.capsule.flight;
        let local = Local::at(longitude, latitude);
        let radius = flight.planet.body.radius + altitude;
        let (east, north) = flight.heading.of_course(azimuth).sin_cos();
        let (sin, cos) = path_angle.sin_cos();
        let steering = if control.len() == 1 { Steering::Angle } else { Steering::Vector };
        let bank = [steering.bank_of(control)];
        let load = |load: &LoadOf<Banked>| {
            let [value] = load.evaluate(time, &x, &bank, &[]);
            value
        };
        Some(Point {
            position: local.up.map(|c| c * radius),
            velocity: local.vector([speed * sin, speed * cos * east, speed * cos * north]),
            thrust: Some([0.0; 3]),
            mass: Some(flight.vehicle.mass),
            delta_v: Some(0.0),
            attitude: None,
            loads: self.loads.iter().map(load).collect(),
        })
    }
}
