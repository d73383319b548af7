//! Re-entry under profiles of the bank angle.

use apsides_nlp::Status;
use apsides_ocp::{Bounds, Ocp};
use apsides_ode::Method;
use apsides_radau::{Radau, RadauSettings};
use apsides_shooting::profile::{
    Flight, FlightEnd, FlightRules, FlightSettings, MAX_DEGREE, MeshWish, ProfileShape, ProfileShooting,
};

use crate::capsule::{TARGET, bank, energy, in_energy, in_time, ocp, score};

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Bank angle in degrees every 10 s from 0 to 560 s of the optimum with limits of 15 kPa, 40 m/s2, 800 kW/m2 (Radau collocation with 300
/// elements of degree 3 by CasADi and Ipopt).
const OPTIMUM: [f64; 57] = [
    6.349, 6.657, 7.031, 7.492, 8.044, 8.677, 9.486, 10.511, 11.817, 13.513, 15.805, 18.982, 23.506, 30.119,
    39.793, 53.027, 67.894, 79.473, 83.662, 79.363, 68.549, 56.875, 50.793, 57.126, 88.500, 59.518, 52.566,
    66.992, 38.630, 27.593, 22.786, 20.455, 19.278, 18.692, 18.415, 18.293, 18.232, 18.178, 18.105, 18.009,
    17.913, 17.862, 17.914, 18.131, 18.565, 19.241, 20.137, 21.173, 22.198, 22.997, 23.305, 22.885, 21.627,
    19.639, 17.199, 14.620, 12.135,
];

/// Published: the ratio of two printed peaks, Pa per m/s2.
const PEAK_RATIO: f64 = 0.01;

/// Discretisation: peaks between the steps of an integration at default settings, relative.
const PEAKS: f64 = 1e-3;

/// Discretisation: ends of a mesh in time against joints over energy, as parts of the range.
const JOINTS: f64 = 1e-5;

fn accurate(rules: FlightRules) -> FlightRules {
    let settings =
        FlightSettings { method: Method::Dop853, tolerance: 1e-11, samples: 20, ..FlightSettings::default() };
    FlightRules { settings, ..rules }
}

fn fly(ocp: &Ocp, rules: FlightRules, decision: &[f64]) -> Flight {
    ProfileShooting::new(ocp, rules).unwrap().flown(decision, Flight::clone).unwrap()
}

/// Three constants over the energy with free lengths, found by a search.
const CONSTANTS: [f64; 6] =
    [1.105_013_7, 0.598_629_337, 0.320_703_225, 0.332_065_481, 0.060_490_963, 0.265_620_25];

fn constants() -> ProfileShape {
    ProfileShape { free_lengths: true, ..ProfileShape::new(0, 3, bank()) }
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

/// The optimum's bank angle, joined by straight lines, leads near to the optimum: 122.9272 MJ/m2, 570.78 s, 228.6 m/s, -54.7 deg at the
/// target, 800 kW/m2 at 239.7 s, 40 m/s2 at 270.2 s. The lines miss the narrow peaks of the angle, worth 0.6 % and 20 km.
#[test]
fn bank_angle_of_the_optimum() {
    let ocp = ocp();
    let shape = ProfileShape { continuous: true, ..ProfileShape::new(1, 56, bank()) };
    let decision: Vec<f64> = OPTIMUM.iter().map(|b| b.to_radians()).chain([560.0]).collect();
    let flight = fly(&ocp, accurate(in_time(shape)), &decision);
    assert_eq!(flight.end, FlightEnd::Stopped);
    close(flight.objective, 122.9272e6, 0.8e6);
    close(flight.final_time, 570.78, 4.0);
    close(flight.final_state[0], TARGET[0], INTEGRATION);
    close(flight.final_state[3], 228.6, 0.3);
    close(flight.final_state[4].to_degrees(), -54.7, 0.1);
    let [pressure, acceleration, heat, ..] = flight.peaks[..] else { panic!("three path rows") };
    close(heat.value, 800e3, 2e3);
    close(heat.time, 239.7, 0.3);
    close(acceleration.value, 40.0, 1.0);
    close(acceleration.time, 270.2, 3.0);
    close(acceleration.relative, acceleration.value / 40.0 - 1.0, ROUNDING);
    // Both are proportional to density times the square of the speed.
    close(pressure.value / acceleration.value, 13_764.032 / 40.000_32, PEAK_RATIO);
    // 0.2 MJ/m2 per km, and 100 MJ/m2 per excess as large as the limit.
    let (longitude, latitude) = (flight.state_misses[1], flight.state_misses[2]);
    let distance = 6378.137 * latitude.hypot(longitude * TARGET[2].to_radians().cos());
    assert!((1.0..20.0).contains(&distance), "{distance}");
    let violation = 0.2e6 * distance + 100e6 * (acceleration.relative + heat.relative);
    close(score().violation(&flight), violation, 1.0);
}

/// Three constants cost less than 0.2 % more than the optimum, 122.9272 MJ/m2, of which they are no better. The best of 40 searches with
/// three constants by others has 123.167 MJ/m2.
#[test]
fn three_constants_in_energy() {
    let ocp = ocp();
    for rules in [in_energy(constants()), accurate(in_energy(constants()))] {
        let flight = fly(&ocp, rules, &CONSTANTS);
        let cost = score().penalised(&flight) / 1e6;
        assert!((122.9272..123.167).contains(&cost), "{cost}");
    }
}

/// Largest errors of default settings in heat load (relative), position (m), peaks (relative), for bank angles that fill a part of their
/// bounds.
fn errors(degree: usize, rules: fn(ProfileShape) -> FlightRules, part: f64) -> [f64; 3] {
    let ocp = ocp();
    let shape = ProfileShape { bounds: vec![Bounds::new(0.0, 1.5)], ..ProfileShape::new(degree, 3, bank()) };
    let shooting = ProfileShooting::new(&ocp, rules(shape)).unwrap();
    let exact = ProfileShooting::new(&ocp, accurate(shooting.rules().clone())).unwrap();
    let (lower, upper) = shooting.space();
    let mut errors = [0.0_f64; 3];
    for seed in 1..=5 {
        let at = |j: usize| 0.5 + part * ((f64::from(seed) * ((j + 2) as f64).sqrt()).fract() - 0.5);
        let ends = lower.iter().zip(upper).enumerate();
        let decision: Vec<f64> = ends.map(|(j, (a, b))| a + (b - a) * at(j)).collect();
        let flight = shooting.flown(&decision, Flight::clone).unwrap();
        let exact = exact.flown(&decision, Flight::clone).unwrap();
        assert_eq!((flight.end, exact.end), (FlightEnd::Stopped, FlightEnd::Stopped));
        let mut raise = |k: usize, error: f64| errors[k] = errors[k].max(error.abs());
        raise(0, flight.objective / exact.objective - 1.0);
        for k in 1..3 {
            raise(1, 6378e3 * (flight.final_state[k] - exact.final_state[k]));
        }
        for (a, b) in flight.peaks.iter().zip(&exact.peaks).take(3) {
            raise(2, a.value / b.value - 1.0);
        }
    }
    errors
}

/// Constants and straight lines have no kink but at the joints. Those of higher degree are cut off at the bounds where the values at
/// the nodes come near to them, which costs accuracy; the second derivative of their continuation beyond a joint jumps.
#[test]
fn accuracy_of_the_default_settings() {
    for degree in 0..=MAX_DEGREE {
        for rules in [in_energy, in_time] {
            for part in [0.5, 1.0] {
                let [load, position, peaks] = errors(degree, rules, part);
                let most = match (degree, part < 1.0) {
                    (0 | 1, _) => (5e-6, 10.0),
                    (_, true) => (5e-5, 150.0),
                    (_, false) => (5e-4, 1e3),
                };
                let found = format!("degree {degree}, {part}: {load:.1e}, {position:.1e} m, {peaks:.1e}");
                assert!(load < most.0 && position < most.1 && peaks < PEAKS, "{found}");
            }
        }
    }
}

#[test]
fn nothing_is_allocated_after_the_first_flight() {
    let ocp = ocp();
    for rules in [in_energy(constants()), in_time(constants())] {
        let shooting = ProfileShooting::new(&ocp, rules).unwrap();
        let (lower, upper) = shooting.space();
        let mut workspace = shooting.workspace().unwrap();
        let first = shooting.fly(lower, &mut workspace).unwrap().clone();
        let mut failed = lower.to_vec();
        failed[0] = f64::NAN;
        let score = score();
        let count = allocation_counter::measure(|| {
            for decision in [upper, &failed[..], lower] {
                let cost = score.penalised(shooting.fly(decision, &mut workspace).unwrap());
                assert!(cost > 0.0 || decision[0].is_nan());
            }
        });
        assert_eq!(count.count_total, 0);
        // The same flight again, whatever was flown between.
        assert_eq!(workspace.flight(), &first);
        shooting.flown(lower, |_| ()).unwrap();
        assert_eq!(allocation_counter::measure(|| shooting.flown(upper, |_| ()).unwrap()).count_total, 0);
    }
}

/// Threads share one object and get the flights that one thread gets.
#[test]
fn threads_fly_the_same() {
    let ocp = ocp();
    let shooting = ProfileShooting::new(&ocp, in_energy(constants())).unwrap();
    let decisions: Vec<Vec<f64>> =
        (0..8).map(|k| [&[0.2 * f64::from(k)], &CONSTANTS[1..]].concat()).collect();
    let objective = |d: &Vec<f64>| shooting.flown(d, |f| f.objective.to_bits()).unwrap();
    let alone: Vec<u64> = decisions.iter().map(objective).collect();
    let (first, second) = std::thread::scope(|scope| {
        let run = || scope.spawn(|| decisions.iter().map(objective).collect::<Vec<_>>());
        let (a, b) = (run(), run());
        (a.join().unwrap(), b.join().unwrap())
    });
    assert_eq!((&first, &second), (&alone, &alone));
}

/// The trajectory is the flight: states at the ends, controls of unit length that jump where the energy passes the joints.
#[test]
fn a_start_for_other_methods() {
    let ocp = ocp();
    let shooting = ProfileShooting::new(&ocp, in_energy(constants())).unwrap();
    let start = shooting.start(&CONSTANTS, MeshWish { intervals: 20, points: 4, joints: true }).unwrap();
    let (phase, flight) = (&start.trajectory.phases[0], &start.flight);
    start.guess.check(&ocp).unwrap();
    assert_eq!(shooting.flown(&CONSTANTS, Flight::clone).unwrap(), *flight);
    for k in 0..6 {
        close(phase.final_state()[k], flight.final_state[k], 1e-9 * flight.final_state[k].abs());
    }
    let profile = shooting.profile(&CONSTANTS).unwrap();
    let [e0, e1] = [energy(&flight.initial_state), energy(&[TARGET[0], 0.0, 0.0, 250.0])];
    let mesh = &start.mesh.phases[0];
    for joint in &profile.joints()[1..3] {
        let s = |t: &f64| (e0 - energy(&phase.state_at(*t))) / (e0 - e1);
        let ends = mesh.fractions().iter().map(|f| phase.time_at(*f));
        let nearest = ends.map(|t| (s(&t) - joint).abs()).fold(1.0, f64::min);
        assert!(nearest < JOINTS, "{nearest}");
    }
    for k in 0..=400 {
        let u = phase.control_at(phase.time_at(f64::from(k) / 400.0));
        close(u[0].hypot(u[1]), 1.0, ROUNDING);
        let bank = u[1].atan2(u[0]);
        assert!(CONSTANTS[..3].iter().any(|b| (b - bank).abs() < ROUNDING), "{bank}");
    }
}

/// The start leads collocation to the optimum: 122.9195 MJ/m2 on 40 elements of degree 3 (CasADi and Ipopt, in a median of 40 iterations
/// from starts that a search found). The joints make two intervals more.
#[test]
fn collocation_from_a_flight() {
    let ocp = ocp();
    let shooting = ProfileShooting::new(&ocp, in_energy(constants())).unwrap();
    let start = shooting.start(&CONSTANTS, MeshWish { intervals: 40, points: 3, joints: true }).unwrap();
    assert_eq!(start.mesh.phases[0].intervals(), 42);
    let radau = Radau { settings: RadauSettings { max_refinements: 0, ..RadauSettings::default() } };
    let solution = radau.solve_on(&ocp, &start.guess, start.mesh, &mut ()).unwrap();
    assert_eq!(solution.status, Status::Optimal);
    close(solution.trajectory.objective, 122.9195e6, 2e3);
    assert!(solution.report.counters.iterations <= 40, "{}", solution.report.counters.iterations);
}
