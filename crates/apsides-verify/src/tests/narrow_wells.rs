//! Controls with a smaller Hamiltonian that a search over a grid does not meet, in closed form, and sets of controls without them.

use super::parts::{breaks, multipliers, phase, trajectory};
use super::{assert_failed, certify, find};
use crate::{Verdict, VerifySettings, with_least_hamiltonian};
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// `x' = u_1`.
struct Rate;
impl<const NU: usize> Dynamics<1, NU> for Rate {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; NU], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// `|u|^2 - depth exp(-|u - at|^2 / width^2)`.
#[derive(Clone, Copy)]
struct Well<const NU: usize> {
    at: [f64; NU],
    width: f64,
    depth: f64,
}
impl<const NU: usize> PathFunction<1, NU, 1> for Well<NU> {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; NU], _p: &[S; 0]) -> [S; 1] {
        let (mut square, mut distance) = (S::from(0.0), S::from(0.0));
        for (u, at) in u.iter().zip(self.at) {
            square += *u * *u;
            distance += ((*u - at) * self.width.recip()).square();
        }
        [square - (-distance).exp() * self.depth]
    }
}

/// `u^2` of one control.
struct Square;
impl PathFunction<1, 1, 1> for Square {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0]]
    }
}

/// The same, known by its values alone.
struct OpaqueSquare;
impl PathFunction<1, 1, 1> for OpaqueSquare {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].map(|u| [u * u, 2.0 * u, 2.0])]
    }
}

/// `u_1^2` and the sum of `1 - cos(u_i - u_j)`, written so that it takes many boxes to see that it is not negative.
struct Angles;
impl PathFunction<1, 5, 1> for Angles {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 5], _p: &[S; 0]) -> [S; 1] {
        let mut sum = u[0] * u[0];
        for i in 0..5 {
            for j in 0..i {
                sum = sum - u[i].cos() * u[j].cos() - u[i].sin() * u[j].sin() + 1.0;
            }
        }
        [sum]
    }
}

/// From 0 to `end` in one unit of time.
fn arc<const NU: usize>(cost: impl PathFunction<1, NU, 1> + 'static, bounds: Bounds, end: f64) -> Phase {
    let control = |j| Variable { bounds, ..Variable::new(format!("u{j}"), "-") }.scaled_by(1.0);
    Phase::new::<_, 1, NU, 0>("arc", Rate)
        .states([State::new("x", "-").starts_at(0.0).ends_at(end).scaled_by(1.0)])
        .controls((1..=NU).map(control))
        .integral(Variable::new("cost", "-"), cost)
        .initial_time(Bounds::fixed(0.0))
        .final_time(Bounds::fixed(1.0))
}

fn ocp(arc: Phase) -> Ocp {
    Ocp::builder("well").phase(arc).minimize_integral("arc", "cost").build().expect("well-posed")
}

/// Constant controls, of which the first one is the end; costates of the cost `u^2`.
fn straight(controls: usize, end: f64) -> Trajectory {
    let mut control = vec![0.0; controls];
    control[0] = end;
    let breaks = breaks(0.0, 1.0, 10);
    let arc = phase("arc", &breaks, 4, |_, t| vec![end * t], |_, _| control.clone(), |_, _| vec![-2.0 * end]);
    trajectory(vec![arc], end * end)
}

/// Solver: the last steps of a compass search.
const SEARCH: f64 = 1e-5;

#[test]
fn a_well_of_a_thousandth() {
    let well = Well { at: [9.0], width: 1e-3, depth: 90.0 };
    let posed = ocp(arc(well, Bounds::new(-10.0, 10.0), 1.0));
    let certificate = certify(&posed, &straight(1, 1.0));
    assert_failed(&certificate, &["least Hamiltonian"]);
    let check = find(&certificate, "least Hamiltonian");
    assert!(check.at.contains("u1 9.0000") && !check.at.contains("searched"), "{}", check.at);
    // v^2 - 2 v: -1 at 1, and 63 - 90 in the well; the largest term is 2.
    assert!((check.value - 13.0).abs() < SEARCH, "{}", check.value);
    let better = with_least_hamiltonian(&posed, &straight(1, 1.0), &VerifySettings::default());
    let better = better.expect("fits").expect("better controls");
    for u in better.phases[0].control.segments().iter().flat_map(|s| &s.values) {
        assert!((u - 9.0).abs() < SEARCH, "{u}");
    }
}

#[test]
fn a_well_of_three_controls() {
    let well = Well { at: [0.5, 0.6, -0.55], width: 0.02, depth: 12.0 };
    let certificate = certify(&ocp(arc(well, Bounds::new(-1.0, 1.0), 0.1)), &straight(3, 0.1));
    assert_failed(&certificate, &["least Hamiltonian"]);
    let check = find(&certificate, "least Hamiltonian");
    for words in ["u1 0.49", "u2 0.59", "u3 -0.54"] {
        assert!(check.at.contains(words), "{}", check.at);
    }
}

#[test]
fn a_well_of_a_control_without_bounds() {
    let well = Well { at: [20.0], width: 1.5, depth: 900.0 };
    let certificate = certify(&ocp(arc(well, Bounds::FREE, 0.5)), &straight(1, 0.5));
    assert_failed(&certificate, &["least Hamiltonian"]);
    let check = find(&certificate, "least Hamiltonian");
    assert!(check.at.contains("smaller with u1 19.9"), "{}", check.at);
}

/// A quadratic is proved over all numbers; a well that is not deep enough holds nothing better.
#[test]
fn nothing_is_missed_without_bounds() {
    let certificate = certify(&ocp(arc(Square, Bounds::FREE, 0.5)), &straight(1, 0.5));
    assert_eq!(certificate.verdict, Verdict::GlobalOptimum);
    assert!(!find(&certificate, "least Hamiltonian").at.contains("searched"));
    let shallow = Well { at: [9.0], width: 0.1, depth: 50.0 };
    let certificate = certify(&ocp(arc(shallow, Bounds::new(-10.0, 10.0), 0.5)), &straight(1, 0.5));
    assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum);
    assert!(!find(&certificate, "least Hamiltonian").at.contains("searched"));
}

#[test]
fn a_well_that_a_path_constraint_cuts_off() {
    let well = Well { at: [9.0], width: 0.1, depth: 90.0 };
    for (largest, verdict) in [(64.0, Verdict::StrictLocalOptimum), (90.0, Verdict::Feasible)] {
        let row = Variable { bounds: Bounds::at_most(largest), ..Variable::new("square", "-") };
        let posed = ocp(arc(well, Bounds::new(-10.0, 10.0), 1.0).path([row], Square));
        let mut straight = straight(1, 1.0);
        straight.phases[0].path_multipliers = Some(multipliers(&straight.phases[0], 1, |_, _| vec![0.0]));
        let certificate = certify(&posed, &straight);
        assert_eq!(certificate.verdict, verdict, "{certificate:#?}");
        assert!(!find(&certificate, "least Hamiltonian").at.contains("searched"));
    }
}

#[test]
fn what_is_searched_alone_is_said() {
    let certificate = certify(&ocp(arc(Angles, Bounds::new(-3.0, 3.0), 0.0)), &straight(5, 0.0));
    let check = find(&certificate, "least Hamiltonian");
    assert!(check.passed && check.at.contains("searched, not proved: not settled at t = "), "{}", check.at);
    assert!(check.at.ends_with("with 5000 boxes of controls"), "{}", check.at);
    let certificate = certify(&ocp(arc(OpaqueSquare, Bounds::FREE, 0.5)), &straight(1, 0.5));
    let check = find(&certificate, "least Hamiltonian");
    assert!(check.passed, "{check:#?}");
    let words = "searched, not proved: a function of the phase is no formula; controls without bounds searched about the range met";
    assert!(check.at.ends_with(words), "{}", check.at);
}
