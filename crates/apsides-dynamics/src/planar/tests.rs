use super::*;
use crate::Hohmann;

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-7;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 5e-3;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// Constants of the paper (Table 1).
fn paper() -> PlanarFlight {
    let body = Body::new(4904.8695e9, 1737.1e3).unwrap();
    PlanarFlight::new(body, Engine::with_exhaust_velocity(440.0, 310.0 * 9.807).unwrap())
}

#[test]
fn circular_orbit_stays_circular() {
    let f = paper();
    let speed = f.body.circular_speed(100e3).unwrap();
    assert!((speed - 1633.98).abs() < PUBLISHED, "eq. 11 of the paper gives 1633.98 m/s");
    let r = f.body.radius + 100e3;
    let rate = ThrottledThrust(f).rate(0.0, &[r, 0.3, speed, 0.0, 300.0], &[1.0, 0.0], &[]);
    assert!(rate[2].abs() < ROUNDING && rate[3].abs() < ROUNDING);
    assert!((rate[1] - speed / r).abs() < 1e10 * ROUNDING * ROUNDING);
    assert_eq!(rate[4], 0.0);
}

#[test]
fn full_throttle_is_constant_thrust() {
    let x = [1.75e6, 0.1, 1500.0, -20.0, 250.0];
    let a = ConstantThrust(paper()).rate(0.0, &x, &[2.1], &[]);
    let b = ThrottledThrust(paper()).rate(0.0, &x, &[2.1, 1.0], &[]);
    assert_eq!(a, b);
    assert!((a[4] + 0.144_728_748_721_288_6).abs() < 0.1 * ROUNDING, "mass flow of the reference");
}

#[test]
fn vertical_flight_is_planar_flight_without_horizontal_speed() {
    let planar = ConstantThrust(paper()).rate(
        0.0,
        &[1.738e6, 0.0, 0.0, -50.0, 160.0],
        &[std::f64::consts::FRAC_PI_2],
        &[],
    );
    let vertical = VerticalThrust(paper()).rate(0.0, &[1.738e6, -50.0, 160.0], &[], &[]);
    assert_eq!([planar[0], planar[3], planar[4]], vertical);
}

#[test]
fn coasting_is_throttle_zero() {
    let x = [1.75e6, 0.1, 1500.0, -20.0, 250.0];
    let coasting = Coasting(paper()).rate(0.0, &x, &[], &[]);
    assert_eq!(coasting, ThrottledThrust(paper()).rate(0.0, &x, &[2.1, 0.0], &[]));
}

#[test]
fn a_pitching_vehicle_flies_like_one_at_its_thrust_angle() {
    let x = [1.75e6, 0.1, 1500.0, -20.0, 250.0];
    let pitching = [x[0], x[1], x[2], x[3], x[4], 2.1];
    let constant = ConstantThrust(paper()).rate(0.0, &x, &[2.1], &[]);
    let rate = PitchRate(ConstantThrust(paper())).rate(0.0, &pitching, &[-0.03], &[]);
    assert_eq!(rate[..5], constant);
    assert_eq!(rate[5], -0.03);
    let throttled = ThrottledThrust(paper()).rate(0.0, &x, &[2.1, 0.4], &[]);
    let rate = PitchRate(ThrottledThrust(paper())).rate(0.0, &pitching, &[-0.03, 0.4], &[]);
    assert_eq!(rate[..5], throttled);
    assert_eq!(rate[5], -0.03);
}

#[test]
fn throttled_vertical_flight() {
    let x = [1.738e6, -50.0, 160.0];
    let full = ThrottledVerticalThrust(paper()).rate(0.0, &x, &[1.0], &[]);
    assert_eq!(full, VerticalThrust(paper()).rate(0.0, &x, &[], &[]));
    let fall = ThrottledVerticalThrust(paper()).rate(0.0, &x, &[0.0], &[]);
    let gravity = 4904.8695e9 / (1.738e6 * 1.738e6);
    assert!((fall[1] + gravity).abs() < 0.1 * ROUNDING && fall[2] == 0.0);
}

/// Along a transfer: the end points, the lowest point as seen from each point, and the equations of motion by central
/// differences.
#[test]
fn points_of_a_transfer_lie_on_one_orbit() {
    let f = paper();
    for (from, to) in [(1837.1e3, 1752.1e3), (1752.1e3, 1837.1e3)] {
        let t = Hohmann::new(&f.body, from, to).unwrap();
        let (first, last) = (t.point(0.0), t.point(std::f64::consts::PI));
        assert!((first.radius - from).abs() < 1e8 * ROUNDING && (last.radius - to).abs() < 1e8 * ROUNDING);
        assert!(
            (last.time - t.duration).abs() < 1e5 * ROUNDING
                && (last.angle - std::f64::consts::PI).abs() < ROUNDING
        );
        assert!((last.horizontal_speed - t.arrival_speed).abs() < 1e5 * ROUNDING);
        for k in 0..=10 {
            let p = t.point(f64::from(k) * 0.1 * std::f64::consts::PI);
            let lowest = f.periapsis_radius(p.radius, p.horizontal_speed, p.radial_speed);
            assert!((lowest - 1752.1e3).abs() < 1e8 * ROUNDING, "{lowest}");
        }
        let (a, p, b) = (t.point(0.7 - 1e-4), t.point(0.7), t.point(0.7 + 1e-4));
        let x = [p.radius, p.angle, p.horizontal_speed, p.radial_speed, 300.0];
        let rate = Coasting(f).rate(0.0, &x, &[], &[]);
        let dt = b.time - a.time;
        assert!(((b.radius - a.radius) / dt - rate[0]).abs() < 100.0 * DIFFERENCES);
        assert!(((b.angle - a.angle) / dt - rate[1]).abs() < 1e-3 * DIFFERENCES);
        assert!(((b.horizontal_speed - a.horizontal_speed) / dt - rate[2]).abs() < DIFFERENCES);
        assert!(((b.radial_speed - a.radial_speed) / dt - rate[3]).abs() < DIFFERENCES);
    }
}

#[test]
fn the_lowest_point_of_a_circle() {
    let f = paper();
    let speed = f.body.circular_speed(100e3).unwrap();
    // The smoothed eccentricity of 1e-9 moves it by about 2 mm.
    assert!((f.periapsis_radius(1837.1e3, speed, 0.0) - 1837.1e3).abs() < 2e+11 * ROUNDING);
}

#[test]
fn hohmann_to_the_perilune_of_the_reference() {
    // 100 km circular to 15 km perilune: speed 1692.8436568 m/s, mass 298.0854492 kg (tests/references/lunar_landing.py, case S2_15km).
    let f = paper();
    let t = Hohmann::new(&f.body, 1837.1e3, 1752.1e3).unwrap();
    assert!((t.arrival_speed - 1_692.843_656_804_368_7).abs() < 1e5 * ROUNDING);
    let mass = f.engine.mass_after(300.0, t.departure_impulse);
    assert!((mass - 298.085_449_232_581_54).abs() < 1e5 * ROUNDING);
    assert!((f.engine.velocity_change(300.0, mass) - t.departure_impulse).abs() < 1e5 * ROUNDING);
}

#[test]
fn hohmann_conserves_angular_momentum_and_energy() {
    let t = Hohmann::new(&Body::MOON, 2.0e6, 3.5e6).unwrap();
    assert!((t.departure_speed * 2.0e6 - t.arrival_speed * 3.5e6).abs() < 1e11 * ROUNDING);
    let energy = |v: f64, r: f64| 0.5 * v * v - Body::MOON.gravitational_parameter / r;
    assert!((energy(t.departure_speed, 2.0e6) - energy(t.arrival_speed, 3.5e6)).abs() < 1e8 * ROUNDING);
}

#[test]
fn impossible_parameters_are_refused() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Engine::new(bad, 310.0).is_err());
        assert!(Engine::new(440.0, bad).is_err());
        assert!(Body::new(bad, 1.0).is_err());
        assert!(Hohmann::new(&Body::MOON, bad, 2e6).is_err());
    }
    let e = Engine::new(-5.0, 310.0).unwrap_err();
    assert_eq!(e.to_string(), "thrust is -5 N, allowed is a positive finite number");
    assert!(Body::MOON.circular_speed(-2e6).is_err());
}

/// Second derivatives of the outputs from the equations of motion give back state and control, and no residual.
#[test]
fn flat_maps_invert_the_equations_of_motion() {
    use super::flat::{FlatConstantThrust, FlatVerticalThrust};
    use apsides_ad::FlatMap;

    let flight = paper();
    let flat = FlatConstantThrust { flight, ignition: 20.0, mass: 298.0 };
    let t = 320.0;
    let m = 298.0 - 300.0 * 0.144_728_748_721_288_6;
    let thrust = flight.engine.thrust;
    for beta in [-1.2, 0.4, 2.2, std::f64::consts::PI, 4.0] {
        let x = [1.745e6, 0.2, 1200.0, -30.0, m];
        let [r1, phi1, u1, v1, _] = ConstantThrust(flight).rate(t, &x, &[beta], &[]);
        let jet = [[x[0], r1, v1], [x[1], phi1, (u1 - r1 * phi1) / x[0]]];
        let (state, [angle], [residual]) = flat.evaluate(t, &jet, &[]);
        for (a, b) in state.iter().zip(x) {
            assert!((a - b).abs() < 100.0 * ROUNDING * b.abs(), "{a} {b}");
        }
        assert!((angle - beta).abs() < 100.0 * ROUNDING && residual.abs() < 1e5 * ROUNDING * thrust * thrust);
        assert_eq!(flat.outputs(t, &x, &[beta], &[]), [x[0], x[1]]);
    }
    let x = [1.738e6, -50.0, m];
    let [r1, v1, _] = VerticalThrust(flight).rate(t, &x, &[], &[]);
    let vertical = FlatVerticalThrust(flat);
    let (state, [], [residual]) = vertical.evaluate(t, &[[x[0], r1, v1]], &[]);
    assert!((state[2] - m).abs() < 100.0 * ROUNDING * m && (state[0], state[1]) == (x[0], x[1]));
    assert!(residual.abs() < 1e5 * ROUNDING * thrust);
    // Thrust down is no solution.
    let down = v1 - 2.0 * thrust / m;
    let (_, [], [residual]) = vertical.evaluate(t, &[[x[0], r1, down]], &[]);
    assert!((residual + 2.0 * thrust).abs() < 1e5 * ROUNDING * thrust);
}
