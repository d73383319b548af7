//! Trajectories that do not fit, NaN, and re-simulations that cannot be continued.

use super::parts::{self, DoubleIntegrator, Energy, breaks, energy, trajectory};
use super::{certify, failed, find};
use crate::{Certificate, CheckKind, Verdict, VerifyError, VerifySettings, verify};
use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Discretisation: the time of a flight that was not ended.
const ENDED: f64 = 1e-6;

/// Discretisation: the tolerances of the integration.
const INTEGRATION: f64 = 1e-10;

fn problem() -> Ocp {
    let phase = Phase::new("push", DoubleIntegrator)
        .states([
            State::new("position", "m").within(-1.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("speed", "m/s").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-10.0, 10.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("minimum energy")
        .phase(phase)
        .minimize_integral("push", "energy")
        .build()
        .expect("well-posed")
}

/// The optimum with `poison(component)` added: 0 position, 1 speed, 2 control, 3 costate.
fn solution(poison: impl Fn(usize, f64) -> f64 + Copy) -> Trajectory {
    let x = move |_: usize, t: f64| {
        vec![3.0 * t * t - 2.0 * t.powi(3) + poison(0, t), 6.0 * t - 6.0 * t * t + poison(1, t)]
    };
    let u = move |_: usize, t: f64| vec![6.0 - 12.0 * t + poison(2, t)];
    let costate = move |_: usize, t: f64| vec![-12.0 + poison(3, t), 12.0 * t - 6.0];
    trajectory(vec![parts::phase("push", &breaks(0.0, 1.0, 3), 4, x, u, costate)], 6.0)
}

fn exact() -> Trajectory {
    solution(|_, _| 0.0)
}

fn error(t: &Trajectory) -> VerifyError {
    verify(&problem(), t, &VerifySettings::default()).expect_err("does not fit")
}

#[test]
fn nan_anywhere_fails_and_never_passes() {
    assert!(certify(&problem(), &exact()).is_verified());
    for component in 0..3 {
        for (from, to) in [(-1.0, 0.01), (0.4, 0.5), (0.9, 1.1), (-1.0, 1.1)] {
            for bad in [f64::NAN, f64::INFINITY] {
                let poison = |c: usize, t: f64| if c == component && t > from && t < to { bad } else { 0.0 };
                let certificate = certify(&problem(), &solution(poison));
                assert_eq!(certificate.verdict, Verdict::Rejected, "component {component} in {from}..{to}");
            }
        }
    }
    let costate = certify(&problem(), &solution(|c, _| if c == 3 { f64::NAN } else { 0.0 }));
    assert_eq!(costate.verdict, Verdict::Feasible);
    for name in ["costate equation", "Hamiltonian constant"] {
        assert!(find(&costate, name).value.is_nan(), "{name}");
    }
    let mut objective = exact();
    objective.objective = f64::NAN;
    let certificate = certify(&problem(), &objective);
    assert!(find(&certificate, "objective").value.is_nan());
    assert_eq!(certificate.verdict, Verdict::Rejected);
}

#[test]
fn a_nan_at_the_end_of_the_states_is_the_value_of_its_check() {
    let certificate = certify(&problem(), &solution(|c, t| if c == 1 && t > 0.99 { f64::NAN } else { 0.0 }));
    let check = find(&certificate, "re-simulated speed");
    assert!(check.value.is_nan() && !check.passed);
    assert!(find(&certificate, "re-simulated position").passed);
}

#[test]
fn sizes_are_refused_with_place_and_numbers() {
    let mut t = exact();
    t.phases.clear();
    assert!(matches!(error(&t), VerifyError::Trajectory(_)));

    let mut t = exact();
    t.parameters.push(1.0);
    assert!(matches!(error(&t), VerifyError::Trajectory(_)));

    let mut t = exact();
    t.phases[0].control = t.phases[0].state.clone();
    assert!(error(&t).to_string().contains("push"));

    let mut t = exact();
    t.phases[0].costate = Some(t.phases[0].control.clone());
    assert_eq!(error(&t).to_string(), "phase `push`, costate: expected 2 components, found 1");

    let mut t = exact();
    t.phases[0].path_multipliers = Some(t.phases[0].control.clone());
    assert_eq!(error(&t).to_string(), "phase `push`, path multipliers: expected 0 components, found 1");

    let mut t = exact();
    t.constraint_multipliers = Some(vec![vec![0.0]]);
    assert!(error(&t).to_string().contains("expected 0 constraints, found 1"));
}

#[test]
fn times_that_disagree_with_the_polynomials_are_refused() {
    for (initial_time, final_time) in [(0.0, 1.1), (0.1, 1.0), (0.0, f64::NAN), (f64::NAN, 1.0), (1.0, 0.0)] {
        let mut t = exact();
        (t.phases[0].initial_time, t.phases[0].final_time) = (initial_time, final_time);
        assert!(
            matches!(error(&t), VerifyError::Span { .. } | VerifyError::Trajectory(_)),
            "{initial_time} {final_time}"
        );
    }
    let mut t = exact();
    t.phases[0].costate = Some(parts::polynomial(2, &[0.0, 2.0], &[-1.0, 1.0], |_, _| vec![0.0; 2]));
    assert_eq!(error(&t).to_string(), "phase `push`: the costate spans [0, 2], the phase [0, 1]");
}

#[test]
fn settings_outside_their_range_are_refused() {
    let default = VerifySettings::default;
    for settings in [
        VerifySettings { end_tolerance: f64::NAN, ..default() },
        VerifySettings { path_tolerance: 0.0, ..default() },
        VerifySettings { integration_tolerance: -1.0, ..default() },
        VerifySettings { costate_tolerance: f64::INFINITY, ..default() },
        VerifySettings { scan_points: 1, ..default() },
        VerifySettings { max_steps: 0, ..default() },
    ] {
        let refused = verify(&problem(), &exact(), &settings);
        assert!(matches!(refused, Err(VerifyError::Setting { .. })), "{settings:?}");
    }
}

/// `x' = x^2 + u`: from 1, the free motion grows without bound at `t = 1`.
struct Blowup;
impl Dynamics<1, 1> for Blowup {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * x[0] + u[0]]
    }
}

#[test]
fn a_re_simulation_that_stops_names_time_and_reason() {
    let phase = Phase::new("grow", Blowup)
        .states([State::new("x", "-").starts_at(1.0)])
        .controls([Variable::new("u", "-")])
        .final_time(Bounds::fixed(2.0))
        .time_unit("-");
    let coast = Phase::new("coast", Blowup)
        .states([State::new("x", "-")])
        .controls([Variable::new("u", "-")])
        .initial_time(Bounds::fixed(2.0))
        .final_time(Bounds::fixed(3.0))
        .time_unit("-");
    let ocp = Ocp::builder("blow-up")
        .phase(phase)
        .phase(coast)
        .link("grow", "coast")
        .minimize("x", "-", At::FinalState("grow", "x"))
        .build()
        .expect("well-posed");
    let part = |name, t0: f64| {
        parts::phase(
            name,
            &breaks(t0, if t0 == 0.0 { 2.0 } else { 3.0 }, 3),
            3,
            |_, _| vec![1.0],
            |_, _| vec![0.0],
            |_, _| vec![0.0],
        )
    };
    let mut t = trajectory(vec![part("grow", 0.0), part("coast", 2.0)], 1.0);
    t.constraint_multipliers = None;
    let verification = verify(&ocp, &t, &VerifySettings::default()).expect("fits");
    let certificate: Certificate = verification.certificate;
    assert_eq!(certificate.verdict, Verdict::Rejected);
    let check = find(&certificate, "time of grow left");
    assert!((check.value - 1.0).abs() < ENDED && check.kind == CheckKind::Feasibility, "{check:?}");
    assert!(check.at.starts_with("phase `grow`, t = 1: "), "{check:?}");
    // The linked phase has nowhere to start from.
    let check = find(&certificate, "time of coast left");
    assert!(check.value == 1.0 && check.at.contains("not finite"), "{check:?}");
    // One interval of two thirds of a second was flown: x = 1 / (1 - t).
    assert_eq!(verification.simulation[0].times.len(), 16);
    assert!((verification.simulation[0].states[15] - 3.0).abs() < INTEGRATION);
    assert!(verification.simulation[1].times.is_empty());
    assert!(failed(&certificate).contains(&"objective x"));
}

#[test]
fn too_few_steps_fail_without_hanging() {
    let settings = VerifySettings { max_steps: 1, integration_tolerance: 1e-15, ..VerifySettings::default() };
    let ocp = problem();
    let fast = solution(|c, t| if c == 2 { (500.0 * t).sin() } else { 0.0 });
    let certificate = verify(&ocp, &fast, &settings).expect("fits").certificate;
    assert_eq!(certificate.verdict, Verdict::Rejected);
}
