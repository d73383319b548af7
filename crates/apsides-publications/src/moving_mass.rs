//! A suborbital capsule held by moving masses (Karimabadeh, Tayefi): the cases of its figures as closed-loop descents, and its four claims.
//!
//! The paper states neither the mass of the capsule nor its aerodynamics. What stands beside the numbers computed here is a reference of its
//! own: the same model by an independent simulation.
//!
//! | module | subject |
//! | --- | --- |
//! | `cases` | the cases, the numbers of the reference, what the paper says |
//! | `sheets` | the tables |
//! | `entry` | a re-entry from orbit with an offset, and with masses that point its lift |

use super::stop::Stop;
use super::workers::Workers;
use super::{Content, HandOn, Publication};

mod cases;
mod entry;
mod sheets;
#[cfg(test)]
mod tests;

const SHEETS: usize = 5;

pub(super) const PUBLICATION: Publication = Publication {
    name: "moving-mass",
    title: "A capsule held by moving masses, cross and radial, PID and nonlinear PID (Karimabadeh, Tayefi; Figs 2 to 21)",
    source: "Karimabadeh, Tayefi, six degrees of freedom of a suborbital capsule with moving masses",
    remarks: || Ok(remarks()),
    memory_mb: [66.0, 10.0],
    content: Content::Sheets(SHEETS, sheets),
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    let threads = workers.threads;
    hand_on(sheets::figures(threads)?)?;
    hand_on(sheets::oscillation()?)?;
    hand_on(sheets::authority(threads)?)?;
    hand_on(sheets::rates(threads)?)?;
    hand_on(entry::sheet(threads, workers.observer)?)
}

fn remarks() -> Vec<String> {
    [
        "Mass, inertia and coefficients of the capsule are not in the paper: 500 kg and 1.5 m, inertia and coefficients of Apollo to scale. \
         What holds and what fails in the paper fits vehicles from about 350 to 530 kg alone.",
        "Which of Figs 2 to 21 is which case is not in the text at hand; the cases are those that the figures show: without law, with an \
         offset of 1 cm along y and z, and cross or radial masses of 10 or 5 kg under PID or nonlinear PID.",
        "Equations (20) to (22), the nonlinear PID, are not in the text at hand. The law here is that of Najm and Ibraheem (2019) with twelve \
         coefficients an axis; with the coefficients of the reference it does not give the numbers of the reference. Forms whose gain rises with \
         the argument give those of the cross, none that was tried gives those of the rim. Coefficients for a rim of 10 kg are not at hand. Open.",
        "Laws on the angles of a rim command at most half a turn from neutral: with that the linear cases come out as in the reference.",
        "A travel of 0 to 70 cm, as printed, corrects offsets to one side only; the cases have 70 cm to both sides.",
        "Beyond 30 deg of total angle of attack the coefficients are held at the edge of the table, so that tumbling is told but not computed.",
    ]
    .map(str::to_owned)
    .into()
}
