//! Orbital flight with finite thrust in Cartesian coordinates of inertial space: states `[x, y, z, vx, vy, vz, m]`.
//!
//! ```text
//! r' = v
//! v' = -mu r / |r|^3 + oblateness + (T / m) d
//! m' = -T / c
//! ```
//!
//! with the unit vector `d` along the thrust. The oblateness `J2` of the body, with its equatorial radius `Re`, the third axis along
//! the axis of the body and `s = z / |r|`, adds `-(3/2) mu J2 Re^2 / |r|^5` times
//!
//! ```text
//! [(1 - 5 s^2) x, (1 - 5 s^2) y, (3 - 5 s^2) z]
//! ```
//!
//! (Vallado 2013, section 8.6.) These equations hold for every motion but through the centre; steering relative to the orbit, and along
//! the velocity, needs an orbital plane, and a velocity.
//!
//! The models are those of [`equinoctial`](crate::equinoctial), with the same steering: the two sets of equations check each other.

use apsides_ad::{Dynamics, Scalar, vector};

use crate::equinoctial::{OrbitalFlight, inertial_direction};
use crate::planar::MASS;
use crate::{Body, Quantity};

/// Positions along the inertial axes.
pub const POSITION: [Quantity; 3] =
    [Quantity::new("position x", "m"), Quantity::new("position y", "m"), Quantity::new("position z", "m")];
/// Velocities along the inertial axes.
pub const VELOCITY: [Quantity; 3] = [
    Quantity::new("velocity x", "m/s"),
    Quantity::new("velocity y", "m/s"),
    Quantity::new("velocity z", "m/s"),
];
/// States of the models; [`CartesianInertialThrust`] adds [`THRUST_LONGITUDE`](crate::equinoctial::THRUST_LONGITUDE) and
/// [`THRUST_LATITUDE`](crate::equinoctial::THRUST_LATITUDE).
pub const STATES: [Quantity; 7] =
    [POSITION[0], POSITION[1], POSITION[2], VELOCITY[0], VELOCITY[1], VELOCITY[2], MASS];

/// The equations of motion with the unit vector along the full thrust, if there is one.
fn rate<S: Scalar>(flight: &OrbitalFlight, x: &[S; 7], thrust: Option<[S; 3]>) -> [S; 7] {
    let [x, y, z, vx, vy, vz, m] = *x;
    let position = [x, y, z];
    let square = vector::dot(&position, &position);
    let cube = square * square.sqrt();
    let central = cube.recip() * -flight.body.gravitational_parameter;
    let mut acceleration = vector::scale(&position, central);
    if flight.j2 != 0.0 {
        let size = (cube * square).recip() * (-1.5 * flight.oblateness());
        let latitude = z.square() / square * 5.0;
        let (equatorial, polar) = ((-latitude + 1.0) * size, (-latitude + 3.0) * size);
        acceleration = vector::add(&acceleration, &[x * equatorial, y * equatorial, z * polar]);
    }
    if let Some(direction) = thrust {
        acceleration = vector::add(&acceleration, &flight.thrust_acceleration(m, &direction));
    }
    let [ax, ay, az] = acceleration;
    [vx, vy, vz, ax, ay, az, flight.mass_rate(thrust.is_some())]
}

/// Unit vector.
fn unit<S: Scalar>(a: &[S; 3]) -> [S; 3] {
    vector::scale(a, vector::norm(a, 0.0).recip())
}

/// No thrust, no control; states [`STATES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianCoast(pub OrbitalFlight);

impl Dynamics<7, 0> for CartesianCoast {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], _u: &[S; 0], _p: &[S; 0]) -> [S; 7] {
        rate(&self.0, x, None)
    }
}

/// Full thrust; states [`STATES`], controls: the angle from the local horizontal in the orbital plane, positive up, and the angle out
/// of that plane, as in [`SpatialThrust`](crate::equinoctial::SpatialThrust).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianThrust(pub OrbitalFlight);

impl Dynamics<7, 2> for CartesianThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 2], _p: &[S; 0]) -> [S; 7] {
        let (position, velocity) = ([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let up = unit(&position);
        let normal = unit(&vector::cross(&position, &velocity));
        let forward = vector::cross(&normal, &up);
        let [(sin_in, cos_in), (sin_out, cos_out)] = u.map(Scalar::sin_cos);
        let in_plane =
            vector::add(&vector::scale(&up, sin_in * cos_out), &vector::scale(&forward, cos_in * cos_out));
        let direction = vector::add(&in_plane, &vector::scale(&normal, sin_out));
        rate(&self.0, x, Some(direction))
    }
}

/// Full thrust along the velocity, no control; states [`STATES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianVelocityThrust(pub OrbitalFlight);

impl Dynamics<7, 0> for CartesianVelocityThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], _u: &[S; 0], _p: &[S; 0]) -> [S; 7] {
        rate(&self.0, x, Some(unit(&[x[3], x[4], x[5]])))
    }
}

/// Full thrust in a direction that is fixed in inertial space, no control; states [`STATES`] and the longitude and latitude of the
/// thrust, as in [`SpatialInertialThrust`](crate::equinoctial::SpatialInertialThrust).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianInertialThrust(pub OrbitalFlight);

impl Dynamics<9, 0> for CartesianInertialThrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 9], _u: &[S; 0], _p: &[S; 0]) -> [S; 9] {
        let [x, y, z, vx, vy, vz, m, longitude, latitude] = *x;
        let direction = inertial_direction(longitude, latitude);
        let rates = rate(&self.0, &[x, y, z, vx, vy, vz, m], Some(direction));
        let [x, y, z, vx, vy, vz, m] = rates;
        [x, y, z, vx, vy, vz, m, S::from(0.0), S::from(0.0)]
    }
}

/// A given force in an inverse-square field; states [`STATES`], controls: components of the force along the inertial axes, N.
///
/// For flights whose thrust is known as a function of time, such as that of a nominal flight. The propellant follows from the size of the
/// force, which must not vanish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CartesianForce {
    /// The body.
    pub body: Body,
    /// Effective exhaust velocity, m/s.
    pub exhaust_velocity: f64,
}

impl Dynamics<7, 3> for CartesianForce {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 7] {
        let [x, y, z, vx, vy, vz, m] = *x;
        let position = [x, y, z];
        let square = vector::dot(&position, &position);
        let central = (square * square.sqrt()).recip() * -self.body.gravitational_parameter;
        let [ax, ay, az] = vector::add(&vector::scale(&position, central), &vector::scale(u, m.recip()));
        [vx, vy, vz, ax, ay, az, -vector::norm(u, 0.0) / self.exhaust_velocity]
    }
}
