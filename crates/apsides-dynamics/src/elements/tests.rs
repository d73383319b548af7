use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

use super::*;
use crate::Body;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 1e-6;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

const MU: f64 = Body::EARTH.gravitational_parameter;

/// Published: elements with four digits, of a state with as few, deg.
const PUBLISHED_DEG: f64 = 0.06;

/// Largest difference of two states, position by radius and velocity by the speed `sqrt(mu / r)`.
fn distance(a: &Cartesian, b: &Cartesian) -> f64 {
    let radius = length(&b.position);
    let speed = (MU / radius).sqrt().max(length(&b.velocity));
    let far = |x: &[f64; 3], y: &[f64; 3], unit: f64| length(&std::array::from_fn(|c| x[c] - y[c])) / unit;
    far(&a.position, &b.position, radius).max(far(&a.velocity, &b.velocity, speed))
}

fn apart(a: f64, b: f64) -> f64 {
    let turned = (a - b).rem_euclid(TAU);
    turned.min(TAU - turned)
}

/// Values that are special in the middle of ordinary ones.
fn with_limits(ordinary: impl Strategy<Value = f64>, limits: &'static [f64]) -> impl Strategy<Value = f64> {
    prop_oneof![3 => ordinary, 1 => prop::sample::select(limits)]
}

/// Circular, elliptic, parabolic and hyperbolic orbits of any inclination, equatorial and retrograde ones and what is near them
/// included; the true anomaly within 90 % of the asymptotes.
fn orbits() -> impl Strategy<Value = Classical> {
    let eccentricity =
        with_limits(0.0..3.0, &[0.0, 1e-15, 1e-13, 1e-8, 1.0 - 1e-9, 1.0 - 1e-15, 1.0, 1.0 + 1e-12]);
    let inclination = with_limits(0.0..PI, &[0.0, 1e-15, 1e-9, 0.5 * PI, PI - 1e-9, PI - 1e-15, PI]);
    let angle = || with_limits(0.0..TAU, &[0.0, 0.5 * PI, PI, 1.5 * PI]);
    (6.4e6..1e9_f64, eccentricity, inclination, angle(), angle(), -0.9..0.9_f64).prop_map(
        |(semi_latus_rectum, eccentricity, inclination, node, periapsis, part)| {
            let widest = if eccentricity < 1.0 { PI } else { (-1.0 / eccentricity).acos() };
            let true_anomaly = part * widest;
            Classical { semi_latus_rectum, eccentricity, inclination, node, periapsis, true_anomaly }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Classical to Cartesian and back: the same state; the same elements where they are defined, to rounding errors divided by
    /// what defines them.
    #[test]
    fn classical_elements_and_states(orbit in orbits()) {
        let state = orbit.to_cartesian(MU).unwrap();
        let back = state.to_classical(MU).unwrap();
        prop_assert!((back.semi_latus_rectum / orbit.semi_latus_rectum - 1.0).abs() < ROUNDING);
        prop_assert!((back.eccentricity - orbit.eccentricity).abs() < 0.1 * ROUNDING * (1.0 + orbit.eccentricity));
        prop_assert!((back.inclination - orbit.inclination).abs() < 0.1 * ROUNDING);
        prop_assert!((0.0..TAU).contains(&back.node) && (0.0..TAU).contains(&back.periapsis));
        prop_assert!((0.0..=PI).contains(&back.inclination) && back.true_anomaly.abs() <= PI);
        let (lean, e) = (orbit.inclination.sin(), orbit.eccentricity);
        if lean > 1e-3 {
            prop_assert!(apart(back.node, orbit.node) < 0.1 * ROUNDING / lean);
        }
        if e > 1e-3 {
            prop_assert!(apart(back.true_anomaly, orbit.true_anomaly) < 0.1 * ROUNDING * (1.0 + 1.0 / e));
            if lean > 1e-3 {
                prop_assert!(apart(back.periapsis, orbit.periapsis) < 0.1 * ROUNDING * (1.0 + 1.0 / e) / lean);
            }
        }
        prop_assert!(distance(&back.to_cartesian(MU).unwrap(), &state) < ROUNDING);
    }

    /// Both senses hold the same orbit, as far as they are regular there.
    #[test]
    fn equinoctial_elements_and_states(orbit in orbits()) {
        let state = orbit.to_cartesian(MU).unwrap();
        for sense in [Sense::Prograde, Sense::Retrograde] {
            let lean = match sense {
                Sense::Prograde => PI - orbit.inclination,
                Sense::Retrograde => orbit.inclination,
            };
            if lean < 0.1 {
                continue;
            }
            let elements = state.to_equinoctial(MU, sense);
            prop_assert!(distance(&elements.to_cartesian(MU), &state) < ROUNDING);
            let direct = orbit.to_equinoctial(sense).unwrap();
            prop_assert!(distance(&direct.to_cartesian(MU), &state) < ROUNDING);
            prop_assert!((elements.semi_latus_rectum / orbit.semi_latus_rectum - 1.0).abs() < ROUNDING);
            for (a, b) in [(elements.f, direct.f), (elements.g, direct.g), (elements.h, direct.h), (elements.k, direct.k)] {
                prop_assert!((a - b).abs() < ROUNDING * (1.0 + b * b) * (1.0 + orbit.eccentricity), "{a} {b}");
            }
            let classical = elements.to_classical().unwrap();
            prop_assert!(distance(&classical.to_cartesian(MU).unwrap(), &state) < ROUNDING);
        }
    }

    /// The retrograde elements are the prograde ones in the frame turned about its first axis, `h` negated.
    #[test]
    fn retrograde_elements_are_prograde_ones_of_a_turned_frame(orbit in orbits()) {
        let orbit = Classical { inclination: orbit.inclination.max(0.1), ..orbit };
        let state = orbit.to_cartesian(MU).unwrap();
        let turn = |[x, y, z]: [f64; 3]| [x, -y, -z];
        let turned = Cartesian { position: turn(state.position), velocity: turn(state.velocity) };
        let [p, f, g, h, k, l] = state.to_equinoctial(MU, Sense::Retrograde).array();
        prop_assert_eq!(turned.to_equinoctial(MU, Sense::Prograde).array(), [p, f, g, -h, k, l]);
    }

    /// Polar coordinates in the plane, with revolutions of the angle.
    #[test]
    fn planar_elements_and_states(orbit in orbits(), turns in -3_i32..4) {
        let flat = Classical { inclination: 0.0, node: 0.0, ..orbit };
        let mut elements = flat.to_equinoctial(Sense::Prograde).unwrap().in_plane();
        elements.true_longitude += TAU * f64::from(turns);
        let polar = elements.to_polar(MU);
        prop_assert_eq!(polar.angle, elements.true_longitude);
        let back = polar.checked().unwrap().to_equinoctial(MU);
        prop_assert!((back.semi_latus_rectum / elements.semi_latus_rectum - 1.0).abs() < ROUNDING);
        let e = orbit.eccentricity;
        prop_assert!((back.f - elements.f).abs() < 0.1 * ROUNDING * (1.0 + e) && (back.g - elements.g).abs() < 0.1 * ROUNDING * (1.0 + e));
        // The same point in space.
        let (sin, cos) = polar.angle.sin_cos();
        let at = |radial: f64, transverse: f64| [radial * cos - transverse * sin, radial * sin + transverse * cos, 0.0];
        let state = Cartesian { position: at(polar.radius, 0.0), velocity: at(polar.radial_speed, polar.horizontal_speed) };
        prop_assert!(distance(&state, &flat.to_cartesian(MU).unwrap()) < ROUNDING);
    }
}

/// Vallado 2013, example 2-5: classical elements of a state, printed to six digits.
#[test]
fn elements_of_a_state_of_the_literature() {
    let state = Cartesian {
        position: [6524.834e3, 6862.875e3, 6448.296e3],
        velocity: [4901.327, 5533.756, -1976.341],
    };
    let orbit = state.to_classical(MU).unwrap();
    assert!((orbit.semi_latus_rectum - 11_067.790e3).abs() < 10.0, "{orbit:?}");
    assert!((orbit.semi_major_axis() - 36_127.343e3).abs() < 10.0, "{orbit:?}");
    assert!((orbit.eccentricity - 0.832_853).abs() < PUBLISHED, "{orbit:?}");
    for (angle, degrees) in [
        (orbit.inclination, 87.870),
        (orbit.node, 227.898),
        (orbit.periapsis, 53.38),
        (orbit.true_anomaly, 92.335),
    ] {
        assert!(
            (angle.to_degrees() - degrees).abs() < 6000.0 * PUBLISHED,
            "{} {degrees}",
            angle.to_degrees()
        );
    }
}

/// Vallado 2013, example 2-6: the state of rounded elements.
#[test]
fn state_of_elements_of_the_literature() {
    let orbit = Classical {
        semi_latus_rectum: 11_067.790e3,
        eccentricity: 0.83285,
        inclination: 87.87_f64.to_radians(),
        node: 227.89_f64.to_radians(),
        periapsis: 53.38_f64.to_radians(),
        true_anomaly: 92.335_f64.to_radians(),
    };
    let state = orbit.to_cartesian(MU).unwrap();
    for (a, b) in state.position.into_iter().zip([6525.344e3, 6861.535e3, 6449.125e3]) {
        assert!((a - b).abs() < 500.0, "{a} {b}");
    }
    for (a, b) in state.velocity.into_iter().zip([4902.276, 5533.124, -1975.709]) {
        assert!((a - b).abs() < 0.5, "{a} {b}");
    }
}

/// Curtis, Orbital Mechanics for Engineering Students, example 4.3 (mu = 398600 km3/s2).
#[test]
fn elements_of_another_state_of_the_literature() {
    let state = Cartesian { position: [-6045e3, -3490e3, 2500e3], velocity: [-3457.0, 6618.0, 2533.0] };
    let orbit = state.to_classical(398_600e9).unwrap();
    let momentum = (orbit.semi_latus_rectum * 398_600e9).sqrt();
    assert!((momentum - 58_310e6).abs() < 5e6, "{momentum}");
    assert!((orbit.eccentricity - 0.1712).abs() < 50.0 * PUBLISHED, "{orbit:?}");
    for (angle, degrees) in [
        (orbit.inclination, 153.2),
        (orbit.node, 255.3),
        (orbit.periapsis, 20.07),
        (orbit.true_anomaly, 28.45),
    ] {
        assert!((angle.to_degrees() - degrees).abs() < PUBLISHED_DEG, "{} {degrees}", angle.to_degrees());
    }
}

#[test]
fn undefined_angles_follow_the_convention() {
    let (r, v) = (7e6, (MU / 7e6).sqrt());
    // Circular and equatorial, a quarter of a revolution from the first axis.
    let state = Cartesian { position: [0.0, r, 0.0], velocity: [-v, 0.0, 0.0] };
    let orbit = state.to_classical(MU).unwrap();
    assert_eq!([orbit.eccentricity, orbit.inclination, orbit.node, orbit.periapsis], [0.0; 4]);
    assert!((orbit.true_anomaly - 0.5 * PI).abs() < 1e-3 * ROUNDING);
    // The same the other way round.
    let state = Cartesian { position: [0.0, r, 0.0], velocity: [v, 0.0, 0.0] };
    let orbit = state.to_classical(MU).unwrap();
    assert_eq!([orbit.eccentricity, orbit.inclination, orbit.node, orbit.periapsis], [0.0, PI, 0.0, 0.0]);
    assert!((orbit.true_anomaly + 0.5 * PI).abs() < 1e-3 * ROUNDING);
    // Circular and polar: the anomaly counts from the node.
    let state = Cartesian { position: [0.0, 0.0, r], velocity: [0.0, -v, 0.0] };
    let orbit = state.to_classical(MU).unwrap();
    assert_eq!([orbit.eccentricity, orbit.periapsis], [0.0; 2]);
    assert!(
        (orbit.node - 0.5 * PI).abs() < 1e-3 * ROUNDING
            && (orbit.true_anomaly - 0.5 * PI).abs() < 1e-3 * ROUNDING
    );
    // Equatorial ellipse: the argument of periapsis counts from the first axis.
    let state = Cartesian { position: [0.0, r, 0.0], velocity: [-1.1 * v, 0.0, 0.0] };
    let orbit = state.to_classical(MU).unwrap();
    assert!(
        (orbit.periapsis - 0.5 * PI).abs() < 1e-3 * ROUNDING
            && orbit.true_anomaly.abs() < 1e-3 * ROUNDING
            && orbit.node == 0.0
    );
    assert!((orbit.eccentricity - 0.21).abs() < 1e-3 * ROUNDING);
}

#[test]
fn sizes_of_an_orbit() {
    let orbit = Classical::with_semi_major_axis(24_371e3, 0.73, 0.5, 0.0, 0.0, 0.0).unwrap();
    assert!((orbit.semi_major_axis() - 24_371e3).abs() < 1e4 * ROUNDING);
    assert!((orbit.periapsis_radius() - 24_371e3 * 0.27).abs() < 1e4 * ROUNDING);
    assert!((orbit.apoapsis_radius() - 24_371e3 * 1.73).abs() < 1e4 * ROUNDING);
    assert!((orbit.period(MU) - TAU * (24_371e3_f64.powi(3) / MU).sqrt()).abs() < 1e3 * ROUNDING);
    let hyperbola = Classical::with_semi_major_axis(-2e7, 1.5, 0.5, 0.0, 0.0, 0.0).unwrap();
    assert!((hyperbola.semi_latus_rectum - 2.5e7).abs() < 1e4 * ROUNDING);
    assert!(hyperbola.period(MU).is_infinite() && hyperbola.apoapsis_radius().is_infinite());
}

#[test]
fn what_is_no_orbit_is_refused() {
    let orbit = Classical {
        semi_latus_rectum: 1e7,
        eccentricity: 1.5,
        inclination: 0.3,
        node: 1.0,
        periapsis: 2.0,
        true_anomaly: 0.5,
    };
    orbit.checked().unwrap();
    let message = |o: Classical| o.to_cartesian(MU).unwrap_err().to_string();
    assert_eq!(
        message(Classical { eccentricity: -0.1, ..orbit }),
        "eccentricity is -0.1 -, allowed is a finite number from 0 on"
    );
    assert_eq!(
        message(Classical { semi_latus_rectum: 0.0, ..orbit }),
        "semi-latus rectum is 0 m, allowed is a positive finite number"
    );
    assert_eq!(message(Classical { inclination: 4.0, ..orbit }), "inclination is 4 rad, allowed is 0 to pi");
    assert_eq!(
        message(Classical { true_anomaly: 2.5, ..orbit }),
        "true anomaly is 2.5 rad, allowed is what lies between the asymptotes of the orbit"
    );
    for k in 0..6 {
        let mut e = [1e7, 0.1, 0.3, 1.0, 2.0, 0.5];
        e[k] = f64::NAN;
        let [semi_latus_rectum, eccentricity, inclination, node, periapsis, true_anomaly] = e;
        let bad = Classical { semi_latus_rectum, eccentricity, inclination, node, periapsis, true_anomaly };
        assert!(bad.checked().is_err());
        let [p, f, g, h, k, l] = e;
        assert!(Equinoctial::prograde([p, f, g, h, k, l]).to_classical().is_err());
        let state = Cartesian { position: [p, f, g], velocity: [h, k, l] };
        assert!(state.to_classical(MU).is_err());
    }
    assert!(Classical { inclination: PI, ..orbit }.to_equinoctial(Sense::Prograde).is_err());
    assert!(Classical { inclination: 0.0, ..orbit }.to_equinoctial(Sense::Retrograde).is_err());
    assert!(Classical::with_semi_major_axis(1e7, 1.0, 0.3, 1.0, 2.0, 0.5).is_err());
    assert!(Classical::with_semi_major_axis(1e7, 1.1, 0.3, 1.0, 2.0, 0.5).is_err());
    assert!(orbit.to_cartesian(0.0).is_err());
    let centre = Cartesian { position: [0.0; 3], velocity: [0.0, 1e3, 0.0] };
    assert_eq!(
        centre.checked().unwrap_err().to_string(),
        "distance from the centre of the body is 0 m, allowed is a positive finite number"
    );
    for velocity in [[0.0; 3], [1e3, 2e3, 3e3], [-1e3, -2e3, -3e3]] {
        let falling = Cartesian { position: [1e6, 2e6, 3e6], velocity };
        assert!(matches!(falling.checked(), Err(DynamicsError::Rectilinear { .. })));
    }
    let backward = PlanarPolar { radius: 7e6, angle: 0.0, horizontal_speed: -7e3, radial_speed: 0.0 };
    assert!(backward.checked().is_err());
}

/// The smooth conversions carry derivatives: position and velocity are what one step of Kepler's motion says.
#[test]
fn conversions_carry_derivatives() {
    use apsides_ad::Dual;
    let orbit = Equinoctial::prograde([1.2e7, -0.3, 0.4, 0.2, -0.1, 1.0]);
    let state = orbit.to_cartesian(MU);
    let r = length(&state.position);
    let seeded = Cartesian {
        position: std::array::from_fn(|c| Dual::<1> { re: state.position[c], eps: [state.velocity[c]] }),
        velocity: std::array::from_fn(|c| Dual::<1> {
            re: state.velocity[c],
            eps: [-MU * state.position[c] / (r * r * r)],
        }),
    };
    let moved = seeded.to_equinoctial(MU, Sense::Prograde).array();
    let rate = (MU * 1.2e7).sqrt() / (r * r);
    for (k, element) in moved.into_iter().enumerate() {
        let (expected, unit) = if k == 5 { (rate, rate) } else { (0.0, rate * element.re.abs()) };
        assert!((element.eps[0] - expected).abs() < 1e-2 * ROUNDING * unit, "{k} {}", element.eps[0]);
    }
}
