//! Units of the user, and starting from an earlier solution.

use apsides_nlp::{InteriorPoint, Nlp, NlpSettings, Scaling, ScalingMethod, Status, WarmStart};

use crate::support::{Units, hs71, solve};

/// Solver: an objective in units in which the tolerances mean less.
const BAD_UNITS: f64 = 1e-3;

/// Solver: ten times `NlpSettings::tolerance`, in the units of the problem.
const SOLVER: f64 = 1e-7;

/// Powers of two, so that the scaled problem is the same to the last bit.
fn other_units() -> Units<impl Nlp> {
    let scaling = Scaling {
        objective: 2.0_f64.powi(-9),
        variables: vec![1024.0, 0.125, 2.0_f64.powi(20), 1.0],
        constraints: vec![2.0_f64.powi(-12), 4096.0],
    };
    Units { problem: hs71(), scaling }
}

#[test]
fn user_scaling_makes_the_solve_independent_of_units() {
    let settings = NlpSettings { scaling: ScalingMethod::User, ..NlpSettings::default() };
    let reference = InteriorPoint::new(NlpSettings { scaling: ScalingMethod::None, ..settings.clone() })
        .solve(&mut hs71())
        .unwrap();
    let mut problem = other_units();
    let units = problem.scaling.clone();
    let report = InteriorPoint::new(settings).solve(&mut problem).unwrap();
    assert_eq!(report.status, Status::Optimal);
    assert_eq!(report.counters, reference.counters);
    assert_eq!(report.objective, reference.objective * units.objective);
    for i in 0..4 {
        assert_eq!(report.x[i], reference.x[i] * units.variables[i]);
        let multiplier = reference.lower_multipliers[i] * units.objective / units.variables[i];
        assert_eq!(report.lower_multipliers[i], multiplier);
    }
    for i in 0..2 {
        let multiplier = reference.constraint_multipliers[i] * units.objective / units.constraints[i];
        assert_eq!(report.constraint_multipliers[i], multiplier);
    }
}

#[test]
fn every_scaling_finds_the_optimum_in_bad_units() {
    for scaling in [
        ScalingMethod::User,
        ScalingMethod::UserThenGradient { max: 100.0 },
        ScalingMethod::Gradient { max: 100.0 },
    ] {
        let settings = NlpSettings { scaling, ..NlpSettings::default() };
        let mut problem = other_units();
        let report = InteriorPoint::new(settings).solve(&mut problem).unwrap();
        assert!(report.status.is_success(), "{scaling:?}: {}", report.status);
        let objective = report.objective / problem.scaling.objective;
        assert!((objective - 17.0140173).abs() < BAD_UNITS, "{scaling:?}: {objective}");
    }
}

#[test]
fn the_lagrangian_is_stationary_in_the_users_units() {
    let report = solve(&hs71());
    let mut problem = hs71();
    let mut gradient = [0.0; 4];
    problem.gradient(&report.x, &mut gradient);
    let mut jacobian = [0.0; 8];
    problem.jacobian(&report.x, &mut jacobian);
    for i in 0..4 {
        let y = &report.constraint_multipliers;
        let residual = gradient[i] + y[0] * jacobian[i] + y[1] * jacobian[4 + i]
            - report.lower_multipliers[i]
            + report.upper_multipliers[i];
        assert!(residual.abs() < SOLVER, "{residual}");
    }
}

#[test]
fn warm_start_saves_iterations() {
    let cold = solve(&hs71());
    let mut near = hs71();
    near.constraint_lower[0] = 25.1;
    near.constraint_lower[1] = 40.2;
    near.constraint_upper[1] = 40.2;
    let from_cold = solve(&near);
    let warm = InteriorPoint::default()
        .solve_from(&mut near.clone(), &WarmStart::from(&cold), &mut crate::support::log)
        .unwrap();
    assert_eq!(warm.status, Status::Optimal);
    assert!((warm.objective - from_cold.objective).abs() < SOLVER);
    let (warm_iterations, cold_iterations) = (warm.counters.iterations, from_cold.counters.iterations);
    assert!(
        warm_iterations <= 5 && warm_iterations < cold_iterations,
        "{warm_iterations} of {cold_iterations}"
    );
    let again = InteriorPoint::default().solve_from(&mut hs71(), &WarmStart::from(&cold), &mut ()).unwrap();
    assert!(again.counters.iterations <= 4, "{}", again.counters.iterations);
}
