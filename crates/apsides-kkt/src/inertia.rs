//! The inertia of a symmetric matrix: how many eigenvalues have each sign.

/// Signs of the eigenvalues, as counted from the factor (Sylvester's law of inertia).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Inertia {
    /// Positive pivots.
    pub positive: usize,
    /// Negative pivots.
    pub negative: usize,
    /// Pivots that are zero to rounding. All rows, if the factorisation overflowed.
    pub zero: usize,
}

impl Inertia {
    /// Adds a pivot, which counts as zero up to `zero`.
    #[inline(always)]
    pub(crate) fn count(&mut self, pivot: f64, zero: f64) {
        if pivot.abs() <= zero {
            self.zero += 1;
        } else if pivot > 0.0 {
            self.positive += 1;
        } else {
            self.negative += 1;
        }
    }
}
