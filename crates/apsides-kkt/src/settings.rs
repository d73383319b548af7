//! Settings of a [`KktSystem`](crate::KktSystem).

use crate::KktError;

/// Elimination order of the rows.
///
/// Every order is followed by a postorder of its elimination tree: an equivalent order with the same fill and the
/// same pivots, in which columns of equal structure are neighbours.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Ordering {
    /// Approximate minimum degree.
    #[default]
    Amd,
    /// One stage number per row: rows are eliminated by ascending stage, rows of one stage in their given order.
    /// The rule that suits a collocation transcription is in the [crate documentation](crate#stages).
    Stages(Vec<u32>),
    /// `order[k]` is the row eliminated at step `k`: a permutation of `0..n`.
    Custom(Vec<usize>),
}

/// Settings of a [`KktSystem`](crate::KktSystem).
#[derive(Debug, Clone, PartialEq)]
pub struct KktSettings {
    /// Elimination order. Default: [`Ordering::Amd`].
    pub ordering: Ordering,
    /// Subtracted from the pivots of the dual rows, and added to those of the primal rows that are at most three times this, in the
    /// factor only, after equilibration (so relative to rows of unit size); refinement removes its effect. Default 1e-9.
    pub static_shift: f64,
    /// Refinement stops when [`SolveQuality::residual`](crate::SolveQuality::residual) is at most this. Default 1e-10.
    pub residual_tolerance: f64,
    /// Refinement steps (solves with the factor after the first) for each of the two factorisations. Each of the first
    /// twenty costs the memory of one more vector. Default 10.
    pub max_refinements: usize,
    /// Scale rows and columns symmetrically to unit largest entries before each factorisation. Default true.
    pub equilibrate: bool,
}

impl Default for KktSettings {
    fn default() -> Self {
        Self {
            ordering: Ordering::Amd,
            static_shift: 1e-9,
            residual_tolerance: 1e-10,
            max_refinements: 10,
            equilibrate: true,
        }
    }
}

impl KktSettings {
    pub(crate) fn check(&self) -> Result<(), KktError> {
        check_nonnegative("static_shift", self.static_shift)?;
        check_nonnegative("residual_tolerance", self.residual_tolerance)
    }
}

/// Accepts finite numbers of at least zero.
pub(crate) fn check_nonnegative(what: &'static str, value: f64) -> Result<(), KktError> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(KktError::Negative { what, value }) }
}
