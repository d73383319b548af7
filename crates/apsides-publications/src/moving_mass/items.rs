//! Items of the paper on moving masses.

use crate::PaperItem;
use crate::items::{command, found, sheet};

pub(super) const ITEMS: &[PaperItem] = &[
    sheet("motion, quaternion, gravity, coefficients (1) to (14)", "figures", "works"),
    sheet("(15), (16), cross; (17), (18), rim", "authority", "reach by mass and travel"),
    sheet("(19), linear law", "figures", "gains are not printed"),
    sheet(
        "(20) to (22), nonlinear law",
        "figures",
        "the form of Najm and Ibraheem; coefficients are not printed, those found by a search are flown",
    ),
    found("Figs 2 and 3, no law, no offset", "paper-figures", ("figures", "no law, no offset"), "reproduced"),
    found(
        "Figs 4 and 5, no law, 1 cm",
        "paper-figures",
        ("figures", "no law, 1 cm"),
        "a trim angle of 2 deg",
    ),
    sheet("Fig. 6, altitude", "paper-figures", "drawn"),
    found("Figs 10 and 11, cross 10 kg, linear", "paper-figures", ("figures", "cross 10 kg, PID: "), "held"),
    sheet(
        "Figs 12 to 14, larger angle and 1 cm",
        "paper-figures",
        "held, with 10 deg, which are not printed",
    ),
    sheet("Figs 15 and 16, positions of the masses", "paper-figures", "drawn"),
    found(
        "Fig. 17, rim with linear law",
        "paper-figures",
        ("figures", "radial 10 kg, PID on angles, neutral (0, 180)"),
        "not held, as claimed",
    ),
    found(
        "Figs 18 and 19, cross 5 kg",
        "paper-figures",
        ("figures", "cross 5 kg, PID: "),
        "not held, as claimed: the masses are too small",
    ),
    found(
        "Figs 20 and 21, rim 5 kg, nonlinear law",
        "paper-figures",
        ("figures", "radial 5 kg, nonlinear PID on angles"),
        "held in its own case; not from 3 deg on, nor in all directions",
    ),
    found("overshoot of at most 5 %", "paper-figures", ("paper-figures", ""), "by case"),
    found(
        "claim (i), amplitude and frequency by offset",
        "oscillation",
        ("oscillation", ""),
        "amplitude yes, frequency no",
    ),
    sheet("claims (ii) to (iv), which layout holds", "authority", "statics decides"),
    found(
        "actuators, left out in the paper",
        "rates",
        ("rates", "with gains for each speed"),
        "gains for limited rates hold",
    ),
    sheet("beyond: a re-entry with an offset", "re-entry", "km off the plan"),
    command(
        "coefficients by trial and error or genetic algorithm",
        "tune moving-mass-cross --set law=nonlinear-pid",
        "twelve coefficients, all positive",
    ),
    command("gains of the linear law", "tune moving-mass-cross", "with margins"),
    command(
        "missions with masses whose reaction on the capsule is not neglected, as the paper does",
        "simulate moving-mass-cross --set masses=full --set mass_station_m=0.2 --set rate_limit_m_s=1 --set acceleration_limit_m_s2=10",
        "also for montecarlo and tune",
    ),
    found(
        "the neglect of momentum and inertia of the masses",
        "full-masses",
        ("full-masses", "what the neglect does"),
        "by case: little for a cross in the plane of the centre of mass; off it fast masses lose the capsule",
    ),
];
