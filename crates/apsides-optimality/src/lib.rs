//! The optimality conditions of a nonlinear program at a reported solution, from the problem alone.
//!
//! Nothing of the solver is used but the point, the multipliers and the scaling factors it reports, with
//! `L = f + y^T c - zl^T (x - xl) - zu^T (xu - x)`. The allowances are those that the solver documents: the tolerances of
//! [`NlpSettings`], bounds of inequalities that are relaxed by `bound_relaxation`, and variables beyond their bounds by
//! rounding ([`SolveReport::x`]).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod evaluated;

use std::fmt;

use apsides_nlp::{Nlp, NlpSettings, ScalingFactors, ScalingMethod, SolveReport};
use evaluated::{Bounds, Evaluated};

/// Multipliers of this average size leave the errors undivided (Waechter and Biegler 2006, doi
/// 10.1007/s10107-004-0559-y, eq. 6).
const MULTIPLIER_SIZE: f64 = 100.0;
/// Largest distance of a variable beyond its bound, relative to max(1, |bound|), scaled.
const BOUND_ROUNDING: f64 = 2e-12;

/// Rounding errors of a sum relative to the sizes of its terms.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// One of the conditions of Karush, Kuhn and Tucker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// The gradient of the Lagrangian vanishes.
    Stationarity,
    /// Constraints and variables are within their bounds.
    Feasibility,
    /// Only the multipliers of active bounds differ from zero.
    Complementarity,
    /// Multipliers of bounds are not negative, and zero where no bound is.
    Sign,
}

/// The variable or constraint that a condition concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A variable, by index.
    Variable(usize),
    /// A constraint, by index.
    Constraint(usize),
}

/// The residual of a point in one condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionResidual {
    /// The condition.
    pub condition: Condition,
    /// The variable or constraint concerned.
    pub place: Place,
    /// Residual in the scaling of the report; dual parts divided by the size of the multipliers (Waechter and Biegler, eq. 5).
    pub scaled: f64,
    /// Residual without divisors in the user's units, or in those of [`Nlp::scaling`] where the solve uses them.
    pub absolute: f64,
    /// The larger of both relative to its tolerance; above 1 if the condition is violated, infinite if not a number.
    pub relative: f64,
}

impl fmt::Display for ConditionResidual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { condition, place, scaled, absolute, relative } = self;
        write!(
            f,
            "{condition:?}, {place:?}: {scaled:e} scaled, {absolute:e} absolute, {relative:e} times the tolerance"
        )
    }
}

/// A positive error relative to what it may be.
fn relative(error: f64, most: f64) -> f64 {
    match error {
        0.0 => 0.0,
        _ if error.is_nan() || most.is_nan() => f64::INFINITY,
        _ => error / most,
    }
}

/// The most violated condition of a report, relative to the tolerances of the settings; none if all hold.
///
/// Dual parts are divided by the average size of all multipliers, complementarity by that of the multipliers of
/// inequalities and bounds (Waechter and Biegler, eq. 6). An inequality counts twice in the first, as constraint and as
/// bound on its slack; a constraint without bounds counts in neither.
///
/// Complementary are the slack of a constraint and the multiplier of the slack: they may differ from the value of the
/// constraint and from its multiplier by the violation and the dual infeasibility that the report states.
///
/// # Panics
/// If lengths in `report` are not those of the problem.
pub fn violated(
    problem: &mut (impl Nlp + ?Sized),
    report: &SolveReport,
    settings: &NlpSettings,
) -> Option<ConditionResidual> {
    let violated = residuals(problem, report, settings).into_iter().filter(|e| e.relative > 1.0);
    violated.max_by(|a, b| a.relative.total_cmp(&b.relative))
}

/// One bound of a constraint or variable, scaled.
struct Side {
    place: Place,
    /// Distance of the point from the bound: zero within the allowances, negative beyond, infinite without a bound.
    distance: f64,
    /// Its multiplier: negative if of the wrong sign.
    multiplier: f64,
    /// True if the other bound is the same, so that the multiplier may have any sign.
    equality: bool,
}

impl Side {
    fn is_inequality(&self) -> bool {
        self.distance.is_finite() && !self.equality
    }
}

/// The average size of some multipliers relative to [`MULTIPLIER_SIZE`], at least 1.
fn divisor(multipliers: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = multipliers.fold((0.0, 0_u32), |(sum, count), y| (sum + y.abs(), count + 1));
    (sum / f64::from(count.max(1))).max(MULTIPLIER_SIZE) / MULTIPLIER_SIZE
}

/// `distance` less the allowances inside and beyond a bound.
fn counted(distance: f64, inside: f64, beyond: f64) -> f64 {
    if distance >= 0.0 { (distance - inside).max(0.0) } else { (distance + beyond).min(0.0) }
}

/// Sides of all bounds, scaled.
fn sides(at: &Evaluated, report: &SolveReport, settings: &NlpSettings) -> Vec<Side> {
    let mut sides = Vec::new();
    let scaling = &report.scaling;
    let allowance = |relative: f64, bound: f64| relative * bound.abs().max(1.0);
    for (k, &value) in at.constraint_values.iter().enumerate() {
        let Bounds { lower, upper } = at.constraint_bounds[k];
        let factor = scaling.constraints[k];
        let dual = scaling.objective / factor;
        let y = report.constraint_multipliers[k];
        // A constraint has one multiplier for both of its bounds: with two, its sign tells which it belongs to.
        let at_bounds = match (lower.is_finite(), upper.is_finite()) {
            (true, false) => [-y, 0.0],
            (false, true) => [0.0, y],
            _ => [(-y).max(0.0), y.max(0.0)],
        };
        let equality = lower == upper;
        let inside = report.errors.scaled.primal_infeasibility;
        for (distance, bound, multiplier) in
            [(value - lower, lower, at_bounds[0]), (upper - value, upper, at_bounds[1])]
        {
            let relaxed = !equality && bound.is_finite();
            let beyond = if relaxed { allowance(settings.bound_relaxation, factor * bound) } else { 0.0 };
            sides.push(Side {
                place: Place::Constraint(k),
                distance: counted(factor * distance, inside, beyond),
                multiplier: dual * multiplier,
                equality,
            });
        }
    }
    for (i, &x) in report.x.iter().enumerate() {
        let Bounds { lower, upper } = at.variable_bounds[i];
        let factor = scaling.variables[i];
        let dual = scaling.objective / factor;
        let at_bounds = [report.lower_multipliers[i], report.upper_multipliers[i]];
        for (distance, bound, multiplier) in
            [(x - lower, lower, at_bounds[0]), (upper - x, upper, at_bounds[1])]
        {
            let beyond = if bound.is_finite() { allowance(BOUND_ROUNDING, factor * bound) } else { 0.0 };
            sides.push(Side {
                place: Place::Variable(i),
                distance: counted(factor * distance, 0.0, beyond),
                multiplier: dual * multiplier,
                equality: lower == upper,
            });
        }
    }
    sides
}

/// Factors from the user's units to those of the absolute tolerances.
fn absolute_units(
    problem: &(impl Nlp + ?Sized),
    report: &SolveReport,
    settings: &NlpSettings,
) -> ScalingFactors {
    let stated = match settings.scaling {
        ScalingMethod::User | ScalingMethod::UserThenGradient { .. } => problem.scaling(),
        _ => None,
    };
    let inverse = |units: Vec<f64>| units.into_iter().map(f64::recip).collect();
    match stated {
        Some(units) => ScalingFactors {
            objective: units.objective.recip(),
            variables: inverse(units.variables),
            constraints: inverse(units.constraints),
        },
        None => ScalingFactors {
            objective: 1.0,
            variables: vec![1.0; report.x.len()],
            constraints: vec![1.0; report.constraint_values.len()],
        },
    }
}

/// Returns the residual of a report in each condition at each place.
///
/// # Panics
/// If lengths in `report` are not those of the problem.
pub fn residuals(
    problem: &mut (impl Nlp + ?Sized),
    report: &SolveReport,
    settings: &NlpSettings,
) -> Vec<ConditionResidual> {
    let at = Evaluated::new(problem, report, settings.infinite_bound);
    let (scaling, units) = (&report.scaling, absolute_units(problem, report, settings));
    let factor = |factors: &ScalingFactors, place| match place {
        Place::Variable(i) => factors.variables[i],
        Place::Constraint(k) => factors.constraints[k],
    };
    let sides = sides(&at, report, settings);
    let one_sided = || sides.iter().filter(|side| side.is_inequality()).map(|side| side.multiplier);
    let of_constraints = (0..report.constraint_multipliers.len())
        .filter(|&k| at.constraint_bounds[k].are_stated())
        .map(|k| report.constraint_multipliers[k] * scaling.objective / scaling.constraints[k]);
    let dual_divisor = divisor(of_constraints.chain(one_sided()));
    let bound_divisor = divisor(one_sided());

    let mut errors = Vec::new();
    let mut add = |condition, place, [scaled, absolute]: [f64; 2], [tolerance, most]: [f64; 2]| {
        let relative = relative(scaled, tolerance).max(relative(absolute, most));
        errors.push(ConditionResidual { condition, place, scaled, absolute, relative });
    };
    let tolerance = settings.tolerance;
    for (i, gradient) in at.gradient.iter().enumerate() {
        let (zl, zu) = (report.lower_multipliers[i], report.upper_multipliers[i]);
        let residual = (gradient - zl + zu).abs();
        let of = |factors: &ScalingFactors| residual * factors.objective / factors.variables[i];
        let rounding = ROUNDING * (at.gradient_size[i] + zl.abs() + zu.abs());
        let most = settings.dual_tolerance + rounding * units.objective / units.variables[i];
        let error = [of(scaling) / dual_divisor, of(&units)];
        add(Condition::Stationarity, Place::Variable(i), error, [tolerance, most]);
    }
    for side in &sides {
        let place = side.place;
        let is_variable = matches!(place, Place::Variable(_));
        let length = factor(&units, place) / factor(scaling, place);
        let cost = units.objective / scaling.objective;
        // Variables are never outside their bounds by more than rounding, and their multipliers never of the wrong sign.
        let least = |most: [f64; 2]| if is_variable { [0.0; 2] } else { most };

        let outside = if side.distance.is_nan() { f64::NAN } else { (-side.distance).max(0.0) };
        let most = least([tolerance, settings.constraint_tolerance]);
        add(Condition::Feasibility, place, [outside, outside * length], most);

        // A multiplier of the wrong sign counts, however far its bound; that of a bound that is not there must vanish.
        let wrong = match (side.equality, side.distance.is_infinite()) {
            _ if side.multiplier.is_nan() => f64::NAN,
            (true, _) if !is_variable => 0.0,
            (_, false) => (-side.multiplier).max(0.0),
            (_, true) => side.multiplier.abs(),
        };
        let most = least([tolerance, settings.dual_tolerance]);
        add(Condition::Sign, place, [wrong / dual_divisor, wrong * cost / length], most);

        if side.is_inequality() {
            // That of a slack may differ from that of its constraint by the residual that the report states.
            let stated = report.errors;
            let differs = match place {
                Place::Variable(_) => [0.0; 2],
                Place::Constraint(_) => {
                    [stated.scaled.dual_infeasibility * dual_divisor, stated.unscaled.dual_infeasibility]
                }
            };
            let product = |distance: f64, multiplier: f64| distance.max(0.0) * multiplier.max(0.0);
            let scaled = product(side.distance, side.multiplier - differs[0]) / bound_divisor;
            let absolute = product(side.distance * length, side.multiplier * cost / length - differs[1]);
            let most = [tolerance, settings.complementarity_tolerance];
            add(Condition::Complementarity, place, [scaled, absolute], most);
        }
    }
    errors
}

#[cfg(test)]
mod tests;
