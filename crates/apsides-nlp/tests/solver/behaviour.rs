//! Hard, degenerate, infeasible and unbounded problems.

use apsides_nlp::{
    BarrierStrategy, Evaluation, Flow, InteriorPoint, IterationRecord, Nlp, NlpSettings, Status,
};
use std::time::Duration;

use crate::support::{Dense, INF, Jet, hs71, solve, solve_with};

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(near, "{found:?} instead of {expected:?}");
}

fn adaptive() -> NlpSettings {
    NlpSettings { barrier: BarrierStrategy::Adaptive, ..NlpSettings::default() }
}

/// Waechter and Biegler 2000, doi 10.1007/PL00011386: methods that only take Newton steps for the constraints fail
/// here, and a stationary point of the 1-norm of the violation lies at (-1, 0, 0).
#[test]
fn waechter_biegler_counterexample() {
    for start in [[-2.0, 1.0, 1.0], [-2.0, 3.0, 1.0], [-1.5, 1.0, 1.0], [-10.0, 1.0, 1.0], [0.0, 0.0, 0.0]] {
        let problem = Dense {
            start,
            lower: [-INF, 0.0, 0.0],
            upper: [INF; 3],
            constraint_lower: [1.0, 0.5],
            constraint_upper: [1.0, 0.5],
            objective: |x| x[0],
            constraints: |x| [x[0] * x[0] - x[1], x[0] - x[2]],
        };
        for settings in [NlpSettings::default(), adaptive()] {
            let report = solve_with(&problem, &settings);
            assert_eq!(report.status, Status::Optimal, "from {start:?}");
            assert_near(&report.x, &[1.0, 0.0, 0.5], 1e-7);
        }
    }
}

#[test]
fn rosenbrock() {
    let problem =
        Dense::unconstrained([-1.2, 1.0], |x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2));
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[1.0, 1.0], 1e-8);
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
    assert_near(&report.x, &[1.0, 0.0], 1e-7);
    assert!((report.constraint_multipliers[0] + 1.5).abs() < 1e-7);
    assert!(corrected > 0 && shortened == 0, "{corrected} corrected, {shortened} shortened");
    assert!(report.counters.iterations <= 8);
}

/// A complementarity constraint: `min (x - 1)^2 + (y - 1)^2`, `x y <= 0`, `x, y >= 0`: no strict interior, unbounded
/// multipliers. Solutions (1, 0) and (0, 1).
#[test]
fn complementarity_constraint() {
    let problem = Dense {
        start: [0.5, 0.4],
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [-INF],
        constraint_upper: [0.0],
        objective: |x| (x[0] - 1.0).powi(2) + (x[1] - 1.0).powi(2),
        constraints: |x| [x[0] * x[1]],
    };
    for settings in [NlpSettings::default(), adaptive()] {
        let report = solve_with(&problem, &settings);
        assert!(report.status.is_success(), "{}", report.status);
        assert!((report.objective - 1.0).abs() < 1e-3, "{report:?}");
    }
}

#[test]
fn infeasible_names_the_worst_constraint() {
    let problem = Dense {
        start: [0.3, -0.2],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [-INF, 4.0, -5.0],
        constraint_upper: [1.0, INF, 5.0],
        objective: |x| x[0] * x[0] + x[1] * x[1],
        constraints: |x| [x[0] * x[0] + x[1] * x[1], x[0] + x[1], x[0] - x[1]],
    };
    for settings in [NlpSettings::default(), adaptive()] {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Infeasible);
        // Least sum of violations: on the circle at 45 degrees, where x + y = sqrt 2.
        let worst = report.worst_constraint.unwrap();
        assert_eq!(worst.constraint, 1);
        assert!((worst.amount - (2.0_f64.sqrt() - 4.0)).abs() < 1e-3, "{worst:?}");
    }
}

#[test]
fn infeasible_linear_equalities() {
    let problem = Dense {
        start: [0.0; 2],
        lower: [0.0; 2],
        upper: [1.0; 2],
        constraint_lower: [3.0],
        constraint_upper: [3.0],
        objective: |x| x[0],
        constraints: |x| [x[0] + x[1]],
    };
    let report = solve(&problem);
    assert_eq!(report.status, Status::Infeasible);
    assert!((report.worst_constraint.unwrap().amount + 1.0).abs() < 1e-6);
}

#[test]
fn unbounded_problems_diverge() {
    let linear = Dense {
        start: [1.0, 1.0],
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [-INF],
        constraint_upper: [1.0],
        objective: |x| -1.0 * x[0] - x[1],
        constraints: |x| [x[0] - x[1]],
    };
    assert_eq!(solve(&linear).status, Status::Diverging);
    assert_eq!(solve_with(&linear, &adaptive()).status, Status::Diverging);
    let cubic = Dense::unconstrained([1.0], |x| -1.0 * x[0].powi(3));
    assert_eq!(solve(&cubic).status, Status::Diverging);
}

#[test]
fn redundant_equalities() {
    let problem = Dense {
        start: [3.0, -1.0, 2.0],
        lower: [-INF; 3],
        upper: [INF; 3],
        constraint_lower: [1.0, 2.0, 1.0, 0.0],
        constraint_upper: [1.0, 2.0, 1.0, 0.0],
        objective: |x| x[0] * x[0] + 2.0 * x[1] * x[1] + x[2] * x[2],
        // The second is twice the first, the third repeats it: rank two, four equalities for three variables.
        constraints: |x| {
            let sum = x[0] + x[1] + x[2];
            [sum, sum * 2.0, sum, x[0] - x[2]]
        },
    };
    for settings in [NlpSettings::default(), adaptive()] {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[0.4, 0.2, 0.4], 1e-7);
    }
}

#[test]
fn inconsistent_redundant_equalities() {
    let problem = Dense {
        start: [3.0, -1.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [1.0, 3.0, 0.0],
        constraint_upper: [1.0, 3.0, 0.0],
        objective: |x| x[0] * x[0],
        constraints: |x| [x[0] + x[1], x[0] + x[1], x[0] - x[1]],
    };
    let report = solve(&problem);
    assert_eq!(report.status, Status::Infeasible);
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
    assert_near(&report.x, &[2.0, 1.0], 1e-8);
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
    for settings in [NlpSettings::default(), adaptive()] {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[2.0, 6.0], 1e-7);
        assert_near(&report.constraint_multipliers, &[0.0, 1.5, 1.0], 1e-7);
        assert_near(&report.lower_multipliers, &[0.0, 0.0], 1e-7);
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
    for settings in [NlpSettings::default(), adaptive()] {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[1.4, 1.7], 1e-7);
        assert_near(&report.constraint_multipliers, &[-0.8, 0.0, 0.0], 1e-7);
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
    assert!((slope - multiplier).abs() < 1e-4, "{slope} and {multiplier}");
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
    assert_near(&report.x, &[1.0, -1.0, 3.0, 7.0], 1e-8);
    assert_near(&report.lower_multipliers, &[2.0, 0.0, 0.0, 0.0], 1e-7);
    assert_near(&report.upper_multipliers, &[0.0, 2.0, 4.0, 0.0], 1e-7);
}

#[test]
fn free_constraints_are_ignored() {
    let mut problem = hs71();
    problem.constraint_lower[0] = -INF;
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_eq!(report.constraint_multipliers[0], 0.0);
    assert!((report.constraint_values[1] - 40.0).abs() < 1e-7);
}

#[test]
fn functions_may_fail_away_from_the_start() {
    // ln is not defined beyond the pole, which the first Newton step jumps over.
    let problem = Dense::unconstrained([5.0], |x| x[0] - x[0].ln() * 0.01);
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[0.01], 1e-8);
    let at_start = Dense::unconstrained([-1.0], |x| x[0].ln());
    assert_eq!(solve(&at_start).status, Status::EvaluationFailed(Evaluation::Objective));
    let constraint = Dense {
        start: [-1.0],
        lower: [-INF],
        upper: [INF],
        constraint_lower: [0.0],
        constraint_upper: [0.0],
        objective: |x| x[0],
        constraints: |x| [x[0].ln()],
    };
    assert_eq!(solve(&constraint).status, Status::EvaluationFailed(Evaluation::Constraints));
}

#[test]
fn no_interior() {
    // Two inequalities that leave a single line, and a degenerate vertex with three active constraints in the plane.
    let line = Dense {
        start: [3.0, 3.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [1.0, -INF],
        constraint_upper: [INF, 1.0],
        objective: |x| x[0] * x[0] + x[1] * x[1],
        constraints: |x| [x[0] + x[1], x[0] + x[1]],
    };
    let vertex = Dense {
        start: [3.0, 3.0],
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [0.0, 0.0, 0.0],
        constraint_upper: [INF; 3],
        objective: |x| 2.0 * x[0] + x[1],
        constraints: |x| [x[0] + x[1], x[0] - x[1] * 0.0, x[0] + 2.0 * x[1]],
    };
    for settings in [NlpSettings::default(), adaptive()] {
        let report = solve_with(&line, &settings);
        assert!(report.status.is_success(), "{}", report.status);
        assert_near(&report.x, &[0.5, 0.5], 1e-4);
        let report = solve_with(&vertex, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[0.0, 0.0], 1e-7);
    }
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
