//! Impulsive transfers between circular orbits.

use std::f64::consts::PI;

use crate::error::positive;
use crate::{Body, DynamicsError};

/// The Hohmann transfer between two coplanar circular orbits (Vallado 2013, section 6.3.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hohmann {
    /// Speed on the transfer ellipse at the first orbit, m/s.
    pub departure_speed: f64,
    /// Speed on the transfer ellipse at the second orbit, m/s.
    pub arrival_speed: f64,
    /// Size of the impulse that leaves the first orbit, m/s.
    pub departure_impulse: f64,
    /// Size of the impulse that would enter the second orbit, m/s.
    pub arrival_impulse: f64,
    /// Half the period of the transfer ellipse, s.
    pub duration: f64,
}

impl Hohmann {
    /// The transfer between the radii `from` and `to` (m, from the centre of the body).
    ///
    /// # Errors
    /// When a radius is not positive and finite.
    pub fn new(body: &Body, from: f64, to: f64) -> Result<Self, DynamicsError> {
        let from = positive("radius of the first orbit", from, "m")?;
        let to = positive("radius of the second orbit", to, "m")?;
        let mu = body.gravitational_parameter;
        let a = 0.5 * (from + to);
        let departure_speed = body.orbital_speed(from, a);
        let arrival_speed = body.orbital_speed(to, a);
        Ok(Self {
            departure_speed,
            arrival_speed,
            departure_impulse: (departure_speed - (mu / from).sqrt()).abs(),
            arrival_impulse: (arrival_speed - (mu / to).sqrt()).abs(),
            duration: PI * (a * a * a / mu).sqrt(),
        })
    }
}
