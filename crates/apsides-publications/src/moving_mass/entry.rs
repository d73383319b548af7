//! Beyond the paper: what an offset of the centre of mass does to a re-entry from orbit, and masses that point the lift along its optimal
//! bank angle.

use std::f64::consts::TAU;

use apsides_dynamics::entry::EntryState;
use apsides_dynamics::great_circle::along_and_across;

use super::sheets::{DIRECTIONS, fly_all};
use crate::change::flag;
use crate::sheet::Sheet;
use crate::stop::{Stop, solved};
use crate::{Error, Observer};
use apsides_missions::entry::CapsuleEntry;
use apsides_missions::moving_mass::{BankProfile, SteeredEntry, SteeredFlight};

/// The mission whose flight is followed.
const MISSION: &str = "capsule-reentry-steered";
/// Offset that is not part of the plan, m.
const OFFSET: f64 = 0.01;

/// No offset, then [`OFFSET`] in all directions from y towards z.
fn offsets() -> Vec<(String, [f64; 2])> {
    let towards = |k: usize| {
        let angle = TAU * k as f64 / DIRECTIONS as f64;
        (format!("1 cm at {:.0} deg", angle.to_degrees()), [OFFSET * angle.cos(), OFFSET * angle.sin()])
    };
    std::iter::once(("no offset".to_owned(), [0.0; 2])).chain((0..DIRECTIONS).map(towards)).collect()
}

/// Flights with all offsets, in their order.
fn fly(
    entry: &SteeredEntry,
    profile: Option<&BankProfile>,
    threads: usize,
) -> Result<Vec<SteeredFlight>, Error> {
    let cases: Vec<SteeredEntry> = offsets()
        .into_iter()
        .map(|(_, offset)| SteeredEntry { unknown_offset: offset, ..entry.clone() })
        .collect();
    fly_all(&cases, threads, |case, record| case.ready(profile)?.fly(record))
}

pub(super) fn sheet(threads: usize, observer: &mut dyn Observer) -> Result<Sheet, Stop> {
    let (mission, outcome) = solved(MISSION, &[flag("margins", false)], threads, None, observer)?;
    let no_capsule = || Error::in_mission("the mission is no re-entry");
    let capsule = mission.mission_as::<CapsuleEntry>().ok_or_else(no_capsule)?;
    let entry = capsule.steered_entry()?;
    let (_, planned) = outcome.solved();
    let profile = capsule.bank_profile(planned)?;
    let mut sheet = Sheet::new(
        "re-entry",
        "Beyond the paper: a re-entry from orbit with an offset that the law does not know, six degrees of freedom",
        "capsule, offset from y towards z",
        &[
            ("downrange_error_km", 3),
            ("crossrange_error_km", 3),
            ("bank_error_rms_deg", 3),
            ("heat_load_mj_m2", 3),
            ("largest_attack_deg", 2),
        ],
    );
    let radius_km = entry.flight.planet.body.radius / 1e3;
    // Of a capsule without lift: against its own flight without an offset.
    let plain = SteeredEntry { trim_offset: 0.0, ..entry.clone() };
    let ballistic = fly(&plain, None, threads)?;
    let course = entry.flight.heading.of_course(entry.start.azimuth);
    let no_end = || Error::in_mission("the planned flight has no end");
    let end = planned.phases.first().and_then(|p| <[f64; 6]>::try_from(p.final_state()).ok());
    let end = EntryState::from(end.ok_or_else(no_end)?);
    let planned_course = entry.flight.heading.of_course(end.azimuth);
    let guided = fly(&entry, Some(&profile), threads)?;
    // The farthest end from a place, km, of those with an offset.
    let mut rows = |what: &str, flights: &[SteeredFlight], from: [f64; 2], course: f64, steered: bool| {
        let ends: Vec<[f64; 2]> = flights
            .iter()
            .map(|f| along_and_across(from, f.place, course).map(|angle| angle * radius_km))
            .collect();
        for (((label, _), flight), [along, across]) in offsets().iter().zip(flights).zip(&ends) {
            let values = [
                Some(*along),
                Some(*across),
                steered.then(|| flight.bank_error[0].to_degrees()),
                Some(flight.heat_load / 1e6),
                Some(flight.largest_attack.to_degrees()),
            ];
            sheet.push(format!("{what}, {label}"), values.into());
        }
        ends.iter().map(|[along, across]| along.hypot(*across)).collect::<Vec<_>>()
    };
    let unguided = rows("without lift", &ballistic, ballistic[0].place, course, false);
    let led = rows("lift pointed by masses", &guided, end.place(), planned_course, true);
    let farthest = |ends: &[f64]| ends[1..].iter().copied().fold(0.0, f64::max);
    let (worst, nominal) = ([farthest(&unguided), farthest(&led)], led[0]);
    sheet.findings.push(format!(
        "an offset of 1 cm on a capsule of {:.2} m without lift moves its end by up to {:.1} km, to the side of the offset: the axis turns away from \
         it, and the lift pulls towards it",
        entry.shape.diameter(),
        worst[0]
    ));
    sheet.findings.push(format!(
        "masses of {} kg on a rim of {} m that point the lift along the optimal bank angle end within {:.3} km of the plan without an offset and \
         within {:.1} km with one in any direction: on an axisymmetric shape where the masses stand is the bank angle, a centre of mass across \
         the plane of the lift turns the lift and does not roll the capsule",
        entry.moving_mass,
        entry.rim_radius,
        nominal,
        worst[1]
    ));
    Ok(sheet)
}
