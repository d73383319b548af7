//! Extremals across kinks of the Lagrangian in states: the second variation has a term where they pass them. Closed forms.

use super::parts::{breaks, phase, trajectory};
use super::{assert_failed, certify};
use crate::{Certificate, Verdict};
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Ocp, Phase, Sense, State, Term, Trajectory, Variable};

/// `x' = u`.
struct Rate;
impl Dynamics<1, 1> for Rate {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// `effort (u - drift)^2 - spring x^2 + slope x + kink |x - drift t|`.
#[derive(Clone, Copy, Default)]
struct Cost {
    effort: f64,
    spring: f64,
    slope: f64,
    kink: f64,
    drift: f64,
}
impl PathFunction<1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let (x, u, y) = (x[0], u[0] - self.drift, x[0] - t * self.drift);
        [u * u * self.effort - x * x * self.spring + x * self.slope + y.abs() * self.kink]
    }
}

/// `x` from one value to another between `-half` and `half`.
fn crossing(cost: Cost, half: f64, ends: [f64; 2]) -> Ocp {
    let phase = Phase::new("arc", Rate)
        .states([State::new("x", "-").starts_at(ends[0]).ends_at(ends[1]).scaled_by(1.0)])
        .controls([Variable::new("u", "-").scaled_by(1.0)])
        .integral(Variable::new("cost", "-"), cost)
        .initial_time(Bounds::fixed(-half))
        .final_time(Bounds::fixed(half));
    Ocp::builder("kink").phase(phase).minimize_integral("arc", "cost").build().expect("well-posed")
}

/// The value of an integral over an odd trajectory, by the rule of Simpson on its second half.
fn twice_the_second_half(half: f64, integrand: impl Fn(f64) -> f64) -> f64 {
    let n = 2000;
    let h = half / f64::from(n);
    let weight = |k: i32| {
        if k == 0 || k == n {
            1.0
        } else if k % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    2.0 * h / 3.0 * (0..=n).map(|k| weight(k) * integrand(h * f64::from(k))).sum::<f64>()
}

/// An odd trajectory with `lambda = -2 u` on an even number of intervals, or an odd one with the kink inside an interval.
fn odd(half: f64, objective: f64, x: impl Fn(f64) -> f64, u: impl Fn(f64) -> f64) -> Trajectory {
    let breaks = breaks(-half, half, 20);
    let x = |t: f64| if t < 0.0 { -x(-t) } else { x(t) };
    let arc =
        phase("arc", &breaks, 8, |_, t| vec![x(t)], |_, t| vec![u(t.abs())], |_, t| vec![-2.0 * u(t.abs())]);
    trajectory(vec![arc], objective)
}

/// `int u^2 + kink |x|` between the ends `-end` and `end` over the time 1: `x'' = kink sign(x) / 2`, with the speed `2 end - kink / 8` at the
/// crossing.
fn parabolas(kink: f64, end: f64) -> Certificate {
    let cost = Cost { effort: 1.0, kink, ..Cost::default() };
    let speed = 2.0 * end - kink / 8.0;
    let (x, u) = (|t: f64| speed * t + 0.25 * kink * t * t, |t: f64| speed + 0.5 * kink * t);
    let value = twice_the_second_half(0.5, |t| u(t) * u(t) + kink * x(t));
    certify(&crossing(cost, 0.5, [-end, end]), &odd(0.5, value, x, u))
}

/// A tent over the crossing has the second variation `8 + 2 kink / speed` of its height.
#[test]
fn a_concave_kink_passed_slowly_is_a_saddle() {
    // Speeds 1.5 and 1 below 2.
    for end in [0.25, 0.0] {
        assert_failed(&parabolas(-8.0, end), &["negative curvature"]);
    }
    // Speeds 3 and 2.2.
    for end in [1.0, 0.6] {
        let certificate = parabolas(-8.0, end);
        assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
    }
}

#[test]
fn a_convex_kink_that_is_passed_leaves_a_minimum() {
    for end in [0.6, 2.0] {
        let certificate = parabolas(8.0, end);
        assert!(certificate.verdict >= Verdict::StrictLocalOptimum, "{certificate:#?}");
    }
}

/// `u^2 - x^2 + 2 |x|` over the time 4, longer than the half period: `x = 1 - cos t + sin t` after the crossing. Even changes
/// have `4 cot 2 + 4 > 0`, odd ones vanish in the middle. Without the term the conjugate point would be inside.
#[test]
fn a_convex_kink_makes_a_minimum_beyond_the_half_period() {
    let half = 2.0;
    for (kink, is_minimum) in [(2.0, true), (0.5, false)] {
        let cost = Cost { effort: 1.0, spring: 1.0, kink, ..Cost::default() };
        let x = |t: f64| 0.5 * kink * (1.0 - t.cos()) + t.sin();
        let u = |t: f64| 0.5 * kink * t.sin() + t.cos();
        let value = twice_the_second_half(half, |t| u(t) * u(t) - x(t) * x(t) + kink * x(t));
        let ocp = crossing(cost, half, [-x(half), x(half)]);
        let certificate = certify(&ocp, &odd(half, value, x, u));
        if is_minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            // 4 cot 2 + 2 kink is negative.
            assert_failed(&certificate, &["negative curvature"]);
        }
    }
}

/// The same in a frame that moves: the kink depends on time.
#[test]
fn a_kink_that_moves_is_judged_as_one_at_rest() {
    for (end, is_minimum) in [(0.25, false), (1.0, true)] {
        let (kink, drift) = (-8.0, 0.7);
        let cost = Cost { effort: 1.0, kink, drift, ..Cost::default() };
        let speed = 2.0 * end - kink / 8.0;
        let y = |t: f64| speed * t + 0.25 * kink * t * t.abs();
        let u = |t: f64| speed + 0.5 * kink * t.abs();
        let value = twice_the_second_half(0.5, |t| u(t) * u(t) + kink * y(t));
        let breaks = breaks(-0.5, 0.5, 20);
        let x = |t: f64| y(t) + drift * t;
        let arc =
            phase("arc", &breaks, 8, |_, t| vec![x(t)], |_, t| vec![u(t) + drift], |_, t| vec![-2.0 * u(t)]);
        let ocp = crossing(cost, 0.5, [x(-0.5), x(0.5)]);
        let certificate = certify(&ocp, &trajectory(vec![arc], value));
        if is_minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            assert_failed(&certificate, &["negative curvature"]);
        }
    }
}

/// `u^2 - 8 sqrt(x^2)`.
struct Root;
impl PathFunction<1, 1, 1> for Root {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0] - (x[0] * x[0]).sqrt() * 8.0]
    }
}

/// The saddle of the concave kink, written as a root of zero.
#[test]
fn no_strict_minimum_is_claimed_across_a_root_of_zero() {
    let end = 0.25;
    let phase_of_problem = Phase::new("arc", Rate)
        .states([State::new("x", "-").starts_at(-end).ends_at(end).scaled_by(1.0)])
        .controls([Variable::new("u", "-").scaled_by(1.0)])
        .integral(Variable::new("cost", "-"), Root)
        .initial_time(Bounds::fixed(-0.5))
        .final_time(Bounds::fixed(0.5));
    let ocp = Ocp::builder("root").phase(phase_of_problem).minimize_integral("arc", "cost").build();
    let ocp = ocp.expect("well-posed");
    // Not zero itself, where the root has no derivative.
    let (x, u) = (|t: f64| (1.5 * t - 2.0 * t * t).max(1e-14), |t: f64| 1.5 - 4.0 * t);
    let value = twice_the_second_half(0.5, |t| u(t) * u(t) - 8.0 * x(t));
    let certificate = certify(&ocp, &odd(0.5, value, x, u));
    assert_eq!(certificate.verdict, Verdict::Extremal, "{certificate:#?}");
    assert!(certificate.remarks.iter().any(|r| r.contains("root of zero")), "{:?}", certificate.remarks);
}

/// Rest along the kink: any change that leaves it lowers the value to first order.
#[test]
fn rest_along_a_concave_kink_is_no_minimum() {
    let cost = Cost { effort: 1.0, kink: -8.0, ..Cost::default() };
    let certificate = certify(&crossing(cost, 0.5, [0.0, 0.0]), &odd(0.5, 0.0, |_| 0.0, |_| 0.0));
    assert_failed(&certificate, &["negative curvature"]);
}

#[test]
fn rest_along_a_convex_kink_stays_a_minimum() {
    let cost = Cost { effort: 1.0, kink: 8.0, ..Cost::default() };
    let certificate = certify(&crossing(cost, 0.5, [0.0, 0.0]), &odd(0.5, 0.0, |_| 0.0, |_| 0.0));
    assert!(certificate.verdict >= Verdict::StrictLocalOptimum, "{certificate:#?}");
}

/// `x' = |y|`, `y' = u`.
struct Drift;
impl Dynamics<2, 1> for Drift {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1].abs(), u[0]]
    }
}

/// `u^2`.
struct Effort;
impl PathFunction<2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0]]
    }
}

/// The kink in the equations of motion, weighted by its costate -8: `u^2 + lambda |y|` as above.
#[test]
fn a_kink_of_the_equations_of_motion_counts_by_its_costate() {
    for (end, is_minimum) in [(0.25, false), (1.0, true)] {
        let reward: f64 = 8.0;
        let phase_of_problem = Phase::new("arc", Drift)
            .states([
                State::new("x", "-").starts_at(0.0).scaled_by(1.0),
                State::new("y", "-").starts_at(-end).ends_at(end).scaled_by(1.0),
            ])
            .controls([Variable::new("u", "-").scaled_by(1.0)])
            .integral(Variable::new("effort", "-"), Effort)
            .initial_time(Bounds::fixed(-0.5))
            .final_time(Bounds::fixed(0.5));
        let ocp = Ocp::builder("drift")
            .phase(phase_of_problem)
            .objective(
                Sense::Minimize,
                "cost",
                "-",
                [Term::Integral("arc", "effort", 1.0), Term::End(At::FinalState("arc", "x"), -reward)],
            )
            .build()
            .expect("well-posed");
        let speed = 2.0 * end + reward / 8.0;
        let y = |t: f64| speed * t - 0.25 * reward * t * t.abs();
        let u = |t: f64| speed - 0.5 * reward * t.abs();
        // The integral of |y| from the start.
        let to_middle = |t: f64| 0.5 * speed * t * t - reward / 12.0 * t.powi(3);
        let whole = to_middle(0.5);
        let x = |t: f64| if t < 0.0 { whole - to_middle(-t) } else { whole + to_middle(t) };
        let value = twice_the_second_half(0.5, |t| u(t) * u(t)) - reward * 2.0 * whole;
        let arc = phase(
            "arc",
            &breaks(-0.5, 0.5, 20),
            8,
            |_, t| vec![x(t), y(t)],
            |_, t| vec![u(t)],
            |_, t| vec![-reward, -2.0 * u(t)],
        );
        let certificate = certify(&ocp, &trajectory(vec![arc], value));
        if is_minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            assert_failed(&certificate, &["negative curvature"]);
        }
    }
}

/// `x' = u` with `|u| <= 1`, the integral of `slope x + kink |x|` and a price of the end: `u = 1` until `t = 1/4`, then -1, so that `x` passes
/// zero at twice that time. In the switching time the value has the second derivative `6 kink - 2 slope`.
#[test]
fn a_switching_time_moves_the_passage_of_a_kink() {
    for (slope, kink, is_minimum) in [(-1.0, -1.0, false), (-2.0, 1.0, true), (-4.0, -1.0, true)] {
        let (s, to) = (0.25, 1.0);
        let price = -(slope + kink) * s - (slope - kink) * (to - 2.0 * s);
        let control = Variable::new("u", "-").within(-1.0, 1.0).scaled_by(1.0);
        let phase_of_problem = Phase::new("arc", Rate)
            .states([State::new("x", "-").starts_at(0.0).scaled_by(1.0)])
            .controls([control])
            .integral(Variable::new("cost", "-"), Cost { slope, kink, ..Cost::default() })
            .final_time(Bounds::fixed(to));
        let ocp = Ocp::builder("switch")
            .phase(phase_of_problem)
            .objective(
                Sense::Minimize,
                "cost",
                "-",
                [Term::Integral("arc", "cost", 1.0), Term::End(At::FinalState("arc", "x"), price)],
            )
            .build()
            .expect("well-posed");
        let costate = |t: f64| {
            if t < 2.0 * s { (slope + kink) * (s - t) } else { price + (slope - kink) * (to - t) }
        };
        let value =
            (slope + kink) * s * s - 0.5 * (slope - kink) * (to - 2.0 * s).powi(2) + price * (2.0 * s - to);
        let breaks = [0.0, 0.1, s, 0.4, 2.0 * s, 0.8, to];
        let arc = phase(
            "arc",
            &breaks,
            5,
            |_, t| vec![s - (t - s).abs()],
            |k, _| vec![if breaks[k] < s { 1.0 } else { -1.0 }],
            |_, t| vec![costate(t)],
        );
        let certificate = certify(&ocp, &trajectory(vec![arc], value));
        if is_minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            assert_failed(&certificate, &["negative curvature"]);
        }
    }
}
