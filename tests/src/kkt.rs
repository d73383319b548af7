//! The optimality conditions of a nonlinear program at a point with multipliers, from the problem alone.
//!
//! Nothing of the solver is used but the point and the multipliers it returns, with
//! `L = f + y^T c - zl^T (x - xl) - zu^T (xu - x)`.

use apsides::nlp::{Nlp, Residuals, ScalingFactors, SolveReport};

/// Multipliers of this average size leave the errors undivided (Waechter and Biegler 2006, doi
/// 10.1007/s10107-004-0559-y, eq. 6).
const MULTIPLIER_SIZE: f64 = 100.0;

/// How far a variable may be beyond its bound, relative to max(1, |bound|), scaled.
const BOUND_ROUNDING: f64 = 2e-12;

/// How far a solution is from the conditions of Karush, Kuhn and Tucker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KktError {
    /// Gradient of the Lagrangian, violation of constraints and bounds, and distance to a bound times its multiplier.
    /// In the scaling asked for, dual parts divided by the size of the multipliers.
    pub residuals: Residuals,
    /// Largest multiplier of the wrong sign, divided like the gradient of the Lagrangian; zero if all signs are right.
    pub sign: f64,
}

impl KktError {
    /// The largest of the four.
    #[must_use]
    pub fn max(&self) -> f64 {
        self.residuals.max().max(self.sign)
    }
}

/// Functions, derivatives and bounds of a problem at a point, in the units of the problem.
struct Evaluated {
    variable_bounds: [Vec<f64>; 2],
    constraint_bounds: [Vec<f64>; 2],
    constraint_values: Vec<f64>,
    /// Gradient of `f + y^T c`.
    gradient: Vec<f64>,
}

fn bounds(count: usize, fill: impl FnOnce(&mut [f64], &mut [f64])) -> [Vec<f64>; 2] {
    let (mut lower, mut upper) = (vec![0.0; count], vec![0.0; count]);
    fill(&mut lower, &mut upper);
    [lower, upper]
}

fn evaluate(problem: &mut impl Nlp, report: &SolveReport) -> Evaluated {
    let (n, m) = (problem.variables(), problem.constraints());
    let (x, y) = (&report.x, &report.constraint_multipliers);
    let variable_bounds = bounds(n, |lower, upper| problem.variable_bounds(lower, upper));
    let mut constraint_values = vec![0.0; m];
    problem.constraint_values(x, &mut constraint_values);
    let mut gradient = vec![0.0; n];
    problem.gradient(x, &mut gradient);
    let pattern = problem.jacobian_pattern();
    let mut values = vec![0.0; pattern.len()];
    problem.jacobian(x, &mut values);
    for ((&row, &col), value) in pattern.rows.iter().zip(&pattern.cols).zip(values) {
        gradient[col] += value * y[row];
    }
    Evaluated {
        constraint_bounds: bounds(m, |lower, upper| problem.constraint_bounds(lower, upper)),
        variable_bounds,
        constraint_values,
        gradient,
    }
}

/// The average size of some multipliers relative to [`MULTIPLIER_SIZE`], at least 1.
fn divisor(multipliers: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = multipliers.fold((0.0, 0_u32), |(sum, count), y| (sum + y.abs(), count + 1));
    (sum / f64::from(count.max(1))).max(MULTIPLIER_SIZE) / MULTIPLIER_SIZE
}

/// One bound of a constraint or variable, scaled.
struct Side {
    /// Distance of the point from the bound: zero within the allowances, negative beyond, infinite without a bound.
    distance: f64,
    /// Its multiplier: negative if of the wrong sign.
    multiplier: f64,
    /// Whether the other bound is the same, so that the multiplier may have any sign.
    equality: bool,
}

impl Side {
    /// Distances up to `inside`, and up to `outside` beyond the bound, do not count.
    fn new(distance: f64, multiplier: f64, equality: bool, inside: f64, outside: f64) -> Self {
        let counted =
            if distance >= 0.0 { (distance - inside).max(0.0) } else { (distance + outside).min(0.0) };
        Self { distance: counted, multiplier, equality }
    }

    fn is_inequality(&self) -> bool {
        self.distance.is_finite() && !self.equality
    }
}

/// The errors of the conditions at the point and multipliers of a report. Functions and variables are multiplied by
/// `scaling` first: `report.scaling` gives the problem that a solver's tolerance refers to, factors of 1 the problem as
/// stated; infinite if anything is not a finite number. The divisors are those of Waechter and Biegler (eq. 5 and 6): the average size of all multipliers for
/// stationarity and signs, that of the multipliers of inequalities and bounds for complementarity. An inequality counts
/// twice in the first, as constraint and as bound on its slack.
///
/// A solver may widen the bounds of inequalities by `relaxation`, relative to max(1, |bound|), scaled, and leave a
/// variable beyond its bound by rounding ([`SolveReport::x`]): neither counts. The slack of a constraint, which is
/// complementary to its multiplier, may differ from its value by the violation that the report states.
///
/// # Panics
/// If lengths in `report` or `scaling` are not those of the problem.
#[must_use]
pub fn kkt_error(
    problem: &mut impl Nlp,
    report: &SolveReport,
    scaling: &ScalingFactors,
    relaxation: f64,
) -> KktError {
    let at = evaluate(problem, report);
    let rounding = |bound: f64| if bound.is_finite() { BOUND_ROUNDING * bound.abs().max(1.0) } else { 0.0 };
    let mut sides = Vec::new();
    let mut constraint_multipliers = Vec::new();
    for (i, &value) in at.constraint_values.iter().enumerate() {
        let (lower, upper) = (at.constraint_bounds[0][i], at.constraint_bounds[1][i]);
        let factor = scaling.constraints[i];
        let y = report.constraint_multipliers[i] * scaling.objective / factor;
        constraint_multipliers.push(y);
        // A constraint has one multiplier for both of its bounds: with two, its sign tells which it belongs to.
        let (at_lower, at_upper) = match (lower.is_finite(), upper.is_finite()) {
            (true, false) => (-y, 0.0),
            (false, true) => (0.0, y),
            _ => ((-y).max(0.0), y.max(0.0)),
        };
        let equality = lower == upper;
        let mut side = |distance: f64, bound: f64, multiplier: f64| {
            let width = if equality || bound.is_infinite() {
                0.0
            } else {
                relaxation * (factor * bound).abs().max(1.0)
            };
            let inside = report.errors.scaled.primal_infeasibility;
            sides.push(Side::new(factor * distance, multiplier, equality, inside, width));
        };
        side(value - lower, lower, at_lower);
        side(upper - value, upper, at_upper);
    }
    let mut stationarity = 0.0_f64;
    for (i, &x) in report.x.iter().enumerate() {
        let (lower, upper) = (at.variable_bounds[0][i], at.variable_bounds[1][i]);
        let (zl, zu) = (report.lower_multipliers[i], report.upper_multipliers[i]);
        let factor = scaling.variables[i];
        let dual = scaling.objective / factor;
        let equality = lower == upper;
        stationarity = stationarity.max(dual * (at.gradient[i] - zl + zu).abs());
        let mut side = |distance: f64, bound: f64, multiplier: f64| {
            sides.push(Side::new(
                factor * distance,
                dual * multiplier,
                equality,
                0.0,
                rounding(factor * bound),
            ));
        };
        side(x - lower, lower, zl);
        side(upper - x, upper, zu);
    }
    // Largest entries do not see what is not a number.
    let numbers = [&report.x, &report.lower_multipliers, &report.upper_multipliers, &constraint_multipliers];
    let values = [&at.constraint_values, &at.gradient];
    if !numbers.into_iter().chain(values).flatten().all(|value| value.is_finite()) {
        stationarity = f64::INFINITY;
    }
    let one_sided = || sides.iter().filter(|side| side.is_inequality()).map(|side| side.multiplier);
    let dual_divisor = divisor(constraint_multipliers.iter().copied().chain(one_sided()));
    let largest = |size: fn(&Side) -> f64| sides.iter().map(size).fold(0.0, f64::max);
    let complementarity = largest(|side| match side.is_inequality() {
        true => side.distance.max(0.0) * side.multiplier.max(0.0),
        false => 0.0,
    });
    // A multiplier of the wrong sign counts here, however far its bound; that of a bound that is not there must vanish.
    let sign = largest(|side| match (side.equality, side.distance.is_finite()) {
        (true, _) => 0.0,
        (false, true) => -side.multiplier,
        (false, false) => side.multiplier.abs(),
    });
    KktError {
        residuals: Residuals {
            dual_infeasibility: stationarity / dual_divisor,
            primal_infeasibility: largest(|side| -side.distance),
            complementarity: complementarity / divisor(one_sided()),
        },
        sign: sign / dual_divisor,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use apsides::nlp::{InteriorPoint, NlpSettings};
    use apsides_problems::nlp::Program;
    use apsides_problems::nlp::hock_schittkowski::collection;

    use super::*;

    /// Problem 35: optimum (4/3, 7/9, 4/9) with the constraint active, multiplier 2/9.
    fn solved() -> (Program, SolveReport) {
        let mut problem = collection().into_iter().find(|case| case.number == 35).unwrap();
        let report = InteriorPoint::new(NlpSettings::default()).solve(&mut problem).unwrap();
        (problem, report)
    }

    fn unit(report: &SolveReport) -> ScalingFactors {
        ScalingFactors {
            objective: 1.0,
            variables: vec![1.0; report.x.len()],
            constraints: vec![1.0; report.constraint_values.len()],
        }
    }

    #[test]
    fn a_solution_has_no_error() {
        let (mut problem, report) = solved();
        assert!(kkt_error(&mut problem, &report, &report.scaling, 1e-10).max() <= 1e-8);
        assert!(kkt_error(&mut problem, &report, &unit(&report), 1e-10).max() <= 1e-7);
    }

    #[test]
    fn each_condition_is_seen() {
        let (mut problem, solution) = solved();
        let mut error = |change: fn(&mut SolveReport)| {
            let mut report = solution.clone();
            change(&mut report);
            kkt_error(&mut problem, &report, &unit(&report), 1e-10)
        };
        let stationarity = error(|r| r.lower_multipliers[0] += 1e-3).residuals.dual_infeasibility;
        assert!((stationarity - 1e-3).abs() < 1e-6);
        // The multiplier of x0 at distance 4/3.
        let complementarity = error(|r| r.lower_multipliers[0] += 1e-3).residuals.complementarity;
        assert!((complementarity - 4e-3 / 3.0).abs() < 1e-6);
        let feasibility = error(|r| r.x[2] += 1e-3).residuals.primal_infeasibility;
        assert!((feasibility - 2e-3).abs() < 1e-6);
        assert!((error(|r| r.x[1] = -1e-3).residuals.primal_infeasibility - 1e-3).abs() < 1e-11);
        assert!((error(|r| r.constraint_multipliers[0] *= -1.0).sign - 2.0 / 9.0).abs() < 1e-6);
        assert!((error(|r| r.lower_multipliers[1] = -1e-3).sign - 1e-3).abs() < 1e-12);
        assert!(error(|r| r.x[0] = f64::NAN).max().is_infinite());
        // No upper bound is there to have a multiplier.
        assert!((error(|r| r.upper_multipliers[1] = 1e-3).sign - 1e-3).abs() < 1e-12);
    }
}
