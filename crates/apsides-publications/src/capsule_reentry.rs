//! The re-entry of a capsule by two layers (Alami Naeini, Roshanian, Modares Mechanical Engineering 14(13), 2014): test functions, moon
//! lander, profiles (Table 1), limits (Table 2), and what the search layer buys.
//!
//! The numbers of Tables 1 and 2 are not in the text at hand. What stands beside the numbers computed here is a reference of its own:
//! the same models by collocation with Ipopt and by other searches.
//!
//! | module | subject |
//! | --- | --- |
//! | `reference` | numbers of the reference |
//! | `model` | the two models, and their solves |
//! | `functions`, `contours`, `lander` | test functions with their figures, moon lander |
//! | `profiles` | searches over bank profiles |
//! | `limits` | optima under limits, with and without the search layer |
//! | `overlays` | figures of all limits of a kind |
//! | `starts` | random starts |

use apsides_metaheuristics::Search;

use super::stop::Stop;
use super::workers::Workers;
use super::{HandOn, Publication};
use crate::Error;
use crate::change::{Change, number, word};
use model::Model;

mod contours;
mod functions;
mod items;
mod lander;
mod limits;
mod model;
mod overlays;
mod profiles;
mod reference;
mod starts;
#[cfg(test)]
mod tests;

const SHEETS: [&str; 8] =
    ["functions", "function-searches", "moon-lander", "profiles", "limits-e", "limits-u", "layers", "starts"];
/// Searches of a kind, and their budget: of the test functions, the lander and the profiles.
const FUNCTION_SEEDS: u64 = 20;
const SEEDS: u64 = 10;
const BUDGET: usize = 6000;
const STARTS: u64 = 20;

const COOPERATION: &str = "cooperation";
/// The cooperation with an exchange after all turns of a cycle, in which migrants that are better replace the worst.
const AFTER_CYCLE: &str = "cooperation-after-cycle";

/// Algorithms by their words in mission files, with their names.
const ALGORITHMS: [(&str, &str); 7] = [
    (COOPERATION, "cooperation"),
    ("genetic", "genetic algorithm"),
    ("particle-swarm", "particle swarm"),
    ("ant-colony", "ant colony"),
    ("differential-evolution", "differential evolution"),
    ("cma-es", "CMA-ES"),
    (AFTER_CYCLE, "cooperation with exchange after the cycle"),
];

/// The values of a mission that choose an algorithm: the cooperation has the exchange of the paper unless another one is named.
fn choice(name: &str) -> [Change<'_>; 2] {
    let (algorithm, exchange) = match name {
        AFTER_CYCLE => (COOPERATION, "after-cycle"),
        name => (name, "at-once"),
    };
    [word("search.algorithm", algorithm), word("search.exchange", exchange)]
}

pub(super) const PUBLICATION: Publication = Publication {
    name: "capsule-reentry",
    title: "Re-entry of a capsule by cooperative search and Radau collocation (Alami Naeini, Roshanian; Tables 1 and 2)",
    source: "Alami Naeini, Roshanian, Modares Mechanical Engineering 14(13), 2014",
    remarks: || Ok(remarks()),
    memory_mb: [111.0, 20.0],
    tables: &[],
    sheets: &SHEETS,
    compute: sheets,
    items: items::ITEMS,
    missions: &["capsule-reentry.toml", "capsule-reentry-us76.toml"],
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    hand_on(functions::optima())?;
    hand_on(functions::searches(FUNCTION_SEEDS, BUDGET, workers)?)?;
    hand_on(lander::sheet(SEEDS, BUDGET, workers)?)?;
    hand_on(profiles::sheet(&profiles::FORMS, SEEDS, BUDGET, workers)?)?;
    let (mut sheet, of_e) = limits::table(Model::E, Model::E.reference().0, workers)?;
    sheet.graphs.extend(overlays::graphs(Model::E, &of_e));
    hand_on(sheet)?;
    let (mut sheet, of_u) = limits::table(Model::U, Model::U.reference().0, workers)?;
    sheet.graphs.extend(overlays::graphs(Model::U, &of_u));
    hand_on(sheet)?;
    hand_on(limits::layers(&[(Model::E, &of_e), (Model::U, &of_u)], &limits::COMBINATIONS, workers)?)?;
    hand_on(starts::sheet(STARTS, workers)?)
}

/// The search of a mission that names this algorithm, on one thread.
fn algorithm(name: &str, budget: usize) -> Result<Search, Error> {
    let [algorithm, exchange] = choice(name);
    let changes = [algorithm, exchange, number("search.evaluations", budget as f64)];
    Ok(crate::load("capsule-reentry", &changes)?.methods().search_settings())
}

fn remarks() -> Vec<String> {
    [
        "Decimals of the printed coordinates run from right to left: 41.5, 40.5, 59.99 and 22.98 deg.",
        "The azimuth counts from east, positive to north, as equation (23) has it: -45 deg is south-east, 2.2 deg off the great circle to \
         the target. From north it would lead away from the target.",
        "At constant lift and drag the dynamic pressure and the aerodynamic acceleration are proportional: 40 m/s2 is 13.764 kPa, so that \
         the limit of 15 kPa is never active beside it.",
        "The constant 1.294e-4 of the heat rate is 36 % above that of Sutton and Graves for the nose radius of the capsule, 3.36 m.",
        "The scale of 79 % against Apollo does not fit the diameters, 2.8 m and 3.9116 m: 71.6 %.",
        "The numbers of Tables 1 and 2 are not in the text at hand, nor are the coefficients of the capsule: model E takes constant ones \
         of Apollo 10 in an exponential atmosphere, model U its trim table in the US Standard Atmosphere 1976 with the printed densities \
         above 86 km.",
        "The budget of the paper's searches is not stated there; 6000 evaluations are used here, as in the reference.",
        "Times are wall-clock times of solves that run side by side on the threads given.",
    ]
    .map(str::to_owned)
    .into()
}
