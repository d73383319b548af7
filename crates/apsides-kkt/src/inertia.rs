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
