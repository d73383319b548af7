//! The laws that may command the masses, and their numbers.

use apsides_control::nonlinear_pid::NonlinearGains;
use apsides_control::pid::PidGains;

use super::keys;

/// The law that commands the masses. Pairs are of the angle of attack and of the sideslip.
///
/// An output is a distance, m, of a mass of a cross; by inversion on a rim it is the distance that a mass of the same size would have on a
/// cross. On angles it is an angle, rad.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// No law: the masses stay neutral.
    None,
    /// PID laws.
    Pid {
        /// Gains.
        gains: [PidGains; 2],
        /// Time constant of the filter of the derivative, s.
        filter_time: f64,
    },
    /// PID laws with nonlinear gains.
    NonlinearPid {
        /// Coefficients.
        gains: [NonlinearGains; 2],
        /// Time constant of the filter of the derivative, s.
        filter_time: f64,
    },
    /// A linear-quadratic regulator with integral action, its gains scheduled by dynamic pressure.
    Regulator(RegulatorSizes),
    /// Sliding mode with a boundary layer, its gain by dynamic pressure and Mach number.
    Sliding(SlidingSizes),
}

impl Law {
    /// The same PID gains for both angles, derivative without filter.
    #[must_use]
    pub fn pid(gains: PidGains) -> Self {
        Self::Pid { gains: [gains; 2], filter_time: 0.0 }
    }

    /// The word of the law in mission files.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::None => keys::NONE,
            Self::Pid { .. } => keys::PID,
            Self::NonlinearPid { .. } => keys::NONLINEAR_PID,
            Self::Regulator(_) => keys::LQR,
            Self::Sliding(_) => keys::SLIDING,
        }
    }
}

/// Sizes that cost one each, squared: of the states and of the command of a regulator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegulatorSizes {
    /// Angle, rad.
    pub angle: f64,
    /// Rate, rad/s.
    pub rate: f64,
    /// Integral of the angle, rad s.
    pub integral: f64,
    /// Distance of a mass, m.
    pub travel: f64,
}

/// Settings of a sliding-mode law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlidingSizes {
    /// Bandwidth of the surface, 1/s.
    pub bandwidth: f64,
    /// Gain of the integral that is added to the angle, 1/s.
    pub integral: f64,
    /// Rate at which the surface is reached, rad/s2.
    pub reaching: f64,
    /// Offset of the centre of mass that the law must stand, m.
    pub offset: f64,
    /// Largest factor between true and assumed effectiveness, at least 1.
    pub factor: f64,
    /// Half the boundary layer, rad/s.
    pub boundary: f64,
}
