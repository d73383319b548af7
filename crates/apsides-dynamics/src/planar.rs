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
//! (R. Jamilnia, Modares Mechanical Engineering 17(10), 2017, eqs. 1 to 4, with an inverse-square field.)
//! A thrust angle above 90 deg brakes.
//!
//! Every model below is this one rate with a thrust of its own: none, full, throttled, upwards. [`PitchRate`] makes the thrust angle
//! of a model a state, with its rate as the control.

use apsides_ad::{Dynamics, Scalar, vector};

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
/// Rate of change of the thrust angle.
pub const PITCH_RATE: Quantity = Quantity::new("pitch rate", "rad/s");
/// Thrust relative to the largest.
pub const THROTTLE: Quantity = Quantity::new("throttle", "-");

/// States of [`ConstantThrust`], [`ThrottledThrust`] and [`Coasting`]; [`PitchRate`] adds [`THRUST_ANGLE`].
pub const STATES: [Quantity; 5] = [RADIUS, POLAR_ANGLE, HORIZONTAL_SPEED, RADIAL_SPEED, MASS];
/// States of [`VerticalThrust`] and [`ThrottledVerticalThrust`].
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

    /// The same with the thrust at an angle from the horizontal.
    fn inclined_rate<S: Scalar>(&self, x: &[S; 5], angle: S, thrust: S) -> [S; 5] {
        let (sin, cos) = angle.sin_cos();
        self.rate(x, cos * thrust, sin * thrust, thrust)
    }

    /// The same without horizontal speed, thrust upwards; states [`VERTICAL_STATES`].
    fn vertical_rate<S: Scalar>(&self, x: &[S; 3], thrust: S) -> [S; 3] {
        let zero = S::from(0.0);
        let [r, _, _, v, m] = self.rate(&[x[0], zero, zero, x[1], x[2]], zero, thrust, thrust);
        [r, v, m]
    }

    /// Distance (m) of the lowest point of the orbit through radius `r` (m) with speeds `u` and `v` (m/s).
    ///
    /// With the semi-latus rectum `p = (r u)^2 / mu`: `e cos(nu) = p / r - 1`, `e sin(nu) = v sqrt(p / mu)` and
    /// `r_p = p / (1 + e)` (Vallado 2013, section 2.4). The eccentricity is smoothed where it is below 1e-9.
    pub fn periapsis_radius<S: Scalar>(&self, r: S, u: S, v: S) -> S {
        let mu = self.body.gravitational_parameter;
        let latus_rectum = (r * u).powi(2) / mu;
        let eccentricity = vector::norm(&[latus_rectum / r - 1.0, r * u * v / mu], ROUND);
        latus_rectum / (eccentricity + 1.0)
    }
}

/// Eccentricity of an orbit that counts as a circle.
const ROUND: f64 = 1e-9;

/// No thrust, no control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coasting(pub PlanarFlight);

impl Dynamics<5, 0> for Coasting {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 0], _p: &[S; 0]) -> [S; 5] {
        let zero = S::from(0.0);
        self.0.rate(x, zero, zero, zero)
    }
}

/// Full thrust all the time; control: thrust angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantThrust(pub PlanarFlight);

impl Dynamics<5, 1> for ConstantThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 1], _p: &[S; 0]) -> [S; 5] {
        self.0.inclined_rate(x, u[0], S::from(self.0.engine.thrust))
    }
}

/// Thrust between zero and full; controls: thrust angle, throttle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrottledThrust(pub PlanarFlight);

impl Dynamics<5, 2> for ThrottledThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 2], _p: &[S; 0]) -> [S; 5] {
        self.0.inclined_rate(x, u[0], u[1] * self.0.engine.thrust)
    }
}

/// A model whose first control is the thrust angle, with that angle as sixth state and its rate as first control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PitchRate<M>(pub M);

impl<M: Dynamics<5, NU>, const NU: usize> Dynamics<6, NU> for PitchRate<M> {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 6], u: &[S; NU], p: &[S; 0]) -> [S; 6] {
        const { assert!(NU > 0, "the model needs a thrust angle") };
        let [r, angle, horizontal, radial, mass, thrust_angle] = *x;
        let mut controls = *u;
        controls[0] = thrust_angle;
        let flight = self.0.rate(t, &[r, angle, horizontal, radial, mass], &controls, p);
        [flight[0], flight[1], flight[2], flight[3], flight[4], u[0]]
    }
}

/// Vertical flight without horizontal speed, full thrust upwards; states [`VERTICAL_STATES`], no control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerticalThrust(pub PlanarFlight);

impl Dynamics<3, 0> for VerticalThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], _u: &[S; 0], _p: &[S; 0]) -> [S; 3] {
        self.0.vertical_rate(x, S::from(self.0.engine.thrust))
    }
}

/// Vertical flight without horizontal speed, thrust upwards between zero and full; states [`VERTICAL_STATES`], control:
/// throttle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrottledVerticalThrust(pub PlanarFlight);

impl Dynamics<3, 1> for ThrottledVerticalThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        self.0.vertical_rate(x, u[0] * self.0.engine.thrust)
    }
}

#[cfg(test)]
mod tests;
