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
        // For k = 0 the "previous" derivative is zero and P_1' = 1 comes out right.
        let next = (legendre_after(k, x, [before.0, current.0]), before.1 + (2 * k + 1) as f64 * current.0);
        before = current;
        current = next;
    }
    (before, current)
}

/// `P_{k+1}` at `x` from `P_{k-1}` and `P_k`.
pub(crate) fn legendre_after(k: usize, x: f64, [before, current]: [f64; 2]) -> f64 {
    ((2 * k + 1) as f64 * x * current - k as f64 * before) / (k + 1) as f64
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
