use proptest::prelude::*;

use apsides_ad::{Dual, VectorFunction, vector, vector_node};

use super::*;
use crate::Body;
use crate::elements::{Cartesian, Classical};

/// Discretisation: difference quotients, by their steps.
const DIFFERENCES: f64 = 1e-8;

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 5e-9;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

const MU: f64 = Body::EARTH.gravitational_parameter;

/// Discretisation: the speed after a thousand years against its limit, relative.
const ASYMPTOTE_SPEED: f64 = 1e-7;

/// Discretisation: the distance after a thousand years against that at the last speed, relative.
const ASYMPTOTE_DISTANCE: f64 = 1e-5;

fn length(a: &[f64; 3]) -> f64 {
    vector::norm(a, 0.0)
}

fn apart(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    length(&std::array::from_fn(|c| a[c] - b[c]))
}

/// Vallado 2013, examples 2-1, 2-2 and 2-3.
#[test]
fn keplers_equation_of_the_literature() {
    let e = eccentric_anomaly(235.4_f64.to_radians(), 0.4).unwrap();
    assert!((e.to_degrees() - 220.512_074_767_522).abs() < 1e3 * ROUNDING, "{}", e.to_degrees());
    let h = hyperbolic_anomaly(235.4_f64.to_radians(), 2.4).unwrap();
    assert!((h - 1.601_376_144).abs() < PUBLISHED, "{h}");
    // 53.7874 min after the periapsis of a parabola with p = 25512 km.
    let p = 25_512e3_f64;
    let d = parabolic_anomaly(2.0 * (MU / p.powi(3)).sqrt() * 53.7874 * 60.0).unwrap();
    assert!((d - 0.817_751).abs() < 1e3 * PUBLISHED, "{d}");
}

/// Vallado 2013, example 2-4: 40 minutes on an ellipse.
#[test]
fn a_flight_of_the_literature() {
    let state =
        Cartesian { position: [1131.340e3, -2282.343e3, 6672.423e3], velocity: [-5643.05, 4303.33, 2428.79] };
    let end = propagate(MU, &state, 2400.0).unwrap();
    assert!(apart(&end.position, &[-4219.7527e3, 4363.0292e3, -3958.7666e3]) < 0.1, "{end:?}");
    assert!(apart(&end.velocity, &[3689.866, -1916.735, -6112.511]) < 200000.0 * PUBLISHED, "{end:?}");
}

/// Curtis, Orbital Mechanics for Engineering Students, example 3.7 (mu = 398600 km3/s2): an hour on an ellipse in the plane, printed to
/// five digits.
#[test]
fn another_flight_of_the_literature() {
    let state = Cartesian { position: [7000e3, -12_124e3, 0.0], velocity: [2667.9, 4621.0, 0.0] };
    let end = propagate(398_600e9, &state, 3600.0).unwrap();
    assert!(apart(&end.position, &[-3297.8e3, 7413.4e3, 0.0]) < 100.0, "{end:?}");
    assert!(apart(&end.velocity, &[-8297.6, -964.09, 0.0]) < 0.1, "{end:?}");
}

#[test]
fn stumpff_functions() {
    for x in
        [-700.0, -20.0, -1.0001, -1.0, -0.9999, -1e-3, 0.0, 1e-9, 0.3, 0.9999, 1.0, 1.0001, 9.0, 40.0, 1e4]
    {
        let [c0, c1, c2, c3] = stumpff(x);
        // c_k + x c_(k+2) = 1/k!, and cos^2 + sin^2 = 1.
        let scale = 1.0 + c0.abs();
        assert!((c0 + x * c2 - 1.0).abs() < 0.1 * ROUNDING * scale, "{x}");
        assert!((c1 + x * c3 - 1.0).abs() < 0.1 * ROUNDING * scale, "{x}");
        assert!((c0 * c0 + x * c1 * c1 - 1.0).abs() < ROUNDING * scale * scale, "{x}");
    }
    // From both sides of where the formulas change: (1 - cos 1), (1 - sin 1), (cosh 1 - 1), (sinh 1 - 1).
    for x in [1.0_f64, 1.0_f64.next_down()] {
        let [_, _, c2, c3] = stumpff(x);
        assert!(
            (c2 - 0.459_697_694_131_860_3).abs() < 0.1 * ROUNDING
                && (c3 - 0.158_529_015_192_103_5).abs() < 0.1 * ROUNDING
        );
        let [_, _, c2, c3] = stumpff(-x);
        assert!(
            (c2 - 0.543_080_634_815_243_8).abs() < 0.1 * ROUNDING
                && (c3 - 0.175_201_193_643_801_4).abs() < 0.1 * ROUNDING
        );
    }
}

#[test]
fn a_quarter_of_a_parabola() {
    // From the periapsis to 90 deg, where the radius is p: D = 1.
    let p = 2e7_f64;
    let time = time_since_periapsis(MU, p, 1.0, 0.5 * PI).unwrap();
    assert!((time - (p.powi(3) / MU).sqrt() * 2.0 / 3.0).abs() < 100.0 * ROUNDING * time);
    let speed = (MU / p).sqrt();
    let state = Cartesian { position: [0.5 * p, 0.0, 0.0], velocity: [0.0, 2.0 * speed, 0.0] };
    let end = propagate(MU, &state, time).unwrap();
    assert!(apart(&end.position, &[0.0, p, 0.0]) < ROUNDING * p, "{end:?}");
    assert!(apart(&end.velocity, &[-speed, speed, 0.0]) < ROUNDING * speed, "{end:?}");
}

/// Classical elements of every conic, near-parabolic ones included.
fn orbits() -> impl Strategy<Value = Classical> {
    let eccentricity = prop_oneof![
        3 => 0.0..4.0_f64,
        1 => prop::sample::select(&[0.0, 1e-12, 1.0 - 1e-4, 1.0 - 1e-9, 1.0 - 1e-15, 1.0, 1.0 + 1e-14, 1.0 + 1e-8, 1.0 + 1e-4]),
    ];
    (6.4e6..1e9_f64, eccentricity, 0.0..PI, 0.0..TAU, 0.0..TAU, -0.9..0.9_f64).prop_map(
        |(semi_latus_rectum, eccentricity, inclination, node, periapsis, part)| {
            let widest = if eccentricity < 1.0 { PI } else { (-1.0 / eccentricity).acos() };
            let true_anomaly = part * widest;
            Classical { semi_latus_rectum, eccentricity, inclination, node, periapsis, true_anomaly }
        },
    )
}

/// The change of a state after a time, relative to its size, for relative errors of one of the data.
fn conditioning(from: &Cartesian, to: &Cartesian, time: f64) -> f64 {
    let (r0, r1) = (length(&from.position), length(&to.position));
    let (v0, v1) = (length(&from.velocity), length(&to.velocity));
    1.0 + time.abs() * (v1 / r1 + v0 / r0) * (r0 / r1 + r1 / r0 + v0 / v1 + v1 / v0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// From the periapsis to the true anomaly of the orbit and back, against Kepler's equation.
    #[test]
    fn propagation_agrees_with_keplers_equation(orbit in orbits()) {
        let state = orbit.to_cartesian(MU).unwrap();
        let periapsis = Classical { true_anomaly: 0.0, ..orbit }.to_cartesian(MU).unwrap();
        let time = time_since_periapsis(MU, orbit.semi_latus_rectum, orbit.eccentricity, orbit.true_anomaly).unwrap();
        let allowed = 1e-14 * conditioning(&periapsis, &state, time);
        for (start, end, time) in [(&periapsis, &state, time), (&state, &periapsis, -time)] {
            let flown = propagate(MU, start, time).unwrap();
            let (far, fast) = (apart(&flown.position, &end.position), apart(&flown.velocity, &end.velocity));
            prop_assert!(far < allowed * length(&end.position), "{far} {allowed}");
            prop_assert!(fast < allowed * length(&end.velocity), "{fast} {allowed}");
        }
    }

    /// Energy, angular momentum and the way back, over several revolutions.
    #[test]
    fn propagation_keeps_the_orbit(orbit in orbits(), turns in -5.0..5.0_f64) {
        let state = orbit.to_cartesian(MU).unwrap();
        let unit = orbit.period(MU).min((length(&state.position).powi(3) / MU).sqrt() * TAU * 10.0);
        let time = turns * unit;
        let end = propagate(MU, &state, time).unwrap();
        let momentum = |s: &Cartesian| vector::cross(&s.position, &s.velocity);
        let energy = |s: &Cartesian| 0.5 * vector::dot(&s.velocity, &s.velocity) - MU / length(&s.position);
        let (h0, h1) = (momentum(&state), momentum(&end));
        let scale = |s: &Cartesian| length(&s.position) * length(&s.velocity);
        prop_assert!(apart(&h0, &h1) < 10.0 * ROUNDING * (scale(&state) + scale(&end)));
        let potential = MU / length(&state.position) + MU / length(&end.position);
        prop_assert!((energy(&end) - energy(&state)).abs() < 10.0 * ROUNDING * potential);
        let allowed = 1e-14 * conditioning(&state, &end, time);
        let back = propagate(MU, &end, -time).unwrap();
        prop_assert!(apart(&back.position, &state.position) < allowed * length(&state.position));
        prop_assert!(apart(&back.velocity, &state.velocity) < allowed * length(&state.velocity));
    }

    /// Kepler's equation holds for every eccentricity and anomaly.
    #[test]
    fn keplers_equation_holds(lack in -16.0..0.0_f64, mean in -30.0..30.0_f64, small in -14.0..0.0_f64) {
        for m in [mean, mean.signum() * 10_f64.powf(small)] {
            let e = 1.0 - 10_f64.powf(lack);
            let eccentric = eccentric_anomaly(m, e).unwrap();
            let turns = TAU * (eccentric / TAU).round();
            let again = Conic { periapsis: 1.0 - e, eccentricity: e, reciprocal_axis: 1.0 }.time(eccentric - turns) + turns;
            prop_assert!((again - m).abs() <= 0.4 * ROUNDING * (m.abs() + turns.abs()), "{m} {e} {eccentric} {again}");
            let there = true_from_eccentric(eccentric, e);
            let back = eccentric_from_true(there, e);
            // At the apoapsis the eccentric anomaly moves sqrt((1 + e) / (1 - e)) times as fast.
            let steepest = ((1.0 + e) / (1.0 - e)).sqrt();
            prop_assert!((back - eccentric).abs() < ROUNDING * steepest * (1.0 + eccentric.abs()), "{eccentric} {back} {e}");
            prop_assert!((there - eccentric).abs() <= PI);
            let e = 1.0 + 10_f64.powf(-lack.max(-15.0) - 13.0);
            let hyperbolic = hyperbolic_anomaly(m, e).unwrap();
            let again = Conic { periapsis: e - 1.0, eccentricity: e, reciprocal_axis: -1.0 }.time(hyperbolic);
            prop_assert!((again - m).abs() <= 0.4 * ROUNDING * m.abs() * (1.0 + hyperbolic.abs()));
        }
    }

    /// The closed form of the time between longitudes is what the anomalies give, and the way back.
    #[test]
    fn coasts_between_longitudes(e in 0.0..0.9_f64, periapsis in 0.0..TAU, from in -7.0..7.0_f64, angle in -20.0..20.0_f64) {
        let p = 1e7;
        let (f, g) = (e * periapsis.cos(), e * periapsis.sin());
        let to = from + angle;
        let time = coast_duration(MU, p, f, g, from, to);
        let since = |l: f64| time_since_periapsis(MU, p, e, l - periapsis).unwrap();
        let period = TAU * ((p / (1.0 - e * e)).powi(3) / MU).sqrt();
        prop_assert!((time - (since(to) - since(from))).abs() < ROUNDING * period * (1.0 + angle.abs()));
        let orbit = PlanarEquinoctial::new([p, f, g, from]);
        let there = longitude_after(MU, &orbit, time).unwrap();
        // The longitude moves fastest at the periapsis, by (1 + e)^2 / (1 - e^2)^1.5 of the mean motion.
        let fastest = (1.0 + e).powi(2) / (1.0 - e * e).powf(1.5);
        prop_assert!((there - to).abs() < ROUNDING * fastest * (20.0 + angle.abs()), "{there} {to}");
    }
}

#[test]
fn a_revolution_takes_a_period() {
    // GTO of the tests above: a = 24371 km, e = 0.73.
    let (a, e) = (24_371e3_f64, 0.73_f64);
    let p = a * (1.0 - e * e);
    let period = TAU * (a.powi(3) / MU).sqrt();
    for from in [-3.0, 0.0, 1.0, 3.1, 3.2, 9.0] {
        let time = coast_duration(MU, p, e * 0.6, e * 0.8, from, from + 3.0 * TAU);
        assert!((time - 3.0 * period).abs() < ROUNDING * 3.0 * period);
        let back = coast_duration(MU, p, e * 0.6, e * 0.8, from, from - TAU);
        assert!((back + period).abs() < ROUNDING * period);
    }
    // Half an ellipse from periapsis to apoapsis, and a circle.
    let half = coast_duration(MU, p, e, 0.0, 0.0, PI);
    assert!((half - 0.5 * period).abs() < 0.1 * ROUNDING * period);
    let circle = coast_duration(MU, 7e6, 0.0, 0.0, 1.0, 2.5);
    assert!((circle - 1.5 * (7e6_f64.powi(3) / MU).sqrt()).abs() < 1e3 * ROUNDING);
}

/// Derivatives by the longitudes are the reciprocals of the rate `sqrt(mu p) / r^2`; those by the elements agree with central
/// differences.
#[test]
fn the_duration_of_a_coast_has_derivatives() {
    let x = [1.2e7, 0.3, -0.4, 0.7, 11.0];
    let duration = |[p, f, g, from, to]: [f64; 5]| coast_duration(MU, p, f, g, from, to);
    let seeded: [Dual<5>; 5] = std::array::from_fn(|k| Dual::variable(x[k], k));
    let exact = coast_duration(MU, seeded[0], seeded[1], seeded[2], seeded[3], seeded[4]);
    assert!((exact.re - duration(x)).abs() < 0.1 * ROUNDING * exact.re);
    for (l, k, sign) in [(x[3], 3, -1.0), (x[4], 4, 1.0)] {
        let r = x[0] / (1.0 + x[1] * l.cos() + x[2] * l.sin());
        let slowness = r * r / (MU * x[0]).sqrt();
        assert!((exact.eps[k] - sign * slowness).abs() < 10.0 * ROUNDING * slowness);
    }
    for k in 0..3 {
        let step = 1e-5 * if k == 0 { x[0] } else { 1.0 };
        let (mut up, mut down) = (x, x);
        up[k] += step;
        down[k] -= step;
        let difference = (duration(up) - duration(down)) / (2.0 * step);
        assert!((difference - exact.eps[k]).abs() < DIFFERENCES * exact.eps[k].abs(), "{k}");
    }
    // Smooth at a circle too: dt/df = (2 / n) (sin(from) - sin(to)) there.
    let [p, l0, l1] = [7e6, 0.7, 3.0].map(Dual::<1>::constant);
    let circle = coast_duration(MU, p, Dual::variable(0.0, 0), Dual::constant(0.0), l0, l1);
    let n = (MU / 7e6_f64.powi(3)).sqrt();
    let expected = 2.0 / n * (0.7_f64.sin() - 3.0_f64.sin());
    assert!((circle.eps[0] - expected).abs() < 10.0 * ROUNDING / n);
}

#[test]
fn extreme_flights() {
    let state = Cartesian { position: [7e6, 0.0, 0.0], velocity: [0.0, 7.5e3, 1e3] };
    let still = propagate(MU, &state, 0.0).unwrap();
    assert!(still.position == state.position && apart(&still.velocity, &state.velocity) < 100.0 * ROUNDING);
    // A hyperbola for a thousand years: nearly all the way along the asymptote.
    let fast = Cartesian { position: [7e6, 0.0, 0.0], velocity: [0.0, 1.5e4, 0.0] };
    let energy = 0.5 * 1.5e4_f64.powi(2) - MU / 7e6;
    let end = propagate(MU, &fast, 3.2e10).unwrap();
    let excess = (2.0 * energy).sqrt();
    assert!((length(&end.velocity) / excess - 1.0).abs() < ASYMPTOTE_SPEED);
    assert!((length(&end.position) / (excess * 3.2e10) - 1.0).abs() < ASYMPTOTE_DISTANCE);
    // A fall past the centre at 1 m: the angular momentum stays.
    let grazing = Cartesian { position: [1e8, 0.0, 0.0], velocity: [-1e3, (2.0 * MU).sqrt() / 1e8, 0.0] };
    let period = grazing.to_classical(MU).unwrap().period(MU);
    for k in 1..=20 {
        let end = propagate(MU, &grazing, period * 0.05 * f64::from(k)).unwrap();
        let momentum = vector::cross(&end.position, &end.velocity)[2];
        let scale = length(&end.position) * length(&end.velocity);
        assert!((momentum - (2.0 * MU).sqrt()).abs() < ROUNDING * scale, "{k}");
    }
}

#[test]
fn what_cannot_be_propagated_is_refused() {
    let state = Cartesian { position: [7e6, 0.0, 0.0], velocity: [0.0, 7.5e3, 1e3] };
    assert!(propagate(0.0, &state, 1.0).is_err());
    assert!(propagate(MU, &state, f64::NAN).is_err());
    assert!(propagate(MU, &Cartesian { velocity: [0.0; 3], ..state }, 1.0).is_err());
    assert!(propagate(MU, &Cartesian { position: [f64::NAN; 3], ..state }, 1.0).is_err());
    assert!(eccentric_anomaly(1.0, 1.0).is_err() && eccentric_anomaly(1.0, -0.1).is_err());
    assert!(eccentric_anomaly(f64::INFINITY, 0.1).is_err());
    assert!(hyperbolic_anomaly(1.0, 1.0).is_err() && hyperbolic_anomaly(1.0, f64::NAN).is_err());
    assert!(parabolic_anomaly(f64::NAN).is_err());
    assert!(
        time_since_periapsis(MU, 1e7, 2.0, 2.5).is_err() && time_since_periapsis(MU, 1e7, 1.0, 4.0).is_err()
    );
    assert!(
        time_since_periapsis(MU, -1e7, 0.5, 1.0).is_err()
            && time_since_periapsis(MU, 1e7, -0.5, 1.0).is_err()
    );
    assert!(longitude_after(MU, &PlanarEquinoctial::new([1e7, 1.0, 0.0, 0.0]), 1.0).is_err());
    assert!(longitude_after(MU, &PlanarEquinoctial::new([1e7, 0.1, 0.0, 0.0]), f64::NAN).is_err());
    assert!(coast_duration(MU, 1e7, 1.0, 0.1, 0.0, 1.0).is_nan());
}

#[test]
fn the_duration_of_a_coast_has_a_formula() {
    struct Coast;
    impl VectorFunction<5, 1> for Coast {
        fn evaluate<S: Scalar>(&self, z: &[S; 5]) -> [S; 1] {
            [coast_duration(MU, z[0], z[1], z[2], z[3], z[4])]
        }
    }
    assert!(vector_node(Coast).formula().is_ok());
}
