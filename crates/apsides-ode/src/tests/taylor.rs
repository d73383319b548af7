use std::f64::consts::{PI, TAU};

use apsides_ad::{Dynamics, FormulaBuilder, Scalar, TaylorError, dynamics_node};
use proptest::prelude::*;

use super::ROUNDING;
use crate::{
    DenseSolution, Direction, Event, EventLog, FnSystem, Integrator, OdeError, OdeSettings, Status,
    TaylorIntegrator, Tolerance,
};

/// Some tens of steps of tolerance 1e-14 with the growth of errors along an orbit.
const ORBIT: f64 = 1e-12;
/// Errors of some tens of steps of tolerance 1e-12.
const STEPS: f64 = 1e-10;

/// Steps end where the state has the size of the absolute tolerance of 1e-10, up to its root before and after a singularity.
const SINGULARITY: f64 = 1e-5;

/// Two bodies of gravitational parameter one in a plane.
struct Orbit;

impl Dynamics<4, 0> for Orbit {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 4], _u: &[S; 0], _p: &[S; 0]) -> [S; 4] {
        let r2 = x[0] * x[0] + x[1] * x[1];
        let factor = S::from(-1.0) / (r2 * r2.sqrt());
        [x[2], x[3], x[0] * factor, x[1] * factor]
    }
}

/// `x'' = -w^2 x` with the frequency as a control.
struct Driven;

impl Dynamics<2, 1> for Driven {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], w: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], -w[0] * w[0] * x[0]]
    }
}

struct Pendulum;

impl Dynamics<2, 0> for Pendulum {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 0], _p: &[S; 0]) -> [S; 2] {
        [x[1], -x[0].sin()]
    }
}

fn orbit(tolerance: f64) -> TaylorIntegrator {
    let formula = dynamics_node(Orbit).formula().unwrap();
    TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(tolerance)).unwrap()
}

fn driven(tolerance: f64) -> TaylorIntegrator {
    let formula = dynamics_node(Driven).formula().unwrap();
    TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(tolerance)).unwrap()
}

/// Start at the periapsis of an ellipse of semi-major axis one.
fn periapsis(eccentricity: f64) -> [f64; 4] {
    [1.0 - eccentricity, 0.0, 0.0, ((1.0 + eccentricity) / (1.0 - eccentricity)).sqrt()]
}

#[test]
fn an_ellipse_closes_and_its_middle_is_the_apoapsis() {
    for eccentricity in [0.0, 0.2, 0.7] {
        let start = periapsis(eccentricity);
        let mut end = [0.0; 4];
        let summary = orbit(1e-14).integrate(0.0, &start, &[], TAU, &mut end).unwrap();
        assert_eq!((summary.status, summary.time), (Status::Completed, TAU));
        assert!(end.iter().zip(start).all(|(e, s)| (e - s).abs() < ORBIT), "{end:?}");
        // Backward to half a period.
        let mut middle = [0.0; 4];
        orbit(1e-14).integrate(TAU, &end, &[], PI, &mut middle).unwrap();
        assert!((middle[0] + 1.0 + eccentricity).abs() < ORBIT && middle[1].abs() < ORBIT, "{middle:?}");
    }
}

#[test]
fn errors_follow_the_tolerance() {
    let start = periapsis(0.3);
    for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
        let mut end = [0.0; 4];
        orbit(tolerance).integrate(0.0, &start, &[], TAU, &mut end).unwrap();
        let error = end.iter().zip(start).map(|(e, s)| (e - s).powi(2)).sum::<f64>().sqrt();
        assert!(error < 100.0 * tolerance && error > 1e-5 * tolerance, "{tolerance}: {error}");
    }
    assert!(orbit(1e-6).order() < orbit(1e-12).order());
    // Near rounding steps are shorter instead.
    assert!(orbit(1e-14).order() < orbit(1e-12).order());
    assert_eq!((orbit(0.5).order(), orbit(1e-300).order()), (4, 28));
}

/// Ten circles, from a time whose rounding is 1e-10: steps that times do not have would add up to some of these.
#[test]
fn late_times_cost_no_digits() {
    let (start, t0) = (periapsis(0.0), 1e6);
    let t1 = t0 + 10.0 * TAU;
    let mut end = [0.0; 4];
    orbit(1e-14).integrate(t0, &start, &[], t1, &mut end).unwrap();
    let (sine, cosine) = (t1 - t0).sin_cos();
    for (found, expected) in end.iter().zip([cosine, sine, -sine, cosine]) {
        assert!((found - expected).abs() < ORBIT, "{end:?}");
    }
}

#[test]
fn an_oscillator_takes_its_frequency_from_the_parameters() {
    let mut integrator = driven(1e-14);
    for w in [0.5, 3.0] {
        let mut end = [0.0; 2];
        integrator.integrate(1.0, &[1.0, 0.0], &[w], 5.0, &mut end).unwrap();
        assert!((end[0] - (4.0 * w).cos()).abs() < ROUNDING, "{end:?}");
        assert!((end[1] + w * (4.0 * w).sin()).abs() < 10.0 * ROUNDING, "{end:?}");
    }
}

/// The period `2 pi / agm(1, cos(a / 2))` of a pendulum of amplitude `a`.
#[test]
fn a_pendulum_has_its_period() {
    let formula = dynamics_node(Pendulum).formula().unwrap();
    let mut integrator = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-14)).unwrap();
    for amplitude in [0.1, 1.0, 3.0_f64] {
        let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
        for _ in 0..10 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let period = TAU / a;
        let (mut end, mut log) = ([0.0; 2], EventLog::default());
        let turning = |_: f64, x: &[f64]| x[1];
        let events = [Event::new(&turning).directed(Direction::Falling).terminal()];
        let summary = integrator
            .integrate_observed(0.0, &[amplitude, 0.0], &[], 100.0, &mut end, &events, &mut log)
            .unwrap();
        assert_eq!(summary.status, Status::Event(0));
        assert!((summary.time - period).abs() < ORBIT * period, "{} {period}", summary.time);
        assert!((end[0] - amplitude).abs() < ORBIT);
    }
}

#[test]
fn events_on_the_series_are_all_found() {
    let height = |_: f64, x: &[f64]| x[1];
    let events = [Event::new(&height)];
    let (mut end, mut log) = ([0.0; 4], EventLog::default());
    orbit(1e-12).integrate_observed(0.0, &periapsis(0.0), &[], 20.0, &mut end, &events, &mut log).unwrap();
    let times: Vec<f64> = log.records.iter().map(|r| r.time).collect();
    assert_eq!(times.len(), 6);
    assert!(times.iter().zip(1..).all(|(t, k)| (t - PI * f64::from(k)).abs() < STEPS), "{times:?}");
}

#[test]
fn dense_output_is_the_solution_at_any_time() {
    let (summary, solution): (_, DenseSolution) =
        driven(1e-13).solve_dense(0.0, &[1.0, 0.0], &[1.0], 30.0).unwrap();
    assert_eq!(summary.statistics.accepted + 1, solution.times().len());
    let mut x = [0.0; 2];
    for k in 0..=300 {
        let t = 0.1 * f64::from(k);
        solution.evaluate(t.min(30.0), &mut x).unwrap();
        assert!((x[0] - t.cos()).abs() < STEPS && (x[1] + t.sin()).abs() < STEPS, "{t}");
    }
}

/// `x' = x^2` reaches infinity at the time 1, `x' = -1 / (2 x)` the end of its domain, `x' = sqrt(1 - t)` its own.
#[test]
fn singularities_end_the_integration() {
    let run = |rate: fn(&mut FormulaBuilder) -> apsides_ad::Value| {
        let mut b = FormulaBuilder::new(2);
        let rate = rate(&mut b);
        let formula = b.formula(&[rate]).unwrap();
        let mut integrator = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-10)).unwrap();
        let mut end = [0.0];
        let summary = integrator.integrate(0.0, &[1.0], &[], 5.0, &mut end).unwrap();
        (summary.status, summary.time, end[0])
    };
    let square = |b: &mut FormulaBuilder| {
        let x = b.input(0);
        b.square(x)
    };
    let falling = |b: &mut FormulaBuilder| {
        let (x, half) = (b.input(0), b.constant(-0.5));
        b.div(half, x)
    };
    let root = |b: &mut FormulaBuilder| {
        let (t, one) = (b.input(1), b.constant(1.0));
        let left = b.sub(one, t);
        b.sqrt(left)
    };
    for rate in [square, falling, root] {
        let (status, time, end) = run(rate);
        assert!(matches!(status, Status::StepTooSmall | Status::NotFinite), "{status:?}");
        assert!((time - 1.0).abs() < SINGULARITY, "{time}");
        assert!(end.is_finite());
    }
}

/// All coefficients of `1 / (1 + t^m)` but each `m`-th vanish at the time zero: the step must not be that of a polynomial.
#[test]
fn gaps_in_a_series_do_not_lengthen_steps() {
    for power in [4, 12] {
        let mut b = FormulaBuilder::new(2);
        let (t, one) = (b.input(1), b.constant(1.0));
        let high = b.powi(t, power);
        let sum = b.add(one, high);
        let rate = b.recip(sum);
        let formula = b.formula(&[rate]).unwrap();
        let mut integrator = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-12)).unwrap();
        let (mut end, mut far) = ([0.0], [0.0]);
        integrator.integrate(0.0, &[0.0], &[], 1.0, &mut end).unwrap();
        // By another integrator.
        let system =
            FnSystem::new(1, |t: f64, _: &[f64], dx: &mut [f64]| dx[0] = 1.0 / (1.0 + t.powi(power)));
        let mut pair = Integrator::new(1, OdeSettings { max_step: 0.1, ..OdeSettings::default() }).unwrap();
        pair.integrate(&system, 0.0, &[0.0], 1.0, &mut far).unwrap();
        assert!((end[0] - far[0]).abs() < STEPS, "{power}: {end:?} {far:?}");
    }
    // A body that falls has a solution of second degree, which one step of the right length would meet.
    let mut b = FormulaBuilder::new(3);
    let (v, g) = (b.input(1), b.constant(-9.81));
    let formula = b.formula(&[v, g]).unwrap();
    let mut integrator = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-12)).unwrap();
    let mut end = [0.0; 2];
    let summary = integrator.integrate(0.0, &[0.0, 10.0], &[], 2.0, &mut end).unwrap();
    assert!((end[0] - 0.38).abs() < STEPS && summary.statistics.accepted < 20, "{end:?} {summary:?}");
}

#[test]
fn what_cannot_be_integrated_is_refused() {
    let refused = |result: Result<TaylorIntegrator, OdeError>| result.unwrap_err();
    let formula = dynamics_node(Driven).formula().unwrap();
    let negative = OdeSettings::with_tolerance(-1.0);
    assert!(matches!(refused(TaylorIntegrator::new(&formula, negative)), OdeError::Setting { .. }));
    let absolute_tolerance = Tolerance::PerComponent(vec![1.0]);
    let short = OdeSettings { absolute_tolerance, ..OdeSettings::default() };
    assert!(matches!(refused(TaylorIntegrator::new(&formula, short)), OdeError::Dimension { .. }));
    let mut b = FormulaBuilder::new(2);
    let x = b.input(0);
    let size = b.abs(x);
    let error = refused(TaylorIntegrator::new(&b.formula(&[size]).unwrap(), OdeSettings::default()));
    assert_eq!(error, OdeError::Taylor(TaylorError::NoRecurrence { operation: 0, name: "abs" }));
    let none = FormulaBuilder::new(2).formula(&[]).unwrap();
    assert!(matches!(
        refused(TaylorIntegrator::new(&none, OdeSettings::default())),
        OdeError::Dimension { .. }
    ));

    let mut integrator = driven(1e-10);
    let mut end = [7.0; 2];
    let mut run = |t0: f64, x0: &[f64], w: &[f64], t1: f64| integrator.integrate(t0, x0, w, t1, &mut end);
    assert!(matches!(run(0.0, &[1.0], &[1.0], 1.0), Err(OdeError::Dimension { argument: "x0", .. })));
    assert!(matches!(run(0.0, &[1.0; 2], &[], 1.0), Err(OdeError::Dimension { argument: "parameters", .. })));
    assert!(matches!(run(0.0, &[1.0, f64::NAN], &[1.0], 1.0), Err(OdeError::NotFinite { .. })));
    assert!(matches!(run(0.0, &[1.0; 2], &[f64::NAN], 1.0), Err(OdeError::NotFinite { .. })));
    assert!(matches!(run(0.0, &[1.0; 2], &[1.0], f64::INFINITY), Err(OdeError::NotFinite { .. })));
    let summary = run(3.0, &[1.0, 2.0], &[1.0], 3.0).unwrap();
    assert_eq!((summary.status, summary.statistics.accepted), (Status::Completed, 0));
    let summary = run(0.0, &[1e200, 1e200], &[1e200], 1.0).unwrap();
    assert_eq!((summary.status, summary.time), (Status::NotFinite, 0.0));
    assert_eq!(end, [1e200, 1e200]);
}

#[test]
fn steps_are_limited_as_stated() {
    let formula = dynamics_node(Driven).formula().unwrap();
    let run = |settings: OdeSettings| {
        let mut end = [0.0; 2];
        let mut integrator = TaylorIntegrator::new(&formula, settings).unwrap();
        let summary = integrator.integrate(0.0, &[1.0, 0.0], &[1.0], 10.0, &mut end).unwrap();
        assert!(summary.status != Status::Completed || (end[0] - 10.0_f64.cos()).abs() < STEPS);
        (summary.status, summary.statistics.accepted)
    };
    assert_eq!(
        run(OdeSettings { fixed_step: Some(0.25), ..OdeSettings::default() }),
        (Status::Completed, 40)
    );
    assert_eq!(run(OdeSettings { max_step: 0.5, ..OdeSettings::default() }), (Status::Completed, 20));
    assert_eq!(
        run(OdeSettings { max_step: 0.5, max_steps: 7, ..OdeSettings::default() }),
        (Status::TooManySteps, 7)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// The same orbit by both schemes, and back to where it started. What errors of energy leave is a delay along the orbit (E. Hairer,
    /// C. Lubich, G. Wanner, Geometric Numerical Integration, Springer 2006, section X.3), which changes a speed by the acceleration times
    /// itself: at most by that of the periapsis, `1 / (1 - e)^2`, to which the schemes must agree.
    #[test]
    fn orbits_agree_with_those_of_runge_kutta(eccentricity in 0.0..0.8_f64, time in 0.5..8.0_f64) {
        let start = periapsis(eccentricity);
        let (mut end, mut other, mut back) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        let bound = STEPS / (1.0 - eccentricity).powi(2);
        let mut integrator = orbit(1e-13);
        integrator.integrate(0.0, &start, &[], time, &mut end).unwrap();
        let system = FnSystem::new(4, |_, x: &[f64], dx: &mut [f64]| {
            let r3 = x[0].hypot(x[1]).powi(3);
            dx.copy_from_slice(&[x[2], x[3], -x[0] / r3, -x[1] / r3]);
        });
        let mut pair = Integrator::new(4, OdeSettings::with_tolerance(1e-13)).unwrap();
        pair.integrate(&system, 0.0, &start, time, &mut other).unwrap();
        integrator.integrate(time, &end, &[], 0.0, &mut back).unwrap();
        for k in 0..4 {
            prop_assert!((end[k] - other[k]).abs() < bound, "{end:?} {other:?}");
            prop_assert!((back[k] - start[k]).abs() < bound, "{back:?}");
        }
    }
}
