//! The same flight in every set of coordinates, by the integrator of `apsides-ode`; Kepler's motion against integration.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{PI, TAU};

use apsides_ad::Dynamics;
use apsides_dynamics::cartesian::{
    CartesianCoast, CartesianInertialThrust, CartesianThrust, CartesianVelocityThrust,
};
use apsides_dynamics::elements::{Cartesian, Classical, Equinoctial, PlanarEquinoctial, Sense};
use apsides_dynamics::equinoctial::{
    EARTH_J2, OrbitalFlight, PlanarCoast, PlanarInertialThrust, PlanarThrust, PlanarVelocityThrust,
    SpatialCoast, SpatialInertialThrust, SpatialThrust, SpatialVelocityThrust,
};
use apsides_dynamics::planar::{ConstantThrust, PlanarFlight};
use apsides_dynamics::{Body, Engine, kepler};
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-10;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

const MU: f64 = Body::EARTH.gravitational_parameter;

/// Published: the drift of the node to first order in J2, relative.
const FIRST_ORDER: f64 = 5e-3;

/// Published: the same, against the mean motion of the Sun, deg a day.
const SUN_DEG: f64 = 0.01;

/// Breeze-M: 20 kN, 6.14 kg/s.
fn breeze() -> OrbitalFlight {
    OrbitalFlight::new(Body::EARTH, Engine::with_exhaust_velocity(20e3, 20e3 / 6.14).unwrap())
}

/// The state after a time, from a model with its controls as a function of time; `size` is the size of each state.
fn fly<M: Dynamics<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    start: [f64; NX],
    size: [f64; NX],
    duration: f64,
    steering: impl Fn(f64) -> [f64; NU],
) -> [f64; NX] {
    let system = FnSystem::new(NX, |t, x: &[f64], dx: &mut [f64]| {
        let x: [f64; NX] = x.try_into().unwrap();
        dx.copy_from_slice(&model.rate(t, &x, &steering(t), &[]));
    });
    let settings = OdeSettings {
        relative_tolerance: 1e-13,
        absolute_tolerance: Tolerance::PerComponent(size.iter().map(|s| 1e-13 * s).collect()),
        ..OdeSettings::default()
    };
    let mut end = [0.0; NX];
    let summary =
        Integrator::new(NX, settings).unwrap().integrate(&system, 0.0, &start, duration, &mut end).unwrap();
    assert_eq!(summary.status, Status::Completed);
    end
}

const PLANAR: [f64; 5] = [1e7, 1.0, 1.0, 1.0, 1e4];
const SPATIAL: [f64; 7] = [1e7, 1.0, 1.0, 1.0, 1.0, 1.0, 1e4];
const CARTESIAN: [f64; 7] = [1e7, 1e7, 1e7, 1e4, 1e4, 1e4, 1e4];

/// Adds the two angles of an inertial thrust to a state.
fn with_direction(x: [f64; 7], [longitude, latitude]: [f64; 2]) -> [f64; 9] {
    std::array::from_fn(|k| if k < 7 { x[k] } else { [longitude, latitude][k - 7] })
}

fn without_direction(x: [f64; 9]) -> [f64; 7] {
    std::array::from_fn(|k| x[k])
}

fn length(a: &[f64; 3]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Asserts that two states agree to 1e-10 of radius, speed and mass.
fn assert_same(what: &str, (a, mass_a): (Cartesian, f64), (b, mass_b): (Cartesian, f64)) {
    let apart = |x: &[f64; 3], y: &[f64; 3]| length(&[x[0] - y[0], x[1] - y[1], x[2] - y[2]]) / length(y);
    let (far, fast) = (apart(&a.position, &b.position), apart(&a.velocity, &b.velocity));
    assert!(far < INTEGRATION && fast < INTEGRATION, "{what}: {far:e} {fast:e}");
    assert!((mass_a - mass_b).abs() < ROUNDING * mass_b, "{what}: {mass_a} {mass_b}");
}

fn of_plane([p, f, g, l, m]: [f64; 5]) -> (Cartesian, f64) {
    (Equinoctial::prograde([p, f, g, 0.0, 0.0, l]).to_cartesian(MU), m)
}

fn of_space([p, f, g, h, k, l, m]: [f64; 7]) -> (Cartesian, f64) {
    (Equinoctial::prograde([p, f, g, h, k, l]).to_cartesian(MU), m)
}

fn of_cartesian([x, y, z, vx, vy, vz, m]: [f64; 7]) -> (Cartesian, f64) {
    (Cartesian { position: [x, y, z], velocity: [vx, vy, vz] }, m)
}

fn cartesian_start(elements: [f64; 6], m: f64) -> [f64; 7] {
    let Cartesian { position: [x, y, z], velocity: [vx, vy, vz] } =
        Equinoctial::prograde(elements).to_cartesian(MU);
    [x, y, z, vx, vy, vz, m]
}

/// A burn of 1500 s in the equatorial plane with changing pitch, from a slightly eccentric parking orbit.
#[test]
fn a_burn_in_the_plane_ends_alike_in_every_set_of_coordinates() {
    let [p, f, g, l, m] = [6.7e6, 0.01, -0.02, 0.4, 22_170.0];
    let (elements, duration) = ([p, f, g, 0.0, 0.0, l], 1500.0);
    let pitch = |t: f64| 0.3 * (t / 300.0).sin() - 0.1;
    for j2 in [0.0, EARTH_J2] {
        let flight = breeze().with_j2(j2);
        let start = cartesian_start(elements, m);
        let spatial = [p, f, g, 0.0, 0.0, l, m];

        let steered =
            of_cartesian(fly(&CartesianThrust(flight), start, CARTESIAN, duration, |t| [pitch(t), 0.0]));
        let plane = fly(&PlanarThrust(flight), [p, f, g, l, m], PLANAR, duration, |t| [pitch(t)]);
        assert_same("planar elements", of_plane(plane), steered);
        let space = fly(&SpatialThrust(flight), spatial, SPATIAL, duration, |t| [pitch(t), 0.0]);
        assert_same("spatial elements", of_space(space), steered);
        if j2 == 0.0 {
            let polar = PlanarEquinoctial::new([p, f, g, l]).to_polar(MU);
            let model = ConstantThrust(PlanarFlight::new(flight.body, flight.engine));
            let x = [polar.radius, polar.angle, polar.horizontal_speed, polar.radial_speed, m];
            let [r, angle, u, v, m] = fly(&model, x, [1e7, 1.0, 1e4, 1e4, 1e4], duration, |t| [pitch(t)]);
            let (sin, cos) = angle.sin_cos();
            let position = [r * cos, r * sin, 0.0];
            let velocity = [v * cos - u * sin, v * sin + u * cos, 0.0];
            assert_same("polar coordinates", (Cartesian { position, velocity }, m), steered);
        }

        let along = of_cartesian(fly(&CartesianVelocityThrust(flight), start, CARTESIAN, duration, |_| []));
        let plane = fly(&PlanarVelocityThrust(flight), [p, f, g, l, m], PLANAR, duration, |_| []);
        assert_same("along the velocity, planar elements", of_plane(plane), along);
        let space = fly(&SpatialVelocityThrust(flight), spatial, SPATIAL, duration, |_| []);
        assert_same("along the velocity, spatial elements", of_space(space), along);

        let direction = [2.3, 0.0];
        let size = with_direction(CARTESIAN, [1.0; 2]);
        let model = CartesianInertialThrust(flight);
        let fixed = of_cartesian(without_direction(fly(
            &model,
            with_direction(start, direction),
            size,
            duration,
            |_| [],
        )));
        let x = [p, f, g, l, m, direction[0]];
        let end = fly(&PlanarInertialThrust(flight), x, [1e7, 1.0, 1.0, 1.0, 1e4, 1.0], duration, |_| []);
        assert_same("fixed, planar elements", of_plane([end[0], end[1], end[2], end[3], end[4]]), fixed);
    }
}

/// The same out of the plane, from an inclined orbit.
#[test]
fn a_burn_in_space_ends_alike_in_every_set_of_coordinates() {
    let (elements, m, duration) = ([7.2e6, 0.1, -0.05, 0.2, 0.15, 5.0], 22_170.0, 1500.0);
    let steering = |t: f64| [0.3 * (t / 300.0).sin() - 0.1, 0.5 * (t / 400.0).cos()];
    let direction = [2.3, -0.7];
    for j2 in [0.0, EARTH_J2] {
        let flight = breeze().with_j2(j2);
        let start = cartesian_start(elements, m);
        let [p, f, g, h, k, l] = elements;
        let x = [p, f, g, h, k, l, m];

        let a = fly(&CartesianThrust(flight), start, CARTESIAN, duration, steering);
        let b = fly(&SpatialThrust(flight), x, SPATIAL, duration, steering);
        assert_same("steered", of_space(b), of_cartesian(a));

        let a = fly(&CartesianVelocityThrust(flight), start, CARTESIAN, duration, |_| []);
        let b = fly(&SpatialVelocityThrust(flight), x, SPATIAL, duration, |_| []);
        assert_same("along the velocity", of_space(b), of_cartesian(a));

        let size = with_direction(CARTESIAN, [1.0; 2]);
        let a =
            fly(&CartesianInertialThrust(flight), with_direction(start, direction), size, duration, |_| []);
        let size = with_direction(SPATIAL, [1.0; 2]);
        let b = fly(&SpatialInertialThrust(flight), with_direction(x, direction), size, duration, |_| []);
        assert_same("fixed", of_space(without_direction(b)), of_cartesian(without_direction(a)));

        let a = fly(&CartesianCoast(flight), start, CARTESIAN, 2e4, |_| []);
        let b = fly(&SpatialCoast(flight), x, SPATIAL, 2e4, |_| []);
        assert_same("coast", of_space(b), of_cartesian(a));
    }
}

/// Kepler's motion against integration: ellipse over revolutions, near-parabola, hyperbola, forward and backward.
#[test]
fn keplers_motion_is_what_integration_gives() {
    let orbit = |eccentricity, true_anomaly| Classical {
        semi_latus_rectum: 1.2e7,
        eccentricity,
        inclination: 0.7,
        node: 1.0,
        periapsis: 4.0,
        true_anomaly,
    };
    for (eccentricity, true_anomaly, duration) in [
        (0.0, 0.3, 5e4),
        (0.3, 2.0, 5e4),
        (0.3, 2.0, -5e4),
        (0.8, -1.0, 2e5),
        (1.0 - 1e-10, -2.0, 3e4),
        (1.0, -2.0, 3e4),
        (1.0 + 1e-10, 1.5, -3e4),
        (2.5, -1.7, 3e4),
        (2.5, 1.2, -1e4),
    ] {
        let start = orbit(eccentricity, true_anomaly).to_cartesian(MU).unwrap();
        let ([x, y, z], [vx, vy, vz]) = (start.position, start.velocity);
        let end = fly(&CartesianCoast(breeze()), [x, y, z, vx, vy, vz, 1e4], CARTESIAN, duration, |_| []);
        let kepler = kepler::propagate(MU, &start, duration).unwrap();
        assert_same(&format!("e = {eccentricity}"), (kepler, 1e4), of_cartesian(end));
    }
}

/// The duration of a coast between longitudes against integration, over a part of a revolution and over several.
#[test]
fn the_duration_of_a_coast_is_what_integration_takes() {
    let [p, f, g, from] = [1.1e7, 0.5, -0.4, 0.3];
    for to in [0.5, 2.0, 4.0, 6.5, 20.0] {
        let duration = kepler::coast_duration(MU, p, f, g, from, to);
        let end = fly(&PlanarCoast(breeze()), [p, f, g, from, 1e4], PLANAR, duration, |_| []);
        assert!((end[3] - to).abs() < INTEGRATION, "{} {to}", end[3]);
    }
}

/// Drift of the node by the oblateness: -(3/2) n J2 (Re / p)^2 cos(i) (Vallado 2013, section 9.6), to first order in J2. At 800 km and
/// 98.6 deg that is the Sun's 0.9856 deg a day.
#[test]
fn the_node_of_a_sun_synchronous_orbit_follows_the_sun() {
    let (a, inclination) = (7_178_137.0_f64, 98.6_f64.to_radians());
    let start = Classical {
        semi_latus_rectum: a,
        eccentricity: 0.0,
        inclination,
        node: 0.5,
        periapsis: 0.0,
        true_anomaly: 0.0,
    };
    let [p, f, g, h, k, l] = start.to_equinoctial(Sense::Prograde).unwrap().array();
    let n = (MU / a.powi(3)).sqrt();
    // Whole revolutions, after which periodic terms are the same.
    let duration = 14.0 * TAU / n;
    let x = [p, f, g, h, k, l, 1e4];
    let [p, f, g, h, k, l, _] = fly(&SpatialCoast(breeze().with_j2(EARTH_J2)), x, SPATIAL, duration, |_| []);
    let end = Equinoctial::prograde([p, f, g, h, k, l]).to_classical().unwrap();
    let drift = (end.node - 0.5) / duration;
    let expected = -1.5 * n * EARTH_J2 * (Body::EARTH.radius / a).powi(2) * inclination.cos();
    assert!((drift / expected - 1.0).abs() < FIRST_ORDER, "{drift} {expected}");
    assert!((drift * 86_400.0 * 180.0 / PI - 0.9856).abs() < SUN_DEG, "{}", drift * 86_400.0 * 180.0 / PI);
}

/// The first of two burns of Alavipour, Nikkhah and Roshanian (Modares Mechanical Engineering 18(1), 2018, table 2: 12480 kg of 22.17 t
/// from a circular orbit of 6578.137 km), but along the velocity, reaches a semi-major axis of 25462 km in an independent integration.
#[test]
fn a_perigee_burn_along_the_velocity() {
    let start = [6_578_137.0, 0.0, 0.0, 0.0, 22_170.0];
    let [p, f, g, _, m] = fly(&PlanarVelocityThrust(breeze()), start, PLANAR, 12_480.0 / 6.14, |_| []);
    let a = p / (1.0 - f * f - g * g);
    assert!((a - 25_462e3).abs() < 500.0, "{a}");
    assert!((m - 9690.0).abs() < 100.0 * INTEGRATION, "{m}");
}
