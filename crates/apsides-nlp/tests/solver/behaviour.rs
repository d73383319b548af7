//! Well-posed problems of every kind, and how a solve is limited and reported.

use std::time::Duration;

use apsides_nlp::{Evaluation, Flow, InteriorPoint, IterationRecord, Nlp, NlpSettings, Status};

use crate::support::{Dense, INF, Jet, assert_near, hs71, solve, solve_with, strategies};

/// Solver: `NlpSettings::tolerance`.
const SOLVER: f64 = 1e-8;

/// Solver: the same divided by the curvature, or by the distance of an active limit; multipliers as well.
const SOLVER_AT_BOUNDS: f64 = 1e-7;

/// Discretisation: a difference quotient of solves, by its step of 1e-3.
const DIFFERENCES: f64 = 1e-4;

#[test]
fn rosenbrock() {
    let problem =
        Dense::unconstrained([-1.2, 1.0], |x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2));
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[1.0, 1.0], SOLVER);
    assert!(report.counters.iterations <= 25);
}

/// Maratos: from any point of the circle the full step raises both objective and violation; with second-order
/// corrections full steps are taken nevertheless.
#[test]
fn maratos_effect() {
    let problem = Dense {
        start: [0.8_f64.cos(), 0.8_f64.sin()],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [1.0],
        constraint_upper: [1.0],
        objective: |x| 2.0 * (x[0] * x[0] + x[1] * x[1] - 1.0) - x[0],
        constraints: |x| [x[0] * x[0] + x[1] * x[1]],
    };
    let mut shortened = 0;
    let mut corrected = 0;
    let mut observer = |record: &IterationRecord| {
        shortened += usize::from(record.iteration > 1 && record.primal_step < 1.0);
        corrected += usize::from(record.step_kind.is_ascii_uppercase());
        Flow::Continue
    };
    let report = InteriorPoint::default().solve_observed(&mut problem.clone(), &mut observer).unwrap();
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[1.0, 0.0], SOLVER_AT_BOUNDS);
    assert!((report.constraint_multipliers[0] + 1.5).abs() < SOLVER_AT_BOUNDS);
    assert!(corrected > 0 && shortened == 0, "{corrected} corrected, {shortened} shortened");
    assert!(report.counters.iterations <= 8);
}

#[test]
fn square_system() {
    // Circle and parabola.
    let problem = Dense {
        start: [3.0, 3.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [5.0, 0.0],
        constraint_upper: [5.0, 0.0],
        objective: |_| Jet::constant(0.0),
        constraints: |x| [x[0] * x[0] + x[1] * x[1], x[0] * x[0] - 4.0 * x[1]],
    };
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[2.0, 1.0], SOLVER);
    assert!(report.counters.iterations <= 10);
}

#[test]
fn linear_program() {
    // min -3a - 5b; a <= 4, 2b <= 12, 3a + 2b <= 18 (Hillier and Lieberman): (2, 6), -36, prices 0, 1.5, 1.
    let problem = Dense {
        start: [0.0; 2],
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [-INF; 3],
        constraint_upper: [4.0, 12.0, 18.0],
        objective: |x| -3.0 * x[0] - 5.0 * x[1],
        constraints: |x| [x[0], 2.0 * x[1], 3.0 * x[0] + 2.0 * x[1]],
    };
    for settings in strategies() {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[2.0, 6.0], SOLVER_AT_BOUNDS);
        assert_near(&report.constraint_multipliers, &[0.0, 1.5, 1.0], SOLVER_AT_BOUNDS);
        assert_near(&report.lower_multipliers, &[0.0, 0.0], SOLVER_AT_BOUNDS);
    }
}

#[test]
fn convex_quadratic_program() {
    // min (x - 1)^2 + (y - 2.5)^2 over a polygon (Nocedal and Wright, example 16.4): (1.4, 1.7).
    let problem = Dense {
        start: [2.0, 0.0],
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [-2.0, -6.0, -2.0],
        constraint_upper: [INF; 3],
        objective: |x| (x[0] - 1.0).powi(2) + (x[1] - 2.5).powi(2),
        constraints: |x| [x[0] - 2.0 * x[1], -1.0 * x[0] - 2.0 * x[1], -1.0 * x[0] + 2.0 * x[1]],
    };
    for settings in strategies() {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[1.4, 1.7], SOLVER_AT_BOUNDS);
        assert_near(&report.constraint_multipliers, &[-0.8, 0.0, 0.0], SOLVER_AT_BOUNDS);
        assert!(report.counters.iterations <= 10);
    }
}

#[test]
fn fixed_variables_get_multipliers() {
    let mut problem = hs71();
    problem.lower[0] = 2.0;
    problem.upper[0] = 2.0;
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_eq!(report.x[0], 2.0);
    // The multiplier of a fixed variable is the slope of the optimal value.
    let at = |value: f64| {
        let mut problem = hs71();
        problem.lower[0] = value;
        problem.upper[0] = value;
        solve(&problem).objective
    };
    let slope = (at(2.001) - at(1.999)) / 0.002;
    let multiplier = report.lower_multipliers[0] - report.upper_multipliers[0];
    assert!((slope - multiplier).abs() < DIFFERENCES, "{slope} and {multiplier}");
}

#[test]
fn everything_fixed() {
    let mut problem = hs71();
    problem.lower = [1.0, 5.0, 5.0, 1.0];
    problem.upper = problem.lower;
    let report = solve(&problem);
    assert_eq!(report.status, Status::Infeasible);
    assert_eq!(report.worst_constraint.unwrap().constraint, 1);
    assert_eq!(report.worst_constraint.unwrap().amount, 12.0);
    problem.constraint_upper[1] = 60.0;
    let report = solve(&problem);
    assert_eq!((report.status, report.objective), (Status::Optimal, 16.0));
}

#[test]
fn bounds_alone() {
    let problem = Dense {
        start: [0.0; 4],
        lower: [1.0, -INF, -2.0, -INF],
        upper: [INF, -1.0, 3.0, INF],
        constraint_lower: [],
        constraint_upper: [],
        objective: |x| x[0] * x[0] + x[1] * x[1] + (x[2] - 5.0).powi(2) + (x[3] - 7.0).powi(2),
        constraints: |_| [],
    };
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[1.0, -1.0, 3.0, 7.0], SOLVER);
    assert_near(&report.lower_multipliers, &[2.0, 0.0, 0.0, 0.0], SOLVER_AT_BOUNDS);
    assert_near(&report.upper_multipliers, &[0.0, 2.0, 4.0, 0.0], SOLVER_AT_BOUNDS);
}

#[test]
fn free_constraints_are_ignored() {
    let mut problem = hs71();
    problem.constraint_lower[0] = -INF;
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_eq!(report.constraint_multipliers[0], 0.0);
    assert!((report.constraint_values[1] - 40.0).abs() < SOLVER_AT_BOUNDS);
}

#[test]
fn limits_and_interruption_return_the_best_point() {
    let limited = NlpSettings { max_iterations: 4, ..NlpSettings::default() };
    let report = solve_with(&hs71(), &limited);
    assert_eq!((report.status, report.counters.iterations), (Status::IterationLimit, 4));
    assert!(report.errors.scaled.max() < 0.1 && (report.objective - 17.0).abs() < 1.0);
    let timed = NlpSettings { time_limit: Some(Duration::ZERO), ..NlpSettings::default() };
    assert_eq!(solve_with(&hs71(), &timed).status, Status::TimeLimit);
    let mut stop = |record: &IterationRecord| if record.iteration >= 3 { Flow::Stop } else { Flow::Continue };
    let report = InteriorPoint::default().solve_observed(&mut hs71(), &mut stop).unwrap();
    assert_eq!((report.status, report.counters.iterations), (Status::Interrupted, 3));
}

#[test]
fn trait_objects_are_solved() {
    let mut problem: Box<dyn Nlp> = Box::new(hs71());
    let report = InteriorPoint::default().solve(problem.as_mut()).unwrap();
    assert_eq!(report.status, Status::Optimal);
}

#[test]
fn status_says_what_happened() {
    assert_eq!(Status::Infeasible.to_string(), "converged to a point of local infeasibility");
    let text = Status::EvaluationFailed(Evaluation::Jacobian).to_string();
    assert!(text.contains("Jacobian is not finite"), "{text}");
}
