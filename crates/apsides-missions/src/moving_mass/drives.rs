//! The actuators that move the masses of both layouts.

use apsides_control::actuator::{Actuator, ActuatorSettings, RimPair};
use apsides_control::controller::Actuation;

use super::case::{ActuatorLimits, Masses};
use apsides_pipeline::Error;

/// Actuators of both layouts.
pub(super) enum Drives {
    Apart([Actuator; 2]),
    OnRim(RimPair),
}

impl Actuation<2> for Drives {
    fn advance(&mut self, command: &[f64; 2]) -> [f64; 2] {
        match self {
            Self::Apart(drives) => drives.advance(command),
            Self::OnRim(pair) => Actuation::advance(pair, command),
        }
    }

    fn saturated(&self) -> bool {
        match self {
            Self::Apart(drives) => drives.saturated(),
            Self::OnRim(pair) => Actuation::saturated(pair),
        }
    }

    fn met(&self) -> bool {
        match self {
            Self::Apart(_) => false,
            Self::OnRim(pair) => Actuation::met(pair),
        }
    }
}

impl Drives {
    /// Positions of the masses.
    pub(super) fn positions(&self) -> [f64; 2] {
        let drives = match self {
            Self::Apart(drives) => drives,
            Self::OnRim(pair) => pair.actuators(),
        };
        [drives[0].position(), drives[1].position()]
    }

    /// Actuators in their neutral positions.
    ///
    /// # Errors
    /// The limit that the actuators refuse, with its number.
    pub(super) fn new(masses: &Masses, limits: &ActuatorLimits, sample_time: f64) -> Result<Self, Error> {
        let actuator = |travel: [f64; 2], by: f64, start: f64| {
            let settings = ActuatorSettings {
                travel,
                rate: limits.rate.map_or(f64::INFINITY, |rate| rate / by),
                acceleration: limits.acceleration.map_or(f64::INFINITY, |acceleration| acceleration / by),
                delay: limits.delay,
                backlash: limits.backlash / by,
                start,
            };
            Actuator::new(settings, sample_time)
        };
        Ok(match *masses {
            Masses::Cross { travel, .. } => {
                let start = 0_f64.clamp(travel[0], travel[1]);
                let drive = actuator(travel, 1.0, start)?;
                Self::Apart([drive.clone(), drive])
            }
            Masses::Radial { radius, neutral, least_separation, .. } => {
                let free = [f64::NEG_INFINITY, f64::INFINITY];
                let drives = [actuator(free, radius, neutral[0])?, actuator(free, radius, neutral[1])?];
                if least_separation > 0.0 {
                    Self::OnRim(RimPair::new(drives, least_separation)?)
                } else {
                    Self::Apart(drives)
                }
            }
        })
    }
}
