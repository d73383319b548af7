//! Arcs and contacts of constraints on states alone, at default settings, against closed forms and published optima.
#![allow(clippy::unwrap_used)]

use std::io::ErrorKind::NotFound;

use apsides::radau::{Radau, RadauSolution};
use apsides::verify::{Verdict, VerifySettings, verify};
use apsides_problem_file::ProblemFile;

/// Published: half a unit of the last digit that Jacobson and Lele print, a fifth of it for that of CasADi.
const PUBLISHED: f64 = 5e-5;

/// Discretisation: the ends of an arc, whose times the objective determines to second order.
const ARC_ENDS: f64 = 1e-6;

/// Solver: objectives relative to closed forms.
const OBJECTIVE: f64 = 1e-9;

/// A problem of one phase: times, states, controls, equations and constraints, integral and objective as a file has them.
fn solve(body: &str) -> (RadauSolution, Verdict) {
    let text = format!("kind = \"problem\"\n{body}");
    let file = ProblemFile::parse(&text, "own.toml", &|_| Err(NotFound.into()), &[]).unwrap();
    let posed = file.statement().pose(&[]).unwrap();
    let solution = Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
    assert!(solution.status.is_success() && solution.accurate);
    let verdict = verify(&posed.ocp, &solution.trajectory, &VerifySettings::default()).unwrap();
    (solution, verdict.certificate.verdict)
}

fn near(s: &RadauSolution, optimum: f64) {
    let found = s.trajectory.objective;
    assert!((found / optimum - 1.0).abs() < OBJECTIVE, "{found}, expected {optimum}");
}

/// The same constraint as a bound of the state and as a path constraint.
fn both(body: &str, state: [&str; 2], row: &str) -> [(RadauSolution, Verdict); 2] {
    let path = format!("[phase.p.path]\nlimit = \"{row}\"\n[phase.p.dynamics]");
    [solve(&body.replace(state[0], state[1])), solve(&body.replace("[phase.p.dynamics]", &path))]
}

/// Order one: outside of the arc `x = cosh(t1 - t)/2` with `cosh t1 = 2`, so that each side costs `sqrt(3)/2`.
#[test]
fn first_order() {
    let body = r#"
        [phase.p]
        time = { end = 3 }
        [phase.p.states]
        x = { start = 1, end = 1 }
        [phase.p.controls]
        u = {}
        [phase.p.dynamics]
        x = "u"
        [phase.p.integrals]
        cost = "x^2 + u^2"
        [objective]
        minimize = "cost"
    "#;
    let entry = 2f64.acosh();
    for (s, verdict) in both(body, ["end = 1 }", "end = 1, min = 0.5 }"], "x >= 0.5") {
        near(&s, 3f64.sqrt() + 0.25 * (3.0 - 2.0 * entry));
        assert_eq!(verdict, Verdict::GlobalOptimum);
        assert!(s.meshes.len() <= 4, "{} meshes", s.meshes.len());
        let [a, b] = &s.switches[..] else { panic!("{:?}", s.switches) };
        assert!(
            (a.time - entry).abs() < ARC_ENDS && (b.time - (3.0 - entry)).abs() < ARC_ENDS,
            "{:?}",
            s.switches
        );
    }
}

/// Order two: effort `4/(9 l)` below a ceiling `l <= 1/6`, along it from `3 l` to `1 - 3 l` (Bryson, Denham, Dreyfus, AIAA Journal 1 (1963)
/// 2544, doi 10.2514/3.2107); for `l` from 1/6 to 1/4 it is touched once, at `2 + 6 (1 - 4 l)^2`.
#[test]
fn second_order_and_a_touch() {
    let body = r#"
        [phase.p]
        time = { end = 1 }
        [phase.p.states]
        x = { start = 0, end = 0 }
        v = { start = 1, end = -1 }
        [phase.p.controls]
        u = {}
        [phase.p.dynamics]
        x = "v"
        v = "u"
        [phase.p.integrals]
        effort = "u^2/2"
        [objective]
        minimize = "effort"
    "#;
    let state = "x = { start = 0, end = 0 }";
    for (s, verdict) in both(body, [state, "x = { start = 0, end = 0, max = 0.08 }"], "x <= 0.08") {
        near(&s, 4.0 / 9.0 / 0.08);
        assert_eq!(verdict, Verdict::GlobalOptimum);
        let times: Vec<f64> = s.switches.iter().map(|s| s.time).collect();
        assert!((times[0] - 0.24).abs() < ARC_ENDS && (times[1] - 0.76).abs() < ARC_ENDS, "{times:?}");
    }
    for (s, verdict) in both(body, [state, "x = { start = 0, end = 0, max = 0.2 }"], "x <= 0.2") {
        near(&s, 2.24);
        assert_eq!(verdict, Verdict::GlobalOptimum);
    }
}

/// A limit on the speed: least time with the full acceleration up to it, 10/2 + 2/1; least effort with an acceleration that falls to
/// zero at it after 2, `2 * (3/2)^2 * 2/6`.
#[test]
fn limit_on_speed() {
    let body = r#"
        [phase.p]
        time = { end = "free" }
        [phase.p.states]
        x = { start = 0, end = 10 }
        v = { start = 0, end = 0 }
        [phase.p.controls]
        u = [-1, 1]
        [phase.p.dynamics]
        x = "v"
        v = "u"
        [objective]
        minimize = "end.time"
    "#;
    for (s, verdict) in both(body, ["end = 0 }", "end = 0, max = 2 }"], "v <= 2") {
        near(&s, 7.0);
        assert_eq!(verdict, Verdict::StrictLocalOptimum);
        assert!(s.meshes.len() <= 3, "{} meshes", s.meshes.len());
    }
    let body = body.replace("end = \"free\"", "end = 8").replace("u = [-1, 1]", "u = {}");
    let effort = "[phase.p.integrals]\neffort = \"u^2/2\"\n[objective]\nminimize = \"effort\"";
    let body = body.replace("[objective]\n        minimize = \"end.time\"", effort);
    for (s, verdict) in both(&body, ["end = 0 }", "end = 0, max = 1.5 }"], "v <= 1.5") {
        near(&s, 1.5);
        assert_eq!(verdict, Verdict::GlobalOptimum);
    }
}

/// A limit that moves with time (D. H. Jacobson, M. M. Lele, IEEE Trans. Automatic Control 14 (1969) 457, doi 10.1109/TAC.1969.1099283), whose
/// optimum is published as 0.1698.
#[test]
fn a_moving_limit() {
    let body = r#"
        [phase.p]
        time = { end = 1 }
        [phase.p.states]
        x = { start = 0 }
        v = { start = -1 }
        [phase.p.controls]
        u = {}
        [phase.p.dynamics]
        x = "v"
        v = "-v + u"
        [phase.p.path]
        limit = "v + 0.5 - 8*(time - 0.5)^2 <= 0"
        [phase.p.integrals]
        cost = "x^2 + v^2 + 0.005*u^2"
        [objective]
        minimize = "cost"
    "#;
    let (s, verdict) = solve(body);
    assert!((s.trajectory.objective - 0.1698).abs() < PUBLISHED, "{}", s.trajectory.objective);
    assert_eq!(verdict, Verdict::GlobalOptimum);
}

/// The oscillator of Van der Pol from CasADi's tutorial and at another start: bounds of a state and of the control. The optimum is that of
/// CasADi with Ipopt on a fine mesh, 3.61518.
#[test]
fn bounds_of_state_and_control() {
    let body = |start: [f64; 2], end: f64, least: f64| {
        format!(
            r#"
        [phase.p]
        time = {{ end = {end} }}
        [phase.p.states]
        x1 = {{ start = {}, min = {least} }}
        x2 = {{ start = {} }}
        [phase.p.controls]
        u = [-1, 1]
        [phase.p.dynamics]
        x1 = "(1 - x2^2)*x1 - x2 + u"
        x2 = "x1"
        [phase.p.integrals]
        cost = "x1^2 + x2^2 + u^2"
        [objective]
        minimize = "cost"
    "#,
            start[0], start[1]
        )
    };
    let (s, verdict) = solve(&body([0.0, 1.0], 10.0, -0.25));
    assert!((s.trajectory.objective - 3.61518).abs() < 0.2 * PUBLISHED, "{}", s.trajectory.objective);
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
    let (_, verdict) = solve(&body([1.0, 0.0], 5.0, -0.4));
    assert_eq!(verdict, Verdict::StrictLocalOptimum);
}
