//! Missions that cannot be flown: the relaxation that the explanation asks for is enough.
#![allow(clippy::unwrap_used)]

use apsides_missions::registry;
use apsides_pipeline::Outcome;

fn landing(dry_mass_kg: f64) -> Outcome {
    // Close to the limit the flight is long and delicate: a coarse mesh answers the question.
    let coarse = ["thrust_n=200", "radau.tolerance=1e-3", "radau.max_refinements=2"].map(str::to_owned);
    let set: Vec<String> = coarse.into_iter().chain([format!("dry_mass_kg={dry_mass_kg}")]).collect();
    registry().load("lunar-perilune", &set).unwrap().solve(None, &mut ()).unwrap()
}

#[test]
fn the_dry_mass_that_an_explanation_asks_for_can_be_landed() {
    let why = landing(100.0).explanation.unwrap();
    let begin = "mass is lowered from 100 to ";
    let number = why.split_once(begin).unwrap_or_else(|| panic!("{why}")).1;
    let least: f64 = number.split_once(" kg").unwrap().0.parse().unwrap();
    assert!(least > 60.0 && least < 100.0, "{why}");
    let solved = landing(least * (1.0 - 1e-3));
    assert!(["optimal", "mesh-limit"].contains(&solved.summary.status.as_str()), "{why}");
    // Minimum time at constant thrust burns least: the final mass is the largest dry mass that can be landed.
    let final_mass = solved.summary.results["final_mass_kg"];
    assert!((final_mass - least).abs() < 1e-3 * least, "{final_mass} {why}");
}
