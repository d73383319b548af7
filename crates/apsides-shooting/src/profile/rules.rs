//! Rules of the flight of a profile: what it is a function of, how it becomes controls, where the flight stops, how it is integrated.

use std::fmt;
use std::sync::Arc;

use apsides_ocp::Phase;
use apsides_ode::{Direction, Method};

use super::shape::ProfileShape;
use crate::error::ShootingError;

/// A function of the state.
pub type StateFunction = Arc<dyn Fn(&[f64]) -> f64 + Send + Sync>;
/// From components of a profile to controls.
pub type ControlFunction = Arc<dyn Fn(&[f64], &mut [f64]) + Send + Sync>;

/// The independent variable of a profile: the abscissa `s`, from 0 at the start to 1.
#[derive(Clone)]
pub enum Independent {
    /// `s = (t - t_0) / (t_f - t_0)`.
    Time,
    /// `s = (E_0 - E) / (E_0 - E_f)` with the energy of the state, cut off at 0 and 1: one less the normalised energy, which falls
    /// from 1 to 0.
    Energy {
        /// `E` of a state, for instance `v^2 / 2 - mu / r`.
        energy: StateFunction,
        /// `E_f`, in its unit.
        end: f64,
    },
}

impl Independent {
    /// An energy of the state that ends at the value `end`.
    pub fn energy(end: f64, energy: impl Fn(&[f64]) -> f64 + Send + Sync + 'static) -> Self {
        Self::Energy { energy: Arc::new(energy), end }
    }
}

impl fmt::Debug for Independent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time => f.write_str("Time"),
            Self::Energy { end, .. } => f.debug_struct("Energy").field("end", end).finish_non_exhaustive(),
        }
    }
}

/// The map from components of a profile to controls.
#[derive(Clone)]
pub enum Steering {
    /// They are the controls.
    Controls,
    /// The only component is an angle `a`, the controls are `(cos a, sin a)`.
    CosSin,
    /// A function writes the controls.
    Map(ControlFunction),
}

impl Steering {
    /// A function that writes the controls for the components of a profile.
    pub fn map(function: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static) -> Self {
        Self::Map(Arc::new(function))
    }

    #[inline]
    pub(crate) fn apply(&self, components: &[f64], controls: &mut [f64]) {
        match self {
            Self::Controls => controls.copy_from_slice(components),
            Self::CosSin => (controls[1], controls[0]) = components[0].sin_cos(),
            Self::Map(function) => function(components, controls),
        }
    }
}

impl fmt::Debug for Steering {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Controls => "Controls",
            Self::CosSin => "CosSin",
            Self::Map(_) => "Map",
        })
    }
}

/// A state whose passage through a value ends the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Index of the state.
    pub state: usize,
    /// Its value, in the state's unit.
    pub value: f64,
    /// The passages that count.
    pub direction: Direction,
}

impl Stop {
    /// Where a state reaches the value that it must end at, coming from its start.
    ///
    /// # Errors
    /// [`ShootingError::Profile`] where the state is not known, its end is not fixed or its start is no other value.
    pub fn at_end(phase: &Phase, state: &str) -> Result<Self, ShootingError> {
        let fail = |reason: &str| {
            let place = format!("phase `{}`, stop at the end of `{state}`", phase.name);
            Err(ShootingError::Profile { place, reason: reason.into() })
        };
        let Some(index) = phase.state_index(state) else { return fail("no state has this name") };
        let s = &phase.states[index];
        if !s.terminal.is_fixed() {
            return fail("its end is not one value; state the stop itself");
        }
        let value = s.terminal.lower;
        let direction = if s.initial.lower > value {
            Direction::Falling
        } else if s.initial.upper < value {
            Direction::Rising
        } else {
            return fail("it may start where it ends; state the stop itself");
        };
        Ok(Self { state: index, value, direction })
    }
}

/// Settings of the integration.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightSettings {
    /// Runge-Kutta method; order 5, which suits this accuracy.
    pub method: Method,
    /// Error of a step relative to the state, and to its scale where that is larger; 1e-6.
    pub tolerance: f64,
    /// Longest step as a part of the longest flight; 0.05.
    pub longest_step: f64,
    /// Points of each step, its end included, at which path constraints and bounds are looked at; between them a parabola through
    /// three tells the largest value; 4.
    pub samples: usize,
    /// Most steps of a flight; 10000.
    pub most_steps: usize,
}

impl Default for FlightSettings {
    fn default() -> Self {
        Self { method: Method::Dopri5, tolerance: 1e-6, longest_step: 0.05, samples: 4, most_steps: 10_000 }
    }
}

impl FlightSettings {
    pub(crate) fn check(&self) -> Result<(), ShootingError> {
        let numbers =
            [("tolerance", self.tolerance, 0.1), ("longest_step", self.longest_step, f64::INFINITY)];
        for (name, value, most) in numbers {
            if !(value > 0.0 && value <= most) {
                return Err(ShootingError::Setting {
                    name,
                    value,
                    allowed: "a positive number, small for a tolerance",
                });
            }
        }
        for (name, value) in [("samples", self.samples), ("most_steps", self.most_steps)] {
            if value == 0 {
                return Err(ShootingError::Setting { name, value: 0.0, allowed: "at least 1" });
            }
        }
        Ok(())
    }
}

/// A profile and how it is flown.
#[derive(Clone, Debug)]
pub struct FlightRules {
    /// Shape of the profile.
    pub shape: ProfileShape,
    /// The independent variable.
    pub independent: Independent,
    /// The map from its components to controls.
    pub steering: Steering,
    /// The event that ends the flight before its time; without, it ends at the end time of the phase.
    pub stop: Option<Stop>,
    /// The settings of the integration.
    pub settings: FlightSettings,
}

impl FlightRules {
    /// Controls as a function of time up to the end time of the phase.
    #[must_use]
    pub fn new(shape: ProfileShape) -> Self {
        Self {
            shape,
            independent: Independent::Time,
            steering: Steering::Controls,
            stop: None,
            settings: FlightSettings::default(),
        }
    }

    /// The same as a function of something else.
    #[must_use]
    pub fn of(self, independent: Independent) -> Self {
        Self { independent, ..self }
    }

    /// With other controls than the components themselves.
    #[must_use]
    pub fn steered(self, steering: Steering) -> Self {
        Self { steering, ..self }
    }

    /// Up to a stop.
    #[must_use]
    pub fn until(self, stop: Stop) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Refuses what does not fit a phase.
    pub(crate) fn check(&self, phase: &Phase) -> Result<(), ShootingError> {
        self.shape.check()?;
        self.settings.check()?;
        let place = || format!("phase `{}`", phase.name);
        let sizes = match self.steering {
            Steering::Controls => Some((phase.controls.len(), self.shape.components())),
            Steering::CosSin if self.shape.components() != 1 => Some((1, self.shape.components())),
            Steering::CosSin => Some((2, phase.controls.len())),
            Steering::Map(_) => None,
        };
        if let Some((expected, found)) = sizes.filter(|(a, b)| a != b) {
            let what = "components of the profile for these controls";
            return Err(ShootingError::Dimension { place: place(), what, expected, found });
        }
        if matches!(self.steering, Steering::Controls) {
            for (c, b) in phase.controls.iter().zip(&self.shape.bounds) {
                if b.lower < c.bounds.lower || b.upper > c.bounds.upper {
                    return Err(ShootingError::Profile {
                        place: format!("{}, control `{}`", place(), c.name),
                        reason: format!(
                            "values within [{}, {}] leave its bounds [{}, {}] {}",
                            b.lower, b.upper, c.bounds.lower, c.bounds.upper, c.unit
                        ),
                    });
                }
            }
        }
        if let Some(stop) = self.stop.filter(|s| s.state >= phase.states.len() || !s.value.is_finite()) {
            let reason = format!("state {} has no value {}", stop.state, stop.value);
            return Err(ShootingError::Profile { place: format!("{}, stop", place()), reason });
        }
        match self.independent {
            Independent::Energy { end, .. } if !end.is_finite() => {
                let reason = format!("the energy at the end, {end}, must be finite");
                Err(ShootingError::Profile { place: place(), reason })
            }
            _ => Ok(()),
        }
    }
}
