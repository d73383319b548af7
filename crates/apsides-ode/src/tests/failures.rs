use super::*;
use crate::{FnSystem, OdeError, Status, Tolerance};

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-12;

#[test]
fn blow_up_ends_near_the_singularity() {
    // x' = x^2, x(0) = 1: x = 1 / (1 - t).
    let system = FnSystem::new(1, |_t, x: &[f64], dx: &mut [f64]| dx[0] = x[0] * x[0]);
    for method in METHODS {
        let mut x1 = [0.0];
        let summary = integrator(1, method, 1e-10).integrate(&system, 0.0, &[1.0], 2.0, &mut x1).unwrap();
        assert_eq!(summary.status, Status::StepTooSmall);
        close(summary.time, 1.0, 1e6 * INTEGRATION);
        assert!(x1[0].is_finite() && x1[0] > 1e6);
    }
}

#[test]
fn rates_that_are_not_finite() {
    let mut x1 = [0.0];
    let mut integrator = integrator(1, Method::Dop853, 1e-10);
    // From the start.
    let nan = FnSystem::new(1, |_t, _x: &[f64], dx: &mut [f64]| dx[0] = f64::NAN);
    let summary = integrator.integrate(&nan, 3.0, &[7.0], 4.0, &mut x1).unwrap();
    assert_eq!((summary.status, summary.time, x1), (Status::NotFinite, 3.0, [7.0]));
    // Beyond t = 1; the state before it is kept.
    let late = FnSystem::new(1, |t, _x: &[f64], dx: &mut [f64]| dx[0] = if t > 1.0 { f64::NAN } else { 1.0 });
    let summary = integrator.integrate(&late, 0.0, &[0.0], 2.0, &mut x1).unwrap();
    assert_eq!(summary.status, Status::NotFinite);
    close(summary.time, 1.0, 1e3 * INTEGRATION);
    close(x1[0], summary.time, INTEGRATION);
    // A domain left only by too long a step is no failure: x' = -sqrt(x), x = (1 - t / 2)^2.
    let root = FnSystem::new(1, |_t, x: &[f64], dx: &mut [f64]| dx[0] = -x[0].sqrt());
    let summary = integrator.integrate(&root, 0.0, &[1.0], 1.9, &mut x1).unwrap();
    assert_eq!(summary.status, Status::Completed);
    close(x1[0], 0.0025, 1e3 * INTEGRATION);
    // Overflow.
    let system = FnSystem::new(1, |_t, x: &[f64], dx: &mut [f64]| dx[0] = 1e3 * x[0]);
    let summary = integrator.integrate(&system, 0.0, &[1.0], 10.0, &mut x1).unwrap();
    assert!(matches!(summary.status, Status::NotFinite | Status::StepTooSmall), "{summary:?}");
    assert!(summary.time < 0.72 && x1[0].is_finite());
    // Fixed steps cannot be shortened.
    let settings = OdeSettings { fixed_step: Some(0.4), ..OdeSettings::default() };
    let summary = Integrator::new(1, settings).unwrap().integrate(&late, 0.0, &[0.0], 2.0, &mut x1).unwrap();
    assert_eq!((summary.status, summary.time), (Status::NotFinite, 0.8));
}

#[test]
fn step_limit_is_a_status_with_the_state_reached() {
    let settings = OdeSettings { max_steps: 25, ..OdeSettings::default() };
    let mut x1 = [0.0; 2];
    let mut integrator = Integrator::new(2, settings).unwrap();
    let summary =
        integrator.integrate(&Oscillator { frequency: 1.0 }, 0.0, &[1.0, 0.0], 1e6, &mut x1).unwrap();
    assert_eq!(summary.status, Status::TooManySteps);
    assert_eq!(summary.statistics.accepted + summary.statistics.rejected, 25);
    close(x1[0], summary.time.cos(), 100.0 * INTEGRATION);
}

#[test]
fn stiff_systems_are_recognised_and_others_are_not() {
    // Van der Pol with eps = 1e-6, the stiff test problem of Hairer and Wanner.
    let system = FnSystem::new(2, |_t, x: &[f64], dx: &mut [f64]| {
        dx[0] = x[1];
        dx[1] = ((1.0 - x[0] * x[0]) * x[1] - x[0]) / 1e-6;
    });
    for method in METHODS {
        let mut x1 = [0.0; 2];
        let summary = integrator(2, method, 1e-6).integrate(&system, 0.0, &[2.0, 0.0], 2.0, &mut x1).unwrap();
        assert_eq!(summary.status, Status::Stiff, "{method:?}");
        assert!(summary.statistics.accepted < 3000 && x1[0] > 1.9);
        let mut x1 = [0.0; 4];
        let kepler = Kepler { axes: 2, mu: 1.0 };
        let settings =
            OdeSettings { method, stiffness_interval: Some(1), ..OdeSettings::with_tolerance(1e-8) };
        let mut integrator = Integrator::new(4, settings).unwrap();
        let summary = integrator.integrate(&kepler, 0.0, &periapsis(0.7), 100.0, &mut x1).unwrap();
        assert_eq!(summary.status, Status::Completed);
    }
}

#[test]
fn intervals_of_no_length_tiny_and_huge() {
    let system = Oscillator { frequency: 1.0 };
    let mut integrator = integrator(2, Method::Dop853, 1e-10);
    let mut x1 = [0.0; 2];
    let summary = integrator.integrate(&system, 5.0, &[1.0, 2.0], 5.0, &mut x1).unwrap();
    assert_eq!((summary.status, summary.time, x1), (Status::Completed, 5.0, [1.0, 2.0]));
    assert_eq!(summary.statistics, crate::Statistics::default());
    let next = 1.0 + f64::EPSILON;
    let summary = integrator.integrate(&system, 1.0, &[1.0, 0.0], next, &mut x1).unwrap();
    assert_eq!((summary.status, summary.time), (Status::Completed, next));
    // Nothing moves: the step grows to any length.
    let rest = FnSystem::new(2, |_t, _x: &[f64], dx: &mut [f64]| dx.fill(0.0));
    let summary = integrator.integrate(&rest, 0.0, &[1.0, 2.0], 1e300, &mut x1).unwrap();
    assert_eq!((summary.status, x1), (Status::Completed, [1.0, 2.0]));
    assert!(summary.statistics.accepted < 1000);
    // Something moves: the limit of steps ends it.
    let settings = OdeSettings { max_steps: 1000, ..OdeSettings::default() };
    let mut limited = Integrator::new(2, settings).unwrap();
    let summary = limited.integrate(&system, 0.0, &[1.0, 0.0], 1e300, &mut x1).unwrap();
    assert_eq!(summary.status, Status::TooManySteps);
    assert!(limited.integrate(&system, -1e308, &[1.0, 0.0], 1e308, &mut x1).is_err());
}

#[test]
fn ill_posed_requests_are_errors() {
    let system = Oscillator { frequency: 1.0 };
    let mut two = integrator(2, Method::Dop853, 1e-10);
    let mut x1 = [0.0; 2];
    let dimension = |argument, expected, found| Err(OdeError::Dimension { argument, expected, found });
    assert_eq!(two.integrate(&system, 0.0, &[1.0], 1.0, &mut x1), dimension("x0", 2, 1));
    assert_eq!(two.integrate(&system, 0.0, &[1.0, 0.0], 1.0, &mut [0.0; 3]), dimension("x1", 2, 3));
    assert_eq!(
        two.integrate(&Kepler { axes: 2, mu: 1.0 }, 0.0, &[1.0, 0.0], 1.0, &mut x1),
        dimension("the system", 2, 4)
    );
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(two.integrate(&system, bad, &[1.0, 0.0], 1.0, &mut x1).is_err());
        assert!(two.integrate(&system, 0.0, &[1.0, 0.0], bad, &mut x1).is_err());
        assert!(matches!(
            two.integrate(&system, 0.0, &[1.0, bad], 1.0, &mut x1),
            Err(OdeError::NotFinite { argument: "x0", index: 1, .. })
        ));
    }
    assert!(Integrator::new(0, OdeSettings::default()).is_err());
    let refused = |settings: OdeSettings| match Integrator::new(2, settings) {
        Err(OdeError::Setting { name, .. }) => name,
        Err(OdeError::Dimension { argument, .. }) => argument,
        other => panic!("{other:?} was not refused"),
    };
    let base = OdeSettings::default;
    for value in [0.0, -1e-9, f64::NAN, f64::INFINITY] {
        assert_eq!(refused(OdeSettings { relative_tolerance: value, ..base() }), "relative_tolerance");
        assert_eq!(refused(OdeSettings { absolute_tolerance: value.into(), ..base() }), "absolute_tolerance");
        assert_eq!(refused(OdeSettings { initial_step: Some(value), ..base() }), "initial_step");
        assert_eq!(refused(OdeSettings { fixed_step: Some(value), ..base() }), "fixed_step");
        if value != f64::INFINITY {
            assert_eq!(refused(OdeSettings { max_step: value, ..base() }), "max_step");
        }
    }
    let one_zero = Tolerance::PerComponent(vec![1e-9, 0.0]);
    assert_eq!(refused(OdeSettings { absolute_tolerance: one_zero, ..base() }), "absolute_tolerance");
    assert_eq!(
        refused(OdeSettings { absolute_tolerance: vec![1e-9].into(), ..base() }),
        "absolute_tolerance"
    );
    assert_eq!(refused(OdeSettings { controlled_components: Some(3), ..base() }), "controlled_components");
    assert_eq!(refused(OdeSettings { controlled_components: Some(0), ..base() }), "controlled_components");
    assert_eq!(refused(OdeSettings { stiffness_interval: Some(0), ..base() }), "stiffness_interval");
}
