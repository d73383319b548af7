//! Rest to rest over 1 m in the least time with `|u| <= 1`: `u = 1`, then `-1` from `t = 1 s`; `tf = 2 s`,
//! `lambda = (-1, t - 1)`, `H = -1`. A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 3.9.

use super::parts::{self, DoubleIntegrator, trajectory};
use super::{assert_exact, assert_failed, certify, certify_stated, find};
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Discretisation: costates that are integrated, relative.
const INTEGRATION: f64 = 1e-10;

fn problem() -> Ocp {
    let phase = Phase::new("dash", DoubleIntegrator)
        .states([
            State::new("position", "m").within(-1.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("speed", "m/s").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.1, 10.0));
    Ocp::builder("minimum time")
        .phase(phase)
        .minimize("time", "s", At::FinalTime("dash"))
        .build()
        .expect("well-posed")
}

/// Bang-bang with any acceleration `a`: `tf = 2 / sqrt(a)`, costates scaled to `H = -1`.
fn solution(a: f64) -> Trajectory {
    let half = 1.0 / a.sqrt();
    let breaks = [0.0, 0.5 * half, half, 1.5 * half, 2.0 * half];
    let x = move |_: usize, t: f64| {
        let left = 2.0 * half - t;
        if t <= half { vec![0.5 * a * t * t, a * t] } else { vec![1.0 - 0.5 * a * left * left, a * left] }
    };
    let u = move |k: usize, _: f64| vec![if k < 2 { a } else { -a }];
    let costate = move |_: usize, t: f64| vec![-half, (t - half) * half];
    trajectory(vec![parts::phase("dash", &breaks, 3, x, u, costate)], 2.0 * half)
}

#[test]
fn the_bang_bang_solution_is_verified() {
    let t = solution(1.0);
    let certificate = certify(&problem(), &t);
    assert_exact(&certificate);
    assert_eq!(t.objective, 2.0);
}

#[test]
fn a_slower_bang_bang_is_feasible_but_not_optimal() {
    let certificate = certify(&problem(), &solution(0.8));
    assert_failed(&certificate, &["stationarity", "least Hamiltonian"]);
}

#[test]
fn a_costate_of_wrong_size_misses_the_condition_on_the_final_time() {
    let mut t = solution(1.0);
    let breaks = t.phases[0].state.breaks().to_vec();
    let nodes = t.phases[0].state.segments()[0].basis.nodes().to_vec();
    t.phases[0].costate = Some(parts::polynomial(2, &breaks, &nodes, |_, t| vec![-1.5, 1.5 * (t - 1.0)]));
    let certificate = certify_stated(&problem(), &t);
    assert_failed(&certificate, &["transversality"]);
    let check = find(&certificate, "transversality");
    // H + 1 = -0.5; the largest term of H is 1.5.
    assert!(
        (check.value - 0.5 / 1.5).abs() < INTEGRATION && check.at == "final time, phase `dash`",
        "{check:?}"
    );
}

#[test]
fn a_control_that_pushes_away_from_its_bound_is_found() {
    // The same path with the costate of the opposite motion: dH/du is positive at the upper bound.
    let mut t = solution(1.0);
    let breaks = t.phases[0].state.breaks().to_vec();
    let nodes = t.phases[0].state.segments()[0].basis.nodes().to_vec();
    t.phases[0].costate = Some(parts::polynomial(2, &breaks, &nodes, |_, t| vec![1.0, 1.0 - t]));
    assert_failed(&certify_stated(&problem(), &t), &["stationarity", "least Hamiltonian", "transversality"]);
}

/// `x' = u + t`.
struct Drift;
impl Dynamics<1, 1> for Drift {
    fn rate<S: Scalar>(&self, t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] + t]
    }
}

/// `1 + u^2 / 2`.
struct TimeAndEnergy;
impl PathFunction<1, 1, 1> for TimeAndEnergy {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0] * 0.5 + 1.0]
    }
}

#[test]
fn explicit_time_and_a_free_end() {
    // H = 1 + u^2/2 + lambda (u + t) with u = -lambda constant; H(tf) = 0 and x(tf) = 1 give tf = u = sqrt(2/3).
    let phase = Phase::new("drift", Drift)
        .states([State::new("x", "m").within(-2.0, 2.0).starts_at(0.0).ends_at(1.0)])
        .controls([Variable::new("u", "m/s").within(-5.0, 5.0)])
        .integral(Variable::new("cost", "-"), TimeAndEnergy)
        .final_time(Bounds::new(0.1, 5.0));
    let ocp =
        Ocp::builder("drift").phase(phase).minimize_integral("drift", "cost").build().expect("well-posed");
    let solution = |tf: f64| {
        let u = 1.0 / tf - 0.5 * tf;
        let breaks = parts::breaks(0.0, tf, 3);
        let x = move |_: usize, t: f64| vec![u * t + 0.5 * t * t];
        let phase = parts::phase("drift", &breaks, 4, x, |_, _| vec![u], |_, _| vec![-u]);
        trajectory(vec![phase], tf * (1.0 + 0.5 * u * u))
    };
    let certificate = certify(&ocp, &solution((2.0f64 / 3.0).sqrt()));
    assert_exact(&certificate);
    assert!(certificate.checks.iter().all(|c| !c.name.contains("Hamiltonian constant")));
    assert_failed(&certify(&ocp, &solution(0.9)), &["transversality"]);
}
