//! Flight in a vertical plane that is fixed to the ground: a divert from one place to another.

use apsides_ad::{Dynamics, Scalar};

use super::{PoweredDescent, UPWARD_SPEED};
use crate::Quantity;
use crate::frames::Local;
use crate::planar::{MASS, RADIUS};

/// Angle at the centre from the start of a divert, along its course.
pub const DIVERT_ANGLE: Quantity = Quantity::new("divert angle", "rad");
/// Velocity relative to the ground along the course of a divert.
pub const FORWARD_SPEED: Quantity = Quantity::new("forward speed", "m/s");
/// Angle of the thrust from the vertical, forwards, in the plane of a divert.
pub const THRUST_TILT: Quantity = Quantity::new("thrust tilt", "rad");
/// The place of the thrust between the one whose upward part is the least thrust (0) and full thrust (1).
pub const THRUST_PART: Quantity = Quantity::new("thrust part", "-");

/// Flight in the vertical plane through a place along a course: the thrust leans across by what keeps the flight in it, a few
/// thousandths of a degree on the Moon.
///
/// With the axes `u` upwards, `f` forwards and `n = u x f` along the flight, the rotation `W` in them, the velocity `w u + v f` relative to the
/// ground, the thrust `T`, and its part in the plane at the angle `a` from the vertical,
///
/// ```text
/// r' = w,   s' = v / r
/// w' = A cos(a) + g_u + v^2 / r + 2 W_n v + r (W^2 - W_u^2)
/// v' = A sin(a) + g_f - w v / r - 2 W_n w - r W_u W_f
/// m' = -T / c
/// A^2 = (T / m)^2 - a_n^2,   a_n = 2 (W_u v - W_f w) + r W_u W_n - g_n
/// ```
///
/// Newton's law in axes that rotate with the body (Vallado 2013, section 3.3).
///
/// The upward part of the thrust is never below the least thrust `T1`: with the thrust part `p` it is `T = (1 - p) T1 / cos(a) + p T2`. So
/// leaning takes more thrust, and none leans to and fro only to fall faster than upright flight can, which has a continuum of optima. States [`VerticalPlaneThrust::STATES`], controls
/// [`VerticalPlaneThrust::CONTROLS`].
#[derive(Clone, Debug, PartialEq)]
pub struct VerticalPlaneThrust {
    /// The flight.
    pub flight: PoweredDescent,
    /// Longitude and latitude of the place where the angle is zero, rad.
    pub place: [f64; 2],
    /// Course there, rad from north towards east.
    pub course: f64,
    /// Least throttle of the engine upright.
    pub least_throttle: f64,
}

impl VerticalPlaneThrust {
    /// States of the model.
    pub const STATES: [Quantity; 5] = [RADIUS, DIVERT_ANGLE, UPWARD_SPEED, FORWARD_SPEED, MASS];
    /// Controls of the model.
    pub const CONTROLS: [Quantity; 2] = [THRUST_TILT, THRUST_PART];

    /// Upwards, forwards and to the left at the place, in axes fixed to the body.
    fn axes(&self) -> [[f64; 3]; 3] {
        let Local { up, east, north } = Local::at(self.place[0], self.place[1]);
        let (sin, cos) = self.course.sin_cos();
        let along = |forward: f64, right: f64| -> [f64; 3] {
            std::array::from_fn(|k| forward * north[k] + right * east[k])
        };
        [up, along(cos, sin), along(sin, -cos)]
    }

    /// Throttle at a tilt (rad) and a thrust part.
    #[must_use]
    pub fn throttle<S: Scalar>(&self, tilt: S, part: S) -> S {
        (S::from(1.0) - part) * self.least_throttle / tilt.cos() + part
    }

    /// Position (m), velocity over the ground (m/s) and thrust (N) at a state and a control, in axes fixed to the body.
    #[must_use]
    pub fn vectors(&self, [r, s, w, v, m]: [f64; 5], [tilt, part]: [f64; 2]) -> [[f64; 3]; 3] {
        let [up0, forward0, left] = self.axes();
        let (sin, cos) = s.sin_cos();
        let up = [0, 1, 2].map(|k| cos * up0[k] + sin * forward0[k]);
        let forward = [0, 1, 2].map(|k| cos * forward0[k] - sin * up0[k]);
        let [longitude, latitude] = self.place_at(s);
        let local = Local::at(longitude, latitude);
        let [_, east, north] = self.flight.gravity.acceleration(r, longitude, latitude);
        let gravity = local.vector([0.0, east, north]);
        let turns = [up, forward, left].map(|axis| axis[2] * self.flight.rotation_rate);
        let side = m * side([r, w, v], turns, || (0..3).map(|k| gravity[k] * left[k]).sum());
        let size = self.throttle(tilt, part) * self.flight.engine.thrust;
        let in_plane = (size * size - side * side).max(0.0).sqrt();
        let along = |a: f64, b: f64, c: f64| [0, 1, 2].map(|k| a * up[k] + b * forward[k] + c * left[k]);
        [along(r, 0.0, 0.0), along(w, v, 0.0), along(in_plane * tilt.cos(), in_plane * tilt.sin(), side)]
    }

    /// Longitude and latitude (rad) at an angle from the start (rad).
    #[must_use]
    pub fn place_at(&self, angle: f64) -> [f64; 2] {
        let [up, forward, _] = self.axes();
        let (sin, cos) = angle.sin_cos();
        let (_, longitude, latitude) = Local::spherical([0, 1, 2].map(|k| cos * up[k] + sin * forward[k]));
        [longitude, latitude]
    }
}

/// Acceleration across the plane, m/s2, that keeps a flight in it, with the rotation in its axes and gravity to the left.
fn side<S: Scalar>([r, w, v]: [S; 3], turns: [S; 3], gravity_left: impl FnOnce() -> S) -> S {
    let [turn_up, turn_forward, turn_left] = turns;
    (turn_up * v - turn_forward * w) * 2.0 + r * turn_up * turn_left - gravity_left()
}

impl Dynamics<5, 2> for VerticalPlaneThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 2], _p: &[S; 0]) -> [S; 5] {
        let [r, s, w, v, m] = *x;
        let [up0, forward0, left] = self.axes();
        let (sin, cos) = s.sin_cos();
        let up: [S; 3] = std::array::from_fn(|k| cos * up0[k] + sin * forward0[k]);
        let forward: [S; 3] = std::array::from_fn(|k| cos * forward0[k] - sin * up0[k]);
        // Longitude and latitude, east and north there, for fields that are not central.
        let (longitude, latitude) = (up[1].atan2(up[0]), up[2].asin());
        let (sin_longitude, cos_longitude) = longitude.sin_cos();
        let (sin_latitude, cos_latitude) = latitude.sin_cos();
        let east = [-sin_longitude, cos_longitude, S::from(0.0)];
        let north = [-sin_latitude * cos_longitude, -sin_latitude * sin_longitude, cos_latitude];
        let [gravity_up, gravity_east, gravity_north] =
            self.flight.gravity.acceleration(r, longitude, latitude);
        let across = |a: &[S; 3], b: &[S; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let left = left.map(S::from);
        let gravity =
            |axis: &[S; 3]| gravity_east * across(&east, axis) + gravity_north * across(&north, axis);
        let turn = self.flight.rotation_rate;
        let (turn_up, turn_forward, turn_left) = (up[2] * turn, forward[2] * turn, left[2] * turn);
        let side = side([r, w, v], [turn_up, turn_forward, turn_left], || gravity(&left));
        let size = self.throttle(u[0], u[1]) * self.flight.engine.thrust;
        let in_plane = ((size / m).square() - side.square()).sqrt();
        let (sin_tilt, cos_tilt) = u[0].sin_cos();
        [
            w,
            v / r,
            in_plane * cos_tilt
                + gravity_up
                + v.square() / r
                + turn_left * v * 2.0
                + r * (turn_up.square() * -1.0 + turn * turn),
            in_plane * sin_tilt + gravity(&forward)
                - w * v / r
                - turn_left * w * 2.0
                - r * turn_up * turn_forward,
            -size / self.flight.engine.exhaust_velocity,
        ]
    }
}
