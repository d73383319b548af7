//! Degenerate problems of the literature: dependent constraints, no interior, no constraint qualification, singular
//! derivatives.

use apsides_nlp::Status;

use crate::support::{Dense, INF, Jet, assert_near, assert_success, solve_by_all, solve_with, strategies};

/// Solver: `NlpSettings::tolerance`.
const SOLVER: f64 = 1e-8;

/// Solver: the same divided by the curvature, or by the distance of an active limit.
const SOLVER_AT_BOUNDS: f64 = 1e-7;

/// Solver: the same where bounds are far away or nearly equal.
const FAR_OR_NEAR: f64 = 1e-6;

/// Solver: the root of the tolerance, where solutions are not isolated or have no interior.
const WITHOUT_INTERIOR: f64 = 1e-4;

/// Solver: ten times the root of the tolerance, where conditions vanish with the square of the distance.
const SQUARE: f64 = 1e-3;

/// Solver: some times the cube root of the tolerance, where conditions vanish with the third power of the distance.
const THIRD_POWER: f64 = 1e-2;

/// Solver: the start scales the objective by 1e-8, and the conditions with it.
const HUGE_GRADIENT: f64 = 1e-3;

/// Waechter and Biegler 2000, doi 10.1007/PL00011386: methods that only take Newton steps for the constraints fail
/// here. The solution has `x0 = max(1, offset)`; a stationary point of the 1-norm of the violation lies at (-1, 0, 0).
#[test]
fn waechter_biegler_counterexample() {
    let problem = |start, offset: f64| Dense {
        start,
        lower: [-INF, 0.0, 0.0],
        upper: [INF; 3],
        constraint_lower: [1.0, offset],
        constraint_upper: [1.0, offset],
        objective: |x| x[0],
        constraints: |x| [x[0] * x[0] - x[1], x[0] - x[2]],
    };
    for (offset, solution) in [(0.5, [1.0, 0.0, 0.5]), (2.0, [2.0, 3.0, 0.0])] {
        for start in [
            [-2.0, 3.0, 1.0],
            [-4.0, 1.0, 1.0],
            [-2.0, 1.0, 1.0],
            [-1.5, 1.0, 1.0],
            [-10.0, 1.0, 1.0],
            [0.0, 0.0, 0.0],
        ] {
            solve_by_all(&problem(start, offset), Status::Optimal, |report| {
                assert_near(&report.x, &solution, SOLVER_AT_BOUNDS);
            });
        }
    }
}

/// Powell 1970: a Newton method with line search for the equations stalls near (1.8, 0), where the Jacobian is
/// singular; it is singular at the solution, too.
#[test]
fn powell_singular_equations() {
    let problem = Dense {
        start: [3.0, 1.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [0.0; 2],
        constraint_upper: [0.0; 2],
        objective: |_| Jet::constant(0.0),
        constraints: |x| [x[0], 10.0 * x[0] / (x[0] + 0.1) + 2.0 * x[1] * x[1]],
    };
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[0.0, 0.0], SQUARE));
}

/// Kuhn and Tucker 1951: the gradients of the active constraints at the solution (1, 0) are opposite to each other, so
/// that no multipliers exist.
#[test]
fn kuhn_tucker_cusp() {
    let problem = Dense {
        start: [0.5, 0.1],
        lower: [-INF, 0.0],
        upper: [INF; 2],
        constraint_lower: [0.0],
        constraint_upper: [INF],
        objective: |x| x[0] * -1.0,
        constraints: |x| [(1.0 - x[0]).powi(3) - x[1]],
    };
    assert_success(&problem, |report| assert_near(&report.x, &[1.0, 0.0], THIRD_POWER));
}

/// A line of feasible points, where the gradient of the constraint vanishes.
#[test]
fn square_at_most_zero() {
    let problem = Dense {
        start: [2.0, -1.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [-INF],
        constraint_upper: [0.0],
        objective: |x| x[0] + (x[1] - 1.0).powi(2),
        constraints: |x| [x[0] * x[0]],
    };
    assert_success(&problem, |report| assert_near(&report.x, &[0.0, 1.0], SQUARE));
}

#[test]
fn singular_hessian_at_the_solution() {
    let problem = Dense::unconstrained([3.0, -2.0], |x| x[0].powi(4) + (x[0] - x[1]).powi(4));
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[0.0, 0.0], THIRD_POWER));
}

#[test]
fn solutions_that_are_not_isolated() {
    let problem = Dense {
        start: [3.0, 5.0],
        lower: [-10.0; 2],
        upper: [10.0; 2],
        constraint_lower: [-INF],
        constraint_upper: [6.0],
        objective: |x| (x[0] + x[1] - 2.0).powi(2),
        constraints: |x| [x[0] - x[1]],
    };
    solve_by_all(&problem, Status::Optimal, |report| {
        assert_near(&[report.x[0] + report.x[1]], &[2.0], WITHOUT_INTERIOR);
    });
}

#[test]
fn more_nonlinear_equalities_than_variables() {
    let problem = Dense {
        start: [3.0, 3.0],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [5.0, 0.0, 3.0, 2.0],
        constraint_upper: [5.0, 0.0, 3.0, 2.0],
        objective: |x| x[0] - x[1],
        constraints: |x| [x[0] * x[0] + x[1] * x[1], x[0] * x[0] - 4.0 * x[1], x[0] + x[1], x[0] * x[1]],
    };
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[2.0, 1.0], SOLVER_AT_BOUNDS));
}

/// After the first step only the multipliers have to converge.
#[test]
fn equalities_that_fix_every_variable() {
    let problem = Dense {
        start: [-3.0],
        lower: [-1.0],
        upper: [4.0],
        constraint_lower: [2.5],
        constraint_upper: [2.5],
        objective: |x| 0.6 * x[0],
        constraints: |x| [2.9 * x[0]],
    };
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[2.5 / 2.9], SOLVER));
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
    for settings in strategies() {
        let report = solve_with(&problem, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[0.4, 0.2, 0.4], SOLVER_AT_BOUNDS);
    }
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
    for settings in strategies() {
        let report = solve_with(&line, &settings);
        assert!(report.status.is_success(), "{}", report.status);
        assert_near(&report.x, &[0.5, 0.5], WITHOUT_INTERIOR);
        let report = solve_with(&vertex, &settings);
        assert_eq!(report.status, Status::Optimal);
        assert_near(&report.x, &[0.0, 0.0], SOLVER_AT_BOUNDS);
    }
}

/// The gradient at the start scales the objective by 1e-8, the complementarity in the user's units by 1e8.
#[test]
fn start_with_a_huge_gradient() {
    let problem = Dense {
        start: [1e10],
        lower: [2.0],
        upper: [INF],
        constraint_lower: [],
        constraint_upper: [],
        objective: |x| (x[0] - 1.0).powi(2),
        constraints: |_| [],
    };
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[2.0], HUGE_GRADIENT));
}

#[test]
fn bounds_far_away() {
    let problem = Dense {
        start: [3.0, 5.0],
        lower: [-1e18, 0.0],
        upper: [1e18, 1e10],
        constraint_lower: [-1e15],
        constraint_upper: [2.0],
        objective: |x| (x[0] - 1.0).powi(2) + (x[1] - 4.0).powi(2),
        constraints: |x| [x[0] + x[1]],
    };
    // Projection of (1, 4) on the half plane.
    solve_by_all(&problem, Status::Optimal, |report| assert_near(&report.x, &[-0.5, 2.5], FAR_OR_NEAR));
}

#[test]
fn nearly_equal_bounds() {
    let problem = Dense {
        start: [3.0, 5.0, 0.0],
        lower: [1.0, -10.0, -INF],
        upper: [1.0 + 1e-9, 10.0, INF],
        constraint_lower: [2.0, 3.0],
        constraint_upper: [2.0 + 1e-9, 3.0],
        objective: |x| (x[0] - 7.0).powi(2) + (x[1] - 4.0).powi(2) + x[2].powi(2),
        constraints: |x| [x[0] + 0.1 * x[1] + x[2], x[0] + x[1] + x[2]],
    };
    // The rows fix x1 and x0 + x2.
    solve_by_all(&problem, Status::Optimal, |report| {
        assert_near(&report.x, &[1.0, 1.0 / 0.9, 1.0 - 0.1 / 0.9], FAR_OR_NEAR);
    });
}
