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
    from: f64,
    to: f64,
}

/// A point of a transfer ellipse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferPoint {
    /// Time since departure, s.
    pub time: f64,
    /// Distance from the centre of the body, m.
    pub radius: f64,
    /// Polar angle travelled since departure, rad.
    pub angle: f64,
    /// Speed along the local horizontal, m/s.
    pub horizontal_speed: f64,
    /// Speed along the local vertical, positive up, m/s.
    pub radial_speed: f64,
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
            from,
            to,
        })
    }

    /// The point of the ellipse at an eccentric anomaly (rad) since departure, from 0 to pi: Kepler's equation (Vallado
    /// 2013, section 2.2), with a negative eccentricity where the departure is the higher end.
    #[must_use]
    pub fn point(&self, anomaly: f64) -> TransferPoint {
        let a = 0.5 * (self.from + self.to);
        let e = 1.0 - self.from / a;
        let (sin, cos) = anomaly.sin_cos();
        let radius = a * (1.0 - e * cos);
        let mean_motion = PI / self.duration;
        TransferPoint {
            time: (anomaly - e * sin) / mean_motion,
            radius,
            angle: f64::atan2((1.0 - e * e).sqrt() * sin, cos - e),
            horizontal_speed: self.departure_speed * self.from / radius,
            radial_speed: a * a * mean_motion * e * sin / radius,
        }
    }
}
