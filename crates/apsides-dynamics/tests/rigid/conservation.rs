//! Free flight keeps momentum, angular momentum and energy, with masses that move, and symmetry.

use apsides_ad::Dynamics;
use apsides_ad::vector::{cross, dot};
use apsides_dynamics::aerodynamics::{Damping, Interpolation};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Start};
use apsides_dynamics::{Atmosphere, Ellipsoid, MovingMassVehicle, attitude};
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};

use crate::{DEG, ENTRY, INERTIA, capsule, flat, step};

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-10;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-13;

const STATION: f64 = 0.2;
const MASSES: [f64; 2] = [10.0, 7.0];
const OFFSET: [f64; 2] = [0.01, -0.02];

/// Tumbling.
const SPIN: [f64; 3] = [0.3, -0.8, 0.5];

fn vehicle(ground: Ground, atmosphere: Atmosphere, layout: Layout) -> MovingMassVehicle {
    let body = capsule(ground, atmosphere, Interpolation::Smooth, Damping::constant(), OFFSET).unwrap();
    MovingMassVehicle::new(body, layout, MASSES, STATION).unwrap()
}

/// The end of a flight in which the last number is added to the rates of the 13 states.
fn fly(
    vehicle: &MovingMassVehicle,
    start: &[f64; 13],
    duration: f64,
    control: impl Fn(f64) -> [f64; 6],
) -> [f64; 14] {
    let system = FnSystem::new(14, |t, x: &[f64], dx: &mut [f64]| {
        let state: [f64; 13] = x[..13].try_into().unwrap();
        let u = control(t);
        dx[..13].copy_from_slice(&Dynamics::<13, 6>::rate(vehicle, t, &state, &u, &[]));
        dx[13] = vehicle.actuator_power(&state, &u);
    });
    let sizes = [1e5, 1e5, 1e5, 1e3, 1e3, 1e3, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 10.0];
    let settings = OdeSettings {
        relative_tolerance: 1e-13,
        absolute_tolerance: Tolerance::PerComponent(sizes.iter().map(|s| 1e-14 * s).collect()),
        ..OdeSettings::default()
    };
    let from: Vec<f64> = start.iter().copied().chain([0.0]).collect();
    let mut end = [0.0; 14];
    let summary =
        Integrator::new(14, settings).unwrap().integrate(&system, 0.0, &from, duration, &mut end).unwrap();
    assert_eq!(summary.status, Status::Completed);
    end
}

/// Masses that swing at frequencies of their own.
fn swing(layout: Layout, t: f64) -> [f64; 6] {
    let size = if matches!(layout, Layout::Cross { .. }) { 0.6 } else { 2.0 };
    let one = |w: f64, phase: f64| {
        let (sin, cos) = (w * t + phase).sin_cos();
        [size * sin, size * w * cos, -size * w * w * sin]
    };
    let ([a, b, c], [d, e, f]) = (one(1.7, 0.2), one(2.3, 1.1));
    [a, d, b, e, c, f]
}

/// Places of the masses with their speeds in body axes, written anew.
fn places(layout: Layout, u: &[f64; 6]) -> [[[f64; 3]; 2]; 2] {
    match layout {
        Layout::Cross { .. } => {
            [[[STATION, u[0], 0.0], [0.0, u[2], 0.0]], [[STATION, 0.0, u[1]], [0.0, 0.0, u[3]]]]
        }
        Layout::Radial { radius } => [0, 1].map(|k| {
            let (sin, cos) = u[k].sin_cos();
            [[STATION, radius * sin, radius * cos], [0.0, radius * cos * u[k + 2], -radius * sin * u[k + 2]]]
        }),
    }
}

/// Angular momentum about the centre of mass in the axes of the ground, and kinetic energy relative to it, as the sum over the body without
/// masses and the two masses.
fn sums(layout: Layout, x: &[f64], u: &[f64; 6]) -> ([f64; 3], f64) {
    let spin = [x[10], x[11], x[12]];
    let masses = places(layout, u);
    let rest = 500.0 - MASSES[0] - MASSES[1];
    // With the masses on the axis the whole has its centre at the offset and the given inertia about it.
    let whole = [0.0, OFFSET[0], OFFSET[1]];
    let axis = [STATION, 0.0, 0.0];
    let own: [f64; 3] = [0, 1, 2].map(|k| (500.0 * whole[k] - (500.0 - rest) * axis[k]) / rest);
    let point =
        |mass: f64, s: [f64; 3], v: [f64; 3]| (cross(&s, &v).map(|c| mass * c), 0.5 * mass * dot(&v, &v));
    let minus = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { [0, 1, 2].map(|k| a[k] - b[k]) };
    let centre: [f64; 3] = [0, 1, 2]
        .map(|k| (rest * own[k] + MASSES[0] * masses[0][0][k] + MASSES[1] * masses[1][0][k]) / 500.0);
    let drift: [f64; 3] =
        [0, 1, 2].map(|k| (MASSES[0] * masses[0][1][k] + MASSES[1] * masses[1][1][k]) / 500.0);
    // The rest's own inertia: that of the whole less what its parts have about the whole's centre, by their spin.
    let turning = |s: [f64; 3]| cross(&s, &cross(&spin, &s));
    let parts = [(rest, minus(own, whole)), (500.0 - rest, minus(axis, whole))];
    let mut momentum: [f64; 3] =
        [0, 1, 2].map(|k| INERTIA[k] * spin[k] - parts.iter().map(|(m, s)| m * turning(*s)[k]).sum::<f64>());
    let mut energy = 0.5 * dot(&spin, &momentum);
    let s = minus(own, centre);
    let moving: [f64; 3] = minus(cross(&spin, &s), drift);
    let mut add = |(h, e): ([f64; 3], f64)| {
        momentum = [0, 1, 2].map(|k| momentum[k] + h[k]);
        energy += e;
    };
    add(point(rest, s, moving));
    for (mass, [place, speed]) in MASSES.iter().zip(masses) {
        let s = minus(place, centre);
        let carried = cross(&spin, &s);
        add(point(*mass, s, [0, 1, 2].map(|k| carried[k] + speed[k] - drift[k])));
    }
    (attitude::turned(&attitude::rotation(&[x[6], x[7], x[8], x[9]]), &momentum), energy)
}

/// 60 s in vacuum: the angular momentum stays in all components, the energy is that of the start and the work of the actuators, both to 1e-10;
/// the centre of mass falls as a point.
#[test]
fn moving_masses_in_vacuum() {
    let ground = Ground::Flat(FlatEarth::uniform(9.8).unwrap());
    for layout in [Layout::CROSS, Layout::RADIAL] {
        let vehicle = vehicle(ground, Atmosphere::Vacuum, layout);
        let start = ground.state(&Start { spin: SPIN, ..ENTRY }).unwrap();
        let end = fly(&vehicle, &start, 60.0, |t| swing(layout, t));
        let (before, kinetic) = sums(layout, &start, &swing(layout, 0.0));
        let (after, later) = sums(layout, &end, &swing(layout, 60.0));
        let size = dot(&before, &before).sqrt();
        let errors = [0, 1, 2].map(|k| (after[k] - before[k]) / size);
        let energy = (later - end[13] - kinetic) / kinetic;
        println!("{layout:?}: momentum {errors:?}, energy {energy:.1e}, work {} of {kinetic} J", end[13]);
        assert!(errors.iter().all(|e| e.abs() < INTEGRATION), "{errors:?}");
        assert!(energy.abs() < INTEGRATION && end[13].abs() > 0.01 * kinetic, "{energy}");
        let fallen = start[2] + 60.0 * start[5] + 0.5 * 9.8 * 3600.0;
        assert!(
            (end[2] - fallen).abs() < 1e3 * INTEGRATION && (end[5] - start[5] - 588.0).abs() < INTEGRATION
        );
    }
}

/// Locked off the axis, where products of inertia are largest: no work, and the energy stays.
#[test]
fn locked_masses_in_vacuum() {
    let ground = Ground::Flat(FlatEarth::uniform(0.0).unwrap());
    for (layout, at) in [(Layout::CROSS, [0.7, -0.5]), (Layout::RADIAL, [0.4, 1.3])] {
        let vehicle = vehicle(ground, Atmosphere::Vacuum, layout);
        let start = ground.state(&Start { spin: SPIN, ..ENTRY }).unwrap();
        let u = [at[0], at[1], 0.0, 0.0, 0.0, 0.0];
        let end = fly(&vehicle, &start, 60.0, |_| u);
        let ((before, kinetic), (after, later)) = (sums(layout, &start, &u), sums(layout, &end, &u));
        assert!((later / kinetic - 1.0).abs() < INTEGRATION && end[13] == 0.0);
        let size = dot(&before, &before).sqrt();
        assert!((0..3).all(|k| (after[k] - before[k]).abs() < INTEGRATION * size));
        // The energy by the inertia of the whole.
        let inertia = vehicle.inertia(at);
        let turned = inertia.map(|row| dot(&row, &SPIN));
        assert!((0.5 * dot(&SPIN, &turned) / kinetic - 1.0).abs() < ROUNDING);
    }
}

/// Without a motion of the masses and with masses on the axis both models are the rigid body.
#[test]
fn both_models_are_one_at_rest_on_the_axis() {
    let vehicle = vehicle(flat(), Atmosphere::UsStandard1976, Layout::CROSS);
    let x = flat().state(&Start { altitude: 30e3, spin: SPIN, ..ENTRY }).unwrap();
    let body = vehicle.body().rate(0.0, &x, &[], &[]);
    let quasi = Dynamics::<13, 2>::rate(&vehicle, 0.0, &x, &[0.0; 2], &[]);
    let full = Dynamics::<13, 6>::rate(&vehicle, 0.0, &x, &[0.0; 6], &[]);
    for k in 0..13 {
        assert!(
            (body[k] - quasi[k]).abs() < ROUNDING
                && (body[k] - full[k]).abs() < 10.0 * ROUNDING * (1.0 + body[k].abs())
        );
    }
    // Off the axis forces agree, and moments but for the inertia.
    let quasi = Dynamics::<13, 2>::rate(&vehicle, 0.0, &x, &[0.5, -0.2], &[]);
    let full = Dynamics::<13, 6>::rate(&vehicle, 0.0, &x, &[0.5, -0.2, 0.0, 0.0, 0.0, 0.0], &[]);
    assert_eq!(quasi[..10], full[..10]);
    assert!((10..13).any(|k| (quasi[k] - full[k]).abs() > 1e-4));
}

/// Around the rotating ellipsoid: energy with the centrifugal potential, energy in inertial axes, angular momentum about the axis of the Earth,
/// and the rotation, over two hours.
#[test]
fn orbit_of_the_ellipsoid() {
    let earth = Ellipsoid::WGS84;
    let ground = Ground::Ellipsoid(earth);
    let vehicle = vehicle(ground, Atmosphere::Vacuum, Layout::CROSS);
    let start =
        Start { altitude: 400e3, speed: 7400.0, path: 3.0 * DEG, azimuth: 50.0 * DEG, spin: SPIN, ..ENTRY };
    let start = ground.state(&start).unwrap();
    let u = [0.3, 0.1, 0.0, 0.0, 0.0, 0.0];
    let duration = 7200.0;
    let end = fly(&vehicle, &start, duration, |_| u);
    let kept = |x: &[f64]| {
        let (r, v) = ([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        // Relative to inertial axes that lie along those of the ground.
        let carried = cross(&[0.0, 0.0, earth.rotation_rate], &r);
        let w: [f64; 3] = std::array::from_fn(|k| v[k] + carried[k]);
        [ground.energy(r, v), 0.5 * dot(&w, &w) - earth.potential(r), r[0] * w[1] - r[1] * w[0]]
    };
    for (before, after) in kept(&start).iter().zip(kept(&end)) {
        println!("{before} {:.1e}", after / before - 1.0);
        assert!((after / before - 1.0).abs() < INTEGRATION, "{before} {after}");
    }
    let ((before, kinetic), (after, later)) =
        (sums(Layout::CROSS, &start, &u), sums(Layout::CROSS, &end, &u));
    // The axes of the Earth have turned.
    let (sin, cos) = (earth.rotation_rate * duration).sin_cos();
    let after = [cos * after[0] - sin * after[1], sin * after[0] + cos * after[1], after[2]];
    let size = dot(&before, &before).sqrt();
    assert!((0..3).all(|k| (after[k] - before[k]).abs() < 10.0 * INTEGRATION * size), "{before:?} {after:?}");
    assert!((later / kinetic - 1.0).abs() < 10.0 * INTEGRATION);
}

/// The body rolled by a right angle with its centre of mass turned back by it flies the same path.
#[test]
fn no_direction_across_the_axis_is_special() {
    let [y, z] = [0.01, 0.004];
    let body = |offset| {
        capsule(flat(), Atmosphere::UsStandard1976, Interpolation::Smooth, Damping::constant(), offset)
            .unwrap()
    };
    let (one, other) = (body([y, z]), body([z, -y]));
    let mut a = flat().state(&Start { altitude: 40e3, ..ENTRY }).unwrap();
    let mut b = a;
    let roll = attitude::product(&[a[6], a[7], a[8], a[9]], &attitude::about(0, 90.0 * DEG));
    b[6..10].copy_from_slice(&roll);
    for k in 0..4000 {
        a = step(&one, [0.01 * f64::from(k), 0.01], &a, |_| []);
        b = step(&other, [0.01 * f64::from(k), 0.01], &b, |_| []);
    }
    for k in 0..6 {
        assert!((a[k] - b[k]).abs() < 1e3 * INTEGRATION * (1.0 + a[k].abs()), "{k}: {} {}", a[k], b[k]);
    }
    let turned = [b[10], -b[12], b[11]];
    assert!((0..3).all(|k| (a[10 + k] - turned[k]).abs() < 100.0 * INTEGRATION), "{a:?} {b:?}");
    let (c, d) = (one.condition(&a), other.condition(&b));
    assert!((c.total_attack - d.total_attack).abs() < 100.0 * INTEGRATION);
}
