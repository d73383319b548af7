//! The optimality conditions of a reported solution, from the functions of the problem and the documented tolerances
//! alone.

use apsides_nlp::{Nlp, NlpSettings, SolveReport};

/// Multipliers of this average size leave the errors undivided (Waechter and Biegler 2006, eq. 6).
const MULTIPLIER_SIZE: f64 = 100.0;
/// How far a variable may be outside its bounds, as the report says.
const BOUND_ROUNDING: f64 = 2e-12;
/// For the rounding errors between the solver's sums and these.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// Values and derivatives of a problem at a point.
struct Values {
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
}

impl Values {
    fn new(nlp: &mut dyn Nlp, x: &[f64]) -> Self {
        let (n, m) = (x.len(), nlp.constraints());
        let mut gradient = vec![0.0; n];
        nlp.gradient(x, &mut gradient);
        let mut constraints = vec![0.0; m];
        nlp.constraint_values(x, &mut constraints);
        let pattern = nlp.jacobian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        nlp.jacobian(x, &mut entries);
        let mut jacobian = vec![vec![0.0; n]; m];
        for ((&row, &col), entry) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
            jacobian[row][col] += entry;
        }
        Self { gradient, constraints, jacobian }
    }
}

/// Whether `value` is above `most`, or one of them is NaN.
fn exceeds(value: f64, most: f64) -> bool {
    value > most || value.is_nan() || most.is_nan()
}

/// What of the optimality conditions a report called optimal violates; nothing if it is right.
pub(crate) fn violated_condition(
    nlp: &mut dyn Nlp,
    report: &SolveReport,
    settings: &NlpSettings,
) -> Option<String> {
    let (n, m) = (report.x.len(), report.constraint_values.len());
    let (x, y) = (&report.x, &report.constraint_multipliers);
    let (zl, zu) = (&report.lower_multipliers, &report.upper_multipliers);
    let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
    nlp.variable_bounds(&mut lower, &mut upper);
    let (mut row_lower, mut row_upper) = (vec![0.0; m], vec![0.0; m]);
    nlp.constraint_bounds(&mut row_lower, &mut row_upper);
    let finite = |bound: f64| bound.abs() < settings.infinite_bound;
    let relaxed = |bound: f64| {
        if finite(bound) { settings.bound_relaxation * bound.abs().max(1.0) } else { 0.0 }
    };

    let values = Values::new(nlp, x);
    let scaling = &report.scaling;

    // Divisors of dual infeasibility and complementarity (eq. 6), slacks of inequalities included.
    let is_fixed = |i: usize| lower[i] == upper[i];
    let (mut bound_sum, mut bound_count) = (0.0, 0_usize);
    for i in (0..n).filter(|&i| !is_fixed(i)) {
        bound_sum += (zl[i] + zu[i]) * scaling.objective / scaling.variables[i];
        bound_count += usize::from(finite(lower[i])) + usize::from(finite(upper[i]));
    }
    let mut sum = 0.0;
    for k in 0..m {
        let multiplier = y[k].abs() * scaling.objective / scaling.constraints[k];
        sum += multiplier;
        if row_lower[k] != row_upper[k] {
            bound_sum += multiplier;
            bound_count += usize::from(finite(row_lower[k])) + usize::from(finite(row_upper[k]));
        }
    }
    let divisor = |sum: f64, count: usize| (sum / count.max(1) as f64).max(MULTIPLIER_SIZE) / MULTIPLIER_SIZE;
    let dual = 1.01 * settings.tolerance * divisor(sum + bound_sum, m + bound_count);
    let complementarity = 1.01 * settings.tolerance * divisor(bound_sum, bound_count);

    for i in 0..n {
        let terms =
            || (0..m).map(|k| y[k] * values.jacobian[k][i]).chain([values.gradient[i], -zl[i], zu[i]]);
        let residual = terms().sum::<f64>().abs();
        let rounding = ROUNDING * terms().map(f64::abs).sum::<f64>();
        let unit = scaling.objective / scaling.variables[i];
        let most = (dual / unit).min(settings.dual_tolerance);
        if exceeds(residual, most + rounding) {
            return Some(format!("stationarity of variable {i}: {residual:e}, at most {most:e}"));
        }
        let factor = scaling.variables[i];
        let rounding = |bound: f64| BOUND_ROUNDING * (bound * factor).abs().max(1.0) / factor;
        if exceeds(lower[i], x[i] + rounding(lower[i])) || exceeds(x[i] - rounding(upper[i]), upper[i]) {
            return Some(format!("variable {i} = {} outside [{}, {}]", x[i], lower[i], upper[i]));
        }
        let distance = |i: usize, bound: f64| (x[i] - bound).abs();
        for (multiplier, bound) in [(zl[i], lower[i]), (zu[i], upper[i])] {
            let product =
                if is_fixed(i) { 0.0 } else { multiplier * (distance(i, bound) - rounding(bound)).max(0.0) };
            let most = (complementarity / scaling.objective).min(settings.complementarity_tolerance);
            let wrong = if finite(bound) { exceeds(product, 1.01 * most) } else { multiplier != 0.0 };
            if wrong || exceeds(0.0, multiplier) {
                return Some(format!(
                    "multiplier {multiplier:e} of the bound {bound} of variable {i} = {}",
                    x[i]
                ));
            }
        }
    }
    for k in 0..m {
        let value = values.constraints[k];
        let factor = scaling.constraints[k];
        let size: f64 = (0..n).map(|i| (values.jacobian[k][i] * x[i]).abs()).sum();
        let relaxation = |bound: f64| {
            if row_lower[k] == row_upper[k] { 0.0 } else { relaxed(bound * factor) / factor }
        };
        let allowed = (1.01 * settings.tolerance / factor).min(settings.constraint_tolerance)
            + ROUNDING * size.max(value.abs());
        for (bound, outside) in [(row_lower[k], row_lower[k] - value), (row_upper[k], value - row_upper[k])] {
            if finite(bound) && exceeds(outside, allowed + relaxation(bound)) {
                return Some(format!(
                    "constraint {k} = {value} outside {bound} by {outside:e}, at most {allowed:e}"
                ));
            }
        }
        // The multiplier of a slack may differ from that of its constraint by the dual tolerance.
        let dual = (dual * factor / scaling.objective).min(settings.dual_tolerance);
        let sides = [(-y[k], row_lower[k], value - row_lower[k]), (y[k], row_upper[k], row_upper[k] - value)];
        for (multiplier, bound, slack) in sides {
            let excess = (multiplier - dual).max(0.0);
            let slack = (slack - allowed).max(0.0);
            let most = (complementarity / scaling.objective).min(settings.complementarity_tolerance);
            let wrong = if finite(bound) { exceeds(excess * slack, 1.01 * most) } else { excess > 0.0 };
            if row_lower[k] != row_upper[k] && wrong {
                return Some(format!(
                    "multiplier {multiplier:e} of constraint {k} at {value} and the bound {bound}"
                ));
            }
        }
    }
    None
}

#[test]
fn every_condition_is_checked() {
    let settings = NlpSettings::default();
    let found = |change: fn(&mut SolveReport)| {
        let mut report = crate::support::solve(&crate::support::hs71());
        change(&mut report);
        violated_condition(&mut crate::support::hs71(), &report, &settings).unwrap_or_default()
    };
    assert_eq!(found(|_| {}), "");
    assert!(found(|report| report.x[1] += 1e-5).starts_with("stationarity of variable 0"));
    assert!(found(|report| report.x[0] = 1.0 - 1e-11).contains("outside [1, 5]"));
    assert!(found(|report| report.lower_multipliers[0] *= -1.0).starts_with("stationarity"));
    assert!(found(|report| report.upper_multipliers[1] += f64::NAN).starts_with("stationarity"));
    // Stationary for the opposite sides of bounds and constraints.
    let swapped = |report: &mut SolveReport| {
        let (zl, zu) = (report.lower_multipliers[2], report.upper_multipliers[2]);
        report.lower_multipliers[2] = zl + 1.0;
        report.upper_multipliers[2] = zu + 1.0;
    };
    assert!(found(swapped).starts_with("multiplier 1"));
    assert!(found(|report| report.constraint_multipliers[0] *= -1.0).starts_with("stationarity"));
}
