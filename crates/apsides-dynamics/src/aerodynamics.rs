//! Aerodynamic coefficients of vehicles, and the vehicles of atmospheric entry.
//!
//! The angle of attack is that between the axis of the body and the air, positive with the axis above the velocity.

use apsides_ad::Scalar;

use crate::error::{finite, positive};
use crate::{DynamicsError, Quantity};

mod apollo;
pub mod axisymmetric;
pub mod mach_alpha;
mod newtonian;
mod table;

pub use axisymmetric::{AirLoads, AxisymmetricAerodynamics, Damping, MachLaw};
pub use mach_alpha::{AxisymmetricCoefficients, Interpolation, MachAlphaTable, RangeLeft};
pub use newtonian::{Newtonian, stagnation_pressure_coefficient};
pub use table::{AttackTable, MachTable};

/// Angle of attack.
pub const ATTACK: Quantity = Quantity::new("angle of attack", "rad");

/// Coefficients of lift and drag as functions of Mach number and angle of attack.
#[derive(Clone, Debug, PartialEq)]
pub enum Aerodynamics {
    /// The same at every Mach number and angle of attack.
    Constant {
        /// Coefficient of lift.
        lift: f64,
        /// Coefficient of drag.
        drag: f64,
    },
    /// A table over the Mach number.
    Mach(MachTable),
    /// A table over Mach number and angle of attack.
    Attack(AttackTable),
    /// The impact of the air on a sphere-cone or a spherical segment.
    Newtonian(Newtonian),
}

impl Aerodynamics {
    /// Coefficients of lift and drag that do not change.
    ///
    /// # Errors
    /// When the lift is not finite or the drag not positive and finite.
    pub fn constant(lift: f64, drag: f64) -> Result<Self, DynamicsError> {
        let lift = finite("coefficient of lift", lift, "-")?;
        Ok(Self::Constant { lift, drag: positive("coefficient of drag", drag, "-")? })
    }

    /// Coefficients of lift and drag at a Mach number and an angle of attack (rad).
    #[inline]
    pub fn coefficients<S: Scalar>(&self, mach: S, attack: S) -> [S; 2] {
        match self {
            Self::Constant { lift, drag } => [S::from(*lift), S::from(*drag)],
            Self::Mach(table) => table.coefficients(mach),
            Self::Attack(table) => table.coefficients(mach, attack),
            Self::Newtonian(shape) => shape.coefficients(mach, attack),
        }
    }

    /// Tells whether the Mach number matters.
    #[must_use]
    pub fn depends_on_mach(&self) -> bool {
        !matches!(self, Self::Constant { .. })
    }
}

/// A vehicle without thrust.
#[derive(Clone, Debug, PartialEq)]
pub struct EntryVehicle {
    /// Mass, kg.
    pub mass: f64,
    /// Area that the coefficients refer to, m2.
    pub reference_area: f64,
    /// Radius of the nose, m.
    pub nose_radius: f64,
    /// Coefficients of lift and drag.
    pub aerodynamics: Aerodynamics,
    /// Angle of attack (rad) where it is no control.
    pub attack: f64,
}

impl EntryVehicle {
    /// A vehicle of a mass (kg), a reference area (m2) and a nose radius (m), at angle of attack zero.
    ///
    /// # Errors
    /// When a number is not positive and finite.
    pub fn new(
        mass: f64,
        reference_area: f64,
        nose_radius: f64,
        aerodynamics: Aerodynamics,
    ) -> Result<Self, DynamicsError> {
        Ok(Self {
            mass: positive("mass of the vehicle", mass, "kg")?,
            reference_area: positive("reference area", reference_area, "m2")?,
            nose_radius: positive("nose radius", nose_radius, "m")?,
            aerodynamics,
            attack: 0.0,
        })
    }

    /// The same vehicle at another angle of attack (rad).
    ///
    /// # Errors
    /// When the angle is not finite.
    pub fn at_attack(self, attack: f64) -> Result<Self, DynamicsError> {
        Ok(Self { attack: finite("angle of attack", attack, "rad")?, ..self })
    }

    /// Lift by drag at a Mach number.
    #[must_use]
    pub fn lift_to_drag(&self, mach: f64) -> f64 {
        let [lift, drag] = self.aerodynamics.coefficients(mach, self.attack);
        lift / drag
    }

    /// Mass by the area of drag at a Mach number, kg/m2.
    #[must_use]
    pub fn ballistic_coefficient(&self, mach: f64) -> f64 {
        let [_, drag] = self.aerodynamics.coefficients(mach, self.attack);
        self.mass / (drag * self.reference_area)
    }
}

#[cfg(test)]
mod tests;
