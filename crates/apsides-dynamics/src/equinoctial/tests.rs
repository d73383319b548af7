use apsides_ad::{Dual, Dynamics, dynamics_node, vector};
use std::f64::consts::PI;

use super::*;
use crate::elements::{Cartesian, Equinoctial, Sense};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

fn breeze() -> OrbitalFlight {
    OrbitalFlight::new(Body::EARTH, Engine::with_exhaust_velocity(20e3, 20e3 / 6.14).unwrap())
}

/// Orbits of every kind, true longitudes over two revolutions.
const ORBITS: [[f64; 6]; 6] = [
    [6.6e6, 0.0, 0.0, 0.0, 0.0, 0.4],
    [7.1e6, 0.1, -0.2, 0.3, 0.2, 2.0],
    [1.2e7, -0.5, 0.4, -0.1, 0.5, 7.0],
    [1.0e7, 0.7, 0.1, 1.2, -0.8, -1.5],
    [1.3e7, 1.0, 0.0, 0.2, 0.0, 1.0],
    [2.0e7, 0.9, 1.2, 0.1, 0.4, 0.2],
];

/// Acceleration of the body's field at a position, J2 included, as the gradient of the potential
/// `mu / r [1 - J2 (Re / r)^2 (3 sin^2(latitude) - 1) / 2]` (Vallado 2013, section 8.6).
fn gravity(flight: &OrbitalFlight, at: [f64; 3]) -> [f64; 3] {
    let x: [Dual<3>; 3] = std::array::from_fn(|k| Dual::variable(at[k], k));
    let r = vector::norm(&x, 0.0);
    let sin2 = (x[2] / r).square();
    let oblate = (r.recip() * flight.body.radius).square() * ((sin2 * 3.0 - 1.0) * (0.5 * flight.j2));
    let potential = r.recip() * flight.body.gravitational_parameter * (-oblate + 1.0);
    potential.eps
}

/// Rates of position and velocity that rates of the elements mean.
fn moved(mu: f64, elements: [f64; 6], rates: [f64; 6]) -> ([f64; 3], [f64; 3]) {
    let along = std::array::from_fn(|k| Dual::<1> { re: elements[k], eps: [rates[k]] });
    let moved = Equinoctial::prograde(along).to_cartesian(mu);
    (moved.position.map(|c| c.eps[0]), moved.velocity.map(|c| c.eps[0]))
}

/// The equations in elements are Newton's law with the thrust and the field, for every kind of orbit: derivatives of position and
/// velocity along the rates, by dual numbers.
#[test]
fn the_rates_are_newtons_law() {
    let mass = 2.1e4;
    for flight in [breeze(), breeze().with_j2(EARTH_J2), breeze().with_j2(0.1)] {
        let mu = flight.body.gravitational_parameter;
        for orbit in ORBITS {
            let Cartesian { position: r, velocity: v } = Equinoctial::prograde(orbit).to_cartesian(mu);
            let size = vector::norm(&r, 0.0);
            let (alpha, beta) = (0.7_f64, -0.4_f64);
            let [p, f, g, h, k, l] = orbit;
            let x = [p, f, g, h, k, l, mass];
            let radial = vector::scale(&r, 1.0 / size);
            let momentum = vector::cross(&r, &v);
            let normal = vector::scale(&momentum, 1.0 / vector::norm(&momentum, 0.0));
            let transverse = vector::cross(&normal, &radial);
            let steered = std::array::from_fn(|c| {
                alpha.sin() * beta.cos() * radial[c]
                    + alpha.cos() * beta.cos() * transverse[c]
                    + beta.sin() * normal[c]
            });
            let forward = vector::scale(&v, 1.0 / vector::norm(&v, 0.0));
            let (a, d) = (2.2_f64, 0.6_f64);
            let fixed = [d.cos() * a.cos(), d.cos() * a.sin(), d.sin()];
            let inertial_rate =
                SpatialInertialThrust(flight).rate(0.0, &[p, f, g, h, k, l, mass, a, d], &[], &[]);
            assert_eq!(inertial_rate[7..], [0.0, 0.0]);
            let cases: [([f64; 7], [f64; 3]); 4] = [
                (SpatialCoast(flight).rate(0.0, &x, &[], &[]), [0.0; 3]),
                (SpatialThrust(flight).rate(0.0, &x, &[alpha, beta], &[]), steered),
                (SpatialVelocityThrust(flight).rate(0.0, &x, &[], &[]), forward),
                (std::array::from_fn(|c| inertial_rate[c]), fixed),
            ];
            for (case, (rates, direction)) in cases.into_iter().enumerate() {
                let (velocity, acceleration) =
                    moved(mu, orbit, [rates[0], rates[1], rates[2], rates[3], rates[4], rates[5]]);
                let thrust = if case == 0 { 0.0 } else { flight.engine.thrust };
                let pull = gravity(&flight, r);
                let scale = vector::norm(&pull, 0.0);
                for c in 0..3 {
                    assert!(
                        (velocity[c] - v[c]).abs() < ROUNDING * vector::norm(&v, 0.0),
                        "{orbit:?} {case}"
                    );
                    let expected = pull[c] + direction[c] * thrust / mass;
                    assert!((acceleration[c] - expected).abs() < ROUNDING * scale, "{orbit:?} {case}");
                }
                assert!((rates[6] + thrust * 6.14 / 20e3).abs() < 0.1 * ROUNDING);
            }
        }
    }
}

/// Retrograde elements with `h` negated obey the same equations.
#[test]
fn retrograde_elements_obey_the_same_equations() {
    let (mass, flight) = (2.1e4, breeze().with_j2(0.1));
    let mu = flight.body.gravitational_parameter;
    for [p, f, g, h, k, l] in ORBITS {
        let rates = SpatialThrust(flight).rate(0.0, &[p, f, g, -h, k, l, mass], &[0.0, 0.5 * PI], &[]);
        let seeded = |re: f64, rate: f64| Dual::<1> { re, eps: [rate] };
        let state = Equinoctial {
            semi_latus_rectum: seeded(p, rates[0]),
            f: seeded(f, rates[1]),
            g: seeded(g, rates[2]),
            h: seeded(h, -rates[3]),
            k: seeded(k, rates[4]),
            true_longitude: seeded(l, rates[5]),
            sense: Sense::Retrograde,
        }
        .to_cartesian(mu);
        let pull = gravity(&flight, state.position.map(|c| c.re));
        let scale = vector::norm(&pull, 0.0);
        let (r, v) = (state.position.map(|c| c.re), state.velocity.map(|c| c.re));
        let momentum = vector::cross(&r, &v);
        let size = vector::norm(&momentum, 0.0);
        for c in 0..3 {
            assert!((state.position[c].eps[0] - v[c]).abs() < ROUNDING * vector::norm(&v, 0.0));
            let expected = pull[c] + momentum[c] / size * flight.engine.thrust / mass;
            assert!((state.velocity[c].eps[0] - expected).abs() < ROUNDING * scale);
        }
    }
}

/// Equatorial orbits: the planar models are the spatial ones.
#[test]
fn flight_in_the_plane_is_flight_in_space() {
    let mass = 1.9e4;
    for flight in [breeze(), breeze().with_j2(EARTH_J2)] {
        for [p, f, g, _, _, l] in ORBITS {
            let flat = [p, f, g, l, mass];
            let x = [p, f, g, 0.0, 0.0, l, mass];
            let a = 2.2;
            let fixed = PlanarInertialThrust(flight).rate(0.0, &[p, f, g, l, mass, a], &[], &[]);
            let spatial =
                SpatialInertialThrust(flight).rate(0.0, &[p, f, g, 0.0, 0.0, l, mass, a, 0.0], &[], &[]);
            assert_eq!(fixed[5], 0.0);
            let pairs: [([f64; 5], [f64; 7]); 4] = [
                (
                    PlanarCoast(flight).rate(0.0, &flat, &[], &[]),
                    SpatialCoast(flight).rate(0.0, &x, &[], &[]),
                ),
                (
                    PlanarThrust(flight).rate(0.0, &flat, &[0.7], &[]),
                    SpatialThrust(flight).rate(0.0, &x, &[0.7, 0.0], &[]),
                ),
                (
                    PlanarVelocityThrust(flight).rate(0.0, &flat, &[], &[]),
                    SpatialVelocityThrust(flight).rate(0.0, &x, &[], &[]),
                ),
                (std::array::from_fn(|c| fixed[c]), std::array::from_fn(|c| spatial[c])),
            ];
            for (planar, [p1, f1, g1, h1, k1, l1, m1]) in pairs {
                for (a, b) in planar.into_iter().zip([p1, f1, g1, l1, m1]) {
                    assert!((a - b).abs() <= ROUNDING * (b.abs() + 1e-3), "{a} {b}");
                }
                assert_eq!([h1, k1], [0.0, 0.0]);
            }
        }
    }
}

#[test]
fn a_circular_orbit_keeps_its_elements() {
    let flight = breeze();
    let r = 6_578_137.0;
    let rate = PlanarCoast(flight).rate(0.0, &[r, 0.0, 0.0, 1.0, 2.2e4], &[], &[]);
    assert_eq!([rate[0], rate[1], rate[2], rate[4]], [0.0; 4]);
    let speed = flight.body.circular_speed(200e3).unwrap();
    // Speed of the parking orbit of the reference: 7784.2617485656265 m/s.
    assert!((speed - 7_784.261_748_565_626).abs() < 1e5 * ROUNDING);
    assert!((rate[3] - speed / r).abs() < 1e-4 * ROUNDING);
}

/// A solver gets formulas of the models, and for a coast the rate of the true longitude as the only one that depends on the state.
#[test]
fn models_have_formulas_and_patterns() {
    let flight = breeze().with_j2(EARTH_J2);
    let nodes = [
        dynamics_node(PlanarThrust(flight)),
        dynamics_node(PlanarVelocityThrust(flight)),
        dynamics_node(PlanarInertialThrust(flight)),
        dynamics_node(SpatialThrust(flight)),
        dynamics_node(SpatialVelocityThrust(flight)),
        dynamics_node(SpatialInertialThrust(flight)),
        dynamics_node(PlanarCoast(flight)),
        dynamics_node(SpatialCoast(flight)),
    ];
    for node in nodes {
        assert!(node.formula().is_ok());
    }
    let coasts = [dynamics_node(PlanarCoast(breeze())), dynamics_node(SpatialCoast(breeze()))];
    for (node, row) in coasts.into_iter().zip([3, 5]) {
        let entries: Vec<_> = node.pattern().jacobian_entries().collect();
        assert_eq!(entries, [(row, 0), (row, 1), (row, 2), (row, row)]);
    }
}
