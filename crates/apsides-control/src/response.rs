//! Frequency response of one channel, at many frequencies.

use nalgebra::linalg::Hessenberg;
use nalgebra::{Complex, DMatrix};

use crate::state_space::StateSpace;

/// The response of one channel. The state matrix is brought to Hessenberg form once, so that a frequency takes the square of the number of
/// states, not its cube: delays make many states.
#[derive(Clone, Debug)]
pub(crate) struct Response {
    /// Upper Hessenberg matrix.
    a: DMatrix<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: f64,
    sample_time: Option<f64>,
}

impl Response {
    pub(crate) fn new(system: &StateSpace, input: usize, output: usize) -> Self {
        let (b, c) = (system.b.column(input), system.c.row(output));
        let (d, sample_time) = (system.d[(output, input)], system.sample_time);
        // Two states are in this form as they are; without states there is nothing to bring to it.
        if system.a.nrows() <= 2 {
            let [b, c] = [b.iter().copied().collect(), c.iter().copied().collect()];
            return Self { a: system.a.clone(), b, c, d, sample_time };
        }
        let (turn, a) = Hessenberg::new(system.a.clone()).unpack();
        let [b, c] = [turn.tr_mul(&b), turn.tr_mul(&c.transpose())].map(|v| v.iter().copied().collect());
        Self { a, b, c, d, sample_time }
    }

    /// The response at a frequency, rad/s; NaN at a pole.
    pub(crate) fn at(&self, frequency: f64) -> Complex<f64> {
        let point = match self.sample_time {
            Some(time) => Complex::new(0.0, frequency * time).exp(),
            None => Complex::new(0.0, frequency),
        };
        let n = self.a.nrows();
        let mut m = DMatrix::from_fn(n, n, |i, j| {
            let diagonal = if i == j { point } else { Complex::new(0.0, 0.0) };
            diagonal - Complex::from(self.a[(i, j)])
        });
        let mut x: Vec<Complex<f64>> = self.b.iter().copied().map(Complex::from).collect();
        // Elimination of the subdiagonal, with the larger of two neighbouring rows as the pivot.
        for k in 1..n {
            if m[(k, k - 1)].norm_sqr() > m[(k - 1, k - 1)].norm_sqr() {
                m.swap_rows(k - 1, k);
                x.swap(k - 1, k);
            }
            let factor = m[(k, k - 1)] / m[(k - 1, k - 1)];
            if factor.norm_sqr() > 0.0 {
                for j in k..n {
                    let above = m[(k - 1, j)];
                    m[(k, j)] -= factor * above;
                }
                let above = x[k - 1];
                x[k] -= factor * above;
            }
        }
        for k in (0..n).rev() {
            let known: Complex<f64> = (k + 1..n).map(|j| m[(k, j)] * x[j]).sum();
            let pivot = m[(k, k)];
            if pivot.norm_sqr() == 0.0 {
                return Complex::new(f64::NAN, f64::NAN);
            }
            x[k] = (x[k] - known) / pivot;
        }
        x.iter().zip(&self.c).map(|(x, c)| x * c).sum::<Complex<f64>>() + self.d
    }
}
