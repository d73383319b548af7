//! Landings in the manner of Chang'e-3, from the perilune of an elliptic orbit, with an engine that cannot be shut down below its least
//! thrust (problem A of the Chinese undergraduate contest in mathematical modelling, 2014).

use super::{Kind, Posed};
use crate::Error;
use crate::key::Values;
use lander::{Lander, Motion};

mod braking;
mod keys;
mod lander;
mod results;

pub(super) const BRAKING: Kind = Kind {
    name: "chang-e-3-braking",
    title: "Main braking from the perilune of a lunar orbit to a gate above the site with least propellant",
    flight_keys: &[keys::VEHICLE, keys::MOON, keys::ORBIT, keys::SITE, keys::GATE],
    nothing_at_zero: &[],
    check: |v| Lander::of(v).map(|_| ()),
    pose: braking,
    approach: |_| Vec::new(),
    results: |v, t| Lander::of(v).map_or_else(|_| Default::default(), |l| results::braking(&l, t)),
    headline: &["final_mass_kg", "flight_time_s", "perilune_speed_m_s", "central_angle_deg"],
    curves: |v, t| Lander::of(v).map_or_else(|_| Vec::new(), |l| results::curves(&l, t)),
    checks: |_, _| Vec::new(),
    missing: |_, _| None,
    margins: super::no_margins,
    reach: None,
};

fn braking(v: &Values) -> Result<Posed, Error> {
    let lander = Lander::of(v).map_err(|reason| Error::Conflict { place: "mission".into(), reason })?;
    match lander.motion {
        Motion::Plane => lander.planar_braking(),
        Motion::Space => lander.spatial_braking(),
    }
}
