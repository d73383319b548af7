//! Functions, derivatives and bounds of a problem at a point, in the units of the problem.

use apsides_nlp::{Nlp, SolveReport};

/// Bounds of one variable or constraint; infinite where there is none.
#[derive(Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Bounds {
    /// True if there is one at least.
    pub(crate) fn are_stated(self) -> bool {
        self.lower.is_finite() || self.upper.is_finite()
    }
}

pub(crate) struct Evaluated {
    pub(crate) variable_bounds: Vec<Bounds>,
    pub(crate) constraint_bounds: Vec<Bounds>,
    pub(crate) constraint_values: Vec<f64>,
    /// Gradient of `f + y^T c`.
    pub(crate) gradient: Vec<f64>,
    /// Sum of the sizes of its terms.
    pub(crate) gradient_size: Vec<f64>,
}

/// Bounds with a magnitude from `infinite` are none.
fn bounds(count: usize, infinite: f64, fill: impl FnOnce(&mut [f64], &mut [f64])) -> Vec<Bounds> {
    let (mut lower, mut upper) = (vec![0.0; count], vec![0.0; count]);
    fill(&mut lower, &mut upper);
    let bound = |(lower, upper): (f64, f64)| Bounds {
        lower: if lower <= -infinite { f64::NEG_INFINITY } else { lower },
        upper: if upper >= infinite { f64::INFINITY } else { upper },
    };
    lower.into_iter().zip(upper).map(bound).collect()
}

impl Evaluated {
    pub(crate) fn new(problem: &mut (impl Nlp + ?Sized), report: &SolveReport, infinite: f64) -> Self {
        let (n, m) = (problem.variables(), problem.constraints());
        let (x, y) = (&report.x, &report.constraint_multipliers);
        let mut constraint_values = vec![0.0; m];
        problem.constraint_values(x, &mut constraint_values);
        let mut gradient = vec![0.0; n];
        problem.gradient(x, &mut gradient);
        let mut gradient_size: Vec<f64> = gradient.iter().map(|g| g.abs()).collect();
        let pattern = problem.jacobian_pattern();
        let mut values = vec![0.0; pattern.len()];
        problem.jacobian(x, &mut values);
        for ((&row, &col), value) in pattern.rows.iter().zip(&pattern.cols).zip(values) {
            gradient[col] += value * y[row];
            gradient_size[col] += (value * y[row]).abs();
        }
        Self {
            variable_bounds: bounds(n, infinite, |lower, upper| problem.variable_bounds(lower, upper)),
            constraint_bounds: bounds(m, infinite, |lower, upper| problem.constraint_bounds(lower, upper)),
            constraint_values,
            gradient,
            gradient_size,
        }
    }
}
