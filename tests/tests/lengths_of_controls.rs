//! Vectors of controls whose length is what they cost: what a solution by length and direction says of the problem as it was posed.
#![allow(clippy::unwrap_used)]

use apsides::radau::Radau;
use apsides::verify::{Verdict, VerifySettings, verify};

/// Multipliers and costates are those of a nonlinear program at its tolerance.
const SOLVER: f64 = 1e-6;

/// With `H = |u| + l . u + m (u . u - 1)` a thrust of one has `m = (|l| - 1) / 2`, and none has `m = 0`, `|l| <= 1`.
#[test]
fn the_multiplier_of_a_limit_of_the_square_follows_the_primer() {
    let path = format!("{}/problems/least_fuel_in_space_by_length.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let posed = apsides::parse(&text, "least fuel", &[]).unwrap().pose().unwrap();
    let solution = Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
    assert!(
        solution.status.is_success()
            && (solution.trajectory.objective - 2.0 * (2.0 - 3_f64.sqrt())).abs() < SOLVER
    );
    let phase = &solution.trajectory.phases[0];
    let (costate, multipliers) = (phase.costate.as_ref().unwrap(), phase.path_multipliers.as_ref().unwrap());
    let (mut coasts, mut burns) = (0, 0);
    let (mut u, mut l, mut m) = ([0.0; 3], [0.0; 6], [0.0; 1]);
    for segment in 0..multipliers.segments().len() {
        for time in multipliers.node_times(segment) {
            phase.control.evaluate_in(segment, time, &mut u);
            costate.evaluate_in(segment, time, &mut l);
            multipliers.evaluate_in(segment, time, &mut m);
            let primer = l[3..].iter().map(|v| v * v).sum::<f64>().sqrt();
            let thrust = u.iter().map(|v| v * v).sum::<f64>().sqrt();
            let expected = if thrust > 0.5 { 0.5 * (primer - 1.0) } else { 0.0 };
            assert!(
                (m[0] - expected).abs() < SOLVER,
                "{} instead of {expected} at {time}, thrust {thrust}",
                m[0]
            );
            assert!(thrust > 0.5 || primer < 1.0 + SOLVER, "primer {primer} at {time}");
            (coasts, burns) = if thrust > 0.5 { (coasts, burns + 1) } else { (coasts + 1, burns) };
        }
    }
    assert!(coasts > 0 && burns > 0, "{coasts} {burns}");
}

/// A coast with a radius above zero, since a state is part of it: the cone is not active there and holds nothing.
#[test]
fn a_cone_holds_nothing_on_a_coast_away_from_its_tip() {
    let text = r#"
        kind = "problem"
        [phase.a]
        time = { end = 6 }
        states.x = { start = 0, end = 4 }
        states.y = { start = 0, end = 3 }
        states.v = { start = 0, end = 0 }
        states.w = { start = 0.1, end = 0 }
        states.p = { start = 1, min = 0 }
        controls = { a = [-1, 1], b = [-1, 1], g = [0, 1] }
        dynamics = { x = "v", y = "w", v = "1.2*a", w = "1.2*b", p = "-0.1*p" }
        integrals.fuel = "g + sqrt(a^2 + b^2)"
        path.cone = "a^2 + b^2 <= (p + g)^2"
        [objective]
        minimize = "fuel"
    "#;
    let solved = apsides::parse(text, "coast", &[]).unwrap().solve(None, &mut ()).unwrap();
    let found = verify(&solved.ocp, &solved.trajectory, &VerifySettings::default()).unwrap();
    assert_eq!(found.certificate.verdict, Verdict::GlobalOptimum, "{:?}", found.certificate);
}
