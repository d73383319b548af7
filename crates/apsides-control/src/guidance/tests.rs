//! Flights by the laws: on flat ground against closed forms, over the planar Moon against an independent simulation of the same law (Python,
//! commands held for 0.02 s) and the indirect optimum of the same braking.

use apsides_dynamics::Engine;
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status};

use super::linear_radial::{DescentState, LinearRadialLaw};
use super::polynomial::{PolynomialLaw, Profile, Target, ThrustCommand, ThrustLimits};
use crate::ControlError;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-6;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 1e-2;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

const MU: f64 = 4.902_793_455e12;
const MOON: f64 = 1_737_013.0;
/// From here on commands are held.
const HELD_S: f64 = 2.0;
/// The polynomials are asked until here.
const ASKED_UNTIL_S: f64 = 0.05;
/// Mass at the end of the optimum with a throttle between 1500 and 7500 N.
const OPTIMUM_KG: f64 = 1_345.831_672_241;
/// The propellant that the independent simulation burns in one of its steps: its end is known to that.
const STEP_KG: f64 = 0.02 * 7500.0 / 2940.0;

/// Published: the range of the reference, as its last step leaves it, km.
const STEP_KM: f64 = 0.015;

/// Published: the propellant of a step of the reference, with what the weaker engine adds to it, kg.
const WEAKER_KG: f64 = 0.06;

fn law() -> LinearRadialLaw {
    LinearRadialLaw {
        gravitational_parameter: MU,
        engine: Engine::with_exhaust_velocity(7500.0, 2940.0).unwrap(),
        radius: MOON + 3e3,
        radial_speed: -24.227_926_737_3,
        horizontal_speed: 51.594_646_679_8,
    }
}

struct Flown {
    time: f64,
    mass: f64,
    radius: f64,
    radial_speed: f64,
    horizontal_speed: f64,
    downrange_km: f64,
}

/// Radius, angle, upward and horizontal speed, mass; the law knows the engine that flies.
fn flown(law: &LinearRadialLaw, start: [f64; 5]) -> Flown {
    let state =
        |x: &[f64]| DescentState { radius: x[0], radial_speed: x[2], horizontal_speed: x[3], mass: x[4] };
    let motion = |x: &[f64], pitch: f64| {
        let (r, w, u) = (x[0], x[2], x[3]);
        let (sin, cos) = pitch.sin_cos();
        let a = law.engine.thrust / x[4];
        [w, u / r, a * sin - MU / (r * r) + u * u / r, -a * cos - w * u / r, -law.engine.mass_flow()]
    };
    let planned = law.command(&state(&start), None).unwrap().time_to_go;
    let system = FnSystem::new(5, |t: f64, x: &[f64], dx: &mut [f64]| {
        let command = law.command(&state(x), Some(planned - t)).unwrap();
        dx.copy_from_slice(&motion(x, command.pitch));
    });
    let mut integrator = Integrator::new(5, OdeSettings::with_tolerance(1e-9)).unwrap();
    let mut x = [0.0; 5];
    let summary = integrator.integrate(&system, 0.0, &start, planned - HELD_S, &mut x).unwrap();
    assert_eq!(summary.status, Status::Completed);
    let last = law.command(&state(&x), Some(HELD_S)).unwrap();
    let held = FnSystem::new(5, |_: f64, x: &[f64], dx: &mut [f64]| {
        dx.copy_from_slice(&motion(x, last.pitch));
    });
    let from = x;
    integrator.integrate(&held, 0.0, &from, last.time_to_go, &mut x).unwrap();
    Flown {
        time: planned - HELD_S + last.time_to_go,
        mass: x[4],
        radius: x[0],
        radial_speed: x[2],
        horizontal_speed: x[3],
        downrange_km: x[1] * MOON / 1e3,
    }
}

const START: [f64; 5] = [MOON + 15e3, 0.0, 0.0, 1692.0, 2400.0];

#[test]
fn linear_radial_acceleration_over_the_planar_moon() {
    let nominal = flown(&law(), START);
    // What the angle, held, turns less over two seconds; the reference ends 0.11 m low and 0.02 m/s fast, by its steps.
    assert!((nominal.radius - law().radius).abs() < PUBLISHED);
    assert!((nominal.radial_speed - law().radial_speed).abs() < PUBLISHED);
    assert!((nominal.horizontal_speed - law().horizontal_speed).abs() < 0.5 * PUBLISHED);
    let gap = OPTIMUM_KG - nominal.mass;
    assert!((gap - 1.137_795).abs() < STEP_KG, "{gap}");
    // The same equations by SciPy (cubic radius, DOP853 at 1e-11): 413.672118121 s.
    assert!((nominal.time - 413.672_118_121).abs() < 1e-4 * PUBLISHED, "{}", nominal.time);
    assert!((gap - 1.117_687_856).abs() < 1e-3 * PUBLISHED, "{gap}");
    assert!((nominal.downrange_km - 386.608_411).abs() < STEP_KM);
}

#[test]
fn the_range_is_what_comes_out() {
    let nominal = flown(&law(), START).downrange_km;
    let faster = flown(&law(), [START[0], 0.0, 0.0, 1695.0, 2400.0]);
    assert!((faster.downrange_km - nominal - 1.223_090).abs() < 0.2 * PUBLISHED, "{}", faster.downrange_km);
    let engine = Engine::with_exhaust_velocity(0.97 * 7500.0, 2940.0).unwrap();
    let weaker = flown(&LinearRadialLaw { engine, ..law() }, START);
    assert!((weaker.downrange_km - nominal - 12.370_464).abs() < STEP_KM, "{}", weaker.downrange_km);
    assert!((OPTIMUM_KG - weaker.mass - 2.636_774).abs() < WEAKER_KG, "{}", weaker.mass);
}

#[test]
fn angle_commands_that_cannot_be() {
    let state = DescentState { radius: START[0], radial_speed: 0.0, horizontal_speed: 1692.0, mass: 2400.0 };
    let error = |s: DescentState| law().command(&s, None).unwrap_err();
    let slow = error(DescentState { horizontal_speed: 50.0, ..state });
    assert!(slow.to_string().contains("not above that of the target"), "{slow}");
    let fast = error(DescentState { horizontal_speed: 30e3, ..state });
    assert!(fast.to_string().contains("propellant"), "{fast}");
    assert!(matches!(
        error(DescentState { mass: 0.0, ..state }),
        ControlError::Parameter { allowed: "a positive finite number", .. }
    ));
    assert!(error(DescentState { radial_speed: f64::NAN, ..state }).to_string().contains("radial speed"));
    // High above its target and with little time the full thrust points down.
    let high = DescentState { radius: MOON + 400e3, horizontal_speed: 60.0, ..state };
    let command = law().command(&high, None);
    assert!(command.is_err() || command.unwrap().saturated);
}

const GRAVITY: [f64; 3] = [0.0, 0.0, -1.62];
const TARGET: Target =
    Target { position: [10.0, -20.0, 30.0], velocity: [1.0, 0.5, -2.0], acceleration: [-1.5, 0.1, 0.4] };
const POSITION: [f64; 3] = [-9_000.0, 800.0, 2_500.0];
const VELOCITY: [f64; 3] = [170.0, -12.0, -40.0];

fn polynomial(profile: Profile, most: f64) -> PolynomialLaw {
    let limits = ThrustLimits::new(0.0, most).unwrap();
    PolynomialLaw { target: TARGET, profile, axis: [1.0, 0.0, 0.0], limits }
}

fn ask(law: &PolynomialLaw, x: &[f64], guess: f64) -> ThrustCommand {
    law.command(&[x[0], x[1], x[2]], &[x[3], x[4], x[5]], 1000.0, &GRAVITY, guess).unwrap()
}

#[test]
fn on_flat_ground_the_polynomials_meet_their_target() {
    for profile in [Profile::Linear, Profile::Quadratic { jerk: 0.002 }] {
        let law = polynomial(profile, 1e9);
        let start = [POSITION, VELOCITY].concat();
        let first = ask(&law, &start, 100.0);
        let total = first.time_to_go;
        let a = law.acceleration(&POSITION, &VELOCITY, total);
        let thrust = std::array::from_fn::<f64, 3, _>(|k| 1000.0 * (a[k] - GRAVITY[k]));
        assert_eq!((first.thrust, first.saturated), (thrust, false));
        // The time is the one at which the condition along the axis holds: the end of the polynomial through both ends.
        let [r, v, r_t, v_t, a_t] =
            [POSITION[0], VELOCITY[0], TARGET.position[0], TARGET.velocity[0], TARGET.acceleration[0]];
        let (way, sum) = (r_t - r - v * total, v_t - v);
        match profile {
            Profile::Linear => {
                // a0 + a1 t with both ends met.
                let a1 = (6.0 * total * sum - 12.0 * way) / total.powi(3);
                assert!((a[0] + a1 * total - a_t).abs() < ROUNDING);
            }
            Profile::Quadratic { jerk } => {
                // a0 + a1 t + a2 t^2 with both ends and the last acceleration met.
                let a2 = (a_t * total * total - 4.0 * sum * total + 6.0 * way) * 6.0 / total.powi(4);
                let a1 = (a_t - a[0] - a2 * total * total) / total;
                assert!((a1 + 2.0 * a2 * total - jerk).abs() < ROUNDING, "{}", a1 + 2.0 * a2 * total);
            }
        }
        // Flown with the law asked at every moment.
        let system = FnSystem::new(6, |t: f64, x: &[f64], dx: &mut [f64]| {
            let command = ask(&law, x, total - t);
            dx[..3].copy_from_slice(&x[3..]);
            for k in 0..3 {
                dx[3 + k] = command.thrust[k] / 1000.0 + GRAVITY[k];
            }
        });
        let mut integrator = Integrator::new(6, OdeSettings::with_tolerance(1e-13)).unwrap();
        let mut x = [0.0; 6];
        integrator.integrate(&system, 0.0, &start, total - ASKED_UNTIL_S, &mut x).unwrap();
        let last = ask(&law, &x, ASKED_UNTIL_S);
        assert!((last.time_to_go - ASKED_UNTIL_S).abs() < 1e3 * ROUNDING, "{}", last.time_to_go);
        let end = law.acceleration(&[x[0], x[1], x[2]], &[x[3], x[4], x[5]], ASKED_UNTIL_S);
        for k in 0..3 {
            // The acceleration changes by 1e-4 m/s2 over the time that it is held.
            let speed = x[3 + k] + ASKED_UNTIL_S * end[k];
            let place = x[k] + ASKED_UNTIL_S * (x[3 + k] + 0.5 * ASKED_UNTIL_S * end[k]);
            assert!((place - TARGET.position[k]).abs() < INTEGRATION, "{place}");
            assert!((speed - TARGET.velocity[k]).abs() < 200.0 * INTEGRATION, "{speed}");
        }
    }
}

/// The closed form: along the commanded polynomial the law asks for the same polynomial, and it ends at the target to rounding.
#[test]
fn along_its_polynomial_the_linear_law_does_not_change_its_mind() {
    let law = polynomial(Profile::Linear, 1e9);
    let start = [POSITION, VELOCITY].concat();
    let total = ask(&law, &start, 100.0).time_to_go;
    let a0 = law.acceleration(&POSITION, &VELOCITY, total);
    let a1: [f64; 3] =
        std::array::from_fn(|k| (TARGET.velocity[k] - VELOCITY[k] - a0[k] * total) * 2.0 / (total * total));
    let at = |t: f64| -> Vec<f64> {
        let place = |k: usize| POSITION[k] + t * (VELOCITY[k] + t * (0.5 * a0[k] + t * a1[k] / 6.0));
        let speed = |k: usize| VELOCITY[k] + t * (a0[k] + 0.5 * t * a1[k]);
        (0..6).map(|k| if k < 3 { place(k) } else { speed(k - 3) }).collect()
    };
    for (k, x) in at(total).iter().enumerate() {
        let wanted = if k < 3 { TARGET.position[k] } else { TARGET.velocity[k - 3] };
        assert!((x - wanted).abs() < 10.0 * ROUNDING * 9_000.0, "{x} {wanted}");
    }
    for part in [0.2, 0.5, 0.9] {
        let t = part * total;
        let command = ask(&law, &at(t), total - t);
        assert!((command.time_to_go - (total - t)).abs() < 1e3 * ROUNDING);
        for k in 0..3 {
            let expected = 1000.0 * (a0[k] + a1[k] * t - GRAVITY[k]);
            assert!((command.thrust[k] - expected).abs() < 1e6 * ROUNDING);
        }
    }
}

#[test]
fn thrust_stays_within_its_limits() {
    let start = [POSITION, VELOCITY].concat();
    let free = ask(&polynomial(Profile::Linear, 1e9), &start, 100.0);
    let size = |f: [f64; 3]| f.iter().map(|c| c * c).sum::<f64>().sqrt();
    let limited = ask(&polynomial(Profile::Linear, 1000.0), &start, 100.0);
    assert!(limited.saturated && (size(limited.thrust) - 1000.0).abs() < 1e3 * ROUNDING);
    for (a, b) in limited.thrust.iter().zip(free.thrust) {
        assert!((a / 1000.0 - b / size(free.thrust)).abs() < ROUNDING);
    }
    let limits = ThrustLimits::new(5e4, 6e4).unwrap();
    let least = ask(&PolynomialLaw { limits, ..polynomial(Profile::Linear, 1e9) }, &start, 100.0);
    assert!(least.saturated && (size(least.thrust) - 5e4).abs() < 1e3 * ROUNDING);
    let refused = ThrustLimits::new(2.0, 1.0);
    assert!(
        matches!(refused, Err(ControlError::Parameter { what: "least thrust", value: 2.0, .. })),
        "{refused:?}"
    );
    // Away from the target, braking towards it: no time to go.
    let law = polynomial(Profile::Linear, 1e9);
    let target = Target { acceleration: [1.5, 0.0, 0.0], ..TARGET };
    let error = PolynomialLaw { target, ..law }
        .command(&[-9_000.0, 0.0, 0.0], &[30.0, 0.0, 0.0], 1000.0, &GRAVITY, 100.0)
        .unwrap_err();
    assert!(matches!(error, ControlError::NoTimeToGo { .. }), "{error}");
    let error = law.command(&POSITION, &VELOCITY, -1.0, &GRAVITY, 100.0).unwrap_err();
    assert!(error.to_string().contains("the mass is -1"), "{error}");
}

/// Neither an engine without thrust or exhaust velocity nor a mass that burns within a millisecond has a time to go.
#[test]
fn engines_that_cannot_brake_are_refused() {
    let state =
        DescentState { radius: MOON + 15e3, radial_speed: 0.0, horizontal_speed: 1692.0, mass: 2400.0 };
    let refused = |thrust: f64, exhaust_velocity: f64| {
        let engine = Engine { thrust, exhaust_velocity };
        LinearRadialLaw { engine, ..law() }.command(&state, None).unwrap_err().to_string()
    };
    assert!(refused(-100.0, 2940.0).contains("the thrust is -100"));
    assert!(refused(f64::NAN, 2940.0).contains("the thrust is NaN"));
    assert!(refused(7500.0, -100.0).contains("the exhaust velocity is -100"));
    assert!(refused(7500.0, 1e-6).contains("no time to go leads from this state to the target"));
}
