//! Full masses: what free flight keeps, the recoil in closed form, and what is left of it for small masses.
#![allow(clippy::unwrap_used)]

use apsides_ad::vector::{cross, dot};
use apsides_control::controller::Actuation;
use apsides_dynamics::attitude;

use super::super::{Case, Descent, Law, MassModel, Masses, Record};
use super::{MovedDrives, motion};
use crate::moving_mass::case::ActuatorLimits;
use crate::moving_mass::drives::Drives;
use crate::moving_mass::state::BodyState;

/// Discretisation: angular momentum and angle after two minutes, relative.
const INTEGRATION: f64 = 1e-7;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Differences that are linear in a small number, relative.
const LINEAR: f64 = 0.05;

/// The same of speeds and accelerations, which are differences over a sample.
const ROUNDING_OF_RATES: f64 = 1e-9;

/// Out of the air: from 900 to 810 km. Steps of 1 ms: where a drive starts or stops within a sample, one step of 10 ms leaves 1e-6.
fn above_the_air(mut case: Case) -> Case {
    case.mass_model = MassModel::Full { station: 0.3 };
    case.vehicle.offset = [0.01, -0.02];
    case.entry.altitude = 900e3;
    case.run.stop_altitude = 810e3;
    case.run.window = [810e3, 900e3];
    case.run.substeps = 10;
    case.run.tumbling = 179_f64.to_radians();
    case
}

/// Masses that a law drives to and fro for two minutes: the angular momentum about the common centre of mass stays in all components, that of
/// the capsule alone does not.
#[test]
fn angular_momentum_stays_without_air() {
    for case in [Case::cross(10.0), Case::radial(10.0)] {
        let mut case = above_the_air(case);
        case.entry.spin = [0.3, 0.02, -0.01];
        case.actuators = ActuatorLimits { rate: Some(0.8), acceleration: Some(4.0), ..ActuatorLimits::IDEAL };
        let descent = Descent::new(&case).unwrap();
        let mut record = Record::every(1);
        let metrics = descent.fly(&mut record).unwrap();
        assert!(metrics.held() && metrics.largest_travel.iter().all(|way| *way > 0.5), "{metrics:?}");
        let vehicle = descent.vehicle();
        let (mut momenta, mut of_capsule) = (Vec::new(), Vec::new());
        let samples = record.samples();
        for k in (1..samples.len() - 1).step_by(50) {
            let (before, now) = (&samples[k - 1], &samples[k]);
            let state = BodyState::of(&now.state);
            let inertia = vehicle.inertia(now.control);
            let mut momentum: [f64; 3] = std::array::from_fn(|i| dot(&inertia[i], &state.spin));
            let capsule = momentum;
            let centre = vehicle.centre(&now.control);
            // Positions of two samples tell the speeds at the later one.
            let speeds = [0, 1].map(|i: usize| (now.control[i] - before.control[i]) / case.run.sample_time);
            for i in 0..2 {
                let (place, speed) = match case.masses {
                    Masses::Cross { .. } => {
                        let along = |value: f64| if i == 0 { [0.0, value, 0.0] } else { [0.0, 0.0, value] };
                        (along(now.control[i]), along(speeds[i]))
                    }
                    Masses::Radial { radius, .. } => {
                        let (sin, cos) = now.control[i].sin_cos();
                        let along = radius * speeds[i];
                        ([0.0, radius * sin, radius * cos], [0.0, along * cos, -along * sin])
                    }
                };
                let from_centre = [0.3 - centre[0], place[1] - centre[1], place[2] - centre[2]];
                let carried = cross(&from_centre, &speed);
                (0..3).for_each(|j| momentum[j] += 10.0 * carried[j]);
            }
            let axes = attitude::rotation(&state.attitude);
            momenta.push(attitude::turned(&axes, &momentum));
            of_capsule.push(attitude::turned(&axes, &capsule));
        }
        let size = dot(&momenta[0], &momenta[0]).sqrt();
        let drift = |of: &[[f64; 3]]| {
            let changes = of.iter().flat_map(|m| (0..3).map(|k| (m[k] - of[0][k]).abs() / size));
            changes.fold(0.0, f64::max)
        };
        let (kept, changed) = (drift(&momenta), drift(&of_capsule));
        assert!(kept < INTEGRATION && changed > 1e4 * INTEGRATION, "{:?}: {kept} {changed}", case.masses);
    }
}

/// A mass that runs across a capsule at rest, `b` ahead of its centre of mass, turns it by `m b / sqrt(J k) atan(z sqrt(k / J))` with
/// `k = m (1 - m / M)`, whatever its speed: `(J + k z^2) w = m b z'`.
#[test]
fn the_recoil_of_a_mass_in_closed_form() {
    for rate in [0.1, 1.0, 20.0] {
        let mut case = above_the_air(Case::cross(10.0));
        case.vehicle.offset = [0.0; 2];
        (case.entry.attack, case.entry.sideslip) = (0.1, 0.0);
        case.actuators.rate = Some(rate);
        // A command far beyond the travel from the first sample on: the mass on z goes to its stop and stays.
        case.law = Law::pid(apsides_control::pid::PidGains::new(1e3, 0.0, 0.0));
        case.run.stop_altitude = 893e3;
        // A start or stop at 20 m/s within a sample takes finer steps yet.
        case.run.substeps = 100;
        let descent = Descent::new(&case).unwrap();
        let mut record = Record::every(1);
        let metrics = descent.fly(&mut record).unwrap();
        assert!(metrics.held(), "{metrics:?}");
        let last = record.samples().last().unwrap();
        let z = last.control[1];
        assert!((z.abs() - 0.7).abs() < ROUNDING && last.control[0].abs() < ROUNDING, "{:?}", last.control);
        let (mass, total, station) = (10.0_f64, 500.0, 0.3);
        let (inertia, k) = (total * 0.4128_f64.powi(2), mass * (1.0 - mass / total));
        let expected = mass * station / (inertia * k).sqrt() * (z * (k / inertia).sqrt()).atan();
        let (start, end) = (BodyState::of(descent.start()).attitude, BodyState::of(&last.state).attitude);
        let back = [start[0], -start[1], -start[2], -start[3]];
        let [w, _, y, _] = attitude::product(&back, &end);
        let turned = 2.0 * y.atan2(w);
        println!("{rate}: {turned} {expected}");
        assert!((turned / expected - 1.0).abs() < INTEGRATION, "{rate}: {turned} instead of {expected}");
        let [_, pitch_rate, _] = BodyState::of(&last.state).spin;
        assert!(pitch_rate.abs() < INTEGRATION, "{pitch_rate}");
    }
}

/// Largest difference of both angles between the models over a descent, rad.
fn difference(case: &Case, station: f64) -> f64 {
    let fly = |mass_model: MassModel| {
        let descent = Descent::new(&Case { mass_model, ..case.clone() }).unwrap();
        let mut record = Record::every(1);
        assert!(descent.fly(&mut record).unwrap().held());
        record.samples().iter().map(|s| (s.time, descent.angles(&s.state).1)).collect::<Vec<_>>()
    };
    let pair = [fly(MassModel::QuasiStatic), fly(MassModel::Full { station })];
    let both = pair[0].iter().zip(&pair[1]).filter(|(a, b)| a.0 == b.0);
    both.flat_map(|((_, a), (_, b))| [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()]).fold(0.0, f64::max)
}

/// The models are one in the limit of small masses, and differ in proportion to small ones.
#[test]
fn small_masses_are_quasi_static() {
    let with = |mass: f64| {
        let mut case = Case::cross(mass);
        case.actuators = ActuatorLimits { rate: Some(0.5), acceleration: Some(2.0), ..ActuatorLimits::IDEAL };
        difference(&case, 0.2)
    };
    let found = [1.0, 0.01, 1e-3, 1e-9].map(with);
    println!("{found:?}");
    assert!((found[1] / found[2] / 10.0 - 1.0).abs() < LINEAR, "{found:?}");
    assert!(found[0] > 1e-4 && found[3] < 1e3 * ROUNDING, "{found:?}");
}

/// Positions, speeds and their ends: continuous from stroke to stroke, where the drives are at the samples.
#[test]
fn strokes_meet() {
    let step = 0.01;
    let limits = ActuatorLimits { rate: Some(1.0), acceleration: Some(10.0), ..ActuatorLimits::IDEAL };
    let masses = Masses::Cross { mass: 10.0, travel: [-0.7, 0.7] };
    let mut drives = MovedDrives::new(Drives::new(&masses, &limits, step).unwrap(), step);
    let mut alone = Drives::new(&masses, &limits, step).unwrap();
    let mut before = [0.0; 6];
    for k in 0..300 {
        let t = step * f64::from(k);
        let command = [(3.0 * t).sin(), 2.0 * (1.7 * t).cos()];
        let stroke = drives.advance(&[command[0], command[1], 0.0, 0.0, 0.0, 0.0, t]);
        let reached = alone.advance(&command);
        let (start, end) = (motion(t, &stroke, step), motion(t + step, &stroke, step));
        for i in 0..4 {
            assert!((start[i] - before[i]).abs() < ROUNDING_OF_RATES, "{k} {i}: {start:?} {before:?}");
        }
        for i in 0..2 {
            assert!((end[i] - reached[i]).abs() < ROUNDING && end[i].abs() < 0.7 + ROUNDING);
            assert!(start[4 + i].abs() <= 40.0 + ROUNDING_OF_RATES, "{start:?}");
        }
        before = end;
    }
}
