//! Items of the paper on planar lunar landings.

use crate::PaperItem;
use crate::items::{command, nowhere, sheet};

pub(super) const ITEMS: &[PaperItem] = &[
    sheet(
        "(1) to (7), planar motion, mass by time; Table 1",
        "table-2",
        "the equations and constants of all rows",
    ),
    sheet(
        "(8), (9), objectives -m_f and t_f: same optimum, t_f converges better",
        "objectives",
        "same optimum; as many iterations with either",
    ),
    sheet(
        "(10) to (16), ends, three strategies, transfer, gate",
        "table-3",
        "the missions lunar-direct, lunar-perilune, lunar-two-phase",
    ),
    command(
        "(17), (18), residual equations of systems that are not flat",
        "solve lunar-perilune --method flatness",
        "the mass is a function of time, the thrust a residual",
    ),
    command(
        "(19) to (24), B-splines, knots, multiplicity, count of coefficients",
        "solve lunar-perilune --method flatness",
        "works; (20) and (24) are misprinted",
    ),
    nowhere(
        "scaling of unknowns and constraints to [0, 1] or [-0.5, 0.5]",
        "the solver scales by gradients and bounds; the scaling changes no optimum, and the iterations of the paper are not printed",
    ),
    sheet(
        "(25) to (38), 31 unknowns and 22 constraints",
        "without-flatness",
        "reproduced; no trajectory between its points: it misses the surface by metres to a kilometre",
    ),
    sheet(
        "size and speed against the same method without flatness (76 and 67)",
        "without-flatness",
        "smaller, as claimed; for the times see the sheet",
    ),
    sheet("Table 2", "table-2", "six of seven times are below the minimum"),
    sheet("Table 3", "table-3", "every row contradicts itself; its origin is open, the text says no more"),
    sheet("Figs 2 and 3: paths, speeds, thrust angle", "figures", "drawn from the optimum"),
    sheet("a lower perilune, and the indirect landing, are better", "table-2", "holds"),
    command(
        "thrust upright at touchdown, time to turn at the gate",
        "solve lunar-vertical",
        "0.43 kg and a limited rate of turn",
    ),
    sheet(
        "the rise of the path at first, to be removed by an impulse when the perilune is left",
        "rise",
        "impulse and its price by perilune altitude (key departure_impulse_m_s), and the best impulse (free_departure_impulse)",
    ),
    sheet(
        "conclusion: tracking under noise, disturbance, uncertainty",
        "dispersion",
        "plan, law and new plans flown with deviations",
    ),
    command(
        "the same by Monte Carlo",
        "montecarlo lunar-perilune --guidance linear-radial",
        "also open-loop and replanned, for all lunar missions",
    ),
    command(
        "interior point, indirect shooting, pseudospectral methods for comparison",
        "solve lunar-perilune --method indirect",
        "all agree to 1e-9",
    ),
];
