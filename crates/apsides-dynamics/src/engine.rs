//! Rocket engines of constant exhaust velocity, and the rocket equation.

use crate::DynamicsError;
use crate::error::positive;

/// Standard gravity, m/s2 (CGPM 1901): the unit of specific impulse.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// An engine of constant exhaust velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engine {
    /// Largest thrust, N.
    pub thrust: f64,
    /// Effective exhaust velocity, m/s.
    pub exhaust_velocity: f64,
}

impl Engine {
    /// An engine of given thrust (N) and specific impulse (s).
    ///
    /// # Errors
    /// When either is not positive and finite.
    pub fn new(thrust: f64, specific_impulse: f64) -> Result<Self, DynamicsError> {
        let isp = positive("specific impulse", specific_impulse, "s")?;
        Self::with_exhaust_velocity(thrust, isp * STANDARD_GRAVITY)
    }

    /// An engine of given thrust (N) and exhaust velocity (m/s).
    ///
    /// # Errors
    /// When either is not positive and finite.
    pub fn with_exhaust_velocity(thrust: f64, exhaust_velocity: f64) -> Result<Self, DynamicsError> {
        Ok(Self {
            thrust: positive("thrust", thrust, "N")?,
            exhaust_velocity: positive("exhaust velocity", exhaust_velocity, "m/s")?,
        })
    }

    /// Mass flow at full thrust, kg/s.
    #[must_use]
    pub fn mass_flow(&self) -> f64 {
        self.thrust / self.exhaust_velocity
    }

    /// Mass (kg) after a velocity change (m/s) from an initial mass (kg): the rocket equation
    /// `m = m0 exp(-dv / c)`.
    #[must_use]
    pub fn mass_after(&self, initial_mass: f64, velocity_change: f64) -> f64 {
        initial_mass * (-velocity_change / self.exhaust_velocity).exp()
    }

    /// Velocity change (m/s) that burns an initial mass down to a final mass (kg).
    #[must_use]
    pub fn velocity_change(&self, initial_mass: f64, final_mass: f64) -> f64 {
        self.exhaust_velocity * (initial_mass / final_mass).ln()
    }
}
