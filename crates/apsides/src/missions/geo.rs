//! Injection of a restartable upper stage from a circular parking orbit into geostationary orbit with one to eight burns, from that of
//! Alavipour, Nikkhah and Roshanian (Modares Mechanical Engineering 18(1)) on.
//!
//! All ignitions, burn times, thrust directions and coasts are free; the final mass is largest. Without oblateness the burns alone are
//! solved, since a coast changes nothing but the true longitude, and the whole flight follows from them.

use std::sync::Arc;

use apsides_dynamics::equinoctial::MASS;
use apsides_ocp::Trajectory;
use apsides_radau::{Explanation, Requirement, RequirementKind};

use super::{Expansion, Flown, Kind, Optimised, Posed};
use crate::key::Values;
use crate::{Error, Mission};
use guess::Start;
use injection::Injection;

mod checks;
mod coast;
mod expansion;
mod guess;
mod impulsive;
mod injection;
mod keys;
mod phases;
mod results;
mod thrust;

pub(super) const INJECTION: Kind = Kind {
    name: "geo-injection",
    title: "Injection from a circular parking orbit into geostationary orbit with several burns and least propellant",
    flight_keys: &[keys::VEHICLE, keys::FLIGHT],
    check: |v| Injection::of(v).map(|_| ()),
    flown: Flown::Optimised(Optimised {
        nothing_at_zero: &["inclination_deg", "target_eccentricity"],
        pose,
        approach,
        results: |v, t| Injection::of(v).map_or_else(|_| Default::default(), |i| results::results(&i, t)),
        headline: &["propellant_kg", "burn_time_s", "flight_time_h", "losses_m_s"],
        curves: |v, t| Injection::of(v).map_or_else(|_| Vec::new(), |i| results::curves(&i, t)),
        checks: |v, t| Injection::of(v).map_or_else(|_| Vec::new(), |i| checks::checks(&i, t)),
        missing,
        margins: super::no_margins,
        reach: None,
        decide: None,
        site_checks: |_, _, _| Vec::new(),
        deviating: None,
        simulate: None,
    }),
};

fn pose(v: &Values) -> Result<Posed, Error> {
    let injection = Injection::of(v).map_err(Error::in_mission)?;
    let (start, models) = (Start::of(&injection), injection.models());
    if injection.has_coast_phases() {
        let ocp = injection.whole(&models)?;
        let guess = start.whole(&ocp)?;
        return Ok(Posed::new(ocp, guess));
    }
    let (ocp, whole) = (injection.reduced(&models)?, injection.whole(&models)?);
    let guess = start.reduced(&ocp)?;
    let costates = Some(start.costates());
    let reduced = ocp.clone();
    let expand = move |whole: &apsides_ocp::Ocp, solution: &Trajectory| {
        expansion::expand(&injection, &reduced, whole, solution)
    };
    let expansion = Some(Expansion { ocp: whole, expand: Arc::new(expand) });
    Ok(Posed { costates, expansion, ..Posed::new(ocp, guess) })
}

/// Part by which a limit on the flight time is lowered at once: shorter flights have local optima beside the one that follows from
/// longer ones.
const LIMIT_STEP: f64 = 0.04;
/// First limit, relative to the time of the guess: it does not limit.
const FIRST_LIMIT: f64 = 1.2;

/// A limited flight time comes from longer ones.
fn approach(v: &Values) -> Vec<Values> {
    let limit = v.number(keys::MAX_FLIGHT_TIME);
    let Ok(injection) = Injection::of(v) else { return Vec::new() };
    if limit.is_infinite() || injection.burns() == 1 {
        return Vec::new();
    }
    let mut cases = Vec::new();
    let mut longer = FIRST_LIMIT * Start::of(&injection).flight_time() / 3600.0;
    while longer > limit {
        cases.push(v.with_number(keys::MAX_FLIGHT_TIME, longer));
        longer *= 1.0 - LIMIT_STEP;
    }
    cases
}

/// Propellant that no flight with these burns does without, in kg and m/s.
fn missing(mission: &Mission, explanation: &Explanation) -> Option<String> {
    let injection = Injection::of(&mission.values).ok()?;
    let dry = injection.dry_mass();
    let is_mass = |r: &&Requirement| {
        r.name == MASS.name && matches!(r.kind, RequirementKind::State | RequirementKind::FinalState)
    };
    let alone = explanation.remedies.iter().find(|r| is_mass(&&r.requirement)).map(|r| r.to);
    let together = || {
        let conflict = explanation.conflicts.iter().find(|c| is_mass(&&c.requirement))?;
        Some(conflict.requirement.relaxed(conflict.amount))
    };
    let left = alone.or_else(together).filter(|left| (0.0..dry).contains(left))?;
    let short = injection.engine().velocity_change(dry, left);
    Some(format!("{:.1} kg of propellant are missing, {short:.1} m/s", dry - left))
}
