//! Quantities that follow from a state.

use crate::engine::STANDARD_GRAVITY;

/// The flow around a body, and what it feels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightCondition {
    /// Height above the ground, m.
    pub altitude: f64,
    /// Speed relative to the air, m/s.
    pub airspeed: f64,
    /// Mach number.
    pub mach: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure: f64,
    /// Angle of attack `atan2(w, u)`, rad.
    pub attack: f64,
    /// Sideslip `asin(v / V)`, rad.
    pub sideslip: f64,
    /// Angle between the axis and the air, rad.
    pub total_attack: f64,
    /// Force of the air by mass, in body axes, in units of standard gravity.
    pub loads: [f64; 3],
}

impl FlightCondition {
    /// The condition at a height (m), a velocity relative to the air (m/s), a density and a speed of sound, and an acceleration by the air
    /// (m/s2), in body axes. At rest all angles are zero.
    pub(super) fn new(altitude: f64, air: &[f64; 3], [density, sound]: [f64; 2], push: [f64; 3]) -> Self {
        let [u, v, w] = *air;
        let across = v.hypot(w);
        let airspeed = across.hypot(u);
        let sideslip = if airspeed > 0.0 { v.atan2(u.hypot(w)) } else { 0.0 };
        Self {
            altitude,
            airspeed,
            mach: airspeed / sound,
            dynamic_pressure: 0.5 * density * airspeed * airspeed,
            attack: w.atan2(u),
            sideslip,
            total_attack: across.atan2(u),
            loads: push.map(|a| a / STANDARD_GRAVITY),
        }
    }

    /// Size of the load, in units of standard gravity.
    #[must_use]
    pub fn load(&self) -> f64 {
        self.loads.iter().map(|l| l * l).sum::<f64>().sqrt()
    }

    /// Tells whether all numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let numbers = [self.altitude, self.airspeed, self.mach, self.dynamic_pressure];
        numbers.iter().chain(&self.loads).chain(&[self.attack, self.sideslip]).all(|n| n.is_finite())
    }
}
