//! A flight that can be asked for its state at any time.

use apsides_dynamics::Ellipsoid;

use crate::quantity::Column;

/// The axes in which a flight gives its states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// The mission's inertial axes.
    Inertial,
    /// Axes fixed to the body, and velocities relative to it.
    Fixed,
}

/// The motion of a vehicle at an instant, in the axes that its flight says.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Position from the centre of the body, m.
    pub position: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
    /// Thrust, N, where it is known.
    pub thrust: Option<[f64; 3]>,
    /// Mass, kg, where it is known.
    pub mass: Option<f64>,
    /// Velocity change that the engine has given since the start of the flight, m/s, where it is known.
    pub delta_v: Option<f64>,
    /// Unit quaternion, scalar first, that turns vectors from the axes of the vehicle to these; none of a point.
    pub attitude: Option<[f64; 4]>,
    /// Loads, in the order of [`About::loads`].
    pub loads: Vec<f64>,
}

/// A site that a flight goes to: longitude and geodetic latitude (rad), and height (m) above the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Longitude, rad.
    pub longitude: f64,
    /// Geodetic latitude, rad.
    pub latitude: f64,
    /// Height, m.
    pub altitude: f64,
}

/// The body of a flight, and what its points have.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Gravitational parameter of the body, m3/s2, by which it is known.
    pub gravitational_parameter: f64,
    /// The surface that altitudes count from.
    pub surface: Ellipsoid,
    /// The axes of the points.
    pub axes: Axes,
    /// Loads of the points.
    pub loads: Vec<Column>,
    /// The site, if there is one.
    pub site: Option<Site>,
}

impl About {
    /// A sphere of this radius (m) that does not turn, by its gravitational parameter (m3/s2), with points in inertial axes.
    #[must_use]
    pub fn sphere(radius: f64, gravitational_parameter: f64) -> Self {
        Self {
            gravitational_parameter,
            surface: Ellipsoid::sphere(radius, gravitational_parameter, 0.0, 0.0),
            axes: Axes::Inertial,
            loads: Vec::new(),
            site: None,
        }
    }
}

/// Motion about a body: what a kind of mission makes of the states and controls of its phases.
pub trait Motion {
    /// The body, and what the points have.
    fn about(&self) -> About;

    /// The motion in a phase (by its place) at a time (s), a state and a control; none where the phase is not one of the mission.
    fn point(&self, phase: usize, time: f64, state: &[f64], control: &[f64]) -> Option<Point>;
}

/// A part of a flight along which nothing jumps, from a time to a time, s. Parts of one phase follow each other and have its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Name of the phase.
    pub name: String,
    /// Times of its start and end, s.
    pub times: [f64; 2],
}

/// The state of a flight at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Instant {
    /// The motion about the body, if the flight has one.
    pub point: Option<Point>,
    /// The flight's own quantities, in their order; not a number where a phase does not have one.
    pub own: Vec<f64>,
}

/// A flight: parts one after the other, each with a state at every time.
pub trait Flight {
    /// The parts, in order.
    fn spans(&self) -> Vec<Span>;

    /// The body that the flight is about; none of a flight that has no place.
    fn about(&self) -> Option<About>;

    /// The flight's own quantities, such as the states and controls of its problem.
    fn own(&self) -> Vec<Column>;

    /// The state in a part (by its place) at a time (s).
    fn at(&self, span: usize, time: f64) -> Instant;
}
