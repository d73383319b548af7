//! Powered descents on Mars by lossless convexification: cases a to e of B. Acikmese and S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353,
//! doi 10.2514/1.27553.
//!
//! Each case by the convex program at the printed flight time and at the best one, and by collocation of the equations of motion with their bounds as
//! they are, without a relaxation. Case e is the one in which the relaxation is not tight.
//!
//! | module | subject |
//! | --- | --- |
//! | `cases` | the cases, by both ways |
//! | `not_tight` | case e: lower bound, and the flight that reaches it |

use crate::items::{command, sheet};
use crate::stop::Stop;
use crate::workers::Workers;
use crate::{HandOn, PaperItem, Publication};

mod cases;
mod not_tight;
#[cfg(test)]
mod tests;

pub(super) const PUBLICATION: Publication = Publication {
    name: "powered-descent",
    title: "Powered descents on Mars by lossless convexification (Acikmese and Ploen 2007, cases a to e)",
    source: "B. Acikmese, S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353, doi 10.2514/1.27553",
    remarks: || Ok(remarks()),
    memory_mb: [60.0, 15.0],
    tables: &[],
    sheets: &["cases", "not-tight"],
    compute: sheets,
    items: ITEMS,
    missions: &["mars-descent.toml", "mars-descent-down.toml", "mars-descent-aside.toml"],
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    hand_on(cases::sheet(workers)?)?;
    hand_on(not_tight::sheet(workers)?)
}

fn remarks() -> Vec<String> {
    [
        "The last thrust is upright in the article; that binds one instant, and is left out here.",
        "Printed propellants are those of controls on steps of one second and of whole seconds of flight time.",
        "The caption of case e has 20 m/s at the start, its text and its number rest.",
        "In case c the printed 81 s are not the best whole second: 78 s take 1.3 kg less.",
    ]
    .map(str::to_owned)
    .into()
}

const ITEMS: &[PaperItem] = &[
    sheet("case a (Fig. 5), no limit along the flight", "cases", "reproduced: 387.9 kg in 72 s"),
    command("case a by a mission file", "solve mars-descent", "strict local optimum"),
    sheet(
        "case b (Fig. 6), no flight below the ground",
        "cases",
        "reproduced: 390.4 kg, one touch of the ground",
    ),
    command(
        "case b by a mission file",
        "solve mars-descent --set constants.lowest=0",
        "verified; powered_descent_above_ground in the gallery",
    ),
    sheet(
        "case c (Figs 7, 8), glide slope",
        "cases",
        "399.4 kg at the printed 81 s; the best time is 77.7 s, 1.3 kg less",
    ),
    command(
        "case c by a mission file",
        "solve mars-descent --set constants.elevation=4 --set constants.below_slope=0",
        "verified; powered_descent_glide_slope in the gallery",
    ),
    sheet(
        "case d (Fig. 10), from rest above the site: thrust downwards first",
        "cases",
        "reproduced: 292.98 kg at the printed 69 s, 293.6 printed with steps of a second; 292.76 kg at the best time",
    ),
    command("case d by a mission file", "solve mars-descent-down", "strict local optimum"),
    sheet(
        "case e (Fig. 11), thrust within 90 deg of up",
        "not-tight",
        "the relaxation is not tight, which is said; thrust from side to side reaches its bound: 302.31 kg, 302.76 kg at the printed 78 s (303 printed)",
    ),
    command("case e by a mission file", "solve mars-descent-aside", "strict local optimum"),
    sheet(
        "lossless convexification: the relaxed optimum is that of the problem",
        "cases",
        "holds in cases a to c; gap beside each",
    ),
];
