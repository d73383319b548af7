//! Landing in the manner of Chang'e-3 in six stages: one published solution of problem A of the Chinese undergraduate contest in
//! mathematical modelling (CUMCM), 2014.
//!
//! Printed numbers stand beside those solved here, and both beside a reference of its own: Pontryagin's conditions by shooting
//! with DOP853, collocation with Ipopt, the same models.
//!
//! | module | subject |
//! | --- | --- |
//! | `comparison` | rows of a printed, a found and a reference value |
//! | `case` | the missions with changed values |
//! | `orbit` | landing orbit |
//! | `landing_zone` | landing zone and the perilunes from which it is reached |
//! | `braking` | main braking, its ends and datums |
//! | `downrange` | main braking over a given arc |
//! | `segments` | piecewise-constant controls |
//! | `stages` | six stages, one after the other and together |
//! | `paths` | paths in space and from above |
//! | `lower_stages` | the hover, the last stage by a uniform deceleration |
//! | `transition`, `deviations` | what errors of the start lead to |
//! | `sensitivity` | mass, exhaust velocity and thrust |
//! | `text` | numbers of the text that exclude each other |
//! | `guidance` | thrust laws of 5.3.5 and other steering |
//! | `hazards` | the paper's rule for a landing site |

use super::stop::Stop;
use super::workers::Workers;
use super::{HandOn, Publication};

mod braking;
mod case;
mod comparison;
mod deviations;
mod downrange;
mod guidance;
mod hazards;
mod items;
mod landing_zone;
mod lower_stages;
mod orbit;
mod paths;
mod segments;
mod sensitivity;
mod stages;
#[cfg(test)]
mod tests;
mod text;
mod transition;

const SHEETS: [&str; 19] = [
    "orbit",
    "landing-zone",
    "braking",
    "downrange",
    "segments",
    "stages",
    "hover",
    "last-stage",
    "paths",
    "transition",
    "deviations",
    "five-percent",
    "guidance",
    "sensitivity",
    "thrust",
    "errors",
    "text",
    "printed-sensitivity",
    "hazards",
];

/// Flights with the deviations of the reference, those planned anew, and those with the deviations of the paper.
const FLIGHTS: usize = 5000;
const REPLANNED: usize = 150;
const FAR_FLIGHTS: usize = 400;
const FAR_REPLANNED: usize = 60;

pub(super) const PUBLICATION: Publication = Publication {
    name: "chang-e-3",
    title: "Landing of Chang'e-3 in six stages with piecewise-constant controls (CUMCM 2014, problem A)",
    source: "one published solution of problem A, Chinese undergraduate contest in mathematical modelling, 2014",
    remarks: || Ok(remarks()),
    memory_mb: [42.0, 7.0],
    tables: &[],
    sheets: &SHEETS,
    compute: sheets,
    items: items::ITEMS,
    missions: &["chang-e-3.toml", "chang-e-3-flat.toml", "chang-e-3-braking.toml"],
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    hand_on(orbit::sheet(workers)?)?;
    hand_on(landing_zone::sheet(workers)?)?;
    hand_on(braking::sheet(workers)?)?;
    hand_on(downrange::sheet(&downrange::ARCS, workers)?)?;
    hand_on(segments::sheet(&segments::ROWS, workers)?)?;
    hand_on(stages::sheet(workers)?)?;
    hand_on(lower_stages::hover(workers)?)?;
    hand_on(lower_stages::last_stage(workers)?)?;
    hand_on(paths::sheet(workers)?)?;
    hand_on(transition::sheet(workers)?)?;
    hand_on(deviations::near(FLIGHTS, REPLANNED, workers)?)?;
    hand_on(deviations::far(FAR_FLIGHTS, FAR_REPLANNED, workers)?)?;
    hand_on(guidance::sheet([guidance::FITTED, guidance::FLIGHTS, guidance::PLANNED_ANEW], workers)?)?;
    hand_on(sensitivity::sheet(workers)?)?;
    hand_on(sensitivity::thrusts(&sensitivity::THRUSTS, workers)?)?;
    hand_on(text::errors(workers)?)?;
    hand_on(text::numbers(workers)?)?;
    hand_on(text::sensitivities())?;
    hand_on(hazards::sheet()?)
}

fn remarks() -> Vec<String> {
    [
        "Of the stages below 3 km the gates alone are printed in the text at hand; their propellants stand beside the reference.",
        "(5.9) takes a constant gravity; the name of the perilune is printed for both speeds.",
        "J is called the remaining mass, but is the consumed one.",
        "(5.7) asks for rest at the radius of the Moon, the statement for 57 m/s at 3 km.",
        "In (5.11) the position has sin a cos b where sin a sin b belongs, and the velocity is parallel to the position.",
        "(5.13) gives the end an altitude of 3000 m in axes at the centre of the Moon.",
        "(5.24) has the Coriolis sign of (5.10) reversed, lacks the centrifugal term and the equation of v_z.",
        "(5.14) measures a path by the integral of the sum of the velocity components.",
        "L_eps is printed with (h - eps)^2 / 4 eps: it jumps by eps at both ends; with (h + eps)^2 / 4 eps, as used here, it does not.",
        "(5.18) lacks the factor k and the minus sign; the normal of a plane is printed as a product, not a cross product.",
        "(5.30) has dA/dt = dF/dT for (dF/dT) A.",
        "The fine stage tests the same 50 m of height differences as the coarse one, on a map of 100 m; slopes are measured from the \
         fitted plane instead of the vertical.",
        "Table of sensitivities: 16.67 and 1.11 % are printed where the printed values give 17.21 and 1.23 %; the other relative \
         changes agree (recomputed by the reference; the values are not in the text at hand).",
        "N = a / sqrt(dL - e^2 sin^2 B) of the map projection has dL for 1; 2408 stands for 2048, C3 begins with 45/64 instead of 15/64, \
         and C5 is used without a definition.",
        "The code printed for the first question is a terrestrial projectile with drag, not the method described.",
    ]
    .map(str::to_owned)
    .into()
}
