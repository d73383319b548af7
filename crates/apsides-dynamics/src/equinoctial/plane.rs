//! Flight in one plane, the equatorial one of an oblate body: states `[p, f, g, L, m]`.

use apsides_ad::{Dynamics, Scalar};

use super::OrbitalFlight;
use crate::elements::Place;

/// The equations of motion with the radial and transverse component of the unit vector along the thrust, and the thrust's size, in N.
fn rate<S: Scalar>(
    flight: &OrbitalFlight,
    x: &[S; 5],
    place: &Place<S>,
    [radial, transverse]: [S; 2],
    thrust: f64,
) -> [S; 5] {
    let [_, f, g, _, m] = *x;
    let push = m.recip() * thrust;
    let mut radial = radial * push;
    if flight.j2 != 0.0 {
        radial -= place.radius.powi(-4) * (1.5 * flight.oblateness());
    }
    let [p, f, g, l] = place.in_plane(f, g, radial, transverse * push);
    [p, f, g, l, S::from(-thrust / flight.engine.exhaust_velocity)]
}

fn place<S: Scalar>(flight: &OrbitalFlight, x: &[S; 5]) -> Place<S> {
    Place::new(flight.body.gravitational_parameter, x[0], x[1], x[2], x[3])
}

/// No thrust, no control; states [`PLANAR_STATES`](super::PLANAR_STATES).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarCoast(pub OrbitalFlight);

impl Dynamics<5, 0> for PlanarCoast {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 0], _p: &[S; 0]) -> [S; 5] {
        rate(&self.0, x, &place(&self.0, x), [S::from(0.0); 2], 0.0)
    }
}

/// Full thrust; states [`PLANAR_STATES`](super::PLANAR_STATES), control: thrust angle from the local horizontal, positive up, zero
/// in the direction of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarThrust(pub OrbitalFlight);

impl Dynamics<5, 1> for PlanarThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 1], _p: &[S; 0]) -> [S; 5] {
        let (sin, cos) = u[0].sin_cos();
        rate(&self.0, x, &place(&self.0, x), [sin, cos], self.0.engine.thrust)
    }
}

/// Full thrust along the velocity, no control; states [`PLANAR_STATES`](super::PLANAR_STATES).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarVelocityThrust(pub OrbitalFlight);

impl Dynamics<5, 0> for PlanarVelocityThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 0], _p: &[S; 0]) -> [S; 5] {
        let place = place(&self.0, x);
        let direction = place.velocity_direction(x[1], x[2]);
        rate(&self.0, x, &place, direction, self.0.engine.thrust)
    }
}

/// Full thrust in a direction that is fixed in inertial space, no control; states [`PLANAR_STATES`](super::PLANAR_STATES) and
/// [`THRUST_LONGITUDE`](super::THRUST_LONGITUDE), which is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarInertialThrust(pub OrbitalFlight);

impl Dynamics<6, 0> for PlanarInertialThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], _u: &[S; 0], _p: &[S; 0]) -> [S; 6] {
        let [p, f, g, l, m, direction] = *x;
        let x = [p, f, g, l, m];
        let (sin, cos) = (direction - l).sin_cos();
        let [p, f, g, l, m] = rate(&self.0, &x, &place(&self.0, &x), [cos, sin], self.0.engine.thrust);
        [p, f, g, l, m, S::from(0.0)]
    }
}
