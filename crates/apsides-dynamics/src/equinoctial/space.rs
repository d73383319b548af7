//! Flight in space: states `[p, f, g, h, k, L, m]`.

use apsides_ad::{Dynamics, Scalar, vector};

use super::OrbitalFlight;
use crate::elements::{Place, Sense, equinoctial_axes};

/// The equations of motion with the radial, transverse and normal component of the unit vector along the full thrust, if there is
/// one.
fn rate<S: Scalar>(flight: &OrbitalFlight, x: &[S; 7], place: &Place<S>, thrust: Option<[S; 3]>) -> [S; 7] {
    let [_, f, g, h, k, _, m] = *x;
    let tilt = h * place.sin - k * place.cos;
    let s2 = h * h + k * k + 1.0;
    let mut acceleration = thrust.map(|direction| flight.thrust_acceleration(m, &direction));
    if flight.j2 != 0.0 {
        let along = h * place.cos + k * place.sin;
        let size = (place.radius.square() * s2).powi(-2) * (-6.0 * flight.oblateness());
        let pull = [
            (s2.square() * 0.25 - tilt.square() * 3.0) * size,
            tilt * along * size * 2.0,
            tilt * (-s2 + 2.0) * size,
        ];
        acceleration = Some(acceleration.map_or(pull, |thrust| vector::add(&thrust, &pull)));
    }
    let in_plane = acceleration.map(|[radial, transverse, _]| [radial, transverse]);
    let [p, mut f1, mut g1, mut l] = place.in_plane(f, g, in_plane);
    let zero = S::from(0.0);
    let (mut h1, mut k1) = (zero, zero);
    if let Some([_, _, normal]) = acceleration {
        let lever = place.root * normal / place.q;
        let turn = tilt * lever;
        f1 -= g * turn;
        g1 += f * turn;
        l += turn;
        let half = s2 * lever * 0.5;
        (h1, k1) = (half * place.cos, half * place.sin);
    }
    [p, f1, g1, h1, k1, l, flight.mass_rate(thrust.is_some())]
}

fn place<S: Scalar>(flight: &OrbitalFlight, x: &[S; 7]) -> Place<S> {
    Place::new(flight.body.gravitational_parameter, x[0], x[1], x[2], x[5])
}

/// No thrust, no control; states [`SPATIAL_STATES`](super::SPATIAL_STATES).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialCoast(pub OrbitalFlight);

impl Dynamics<7, 0> for SpatialCoast {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], _u: &[S; 0], _p: &[S; 0]) -> [S; 7] {
        rate(&self.0, x, &place(&self.0, x), None)
    }
}

/// Full thrust; states [`SPATIAL_STATES`](super::SPATIAL_STATES), controls: the angle `alpha` from the local horizontal in the
/// orbital plane, positive up, and the angle `beta` out of that plane, positive along the angular momentum.
///
/// The unit vector along the thrust has the components `sin(alpha) cos(beta)` (radial), `cos(alpha) cos(beta)` (transverse) and
/// `sin(beta)` (normal).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialThrust(pub OrbitalFlight);

impl Dynamics<7, 2> for SpatialThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 2], _p: &[S; 0]) -> [S; 7] {
        let [(sin_in, cos_in), (sin_out, cos_out)] = u.map(Scalar::sin_cos);
        let direction = [sin_in * cos_out, cos_in * cos_out, sin_out];
        rate(&self.0, x, &place(&self.0, x), Some(direction))
    }
}

/// Full thrust along the velocity, no control; states [`SPATIAL_STATES`](super::SPATIAL_STATES).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialVelocityThrust(pub OrbitalFlight);

impl Dynamics<7, 0> for SpatialVelocityThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], _u: &[S; 0], _p: &[S; 0]) -> [S; 7] {
        let place = place(&self.0, x);
        let [radial, transverse] = place.velocity_direction(x[1], x[2]);
        rate(&self.0, x, &place, Some([radial, transverse, S::from(0.0)]))
    }
}

/// Full thrust in a direction that is fixed in inertial space, no control; states [`SPATIAL_STATES`](super::SPATIAL_STATES),
/// [`THRUST_LONGITUDE`](super::THRUST_LONGITUDE) and [`THRUST_LATITUDE`](super::THRUST_LATITUDE), which are constant.
///
/// With the longitude `a` and the latitude `d` the unit vector along the thrust is `[cos(d) cos(a), cos(d) sin(a), sin(d)]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialInertialThrust(pub OrbitalFlight);

impl Dynamics<9, 0> for SpatialInertialThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 9], _u: &[S; 0], _p: &[S; 0]) -> [S; 9] {
        let [p, f, g, h, k, l, m, longitude, latitude] = *x;
        let x = [p, f, g, h, k, l, m];
        let place = place(&self.0, &x);
        let thrust = inertial_direction(longitude, latitude);
        let [x1, x2, normal] =
            equinoctial_axes(h, k, Sense::Prograde).map(|axis| vector::dot(&axis, &thrust));
        let (radial, transverse) = (x1 * place.cos + x2 * place.sin, x2 * place.cos - x1 * place.sin);
        let rates = rate(&self.0, &x, &place, Some([radial, transverse, normal]));
        let [p, f, g, h, k, l, m] = rates;
        [p, f, g, h, k, l, m, S::from(0.0), S::from(0.0)]
    }
}

/// Unit vector of a longitude and a latitude in inertial space.
pub(crate) fn inertial_direction<S: Scalar>(longitude: S, latitude: S) -> [S; 3] {
    let ((sin_a, cos_a), (sin_d, cos_d)) = (longitude.sin_cos(), latitude.sin_cos());
    [cos_d * cos_a, cos_d * sin_a, sin_d]
}
