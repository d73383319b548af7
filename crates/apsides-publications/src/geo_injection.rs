//! Tables 2 to 7 of Alavipour, Nikkhah and Roshanian on the injection of an upper stage into geostationary orbit with several burns,
//! Modares Mechanical Engineering 18(1), and the costates of its single burns.
//!
//! The rule of Tables 2 to 6: each burn reaches the printed orbit in minimum time, ignites half its duration before perigee of the
//! orbit before (the last burn: before apogee) and leaves the line of apses as it is. Every burn is a problem of its own, solved by
//! collocation and by indirect shooting; the joint optimum is that of the missions `geo-2-burn` to `geo-6-burn`.
//!
//! | module | subject |
//! | --- | --- |
//! | `printed` | the tables as printed |
//! | `stage` | vehicle, orbits, solvers |
//! | `burns` | burns by the rule, one or a sequence |
//! | `tables` | Tables 2 to 6, and what they cost |
//! | `along_velocity` | Table 7 |
//! | `profiles` | Figs 4 to 9 |
//! | `reference_20` | the sequence that Table 6 is compared with |
//! | `analytic`, `circles`, `costates` | the guess of a single burn, single burns, both beside each other |

use apsides_dynamics::engine::STANDARD_GRAVITY;

use super::workers::Workers;
use super::{HandOn, Publication};
use crate::Error;
use printed::{STATED_MASS, TABLES, TWO_BURNS, USED_MASS};
use stage::{Solver, Stage, Stop};

mod along_velocity;
mod analytic;
mod burns;
mod circles;
mod costates;
mod items;
mod printed;
mod profiles;
mod reference_20;
mod stage;
mod tables;

/// The stage of Tables 2 to 7.
const VEHICLE: &str = "breeze-m";
/// Altitude that the text gives for the geostationary orbit, km.
const PRINTED_ALTITUDE_KM: f64 = 36_786.0;

pub(super) const PUBLICATION: Publication = Publication {
    name: "geo-injection",
    title: "Injection into geostationary orbit with two to six burns by indirect shooting (Alavipour, Nikkhah, Roshanian; Tables 2 to 7)",
    source: "Alavipour, Nikkhah, Roshanian, Modares Mechanical Engineering 18(1)",
    remarks,
    memory_mb: [28.0, 2.0],
    tables: &[],
    sheets: &[
        "table-2",
        "table-3",
        "table-4",
        "table-5",
        "table-6",
        "table-7",
        "burn-times",
        "sequences",
        "detours",
        "costates",
        "guesses",
        "profiles",
        "reference-20",
    ],
    compute: sheets,
    items: items::ITEMS,
    missions: &[
        "geo-2-burn.toml",
        "geo-3-burn.toml",
        "geo-4-burn.toml",
        "geo-5-burn.toml",
        "geo-6-burn.toml",
    ],
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    let solver = &mut Solver { threads: workers.threads, observer: &mut *workers.observer };
    let stages = [Stage::of(VEHICLE, Some(USED_MASS))?, Stage::of(VEHICLE, Some(STATED_MASS))?];
    let mut sequences = Vec::new();
    for printed in &TABLES {
        let (sheet, sequence) = tables::table(printed, &stages, solver)?;
        sequences.push(sequence);
        hand_on(sheet)?;
    }
    hand_on(along_velocity::table_7(&stages)?)?;
    hand_on(tables::agreement(&sequences, &stages[0]))?;
    hand_on(tables::totals(&sequences, &stages, solver)?)?;
    hand_on(tables::detours(&sequences, &stages[0], solver)?)?;
    for sheet in costates::tables(solver)? {
        hand_on(sheet)?;
    }
    hand_on(profiles::sheet(&stages[0], solver)?)?;
    hand_on(reference_20::sheet(&stages[0], solver)?)
}

fn remarks() -> Result<Vec<String>, Error> {
    let stage = Stage::of(VEHICLE, None)?;
    let altitude = (stage.target_radius - stage.flight.body.radius) / 1e3;
    let (_, unit) = stage.canonical();
    let [first, _] = TWO_BURNS;
    let mut impulses = Vec::new();
    for (vehicle, _) in costates::STAGES {
        let engine = Stage::of(vehicle, None)?.flight.engine;
        impulses.push(format!("{:.2}", engine.exhaust_velocity / STANDARD_GRAVITY));
    }
    Ok(vec![
        "The printed rule: each burn reaches the printed orbit in minimum time from the printed orbit and mass before it, ignites half \
         its duration before perigee (the last one: before apogee) and leaves the line of apses as it is."
            .into(),
        format!(
            "The text gives {PRINTED_ALTITUDE_KM} km as the altitude of the geostationary orbit; {} km from the centre are {altitude:.0} km.",
            stage.target_radius / 1e3
        ),
        format!(
            "The specific impulses of Table 1 are truncated: thrust by mass flow by standard gravity is {} s. Thrust and mass flow are \
             used here.",
            impulses.join(", ")
        ),
        format!(
            "The analytic guess is meant for arcs below a quarter of a revolution; the first burn of Table 2 lasts {:.2} periods of the \
             parking orbit.",
            first.time / (std::f64::consts::TAU * unit)
        ),
        "Equation (16), the analytic guess, is lost in the text at hand; the one used here follows from the assumptions stated there.".into(),
        "The text restricts the stage to fewer than six firings; Table 5 has six.".into(),
        "Burn time and propellant are equivalent for one burn to a given orbit, not for a sequence whose orbits are free.".into(),
    ])
}
