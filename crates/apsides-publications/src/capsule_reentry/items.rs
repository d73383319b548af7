//! Items of the paper on re-entry by two layers.

use crate::PaperItem;
use crate::items::{command, found, sheet};

pub(super) const ITEMS: &[PaperItem] = &[
    found(
        "(1) to (4), cooperation of colony, swarm and genetic algorithm: six steps",
        "profiles",
        ("profiles", "Against single algorithms"),
        "in the order of the paper, and with an exchange after the cycle: counted by the sheet",
    ),
    sheet(
        "(5), (6), test functions",
        "functions",
        "(0, 0) is no global minimiser of (5) with the exponent 0.25",
    ),
    sheet(
        "Figs 1 and 2, contours of the test functions",
        "functions",
        "drawn, with the minima beside the printed ones; the levels of the paper are not printed",
    ),
    found(
        "cooperation against single algorithms on the test functions",
        "function-searches",
        ("function-searches", ""),
        "verdict by function",
    ),
    sheet("(7) to (15), collocation at Radau points", "moon-lander", "works"),
    sheet(
        "(16) to (22), moon lander; Figs 3 to 5",
        "moon-lander",
        "closed form beside all methods; thrust, height and speed over time",
    ),
    sheet("(23) to (26), motion, limits, ends, cost", "limits-e", "works; azimuth from east"),
    sheet(
        "Table 1, three kinds of profile",
        "profiles",
        "the decimals are lost in every copy: no row can be compared",
    ),
    sheet(
        "largest number of sub-intervals and highest degree as inputs, with a degree of each sub-interval in the searched string",
        "profiles",
        "searched with up to 3 sub-intervals of degrees 0 to 3, number, lengths and degrees free (search.most_degree)",
    ),
    sheet(
        "Figs 7 to 10, profiles",
        "profiles",
        "bank angle, all states and path of the best profile of each form beside the optimum",
    ),
    sheet(
        "Table 2, two layers with limits, model E",
        "limits-e",
        "the decimals are lost; the heat loads are within 0.006 MJ/m2 of the reference, whose limits hold at its points alone",
    ),
    sheet(
        "Table 2, US Standard Atmosphere and trim table",
        "limits-u",
        "the heat loads are within 0.006 MJ/m2 of the reference",
    ),
    sheet(
        "Figs 11 to 19, limits on dynamic pressure, heat rate, load",
        "limits-e",
        "the quantity, the bank angle and all states over time, a curve a limit; heat load over each limit",
    ),
    command(
        "histories of all states under each limit",
        "sweep capsule-reentry --set heat_rate_limit_kw_m2=800,900 --out limits",
        "a report for each",
    ),
    found(
        "claim: the search layer helps collocation",
        "layers",
        ("layers", ""),
        "iterations and times with and without it",
    ),
    sheet("claim: random starts", "starts", "by kind of start"),
];
