//! A suborbital capsule held by moving masses (Karimabadeh, Tayefi): the cases of its figures as closed-loop descents, and its four claims.
//!
//! The paper states neither the mass of the capsule nor its aerodynamics. What stands beside the numbers computed here is a reference of its
//! own: the same model by an independent simulation.
//!
//! | module | subject |
//! | --- | --- |
//! | `cases` | the cases, the numbers of the reference, what the paper says |
//! | `sheets` | the tables |
//! | `curves` | a figure for each figure |
//! | `full` | masses whose momentum and inertia are not neglected |
//! | `entry` | a re-entry from orbit with an offset, and with masses that point its lift |

use super::stop::Stop;
use super::workers::Workers;
use super::{HandOn, Publication};

mod cases;
mod curves;
mod entry;
mod full;
mod items;
mod sheets;
#[cfg(test)]
mod tests;

const SHEETS: [&str; 7] =
    ["figures", "paper-figures", "oscillation", "authority", "rates", "full-masses", "re-entry"];

pub(super) const PUBLICATION: Publication = Publication {
    name: "moving-mass",
    title: "A capsule held by moving masses, cross and radial, PID and nonlinear PID (Karimabadeh, Tayefi; Figs 2 to 21)",
    source: "Karimabadeh, Tayefi, six degrees of freedom of a suborbital capsule with moving masses",
    remarks: || Ok(remarks()),
    memory_mb: [66.0, 10.0],
    tables: &[],
    sheets: &SHEETS,
    compute: sheets,
    items: items::ITEMS,
    missions: &["moving-mass-cross.toml", "moving-mass-radial.toml"],
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    let threads = workers.threads;
    hand_on(sheets::figures(threads)?)?;
    hand_on(curves::sheet(threads)?)?;
    hand_on(sheets::oscillation()?)?;
    hand_on(sheets::authority(threads)?)?;
    hand_on(sheets::rates(threads)?)?;
    hand_on(full::sheet(threads)?)?;
    hand_on(entry::sheet(threads, workers.observer)?)
}

fn remarks() -> Vec<String> {
    [
        "Mass, inertia and coefficients of the capsule are not in the paper: 500 kg and 1.5 m, inertia and coefficients of Apollo to scale. \
         What holds and what fails in the paper fits vehicles from about 350 to 530 kg alone.",
        "Figs 2, 3, 10 and 11 enter at a pitch of 90 deg without an angle of attack; the larger angle of Figs 12 to 14 is not printed, 10 deg are \
         taken here.",
        "The nonlinear PID, (20) to (22), is that of Najm and Ibraheem (2019): u = sum of (k1 + k2 / (1 + exp(mu b^2))) |b|^epsilon sign(b) over \
         error, rate and integral b. None of its coefficients is printed, nor the gains of the linear law; those flown here were found by a search.",
        "Laws on the angles of a rim command at most half a turn from neutral: with that the linear cases come out as in the reference.",
        "A travel of 0 to 70 cm, as printed, corrects offsets to one side only; the cases have 70 cm to both sides.",
        "Beyond 30 deg of total angle of attack the coefficients are held at the edge of the table, so that tumbling is told but not computed.",
    ]
    .map(str::to_owned)
    .into()
}
