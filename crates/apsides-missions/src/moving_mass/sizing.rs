//! Least masses and least speeds of actuators for an offset of the centre of mass.
//!
//! By statics masses `m` bring the centre of mass of a vehicle of mass `M` back to the axis up to
//!
//! ```text
//! cross: m L / M along each axis,      rim: 2 m R / M in any direction
//! ```
//!
//! with the travel `L` and the radius `R`. Simulation finds the same numbers as the limit of what descents hold: by bisection, one number of a
//! [`Case`] at a time.

use apsides_control::pid::PidGains;
use serde::Serialize;

use super::cases::CaseSet;
use super::{Allocation, Case, Law, Masses, RATE_LIMITED_GAINS, Record};
use apsides_pipeline::Error;

/// Settings of the bisections.
#[derive(Clone, Debug, PartialEq)]
pub struct Sizing {
    /// Largest root mean square of an angle that counts as held, rad. A saturated loop leaves about 2 deg times the part of the offset that it
    /// cannot balance.
    pub limit: f64,
    /// Relative width at which a bisection ends.
    pub tolerance: f64,
}

impl Default for Sizing {
    fn default() -> Self {
        Self { limit: 0.02_f64.to_radians(), tolerance: 2e-3 }
    }
}

/// The number between two, one held and one not, at which descents are no longer held: bisection by the geometric mean, `None` where both
/// ends are alike.
fn threshold(
    [held, lost]: [f64; 2],
    tolerance: f64,
    mut holds: impl FnMut(f64) -> Result<bool, Error>,
) -> Result<Option<f64>, Error> {
    let (mut good, mut bad) = (held, lost);
    if !holds(good)? || holds(bad)? {
        return Ok(None);
    }
    while (good / bad).ln().abs() > tolerance {
        let middle = (good * bad).sqrt();
        if holds(middle)? { good = middle } else { bad = middle }
    }
    Ok(Some(good))
}

impl Case {
    /// Mass of one of the moving masses, kg.
    #[must_use]
    pub fn moving_mass(&self) -> f64 {
        match self.masses {
            Masses::Cross { mass, .. } | Masses::Radial { mass, .. } => mass,
        }
    }

    /// The same with moving masses of another size, kg each.
    #[must_use]
    pub fn with_moving_mass(&self, kilograms: f64) -> Self {
        let mut case = self.clone();
        match &mut case.masses {
            Masses::Cross { mass, .. } | Masses::Radial { mass, .. } => *mass = kilograms,
        }
        case
    }

    /// The same with masses of the same size in the other layout of the reference: a cross with 0.70 m of travel, a rim of 0.75 m by inversion.
    #[must_use]
    pub fn with_other_layout(&self) -> Self {
        let other = match self.masses {
            Masses::Cross { mass, .. } => Self::radial(mass),
            Masses::Radial { mass, .. } => Self::cross(mass),
        };
        Self { masses: other.masses, ..self.clone() }
    }

    fn by_inversion(&self) -> Self {
        let mut case = self.clone();
        if let Masses::Radial { allocation, .. } = &mut case.masses {
            *allocation = Allocation::Inversion;
        }
        case
    }

    fn layout_name(&self) -> &'static str {
        match self.masses {
            Masses::Cross { .. } => "cross",
            Masses::Radial { .. } => "radial",
        }
    }

    /// The least mass, kg each, that balances an offset by statics: on a cross the larger component counts, on a rim the distance.
    #[must_use]
    pub fn static_moving_mass(&self, [y, z]: [f64; 2]) -> f64 {
        let reach = match self.masses {
            Masses::Cross { .. } => y.abs().max(z.abs()),
            Masses::Radial { .. } => y.hypot(z),
        };
        reach / self.with_moving_mass(1.0).authority()
    }
}

impl Sizing {
    /// The largest vehicle mass, kg, at which the descent of a case is held: the offset stays, the moving masses move the centre of mass of a
    /// heavier vehicle less. `None` where it is not between half and twice that of statics.
    ///
    /// # Errors
    /// Those of [`Descent::new`](super::Descent::new) for the case.
    pub fn largest_vehicle_mass(&self, case: &Case) -> Result<Option<f64>, Error> {
        let statics = case.vehicle.mass * case.moving_mass() / case.static_moving_mass(case.vehicle.offset);
        let mut record = Record::every(1);
        let alone = CaseSet { directions: 0, offset: 0.0, attacks: Vec::new(), damping: Vec::new() };
        threshold([0.5 * statics, 2.0 * statics], self.tolerance, |mass| {
            let mut case = case.clone();
            case.vehicle.mass = mass;
            alone.held(&case, self.limit, &mut record)
        })
    }

    /// The least moving mass, kg each, that holds a set of descents. `None` where it is not between half and twice that of statics for the
    /// offset along an axis.
    ///
    /// # Errors
    /// Those of [`Descent::new`](super::Descent::new) for the case.
    pub fn least_moving_mass(&self, case: &Case, set: &CaseSet) -> Result<Option<f64>, Error> {
        let mut case = case.clone();
        case.vehicle.offset = [set.offset, 0.0];
        let statics = case.static_moving_mass(case.vehicle.offset);
        let mut record = Record::every(1);
        threshold([2.0 * statics, 0.5 * statics], self.tolerance, |mass| {
            set.held(&case.with_moving_mass(mass), self.limit, &mut record)
        })
    }

    /// The least rate limit, m/s, down from which a set of descents is held: from `fastest`, which must hold, in steps of a factor, then by
    /// bisection. `None` where `fastest` does not hold; `slowest` where all do.
    ///
    /// # Errors
    /// Those of [`Descent::new`](super::Descent::new) for the case.
    pub fn least_rate(
        &self,
        case: &Case,
        set: &CaseSet,
        [slowest, fastest]: [f64; 2],
    ) -> Result<Option<f64>, Error> {
        const FACTOR: f64 = 1.25;
        let mut record = Record::every(1);
        let mut holds = |rate: f64| {
            let mut case = case.clone();
            case.actuators.rate = Some(rate);
            set.held(&case, self.limit, &mut record)
        };
        if !holds(fastest)? {
            return Ok(None);
        }
        let mut rate = fastest;
        while rate > slowest {
            let next = (rate / FACTOR).max(slowest);
            if !holds(next)? {
                return threshold([rate, next], self.tolerance, holds);
            }
            rate = next;
        }
        Ok(Some(slowest))
    }
}

/// Masses of a layout for an offset in the worst of eight directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MassRow {
    /// `cross` or `radial`.
    pub layout: &'static str,
    /// Offset of the centre of mass, m.
    pub offset_m: f64,
    /// Both masses together by statics, kg.
    pub static_kg: f64,
    /// Both masses together by simulation, kg; none where it is not between half and twice that.
    pub simulated_kg: Option<f64>,
}

/// Rates of a layout.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateRow {
    /// `cross` or `radial`.
    pub layout: &'static str,
    /// Both masses together: those of statics times the margin, kg.
    pub masses_kg: f64,
    /// Least rate limit with the law of the case, m/s.
    pub rate_m_s: Option<f64>,
    /// The least of those with the gains for limited rates, m/s, and its gains.
    pub tuned_rate_m_s: Option<f64>,
    /// Gains of that rate.
    pub tuned_gains: [f64; 3],
}

/// Cross against rim.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SizeStudy {
    /// Factor on the masses of statics with which rates are sought.
    pub margin: f64,
    /// Offset for which rates are sought, m.
    pub offset_m: f64,
    /// Largest vehicle mass that the masses of the case hold at its offset, kg: by statics and by simulation.
    pub initial_mass_kg: (f64, Option<f64>),
    /// Masses by offset.
    pub masses: Vec<MassRow>,
    /// Rates.
    pub rates: Vec<RateRow>,
}

/// Rate limits between which the least is sought, m/s.
const RATES: [f64; 2] = [0.005, 10.0];
/// Shift of the centre of mass by the travel of a mass in the cases that the gains for limited rates are for: 10 kg of 500 kg.
const TUNED_SHIFT: f64 = 10.0 / 500.0;

impl Sizing {
    /// Masses and rates of both layouts for a case, in eight directions of the offset; masses on a rim are placed by inversion.
    ///
    /// # Errors
    /// Those of [`Descent::new`](super::Descent::new) for the case.
    pub fn study(&self, case: &Case, offsets: &[f64], margin: f64) -> Result<SizeStudy, Error> {
        let set = CaseSet { attacks: vec![case.entry.attack], ..CaseSet::around(case) };
        let (mut masses, mut rates) = (Vec::new(), Vec::new());
        for case in [case.by_inversion(), case.with_other_layout()] {
            let layout = case.layout_name();
            for offset in offsets {
                let set = CaseSet { offset: *offset, ..set.clone() };
                masses.push(MassRow {
                    layout,
                    offset_m: *offset,
                    static_kg: 2.0 * case.static_moving_mass([*offset, 0.0]),
                    simulated_kg: self.least_moving_mass(&case, &set)?.map(|kg| 2.0 * kg),
                });
            }
            rates.push(self.rates(&case, &set, margin)?);
        }
        let statics = case.vehicle.mass * case.moving_mass() / case.static_moving_mass(case.vehicle.offset);
        let initial_mass_kg = (statics, self.largest_vehicle_mass(&case.by_inversion())?);
        Ok(SizeStudy { margin, offset_m: set.offset, initial_mass_kg, masses, rates })
    }

    fn rates(&self, case: &Case, set: &CaseSet, margin: f64) -> Result<RateRow, Error> {
        let mut case = case.with_moving_mass(margin * case.static_moving_mass([set.offset, 0.0]));
        case.vehicle.offset = [set.offset, 0.0];
        let rate_m_s = self.least_rate(&case, set, RATES)?;
        // The same shift of the centre of mass per angle.
        let by = TUNED_SHIFT * case.vehicle.mass / case.moving_mass();
        let (mut best, mut tuned_gains) = (None, [0.0; 3]);
        for (_, gains) in RATE_LIMITED_GAINS {
            let gains = gains.map(|k| k * by);
            let [p, i, d] = gains;
            case.law = Law::pid(PidGains::new(p, i, d));
            if let Some(rate) = self.least_rate(&case, set, RATES)?
                && best.is_none_or(|least| rate < least)
            {
                (best, tuned_gains) = (Some(rate), gains);
            }
        }
        Ok(RateRow {
            layout: case.layout_name(),
            masses_kg: 2.0 * case.moving_mass(),
            rate_m_s,
            tuned_rate_m_s: best,
            tuned_gains,
        })
    }
}
