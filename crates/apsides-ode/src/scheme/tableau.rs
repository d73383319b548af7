//! A pair as its Butcher tableau, for the discrete map and its derivatives.

/// The explicit scheme `k_i = f(t + c_i h, x + h sum_j a_ij k_j)`, `x+ = x + h sum_i b_i k_i`; non-zero entries alone.
#[derive(Debug, Clone)]
pub(crate) struct Tableau {
    pub(crate) order: i32,
    /// Abscissae, one per stage.
    pub(crate) c: Vec<f64>,
    /// Per stage, the earlier stages and their coefficients.
    pub(crate) a: Vec<Vec<(usize, f64)>>,
    /// Stages and their weights.
    pub(crate) b: Vec<(usize, f64)>,
}

/// Stages, counted from zero, and their coefficients.
type Row<'a> = (&'a [usize], &'a [f64]);

impl Tableau {
    /// Rows of `a` from the second stage on.
    pub(super) fn new(order: i32, c: &[f64], a: &[Row<'_>], b: Row<'_>) -> Self {
        let row = |(stages, values): Row<'_>| stages.iter().copied().zip(values.iter().copied()).collect();
        let mut rows = vec![Vec::new()];
        rows.extend(a.iter().map(|r| row(*r)));
        Self { order, c: c.to_vec(), a: rows, b: row(b) }
    }

    pub(crate) fn stages(&self) -> usize {
        self.c.len()
    }
}
