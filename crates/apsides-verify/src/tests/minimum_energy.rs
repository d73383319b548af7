//! Rest to rest in one second with the least integral of `u^2 / 2`: `u = 6 - 12 t`, `J = 6`,
//! `lambda = (-12, 12 t - 6)`, `H = -18`. A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 5.3.

use super::parts::{self, DoubleIntegrator, Energy, breaks, energy, trajectory};
use super::{assert_exact, assert_failed, certify, certify_stated, find};
use crate::{CheckKind, VerifySettings, verify};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Round-off of polynomials that the integrator follows exactly.
const ROUNDING: f64 = 1e-12;

/// Round-off of limits.
const ROUNDING_OF_LIMITS: f64 = 1e-15;

/// Discretisation: integrals.
const INTEGRATION: f64 = 1e-10;

/// Discretisation: costates that are integrated, relative.
const INTEGRATION_OF_COSTATES: f64 = 1e-9;

/// Discretisation: residuals of the costate equation between the times at which they are sampled.
const DIFFERENCES: f64 = 1e-6;

/// Discretisation: terms of second order in a change of 1e-4.
const SMALL: f64 = 1e-8;

fn phase() -> Phase {
    Phase::new("push", DoubleIntegrator)
        .states([
            State::new("position", "m").starts_at(0.0).ends_at(1.0).scaled_by(1.0),
            State::new("speed", "m/s").starts_at(0.0).ends_at(0.0).scaled_by(1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-10.0, 10.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0))
}

fn build(phase: Phase) -> Ocp {
    Ocp::builder("minimum energy")
        .phase(phase)
        .minimize_integral("push", "energy")
        .build()
        .expect("well-posed")
}

fn problem() -> Ocp {
    build(phase())
}

fn x(t: f64) -> Vec<f64> {
    vec![3.0 * t * t - 2.0 * t.powi(3), 6.0 * t - 6.0 * t * t]
}

fn costate(t: f64) -> Vec<f64> {
    vec![-12.0, 12.0 * t - 6.0]
}

fn solution(intervals: usize, points: usize) -> Trajectory {
    let breaks = breaks(0.0, 1.0, intervals);
    let phase =
        parts::phase("push", &breaks, points, |_, t| x(t), |_, t| vec![6.0 - 12.0 * t], |_, t| costate(t));
    trajectory(vec![phase], 6.0)
}

#[test]
fn the_solution_is_verified() {
    for (intervals, points) in [(1, 4), (5, 4), (10, 8)] {
        let ocp = problem();
        let verification =
            verify(&ocp, &solution(intervals, points), &VerifySettings::default()).expect("fits");
        assert_exact(&verification.certificate);
        let names: Vec<_> = verification.certificate.checks.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "re-simulated position at the end of push",
                "re-simulated speed at the end of push",
                "boundary conditions of push",
                "times of push",
                "objective energy",
                "states along push against the re-simulation",
                "control bounds along push",
                "costate equation along push",
                "stationarity of the Hamiltonian in the controls of push",
                "least Hamiltonian among all admissible controls of push",
                "Hamiltonian constant along push",
                "transversality at the ends of push",
                "negative curvature of the second variation",
                "second variation positive on all admissible changes",
                "worth of what is missed",
                "convex problem",
            ]
        );
        let simulated = &verification.simulation[0];
        assert_eq!(simulated.times.len(), 16 * intervals);
        for (k, t) in simulated.times.iter().enumerate() {
            assert!((simulated.states[2 * k] - x(*t)[0]).abs() < ROUNDING);
            assert!((simulated.states[2 * k + 1] - x(*t)[1]).abs() < ROUNDING);
            assert!((simulated.controls[k] - (6.0 - 12.0 * t)).abs() < ROUNDING);
        }
        assert!((simulated.integrals[0] - 6.0).abs() < ROUNDING);
    }
}

#[test]
fn the_smallest_margin_of_a_met_bound_is_placed() {
    let certificate = certify(&problem(), &solution(5, 4));
    let check = find(&certificate, "control bounds");
    // |u| = 6 of 10 at both ends; the first found is named.
    assert_eq!((check.value, check.limit), (0.0, 20.0 * 1e-6));
    assert_eq!(check.at, "acceleration, phase `push`, t = 0 s");
    assert_eq!(find(&certificate, "objective").at.split(',').next_back(), Some(" stated 6"));
}

#[test]
fn a_shifted_state_is_rejected() {
    let ocp = problem();
    let mut t = solution(5, 4);
    let breaks = breaks(0.0, 1.0, 5);
    let shifted = |_: usize, t: f64| vec![x(t)[0] + 1e-4 * t, x(t)[1]];
    let nodes = t.phases[0].state.segments()[0].basis.nodes().to_vec();
    t.phases[0].state = parts::polynomial(2, &breaks, &nodes, shifted);
    let certificate = certify(&ocp, &t);
    // The end of the trajectory's own states counts as the miss; the flown path still meets the boundary condition.
    assert_failed(&certificate, &["re-simulated position", "states along push"]);
    let check = find(&certificate, "re-simulated position");
    assert!((check.value - 1e-4).abs() < ROUNDING && check.limit == 1e-7 && check.unit == "m");
    assert_eq!(check.at, "phase `push`, t = 1 s");
}

#[test]
fn a_control_off_by_1e_4_is_rejected() {
    let ocp = problem();
    let mut t = solution(5, 4);
    let breaks = breaks(0.0, 1.0, 5);
    let nodes = t.phases[0].control.segments()[0].basis.nodes().to_vec();
    t.phases[0].control = parts::polynomial(1, &breaks, &nodes, |_, t| vec![6.0 - 12.0 * t + 1e-4]);
    let certificate = certify(&ocp, &t);
    // Position misses by 5e-5, speed by 1e-4; the integral moves by 1e-8 / 2 only, since the mean of u is zero.
    for (name, miss) in
        [("re-simulated position", 5e-5), ("re-simulated speed", 1e-4), ("boundary conditions", 1e-4)]
    {
        let check = find(&certificate, name);
        assert!((check.value - miss).abs() < ROUNDING && !check.passed, "{check:?}");
    }
    // dH/du = 1e-4; the largest term of H is 36 (lambda u at the ends), the scale of the control 20.
    let check = find(&certificate, "stationarity");
    assert!((check.value - 1e-4 * 20.0 / 36.0).abs() < SMALL && !check.passed, "{check:?}");
    let names = ["re-simulated position", "re-simulated speed", "boundary", "states along", "stationarity"];
    assert_failed(&certificate, &names);
}

#[test]
fn a_wrong_objective_is_rejected() {
    let mut t = solution(5, 4);
    t.objective = 6.001;
    let certificate = certify(&problem(), &t);
    assert_failed(&certificate, &["objective"]);
    let check = find(&certificate, "objective");
    assert!((check.value - 1e-3).abs() < INTEGRATION && (check.limit - 6.001e-7).abs() < ROUNDING_OF_LIMITS);
}

#[test]
fn costates_of_the_wrong_sign_are_found() {
    let mut t = solution(5, 4);
    let breaks = breaks(0.0, 1.0, 5);
    let nodes = t.phases[0].costate.as_ref().expect("has costates").segments()[0].basis.nodes().to_vec();
    let negated = |_: usize, t: f64| vec![12.0, 6.0 - 12.0 * t];
    t.phases[0].costate = Some(parts::polynomial(2, &breaks, &nodes, negated));
    let certificate = certify_stated(&problem(), &t);
    // The negated costate still solves the costate equation and the ends are fixed: dH/du and H show it.
    assert_failed(&certificate, &["stationarity", "least Hamiltonian", "Hamiltonian constant"]);
    // At the start dH/du = 12, which asks for the whole way from u = 6 to the lower bound: 16 of 20.
    assert!((find(&certificate, "stationarity").value - 0.8).abs() < ROUNDING);
}

#[test]
fn a_costate_that_does_not_solve_its_equation_is_found() {
    let mut t = solution(5, 4);
    let breaks = breaks(0.0, 1.0, 5);
    let nodes = t.phases[0].costate.as_ref().expect("has costates").segments()[0].basis.nodes().to_vec();
    // Position costate off by 1 %: the equation of the speed costate and the Hamiltonian show it.
    let wrong = |_: usize, t: f64| vec![-12.12, 12.0 * t - 6.0];
    t.phases[0].costate = Some(parts::polynomial(2, &breaks, &nodes, wrong));
    let certificate = certify_stated(&problem(), &t);
    assert_failed(&certificate, &["costate equation", "Hamiltonian constant"]);
    let check = find(&certificate, "costate equation");
    assert!((check.value - 0.12 * 0.2 / 12.12).abs() < DIFFERENCES, "{check:?}");
    assert!(check.at.starts_with("costate of speed"));
    // A jump between intervals.
    let jump = |k: usize, t: f64| vec![-12.0, 12.0 * t - 6.0 + if k == 2 { 1e-3 } else { 0.0 }];
    t.phases[0].costate = Some(parts::polynomial(2, &breaks, &nodes, jump));
    let certificate = certify_stated(&problem(), &t);
    let check = find(&certificate, "costate equation");
    assert!((check.value - 1e-3 / 12.0).abs() < INTEGRATION_OF_COSTATES && !check.passed, "{check:?}");
}

#[test]
fn a_feasible_detour_is_not_optimal() {
    // u = 30 t^4 - ...: any rest-to-rest path; here x = 10 t^3 - 15 t^4 + 6 t^5 with J = 60 / 7.
    let detour = parts::phase(
        "push",
        &breaks(0.0, 1.0, 4),
        6,
        |_, t| {
            vec![
                10.0 * t.powi(3) - 15.0 * t.powi(4) + 6.0 * t.powi(5),
                30.0 * t.powi(2) - 60.0 * t.powi(3) + 30.0 * t.powi(4),
            ]
        },
        |_, t| vec![60.0 * t - 180.0 * t.powi(2) + 120.0 * t.powi(3)],
        |_, t| costate(t),
    );
    let certificate = certify(&problem(), &trajectory(vec![detour], 60.0 / 7.0));
    assert_failed(&certificate, &["stationarity", "least Hamiltonian", "Hamiltonian constant"]);
}

#[test]
fn a_wrong_final_time_is_rejected() {
    let slow = 1.1;
    let stretched = parts::phase(
        "push",
        &breaks(0.0, slow, 5),
        4,
        |_, t| vec![x(t / slow)[0], x(t / slow)[1] / slow],
        |_, t| vec![(6.0 - 12.0 * t / slow) / (slow * slow)],
        |_, t| costate(t),
    );
    let certificate = certify(&problem(), &trajectory(vec![stretched], 6.0 / slow.powi(3)));
    let check = find(&certificate, "times of push");
    assert!(
        (check.value - 0.1).abs() < ROUNDING && !check.passed && check.at.contains("t = 1.1 s"),
        "{check:?}"
    );
}

#[test]
fn bounds_violated_between_the_nodes_only_are_found() {
    // Largest speed 1.5 at t = 0.5, which is no node and no point of the scan; the nodes stay below 1.49.
    let t = solution(1, 4);
    let nodes: Vec<_> = t.phases[0].state.node_times(0).map(|t| x(t)[1]).collect();
    assert!(nodes.iter().all(|v| *v < 1.49));
    let mut limited = phase();
    limited.states[1].variable.bounds = Bounds::at_most(1.49);
    let certificate = certify(&build(limited), &t);
    assert_failed(&certificate, &["state bounds along push"]);
    let check = find(&certificate, "state bounds along push");
    assert!((check.value - 0.01).abs() < ROUNDING && check.limit == 1e-6, "{check:?}");
    assert_eq!(check.at, "speed, phase `push`, t = 0.5 s");
    // A control polynomial beyond its bound at the end, which is not a Radau node.
    let mut limited = phase();
    limited.controls[0].bounds = Bounds::new(-5.0, 7.0);
    let certificate = certify(&build(limited), &t);
    let check = find(&certificate, "control bounds along push");
    assert!((check.value - 1.0).abs() < ROUNDING && check.at.contains("t = 1 s"), "{check:?}");
}

#[test]
fn a_state_tolerance_decides_over_its_scale() {
    let mut loose = phase();
    loose.states[0].tolerance = Some(1e-3);
    loose.states[1].tolerance = Some(1e-3);
    let mut t = solution(5, 4);
    let nodes = t.phases[0].control.segments()[0].basis.nodes().to_vec();
    t.phases[0].control =
        parts::polynomial(1, &breaks(0.0, 1.0, 5), &nodes, |_, t| vec![6.0 - 12.0 * t + 1e-6]);
    assert_failed(&certify(&build(loose), &t), &[]);
    assert_eq!(certify(&problem(), &t).verdict, crate::Verdict::Rejected);
}

#[test]
fn bounds_on_the_integral_are_checked() {
    let mut p = phase();
    p.integrals[0].variable.bounds = Bounds::at_most(5.5);
    let certificate = certify(&build(p), &solution(5, 4));
    let check = find(&certificate, "bounds on the integrals of push");
    assert!(
        (check.value - 0.5).abs() < INTEGRATION && (check.limit - 5.5e-7).abs() < ROUNDING_OF_LIMITS,
        "{check:?}"
    );
}

#[test]
fn without_costates_only_feasibility_is_claimed() {
    let mut t = solution(5, 4);
    t.phases[0].costate = None;
    let certificate = certify_stated(&problem(), &t);
    assert_eq!(certificate.verdict, crate::Verdict::Feasible);
    assert!(certificate.checks.iter().all(|c| c.kind == CheckKind::Feasibility && c.passed));
}

#[test]
fn costates_come_from_the_adjoint_equation_where_none_or_wrong_ones_are_stated() {
    for wrong in [None, Some(-1.0)] {
        let mut t = solution(5, 4);
        let breaks = breaks(0.0, 1.0, 5);
        let nodes = t.phases[0].state.segments()[0].basis.nodes().to_vec();
        let scaled =
            |f: f64| parts::polynomial(2, &breaks, &nodes, |_, t| costate(t).iter().map(|l| f * l).collect());
        t.phases[0].costate = wrong.map(scaled);
        let certificate = certify(&problem(), &t);
        assert_eq!(certificate.verdict, crate::Verdict::GlobalOptimum);
        assert!(certificate.remarks[0].contains("adjoint equation"), "{:?}", certificate.remarks);
    }
}

/// With a constant control in each interval the means of the optimal one, stretched so that the end is met, are best: at the middle of each
/// interval the Hamiltonian is stationary, beside it it is not.
#[test]
fn a_constant_control_is_judged_at_all_times() {
    let intervals = 4;
    let h = 1.0 / intervals as f64;
    let stretch = 1.0 / (1.0 - h * h);
    let breaks = breaks(0.0, 1.0, intervals);
    let middle = |k: usize| (k as f64 + 0.5) * h;
    let control = |k: usize| stretch * (6.0 - 12.0 * middle(k));
    // The sums of the midpoint rule, and the parabola of the interval.
    let state = |k: usize, t: f64| {
        let (mut x, mut v) = (0.0, 0.0);
        for j in 0..k {
            x += v * h + 0.5 * control(j) * h * h;
            v += control(j) * h;
        }
        let s = t - breaks[k];
        vec![x + v * s + 0.5 * control(k) * s * s, v + control(k) * s]
    };
    let stretched = |_: usize, t: f64| costate(t).iter().map(|c| stretch * c).collect();
    let mut phase = parts::phase("push", &breaks, 2, state, |k, _| vec![control(k)], stretched);
    phase.control = parts::polynomial(1, &breaks, &[0.0], |k, _| vec![control(k)]);
    phase.mesh = phase.mesh.with_points(vec![1; intervals]).expect("one point each");
    let objective: f64 = (0..intervals).map(|k| 0.5 * h * control(k).powi(2)).sum();
    let certificate = certify_stated(&problem(), &trajectory(vec![phase], objective));
    assert_failed(&certificate, &["stationarity", "least Hamiltonian"]);
    // At the start of each interval the slope is that of half an interval of the costate and asks for a larger control; the last interval,
    // where it is -4.8, is farthest from the upper bound: 14.8 of 20.
    let check = find(&certificate, "stationarity");
    assert_eq!(check.at, "acceleration, phase `push`, t = 0.75 s");
    assert!((check.value - 0.74).abs() < ROUNDING, "{check:?}");
}
