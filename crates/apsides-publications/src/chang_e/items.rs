//! Items of the paper on a landing in six stages.

use crate::PaperItem;
use crate::items::{command, found, nowhere, sheet};

pub(super) const ITEMS: &[PaperItem] = &[
    sheet(
        "speeds and places of perilune and apolune (5.9) to (5.11)",
        "orbit",
        "reproduced but for truncation and misprints",
    ),
    sheet(
        "main braking (5.1) to (5.13), free place of the perilune",
        "braking",
        "beside the optimum and an independent solution",
    ),
    sheet("braking over a given arc", "downrange", "the printed time is not the optimum"),
    sheet(
        "piecewise-constant controls with time scaling, L_eps with eps 0.01, tau 0.0025, 30 segments",
        "segments",
        "9.1 g above the optimum",
    ),
    sheet("six stages, gates", "stages", "gates alone are printed below 3 km"),
    command(
        "stage 2, shortest path (5.14), (5.15)",
        "solve chang-e-3-flat --set adjustment_path_weight_kg_m=1",
        "jointly or by stages",
    ),
    sheet(
        "hover (5.17) to (5.20), nominal radial and tangential acceleration",
        "hover",
        "-1.624747 m/s2 and 6.15e-6 m/s2; the flown hover has their resultant",
    ),
    sheet(
        "stage 6, uniform deceleration, least propellant (5.23)",
        "last-stage",
        "uniform deceleration beside the optimum from the same start; no printed numbers",
    ),
    sheet(
        "hazard rule: least-median plane, 50 m, Canny 0.4, spiral; fine: median of pair normals below 2 deg",
        "hazards",
        "unsafe: sites beside criteria on slope, footpads and roughness",
    ),
    command(
        "the same rule on a map of one's own",
        "hazard ground.tif --criteria contest-fine --rule spiral",
        "presets contest-coarse and contest-fine; the output says that they are unsafe and why",
    ),
    command(
        "the same rule in flight: the first safe site on the spiral",
        "solve chang-e-3 --set terrain.rule=spiral --set terrain.coarse_criteria=contest-coarse --set terrain.fine_criteria=contest-fine",
        "lands, with a warning for each map; with the default criteria terrain.rule=spiral alone",
    ),
    nowhere(
        "Figs 5, 7, 8 and DEM values of Table 1: the maps of the contest",
        "the maps are not at hand; generated maps stand for them (sheet hazards)",
    ),
    sheet("state-transition matrix, errors of the start", "transition", "compared"),
    sheet("deviations of 1 km and 3 m/s", "deviations", "sigma by flights and by the matrix"),
    sheet("deviations of 5 %", "five-percent", "no thrust brings those back"),
    sheet("error table", "errors", "recomputed from the printed values"),
    sheet("sensitivities of the optimum", "sensitivity", "prices of each parameter"),
    sheet("scan of the full thrust", "thrust", "beside collocation"),
    sheet(
        "table of sensitivities",
        "printed-sensitivity",
        "relative changes from the printed values; by how much parameters were changed is not said",
    ),
    sheet(
        "their own critique: flight time is not considered, nor the size of the lander",
        "downrange",
        "the printed time of 450 s costs 6 g beside that of the optimum; footpads are criteria of sites (sheet hazards)",
    ),
    sheet("numbers of the text", "text", "each beside that of the problem"),
    command(
        "thrust laws of 5.3.5: elevation",
        "montecarlo chang-e-3-braking --guidance linear-radial",
        "radial acceleration linear in time, its horizontal part along the velocity to be gained",
    ),
    found(
        "thrust laws of 5.3.5: azimuth, feed-forward with gains from simulation",
        "guidance",
        ("guidance", "The laws alone"),
        "the gains are not printed: found by least squares; miss and propellant beside E-guidance and new plans",
    ),
    sheet(
        "landing zone of 356 x 91 km and zone of perilunes, (5.1) to (5.4)",
        "landing-zone",
        "the printed zone is the landing zone with ten times the printed way of the braking on all sides; the way is four times that",
    ),
    nowhere(
        "map projection of (5.1) to (5.4)",
        "its coefficients are misprinted (remarks), and C5 is used without a definition",
    ),
    sheet(
        "Figs 10 to 13, thrust, theta from the vertical, psi from backwards",
        "paths",
        "drawn from the optimum on maps; course and pitch in the reports of solves",
    ),
    sheet("Figs 14 to 16, paths in space", "paths", "in space and from above, of a landing on maps"),
    nowhere(
        "orbit by elements read from TLE (appendix)",
        "elements are keys; two-line elements of lunar orbits do not exist",
    ),
    command(
        "Monte Carlo of the landing: all six stages, on maps",
        "montecarlo chang-e-3 --position-m 333 --velocity-m-s 1 --guidance replanned",
        "open loop, planned anew stage by stage, or by a law: where each stage ends against its gate, touchdown, distance from the site, propellant",
    ),
    command(
        "Monte Carlo of the main braking alone",
        "montecarlo chang-e-3-braking --position-m 333 --velocity-m-s 1",
        "with the state-transition matrix beside",
    ),
];
