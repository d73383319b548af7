//! Re-entry of a capsule to a target with least heat load under limits on dynamic pressure, acceleration and heat rate, steered by the
//! bank angle, from that of A. Alami Naeini and J. Roshanian (Modares Mechanical Engineering 14(13), 2014) on.

use std::sync::Arc;

use super::{Expansion, Flown, Kind, Optimised, Posed};
use crate::key::Values;
use crate::{Error, method};
use capsule::{Capsule, Goal};
use problem::Steering;

mod atmosphere_table;
mod capsule;
mod expansion;
mod guess;
mod keys;
mod margins;
mod problem;
mod reach;
mod results;
mod search;
pub(crate) mod steered;

pub(super) const REENTRY: Kind = Kind {
    name: "capsule-reentry",
    title: "Re-entry of a capsule to a target with least heat load under limits on its loads",
    flight_keys: &[
        keys::PLANET,
        keys::VEHICLE,
        keys::FLIGHT,
        keys::LIMITS,
        keys::GOALS,
        keys::CONTROL,
        keys::STEERED,
    ],
    check: |v| Capsule::of(v).map(|_| ()),
    flown: Flown::Optimised(Optimised {
        nothing_at_zero: &[],
        pose,
        approach,
        results: |v, t| Capsule::of(v).map_or_else(|_| Default::default(), |c| results::results(&c, t)),
        headline: &[
            "heat_load_mj_m2",
            "flight_time_s",
            "peak_dynamic_pressure_kpa",
            "peak_load_m_s2",
            "peak_heat_rate_kw_m2",
        ],
        curves: |v, t| Capsule::of(v).map_or_else(|_| Vec::new(), |c| results::curves(&c, t)),
        checks: |_, _| Vec::new(),
        missing: margins::missing,
        margins: margins::margins,
        reach: Some(reach::REACH),
        decide: None,
        site_checks: |_, _, _| Vec::new(),
        deviating: None,
        simulate: Some(steered::simulate),
    }),
};

/// Indirect shooting, whose control is the bank angle itself, begins from the collocation of the bank vector.
fn approach(v: &Values) -> Vec<Values> {
    if v.word(method::KEY) == method::INDIRECT && v.word(keys::STEERING) == keys::BANK_VECTOR {
        vec![v.with_word(method::KEY, method::RADAU)]
    } else {
        Vec::new()
    }
}

fn pose(v: &Values) -> Result<Posed, Error> {
    let capsule = Capsule::of(v).map_err(Error::in_mission)?;
    // The Hamiltonian of indirect shooting has the angle as its control.
    let steering = if v.word(method::KEY) == method::INDIRECT { Steering::Angle } else { capsule.steering };
    let ocp = capsule.problem(steering)?;
    let guess = capsule.straight_lines(&ocp, steering)?;
    let search = capsule.profiles();
    let posed = Posed { search, ..Posed::new(ocp, guess) };
    if steering == Steering::Angle || capsule.goal == Goal::LeastLift {
        return Ok(posed);
    }
    let whole = capsule.problem(Steering::Angle)?;
    let expansion = Some(Expansion { ocp: whole, expand: Arc::new(expansion::expand) });
    Ok(Posed { expansion, ..posed })
}
