//! Central bodies with an inverse-square field.

use crate::DynamicsError;
use crate::error::positive;

/// A spherical body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Gravitational parameter, m3/s2.
    pub gravitational_parameter: f64,
    /// Mean radius, m; of the Earth the equatorial one, which goes with its oblateness.
    pub radius: f64,
}

impl Body {
    /// The Moon: GRAIL's gravitational parameter (GRGM1200A, 4902.8001 km3/s2) and the mean radius 1737.4 km (IAU 2015).
    pub const MOON: Self = Self { gravitational_parameter: 4.902_800_1e12, radius: 1.7374e6 };

    /// The Earth: WGS 84's gravitational parameter 398600.4418 km3/s2 and equatorial radius 6378.137 km (NGA.STND.0036, 2014).
    pub const EARTH: Self = Self { gravitational_parameter: 3.986_004_418e14, radius: 6_378_137.0 };

    /// Mars: the gravitational parameter 42828.3752 km3/s2 (MRO120D, doi 10.1016/j.icarus.2016.02.052) and the equatorial radius
    /// 3396.19 km (IAU 2015).
    pub const MARS: Self = Self { gravitational_parameter: 4.282_837_52e13, radius: 3.396_19e6 };

    /// A body of given gravitational parameter (m3/s2) and radius (m).
    ///
    /// # Errors
    /// When either is not positive and finite.
    pub fn new(gravitational_parameter: f64, radius: f64) -> Result<Self, DynamicsError> {
        Ok(Self {
            gravitational_parameter: positive("gravitational parameter", gravitational_parameter, "m3/s2")?,
            radius: positive("radius of the body", radius, "m")?,
        })
    }

    /// Acceleration of gravity at the surface, m/s2.
    #[must_use]
    pub fn surface_gravity(&self) -> f64 {
        self.gravitational_parameter / (self.radius * self.radius)
    }

    /// Speed on a circular orbit at an altitude (m), m/s.
    ///
    /// # Errors
    /// When the altitude is not above the centre of the body.
    pub fn circular_speed(&self, altitude: f64) -> Result<f64, DynamicsError> {
        let r = positive("distance from the centre of the body", self.radius + altitude, "m")?;
        Ok((self.gravitational_parameter / r).sqrt())
    }

    /// Speed (m/s) at distance `r` (m) from the centre on an orbit of semi-major axis `a` (m): the vis-viva equation
    /// `v^2 = mu (2 / r - 1 / a)`.
    #[must_use]
    pub fn orbital_speed(&self, r: f64, a: f64) -> f64 {
        (self.gravitational_parameter * (2.0 / r - 1.0 / a)).sqrt()
    }
}
