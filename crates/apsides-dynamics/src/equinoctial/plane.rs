//! Flight in one plane, the equatorial one of an oblate body: states `[p, f, g, L, m]`.

use apsides_ad::{Dynamics, Scalar};

use super::OrbitalFlight;
use crate::elements::Place;

/// The equations of motion with the radial and transverse component of the unit vector along the full thrust, if there is one.
fn rate<S: Scalar>(flight: &OrbitalFlight, x: &[S; 5], place: &Place<S>, thrust: Option<[S; 2]>) -> [S; 5] {
    let [_, f, g, _, m] = *x;
    let mut acceleration = thrust.map(|direction| flight.thrust_acceleration(m, &direction));
    if flight.j2 != 0.0 {
        let pull = place.radius.powi(-4) * (-1.5 * flight.oblateness());
        let [radial, transverse] = acceleration.unwrap_or([S::from(0.0); 2]);
        acceleration = Some([radial + pull, transverse]);
    }
    let [p, f, g, l] = place.in_plane(f, g, acceleration);
    [p, f, g, l, flight.mass_rate(thrust.is_some())]
}

fn place<S: Scalar>(flight: &OrbitalFlight, x: &[S; 5]) -> Place<S> {
    Place::new(flight.body.gravitational_parameter, x[0], x[1], x[2], x[3])
}

/// No thrust, no control; states [`PLANAR_STATES`](super::PLANAR_STATES).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarCoast(pub OrbitalFlight);

impl Dynamics<5, 0> for PlanarCoast {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 0], _p: &[S; 0]) -> [S; 5] {
        rate(&self.0, x, &place(&self.0, x), None)
    }
}

/// Full thrust; states [`PLANAR_STATES`](super::PLANAR_STATES), control: thrust angle from the local horizontal, positive up, zero
/// in the direction of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarThrust(pub OrbitalFlight);

impl Dynamics<5, 1> for PlanarThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 1], _p: &[S; 0]) -> [S; 5] {
        let (sin, cos) = u[0].sin_cos();
        rate(&self.0, x, &place(&self.0, x), Some([sin, cos]))
    }
}

/// Full thrust along the velocity, no control; states [`PLANAR_STATES`](super::PLANAR_STATES).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarVelocityThrust(pub OrbitalFlight);

impl Dynamics<5, 0> for PlanarVelocityThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 0], _p: &[S; 0]) -> [S; 5] {
        let place = place(&self.0, x);
        let direction = place.velocity_direction(x[1], x[2]);
        rate(&self.0, x, &place, Some(direction))
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
        let [p, f, g, l, m] = rate(&self.0, &x, &place(&self.0, &x), Some([cos, sin]));
        [p, f, g, l, m, S::from(0.0)]
    }
}
