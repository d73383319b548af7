//! Derivatives of solutions against closed forms and against difference quotients of solutions.
#![allow(clippy::unwrap_used)]

use apsides_nlp::{
    InteriorPoint, NlpError, NlpSettings, Perturbation, SolutionDerivative, SolveReport, Status,
};

use crate::support::{Dense, INF, hs71, solve_with};

/// Agreement of a difference quotient of solutions: their tolerance over the width.
const RESOLVED: f64 = 2e-6;
const CLOSED_FORM: f64 = 1e-8;

fn exact() -> NlpSettings {
    NlpSettings { tolerance: 1e-12, ..NlpSettings::default() }
}

fn derivative<const N: usize, const M: usize>(
    problem: &Dense<N, M>,
    p: &Perturbation,
) -> (SolveReport, SolutionDerivative) {
    let report = solve_with(problem, &exact());
    assert_eq!(report.status, Status::Optimal);
    let mut sensitivity = InteriorPoint::new(exact()).sensitivity(&mut problem.clone(), &report).unwrap();
    let found = sensitivity.solve(p).unwrap();
    assert_eq!(found.objective, p.objective_derivative(&report).unwrap());
    (report, found)
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * b.abs().max(1.0), "{found:?} instead of {expected:?}");
    }
}

/// The derivatives of `problem(p)` at zero from [`Perturbation::between`] and from solutions.
fn check_against_solutions<const N: usize, const M: usize>(problem: impl Fn(f64) -> Dense<N, M>) {
    let h = 1e-5;
    let report = solve_with(&problem(0.0), &exact());
    let p = Perturbation::between(&mut problem(-h), &mut problem(h), &report, 2.0 * h).unwrap();
    let (_, found) = derivative(&problem(0.0), &p);
    let (a, b) = (solve_with(&problem(-h), &exact()), solve_with(&problem(h), &exact()));
    let slope =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| (b - a) / (2.0 * h)).collect() };
    assert_close(&[found.objective], &slope(&[a.objective], &[b.objective]), RESOLVED);
    assert_close(&found.x, &slope(&a.x, &b.x), RESOLVED);
    let multipliers = slope(&a.constraint_multipliers, &b.constraint_multipliers);
    assert_close(&found.constraint_multipliers, &multipliers, RESOLVED);
}

/// `min x0^2/2 + x1^2 + x2^2/2 - p x0` with `x0 + x1 + x2 = b` at `p = 1`, `b = 2`:
/// `y = (p - b) / 2.5`, `x = (p - y, -y/2, -y)`.
fn quadratic() -> Dense<3, 1> {
    Dense {
        start: [0.0; 3],
        lower: [-INF; 3],
        upper: [INF; 3],
        constraint_lower: [2.0],
        constraint_upper: [2.0],
        objective: |x| x[0].powi(2) * 0.5 + x[1].powi(2) + x[2].powi(2) * 0.5 - x[0],
        constraints: |x| [x[0] + x[1] + x[2]],
    }
}

#[test]
fn quadratic_program_has_the_closed_form() {
    let report = solve_with(&quadratic(), &exact());
    let cost =
        Perturbation { objective: -report.x[0], gradient: vec![-1.0, 0.0, 0.0], ..Perturbation::none(3, 1) };
    let (_, found) = derivative(&quadratic(), &cost);
    assert_close(&found.x, &[0.6, -0.2, -0.4], CLOSED_FORM);
    assert_close(&found.constraint_multipliers, &[0.4], CLOSED_FORM);
    assert_close(&[found.objective], &[-1.4], CLOSED_FORM);

    let bound =
        Perturbation { constraint_lower: vec![1.0], constraint_upper: vec![1.0], ..Perturbation::none(3, 1) };
    // The same as the function moving the other way.
    let function = Perturbation { constraints: vec![-1.0], ..Perturbation::none(3, 1) };
    for p in [bound, function] {
        let (_, found) = derivative(&quadratic(), &p);
        assert_close(&found.x, &[0.4, 0.2, 0.4], CLOSED_FORM);
        assert_close(&found.constraint_multipliers, &[-0.4], CLOSED_FORM);
        assert_close(&[found.objective], &[0.4], CLOSED_FORM);
    }
}

#[test]
fn an_active_bound_is_followed_and_an_inactive_one_is_not() {
    // min (x0 - 3)^2 + (x1 - 1)^2 + x0 x1 with x0 <= 2 active: x = (2, 0).
    let problem = Dense {
        start: [0.5, 0.5],
        lower: [-10.0; 2],
        upper: [2.0, 10.0],
        constraint_lower: [],
        constraint_upper: [],
        objective: |x| (x[0] - 3.0).powi(2) + (x[1] - 1.0).powi(2) + x[0] * x[1],
        constraints: |_| [],
    };
    let upper = Perturbation { variable_upper: vec![1.0, 0.0], ..Perturbation::none(2, 0) };
    let (_, found) = derivative(&problem, &upper);
    assert_close(&found.x, &[1.0, -0.5], CLOSED_FORM);
    assert_close(&[found.objective], &[-2.0], CLOSED_FORM);
    let inactive = Perturbation {
        variable_lower: vec![1.0, 1.0],
        variable_upper: vec![0.0, 1.0],
        ..Perturbation::none(2, 0)
    };
    let (_, found) = derivative(&problem, &inactive);
    assert_close(&found.x, &[0.0, 0.0], CLOSED_FORM);
    assert_close(&[found.objective], &[0.0], CLOSED_FORM);
}

#[test]
fn hs71_follows_right_hand_sides_and_bounds() {
    let with = |change: fn(&mut Dense<4, 2>, f64)| {
        move |p: f64| {
            let mut problem = hs71();
            change(&mut problem, p);
            problem
        }
    };
    check_against_solutions(with(|hs, p| hs.constraint_lower[0] += p));
    check_against_solutions(with(|hs, p| {
        hs.constraint_lower[1] += p;
        hs.constraint_upper[1] += p;
    }));
    check_against_solutions(with(|hs, p| hs.lower[0] += p));
    check_against_solutions(with(|hs, p| hs.upper[1] += p));
}

#[test]
fn scaling_by_the_method_does_not_show() {
    // Gradients above 100, so that objective and constraints are scaled.
    check_against_solutions(|p| Dense {
        objective: |x| (x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]) * 1e4,
        constraints: |x| {
            let squares = x[0].powi(2) + x[1].powi(2) + x[2].powi(2) + x[3].powi(2);
            [x[0] * x[1] * x[2] * x[3] * 1e2, squares]
        },
        constraint_lower: [2500.0 + 100.0 * p, 40.0],
        ..hs71()
    });
}

#[test]
fn a_fixed_variable_moves_functions_and_solution() {
    check_against_solutions(|p| {
        let mut problem = hs71();
        (problem.lower[0], problem.upper[0]) = (1.2 + p, 1.2 + p);
        problem
    });
}

#[test]
fn without_free_variables_the_functions_decide() {
    let fixed = |value: f64| Dense { lower: [value; 3], upper: [value; 3], ..free_sum() };
    check_against_solutions(|p| fixed(1.0 + p));
}

fn free_sum() -> Dense<3, 1> {
    Dense { constraint_lower: [-10.0], constraint_upper: [10.0], ..quadratic() }
}

#[test]
fn what_does_not_fit_is_refused() {
    let solver = InteriorPoint::new(exact());
    let report = solve_with(&hs71(), &exact());
    let mut sensitivity = solver.sensitivity(&mut hs71(), &report).unwrap();
    assert!(matches!(sensitivity.solve(&Perturbation::none(4, 1)), Err(NlpError::Length { .. })));
    let mut bad = Perturbation::none(4, 2);
    bad.fixed_variables[2] = 1.0;
    let text = sensitivity.solve(&bad).unwrap_err().to_string();
    assert_eq!(text, "perturbation, fixed_variables 2: the variable is free");
    let mut bad = Perturbation::none(4, 2);
    bad.gradient[1] = f64::NAN;
    assert!(matches!(sensitivity.solve(&bad), Err(NlpError::Perturbation { .. })));

    let (mut a, mut b) = (hs71(), hs71());
    b.upper[0] = 1.0;
    assert!(Perturbation::between(&mut a, &mut b, &report, 1.0).is_err());
    b.upper[0] = INF;
    assert!(Perturbation::between(&mut a, &mut b, &report, 1.0).is_err());
    assert!(Perturbation::between(&mut a.clone(), &mut a, &report, 0.0).is_err());
    assert!(Perturbation::between(&mut quadratic(), &mut quadratic(), &report, 1.0).is_err());
    assert!(solver.sensitivity(&mut quadratic(), &report).is_err());
}

#[test]
fn points_that_are_no_isolated_minima_have_no_derivative() {
    let solver = InteriorPoint::new(exact());
    let limited = solve_with(&hs71(), &NlpSettings { max_iterations: 2, ..exact() });
    assert!(matches!(solver.sensitivity(&mut hs71(), &limited), Err(NlpError::NoDerivative { .. })));
    // A valley: x0 + x1 is determined, x0 - x1 is not.
    let valley = Dense::unconstrained([1.0, 0.5], |x: &[_; 2]| (x[0] + x[1]).powi(2));
    let report = solve_with(&valley, &exact());
    assert_eq!(report.status, Status::Optimal);
    let tilt = Perturbation { gradient: vec![1.0, -1.0], ..Perturbation::none(2, 0) };
    let found = solver.sensitivity(&mut valley.clone(), &report).and_then(|mut s| s.solve(&tilt));
    assert!(matches!(found, Err(NlpError::NoDerivative { .. })));
}

/// `min (x + 1)^2` with `x >= a` and `x >= b` as rows, both zero: the least value is `(1 + max(a, b))^2`.
fn twice_bounded() -> Dense<1, 2> {
    Dense {
        start: [1.0],
        lower: [-INF],
        upper: [INF],
        constraint_lower: [0.0; 2],
        constraint_upper: [INF; 2],
        objective: |x| (x[0] + 1.0).powi(2),
        constraints: |x| [x[0], x[0]],
    }
}

/// The same with equalities, in two variables: `x + y = a`, `2 x + 2 y = b`.
fn twice_fixed() -> Dense<2, 2> {
    Dense {
        start: [1.0; 2],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [1.0, 2.0],
        constraint_upper: [1.0, 2.0],
        objective: |x| x[0].powi(2) + x[1].powi(2),
        constraints: |x| [x[0] + x[1], (x[0] + x[1]) * 2.0],
    }
}

fn follows<const N: usize, const M: usize>(problem: &Dense<N, M>, lower: [f64; M], upper: [f64; M]) -> bool {
    let report = solve_with(problem, &exact());
    let mut active = InteriorPoint::new(exact()).active_constraints(&mut problem.clone(), &report).unwrap();
    let p = Perturbation {
        constraint_lower: lower.to_vec(),
        constraint_upper: upper.to_vec(),
        ..Perturbation::none(N, M)
    };
    active.follow(&p, 1e-5).unwrap()
}

/// A bound that moves away from its equal has no price: it is 2 up and 0 down. Both together have one.
#[test]
fn dependent_constraints_follow_what_moves_them_alike() {
    assert!(follows(&twice_bounded(), [1.0, 1.0], [0.0; 2]));
    assert!(!follows(&twice_bounded(), [1.0, 0.0], [0.0; 2]));
    assert!(follows(&twice_fixed(), [1.0, 2.0], [1.0, 2.0]));
    assert!(!follows(&twice_fixed(), [1.0, 0.0], [1.0, 0.0]));
    assert!(!follows(&twice_fixed(), [0.0, 1.0], [0.0, 1.0]));
    let alone = Dense { constraint_lower: [0.0, -1.0], ..twice_bounded() };
    assert!(follows(&alone, [1.0, 0.0], [0.0; 2]));
    assert!(follows(&alone, [0.0, 1.0], [0.0; 2]));
    assert!(follows(&quadratic(), [1.0], [1.0]));
}
