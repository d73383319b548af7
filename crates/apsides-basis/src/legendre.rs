//! Legendre polynomials and their derivatives.

use crate::double::Double;

/// Legendre polynomial of degree `n` at `x`: `(P_n(x), P_n'(x))`.
///
/// Three-term recurrence for the value, `P'_{k+1} = P'_{k-1} + (2 k + 1) P_k` for the derivative, so the ends
/// `x = -1` and `x = 1` need no special case. Accurate for `|x| <= 1`.
pub fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (_, current) = legendre_pair(n, x);
    current
}

/// `((P_{n-1}, P'_{n-1}), (P_n, P'_n))` at `x`; the first pair is zero for `n = 0`.
pub(crate) fn legendre_pair(n: usize, x: f64) -> ((f64, f64), (f64, f64)) {
    let mut before = (0.0, 0.0);
    let mut current = (1.0, 0.0);
    for k in 0..n {
        let k2 = (2 * k + 1) as f64;
        let next = (
            (k2 * x * current.0 - k as f64 * before.0) / (k + 1) as f64,
            // For k = 0 the "previous" derivative is zero and P_1' = 1 comes out right.
            before.1 + k2 * current.0,
        );
        before = current;
        current = next;
    }
    (before, current)
}

/// `(P_{n-1}, P_n)` at `x` in twice the working precision, for the roots of combinations of the two; `n >= 1`.
pub(crate) fn legendre_double(n: usize, x: f64) -> (Double, Double) {
    let mut before = Double::new(0.0);
    let mut current = Double::new(1.0);
    for k in 0..n {
        let next =
            current.times(x).times((2 * k + 1) as f64).plus(before.times(-(k as f64))).over((k + 1) as f64);
        before = current;
        current = next;
    }
    (before, current)
}
