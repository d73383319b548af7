//! Landings in the manner of Chang'e-3, from the perilune of an elliptic orbit, with an engine that cannot be shut down below its least
//! thrust (problem A of the Chinese undergraduate contest in mathematical modelling, 2014).

use super::{Deviating, Flown, Kind, Optimised};
use crate::Error;
use dispersed::PlannedBraking;
use lander::Lander;

mod braking;
mod decisions;
mod dispersed;
mod guess;
mod keys;
mod lander;
mod landing;
mod phases;
mod results;
mod site_checks;
mod terrain;

pub(super) const BRAKING: Kind = Kind {
    name: "chang-e-3-braking",
    title: "Main braking from the perilune of a lunar orbit to a gate above the site with least propellant",
    flight_keys: &[keys::VEHICLE, keys::MOON, keys::ORBIT, keys::SITE, keys::GATE],
    check: |v| Lander::of(v).map(|_| ()),
    flown: Flown::Optimised(BY_BRAKING),
};

const BY_BRAKING: Optimised = Optimised {
    nothing_at_zero: &[],
    pose: |v| Lander::of(v).map_err(Error::in_mission)?.braking(),
    approach: |_| Vec::new(),
    results: |v, t| Lander::of(v).map_or_else(|_| Default::default(), |l| results::braking(&l, t)),
    headline: &["final_mass_kg", "flight_time_s", "perilune_speed_m_s", "central_angle_deg"],
    curves: |v, t| Lander::of(v).map_or_else(|_| Vec::new(), |l| results::curves(&l, t)),
    checks: |_, _| Vec::new(),
    missing: |_, _| None,
    margins: super::no_margins,
    reach: None,
    decide: None,
    site_checks: |_, _, _| Vec::new(),
    deviating: Some(Deviating {
        columns: dispersed::COLUMNS,
        flights: |v, t| Ok(Box::new(PlannedBraking::new(v, t)?)),
    }),
    simulate: None,
};

pub(super) const LANDING: Kind = Kind {
    name: "chang-e-3",
    title: "Landing in six stages from the perilune of a lunar orbit to the cut-off of the engine with least propellant",
    flight_keys: &[
        keys::VEHICLE,
        keys::MOON,
        keys::ORBIT,
        keys::SITE,
        keys::GATE,
        keys::STAGES_BELOW,
        keys::TERRAIN,
        keys::DECIDED,
    ],
    check: |v| Lander::of_landing(v).map(|_| ()),
    flown: Flown::Optimised(Optimised {
        nothing_at_zero: &[keys::HOVER_TIME],
        pose: |v| Lander::of_landing(v).map_err(Error::in_mission)?.landing(),
        results: |v, t| {
            Lander::of_landing(v).map_or_else(|_| Default::default(), |l| results::landing(&l, t))
        },
        headline: &["final_mass_kg", "propellant_kg", "flight_time_s", "touchdown_speed_m_s"],
        decide: Some(decisions::decide),
        site_checks: site_checks::of,
        deviating: None,
        simulate: None,
        ..BY_BRAKING
    }),
};
