//! Path constraints and state bounds that are active.

use super::parts::{self, DoubleIntegrator, Energy, energy, trajectory};
use super::{assert_exact, assert_failed, certify, certify_stated, find};
use crate::Verdict;
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// `x' = u`.
struct Slide;
impl Dynamics<1, 1> for Slide {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// `(u - 2)^2 / 2`.
struct Wish;
impl PathFunction<1, 1, 1> for Wish {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(u[0] - 2.0) * (u[0] - 2.0) * 0.5]
    }
}

/// `u` and `x + u`.
struct Rows;
impl PathFunction<1, 1, 2> for Rows {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [u[0], x[0] + u[0]]
    }
}

fn problem() -> Ocp {
    let phase = Phase::new("slide", Slide)
        .states([State::new("x", "m").starts_at(0.0)])
        .controls([Variable::new("speed", "m/s").within(-5.0, 5.0)])
        .path([Variable::new("limit", "m/s").at_most(1.0), Variable::new("sum", "-").at_most(10.0)], Rows)
        .integral(Variable::new("wish", "-"), Wish)
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("wish").phase(phase).minimize_integral("slide", "wish").build().expect("well-posed")
}

/// `u = 1` against the limit: `dL/du = u - 2 + mu = 0`, so `mu = 1`; `lambda = 0`.
fn solution(mu: Option<[f64; 2]>) -> Trajectory {
    let mut phase = parts::phase(
        "slide",
        &parts::breaks(0.0, 1.0, 2),
        3,
        |_, t| vec![t],
        |_, _| vec![1.0],
        |_, _| vec![0.0],
    );
    phase.path_multipliers = mu.map(|mu| parts::multipliers(&phase, 2, move |_, _| mu.to_vec()));
    trajectory(vec![phase], 0.5)
}

#[test]
fn an_active_path_constraint_with_its_multiplier() {
    let certificate = certify(&problem(), &solution(Some([1.0, 0.0])));
    assert_exact(&certificate);
    assert_eq!(find(&certificate, "limit along slide").limit, 1e-6);
    assert!(find(&certificate, "sum along slide").at.contains("t = 1 s"));
}

#[test]
fn wrong_or_missing_path_multipliers_are_found() {
    let certificate = certify_stated(&problem(), &solution(None));
    assert_failed(&certificate, &["stationarity"]);
    assert!(find(&certificate, "stationarity").at.contains("taken as zero"));
    assert_failed(
        &certify_stated(&problem(), &solution(Some([-1.0, 0.0]))),
        &["stationarity", "signs of the path"],
    );
    // A multiplier on an inactive row: dL/du would vanish, but complementarity does not hold.
    let certificate = certify_stated(&problem(), &solution(Some([0.0, 1.0])));
    assert!(!find(&certificate, "signs of the path multipliers").passed);
}

/// `ln(3 / 2 - u)`, which has no value where `u` would be best.
struct Logarithm;
impl PathFunction<1, 1, 1> for Logarithm {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(-u[0] + 1.5).ln()]
    }
}

/// `u = 1` where `ln(3 / 2 - u) = ln(1 / 2)`: `dL/du = u - 2 - mu / (3 / 2 - u) = 0`, so `mu = -1 / 2`.
#[test]
fn controls_at_which_a_path_constraint_has_no_value_are_not_admissible() {
    let phase = Phase::new("slide", Slide)
        .states([State::new("x", "m").starts_at(0.0)])
        .controls([Variable::new("speed", "m/s").within(-5.0, 5.0)])
        .path([Variable::new("limit", "-").at_least(0.5_f64.ln())], Logarithm)
        .integral(Variable::new("wish", "-"), Wish)
        .final_time(Bounds::fixed(1.0));
    let ocp = Ocp::builder("wish").phase(phase).minimize_integral("slide", "wish").build();
    let mut found = solution(None);
    found.phases[0].path_multipliers = Some(parts::multipliers(&found.phases[0], 1, |_, _| vec![-0.5]));
    let certificate = certify_stated(&ocp.expect("well-posed"), &found);
    assert_exact(&certificate);
    assert!(certificate.verdict >= Verdict::StrictLocalOptimum, "{certificate:#?}");
}

#[test]
fn a_path_constraint_violated_between_the_nodes() {
    // Radau nodes of three points at -1, -0.29, 0.69; the polynomial peaks in between.
    let peak = |t: f64| vec![0.9 + 0.4 * (t - 0.3) * (0.9 - t)];
    let mut t = solution(Some([0.0, 0.0]));
    let area = |t: f64| 0.9 * t + 0.4 * (-t.powi(3) / 3.0 + 0.6 * t * t - 0.27 * t);
    t.phases[0] =
        parts::phase("slide", &[0.0, 1.0], 3, |_, t| vec![area(t)], |_, t| peak(t), |_, _| vec![0.0]);
    let mut ocp = problem();
    ocp.phases[0].path[0].rows[0].bounds = Bounds::at_most(0.93);
    let nodes: Vec<f64> = t.phases[0].control.node_times(0).map(|t| peak(t)[0]).collect();
    assert!(nodes.iter().all(|u| *u < 0.93), "{nodes:?}");
    let check = find(&certify(&ocp, &t), "limit along slide").clone();
    assert!(
        (check.value - 0.006).abs() < ROUNDING && check.at.contains("t = 0.6 s") && !check.passed,
        "{check:?}"
    );
}

/// Bryson and Denham: the minimum-energy arc under the ceiling `x <= 1/9`; `J = 4 / (9 l) = 4`.
/// A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 3.11, example 2.
#[test]
fn an_active_state_bound() {
    let l = 1.0 / 9.0;
    let phase = Phase::new("arc", DoubleIntegrator)
        .states([
            State::new("position", "m").within(-1.0, l).starts_at(0.0).ends_at(0.0),
            State::new("speed", "m/s").within(-2.0, 2.0).starts_at(1.0).ends_at(-1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-20.0, 20.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0));
    let ocp =
        Ocp::builder("ceiling").phase(phase).minimize_integral("arc", "energy").build().expect("well-posed");
    let breaks = parts::breaks(0.0, 1.0, 6);
    // The arc from a start on the ceiling's far side: mirrored for the last third.
    let rise = |t: f64| {
        let s = 1.0 - 3.0 * t; // 1 - t / (3 l)
        [l * (1.0 - s.powi(3)), s * s, -6.0 * s]
    };
    let x = |k: usize, t: f64| match k {
        0 | 1 => vec![rise(t)[0], rise(t)[1]],
        2 | 3 => vec![l, 0.0],
        _ => vec![rise(1.0 - t)[0], -rise(1.0 - t)[1]],
    };
    let u = |k: usize, t: f64| match k {
        0 | 1 => rise(t)[2],
        2 | 3 => 0.0,
        _ => rise(1.0 - t)[2],
    };
    let with_jumps_of = |middle: f64| {
        let costate = |k: usize, t: f64| vec![[18.0, middle, -18.0][k / 2], -u(k, t)];
        let found = parts::phase("arc", &breaks, 5, x, |k, t| vec![u(k, t)], costate);
        certify_stated(&ocp, &trajectory(vec![found], 4.0))
    };
    // On the ceiling only the sign of what drives the costate is known: it may not rise.
    let certificate = with_jumps_of(0.0);
    assert_exact(&certificate);
    assert_eq!(certificate.verdict, Verdict::GlobalOptimum);
    assert_failed(&with_jumps_of(36.0), &["costate equation"]);
}
