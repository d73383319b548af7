//! Right-hand sides that are treated at once.

/// Most right-hand sides that are solved with at once.
pub(crate) const MOST_COLUMNS: usize = 2;

/// The first `R` of some columns.
pub(crate) fn first_columns<const R: usize>(columns: &mut [Vec<f64>; MOST_COLUMNS]) -> [&mut [f64]; R] {
    columns_from(columns, 0)
}

/// `R` columns from number `first`.
#[expect(clippy::expect_used, reason = "invariant: no more columns than there are")]
pub(crate) fn columns_from<const R: usize>(
    columns: &mut [Vec<f64>; MOST_COLUMNS],
    first: usize,
) -> [&mut [f64]; R] {
    const { assert!(R <= MOST_COLUMNS) };
    columns[first..]
        .first_chunk_mut()
        .expect("invariant: no more columns than there are")
        .each_mut()
        .map(|column| &mut column[..])
}
