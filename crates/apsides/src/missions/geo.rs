//! Injection of a restartable upper stage from a circular parking orbit into geostationary orbit with one to eight burns, from that of
//! Alavipour, Nikkhah and Roshanian (Modares Mechanical Engineering 18(1)) on.
//!
//! All ignitions, burn times, thrust directions and coasts are free; the final mass is largest. Without oblateness the burns alone are
//! solved, since a coast changes nothing but the true longitude, and the whole flight follows from them.

use std::sync::Arc;

use apsides_ocp::Trajectory;
use apsides_radau::{Explanation, RequirementKind};

use super::{Expansion, Kind, Posed};
use crate::Error;
use crate::key::Values;
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

pub(super) const INJECTION: Kind = Kind {
    name: "geo-injection",
    title: "Injection from a circular parking orbit into geostationary orbit with several burns and least propellant",
    flight_keys: &[keys::VEHICLE, keys::FLIGHT],
    check: |v| Injection::of(v).map(|_| ()),
    pose,
    results: |v, t| Injection::of(v).map_or_else(|_| Default::default(), |i| results::results(&i, t)),
    headline: &["propellant_kg", "burn_time_s", "flight_time_h", "losses_m_s"],
    curves: |v, t| Injection::of(v).map_or_else(|_| Vec::new(), |i| results::curves(&i, t)),
    checks: |v, t| Injection::of(v).map_or_else(|_| Vec::new(), |i| checks::checks(&i, t)),
    missing,
};

fn pose(v: &Values) -> Result<Posed, Error> {
    let injection = Injection::of(v).map_err(|reason| Error::Conflict { place: "mission".into(), reason })?;
    let start = Start::of(&injection);
    if injection.has_coast_phases() {
        let ocp = injection.whole()?;
        let guess = start.whole(&ocp)?;
        return Ok(Posed::new(ocp, guess));
    }
    let (ocp, whole) = (injection.reduced()?, injection.whole()?);
    let guess = start.reduced(&ocp)?;
    let costates = Some(start.costates());
    let reduced = ocp.clone();
    let expand = move |whole: &apsides_ocp::Ocp, solution: &Trajectory| {
        expansion::expand(&injection, &reduced, whole, solution)
    };
    let expansion = Some(Expansion { ocp: whole, expand: Arc::new(expand) });
    Ok(Posed { costates, expansion, ..Posed::new(ocp, guess) })
}

/// Propellant that no flight with these burns does without, in kg and m/s.
fn missing(v: &Values, explanation: &Explanation) -> Option<String> {
    let injection = Injection::of(v).ok()?;
    let mass = injection.dry_mass();
    let remedy = explanation.remedies.iter().find(|r| {
        r.requirement.name == apsides_dynamics::equinoctial::MASS.name
            && matches!(r.requirement.kind, RequirementKind::State | RequirementKind::FinalState)
            && r.to < mass
    })?;
    let short = injection.engine().velocity_change(mass, remedy.to);
    Some(format!("{:.1} kg of propellant are missing, {short:.1} m/s", mass - remedy.to))
}
