//! The gallery by every method through the one interface: each problem within the class of the method, or a reason why it is out of reach.
//!
//! | class | methods | relative difference from the optimum |
//! | --- | --- | --- |
//! | exact | collocation, multiple shooting, indirect shooting after collocation, flat outputs, two layers | what the source of the optimum supports |
//! | linear controls | successive convexification, 40 equal intervals | [`LINEAR_CONTROLS`] |
//! | constant controls | piecewise-constant controls, 40 equal segments | [`CONSTANT_CONTROLS`] |
//!
//! `--nocapture` prints the differences.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::collections::BTreeMap;

use apsides::radau::Radau;
use apsides_ad::{FlatMap, Scalar};
use apsides_convex::{SuccessiveConvexification, SuccessiveSettings};
use apsides_flatness::{FlatMethod, FlatSystem, Flatness};
use apsides_metaheuristics::Search;
use apsides_ocp::{Bounds, Method, Start};
use apsides_piecewise::{PiecewiseConstant, PiecewiseSettings};
use apsides_problems::{GALLERY, Problem, Structure};
use apsides_shooting::direct::{MultipleShooting, MultipleShootingSettings};
use apsides_shooting::indirect::{DirectIndirect, IndirectSettings, IndirectShooting};
use apsides_shooting::profile::{Independent, Steering};
use apsides_two_layer::{ProfileModel, TwoLayer, TwoLayerSettings};

/// Linear controls on 40 intervals: `O(h^2)` where controls are smooth, the cost of ramps where they jump.
const LINEAR_CONTROLS: f64 = 2e-2;

/// Constant controls on 40 segments, whose objective misses the optimum by `O(h^2)` where controls are smooth and by `O(h)` at jumps.
const CONSTANT_CONTROLS: f64 = 2e-2;

/// Position as the output of the double integrator.
struct Position;

impl FlatMap<1, 3, 2, 1, 0> for Position {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 1], _p: &[S; 0]) -> ([S; 2], [S; 1], [S; 0]) {
        ([y[0][0], y[0][1]], [y[0][2]], [])
    }

    fn outputs(&self, _t: f64, x: &[f64; 2], _u: &[f64; 1], _p: &[f64; 0]) -> [f64; 1] {
        [x[0]]
    }
}

/// Segments of indirect shooting per phase: several where the equations are unstable.
fn intervals(problem: &Problem) -> usize {
    match problem.name {
        "hypersensitive" | "shuttle_heat_limit" => 4,
        _ => 1,
    }
}

/// The methods with the settings that suit a problem.
fn methods(problem: &Problem) -> Vec<Box<dyn Method>> {
    let mut shooting = MultipleShootingSettings::default();
    if problem.structure == Structure::BangBang && problem.name != "powered_descent_glide_slope" {
        // What the barrier loses on each side of a jump is the largest error.
        shooting.nlp.tolerance = 1e-10;
    }
    let indirect = IndirectSettings { intervals: intervals(problem), ..IndirectSettings::default() };
    let piecewise = PiecewiseSettings { intervals: 40, ..PiecewiseSettings::default() };
    let convex = SuccessiveSettings { max_iterations: 200, ..SuccessiveSettings::default() };
    vec![
        Box::new(Radau::default()),
        Box::new(MultipleShooting { settings: shooting }),
        Box::new(DirectIndirect {
            direct: Box::new(Radau::default()),
            indirect: IndirectShooting { settings: indirect },
        }),
        Box::new(PiecewiseConstant { settings: piecewise }),
        Box::new(SuccessiveConvexification { settings: convex }),
        Box::new(FlatMethod { flatness: Flatness::default(), systems: vec![FlatSystem::new(Position)] }),
        Box::new(TwoLayer {
            settings: TwoLayerSettings {
                search: Search { budget: 500, threads: 1, ..Search::default() },
                ..TwoLayerSettings::default()
            },
            profile: ProfileModel {
                independent: Independent::Time,
                bounds: vec![Bounds::new(0.0, 1.2)],
                steering: Steering::Controls,
                stop: "h".into(),
                distance_per_unit: vec![1.0, 1.0, 0.0],
            },
            second: Box::new(Radau::default()),
            checkpoint: None,
        }),
    ]
}

const NO_FLAT_OUTPUTS: &str = "no flat outputs are stated for it";
const NO_PROFILE: &str = "no control profile that ends with a state is stated for it";

/// The reason for which a problem is out of a method's reach, if it is.
fn out_of_reach(method: &str, problem: &str) -> Option<&'static str> {
    OUT_OF_REACH
        .iter()
        .find(|(m, names, _)| *m == method && names.contains(&problem))
        .map(|found| found.2)
        .or({
            match method {
                "flatness" if !FLAT.contains(&problem) => Some(NO_FLAT_OUTPUTS),
                "two-layer" if problem != "moon_lander_soft" => Some(NO_PROFILE),
                _ => None,
            }
        })
}

/// Double integrators whose control is smooth.
const FLAT: &[&str] = &["di_min_energy", "di_min_energy_free_speed"];

/// Method, problems, reason.
const OUT_OF_REACH: &[(&str, &[&str], &str)] = &[
    (
        "multiple-shooting",
        &["hypersensitive_long"],
        "its equations are unstable over ten thousand units of time, so that no segment can be integrated",
    ),
    (
        "indirect",
        &["hypersensitive_long"],
        "its equations are unstable over ten thousand units of time, so that no segment can be integrated",
    ),
    ("indirect", &["hanging_chain"], "it bounds an integral"),
    (
        "indirect",
        &["min_time_climb", "brachistochrone_wall", "bryson_denham", "bryson_denham_contact"],
        "a bound on a state or a path constraint without controls is active",
    ),
    (
        "indirect",
        &[
            "free_flying_robot",
            "powered_descent",
            "powered_descent_above_ground",
            "powered_descent_glide_slope",
        ],
        "controls jump between bounds that several of them share",
    ),
    ("indirect", &["di_singular_arc", "catmix", "catmix_reversed", "goddard_cops"], "it has a singular arc"),
    (
        "piecewise",
        &["hypersensitive", "hypersensitive_long"],
        "its boundary layers are thinner than one of 40 equal segments, and its equations unstable",
    ),
    (
        "piecewise",
        &["shuttle_heat_limit"],
        "the limit on the heat rate is exceeded between the points of 40 segments",
    ),
    ("piecewise", &["min_time_climb"], "its tables have kinks at which equal steps miss the tolerance"),
    (
        "successive-convexification",
        &["hypersensitive", "hypersensitive_long"],
        "its boundary layers are thinner than one of 40 equal intervals",
    ),
    (
        "successive-convexification",
        &[
            "hanging_chain",
            "orbit_raising",
            "shuttle_reentry",
            "shuttle_heat_limit",
            "min_time_climb",
            "delta_iii",
        ],
        "without second derivatives it converges linearly, and not within 200 programs",
    ),
];

#[test]
fn every_method_solves_the_gallery_within_its_class() {
    let mut failures = Vec::new();
    let mut reached: BTreeMap<&'static str, usize> = BTreeMap::new();
    for problem in GALLERY {
        let case = problem.pose().unwrap();
        let start = Start::new(case.guess.clone());
        for method in &methods(problem) {
            let method: &dyn Method = &**method;
            let name = method.name();
            if let Some(reason) = out_of_reach(name, problem.name) {
                println!("{:28} {name:28} out of reach: {reason}", problem.name);
                continue;
            }
            let solution = match method.solve(&case.ocp, &start, &mut ()) {
                Ok(solution) => solution,
                Err(e) => {
                    failures.push(format!("{}, {name}: {e}", problem.name));
                    continue;
                }
            };
            let difference = problem.optimum.relative_difference(solution.trajectory.objective);
            let class = match name {
                "successive-convexification" => LINEAR_CONTROLS,
                "piecewise" => CONSTANT_CONTROLS,
                _ => problem.optimum.relative_tolerance,
            };
            let row = format!("{:28} {name:28} {:14} {difference:9.1e}", problem.name, solution.word());
            println!("{row}");
            if solution.is_success() && difference.abs() <= class {
                *reached.entry(name).or_default() += 1;
            } else {
                let why = solution.deficiency.as_ref().map_or_else(String::new, ToString::to_string);
                failures.push(format!("{row} {why}"));
            }
        }
    }
    println!("{reached:?}");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
