//! Problems without a solution: infeasible, unbounded, or with functions that cannot be evaluated.

use apsides_nlp::{Evaluation, Status};

use crate::support::{Dense, INF, assert_near, solve, solve_by_all, solve_with, strategies};

/// Solver: `NlpSettings::tolerance`.
const SOLVER: f64 = 1e-8;

/// Solver: the same at a bound.
const SOLVER_AT_BOUND: f64 = 1e-7;

/// Solver: how near a solve comes to the edge of a domain before it fails.
const EDGE: f64 = 1e-3;

/// Solver: the restoration ends where the violations hardly fall.
const LEAST_VIOLATION: f64 = 1e-3;

/// Solver: the same for linear constraints.
const LINEAR_VIOLATION: f64 = 1e-6;

/// The circle and the parabola meet at (2, 1) and (-2, 1); the line passes through neither.
#[test]
fn inconsistent_nonlinear_equalities() {
    let problem = Dense {
        start: [3.0, 3.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [5.0, 0.0, 1.0],
        constraint_upper: [5.0, 0.0, 1.0],
        objective: |x| x[0],
        constraints: |x| [x[0] * x[0] + x[1] * x[1], x[0] * x[0] - 4.0 * x[1], x[0] - 3.0 * x[1]],
    };
    solve_by_all(&problem, Status::Infeasible, |report| assert!(report.worst_constraint.is_some()));
}

/// The problem is unbounded, and should be called so. Short steps along the cone reach the iteration limit instead: a known limit of the
/// method. This fails once a strategy does better; then its right status is `Diverging`.
#[test]
fn linear_objective_along_a_cone_is_not_yet_seen_to_diverge() {
    let problem = Dense {
        start: [1.0, 0.5, 3.0],
        lower: [-INF; 3],
        upper: [INF; 3],
        constraint_lower: [0.0],
        constraint_upper: [INF],
        objective: |x| x[0] - 2.0 * x[2],
        constraints: |x| [x[2] * x[2] - x[0] * x[0] - x[1] * x[1]],
    };
    solve_by_all(&problem, Status::IterationLimit, |_| {});
}

#[test]
fn concave_parabola_diverges() {
    solve_by_all(&Dense::unconstrained([1.0], |x| -1.0 * x[0] * x[0]), Status::Diverging, |_| {});
}

/// The curvature, and with it the regularisation, grows so fast that the objective is at its limit before `x` is.
#[test]
fn concave_quartic_diverges() {
    let problem = Dense::unconstrained([1.0, 2.0], |x| x[1] * x[1] - x[0].powi(4));
    solve_by_all(&problem, Status::Diverging, |_| {});
}

#[test]
fn growing_exponential_diverges() {
    let problem = Dense::unconstrained([1.0, 2.0], |x| x[1] * x[1] - x[0].exp());
    solve_by_all(&problem, Status::Diverging, |_| {});
}

/// Where the gradient is below the tolerance is a solution to the tolerance.
#[test]
fn infimum_that_is_not_attained() {
    let problem = Dense::unconstrained([0.0], |x| (-x[0]).exp());
    solve_by_all(&problem, Status::Optimal, |report| assert!(report.objective <= SOLVER));
}

/// Defined from 1 on, and still falling there.
#[test]
fn objective_falls_to_the_edge_of_its_domain() {
    let problem = Dense::unconstrained([3.0], |x| x[0] + (x[0] - 1.0).powf(1.5));
    for settings in strategies() {
        let report = solve_with(&problem, &settings);
        assert!(!report.status.is_success(), "{}", report.status);
        assert_near(&report.x, &[1.0], EDGE);
    }
}

/// The same with a bound at the edge: the solution is there, and just outside is NaN.
#[test]
fn bound_at_the_edge_of_the_domain() {
    let free = Dense::unconstrained([3.0], |x: &[_; 1]| x[0] + (x[0] - 1.0).powf(1.5));
    let problem = Dense { lower: [1.0], ..free };
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[1.0], SOLVER_AT_BOUND));
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
    for settings in strategies() {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Infeasible);
        // Least sum of violations: on the circle at 45 degrees, where x + y = sqrt 2.
        let worst = report.worst_constraint.unwrap();
        assert_eq!(worst.constraint, 1);
        assert!((worst.amount - (2.0_f64.sqrt() - 4.0)).abs() < LEAST_VIOLATION, "{worst:?}");
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
    assert!((report.worst_constraint.unwrap().amount + 1.0).abs() < LINEAR_VIOLATION);
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
    solve_by_all(&linear, Status::Diverging, |_| {});
    let cubic = Dense::unconstrained([1.0], |x| -1.0 * x[0].powi(3));
    solve_by_all(&cubic, Status::Diverging, |_| {});
}

#[test]
fn functions_may_fail_away_from_the_start() {
    // ln is not defined beyond the pole, which the first Newton step jumps over.
    let problem = Dense::unconstrained([5.0], |x| x[0] - x[0].ln() * 0.01);
    let report = solve(&problem);
    assert_eq!(report.status, Status::Optimal);
    assert_near(&report.x, &[0.01], SOLVER);
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
