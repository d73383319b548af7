//! The motion about the Earth of an injection, from its orbital elements.

use apsides_dynamics::elements::Cartesian;
use apsides_ephemeris::{About, Motion, Point};
use apsides_ocp::Trajectory;

use super::injection::{BurnSteering, GeoInjection};
use super::phases::is_burn;

/// An injection with its solution.
pub(super) struct InjectionMotion<'a> {
    pub(super) injection: &'a GeoInjection,
    pub(super) solution: &'a Trajectory,
}

impl InjectionMotion<'_> {
    /// The unit vector along the thrust of a burn.
    fn direction(&self, state: &[f64], control: &[f64], orbit: &Cartesian) -> Option<[f64; 3]> {
        let injection = self.injection;
        let (r, v) = (orbit.position, orbit.velocity);
        Some(match injection.steering {
            BurnSteering::Velocity => unit(v),
            BurnSteering::InertialFixed => {
                let angles = state.get(injection.coast_states().len()..)?;
                let (longitude, latitude) = (*angles.first()?, angles.get(1).copied().unwrap_or(0.0));
                let (sin, cos) = longitude.sin_cos();
                [latitude.cos() * cos, latitude.cos() * sin, latitude.sin()]
            }
            BurnSteering::Optimal => {
                let (in_plane, out_of_plane) = (*control.first()?, control.get(1).copied().unwrap_or(0.0));
                let (up, normal) = (unit(r), unit(cross(r, v)));
                let forward = cross(normal, up);
                let parts = [
                    in_plane.sin() * out_of_plane.cos(),
                    in_plane.cos() * out_of_plane.cos(),
                    out_of_plane.sin(),
                ];
                [0, 1, 2].map(|k| parts[0] * up[k] + parts[1] * forward[k] + parts[2] * normal[k])
            }
        })
    }
}

impl Motion for InjectionMotion<'_> {
    fn about(&self) -> About {
        let body = self.injection.flight.body;
        About::sphere(body.radius, body.gravitational_parameter)
    }

    fn point(&self, phase: usize, _time: f64, state: &[f64], control: &[f64]) -> Option<Point> {
        let injection = self.injection;
        let orbit = injection.elements(state).to_cartesian(injection.flight.body.gravitational_parameter);
        let mass = injection.mass_in(state);
        let engine = &injection.flight.engine;
        let burns = is_burn(&self.solution.phases.get(phase)?.name);
        let thrust = match burns {
            true => self.direction(state, control, &orbit)?.map(|c| c * engine.thrust),
            false => [0.0; 3],
        };
        Some(Point {
            position: orbit.position,
            velocity: orbit.velocity,
            thrust: Some(thrust),
            mass: Some(mass),
            delta_v: Some(engine.velocity_change(injection.initial_mass, mass)),
            attitude: None,
            loads: Vec::new(),
        })
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    apsides_ad::vector::cross(&a, &b)
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    apsides_ad::vector::scale(&v, apsides_ad::vector::norm(&v, 0.0).recip())
}
