//! Small dense matrices between arrays and the linear algebra library.

use nalgebra::DMatrix;

use crate::error::ControlError;

/// A matrix of rows.
pub(crate) fn from_rows<const R: usize, const C: usize>(rows: &[[f64; C]; R]) -> DMatrix<f64> {
    DMatrix::from_fn(R, C, |i, j| rows[i][j])
}

/// Rows of a matrix of this size.
pub(crate) fn to_rows<const R: usize, const C: usize>(m: &DMatrix<f64>) -> [[f64; C]; R] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

/// Passes a matrix of finite numbers on.
pub(crate) fn finite(what: &'static str, m: DMatrix<f64>) -> Result<DMatrix<f64>, ControlError> {
    match m.iter().find(|v| !v.is_finite()) {
        Some(&value) => Err(ControlError::Parameter { what, value, allowed: "a finite number" }),
        None => Ok(m),
    }
}

/// The inverse.
pub(crate) fn inverse(what: &'static str, m: DMatrix<f64>) -> Result<DMatrix<f64>, ControlError> {
    m.try_inverse().filter(|i| i.iter().all(|v| v.is_finite())).ok_or(ControlError::Singular { what })
}

/// The symmetric part, which round-off leaves.
pub(crate) fn symmetric(m: &DMatrix<f64>) -> DMatrix<f64> {
    (m + m.transpose()) * 0.5
}

/// Transition over `time` with the input held: `(exp(A t), integral of exp(A s) B ds)`, both from the exponential of one block matrix
/// (C. F. Van Loan, *IEEE Trans. Autom. Control* 23 (1978) 395, doi 10.1109/TAC.1978.1101743).
pub(crate) fn held_input(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    time: f64,
) -> Result<(DMatrix<f64>, DMatrix<f64>), ControlError> {
    let (n, m) = (a.nrows(), b.ncols());
    let mut block = DMatrix::zeros(n + m, n + m);
    block.view_mut((0, 0), (n, n)).copy_from(&(a * time));
    block.view_mut((0, n), (n, m)).copy_from(&(b * time));
    let e = finite("transition over a sample", finite("a plant times its sample time", block)?.exp())?;
    Ok((e.view((0, 0), (n, n)).into_owned(), e.view((0, n), (n, m)).into_owned()))
}
