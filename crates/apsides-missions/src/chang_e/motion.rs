//! The motion of a landing about the Moon: in the plane of the orbit, or over the ground.

use apsides_dynamics::Ellipsoid;
use apsides_dynamics::frames::Local;
use apsides_dynamics::powered_descent::{Hovering, PlumbThrust};
use apsides_ephemeris::{About, Axes, Motion, Point, Site};
use apsides_ocp::Trajectory;

use super::divert::Divert;
use super::flight_state::{Across, FlightState};
use super::lander::{Lander, Motion as Space};
use super::phases::{AVOIDANCE, BRAKING, DESCENT, FINE_AVOIDANCE, HOVER};

/// A landing with its solution.
pub(super) struct DescentMotion<'a> {
    lander: &'a Lander,
    names: Vec<&'a str>,
    /// Diverts over the coarse and the fine map.
    diverts: [Option<Divert>; 2],
    /// Polar angle above which vertical flight in the plane is.
    last_angle: f64,
}

/// Parts of a vector upwards, to the east and to the north.
type UpEastNorth = [f64; 3];

impl<'a> DescentMotion<'a> {
    pub(super) fn of(lander: &'a Lander, solution: &'a Trajectory, diverts: [Option<Divert>; 2]) -> Self {
        let angle = |p: &apsides_ocp::PhaseTrajectory| match FlightState::end(lander.motion, p)?.across {
            Across::Plane { angle, .. } => Some(angle),
            _ => None,
        };
        let last_angle = solution.phases.iter().rev().find_map(angle).unwrap_or(0.0);
        let names = solution.phases.iter().map(|p| &*p.name).collect();
        Self { lander, names, diverts, last_angle }
    }

    /// Longitude and latitude above which a vertical phase is.
    fn place(&self, phase: &str) -> [f64; 2] {
        let [coarse, fine] = &self.diverts;
        let divert = if [DESCENT, FINE_AVOIDANCE].contains(&phase) { fine } else { coarse };
        divert.map_or(self.lander.site, |divert| divert.to)
    }

    fn engine_thrust(&self, throttle: f64) -> f64 {
        throttle * self.lander.descent.engine.thrust
    }

    /// Position, velocity and thrust of vertical flight above a place.
    fn vertical(&self, phase: &str, s: &FlightState, control: &[f64]) -> [[f64; 3]; 3] {
        let place = self.place(phase);
        let local = Local::at(place[0], place[1]);
        let plumb = PlumbThrust { flight: self.lander.descent.clone(), place };
        let size = match (phase, control) {
            (HOVER, _) => s.mass * Hovering(plumb.clone()).acceleration(s.radius),
            (_, [throttle]) => self.engine_thrust(*throttle),
            _ => 0.0,
        };
        let thrust = plumb.thrust(s.radius, s.upward, s.mass, size);
        [local.up.map(|c| c * s.radius), local.vector([s.upward, 0.0, 0.0]), local.vector(thrust)]
    }

    /// The same in the plane of the orbit.
    fn in_plane(&self, s: &FlightState, angle: f64, forward: f64, [up, along]: [f64; 2]) -> [[f64; 3]; 3] {
        let (sin, cos) = angle.sin_cos();
        let vector = |up: f64, along: f64| [cos * up - sin * along, sin * up + cos * along, 0.0];
        [vector(s.radius, 0.0), vector(s.upward, forward), vector(up, along)]
    }

    /// The size of the thrust upwards of vertical flight in the plane.
    fn upright(&self, phase: &str, s: &FlightState, control: &[f64]) -> f64 {
        match (phase, control) {
            (HOVER, _) => {
                let plumb = PlumbThrust { flight: self.lander.descent.clone(), place: [0.0; 2] };
                s.mass * Hovering(plumb).acceleration(s.radius)
            }
            (_, [throttle]) => self.engine_thrust(*throttle),
            _ => 0.0,
        }
    }

    /// Position, velocity and thrust at a state of a phase.
    fn vectors(&self, phase: &str, state: &[f64], control: &[f64]) -> Option<[[f64; 3]; 3]> {
        let s = FlightState::of(self.lander.motion, state)?;
        match s.across {
            Across::Plane { angle, forward } => {
                let [thrust_angle, throttle] = *control else { return None };
                let (sin, cos) = thrust_angle.sin_cos();
                let size = self.engine_thrust(throttle);
                Some(self.in_plane(&s, angle, forward, [size * sin, size * cos]))
            }
            Across::Space { longitude, latitude, eastward, northward } => {
                // The thrust of an adjustment by the shortest path has its course as a state.
                let (course, pitch, throttle) = match (control, state.get(7)) {
                    (&[course, pitch, throttle], None) => (course, pitch, throttle),
                    (&[pitch, throttle], Some(course)) => (*course, pitch, throttle),
                    _ => return None,
                };
                let size = self.engine_thrust(throttle);
                let across = size * pitch.cos();
                let thrust: UpEastNorth = [size * pitch.sin(), across * course.sin(), across * course.cos()];
                let local = Local::at(longitude, latitude);
                let velocity = local.vector([s.upward, eastward, northward]);
                Some([local.up.map(|c| c * s.radius), velocity, local.vector(thrust)])
            }
            Across::Divert { .. } => {
                let [coarse, fine] = &self.diverts;
                let divert = if phase == AVOIDANCE { coarse } else { fine }.as_ref()?;
                let plane = self.lander.in_plane_of(divert);
                Some(plane.vectors(state.try_into().ok()?, control.try_into().ok()?))
            }
            Across::Above if self.lander.motion == Space::Plane => {
                let up = self.upright(phase, &s, control);
                Some(self.in_plane(&s, self.last_angle, 0.0, [up, 0.0]))
            }
            Across::Above => Some(self.vertical(phase, &s, control)),
        }
    }
}

impl Motion for DescentMotion<'_> {
    fn about(&self) -> About {
        let Lander { body, descent, motion, site, .. } = self.lander;
        let fixed = *motion == Space::Space && descent.rotation_rate != 0.0;
        let [longitude, latitude] = *site;
        let goal = Site { longitude, latitude, altitude: 0.0 };
        About {
            gravitational_parameter: body.gravitational_parameter,
            surface: Ellipsoid::sphere(body.radius, body.gravitational_parameter, descent.rotation_rate, 0.0),
            axes: if fixed { Axes::Fixed } else { Axes::Inertial },
            loads: Vec::new(),
            site: (*motion == Space::Space).then_some(goal),
        }
    }

    fn point(&self, phase: usize, _time: f64, state: &[f64], control: &[f64]) -> Option<Point> {
        let name = self.names.get(phase).copied().unwrap_or(BRAKING);
        let [position, velocity, thrust] = self.vectors(name, state, control)?;
        let mass = FlightState::of(self.lander.motion, state)?.mass;
        Some(Point {
            position,
            velocity,
            thrust: Some(thrust),
            mass: Some(mass),
            delta_v: Some(self.lander.descent.engine.velocity_change(self.lander.initial_mass, mass)),
            attitude: None,
            loads: Vec::new(),
        })
    }
}
