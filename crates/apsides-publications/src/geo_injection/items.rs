//! Items of the paper on injection into geostationary orbit.

use crate::PaperItem;
use crate::items::{command, sheet};

pub(super) const ITEMS: &[PaperItem] = &[
    sheet(
        "(1) to (15), canonical units, equations of costates, Table 1",
        "costates",
        "works; the derivation of (16), lost in the text, from its assumptions",
    ),
    sheet("(16), analytic guess", "guesses", "quality of the guess by stage and radius"),
    sheet("Table 2", "table-2", "reproduced with 22170 kg, not with the 22100 kg of Table 1"),
    sheet("Table 3", "table-3", "reproduced with 22170 kg"),
    sheet("Table 4", "table-4", "reproduced with 22170 kg"),
    sheet("Table 5", "table-5", "reproduced with 22170 kg"),
    sheet("Table 6", "table-6", "no semi-major axes are printed: the rows together"),
    sheet("which initial mass the tables have", "burn-times", "22170 kg, by least squares"),
    sheet("Tables 2 to 6 beside the joint optimum", "sequences", "43 to 129 kg above it"),
    sheet("orbits between the burns, chosen by hand", "detours", "up to 99 kg a burn"),
    sheet(
        "Table 7, thrust along the velocity",
        "table-7",
        "the last burn alone; its correction takes 7.3 kg, not about 100 kg",
    ),
    sheet(
        "Figs 4 to 7: altitude, speeds, polar, thrust and flight path angle by burn, plane",
        "profiles",
        "drawn from the joint optimum of two burns",
    ),
    sheet("Figs 8 and 9: optimal beside along the velocity", "profiles", "dots of the same figures"),
    sheet(
        "Table 6 beside reference [20]",
        "reference-20",
        "[20] has 22848 kg at the start: the difference is mass, not steering",
    ),
    command(
        "six stages of Table 1",
        "solve geo-3-burn --set vehicle=fregat-sb --set parking_eccentricity=0.7",
        "upper stages as data",
    ),
    command(
        "limits on burn time, restarts, flight time",
        "solve geo-3-burn --set max_burn_time_s=1100",
        "keys of the mission",
    ),
    command(
        "elliptic start orbits, which the paper leaves out",
        "solve geo-2-burn --set parking_eccentricity=0.7306 --set pattern=AP",
        "a burn at apogee, and the rest of it at the next perigee, from the usual transfer orbit",
    ),
    command(
        "Newton iterations of indirect shooting",
        "solve geo-3-burn --method indirect",
        "counted in the summary",
    ),
];
