//! Items of the paper on moving masses.

use crate::PaperItem;
use crate::items::{command, nowhere, sheet};

pub(super) const ITEMS: &[PaperItem] = &[
    sheet("motion, quaternion, gravity, coefficients (1) to (14)", "figures", "works"),
    sheet("(15), (16), cross; (17), (18), rim", "authority", "reach by mass and travel"),
    sheet("(19), linear law", "figures", "gains are not printed"),
    sheet(
        "(20) to (22), nonlinear law",
        "figures",
        "the form of Najm and Ibraheem; coefficients are not printed, those found by a search are flown",
    ),
    sheet("Figs 2 and 3, no law, no offset", "paper-figures", "reproduced"),
    sheet("Figs 4 and 5, no law, 1 cm", "paper-figures", "a trim angle of 2 deg"),
    sheet("Fig. 6, altitude", "paper-figures", "drawn"),
    sheet("Figs 10 and 11, cross 10 kg, linear", "paper-figures", "held"),
    sheet(
        "Figs 12 to 14, larger angle and 1 cm",
        "paper-figures",
        "held, with 10 deg, which are not printed",
    ),
    sheet("Figs 15 and 16, positions of the masses", "paper-figures", "drawn"),
    sheet("Fig. 17, rim with linear law", "paper-figures", "not held, as claimed"),
    sheet("Figs 18 and 19, cross 5 kg", "paper-figures", "not held, as claimed: the masses are too small"),
    sheet(
        "Figs 20 and 21, rim 5 kg, nonlinear law",
        "paper-figures",
        "held in its own case; not from 3 deg on, nor in all directions",
    ),
    sheet("overshoot of at most 5 %", "paper-figures", "by case"),
    sheet("claim (i), amplitude and frequency by offset", "oscillation", "amplitude yes, frequency no"),
    sheet("claims (ii) to (iv), which layout holds", "authority", "statics decides"),
    sheet("actuators, left out in the paper", "rates", "gains for limited rates hold"),
    sheet("beyond: a re-entry with an offset", "re-entry", "km off the plan"),
    command(
        "coefficients by trial and error or genetic algorithm",
        "tune moving-mass-cross --set law=nonlinear-pid",
        "twelve coefficients, all positive",
    ),
    command("gains of the linear law", "tune moving-mass-cross", "with margins"),
    nowhere(
        "missions with masses whose reaction on the capsule is not neglected",
        "the paper neglects it, too; the equations of full masses are in apsides-dynamics and no mission flies them",
    ),
];
