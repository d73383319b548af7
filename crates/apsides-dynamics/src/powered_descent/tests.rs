use apsides_ad::Dynamics;

use super::*;
use crate::Body;
use crate::frames::{BodyFixed, Local};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 2e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-15;

fn descent() -> PoweredDescent {
    let engine = Engine::with_exhaust_velocity(7500.0, 2940.0).unwrap();
    PoweredDescent::new(GravityField::central(Body::MOON), 40.0 * MOON_ROTATION_RATE, engine).unwrap()
}

/// Newton's law in inertial axes, the velocity and the position turned into the local axes before and after a short time.
#[test]
fn the_same_acceleration_as_in_inertial_axes() {
    let flight = descent();
    let model = AngledThrust(flight.clone());
    for (x, u) in [
        ([1.75e6, -0.34, 0.77, -20.0, 300.0, 900.0, 1500.0], [2.0, 0.4, 0.7]),
        ([1.74e6, 2.2, -1.1, 30.0, -1200.0, -500.0, 2400.0], [-0.5, -0.3, 1.0]),
        ([1.80e6, 0.0, 0.0, 0.0, 0.0, 0.0, 1000.0], [0.0, 1.2, 0.3]),
    ] {
        let [r, longitude, latitude, w, e, n, m] = x;
        let rates = model.rate(0.0, &x, &u, &[]);
        let frame = BodyFixed { rotation_rate: flight.rotation_rate, epoch_angle: 0.3 };
        let local = Local::at(longitude, latitude);
        let (position, velocity) = (local.up.map(|c| c * r), local.vector([w, e, n]));
        let (p0, v0) = frame.to_inertial(0.0, position, velocity);
        // Thrust and gravity in inertial axes.
        let (sin, cos) = u[1].sin_cos();
        let size = u[2] * 7500.0 / m;
        let thrust = local.vector([size * sin, size * cos * u[0].sin(), size * cos * u[0].cos()]);
        let (thrust, _) = frame.to_inertial(0.0, thrust, [0.0; 3]);
        let mu = flight.gravity.gravitational_parameter();
        let acceleration = [0, 1, 2].map(|k| thrust[k] - mu * p0[k] / r.powi(3));
        // Second-order motion over +-h, seen from the ground again.
        let h = 1e-2;
        let at = |t: f64| {
            let p = [0, 1, 2].map(|k| p0[k] + t * v0[k] + 0.5 * t * t * acceleration[k]);
            let v = [0, 1, 2].map(|k| v0[k] + t * acceleration[k]);
            let (p, v) = frame.to_fixed(t, p, v);
            let (r, longitude, latitude) = Local::spherical(p);
            let [w, e, n] = Local::at(longitude, latitude).components(v);
            [r, longitude, latitude, w, e, n]
        };
        let (before, after) = (at(-h), at(h));
        for k in 0..6 {
            let slope = (after[k] - before[k]) / (2.0 * h);
            let size = [1.0, 1e-3, 1e-3, 1.0, 1.0, 1.0][k];
            assert!((rates[k] - slope).abs() < DIFFERENCES * size, "{k}: {} {slope}", rates[k]);
        }
        assert!((rates[6] + u[2] * 7500.0 / 2940.0).abs() < 1e3 * ROUNDING);
    }
}

#[test]
fn the_forms_of_the_thrust_are_one() {
    let flight = descent();
    let x = [1.75e6, -0.34, 0.77, -20.0, 300.0, 900.0, 1500.0];
    let (course, pitch, throttle) = (2.0_f64, 0.4_f64, 0.6);
    let direction = [pitch.sin(), pitch.cos() * course.sin(), pitch.cos() * course.cos()];
    let angled = AngledThrust(flight.clone()).rate(0.0, &x, &[course, pitch, throttle], &[]);
    let u = [direction[0], direction[1], direction[2], throttle];
    let directed = DirectedThrust(flight.clone()).rate(0.0, &x, &u, &[]);
    let [norm] = DirectionNorm.evaluate(0.0, &x, &u, &[]);
    assert!((norm - 1.0).abs() < ROUNDING);
    for (a, d) in angled.iter().zip(directed) {
        assert!((a - d).abs() < 1e3 * ROUNDING * (1.0 + a.abs()));
    }
    let upright = UprightThrust(flight.clone()).rate(0.0, &x, &[throttle], &[]);
    let same = AngledThrust(flight).rate(0.0, &x, &[0.0, std::f64::consts::FRAC_PI_2, throttle], &[]);
    for (a, d) in upright.iter().zip(same) {
        assert!((a - d).abs() < 1e3 * ROUNDING * (1.0 + a.abs()));
    }
}

/// A vehicle that leans as the plumb thrust does stays above its place.
#[test]
fn vertical_flight_stays_above_its_place() {
    let flight = PoweredDescent {
        gravity: GravityField::second_degree(
            Body::MOON,
            1.738e6,
            crate::gravity::MOON_J2,
            crate::gravity::MOON_C22,
        )
        .unwrap(),
        ..descent()
    };
    let (place, [r, w, m], throttle) = ([-0.34, 0.77], [1.738e6, -46.0, 1300.0], 0.6);
    let plumb = PlumbThrust { flight: flight.clone(), place };
    let vertical = plumb.rate(0.0, &[r, w, m], &[throttle], &[]);
    // The direction that cancels what the equations in space have across.
    let x = [r, place[0], place[1], w, 0.0, 0.0, m];
    let falling = DirectedThrust(flight.clone()).rate(0.0, &x, &[0.0, 0.0, 0.0, throttle], &[]);
    let size = throttle * 7500.0 / m;
    let (east, north) = (-falling[4] / size, -falling[5] / size);
    let up = (1.0 - east * east - north * north).sqrt();
    let in_space = DirectedThrust(flight).rate(0.0, &x, &[up, east, north, throttle], &[]);
    assert!(in_space[4].abs() < ROUNDING && in_space[5].abs() < ROUNDING && east.abs() > 1e-5);
    assert_eq!(in_space[0], vertical[0]);
    assert!(
        (in_space[3] - vertical[1]).abs() < 10.0 * ROUNDING && (in_space[6] - vertical[2]).abs() < ROUNDING
    );
    // At rest with the hovering thrust nothing moves.
    let hover = Hovering(plumb.clone());
    let balance = hover.acceleration(r) * m / 7500.0;
    let still = plumb.rate(0.0, &[r, 0.0, m], &[balance], &[]);
    assert!(still[0] == 0.0 && still[1].abs() < 10.0 * ROUNDING);
    assert!((hover.rate(0.0, &[r, 0.0, m], &[], &[])[2] - still[2]).abs() < 10.0 * ROUNDING);
}

/// The same flight in spherical coordinates, under the thrust that keeps it in its plane.
#[test]
fn flight_in_a_vertical_plane_is_one_in_space() {
    let flight = descent();
    let model = VerticalPlaneThrust {
        flight: flight.clone(),
        place: [-0.34, 0.77],
        course: 2.3,
        least_throttle: 0.2,
    };
    let (x, u) = ([1.739e6, 4e-4, -46.0, 30.0, 1300.0], [0.5, 0.6]);
    let rates = model.rate(0.0, &x, &u, &[]);
    let up0 = Local::at(-0.34, 0.77);
    let (sin, cos) = 2.3_f64.sin_cos();
    let forward0 = [0, 1, 2].map(|k| cos * up0.north[k] + sin * up0.east[k]);
    let left = [0, 1, 2].map(|k| sin * up0.north[k] - cos * up0.east[k]);
    let axes = |s: f64| {
        let (sin, cos) = s.sin_cos();
        let turned = |a: f64, b: f64| [0, 1, 2].map(|k| a * up0.up[k] + b * forward0[k]);
        [turned(cos, sin), turned(-sin, cos)]
    };
    let in_space = |x: [f64; 5]| {
        let [r, s, w, v, m] = x;
        let [up, forward] = axes(s);
        let (_, longitude, latitude) = Local::spherical(up);
        assert_eq!([longitude, latitude], model.place_at(s));
        let [up, east, north] =
            Local::at(longitude, latitude).components([0, 1, 2].map(|k| w * up[k] + v * forward[k]));
        [r, longitude, latitude, up, east, north, m]
    };
    let h = 1e-3;
    let moved = |h: f64| in_space(std::array::from_fn(|k| x[k] + h * rates[k]));
    let (before, after) = (moved(-h), moved(h));
    // The thrust: in the plane as given, across what the last term of the model says.
    let [up, forward] = axes(x[1]);
    let turn = flight.rotation_rate;
    let side = 2.0 * turn * (up[2] * x[3] - forward[2] * x[2]) + x[0] * turn * turn * up[2] * left[2];
    // 0.4 of the way from 1500 N upwards to 7500 N: p = 0.6.
    let throttle = 0.4 * 0.2 / u[0].cos() + 0.6;
    let in_plane = ((throttle * 7500.0 / x[4]).powi(2) - side * side).sqrt();
    let here = in_space(x);
    let thrust =
        [0, 1, 2].map(|k| in_plane * (u[0].cos() * up[k] + u[0].sin() * forward[k]) + side * left[k]);
    let [a, b, c] = Local::at(here[1], here[2]).components(thrust).map(|t| t / (throttle * 7500.0 / x[4]));
    assert!(side.abs() > 1e-3);
    let expected = DirectedThrust(flight).rate(0.0, &here, &[a, b, c, throttle], &[]);
    for k in 0..7 {
        let slope = (after[k] - before[k]) / (2.0 * h);
        let size = [1.0, 1e-3, 1e-3, 1.0, 1.0, 1.0, 1.0][k];
        assert!((expected[k] - slope).abs() < 0.5 * DIFFERENCES * size, "{k}: {} {slope}", expected[k]);
    }
}
