//! A point and multipliers that a solve starts from.

use apsides_iteration::SolveReport;

use crate::problem::Nlp;

/// A point and multipliers to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct WarmStart {
    /// Variables, length `n`.
    pub x: Vec<f64>,
    /// Multipliers of the constraints, length `m`.
    pub constraint_multipliers: Vec<f64>,
    /// Multipliers of the lower bounds, length `n`.
    pub lower_multipliers: Vec<f64>,
    /// Multipliers of the upper bounds, length `n`.
    pub upper_multipliers: Vec<f64>,
    /// Barrier parameter to begin with; from the average complementarity if none.
    pub barrier: Option<f64>,
}

impl WarmStart {
    /// A point with multipliers of the constraints; those of the bounds are what the gradient of the Lagrangian leaves there. None
    /// where that or a multiplier is not finite.
    pub fn from_multipliers<N: Nlp + ?Sized>(
        nlp: &mut N,
        x: Vec<f64>,
        constraint_multipliers: Vec<f64>,
    ) -> Option<Self> {
        let mut slope = vec![0.0; x.len()];
        nlp.gradient(&x, &mut slope);
        let pattern = nlp.jacobian_pattern();
        let mut entries = vec![0.0; pattern.len()];
        nlp.jacobian(&x, &mut entries);
        for ((&row, &col), v) in pattern.rows.iter().zip(&pattern.cols).zip(&entries) {
            slope[col] += v * constraint_multipliers[row];
        }
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        (finite(&slope) && finite(&constraint_multipliers)).then(|| Self {
            x,
            constraint_multipliers,
            lower_multipliers: slope.iter().map(|s| s.max(0.0)).collect(),
            upper_multipliers: slope.iter().map(|s| (-s).max(0.0)).collect(),
            barrier: None,
        })
    }
}

impl From<&SolveReport> for WarmStart {
    fn from(report: &SolveReport) -> Self {
        Self {
            x: report.x.clone(),
            constraint_multipliers: report.constraint_multipliers.clone(),
            lower_multipliers: report.lower_multipliers.clone(),
            upper_multipliers: report.upper_multipliers.clone(),
            barrier: None,
        }
    }
}
