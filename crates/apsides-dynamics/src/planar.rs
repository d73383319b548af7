//! Planar flight in an inverse-square field, in polar coordinates, non-rotating.
//!
//! With the radius `r`, the polar angle `phi`, the horizontal speed `u` (in the direction of motion), the radial speed `v`, the mass
//! `m`, the thrust `T` and the thrust angle `beta` from the local horizontal, positive up:
//!
//! ```text
//! r'   = v
//! phi' = u / r
//! u'   = (T / m) cos(beta) - u v / r
//! v'   = (T / m) sin(beta) + u^2 / r - mu / r^2
//! m'   = -T / c
//! ```
//!
//! (A. Naghash and A. Jamilnia, Modares Mechanical Engineering 17(10), 2017, eqs. 1 to 4, with an inverse-square field.)
//! A thrust angle above 90 deg brakes.

use apsides_ad::{Dynamics, Scalar};

use crate::{Body, Engine, Quantity};

pub mod flat;

/// Distance from the centre of the body.
pub const RADIUS: Quantity = Quantity::new("radius", "m");
/// Polar angle travelled.
pub const POLAR_ANGLE: Quantity = Quantity::new("polar angle", "rad");
/// Speed along the local horizontal.
pub const HORIZONTAL_SPEED: Quantity = Quantity::new("horizontal speed", "m/s");
/// Speed along the local vertical, positive up.
pub const RADIAL_SPEED: Quantity = Quantity::new("radial speed", "m/s");
/// Mass of the vehicle.
pub const MASS: Quantity = Quantity::new("mass", "kg");
/// Angle of the thrust from the local horizontal, positive up.
pub const THRUST_ANGLE: Quantity = Quantity::new("thrust angle", "rad");
/// Thrust relative to the largest.
pub const THROTTLE: Quantity = Quantity::new("throttle", "-");

/// States of [`ConstantThrust`] and [`ThrottledThrust`].
pub const STATES: [Quantity; 5] = [RADIUS, POLAR_ANGLE, HORIZONTAL_SPEED, RADIAL_SPEED, MASS];
/// States of [`VerticalThrust`].
pub const VERTICAL_STATES: [Quantity; 3] = [RADIUS, RADIAL_SPEED, MASS];

/// A body and an engine: what the equations of motion need to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarFlight {
    /// Central body.
    pub body: Body,
    /// Engine.
    pub engine: Engine,
}

impl PlanarFlight {
    /// Flight of a vehicle with one engine around a body.
    #[must_use]
    pub const fn new(body: Body, engine: Engine) -> Self {
        Self { body, engine }
    }

    /// The equations of motion with the thrust components along the horizontal and the vertical, and the thrust's size, in N.
    fn rate<S: Scalar>(&self, x: &[S; 5], horizontal: S, vertical: S, thrust: S) -> [S; 5] {
        let [r, _, u, v, m] = *x;
        let angular_rate = u / r;
        [
            v,
            angular_rate,
            horizontal / m - angular_rate * v,
            vertical / m + angular_rate * u - r.powi(-2) * self.body.gravitational_parameter,
            -thrust / self.engine.exhaust_velocity,
        ]
    }
}

/// Full thrust all the time; control: thrust angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantThrust(pub PlanarFlight);

impl Dynamics<5, 1> for ConstantThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 1], _p: &[S; 0]) -> [S; 5] {
        let thrust = self.0.engine.thrust;
        let (sin, cos) = u[0].sin_cos();
        self.0.rate(x, cos * thrust, sin * thrust, S::from(thrust))
    }
}

/// Thrust between zero and full; controls: thrust angle, throttle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrottledThrust(pub PlanarFlight);

impl Dynamics<5, 2> for ThrottledThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 2], _p: &[S; 0]) -> [S; 5] {
        let thrust = u[1] * self.0.engine.thrust;
        let (sin, cos) = u[0].sin_cos();
        self.0.rate(x, cos * thrust, sin * thrust, thrust)
    }
}

/// Vertical flight without horizontal speed, full thrust upwards; states [`VERTICAL_STATES`], no control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerticalThrust(pub PlanarFlight);

impl Dynamics<3, 0> for VerticalThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], _u: &[S; 0], _p: &[S; 0]) -> [S; 3] {
        let zero = S::from(0.0);
        let thrust = S::from(self.0.engine.thrust);
        let planar = [x[0], zero, zero, x[1], x[2]];
        let [r, _, _, v, m] = self.0.rate(&planar, zero, thrust, thrust);
        [r, v, m]
    }
}

#[cfg(test)]
mod tests;
