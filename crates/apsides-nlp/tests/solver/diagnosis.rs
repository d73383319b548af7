//! Conflicts of infeasible problems, with amounts in closed form.

use apsides_nlp::{
    Nlp, NlpError, NlpSettings, Place, Requirement, ScalingMethod, Side, diagnose, relax, requirements_of,
};

use crate::support::{Dense, INF};

/// Solver: amounts of the elastic problem, to the tolerance of its solves.
const RELAXED: f64 = 1e-5;

/// Solver: the same for one amount.
const SHARED: f64 = 1e-6;

fn settings() -> NlpSettings {
    NlpSettings { scaling: ScalingMethod::User, ..NlpSettings::default() }
}

/// `x^2 + y^2 <= 1` and `x + y >= 2`: the sum can reach sqrt(2), or the square of the radius must be 2.
fn disc_and_half_plane() -> Dense<2, 2> {
    Dense {
        start: [0.3, -0.2],
        lower: [-INF; 2],
        upper: [INF; 2],
        constraint_lower: [-INF, 2.0],
        constraint_upper: [1.0, INF],
        objective: |x| x[0],
        constraints: |x| [x[0] * x[0] + x[1] * x[1], x[0] + x[1]],
    }
}

fn find(list: &[(usize, f64)], requirement: usize) -> Option<f64> {
    list.iter().find(|(g, _)| *g == requirement).map(|(_, amount)| *amount)
}

#[test]
fn the_cheapest_conflict_is_named_and_every_remedy_measured() {
    let mut nlp = disc_and_half_plane();
    let requirements = requirements_of(&nlp);
    assert_eq!(requirements.len(), 2);
    let found = diagnose(&mut nlp, &requirements, &[0.3, -0.2], &settings()).unwrap();
    assert!(found.status.is_success());
    let short = 2.0 - 2f64.sqrt();
    assert_eq!(found.conflicts.len(), 1, "{found:?}");
    assert!((find(&found.conflicts, 1).unwrap() - short).abs() < RELAXED, "{found:?}");
    assert!((find(&found.remedies, 1).unwrap() - short).abs() < RELAXED, "{found:?}");
    assert!((find(&found.remedies, 0).unwrap() - 1.0).abs() < RELAXED, "{found:?}");
}

/// `0 <= x <= 1` and `x^2 >= 4`, and apart from it `y = 1` fixed and `y >= 1.5`: no single relaxation helps.
#[test]
fn bounds_on_variables_take_part_and_two_conflicts_have_no_single_remedy() {
    let mut nlp = Dense {
        start: [0.5, 1.0],
        lower: [0.0, 1.0],
        upper: [1.0, 1.0],
        constraint_lower: [4.0, 1.5],
        constraint_upper: [INF, INF],
        objective: |x| x[0],
        constraints: |x| [x[0] * x[0], x[1]],
    };
    let requirements = requirements_of(&nlp);
    let found = diagnose(&mut nlp, &requirements, &[0.5, 1.0], &settings()).unwrap();
    assert_eq!(found.conflicts.len(), 2, "{found:?}");
    assert!(found.remedies.is_empty(), "{found:?}");
    let x_upper = Place::Variable(0);
    let upper =
        requirements.iter().position(|r| r.limits[0].place == x_upper && r.limits[0].side == Side::Upper);
    assert!((find(&found.conflicts, upper.unwrap()).unwrap() - 1.0).abs() < RELAXED, "{found:?}");
    // Without the second conflict each side of the first is a remedy.
    nlp.constraint_lower[1] = 0.0;
    let requirements = requirements_of(&nlp);
    let found = diagnose(&mut nlp, &requirements, &[0.5, 1.0], &settings()).unwrap();
    let amounts: Vec<f64> = found.remedies.iter().map(|r| r.1).collect();
    assert_eq!(amounts.len(), 2, "{found:?}");
    assert!(amounts.iter().any(|a| (a - 1.0).abs() < RELAXED), "x raised to 2: {found:?}");
    assert!(amounts.iter().any(|a| (a - 3.0).abs() < RELAXED), "x^2 lowered to 1: {found:?}");
}

/// Limits that move together: the largest excess is the amount.
#[test]
fn shared_limits_have_one_amount() {
    let mut nlp = Dense {
        start: [0.0, 0.0],
        lower: [1.0, 3.0],
        upper: [INF; 2],
        constraint_lower: [-INF; 2],
        constraint_upper: [0.5; 2],
        objective: |x| x[0],
        constraints: |x| [x[0] * x[0], x[1] * 1.0],
    };
    let upper: Vec<_> = requirements_of(&nlp).into_iter().skip(2).flat_map(|r| r.limits).collect();
    assert_eq!(upper.len(), 2);
    let shared = Requirement { limits: upper, unit: 1.0, weight: 1.0, most: INF };
    let found =
        relax(&mut nlp, std::slice::from_ref(&shared), &[0], &[0.0, 0.0], &settings(), &mut ()).unwrap();
    assert!((found.amounts[0] - 2.5).abs() < SHARED, "{found:?}");
    assert_eq!(found.report.x.len(), nlp.variables());
    // As far as 2, it is not enough.
    let little = Requirement { most: 2.0, ..shared };
    let found = relax(&mut nlp, &[little], &[0], &[0.0, 0.0], &settings(), &mut ()).unwrap();
    assert!(!found.is_success());
}

#[test]
fn a_feasible_problem_has_no_conflict() {
    let mut nlp = disc_and_half_plane();
    nlp.constraint_lower[1] = 1.0;
    let found = diagnose(&mut nlp, &requirements_of(&disc_and_half_plane())[..1], &[0.0, 0.0], &settings());
    let found = found.unwrap();
    assert!(
        found.status.is_success() && found.conflicts.is_empty() && found.remedies.is_empty(),
        "{found:?}"
    );
}

#[test]
fn malformed_requirements_are_refused() {
    let mut nlp = disc_and_half_plane();
    let good = requirements_of(&nlp);
    let mut run = |requirements: &[Requirement], elastic: &[usize], start: &[f64]| {
        relax(&mut nlp, requirements, elastic, start, &settings(), &mut ()).unwrap_err()
    };
    assert!(matches!(run(&good, &[0], &[0.0]), NlpError::Length { .. }));
    assert!(matches!(run(&good, &[2], &[0.0; 2]), NlpError::Length { .. }));
    assert!(matches!(run(&good, &[0], &[f64::NAN; 2]), NlpError::Start { .. }));
    for (unit, weight) in [(0.0, 1.0), (1.0, -1.0), (f64::NAN, 1.0), (1.0, INF)] {
        let bad = Requirement { unit, weight, ..good[0].clone() };
        assert!(matches!(run(&[bad], &[0], &[0.0; 2]), NlpError::Scale { .. }));
    }
    let bad = Requirement { most: f64::NAN, ..good[0].clone() };
    assert!(matches!(run(&[bad], &[0], &[0.0; 2]), NlpError::Bounds { .. }));
    let mut bad = good[0].clone();
    bad.limits[0].value = INF;
    assert!(matches!(run(&[bad.clone()], &[0], &[0.0; 2]), NlpError::Start { .. }));
    bad.limits[0].place = Place::Constraint(7);
    assert!(matches!(run(&[bad], &[0], &[0.0; 2]), NlpError::Length { .. }));
}
