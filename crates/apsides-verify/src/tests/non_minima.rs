//! Trajectories that meet the first-order conditions of the textbooks and are no minima, in closed form, beside minima of
//! the same problems. I. M. Gelfand and S. V. Fomin, Calculus of Variations, Prentice-Hall 1963, chapters 5 and 6.

use super::parts::{breaks, phase, trajectory};
use super::{assert_failed, certify, find};
use crate::{Certificate, Verdict, VerifySettings, with_least_hamiltonian};
use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, Sense, State, Term, Trajectory, Variable};

/// Round-off of controls at their bounds.
const ROUNDING: f64 = 1e-12;

/// Discretisation: the conjugate point in a sweep.
const CONJUGATE: f64 = 1e-6;

/// Discretisation: the same for where two tangents meet.
const CONJUGATE_TANGENTS: f64 = 1e-5;

/// `x' = u`.
struct Rate;
impl Dynamics<1, 1> for Rate {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// Integrands of `x' = u`.
#[derive(Clone, Copy)]
enum Cost {
    /// `-u^2`.
    NegativeSquare,
    /// `u^2 - x^2`.
    Oscillator,
    /// `-x^2`.
    NegativeState,
    /// `sqrt(u^2 + cos^2 x)`: length on the unit sphere, latitude over longitude.
    Sphere,
    /// `x sqrt(1 + u^2)`: area of a surface of revolution.
    Catenary,
}
impl PathFunction<1, 1, 1> for Cost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let (x, u) = (x[0], u[0]);
        [match self {
            Self::NegativeSquare => -(u * u),
            Self::Oscillator => u * u - x * x,
            Self::NegativeState => -(x * x),
            Self::Sphere => (u * u + x.cos() * x.cos()).sqrt(),
            Self::Catenary => x * (u * u + 1.0).sqrt(),
        }]
    }
}

fn problem(cost: Cost, state: State, control: Bounds, from: f64, to: f64) -> Ocp {
    let control = Variable { bounds: control, ..Variable::new("u", "-") };
    let phase = Phase::new("arc", Rate)
        .states([state.scaled_by(1.0)])
        .controls([control.scaled_by(1.0)])
        .integral(Variable::new("cost", "-"), cost)
        .initial_time(Bounds::fixed(from))
        .final_time(Bounds::fixed(to));
    Ocp::builder("non-minimum").phase(phase).minimize_integral("arc", "cost").build().expect("well-posed")
}

fn solution(
    ends: (f64, f64),
    objective: f64,
    x: impl Fn(f64) -> f64,
    u: impl Fn(f64) -> f64,
    costate: impl Fn(f64) -> f64,
) -> Trajectory {
    let breaks = breaks(ends.0, ends.1, 20);
    let arc = phase("arc", &breaks, 8, |_, t| vec![x(t)], |_, t| vec![u(t)], |_, t| vec![costate(t)]);
    trajectory(vec![arc], objective)
}

/// The conjugate time that a certificate names.
fn conjugate_time(certificate: &Certificate) -> f64 {
    let at = &find(certificate, "negative curvature").at;
    assert!(at.starts_with("conjugate point at"), "{at}");
    at.rsplit("t = ")
        .next()
        .and_then(|t| t.split_whitespace().next())
        .and_then(|t| t.parse().ok())
        .expect("a time")
}

fn rest(cost: Cost, control: Bounds, to: f64) -> Certificate {
    let state = State::new("x", "-").starts_at(0.0).ends_at(0.0);
    certify(&problem(cost, state, control, 0.0, to), &solution((0.0, to), 0.0, |_| 0.0, |_| 0.0, |_| 0.0))
}

#[test]
fn a_maximum_of_the_hamiltonian() {
    let certificate = rest(Cost::NegativeSquare, Bounds::new(-1.0, 1.0), 1.0);
    assert_failed(&certificate, &["least Hamiltonian"]);
}

/// Better controls are at their bounds where rest is a maximum; a minimum has none.
#[test]
fn better_controls_of_a_maximum() {
    let settings = VerifySettings::default();
    let state = || State::new("x", "-").starts_at(0.0).ends_at(0.0);
    let control = Bounds::new(-1.0, 1.0);
    let rest = solution((0.0, 1.0), 0.0, |_| 0.0, |_| 0.0, |_| 0.0);
    let maximum = problem(Cost::NegativeSquare, state(), control, 0.0, 1.0);
    let better = with_least_hamiltonian(&maximum, &rest, &settings).unwrap().expect("better controls");
    let values = better.phases[0].control.segments().iter().flat_map(|s| &s.values);
    assert!(values.clone().count() > 100);
    for u in values {
        assert!((u.abs() - 1.0).abs() < ROUNDING, "{u}");
    }
    let minimum = problem(Cost::Oscillator, state(), control, 0.0, 1.0);
    assert!(with_least_hamiltonian(&minimum, &rest, &settings).unwrap().is_none());
}

#[test]
fn a_singular_arc_that_is_a_maximum() {
    // -x^2 with x' = u: the Hamiltonian does not depend on u, and every change lowers the cost.
    let certificate = rest(Cost::NegativeState, Bounds::new(-1.0, 1.0), 1.0);
    assert_failed(&certificate, &["negative curvature"]);
    assert_eq!(certificate.verdict, Verdict::Feasible);
}

#[test]
fn beyond_the_conjugate_point() {
    // u^2 - x^2: the fields x = sin t meet again at pi.
    for to in [3.2, 5.0] {
        let certificate = rest(Cost::Oscillator, Bounds::FREE, to);
        assert_failed(&certificate, &["negative curvature"]);
        assert!((conjugate_time(&certificate) - std::f64::consts::PI).abs() < CONJUGATE);
    }
    assert_eq!(rest(Cost::Oscillator, Bounds::FREE, 3.0).verdict, Verdict::StrictLocalOptimum);
}

#[test]
fn a_free_start_has_its_focal_point_after_half_the_time() {
    let certify_to = |to: f64| {
        let state = State::new("x", "-").ends_at(0.0);
        let ocp = problem(Cost::Oscillator, state, Bounds::FREE, 0.0, to);
        certify(&ocp, &solution((0.0, to), 0.0, |_| 0.0, |_| 0.0, |_| 0.0))
    };
    let certificate = certify_to(2.0);
    assert_failed(&certificate, &["negative curvature"]);
    assert!((conjugate_time(&certificate) - std::f64::consts::FRAC_PI_2).abs() < CONJUGATE);
    assert_eq!(certify_to(1.5).verdict, Verdict::StrictLocalOptimum);
}

#[test]
fn the_action_of_an_oscillator_beyond_half_a_period() {
    // x = sin t / sin T with x(T) = 1; lambda = -2 u, and the value is cot T.
    for (to, minimum) in [(4.0f64, false), (1.0, true)] {
        let ocp = problem(
            Cost::Oscillator,
            State::new("x", "-").starts_at(0.0).ends_at(1.0),
            Bounds::FREE,
            0.0,
            to,
        );
        let (u, x) = (|t: f64| t.cos() / to.sin(), |t: f64| t.sin() / to.sin());
        let certificate = certify(&ocp, &solution((0.0, to), 1.0 / to.tan(), x, u, |t| -2.0 * u(t)));
        if minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            assert_failed(&certificate, &["negative curvature"]);
            assert!((conjugate_time(&certificate) - std::f64::consts::PI).abs() < CONJUGATE);
        }
    }
}

#[test]
fn a_great_circle_beyond_the_antipode() {
    // The equator; value and Hamiltonian are one per radian.
    let along = |to: f64| {
        let ocp =
            problem(Cost::Sphere, State::new("x", "rad").starts_at(0.0).ends_at(0.0), Bounds::FREE, 0.0, to);
        certify(&ocp, &solution((0.0, to), to, |_| 0.0, |_| 0.0, |_| 0.0))
    };
    let certificate = along(3.5);
    assert_failed(&certificate, &["negative curvature"]);
    assert!((conjugate_time(&certificate) - std::f64::consts::PI).abs() < CONJUGATE);
    assert_eq!(along(3.0).verdict, Verdict::StrictLocalOptimum);
}

#[test]
fn the_upper_and_the_lower_catenary() {
    // c cosh(1/2 / c) = 1 has two roots. The tangents of a catenary in conjugate points meet on the axis (Lindeloef 1860).
    let root = |mut low: f64, mut high: f64| {
        let f = |c: f64| c * (0.5 / c).cosh() - 1.0;
        let rising = f(high) > f(low);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if (f(middle) > 0.0) == rising { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    };
    for (c, minimum) in [(root(0.5, 2.0), true), (root(0.1, 0.4), false)] {
        let ends = (-0.5, 0.5);
        let state = State::new("x", "-").within(0.01, 5.0).starts_at(1.0).ends_at(1.0);
        let ocp = problem(Cost::Catenary, state, Bounds::FREE, ends.0, ends.1);
        let (x, u) = (|t: f64| c * (t / c).cosh(), |t: f64| (t / c).sinh());
        // The integral of c cosh^2(t / c); lambda = -x u / sqrt(1 + u^2).
        let area = c * (0.5 + 0.5 * c * (1.0 / c).sinh());
        let costate = |t: f64| -c * (t / c).sinh();
        let certificate = certify(&ocp, &solution(ends, area, x, u, costate));
        if minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            assert_failed(&certificate, &["negative curvature"]);
            // Start and conjugate point have the tangents t - x / u through one point of the axis.
            let foot = |t: f64| t - x(t) / u(t);
            let conjugate = conjugate_time(&certificate);
            assert!((foot(conjugate) - foot(-0.5)).abs() < CONJUGATE_TANGENTS, "{conjugate}");
        }
    }
}

#[test]
fn a_bang_bang_extremal_that_is_a_maximum_in_its_switching_time() {
    // x' = u, |u| <= 1, x(0) = 0, maximise the integral of x^2 over [0, 3]: u = 1 until t = 1, then -1, has strict switching;
    // J(s) = -(2 s^3 + (3 - 2 s)^3) / 3 has its maximum there, the minima are u = 1 and u = -1.
    let ocp =
        problem(Cost::NegativeState, State::new("x", "-").starts_at(0.0), Bounds::new(-1.0, 1.0), 0.0, 3.0);
    let x = |t: f64| 1.0 - (t - 1.0).abs();
    // lambda' = 2 x, lambda(3) = 0 = lambda(1).
    let costate = |t: f64| if t < 1.0 { t * t - 1.0 } else { 4.0 * t - t * t - 3.0 };
    let build = |breaks: &[f64], up: f64, x: &dyn Fn(f64) -> f64, costate: &dyn Fn(f64) -> f64, objective| {
        let u = |t: f64| if t < up { 1.0 } else { -1.0 };
        let middle = |k: usize| 0.5 * (breaks[k] + breaks[k + 1]);
        let arc =
            phase("arc", breaks, 5, |_, t| vec![x(t)], |k, _| vec![u(middle(k))], |_, t| vec![costate(t)]);
        trajectory(vec![arc], objective)
    };
    let certificate = certify(&ocp, &build(&[0.0, 0.5, 1.0, 2.0, 3.0], 1.0, &x, &costate, -1.0));
    assert_failed(&certificate, &["negative curvature"]);
    let straight = build(&[0.0, 1.0, 3.0], 4.0, &|t| t, &|t| t * t - 9.0, -9.0);
    let certificate = certify(&ocp, &straight);
    assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
}

/// `T - c (T - 1)^2`.
struct Late(f64);
impl VectorFunction<1, 1> for Late {
    fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
        let late = z[0] - 1.0;
        [z[0] - late * late * self.0]
    }
}

/// `u^2`.
struct Square;
impl PathFunction<1, 1, 1> for Square {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] * u[0]]
    }
}

#[test]
fn a_final_time_that_is_a_maximum() {
    // From 0 to 1 with the least 1 / T + T - c (T - 1)^2: stationary at T = 1, with the second derivative 2 - 2 c.
    for (c, minimum) in [(2.0, false), (0.5, true)] {
        let phase = Phase::new("arc", Rate)
            .states([State::new("x", "-").starts_at(0.0).ends_at(1.0).scaled_by(1.0)])
            .controls([Variable::new("u", "-").scaled_by(1.0)])
            .integral(Variable::new("cost", "-"), Square)
            .final_time(Bounds::new(0.1, 5.0));
        let ocp = Ocp::builder("time")
            .phase(phase)
            .objective(
                Sense::Minimize,
                "cost",
                "-",
                [Term::Integral("arc", "cost", 1.0), Term::function([At::FinalTime("arc")], Late(c))],
            )
            .build()
            .expect("well-posed");
        let certificate = certify(&ocp, &solution((0.0, 1.0), 2.0, |t| t, |_| 1.0, |_| -2.0));
        if minimum {
            assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
        } else {
            assert_failed(&certificate, &["negative curvature"]);
            assert!(find(&certificate, "negative curvature").at.contains("no conjugate point"));
        }
    }
}
