//! Problems as a user first writes them, at default settings, against closed forms.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::io::ErrorKind::NotFound;

use apsides::verify::{Verdict, VerifySettings, verify};
use apsides_problem_file::ProblemFile;

/// Published: digits of the reference.
const PUBLISHED: f64 = 1e-6;

/// Discretisation: the error between the points of the mesh at default settings, in the objective to second order.
const MESH: f64 = 1e-9;

/// Objective, verdict and the times of the breaks of the only phase, as parts of it.
fn solve(text: &str) -> (f64, Verdict, Vec<f64>) {
    let file = ProblemFile::parse(text, "own.toml", &|_| Err(NotFound.into()), &[]).unwrap();
    let posed = file.statement().pose(&[]).unwrap();
    let solution = apsides::radau::Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
    assert!(solution.status.is_success() && solution.accurate);
    let verdict = verify(&posed.ocp, &solution.trajectory, &VerifySettings::default()).unwrap();
    let mesh = &solution.trajectory.phases[0].mesh;
    let breaks = mesh.breaks().iter().map(|b| mesh.fractions()[b.end]).collect();
    (solution.trajectory.objective, verdict.certificate.verdict, breaks)
}

/// A quarter turn about the first axis, from rest to rest, for time and effort. The torque is 1 for a part of the flight, falls
/// through zero and is -1 at its end. With half of the time `h` and half of the time of the fall `b` the angle is `h^2 - b^2/3` and
/// the objective `2.2 h - 0.4 b/3`; it is least at `b = h/5.5`.
#[test]
fn slew_whose_torque_leaves_its_bounds_continuously() {
    let text = r#"
        kind = "problem"
        [phase.turn]
        time = { end = [0.5, 20] }
        [phase.turn.states]
        q1 = { start = 0, end = "sin(pi/4)" }
        q2 = { start = 0, end = 0 }
        q3 = { start = 0, end = 0 }
        q4 = { start = 1 }
        w1 = { start = 0, end = 0 }
        w2 = { start = 0, end = 0 }
        w3 = { start = 0, end = 0 }
        [phase.turn.controls]
        m1 = [-1, 1]
        m2 = [-1, 1]
        m3 = [-1, 1]
        [phase.turn.dynamics]
        q1 = "0.5*(q4*w1 - q3*w2 + q2*w3)"
        q2 = "0.5*(q3*w1 + q4*w2 - q1*w3)"
        q3 = "0.5*(-q2*w1 + q1*w2 + q4*w3)"
        q4 = "-0.5*(q1*w1 + q2*w2 + q3*w3)"
        w1 = "m1 - w2*w3"
        w2 = "(m2 + 2*w3*w1)/2"
        w3 = "(m3 - w1*w2)/3"
        [phase.turn.integrals]
        effort = "m1^2 + m2^2 + m3^2"
        [objective]
        minimize = "end.time + 0.1*effort"
    "#;
    let (objective, verdict, breaks) = solve(text);
    let half = (PI / 2.0 / (1.0 - 1.0 / (3.0 * 5.5 * 5.5))).sqrt();
    let optimum = half * (2.2 - 0.4 / 3.0 / 5.5);
    assert!((objective / optimum - 1.0).abs() < 0.1 * MESH, "{objective} {optimum}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
    let leaves = 0.5 * (1.0 - 1.0 / 5.5);
    assert_eq!(breaks.len(), 2);
    assert!(
        (breaks[0] - leaves).abs() < 10.0 * MESH && (breaks[1] - (1.0 - leaves)).abs() < 10.0 * MESH,
        "{breaks:?}"
    );
}

/// The largest area under a curve of length 1.2 between two points 1 apart: an arc of a circle with `a/sin(a) = 1.2`. The straight line
/// that a solve starts from has no length that changes to first order.
#[test]
fn largest_area_under_a_curve_of_given_length() {
    let text = r#"
        kind = "problem"
        [phase.curve]
        time = { end = 1 }
        states.y = { start = 0, end = 0 }
        controls.slope = {}
        dynamics.y = "slope"
        [phase.curve.integrals]
        area = "y"
        length = { value = "sqrt(1 + slope^2)", equals = 1.2 }
        [objective]
        maximize = "area"
    "#;
    // By Newton's method on a - 1.2 sin a.
    let half_angle = (0..20).fold(1.0_f64, |a, _| a - (a - 1.2 * a.sin()) / (1.0 - 1.2 * a.cos()));
    let radius = 0.5 / half_angle.sin();
    let area = radius * radius * (half_angle - half_angle.sin() * half_angle.cos());
    let (objective, verdict, _) = solve(text);
    // The quadrature of the length is no part of the error of the mesh: 5e-8 is left.
    assert!((objective / area - 1.0).abs() < 1e3 * MESH, "{objective} {area}");
    assert_ne!(verdict, Verdict::Rejected);
}

/// Light across the border of two media: a steering angle within a turn, which is caught at a bound at some nodes of a first mesh. The place of
/// the passage minimises the sum of both times.
#[test]
fn angles_between_bounds_a_turn_apart() {
    let text = r#"
        kind = "problem"
        [phase.a]
        time = { end = [0.01, 10] }
        states.x = { start = 0 }
        states.y = { start = 1, end = 0 }
        controls.h = [-3.2, 3.2]
        dynamics.x = "cos(h)"
        dynamics.y = "sin(h)"
        [phase.b]
        time = { end = [0.01, 10] }
        states.x = { end = 2 }
        states.y = { end = -1 }
        controls.h = [-3.2, 3.2]
        dynamics.x = "0.5*cos(h)"
        dynamics.y = "0.5*sin(h)"
        [links]
        a = "b"
        [objective]
        minimize = "b.end.time"
    "#;
    let (objective, verdict, _) = solve(text);
    // Snell: the sines of both angles are as the speeds; bisection for where.
    let excess = |s: f64| s / s.hypot(1.0) - 2.0 * (2.0 - s) / (2.0 - s).hypot(1.0);
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    let optimum = low.hypot(1.0) + 2.0 * (2.0 - low).hypot(1.0);
    assert!((objective / optimum - 1.0).abs() < 0.1 * MESH, "{objective} {optimum}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// Zermelo's boat in a current that grows with the distance from the shore, with angles that a first mesh mixes by whole turns: the heading falls
/// from 240 to 105 degrees backwards in time, which takes `tan 240 - tan 105` (A. E. Bryson, Y.-C. Ho, Applied Optimal Control, 1975,
/// section 2.7, problem 1).
#[test]
fn angles_that_differ_by_whole_turns() {
    let (start, end) = (105f64.to_radians(), 240f64.to_radians());
    let sec = |a: f64| 1.0 / a.cos();
    let y = sec(start) - sec(end);
    let logarithm = ((end.tan() + sec(end)) / (start.tan() + sec(start))).ln();
    let x = -0.5 * (sec(end) * (end.tan() - start.tan()) - start.tan() * (sec(end) - sec(start)) + logarithm);
    let text = format!(
        r#"
        kind = "problem"
        [phase.a]
        time = {{ end = [0.1, 20] }}
        states.x = {{ start = {x}, end = 0 }}
        states.y = {{ start = {y}, end = 0 }}
        controls.h = [-7, 7]
        dynamics.x = "cos(h) - y"
        dynamics.y = "sin(h)"
        [objective]
        minimize = "end.time"
    "#
    );
    let (objective, verdict, _) = solve(&text);
    let optimum = end.tan() - start.tan();
    assert!((objective / optimum - 1.0).abs() < MESH, "{objective} {optimum}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// An objective whose parts cancel: the integral of `1 - t` over twice the time in which it is positive. What is recomputed of it is held
/// against the size of its parts.
#[test]
fn an_objective_of_zero() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = 2 }
        states.x = { start = 1 }
        controls.u = [-1, 1]
        dynamics.x = "u"
        integrals.area = "x"
        [objective]
        minimize = "area"
    "#;
    let (objective, verdict, _) = solve(text);
    // A control along its bound is above it by what the barrier leaves.
    assert!(objective.abs() < 20.0 * MESH, "{objective}");
    assert_eq!(verdict, Verdict::GlobalOptimum);
}

/// The shortest flight to a speed of 45 at an altitude of 500 without climb, with the components of the direction of the thrust as controls:
/// the tangent of its angle falls from `a` to `-a` linearly in time (A. E. Bryson, Y.-C. Ho, Applied Optimal Control, 1975, section 2.7).
/// The bounds of the components say nothing beside the length of one, or are not there.
#[test]
fn direction_of_length_one() {
    let time = |a: f64| 4.5 * a / a.asinh();
    let altitude = |a: f64| 2.5 * time(a).powi(2) * (a * a.hypot(1.0) - a.asinh()) / (a * a);
    let (mut low, mut high) = (1.0, 100.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if altitude(middle) < 500.0 { low = middle } else { high = middle }
    }
    for (bounds, row) in [
        ("[-1, 1]", "c^2 + s^2 == 1"),
        ("[-1.1, 1.1]", "c^2 + s^2 == 1"),
        ("{}", "c^2 + s^2 == 1"),
        ("[-1, 1]", "c^2 + s^2 <= 1"),
    ] {
        let text = format!(
            r#"
            kind = "problem"
            [phase.a]
            time = {{ end = [0.1, 100] }}
            states.x = {{ start = 0 }}
            states.vx = {{ start = 0, end = 45 }}
            states.y = {{ start = 0, end = 500 }}
            states.vy = {{ start = 0, end = 0 }}
            controls.c = {bounds}
            controls.s = {bounds}
            dynamics = {{ x = "vx", vx = "10*c", y = "vy", vy = "10*s" }}
            path.unit = "{row}"
            [objective]
            minimize = "end.time"
        "#
        );
        let (objective, verdict, _) = solve(&text);
        // Along an inequality the barrier leaves a part.
        assert!(
            (objective / time(low) - 1.0).abs() < 20.0 * MESH,
            "{bounds} {row}: {objective} {}",
            time(low)
        );
        assert_eq!(verdict, Verdict::StrictLocalOptimum, "{bounds} {row}");
    }
}

/// A distance of 100 along an axis at an acceleration of 4 in a free direction takes `sqrt(50)`: some nodes begin with the opposite one.
#[test]
fn direction_in_space_along_an_axis() {
    let text = r#"
        kind = "problem"
        [phase.a]
        time = { end = [0.1, 100] }
        states.x = { start = 0, end = 100 }
        states.y = { start = 0, end = 0 }
        states.z = { start = 0, end = 0 }
        states.vx = { start = 0 }
        states.vy = { start = 0 }
        states.vz = { start = 0 }
        controls.ux = [-1, 1]
        controls.uy = [-1, 1]
        controls.uz = [-1, 1]
        dynamics = { x = "vx", y = "vy", z = "vz", vx = "4*ux", vy = "4*uy", vz = "4*uz" }
        path.unit = "ux^2 + uy^2 + uz^2 == 1"
        [objective]
        minimize = "end.time"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective / 50f64.sqrt() - 1.0).abs() < MESH, "{objective}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// A turn by 1.5 rad in 4 s from rest to rest with least effort, `12 * 1.5^2 / 4^3`, whose quaternion is asked to keep the length that its
/// equations of motion keep.
#[test]
fn length_of_a_quaternion_as_path_constraint() {
    let text = r#"
        kind = "problem"
        [phase.turn]
        time = { end = 4 }
        states.q1 = { start = 0, end = "sin(0.75)" }
        states.q2 = { start = 0, end = 0 }
        states.q3 = { start = 0, end = 0 }
        states.q4 = { start = 1, end = "cos(0.75)" }
        states.w1 = { start = 0, end = 0 }
        states.w2 = { start = 0, end = 0 }
        states.w3 = { start = 0, end = 0 }
        controls = { m1 = {}, m2 = {}, m3 = {} }
        dynamics.q1 = "0.5*(q4*w1 - q3*w2 + q2*w3)"
        dynamics.q2 = "0.5*(q3*w1 + q4*w2 - q1*w3)"
        dynamics.q3 = "0.5*(-q2*w1 + q1*w2 + q4*w3)"
        dynamics.q4 = "-0.5*(q1*w1 + q2*w2 + q3*w3)"
        dynamics.w1 = "m1"
        dynamics.w2 = "m2"
        dynamics.w3 = "m3"
        path.unit = "q1^2 + q2^2 + q3^2 + q4^2 == 1"
        integrals.effort = "m1^2 + m2^2 + m3^2"
        [objective]
        minimize = "effort"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective / 0.421875 - 1.0).abs() < MESH, "{objective}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// A quarter of a circle from given points along which the states are held by an equality without controls: `(pi/2)^2`.
#[test]
fn equality_of_states() {
    let text = r#"
        kind = "problem"
        [phase.arc]
        time = { end = 1 }
        states.x = { start = 1, end = 0 }
        states.y = { start = 0, end = 1 }
        controls = { u = {}, v = {} }
        dynamics = { x = "u", y = "v" }
        path.circle = "x^2 + y^2 == 1"
        integrals.effort = "u^2 + v^2"
        [objective]
        minimize = "effort"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective / (0.25 * PI * PI) - 1.0).abs() < 1e-3 * MESH, "{objective}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
    // A start beside the circle meets no such equality.
    let beside = text.replace("start = 1, end = 0", "start = 1.1, end = 0");
    let file = ProblemFile::parse(&beside, "own.toml", &|_| Err(NotFound.into()), &[]).unwrap();
    let posed = file.statement().pose(&[]).unwrap();
    let solution = apsides::radau::Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
    assert!(!solution.status.is_success(), "{:?}", solution.status);
}

/// A path constraint of states that binds at the very end of its phase, where there is no collocation point: `v = 2.5 t - 5/4 t^2 + ...` of least
/// effort with a given rise, `x(1) = 0.3` for `u = 0.9 (1 - t)`, and 0.27 of effort.
#[test]
fn path_constraint_that_binds_at_the_end() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = 1 }
        states.x = { start = 0 }
        states.v = { start = 0 }
        controls.u = [-5, 5]
        dynamics = { x = "v", v = "u" }
        path.lid = "x <= 0.3"
        integrals.e = "u^2"
        [objective]
        maximize = "end.x - 0.01*e"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective - (0.3 - 0.0027)).abs() < MESH, "{objective}");
    assert_eq!(verdict, Verdict::GlobalOptimum);
    // Of order one: the arc along it lasts to the end.
    let text = text.replace("x <= 0.3", "x + 0.1*v <= 0.3");
    let (_, verdict, _) = solve(&text);
    assert_eq!(verdict, Verdict::GlobalOptimum);
}

/// An arc along a bound of a state that lasts to the end: `u = -1` until `x^2 = 0.26`, then `u^2 = 10 (x^2 - 0.16)`, then `x = 0.4`.
#[test]
fn arc_to_the_end_of_the_phase() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = 3 }
        states.x = { start = 1, min = 0.4 }
        controls.u = [-1, 1]
        dynamics.x = "u"
        integrals.j = "x^2 + 0.1*u^2"
        [objective]
        minimize = "j"
    "#;
    let (objective, verdict, _) = solve(text);
    let kink = 0.26_f64.sqrt();
    let first = (1.0 - kink * kink * kink) / 3.0 + 0.1 * (1.0 - kink);
    // With x = 0.4 cosh(s), dx = -sqrt(10) 0.4 sinh(s) dt: the integral of 2 x^2 - 0.16.
    let s = (kink / 0.4).acosh();
    let second = 0.16 / 10.0_f64.sqrt() * 0.5 * (2.0 * s).sinh();
    let time = 1.0 - kink + s / 10.0_f64.sqrt();
    let optimum = first + second + 0.16 * (3.0 - time);
    assert!((objective / optimum - 1.0).abs() < MESH, "{objective} {optimum}");
    assert_eq!(verdict, Verdict::GlobalOptimum);
}

/// The same of order two: `x'' = u` from `x(0) = 1` with a free rate, along `x = 0.4` to the end. The problem is convex, so that the values of
/// many meshes without arcs agree: 0.990369 to six digits with 300 points.
#[test]
fn arc_of_order_two_to_the_end_of_the_phase() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = 4 }
        states.x = { start = 1 }
        states.v = { start = [-1, 1] }
        controls.u = [-3, 3]
        dynamics = { x = "v", v = "u" }
        path.floor = "x >= 0.4"
        integrals.j = "x^2 + 0.1*u^2"
        [objective]
        minimize = "j"
    "#;
    let (objective, verdict, breaks) = solve(text);
    assert!((objective - 0.990_369).abs() < PUBLISHED, "{objective}");
    assert_eq!((verdict, breaks.len()), (Verdict::GlobalOptimum, 1));
}

/// The largest area over a chord of 1 under a curve of at most a length, from a straight line: an arc of a circle of radius `r` with half of
/// its angle `a = length/(2r)`, `1 = 2r sin(a)`, whose area is `r^2 (a - sin(a) cos(a))`.
#[test]
fn length_that_bounds_an_area() {
    for length in [1.05, 1.3, 1.5] {
        let text = r#"
            kind = "problem"
            [phase.curve]
            time = { end = 1 }
            states.y = { start = 0, end = 0 }
            controls.slope = {}
            dynamics.y = "slope"
            integrals.area = "y"
            integrals.length = { value = "sqrt(1 + slope^2)", max = LENGTH }
            [objective]
            maximize = "area"
        "#;
        let (objective, verdict, _) = solve(&text.replace("LENGTH", &length.to_string()));
        let (mut low, mut high) = (1e-3, 0.5 * PI);
        for _ in 0..100 {
            let a = 0.5 * (low + high);
            // The chord falls with the angle.
            if length * a.sin() / a > 1.0 { low = a } else { high = a }
        }
        let radius = 0.5 * length / low;
        let area = radius * radius * (low - low.sin() * low.cos());
        assert!((objective / area - 1.0).abs() < 1e3 * MESH, "{length}: {objective} {area}");
        // The length is convex in the slope.
        assert_eq!(verdict, Verdict::GlobalOptimum, "{length}");
    }
}

/// The shortest way of a car with a least radius of one to a disc: a turn, then a tangent towards the centre, along which the control is
/// singular. The end of the turn is found, though the singular arc could go on with it at first.
#[test]
fn turn_that_ends_on_a_tangent() {
    let text = r#"
        kind = "problem"
        [phase.way]
        time = { end = [0.1, 10] }
        states.x = { start = 3 }
        states.y = { start = 1 }
        states.h = { start = 2 }
        controls.w = [-1, 1]
        dynamics = { x = "cos(h)", y = "sin(h)", h = "w" }
        [boundary]
        disc = "end.x^2 + end.y^2 <= 0.5"
        [objective]
        minimize = "end.time"
    "#;
    let (objective, verdict, breaks) = solve(text);
    // The centre of the turn is on the left; the tangent from it passes the centre of the disc at the distance of one.
    let (x, y) = (3.0 - 2f64.sin(), 1.0 + 2f64.cos());
    let distance = x.hypot(y);
    let tangent = (distance * distance - 1.0).sqrt();
    let heading = (-y).atan2(-x) + 2.0 * PI + (1.0 / distance).asin();
    let length = heading - 2.0 + tangent - 0.5_f64.sqrt();
    assert!((objective / length - 1.0).abs() < MESH, "{objective} {length}");
    assert_eq!(verdict, Verdict::Extremal);
    assert!((breaks[0] * objective - (heading - 2.0)).abs() < 1e3 * MESH, "{breaks:?}");
}

/// States held together by an equality of time, with free ends: one function `x(t)` is left, with `y = x + sin(3t)`.
#[test]
fn equality_of_states_with_free_ends() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = 1 }
        states.x = { start = [-2, 2], end = 0 }
        states.y = { start = [-2, 2], end = [-2, 2] }
        controls = { u = {}, v = {} }
        dynamics = { x = "u", y = "v" }
        path.line = "y == sin(3*time) + x"
        integrals.e = "u^2 + v^2 + (x - 1)^2"
        [objective]
        minimize = "e"
    "#;
    let (objective, verdict, _) = solve(text);
    let eliminated = r#"
        kind = "problem"
        [phase.p]
        time = { end = 1 }
        states.x = { start = [-2, 2], end = 0 }
        controls.u = {}
        dynamics.x = "u"
        integrals.e = "u^2 + (u + 3*cos(3*time))^2 + (x - 1)^2"
        [objective]
        minimize = "e"
    "#;
    let (expected, ..) = solve(eliminated);
    assert!((objective / expected - 1.0).abs() < MESH, "{objective} {expected}");
    // The line and the equations of motion are affine, the integrand is a sum of squares.
    assert_eq!(verdict, Verdict::GlobalOptimum);
}

/// The largest area under a curve of length 1.2 over a chord of 1, with the length as a state: the straight line, from which the length
/// grows by nothing to first order, is no start. The curve is an arc of radius `r`, `1 = 2 r sin(0.6/r)`.
#[test]
fn length_as_a_state() {
    let text = r#"
        kind = "problem"
        [phase.curve]
        time = { end = 1 }
        states.y = { start = 0, end = 0 }
        states.l = { start = 0, end = 1.2 }
        controls.slope = {}
        dynamics = { y = "slope", l = "sqrt(1 + slope^2)" }
        integrals.area = "y"
        [objective]
        maximize = "area"
    "#;
    let (objective, verdict, _) = solve(text);
    let (mut low, mut high) = (0.5, 2.0);
    for _ in 0..80 {
        let half = 0.5 * (low + high);
        if 2.0 * f64::sin(0.6 / half) * half < 1.0 { low = half } else { high = half }
    }
    let area = 0.5 * low * low * (1.2 / low - (1.2 / low).sin());
    assert!((objective / area - 1.0).abs() < 10.0 * MESH, "{objective} {area}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// The stiffness of a spring from its motion: a sum of squares of zero, which is held against what the tolerance of the states makes of it.
#[test]
fn a_sum_of_squares_of_zero() {
    let text = r#"
        kind = "problem"
        [parameters]
        k = { min = 0.1, max = 10, guess = 1 }
        [phase.a]
        time = { end = 2 }
        states.x = { start = 1 }
        states.v = { start = 0 }
        dynamics = { x = "v", v = "-k*x" }
        integrals.misfit = "(x - cos(1.7*time))^2"
        [objective]
        minimize = "misfit"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!(objective.abs() < 1e-5 * MESH, "{objective}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// Full speed one way and back gains as much as any number of turns: another control has the same Hamiltonian all along, and the optimum is
/// not strict.
#[test]
fn controls_as_good_as_those_found() {
    let text = r#"
        kind = "problem"
        [phase.a]
        time = { end = 1 }
        states.x = { start = 0, end = 0 }
        controls.u = [-1, 1]
        dynamics.x = "u"
        integrals.gain = "u^2"
        [objective]
        maximize = "gain"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective - 1.0).abs() < 100.0 * MESH, "{objective}");
    assert_eq!(verdict, Verdict::Extremal);
}

/// Ascent over a flat Moon in the least time, by direction cosines: the tangent of the thrust angle is linear in time. Its two constants
/// and the time from the three conditions at the end, by Newton's method over a quadrature of the rates: 288.398286038 s.
#[test]
fn direction_cosines_in_the_least_time() {
    for bounds in ["[-1, 1]", "[-2, 2]", "[-inf, inf]"] {
        let text = format!(
            r#"
            kind = "problem"
            [phase.ascent]
            time = {{ end = [100, 800] }}
            states = {{ x = {{ start = 0 }}, y = {{ start = 0, end = 18500 }}, u = {{ start = 0, end = 1650 }}, v = {{ start = 0, end = 0 }} }}
            controls = {{ cx = {bounds}, cy = {bounds} }}
            dynamics = {{ x = "u", y = "v", u = "6*cx", v = "6*cy - 1.62" }}
            path.unit = "cx^2 + cy^2 == 1"
            [objective]
            minimize = "end.time"
            "#
        );
        let (objective, verdict, _) = solve(&text);
        assert!((objective / 288.398_286_038_379_75 - 1.0).abs() < MESH, "{bounds}: {objective}");
        assert_eq!(verdict, Verdict::StrictLocalOptimum, "{bounds}");
    }
}

/// A swing to rest in the least time: full force to alternate sides, pi between the switches. The first and the last part from the
/// conditions at the end: 0.51936, twice pi, 0.84107. The straight line to the end leads to times too short for any force.
#[test]
fn a_swing_to_rest() {
    let text = r#"
        kind = "problem"
        [phase.swing]
        time = { end = [0.1, 40] }
        states = { x = { start = 4, end = 0 }, v = { start = 2, end = 0 } }
        controls.u = [-1, 1]
        dynamics = { x = "v", v = "-x + u" }
        [objective]
        minimize = "end.time"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective / 7.643_615_260_941_419 - 1.0).abs() < MESH, "{objective}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// Least effort between opposite speeds under a ceiling (Bryson, Denham and Dreyfus, AIAA Journal 1 (1963) 2544): 4/(9 l) below 1/6.
/// How wide the control's own bounds are says nothing about the optimum.
#[test]
fn a_ceiling_under_any_bounds_of_the_control() {
    for (ceiling, most) in [(0.05, 40.0), (0.08, 40.0), (0.09, 100.0), (0.12, 100.0), (0.1, 1000.0)] {
        let text = format!(
            r#"
            kind = "problem"
            [phase.p]
            time = {{ end = 1 }}
            states = {{ x = {{ start = 0, end = 0, max = {ceiling} }}, v = {{ start = 1, end = -1 }} }}
            controls.a = [-{most}, {most}]
            dynamics = {{ x = "v", v = "a" }}
            integrals.e = "0.5*a^2"
            [objective]
            minimize = "e"
            "#
        );
        let (objective, verdict, _) = solve(&text);
        assert!((objective * 9.0 * ceiling / 4.0 - 1.0).abs() < MESH, "{ceiling} {most}: {objective}");
        assert_eq!(verdict, Verdict::GlobalOptimum, "{ceiling} {most}");
    }
}

/// A bound of a state whose multiplier is small beside the costate at the fixed start of that state. The optimum is that of multiple
/// shooting, and of collocation with bounds on the nodes alone, to their digits: 3.694055.
#[test]
fn a_bound_of_a_state_with_a_large_costate_at_its_start() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = 5 }
        states = { x = { start = 0, end = [-5, 5] }, y = { start = 1, end = [-5, 5], min = -0.3 } }
        controls.u = [-1, 1]
        dynamics = { x = "y", y = "-x + (1 - x^2)*y + u" }
        integrals.j = "x^2 + y^2 + u^2"
        [objective]
        minimize = "j"
    "#;
    let (objective, verdict, _) = solve(text);
    assert!((objective / 3.694_055_28 - 1.0).abs() < 1e-2 * PUBLISHED, "{objective}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}

/// Goddard's rocket (COPS 3.0, problem 10: 1.01283) with the mass of the empty vehicle as a bound all along the flight.
#[test]
fn a_mass_that_must_not_fall_below_that_of_the_empty_vehicle() {
    let text = r#"
        kind = "problem"
        [phase.flight]
        time = { end = [0.05, 1] }
        states.h = { start = 1, min = 1, max = 2 }
        states.v = { start = 0, min = 0, max = 1 }
        states.m = { start = 1, end = "free", min = 0.6, max = 1 }
        controls.T = [0, 3.5]
        dynamics.h = "v"
        dynamics.v = "(T - 310*v^2*exp(-500*(h - 1)))/m - 1/h^2"
        dynamics.m = "-2*T"
        [objective]
        maximize = "end.h"
    "#;
    let (objective, verdict, breaks) = solve(text);
    assert!((objective - 1.012_837).abs() < PUBLISHED, "{objective}");
    assert_eq!(verdict, Verdict::Extremal);
    assert_eq!(breaks.len(), 2, "{breaks:?}");
}

/// Landing on Mars with least propellant between two thrusts, above the ground: the multipliers of the ground, which the flight meets at
/// its end alone, are zero, not what the barrier leaves of them.
#[test]
fn a_landing_above_the_ground() {
    let text = r#"
        kind = "problem"
        [phase.p]
        time = { end = [10, 120] }
        states.x = { start = 400, end = 0 }
        states.z = { start = 1000, end = 0 }
        states.u = { start = 10, end = 0 }
        states.w = { start = -60, end = 0 }
        states.m = { start = 2000, end = "free", min = 1200 }
        controls = { tx = [-20000, 20000], tz = [-20000, 20000], s = [6000, 18000] }
        dynamics.x = "u"
        dynamics.z = "w"
        dynamics.u = "tx/m"
        dynamics.w = "tz/m - 3.71"
        dynamics.m = "-s/2200"
        path.thrust = "tx^2 + tz^2 <= s^2"
        path.ground = "z >= 0"
        [objective]
        maximize = "end.m"
    "#;
    let (mass, verdict, _) = solve(text);
    // Without the ground the flight is the same.
    let (free, ..) = solve(&text.replace("path.ground = \"z >= 0\"", ""));
    assert!((mass / free - 1.0).abs() < MESH, "{mass} {free}");
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}
