//! Flight with throttled thrust over a rotating body, in spherical coordinates fixed to it.
//!
//! With the distance `r` from the centre, the longitude and the latitude `lat`, the velocity relative to the ground `w` upwards, `e` to
//! the east, `n` to the north, the mass `m`, the rotation rate `W` and the thrust `T` in the same local axes:
//!
//! ```text
//! r'   = w
//! lon' = e / (r cos(lat))
//! lat' = n / r
//! w'   = T_w / m + g_w + (e^2 + n^2) / r          + 2 W e cos(lat)                    + W^2 r cos^2(lat)
//! e'   = T_e / m + g_e + e (n tan(lat) - w) / r    - 2 W (w cos(lat) - n sin(lat))
//! n'   = T_n / m + g_n - (e^2 tan(lat) + n w) / r  - 2 W e sin(lat)                    - W^2 r sin(lat) cos(lat)
//! m'   = -|T| / c
//! ```
//!
//! Newton's law in rotating axes (Vallado 2013, section 3.3): the third column are the Coriolis, the last the centrifugal accelerations.
//! The coordinates are singular at the poles.

use apsides_ad::{Dynamics, PathFunction, Scalar};

mod vertical_plane;

pub use vertical_plane::{DIVERT_ANGLE, FORWARD_SPEED, THRUST_PART, THRUST_TILT, VerticalPlaneThrust};

use crate::planar::{MASS, RADIUS, THROTTLE};
use crate::{DynamicsError, Engine, GravityField, Quantity};

/// Angular velocity of the Moon, rad/s: one turn in a sidereal month of 27.321661 days.
pub const MOON_ROTATION_RATE: f64 = std::f64::consts::TAU / (27.321_661 * 86_400.0);

/// Longitude, eastwards.
pub const LONGITUDE: Quantity = Quantity::new("longitude", "rad");
/// Geocentric latitude, positive north.
pub const LATITUDE: Quantity = Quantity::new("latitude", "rad");
/// Velocity relative to the ground, upwards.
pub const UPWARD_SPEED: Quantity = Quantity::new("upward speed", "m/s");
/// Velocity relative to the ground, to the east.
pub const EASTWARD_SPEED: Quantity = Quantity::new("eastward speed", "m/s");
/// Velocity relative to the ground, to the north.
pub const NORTHWARD_SPEED: Quantity = Quantity::new("northward speed", "m/s");
/// Angle of the thrust from the vertical plane to the north, towards east: the thrust is
/// `(sin(pitch), cos(pitch) sin(course), cos(pitch) cos(course))` upwards, to the east and to the north.
pub const THRUST_COURSE: Quantity = Quantity::new("thrust course", "rad");
/// Angle of the thrust above the local horizontal.
pub const THRUST_PITCH: Quantity = Quantity::new("thrust pitch", "rad");
/// Components of the direction of the thrust upwards, to the east and to the north.
pub const THRUST_DIRECTION: [Quantity; 3] = [
    Quantity::new("thrust direction up", "-"),
    Quantity::new("thrust direction east", "-"),
    Quantity::new("thrust direction north", "-"),
];

/// States of all models.
pub const STATES: [Quantity; 7] =
    [RADIUS, LONGITUDE, LATITUDE, UPWARD_SPEED, EASTWARD_SPEED, NORTHWARD_SPEED, MASS];

/// A rotating body and an engine: what the equations of motion need to know.
#[derive(Clone, Debug, PartialEq)]
pub struct PoweredDescent {
    /// Gravity of the body.
    pub gravity: GravityField,
    /// Angular velocity of the body about its axis, rad/s, positive eastwards.
    pub rotation_rate: f64,
    /// Engine.
    pub engine: Engine,
}

impl PoweredDescent {
    /// Flight of a vehicle with one engine over a body.
    ///
    /// # Errors
    /// When the rotation rate is not finite.
    pub fn new(gravity: GravityField, rotation_rate: f64, engine: Engine) -> Result<Self, DynamicsError> {
        let rotation_rate = crate::error::finite("rotation rate", rotation_rate, "rad/s")?;
        Ok(Self { gravity, rotation_rate, engine })
    }

    /// The equations of motion with the components of the thrust and its size, N.
    #[inline]
    fn rate<S: Scalar>(&self, x: &[S; 7], thrust: [S; 3], size: S) -> [S; 7] {
        let [r, longitude, latitude, w, e, n, m] = *x;
        let (sin, cos) = latitude.sin_cos();
        let [gravity_up, gravity_east, gravity_north] = self.gravity.acceleration(r, longitude, latitude);
        let [up, east, north] = thrust.map(|t| t / m);
        let turn = self.rotation_rate;
        let (by_r, tan) = (r.recip(), sin / cos);
        let centrifugal = r * cos * (turn * turn);
        [
            w,
            e * by_r / cos,
            n * by_r,
            up + gravity_up + (e.square() + n.square()) * by_r + e * cos * (2.0 * turn) + centrifugal * cos,
            east + gravity_east + e * (n * tan - w) * by_r - (w * cos - n * sin) * (2.0 * turn),
            north + gravity_north
                - (e.square() * tan + n * w) * by_r
                - e * sin * (2.0 * turn)
                - centrifugal * sin,
            -size / self.engine.exhaust_velocity,
        ]
    }
}

/// Thrust by two angles and a throttle; controls [`THRUST_COURSE`], [`THRUST_PITCH`], [`THROTTLE`].
#[derive(Clone, Debug, PartialEq)]
pub struct AngledThrust(pub PoweredDescent);

impl AngledThrust {
    /// Controls of the model.
    pub const CONTROLS: [Quantity; 3] = [THRUST_COURSE, THRUST_PITCH, THROTTLE];
}

impl Dynamics<7, 3> for AngledThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 7] {
        let size = u[2] * self.0.engine.thrust;
        let ((sin_course, cos_course), (sin_pitch, cos_pitch)) = (u[0].sin_cos(), u[1].sin_cos());
        let horizontal = size * cos_pitch;
        self.0.rate(x, [size * sin_pitch, horizontal * sin_course, horizontal * cos_course], size)
    }
}

/// Thrust by a unit vector and a throttle; controls [`THRUST_DIRECTION`], whose length [`DirectionNorm`] is to be 1, and [`THROTTLE`].
///
/// Unlike the angles it has no singular direction.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectedThrust(pub PoweredDescent);

impl DirectedThrust {
    /// Controls of the model.
    pub const CONTROLS: [Quantity; 4] =
        [THRUST_DIRECTION[0], THRUST_DIRECTION[1], THRUST_DIRECTION[2], THROTTLE];
}

impl Dynamics<7, 4> for DirectedThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 4], _p: &[S; 0]) -> [S; 7] {
        let size = u[3] * self.0.engine.thrust;
        self.0.rate(x, [u[0] * size, u[1] * size, u[2] * size], size)
    }
}

/// Square of the length of the direction of [`DirectedThrust`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionNorm;

impl PathFunction<7, 4, 1> for DirectionNorm {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 7], u: &[S; 4], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square() + u[2].square()]
    }
}

/// Vertical flight above one place: the thrust leans by what holds the place, a few thousandths of a degree on the Moon.
///
/// With the accelerations `a_e = 2 W w cos(lat) - g_e` and `a_n = W^2 r sin(lat) cos(lat) - g_n` across,
///
/// ```text
/// r' = w,   w' = sqrt((T / m)^2 - a_e^2 - a_n^2) + g_w + W^2 r cos^2(lat),   m' = -T / c
/// ```
///
/// States [`VERTICAL_STATES`], control [`THROTTLE`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlumbThrust {
    /// The flight.
    pub flight: PoweredDescent,
    /// Longitude and latitude of the place, rad.
    pub place: [f64; 2],
}

/// States of [`PlumbThrust`] and [`Hovering`].
pub const VERTICAL_STATES: [Quantity; 3] = [RADIUS, UPWARD_SPEED, MASS];

impl PlumbThrust {
    /// Accelerations without thrust upwards, and that the thrust must have to the east and to the north, m/s2.
    fn parts<S: Scalar>(&self, r: S, w: S) -> [S; 3] {
        let [longitude, latitude] = self.place;
        let (sin, cos) = latitude.sin_cos();
        let [up, east, north] = self.flight.gravity.acceleration(r, S::from(longitude), S::from(latitude));
        let turn = self.flight.rotation_rate;
        let centrifugal = r * (cos * turn * turn);
        let (east, north) = (w * (2.0 * turn * cos) - east, centrifugal * sin - north);
        [up + centrifugal * cos, east, north]
    }

    /// Acceleration without thrust upwards, and square of the acceleration that the thrust must have across, m/s2 and m2/s4.
    fn accelerations<S: Scalar>(&self, r: S, w: S) -> (S, S) {
        let [up, east, north] = self.parts(r, w);
        (up, east.square() + north.square())
    }

    /// Parts of a thrust of a size (N) upwards, to the east and to the north, N, at a distance from the centre (m), an upward speed (m/s) and a
    /// mass (kg).
    #[must_use]
    pub fn thrust(&self, r: f64, w: f64, mass: f64, size: f64) -> [f64; 3] {
        let [_, east, north] = self.parts(r, w).map(|a| a * mass);
        [(size * size - east * east - north * north).max(0.0).sqrt(), east, north]
    }
}

impl Dynamics<3, 1> for PlumbThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let [r, w, m] = *x;
        let (free, across) = self.accelerations(r, w);
        let size = u[0] * self.flight.engine.thrust;
        let up = ((size / m).square() - across).sqrt();
        [w, up + free, -size / self.flight.engine.exhaust_velocity]
    }
}

/// Rest above one place, whatever thrust that takes; states [`VERTICAL_STATES`], no control.
#[derive(Clone, Debug, PartialEq)]
pub struct Hovering(pub PlumbThrust);

impl Hovering {
    /// Acceleration by the thrust, m/s2, at a distance from the centre (m).
    pub fn acceleration<S: Scalar>(&self, r: S) -> S {
        let (free, across) = self.0.accelerations(r, S::from(0.0));
        (free.square() + across).sqrt()
    }
}

impl Dynamics<3, 0> for Hovering {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], _u: &[S; 0], _p: &[S; 0]) -> [S; 3] {
        let zero = S::from(0.0);
        let flow = x[2] * self.acceleration(x[0]) / self.0.flight.engine.exhaust_velocity;
        [zero, zero, -flow]
    }
}

/// Thrust straight up; control [`THROTTLE`].
#[derive(Clone, Debug, PartialEq)]
pub struct UprightThrust(pub PoweredDescent);

impl Dynamics<7, 1> for UprightThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 1], _p: &[S; 0]) -> [S; 7] {
        let size = u[0] * self.0.engine.thrust;
        let zero = S::from(0.0);
        self.0.rate(x, [size, zero, zero], size)
    }
}

#[cfg(test)]
mod tests;
