//! Closed-loop descents against the independent simulation of the reference, ends of flights by name, laws, margins.
#![allow(clippy::unwrap_used)]

use apsides_control::pid::PidGains;
use apsides_control::simulation::{Breach, Ending};
use apsides_dynamics::aerodynamics::Interpolation;

use super::simulation::simulate;
use super::{
    Allocation, Case, CaseSet, Descent, DescentDeviations, Descents, Earth, Law, LeastMargins, MassModel,
    Masses, Metrics, Record, RegulatorSizes, SlidingSizes, Tuning, case, tune,
};

/// Published: root mean squares of the reference, as its steps leave them, relative.
const PUBLISHED: f64 = 0.01;

/// Discretisation: root mean square of an angle that is held, deg, as samples and stops of the masses leave it.
const HELD_DEG: f64 = 0.01;

fn fly(case: &Case) -> Metrics {
    Descent::new(case).unwrap().fly(&mut Record::every(1)).unwrap()
}

fn pid(p: f64, i: f64, d: f64) -> Law {
    Law::pid(PidGains::new(p, i, d))
}

/// Offset of 1 cm in an eighth of a turn from y towards z.
fn towards(case: &Case, direction: u32) -> Case {
    let (sin, cos) = (f64::from(direction) * std::f64::consts::FRAC_PI_4).sin_cos();
    let mut case = case.clone();
    case.vehicle.offset = [0.01 * cos, 0.01 * sin];
    case
}

/// The worst root mean square of eight directions, deg.
fn worst_of_eight(case: &Case) -> f64 {
    (0..8).map(|d| fly(&towards(case, d)).worst_rms().to_degrees()).fold(0.0, f64::max)
}

/// `closed_loop_tuned`, `cross_fixed_gains` and `mass_scan_cross` of the reference: root mean squares, deg.
#[test]
fn root_mean_squares_of_the_reference() {
    let cross = |mass: f64, law: Law, vehicle: f64| {
        let mut case = Case { law, ..Case::cross(mass) };
        case.vehicle.mass = vehicle;
        case
    };
    let steep = || pid(30.0, 30.0, 10.0);
    for (what, case, expected) in [
        ("no law", cross(10.0, Law::None, 500.0), [2.0336743010710836, 2.0320474742734502]),
        ("(10, 5, 5)", cross(5.0, pid(10.0, 5.0, 5.0), 500.0), [0.5906, 0.5897]),
        (
            "tuned",
            cross(5.0, pid(0.7858760944091405, 0.35346145759918907, 8.46893493447689), 500.0),
            [0.58853, 0.58811],
        ),
        ("5 kg of 400", cross(5.0, steep(), 400.0), [0.24334787195388044, 0.24341138256473163]),
        ("5 kg of 500", cross(5.0, steep(), 500.0), [0.5976585362412664, 0.5959072819293849]),
        ("5 kg of 600", cross(5.0, steep(), 600.0), [0.8838451119182114, 0.8825377484186172]),
        ("5 kg of 700", cross(5.0, steep(), 700.0), [1.1108238118112643, 1.1096981057351252]),
        ("10 kg of 800", cross(10.0, steep(), 800.0), [0.29970789879352416, 0.2947296036138006]),
    ] {
        let found = fly(&case).window.unwrap().rms.map(f64::to_degrees);
        for (f, e) in found.iter().zip(expected) {
            assert!((f / e - 1.0).abs() < PUBLISHED, "{what}: {found:?} instead of {expected:?}");
        }
    }
    // Held to the last digits: the error follows the trim, which changes with the Mach number.
    for (case, expected) in [
        (Case::cross(10.0), 1.0036187403985346e-5),
        (Case { law: steep(), ..Case::cross(10.0) }, 1.7287920301794488e-6),
        (Case { law: steep(), ..Case::radial(10.0) }, 1.727e-6),
    ] {
        let found = fly(&case).window.unwrap().rms[0].to_degrees();
        assert!((found / expected - 1.0).abs() < PUBLISHED, "{found} instead of {expected}");
    }
}

#[test]
fn ten_kg_on_a_cross_and_five_on_a_rim_hold_all_directions() {
    let cross = worst_of_eight(&Case::cross(10.0));
    let rim = worst_of_eight(&Case::radial(5.0));
    assert!(cross < HELD_DEG && rim < HELD_DEG, "{cross} {rim}");
    // Five on a cross stand at their stops, but for offsets between the axes, 0.707 cm along each.
    let saturated = fly(&towards(&Case::cross(5.0), 0)).worst_rms().to_degrees();
    assert!((saturated / 0.589 - 1.0).abs() < PUBLISHED, "{saturated}");
    let between = fly(&towards(&Case::cross(5.0), 1)).worst_rms().to_degrees();
    assert!(between < 2.0 * HELD_DEG, "{between}");
    assert!(fly(&Case::cross(5.0)).saturated_time > 190.0);
}

/// The law on the angles themselves: swings of tens of degrees, or no control at all, in most directions.
#[test]
fn laws_on_the_angles_of_a_rim_fail() {
    for mass in [5.0, 10.0] {
        let mut case = Case::radial(mass);
        if let Masses::Radial { neutral, allocation, .. } = &mut case.masses {
            (*neutral, *allocation) = ([0.0, std::f64::consts::PI], Allocation::Angles);
        }
        let rms: Vec<f64> = (0..8).map(|d| fly(&towards(&case, d)).worst_rms().to_degrees()).collect();
        assert!(rms.iter().filter(|rms| **rms > 1.0).count() >= 5, "{rms:?}");
        // `radial_direct_linear`: 2.03 deg, as without a law.
        let nominal = fly(&case).worst_rms().to_degrees();
        assert!((nominal / 2.0336 - 1.0).abs() < PUBLISHED, "{nominal}");
    }
}

#[test]
fn flights_that_fail_say_why_and_when() {
    let mut fast = Case::cross(10.0);
    fast.entry.speed = 12e3;
    assert_eq!(fly(&fast).ending, Ending::Breach(Breach::TableLeft));
    // The capsule oscillates at 1 Hz.
    let mut slow = Case { law: Law::None, ..Case::cross(10.0) };
    slow.run.sample_time = 1.0;
    let ending = fly(&slow).ending;
    assert!(matches!(ending, Ending::StepTooLong { .. }), "{ending:?}");
    let mut driven = Case { law: pid(30.0, 30.0, 10.0), ..Case::cross(10.0) };
    driven.vehicle.damping = super::DampingSet::Unstable;
    driven.actuators.rate = Some(0.2);
    let found = fly(&driven);
    assert_eq!(found.ending, Ending::Breach(Breach::Tumbling));
    assert!(found.time > 40.0 && found.worst_rms() == f64::INFINITY && !found.held());
    // Masses of 10 deg that are driven to the same side.
    let mut rim = Case::radial(5.0);
    if let Masses::Radial { least_separation, allocation, .. } = &mut rim.masses {
        (*least_separation, *allocation) = (10_f64.to_radians(), Allocation::Angles);
    }
    rim.law = pid(10.0, 5.0, 5.0);
    assert_eq!(fly(&rim).ending, Ending::Breach(Breach::MassesMet));
}

/// Regulator and sliding mode hold all directions; so do PID gains with slow masses, noise and delay.
#[test]
fn other_laws_hold() {
    let regulator = RegulatorSizes {
        angle: 0.3_f64.to_radians(),
        rate: 3_f64.to_radians(),
        integral: 0.3_f64.to_radians(),
        travel: 0.2,
    };
    let sliding = SlidingSizes {
        bandwidth: 3.0,
        integral: 0.7,
        reaching: 0.2_f64.to_radians(),
        offset: 0.015,
        factor: 1.2,
        boundary: 8_f64.to_radians(),
    };
    for law in [Law::Regulator(regulator), Law::Sliding(sliding)] {
        for case in [Case::cross(10.0), Case::radial(10.0)] {
            let case = Case { law: law.clone(), ..case };
            let worst = worst_of_eight(&case);
            assert!(worst < HELD_DEG, "{law:?}: {worst}");
        }
    }
    let mut real =
        Case { law: pid(1.7249398417493524, 2.8545196158869044, 10.860345106216773), ..Case::cross(10.0) };
    real.actuators.rate = Some(0.2);
    let worst = worst_of_eight(&real);
    assert!(worst < HELD_DEG, "{worst}");
    let mut seen = real.clone();
    seen.sensors.angle_noise = 0.05_f64.to_radians();
    let noisy = fly(&seen);
    assert!(noisy.held() && noisy.worst_rms() > fly(&real).worst_rms(), "{noisy:?}");
    assert_eq!(noisy, fly(&seen));
    seen.sensors.seed = 1;
    assert_ne!(noisy.window, fly(&seen).window);
}

/// A loop with less delay than its margin at the largest dynamic pressure is held, one with more swings.
#[test]
fn delay_margins_are_those_of_flights() {
    let case = Case::cross(10.0);
    let descent = Descent::new(&case).unwrap();
    let mut record = Record::every(1);
    descent.fly(&mut record).unwrap();
    let rows = descent.margins(&record, &[25e3]).unwrap();
    let margin = rows[0].least()[2].unwrap();
    let late = |delay: f64| {
        let mut case = case.clone();
        case.actuators.delay = delay;
        let descent = Descent::new(&case).unwrap();
        let mut record = Record::every(1);
        descent.fly(&mut record).unwrap();
        // Rates near the largest dynamic pressure.
        let rates = |s: &apsides_control::record::Sample<13, 2>| s.state[11];
        record.statistics(rates, |s| -s.state[2], [24e3, 26e3]).unwrap().peak
    };
    let (before, beyond) = (late(0.7 * margin), late(1.6 * margin));
    assert!(before < 1e-3 && beyond > 0.1, "{margin}: {before} {beyond}");
}

#[test]
fn ground_and_table_change_little() {
    let nominal = fly(&Case::cross(5.0)).worst_rms();
    let mut round = Case::cross(5.0);
    round.earth = Earth::Ellipsoid;
    round.entry.azimuth = 1.0;
    let mut smooth = Case::cross(5.0);
    smooth.vehicle.interpolation = Interpolation::Smooth;
    let mut windy = Case::cross(5.0);
    windy.wind = [20.0, -10.0];
    for (what, case) in [("ellipsoid", round), ("smooth", smooth), ("wind", windy)] {
        let found = fly(&case);
        assert!((found.worst_rms() / nominal - 1.0).abs() < 0.2, "{what}: {found:?}");
    }
}

#[test]
fn impossible_cases_are_refused() {
    let refused = |change: fn(&mut Case)| {
        let mut case = Case::cross(10.0);
        change(&mut case);
        Descent::new(&case).unwrap_err().to_string()
    };
    assert!(refused(|c| c.vehicle.mass = 15.0).contains("mass without the moving masses"));
    assert!(refused(|c| c.run.sample_time = 0.0).contains("control step"));
    assert!(refused(|c| c.actuators.rate = Some(-1.0)).contains("rate of the actuator"));
    assert!(refused(|c| c.entry.attack = f64::NAN).contains("angle of attack"));
}

#[test]
fn dispersed_descents_do_not_depend_on_threads() {
    let mission = crate::registry().load("moving-mass-cross", &["angle_noise_deg=0.01".into()]).unwrap();
    let case = case(&mission).unwrap();
    let dispersions = DescentDeviations {
        offset_m: [0.003; 2],
        entry_angles_deg: [2.0; 2],
        path_angle_deg: 1.0,
        sensor_gain: 0.05,
        damping: 0.3,
        wind_m_s: [10.0; 2],
    };
    let fly = |threads| {
        let run = Descents { samples: 10, seed: 3, threads, dispersions };
        let mut seen = 0;
        let found = run.run(&case, Vec::new(), |sample| {
            assert_eq!(sample.index, seen);
            seen += 1;
            true
        });
        found.unwrap()
    };
    let (samples, statistics) = fly(1);
    assert_eq!((samples.clone(), statistics.clone()), fly(3));
    assert_eq!((statistics.samples, statistics.within_1_m), (10, None));
    assert!(samples.windows(2).all(|w| w[0].results != w[1].results));
    let optimised = crate::registry().load("capsule-reentry", &[]).unwrap();
    let refused = super::case(&optimised).unwrap_err().to_string();
    assert!(refused.contains("optimised, not simulated"), "{refused}");
}

/// Delays of many samples end in time: with the margins as long as these are found soon, with a sentence and the flight beyond.
#[test]
fn long_delays_keep_the_flight() {
    let delayed = |delay: f64| {
        let mut case = Case::cross(10.0);
        case.actuators.delay = delay;
        simulate(&case, &|_| true).unwrap()
    };
    // 50 samples.
    let flight = delayed(0.5);
    assert_eq!((flight.summary.status.as_str(), flight.summary.margins.len()), ("tumbling", 4));
    // 1000 samples.
    let flight = delayed(10.0);
    assert_eq!(flight.summary.status, "tumbling");
    assert!(flight.rows.len() > 1000 && flight.summary.margins.is_empty() && flight.root_locus.is_none());
    let said = flight.summary.warnings.iter().any(|w| {
        w.contains("are 1000 samples of the law") && w.contains("at most 64") && w.contains("`sample_time_s`")
    });
    assert!(said, "{:?}", flight.summary.warnings);
    let mut case = Case::cross(10.0);
    case.actuators.delay = 10.0;
    let refused = LeastMargins::of(&case, &[case.vehicle.damping], &mut Record::every(1)).unwrap_err();
    assert!(refused.to_string().contains("are 1000 samples"), "{refused}");
}

/// `masses = "full"` in a mission: simulated with a word on its margins, dispersed on any number of threads, tuned.
#[test]
fn missions_with_full_masses() {
    let load = |overrides: &[&str]| {
        let stated: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        crate::registry().load("moving-mass-cross", &stated).map(|mission| case(&mission).unwrap())
    };
    let quasi = load(&[]).unwrap();
    assert_eq!(quasi.mass_model, MassModel::QuasiStatic);
    let warned = |case: &Case| {
        let warnings = simulate(case, &|_| true).unwrap().summary.warnings;
        warnings.iter().any(|w| w.contains("those of quasi-static masses"))
    };
    assert!(!warned(&quasi));
    let slow = ["rate_limit_m_s=0.1", "pid.attack_p=0.02032", "pid.attack_i=0.7798", "pid.attack_d=2.361"];
    let sideslip = ["pid.sideslip_p=0.02032", "pid.sideslip_i=0.7798", "pid.sideslip_d=2.361"];
    let full = load(&[&["masses=full", "mass_station_m=0.2"][..], &slow, &sideslip].concat()).unwrap();
    assert_eq!(full.mass_model, MassModel::Full { station: 0.2 });
    let flight = simulate(&full, &|_| true).unwrap();
    assert_eq!(flight.summary.status, "completed");
    assert!(warned(&full));
    assert!(flight.summary.results["attack_rms_deg"] < 2.0 * HELD_DEG);
    let fly = |case: &Case, threads| {
        let dispersions = DescentDeviations { offset_m: [0.003; 2], ..DescentDeviations::default() };
        let run = Descents { samples: 4, seed: 3, threads, dispersions };
        run.run(case, Vec::new(), |_| true).unwrap().0
    };
    let still = Case { mass_model: MassModel::QuasiStatic, ..full.clone() };
    assert_eq!(fly(&full, 1), fly(&full, 3));
    assert_ne!(fly(&full, 1), fly(&still, 1));
    let alone = CaseSet { directions: 0, attacks: Vec::new(), ..CaseSet::around(&full) };
    let tuned = tune(&full, &Tuning { set: alone, evaluations: 1, ..Tuning::new(&full) }).unwrap();
    assert!(tuned.held(), "{tuned:?}");
    // 20 kg at 5 m have more inertia than the capsule.
    let refused = load(&["masses=full", "mass_station_m=5"]).map(|c| c.mass_model).unwrap_err().to_string();
    assert!(refused.contains("inertia"), "{refused}");
}
