//! Planar flight with constant thrust in flat outputs: the radius and, unless the flight is vertical, the polar angle.
//!
//! ```text
//! u = r phi',   v = r',   m = m0 - (T / c) (t - t0)
//! a_h = r phi'' + 2 r' phi',   a_v = r'' - r phi'^2 + mu / r^2,   beta = atan2(a_v, a_h)
//! 0 = m^2 (a_h^2 + a_v^2) - T^2        (vertical: 0 = m a_v - T)
//! ```
//!
//! (R. Jamilnia, Modares Mechanical Engineering 17(10), 2017, eqs. 32 to 38.) The thrust is squared where its
//! direction is free, since its size has no derivative at zero. Squared, it does not depend on the polar angle to first order where
//! the thrust is vertical and the angular rate is zero: vertical flight has a map of its own, which keeps the sign of the thrust.

use std::f64::consts::FRAC_PI_2;

use apsides_ad::{FlatMap, Scalar};

use super::PlanarFlight;

/// Accelerations that the thrust must give, along the horizontal and along the vertical, m/s2; of radius and polar angle with two
/// derivatives each.
pub fn thrust_acceleration<S: Scalar>(flight: &PlanarFlight, r: &[S; 3], phi: &[S; 3]) -> [S; 2] {
    let gravity = r[0].powi(-2) * flight.body.gravitational_parameter;
    [r[0] * phi[2] + r[1] * phi[1] * 2.0, r[2] - r[0] * phi[1].square() + gravity]
}

/// Angle of an acceleration from the local horizontal in (-90 deg, 270 deg], rad: continuous through 180 deg, where a thrust brakes.
pub fn thrust_angle<S: Scalar>([horizontal, vertical]: [S; 2]) -> S {
    (-horizontal).atan2(vertical) + FRAC_PI_2
}

/// [`ConstantThrust`](super::ConstantThrust) in the outputs radius and polar angle; the mass is a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatConstantThrust {
    /// Body and engine.
    pub flight: PlanarFlight,
    /// Time of ignition, s.
    pub ignition: f64,
    /// Mass then, kg.
    pub mass: f64,
}

/// [`VerticalThrust`](super::VerticalThrust) in the output radius; the mass is a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatVerticalThrust(pub FlatConstantThrust);

impl FlatConstantThrust {
    /// Mass at a time.
    pub fn mass_at<S: Scalar>(&self, t: S) -> S {
        (t - self.ignition) * -self.flight.engine.mass_flow() + self.mass
    }
}

impl FlatMap<2, 3, 5, 1, 1> for FlatConstantThrust {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 3]; 2], _p: &[S; 0]) -> ([S; 5], [S; 1], [S; 1]) {
        let [r, phi] = y;
        let a = thrust_acceleration(&self.flight, r, phi);
        let m = self.mass_at(t);
        let thrust = self.flight.engine.thrust;
        let residual = m.square() * (a[0].square() + a[1].square()) - thrust * thrust;
        ([r[0], phi[0], r[0] * phi[1], r[1], m], [thrust_angle(a)], [residual])
    }

    fn outputs(&self, _t: f64, x: &[f64; 5], _u: &[f64; 1], _p: &[f64; 0]) -> [f64; 2] {
        [x[0], x[1]]
    }
}

impl FlatMap<1, 3, 3, 0, 1> for FlatVerticalThrust {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 3]; 1], _p: &[S; 0]) -> ([S; 3], [S; 0], [S; 1]) {
        let FlatConstantThrust { flight, .. } = &self.0;
        let [_, vertical] = thrust_acceleration(flight, &y[0], &[S::from(0.0); 3]);
        let m = self.0.mass_at(t);
        ([y[0][0], y[0][1], m], [], [m * vertical - flight.engine.thrust])
    }

    fn outputs(&self, _t: f64, x: &[f64; 3], _u: &[f64; 0], _p: &[f64; 0]) -> [f64; 1] {
        [x[0]]
    }
}

/// [`ConstantThrust`](super::ConstantThrust) with radius, polar angle, both speeds and the thrust angle as outputs of their own: the same
/// curves without flatness. The residuals are the equations of motion less that of the mass, a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplinedConstantThrust(pub FlatConstantThrust);

/// [`VerticalThrust`](super::VerticalThrust) with radius and radial speed as outputs of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplinedVerticalThrust(pub FlatConstantThrust);

impl FlatMap<5, 2, 5, 1, 4> for SplinedConstantThrust {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 2]; 5], _p: &[S; 0]) -> ([S; 5], [S; 1], [S; 4]) {
        let [r, phi, u, v, beta] = y;
        let state = [r[0], phi[0], u[0], v[0], self.0.mass_at(t)];
        let thrust = S::from(self.0.flight.engine.thrust);
        let rate = self.0.flight.inclined_rate(&state, beta[0], thrust);
        (state, [beta[0]], [r[1] - rate[0], phi[1] - rate[1], u[1] - rate[2], v[1] - rate[3]])
    }

    fn outputs(&self, _t: f64, x: &[f64; 5], u: &[f64; 1], _p: &[f64; 0]) -> [f64; 5] {
        [x[0], x[1], x[2], x[3], u[0]]
    }
}

impl FlatMap<2, 2, 3, 0, 2> for SplinedVerticalThrust {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 2]; 2], _p: &[S; 0]) -> ([S; 3], [S; 0], [S; 2]) {
        let FlatConstantThrust { flight, .. } = &self.0;
        let ([r, v], zero) = (y, S::from(0.0));
        let state = [r[0], zero, zero, v[0], self.0.mass_at(t)];
        let thrust = S::from(flight.engine.thrust);
        let rate = flight.rate(&state, zero, thrust, thrust);
        ([r[0], v[0], state[4]], [], [r[1] - rate[0], v[1] - rate[3]])
    }

    fn outputs(&self, _t: f64, x: &[f64; 3], _u: &[f64; 0], _p: &[f64; 0]) -> [f64; 2] {
        [x[0], x[1]]
    }
}
