//! Re-entries of a capsule through the facade, against independent optima.
//!
//! Reference numbers: Radau collocation with CasADi and Ipopt on 120 to 300 elements, flown again with DOP853 (121.6841 and 122.9272 MJ/m2 with an
//! exponential atmosphere, 120.4488 and 120.690 with the US Standard Atmosphere 1976 and a trim table); the least lift by bisection on the reach.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use apsides::nlp::Flow;
use apsides::pipeline::Cancellation;
use apsides::{Observer, SearchProgress};
use apsides_tests::mission::{load, near, solve, verified};

/// Discretisation: heat loads against collocation, MJ/m2.
const HEAT_MJ_M2: f64 = 1e-3;
/// Round-off of sums: the heat load as result and as objective, MJ/m2.
const SAME_HEAT_MJ_M2: f64 = 1e-7;
/// Published: two units of the last digit of the heat load, MJ/m2.
const DIGITS_MJ_M2: f64 = 2e-6;
/// Discretisation: the heat load under limits, MJ/m2.
const LIMITED_HEAT_MJ_M2: f64 = 3e-3;
/// Discretisation: the heat load without arcs along limits, MJ/m2.
const REFINED_HEAT_MJ_M2: f64 = 3e-5;
/// Solver: the target is met to it, km.
const MISS_KM: f64 = 1e-5;
/// Solver: the same on Mars, km.
const MARS_MISS_KM: f64 = 1e-4;
/// Discretisation: peaks of the load, m/s2.
const LOAD_M_S2: f64 = 2e-3;
/// Solver: a limited load at its limit, m/s2.
const LIMITED_LOAD_M_S2: f64 = 1e-4;
/// Discretisation: times at a flat optimum, s.
const FLAT_TIME_S: f64 = 0.02;
/// Discretisation: peaks of the heat rate, kW/m2.
const PEAK_HEAT_RATE_KW_M2: f64 = 0.01;
/// Solver: a limited heat rate at its limit, kW/m2.
const HEAT_RATE_KW_M2: f64 = 1e-3;
/// Discretisation: peaks of the dynamic pressure, kPa.
const PRESSURE_KPA: f64 = 1e-3;
/// Published: the last digit of the ratio of lift to drag.
const LIFT_TO_DRAG: f64 = 1e-4;
/// Discretisation: the least peak of the dynamic pressure, kPa.
const LEAST_PRESSURE_KPA: f64 = 2e-3;
/// Discretisation: the least peak of the load, m/s2.
const LEAST_LOAD_M_S2: f64 = 5e-3;

const UNLIMITED: [&str; 4] =
    ["dynamic_pressure_limit_kpa=inf", "load_limit_m_s2=inf", "heat_rate_limit_kw_m2=inf", "margins=false"];

#[test]
fn exponential_atmosphere_without_limits() {
    let outcome = solve("capsule-reentry", &UNLIMITED);
    verified(&outcome);
    near(&outcome, "heat_load_mj_m2", 121.6841, HEAT_MJ_M2);
    near(&outcome, "flight_time_s", 568.913, FLAT_TIME_S);
    near(&outcome, "peak_dynamic_pressure_kpa", 15.6886, PRESSURE_KPA);
    near(&outcome, "peak_load_m_s2", 45.593, LOAD_M_S2);
    near(&outcome, "peak_heat_rate_kw_m2", 885.35, PEAK_HEAT_RATE_KW_M2);
    near(&outcome, "target_miss_km", 0.0, MISS_KM);
    // The integral of the mission's own results is that of the objective.
    near(&outcome, "heat_load_mj_m2", outcome.summary.objective.value, SAME_HEAT_MJ_M2);
}

/// A result has the bank angle, the problem its cosine and sine.
#[test]
fn a_flight_starts_its_mission_again() {
    let first = solve("capsule-reentry", &[]);
    let mission = load("capsule-reentry", &[]).unwrap();
    let again = mission.solve(Some(&first.trajectory), &mut ()).unwrap();
    verified(&again);
    near(&again, "heat_load_mj_m2", first.summary.objective.value, SAME_HEAT_MJ_M2);
}

#[test]
fn exponential_atmosphere_with_limits_touches_two() {
    let outcome = solve("capsule-reentry", &[]);
    verified(&outcome);
    near(&outcome, "heat_load_mj_m2", 122.9272, HEAT_MJ_M2);
    near(&outcome, "flight_time_s", 570.78, 0.1);
    near(&outcome, "final_speed_m_s", 228.6, 0.1);
    near(&outcome, "final_path_angle_deg", -54.7, 0.1);
    near(&outcome, "peak_load_m_s2", 40.0, LIMITED_LOAD_M_S2);
    near(&outcome, "peak_heat_rate_kw_m2", 800.0, HEAT_RATE_KW_M2);
    near(&outcome, "peak_heat_rate_time_s", 239.7, 1.0);
    near(&outcome, "peak_load_time_s", 270.2, 0.5);
    near(&outcome, "least_lift_to_drag", 0.2974, LIFT_TO_DRAG);
    near(&outcome, "range_km", 2609.0, 1.0);
}

/// Arcs along limits of second order and touch points beside them, short ones among them: each is an optimum, not feasible alone. References
/// on 60 elements; limits of dynamic pressure (kPa), load (m/s2) and heat rate (kW/m2).
#[test]
fn arcs_along_limits_are_verified_as_optima() {
    let rows = [
        (["13", "inf", "inf"], 122.77025),
        (["12", "inf", "inf"], 123.3855),
        (["11", "inf", "inf"], 124.13063),
        (["inf", "37", "inf"], 122.9255),
        (["inf", "34", "inf"], 123.59278),
        (["inf", "inf", "760"], 123.29409),
        (["13", "40", "800"], 123.1919),
        (["15", "36", "800"], 123.4394),
        (["15", "40", "780"], 123.22586),
    ];
    for ([pressure, load, heat_rate], heat_load) in rows {
        let limits = [
            &format!("dynamic_pressure_limit_kpa={pressure}"),
            &format!("load_limit_m_s2={load}"),
            &format!("heat_rate_limit_kw_m2={heat_rate}"),
            "margins=false",
        ];
        let outcome = solve("capsule-reentry", &limits);
        verified(&outcome);
        near(&outcome, "heat_load_mj_m2", heat_load, LIMITED_HEAT_MJ_M2);
    }
}

/// Flights near the mission have short arcs along limits of second order, some of a thousandth of the flight. References: refinement of meshes
/// without arcs, until the heat load changes by less than 1e-5 MJ/m2.
#[test]
fn short_arcs_along_limits_are_verified_as_optima() {
    let rows = [
        ("target_longitude_deg=59.2", 120.30375),
        ("target_longitude_deg=59.8", 122.06177),
        ("target_latitude_deg=22.7502", 123.30137),
        ("entry_path_angle_deg=-1.8", 120.06149),
        ("entry_longitude_deg=42.33", 120.21215),
    ];
    for (set, heat_load) in rows {
        let outcome = solve("capsule-reentry", &[set, "margins=false"]);
        verified(&outcome);
        near(&outcome, "heat_load_mj_m2", heat_load, REFINED_HEAT_MJ_M2);
    }
}

#[test]
fn standard_atmosphere_and_trim_table() {
    let free = solve("capsule-reentry-us76", &UNLIMITED);
    verified(&free);
    near(&free, "heat_load_mj_m2", 120.4488, HEAT_MJ_M2);
    near(&free, "flight_time_s", 577.808, FLAT_TIME_S);
    let limited = solve("capsule-reentry-us76", &["margins=false"]);
    verified(&limited);
    near(&limited, "heat_load_mj_m2", 120.690, LIMITED_HEAT_MJ_M2);
    near(&limited, "flight_time_s", 578.88, 0.1);
}

#[test]
fn methods_agree_without_limits() {
    let [pressure, load, heat, margins] = UNLIMITED;
    for method in ["method=indirect", "method=two-layer"] {
        let outcome = solve("capsule-reentry", &[pressure, load, heat, margins, method]);
        verified(&outcome);
        near(&outcome, "heat_load_mj_m2", 121.684_087, DIGITS_MJ_M2);
    }
}

#[test]
fn both_conventions_of_the_azimuth_are_one_flight() {
    let outcome = solve("capsule-reentry", &["azimuth_from=north", "entry_azimuth_deg=135", "margins=false"]);
    near(&outcome, "heat_load_mj_m2", 122.9272, HEAT_MJ_M2);
}

#[test]
fn least_peaks() {
    // 8717 Pa, 25.333 m/s2, 674.67 kW/m2 at the nodes of 60 elements; between them a little more.
    let [pressure, load, heat, margins] = UNLIMITED;
    for (goal, key, expected, tolerance) in [
        ("goal=peak-dynamic-pressure", "peak_dynamic_pressure_kpa", 8.717, LEAST_PRESSURE_KPA),
        ("goal=peak-load", "peak_load_m_s2", 25.333, LEAST_LOAD_M_S2),
        ("goal=peak-heat-rate", "peak_heat_rate_kw_m2", 674.67, 0.3),
    ] {
        let outcome =
            solve("capsule-reentry", &[pressure, load, heat, margins, goal, "radau.tolerance=1e-6"]);
        assert!(outcome.status.is_success(), "{goal}: {:?}", outcome.explanation);
        near(&outcome, key, expected, tolerance);
    }
}

#[test]
fn a_target_out_of_reach_is_explained_in_km_and_lift() {
    // L/D 0.25; the least that reaches the target is 0.2974.
    let outcome = solve("capsule-reentry", &["lift_coefficient=0.314225"]);
    assert_eq!(outcome.summary.status, "infeasible");
    let text = outcome.explanation.unwrap();
    let km: f64 = text.split("the target is ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((30.0..60.0).contains(&km), "{text}");
    assert!(text.contains("the least L/D that reaches it is 0.2974, now 0.2500"), "{text}");
}

/// The solves for nearest end and least lift look at the interruption, too, and what they have no time for is not said.
#[test]
fn what_explains_a_target_out_of_reach_can_be_interrupted() {
    let looks = Arc::new(AtomicUsize::new(0));
    let asked_from = |look: usize| {
        looks.store(0, Ordering::SeqCst);
        let counted = Arc::clone(&looks);
        let cancellation = Cancellation::when(move || counted.fetch_add(1, Ordering::SeqCst) >= look);
        let mission = load("capsule-reentry", &["lift_coefficient=0.314225"]).unwrap();
        let outcome = mission.with_cancellation(cancellation).solve(None, &mut ()).unwrap();
        (outcome.summary.status, outcome.explanation.unwrap(), looks.load(Ordering::SeqCst))
    };
    let (status, whole, all) = asked_from(usize::MAX);
    assert_eq!(status, "infeasible");
    assert!(whole.contains("the least L/D that reaches it is 0.2974"), "{whole}");
    // In the last solve, that for the lift: the nearest end is known, nothing is said of the lift.
    let (status, part, _) = asked_from(all - 3);
    assert_eq!(status, "interrupted");
    assert!(part.contains("out of reach") && !part.contains("L/D"), "{part}");
    // From the first look on each solve ends at its first iteration.
    let (status, none, few) = asked_from(0);
    assert_eq!(status, "interrupted");
    assert!(!none.contains("out of reach") && few < all / 4, "{none} {few} {all}");
}

/// Ends the search at its first generation.
struct Impatient(usize);

impl Observer for Impatient {
    fn iteration(&mut self, _: &apsides::nlp::IterationRecord) -> Flow {
        Flow::Continue
    }

    fn generation(&mut self, search: &SearchProgress) -> Flow {
        self.0 += 1;
        assert!(search.evaluations <= search.budget && search.best.is_some());
        Flow::Stop
    }
}

#[test]
fn an_interrupted_search_goes_on_from_its_best() {
    let mut observer = Impatient(0);
    let outcome = load("capsule-reentry", &["method=two-layer", "margins=false", "radau.max_refinements=0"])
        .unwrap()
        .solve(None, &mut observer)
        .unwrap();
    assert_eq!(observer.0, 1);
    let search = outcome.summary.search.as_ref().unwrap();
    assert_eq!((search.stop.as_str(), search.generations), ("interrupted", 1));
    assert!(outcome.status.is_success());
}

#[test]
fn a_seed_fixes_the_search_for_any_number_of_threads() {
    let with = |seed: u64, threads: usize| {
        let mission = load(
            "capsule-reentry",
            &["method=two-layer", "search.evaluations=600", "margins=false", "radau.max_refinements=0"],
        )
        .unwrap()
        .with_seed(seed)
        .with_threads(threads);
        let summary = mission.solve(None, &mut ()).unwrap().summary;
        (summary.search.unwrap().objective.unwrap(), summary.objective.value)
    };
    assert_eq!(with(3, 1), with(3, 4));
    assert_ne!(with(3, 1).0, with(4, 1).0);
}

#[test]
fn every_algorithm_finds_a_start() {
    for algorithm in [
        "cooperation",
        "genetic",
        "particle-swarm",
        "ant-colony",
        "differential-evolution",
        "cma-es",
        "annealing",
        "islands",
    ] {
        let key = format!("search.algorithm={algorithm}");
        let outcome = solve(
            "capsule-reentry",
            &[
                "method=two-layer",
                &key,
                "search.evaluations=1000",
                "margins=false",
                "radau.max_refinements=0",
            ],
        );
        assert!(outcome.status.is_success(), "{algorithm}");
        assert!(outcome.summary.search.unwrap().miss_km.unwrap() < 50.0, "{algorithm}");
    }
}

#[test]
fn bad_values_are_refused_by_name() {
    let cases: &[(&[&str], &str)] = &[
        (&["target_altitude_km=-1"], "target_altitude_km"),
        (&["target_altitude_km=130"], "it must be below `entry_altitude_km`"),
        (&["initial_mass_kg=0"], "`initial_mass_kg` is 0"),
        (&["atmosphere=table"], "`atmosphere_table` has no row"),
        (&["atmosphere=table", "atmosphere_table=0 1 300"], "is not three numbers"),
        (&["atmosphere=table", "atmosphere_table=missing.csv"], "no such file"),
        (&["method=flatness"], "has no flat outputs"),
        (&["method=two-layer", "search.evaluations=0"], "search.evaluations"),
        (&["method=two-layer", "search.population=1"], "search.population"),
        (&["method=two-layer", "search.least_intervals=4"], "must not be above `search.most_intervals`"),
        (&["method=two-layer", "search.most_degree=0"], "must not be below `search.degree` = 1"),
        (&["method=two-layer", "search.most_degree=1.5"], "must be a whole number from 0 to 5"),
        (&["method=two-layer", "goal=peak-load"], "two-layer"),
        (&["body=venus"], "`body` is \"venus\", allowed is one of `earth`, `mars`"),
        (&["atmosphere=us-1976-printed", "entry_altitude_km=300"], "above the top of the atmosphere"),
    ];
    for (overrides, expected) in cases {
        let found = load("capsule-reentry", overrides).unwrap_err().to_string();
        assert!(found.contains(expected), "{overrides:?}: {found}");
    }
    let found = load("lunar-direct", &["method=two-layer"]).unwrap_err().to_string();
    assert!(found.contains("two-layer"), "{found}");
}

#[test]
fn mars_and_oblateness() {
    // A capsule of 3300 kg enters Mars at 5.6 km/s; no reference: it is feasible and the results are whole.
    let outcome = solve(
        "capsule-reentry",
        &[
            "body=mars",
            "heating=sutton-graves",
            "oblateness=true",
            "initial_mass_kg=3300",
            "reference_area_m2=15.9",
            "lift_coefficient=0.348",
            "drag_coefficient=1.45",
            "nose_radius_m=1.125",
            "entry_altitude_km=125",
            "entry_longitude_deg=0",
            "entry_latitude_deg=0",
            "entry_speed_m_s=5600",
            "entry_path_angle_deg=-14",
            "entry_azimuth_deg=0",
            "target_altitude_km=10",
            "target_longitude_deg=12",
            "target_latitude_deg=0.3",
            "load_limit_m_s2=inf",
            "margins=false",
        ],
    );
    assert!(outcome.status.is_success(), "{:?}", outcome.explanation);
    near(&outcome, "target_miss_km", 0.0, MARS_MISS_KM);
    assert!((1.0..100.0).contains(&outcome.summary.results["heat_load_mj_m2"]));
}
