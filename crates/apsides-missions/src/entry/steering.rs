//! The forms in which the bank angle is a control.

/// The form in which the bank angle is a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steering {
    /// The control is the angle.
    Angle,
    /// The controls are its cosine and sine, with their norm as a constraint.
    Vector,
}

impl Steering {
    /// The controls of a bank angle, rad.
    pub(super) fn controls_of(self, bank: f64) -> Vec<f64> {
        match self {
            Self::Angle => vec![bank],
            Self::Vector => vec![bank.cos(), bank.sin()],
        }
    }

    /// The bank angle of controls, rad.
    pub(super) fn bank_of(self, controls: &[f64]) -> f64 {
        match (self, controls) {
            (Self::Vector, [cosine, sine]) => sine.atan2(*cosine),
            (_, controls) => controls.first().copied().unwrap_or(f64::NAN),
        }
    }
}
