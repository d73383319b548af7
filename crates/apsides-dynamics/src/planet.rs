//! Planets: a body with its rotation, its oblateness and its atmosphere.

use apsides_ad::Scalar;

use crate::atmosphere::{Atmosphere, Exponential};
use crate::error::finite;
use crate::{Body, DynamicsError, Ellipsoid};

/// A rotating body with an atmosphere that rotates with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Planet {
    /// The body; altitudes are above the sphere of its radius.
    pub body: Body,
    /// Angular velocity about the axis, rad/s, positive eastwards; 0 for none.
    pub rotation_rate: f64,
    /// Oblateness `J2`; 0 for a sphere. Goes with the equatorial radius.
    pub j2: f64,
    /// The atmosphere.
    pub atmosphere: Atmosphere,
}

/// Angular velocity of the Earth, rad/s (WGS 84, NGA.STND.0036, 2014).
pub const EARTH_ROTATION_RATE: f64 = 7.292_115e-5;

/// Angular velocity of Mars, rad/s: 350.891985307 deg in a day of 86400 s (IAU 2015, doi 10.1007/s10569-017-9805-5).
pub const MARS_ROTATION_RATE: f64 = 7.088_218_127e-5;

impl Planet {
    /// A body with its rotation rate (rad/s), its oblateness and its atmosphere.
    ///
    /// # Errors
    /// When the rotation rate or the oblateness is not finite.
    pub fn new(
        body: Body,
        rotation_rate: f64,
        j2: f64,
        atmosphere: Atmosphere,
    ) -> Result<Self, DynamicsError> {
        let rotation_rate = finite("rotation rate", rotation_rate, "rad/s")?;
        Ok(Self { body, rotation_rate, j2: finite("oblateness J2", j2, "-")?, atmosphere })
    }

    /// The rotating Earth as a sphere.
    #[must_use]
    pub fn earth(atmosphere: Atmosphere) -> Self {
        Self { body: Body::EARTH, rotation_rate: EARTH_ROTATION_RATE, j2: 0.0, atmosphere }
    }

    /// Rotating Mars as a sphere, with [`Exponential::MARS`].
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::Planet;
    ///
    /// let mars = Planet::mars();
    /// let density = mars.atmosphere.density(0.0);
    /// assert!((density - 0.0158).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn mars() -> Self {
        let atmosphere = Atmosphere::Exponential(Exponential::MARS);
        Self { body: Body::MARS, rotation_rate: MARS_ROTATION_RATE, j2: 0.0, atmosphere }
    }

    /// The same planet with another oblateness.
    #[must_use]
    pub fn with_j2(self, j2: f64) -> Self {
        Self { j2, ..self }
    }

    /// The surface that altitudes count from, turning, with the gravity of the planet.
    #[must_use]
    pub fn surface(&self) -> Ellipsoid {
        Ellipsoid::sphere(self.body.radius, self.body.gravitational_parameter, self.rotation_rate, self.j2)
    }

    /// Passes an altitude (m) on that is at the surface or above.
    ///
    /// # Errors
    /// When it is below the surface or not finite.
    pub fn above_surface(&self, what: &'static str, altitude: f64) -> Result<f64, DynamicsError> {
        if altitude >= 0.0 && altitude.is_finite() {
            Ok(altitude)
        } else {
            Err(DynamicsError::Parameter {
                what,
                value: altitude,
                unit: "m",
                allowed: "a finite number not below the surface at 0 m",
            })
        }
    }

    /// Components of gravity, m/s2, at the distance `r` (m) and the sine and cosine of the geocentric latitude: towards the centre, and
    /// towards north if the planet is oblate.
    ///
    /// ```text
    /// g_r =  mu / r^2 (1 - 3/2 J2 (Re / r)^2 (3 sin^2(lat) - 1))
    /// g_n = -3 mu / r^2 J2 (Re / r)^2 sin(lat) cos(lat)
    /// ```
    ///
    /// the gradient of `mu / r (1 - J2 (Re / r)^2 (3 sin^2(lat) - 1) / 2)` (Vallado 2013, section 8.6).
    #[inline]
    pub fn gravity<S: Scalar>(&self, r: S, sin_latitude: S, cos_latitude: S) -> (S, Option<S>) {
        let central = r.powi(-2) * self.body.gravitational_parameter;
        if self.j2 == 0.0 {
            return (central, None);
        }
        let size = central * r.powi(-2) * (self.j2 * self.body.radius * self.body.radius);
        let radial = central + size * (-sin_latitude.square() * 3.0 + 1.0) * 1.5;
        (radial, Some(size * sin_latitude * cos_latitude * -3.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equinoctial::EARTH_J2;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-13;

    /// Gravitation of the surface's field against the components of the planet.
    #[test]
    fn the_surface_has_the_gravity_of_the_planet() {
        let planet = Planet::earth(Atmosphere::Vacuum).with_j2(EARTH_J2);
        let surface = planet.surface();
        for (longitude, latitude, altitude) in [(0.4, 0.7, 1.2e5), (-2.0, -1.1, 2e4), (1.0, 0.0, 0.0)] {
            let r = surface.position(longitude, latitude, altitude);
            let at = surface.geodetic(&r);
            assert!((at.altitude - altitude).abs() < 1e5 * ROUNDING, "{}", at.altitude);
            let found = surface.gravitation(&r);
            let (sin, cos) = f64::sin_cos(latitude);
            let (down, north) = planet.gravity(planet.body.radius + altitude, sin, cos);
            let along = |axis: &[f64; 3]| apsides_ad::vector::dot(&found, axis);
            assert!((along(&at.up) + down).abs() < ROUNDING, "{} {down}", along(&at.up));
            assert!((along(&at.north) - north.unwrap()).abs() < ROUNDING);
            assert!(along(&at.east).abs() < ROUNDING);
        }
        assert_eq!(surface.rotation_rate, EARTH_ROTATION_RATE);
    }
}
