//! Deviating flights of the whole landing, on maps of 400 m and 50 m.

use apsides_pipeline::dispersion::Replanning;
use apsides_pipeline::montecarlo::{MonteCarlo, Sample};
use apsides_pipeline::{Outcome, Pipeline};

use super::*;
use crate::deviating_flight::{COLUMNS as OF_BRAKING, LINEAR};
use crate::registry;

/// Discretisation: the ends of an undisturbed flight against those of collocation, m and m/s.
const END: [f64; 2] = [0.05, 0.005];
/// Free fall from 4 m: sqrt(2 mu (1/r - 1/(r + 4))) at 1737.013 km less the height of the site, m/s (truth.json of the reference: 3.6055).
const TOUCHDOWN_M_S: f64 = 3.6055;
/// The same at the height of other sites, m/s.
const OTHER_HEIGHT_M_S: f64 = 1e-3;
/// Discretisation: difference quotients of flights against the transition matrix, relative, and m or m/s.
const LINEARISED: [f64; 2] = [1e-4, 1e-7];
/// Touchdown speeds of steered flights beside that of the plan, m/s: commands are held for 0.2 s, new plans take gravity as uniform.
const STEERED_M_S: f64 = 0.5;

fn planned(overrides: &[&str]) -> (Pipeline, Outcome) {
    let small = ["terrain.coarse_width_m=400", "terrain.fine_width_m=50", "terrain.candidates=8"];
    let overrides: Vec<String> = small.iter().chain(overrides).map(|o| (*o).to_owned()).collect();
    let mission = registry().load("chang-e-3", &overrides).unwrap();
    let plan = mission.solve(None, &mut ()).unwrap();
    assert!(plan.status.is_success());
    (mission, plan)
}

fn flights(mission: &Pipeline, plan: &Outcome) -> Box<dyn Dispersed> {
    let decided = mission.decided(&plan.decisions).unwrap();
    decided.mission().dispersed(&plan.trajectory).unwrap().unwrap()
}

fn of(results: &[f64], name: &str) -> f64 {
    results[COLUMNS.iter().position(|c| *c == name).unwrap()]
}

fn deviations() -> Deviations {
    Deviations { position_m: [1000.0 / 3.0; 3], velocity_m_s: [1.0; 3], ..Deviations::default() }
}

fn replanned(at_s: Vec<f64>, every_s: Option<f64>) -> Guidance {
    Guidance::Replanned(Replanning { at_s, every_s })
}

#[test]
fn columns_begin_with_those_of_the_braking() {
    assert_eq!(COLUMNS[..OF_BRAKING.len()], *OF_BRAKING);
    let of_stages = COLUMNS.len() - OF_A_STAGE * (STAGES.len() - 1);
    for (k, name) in STAGES[..STAGES.len() - 1].iter().enumerate() {
        let first = COLUMNS[of_stages + OF_A_STAGE * k];
        assert_eq!(first, format!("{}_up_m", name.replace('-', "_")));
    }
}

/// Each stage of an undisturbed flight in open loop ends at its gate, and the touchdown is that of the plan.
#[test]
fn an_undisturbed_flight_passes_all_gates() {
    let (mission, plan) = planned(&[]);
    let flights = flights(&mission, &plan);
    let fly =
        |guidance: &Guidance| flights.fly(&Deviations::default(), guidance, &Onboard::default()).unwrap();
    let open = fly(&Guidance::OpenLoop);
    assert_eq!((open.len(), of(&open, "success"), of(&open, "stages_flown")), (COLUMNS.len(), 1.0, 6.0));
    for (name, value) in COLUMNS.iter().zip(&open) {
        let tolerance = if name.ends_with("m_s") { END[1] } else { END[0] };
        let is_miss = ["_up_m", "_aside_m", "_speed_m_s"].iter().any(|end| name.ends_with(end));
        if is_miss && !name.starts_with("touchdown") || *name == "site_distance_m" {
            assert!(value.abs() < tolerance, "{name}: {value}");
        }
    }
    assert!((of(&open, "touchdown_speed_m_s") - TOUCHDOWN_M_S).abs() < END[1] + OTHER_HEIGHT_M_S, "{open:?}");
    let propellant = plan.summary.results["propellant_kg"];
    assert!((of(&open, "propellant_kg") - propellant).abs() < END[0]);
    // Steered flights pass them, too, with little more propellant.
    for guidance in [Guidance::Polynomial, replanned(vec![0.0], None)] {
        let steered = fly(&guidance);
        assert_eq!(of(&steered, "success"), 1.0, "{guidance:?} {steered:?}");
        assert!((of(&steered, "touchdown_speed_m_s") - TOUCHDOWN_M_S).abs() < STEERED_M_S, "{steered:?}");
        // A new plan may lean to fall faster, which the plan of the mission must not; the law brakes with a part of the thrust.
        let more = of(&steered, "propellant_kg") - propellant;
        assert!((-2.0..10.0).contains(&more), "{guidance:?} {more}");
    }
}

/// With 1 km and 3 m/s (3 sigma) at the start all steered flights land on the site; in open loop none does.
#[test]
fn steered_flights_land_on_the_site_and_others_do_not() {
    let (mission, plan) = planned(&[]);
    let fly = |guidance: Guidance| {
        let run = MonteCarlo {
            samples: 12,
            seed: 2,
            threads: 2,
            dispersions: deviations(),
            guidance,
            onboard: Onboard::default(),
        };
        run.run(&mission, &plan, Vec::new(), |_| true).unwrap().0
    };
    let successes = |samples: &[Sample]| samples.iter().map(|s| of(&s.results, "success")).sum::<f64>();
    for guidance in [Guidance::Polynomial, replanned(vec![0.0], None), replanned(vec![0.0], Some(10.0))] {
        let samples = fly(guidance.clone());
        assert_eq!(successes(&samples), 12.0, "{guidance:?} {samples:?}");
        for s in &samples {
            assert!(of(&s.results, "site_distance_m") < 2.5, "{guidance:?} {s:?}");
            assert!(of(&s.results, "touchdown_speed_m_s") < 1.2 * TOUCHDOWN_M_S, "{guidance:?} {s:?}");
        }
    }
    let open = fly(Guidance::OpenLoop);
    assert_eq!(successes(&open), 0.0);
    // A flight that comes in too low ends on the ground, 4 m below the cut-off, before its last gate.
    assert!(open.iter().all(|s| s.results.iter().all(|v| v.is_finite())), "{open:?}");
    let early = open.iter().filter(|s| of(&s.results, "stages_flown") < 6.0);
    assert!(early.clone().count() > 0);
    for s in early {
        assert!((of(&s.results, "up_m") + 4.0).abs() < END[1], "{s:?}");
    }
}

#[test]
fn samples_are_the_same_for_any_number_of_threads_and_as_parts() {
    let (mission, plan) = planned(&[]);
    for guidance in [Guidance::OpenLoop, Guidance::Polynomial, replanned(vec![0.0], None)] {
        let run = |threads| MonteCarlo {
            samples: 6,
            seed: 5,
            threads,
            dispersions: deviations(),
            guidance: guidance.clone(),
            onboard: Onboard::default(),
        };
        let fly = |threads, indices| {
            let mut samples = Vec::new();
            run(threads)
                .fly(&mission, &plan, indices, |sample| {
                    samples.push(sample);
                    true
                })
                .unwrap();
            samples
        };
        let whole = fly(1, 0..6);
        let parts = [fly(2, 0..2), fly(3, 2..6)].concat();
        assert_eq!(whole, parts, "{guidance:?}");
    }
}

/// The covariance by the matrix is that of difference quotients of flights in open loop, as long as the ground is far.
#[test]
fn the_matrix_is_that_of_flights() {
    let (mission, plan) = planned(&["cutoff_altitude_m=20"]);
    let flights = flights(&mission, &plan);
    let small = [
        Deviations { position_m: [0.0, 1.0, 0.0], ..Deviations::default() },
        Deviations { velocity_m_s: [1e-3, 0.0, 0.0], ..Deviations::default() },
        Deviations { exhaust_velocity: 1e-6, ..Deviations::default() },
    ];
    for d in small {
        let minus = Deviations {
            position_m: d.position_m.map(|c| -c),
            velocity_m_s: d.velocity_m_s.map(|c| -c),
            exhaust_velocity: -d.exhaust_velocity,
            ..d
        };
        let [above, below] =
            [d, minus].map(|d| flights.fly(&d, &Guidance::OpenLoop, &Onboard::default()).unwrap());
        let covariance = flights.linear_covariance(&d).unwrap();
        for k in 0..LINEAR {
            let (slope, sigma) = (0.5 * (above[k] - below[k]).abs(), covariance[k * (LINEAR + 1)].sqrt());
            assert!((slope - sigma).abs() < LINEARISED[0] * sigma + LINEARISED[1], "{k}: {slope} {sigma}");
        }
    }
}

/// An engine with half of its thrust, one that uses its propellant up, and a lander without mass are outcomes; missions that cannot be flown so
/// are refused.
#[test]
fn what_cannot_land_is_an_outcome() {
    let (mission, plan) = planned(&[]);
    let flights = flights(&mission, &plan);
    for guidance in [Guidance::OpenLoop, Guidance::Polynomial, replanned(vec![0.0], None)] {
        let weak = Deviations { thrust: -0.5, ..Deviations::default() };
        if let Some(results) = flights.fly(&weak, &guidance, &Onboard::default()) {
            assert_eq!(of(&results, "success"), 0.0, "{guidance:?}");
            assert!(results.iter().all(|v| v.is_finite()), "{guidance:?} {results:?}");
        }
        let empty = Deviations { mass_kg: -2400.0, ..Deviations::default() };
        assert_eq!(flights.fly(&empty, &guidance, &Onboard::default()), None);
    }
    let planar = ["motion=plane".to_owned()];
    let mission = registry().load("chang-e-3-flat", &planar).unwrap();
    let plan = mission.solve(None, &mut ()).unwrap();
    let refused = mission.mission().dispersed(&plan.trajectory).err().unwrap().to_string();
    assert!(refused.contains("Monte Carlo needs `motion` = \"space\""), "{refused}");
}
