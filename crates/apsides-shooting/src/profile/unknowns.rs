//! Numbers of a decision vector besides the profile: end time, start, parameters.

use apsides_ocp::{Bounds, Ocp};

use super::rules::{FlightRules, Independent};
use crate::error::ShootingError;

/// A number that is known, or stands in the decision vector.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Slot {
    Known(f64),
    Unknown { index: usize, bounds: Bounds },
}

impl Slot {
    /// Its value; numbers outside of the bounds count as the nearest inside.
    pub(crate) fn value(&self, decision: &[f64]) -> f64 {
        match *self {
            Self::Known(value) => value,
            // `f64::clamp` keeps a NaN, which then shows in the flight.
            Self::Unknown { index, bounds } => decision[index].clamp(bounds.lower, bounds.upper),
        }
    }
}

/// The decision vector of a flight.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
    /// Numbers of the profile, which come first.
    pub(crate) shape: usize,
    /// End of a flight without stop, or of the abscissa of a profile in time.
    pub(crate) horizon: Slot,
    pub(crate) initial_time: Slot,
    pub(crate) initial_state: Vec<Slot>,
    pub(crate) parameters: Vec<Slot>,
    /// Latest end of a flight.
    pub(crate) latest: f64,
    /// Longest flight.
    pub(crate) longest: f64,
}

impl Unknowns {
    pub(crate) fn new(ocp: &Ocp, rules: &FlightRules) -> Result<Self, ShootingError> {
        let [phase] = &ocp.phases[..] else {
            let reason = format!("has {} phases, a profile is flown through one", ocp.phases.len());
            return Err(ShootingError::Profile { place: format!("problem `{}`", ocp.name), reason });
        };
        rules.check(phase)?;
        let (mut lower, mut upper) = rules.shape.space()?;
        let shape = lower.len();
        let mut slot = |what: &dyn Fn() -> String, bounds: Bounds| {
            if bounds.is_fixed() {
                return Ok(Slot::Known(bounds.lower));
            }
            if !(bounds.lower.is_finite() && bounds.upper.is_finite()) {
                let reason = format!(
                    "is in [{}, {}], a decision variable needs finite bounds",
                    bounds.lower, bounds.upper
                );
                return Err(ShootingError::Profile { place: what(), reason });
            }
            lower.push(bounds.lower);
            upper.push(bounds.upper);
            Ok(Slot::Unknown { index: lower.len() - 1, bounds })
        };
        let (start, end) = phase.time_bounds();
        let place = |what: &str| format!("phase `{}`, {what}", phase.name);
        if !end.upper.is_finite() {
            let reason = "needs a finite upper bound, the latest end of a flight".into();
            return Err(ShootingError::Profile { place: place("final time"), reason });
        }
        let in_energy = matches!(rules.independent, Independent::Energy { .. });
        let horizon = if rules.stop.is_some() && in_energy {
            Slot::Known(end.upper)
        } else {
            slot(&|| place("final time"), end)?
        };
        let initial_time = slot(&|| place("initial time"), start)?;
        let states = phase.states.iter().map(|s| {
            let bounds = s.initial.intersect(&s.variable.bounds);
            slot(&|| place(&format!("start of state `{}`", s.variable.name)), bounds)
        });
        let initial_state = states.collect::<Result<_, _>>()?;
        let parameters = ocp.parameters.iter().map(|p| slot(&|| format!("parameter `{}`", p.name), p.bounds));
        let parameters = parameters.collect::<Result<_, _>>()?;
        let longest = (end.upper - start.lower).min(phase.duration.upper);
        Ok(Self {
            lower,
            upper,
            shape,
            horizon,
            initial_time,
            initial_state,
            parameters,
            latest: end.upper,
            longest,
        })
    }
}
