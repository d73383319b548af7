//! Residuals of a transcription before the first iteration.

use apsides_nlp::Nlp;

use crate::transcription::Transcription;

/// The first point, and what its rows miss.
pub(crate) struct StartResiduals {
    pub(crate) x: Vec<f64>,
    /// The size of the residual of each constraint, relative to its scale, and the residual, positive beyond the upper bound: infinite and NaN where
    /// it cannot be evaluated.
    pub(crate) rows: Vec<(f64, f64)>,
}

impl StartResiduals {
    pub(crate) fn of(nlp: &mut Transcription) -> Self {
        let (mut x, m) = (vec![0.0; nlp.variables()], nlp.constraints());
        nlp.initial_point(&mut x);
        let (mut values, mut lower, mut upper) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
        nlp.constraint_values(&x, &mut values);
        nlp.constraint_bounds(&mut lower, &mut upper);
        let units = nlp.scaling().map_or_else(|| vec![1.0; m], |s| s.constraints);
        let row = |r: usize| {
            let amount = (values[r] - upper[r]).max(0.0) - (lower[r] - values[r]).max(0.0);
            if values[r].is_finite() { (amount.abs() / units[r], amount) } else { (f64::INFINITY, f64::NAN) }
        };
        Self { rows: (0..m).map(row).collect(), x }
    }

    /// The largest size.
    pub(crate) fn largest(&self) -> f64 {
        self.rows.iter().fold(0.0, |largest, (size, _)| largest.max(*size))
    }
}
