#![allow(clippy::unwrap_used)]

use apsides_nlp::InteriorPoint;
use apsides_problems::nlp::Program;
use apsides_problems::nlp::hock_schittkowski::collection;

use super::*;

/// Solver: errors of the conditions before they are changed.
const SOLVER: f64 = 1e-6;

/// Problem 35: optimum (4/3, 7/9, 4/9) with the constraint active, multiplier 2/9.
fn solved() -> (Program, SolveReport) {
    let mut problem = collection().into_iter().find(|case| case.number == 35).unwrap();
    let report = InteriorPoint::new(NlpSettings::default()).solve(&mut problem).unwrap();
    (problem, report)
}

#[test]
fn a_solution_has_no_error() {
    let (mut problem, report) = solved();
    assert_eq!(violated(&mut problem, &report, &NlpSettings::default()), None);
}

#[test]
fn each_condition_is_seen() {
    let (mut problem, solution) = solved();
    let settings = NlpSettings::default();
    // The largest absolute error of a condition after a change, and whether any condition is called violated.
    let mut error = |condition: Condition, change: fn(&mut SolveReport)| {
        let mut report = solution.clone();
        change(&mut report);
        let of_condition =
            residuals(&mut problem, &report, &settings).into_iter().filter(|e| e.condition == condition);
        assert!(violated(&mut problem, &report, &settings).is_some());
        of_condition.map(|e| e.absolute).fold(0.0, f64::max)
    };
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < SOLVER, "{found}, {expected}");
    near(error(Condition::Stationarity, |r| r.lower_multipliers[0] += 1e-3), 1e-3);
    // The multiplier of x0 at distance 4/3.
    near(error(Condition::Complementarity, |r| r.lower_multipliers[0] += 1e-3), 4e-3 / 3.0);
    near(error(Condition::Feasibility, |r| r.x[2] += 1e-3), 2e-3);
    near(error(Condition::Feasibility, |r| r.x[1] = -1e-3), 1e-3);
    near(error(Condition::Sign, |r| r.constraint_multipliers[0] *= -1.0), 2.0 / 9.0);
    near(error(Condition::Sign, |r| r.lower_multipliers[1] = -1e-3), 1e-3);
    // No upper bound is there to have a multiplier.
    near(error(Condition::Sign, |r| r.upper_multipliers[1] = 1e-3), 1e-3);
}

/// No tolerance forgives variables outside their bounds, multipliers of the wrong sign, or NaN.
#[test]
fn what_may_not_be_at_all() {
    let (mut problem, solution) = solved();
    let mut found = |change: fn(&mut SolveReport)| {
        let mut report = solution.clone();
        change(&mut report);
        violated(&mut problem, &report, &NlpSettings::default()).map(|e| (e.condition, e.place))
    };
    let at = |condition, i| Some((condition, Place::Variable(i)));
    assert_eq!(found(|r| r.upper_multipliers[0] = 1e-12), at(Condition::Sign, 0));
    assert_eq!(found(|r| r.lower_multipliers[2] = -1e-12), at(Condition::Sign, 2));
    assert!(found(|r| r.lower_multipliers[1] = f64::NAN).is_some());
    assert!(found(|r| r.x[0] = f64::NAN).is_some());
    assert!(found(|r| r.constraint_multipliers[0] = f64::NAN).is_some());
}
