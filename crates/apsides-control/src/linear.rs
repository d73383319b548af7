//! Linear plants `dx' = A dx + B du` of equations of motion at a state, with exact derivatives.

use apsides_ad::{Dual, Dynamics, VectorFunction};
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{DMatrix, Schur};

use crate::error::{ControlError, positive};
use crate::matrix::{finite, from_rows, held_input, to_rows};

/// Directions that one evaluation differentiates along.
const LANES: usize = 4;
/// Most iterations for the eigenvalues of a small matrix.
const MAX_ITERATIONS: usize = 10_000;

/// A linear plant of `NX` states and `NU` controls; continuous, or of one sample where it comes from [`Plant::sampled`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant<const NX: usize, const NU: usize> {
    /// States by states.
    pub a: [[f64; NX]; NX],
    /// States by controls.
    pub b: [[f64; NU]; NX],
}

impl<const NX: usize, const NU: usize> Plant<NX, NU> {
    /// The plant over one sample with the control held: `x+ = exp(A T) x + integral of exp(A s) B ds u`.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where the sample time (s) is not positive or a number is not finite.
    pub fn sampled(&self, sample_time: f64) -> Result<Self, ControlError> {
        positive("sample time in s", sample_time)?;
        let a = finite("state matrix of the plant", from_rows(&self.a))?;
        let b = finite("control matrix of the plant", from_rows(&self.b))?;
        let (a, b) = held_input(&a, &b, sample_time)?;
        Ok(Self { a: to_rows(&a), b: to_rows(&b) })
    }

    /// Some of the states alone, in this order: the others are taken as they are.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where a state is out of range.
    pub fn reduced<const M: usize>(&self, states: [usize; M]) -> Result<Plant<M, NU>, ControlError> {
        match states.iter().find(|&&s| s >= NX) {
            Some(&found) => Err(ControlError::Dimension { what: "state of the plant", expected: NX, found }),
            None => Ok(Plant {
                a: std::array::from_fn(|i| std::array::from_fn(|j| self.a[states[i]][states[j]])),
                b: std::array::from_fn(|i| self.b[states[i]]),
            }),
        }
    }

    /// Eigenvalues of `A`, in the order of [`eigenvalues`].
    ///
    /// # Errors
    /// As [`eigenvalues`].
    pub fn eigenvalues(&self) -> Result<Vec<Eigenvalue>, ControlError> {
        eigenvalues(&self.a)
    }
}

/// The plant of equations of motion at a time, state and control; NaN where the rate has no derivative there.
#[must_use]
pub fn linearise<D: Dynamics<NX, NU>, const NX: usize, const NU: usize>(
    model: &D,
    t: f64,
    x: &[f64; NX],
    u: &[f64; NU],
) -> Plant<NX, NU> {
    let (mut a, mut b) = ([[0.0; NX]; NX], [[0.0; NU]; NX]);
    for first in (0..NX + NU).step_by(LANES) {
        let seed = |k: usize, value: f64| match k.checked_sub(first) {
            Some(lane) => Dual::<LANES>::variable(value, lane),
            None => Dual::constant(value),
        };
        let xs = std::array::from_fn(|k| seed(k, x[k]));
        let us = std::array::from_fn(|k| seed(NX + k, u[k]));
        let rate = model.rate(Dual::constant(t), &xs, &us, &[]);
        for (i, r) in rate.iter().enumerate() {
            for (lane, derivative) in r.eps.iter().enumerate() {
                match first + lane {
                    k if k < NX => a[i][k] = *derivative,
                    k if k < NX + NU => b[i][k - NX] = *derivative,
                    _ => {}
                }
            }
        }
    }
    Plant { a, b }
}

/// Derivatives of quantities that follow from a state, such as angle of attack and sideslip: quantities by states.
#[must_use]
pub fn jacobian<V: VectorFunction<N, M>, const N: usize, const M: usize>(
    function: &V,
    x: &[f64; N],
) -> [[f64; N]; M] {
    let mut rows = [[0.0; N]; M];
    for k in 0..N {
        let seeded =
            std::array::from_fn(|j| if j == k { Dual::<1>::variable(x[j], 0) } else { Dual::constant(x[j]) });
        for (row, value) in rows.iter_mut().zip(function.evaluate(&seeded)) {
            row[k] = value.eps[0];
        }
    }
    rows
}

/// An eigenvalue, real and imaginary part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eigenvalue {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Eigenvalue {
    /// Undamped frequency of a continuous mode, rad/s where time is in s.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Damping ratio of a continuous mode.
    #[must_use]
    pub fn damping(&self) -> f64 {
        -self.re / self.frequency()
    }

    /// The continuous mode that a mode `z` seen every `sample_time` (s) is of: `ln z / T`, its imaginary part above `-pi / T` and up to
    /// `pi / T`. The real part is negative infinity where `z` is 0.
    #[must_use]
    pub fn continuous(&self, sample_time: f64) -> Self {
        // A negative zero would turn the angle of a negative number.
        Self { re: self.frequency().ln() / sample_time, im: (self.im + 0.0).atan2(self.re) / sample_time }
    }
}

/// Eigenvalues of a matrix, by real part, then by imaginary part.
///
/// # Errors
/// [`ControlError::Parameter`] where an entry is not finite, [`ControlError::Eigenvalues`] where the iteration does not converge.
pub fn eigenvalues<const N: usize>(a: &[[f64; N]; N]) -> Result<Vec<Eigenvalue>, ControlError> {
    eigenvalues_of("a matrix", &from_rows(a))
}

/// See [`eigenvalues`].
pub(crate) fn eigenvalues_of(what: &'static str, a: &DMatrix<f64>) -> Result<Vec<Eigenvalue>, ControlError> {
    let mut balanced = finite(what, a.clone())?;
    if balanced.is_empty() {
        return Ok(Vec::new());
    }
    balance_parlett_reinsch(&mut balanced);
    let schur = Schur::try_new(balanced, f64::EPSILON, MAX_ITERATIONS);
    let values = schur.ok_or(ControlError::Eigenvalues { what })?.complex_eigenvalues();
    let mut values: Vec<_> = values.iter().map(|c| Eigenvalue { re: c.re, im: c.im }).collect();
    values.sort_by(|p, q| p.re.total_cmp(&q.re).then(p.im.total_cmp(&q.im)));
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use apsides_ad::Scalar;

    /// A few operations on doubles.
    const ROUNDING: f64 = 1e-13;

    /// x'' = -w^2 sin(x) - d x' + u1, y' = x u2 + t.
    struct Pendulum;

    impl Dynamics<3, 2> for Pendulum {
        fn rate<S: Scalar>(&self, t: S, x: &[S; 3], u: &[S; 2], _p: &[S; 0]) -> [S; 3] {
            [x[1], u[0] - x[0].sin() * 4.0 - x[1] * 0.4, x[0] * u[1] + t]
        }
    }

    #[test]
    fn derivatives_by_hand() {
        let plant = linearise(&Pendulum, 1.0, &[0.3, 0.0, 2.0], &[0.5, 7.0]);
        assert_eq!(plant.a[0], [0.0, 1.0, 0.0]);
        assert!((plant.a[1][0] + 4.0 * 0.3_f64.cos()).abs() < ROUNDING);
        assert_eq!((plant.a[1][1], plant.a[2]), (-0.4, [7.0, 0.0, 0.0]));
        assert_eq!(plant.b, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.3]]);
        let small = plant.reduced([1, 0]).unwrap();
        assert_eq!((small.a[1], small.b[0]), ([1.0, 0.0], [1.0, 0.0]));
        assert!(plant.reduced([3]).is_err());
    }

    #[test]
    fn modes_of_an_oscillator() {
        let plant = linearise(&Pendulum, 0.0, &[0.0; 3], &[0.0; 2]).reduced([0, 1]).unwrap();
        // s^2 + 0.4 s + 4: frequency 2, damping 0.1.
        for mode in plant.eigenvalues().unwrap() {
            assert!((mode.frequency() - 2.0).abs() < ROUNDING);
            assert!((mode.damping() - 0.1).abs() < ROUNDING);
        }
        assert!(eigenvalues(&[[f64::NAN]]).is_err());
        let continuous = |re, im| Eigenvalue { re, im }.continuous(0.5);
        assert_eq!(continuous(1.0, 0.0), Eigenvalue { re: 0.0, im: 0.0 });
        assert_eq!(continuous(-1.0, -0.0), Eigenvalue { re: 0.0, im: std::f64::consts::TAU });
        assert_eq!(continuous(0.0, 0.0).re, f64::NEG_INFINITY);
        let (sin, cos) = 0.3_f64.sin_cos();
        let mode = continuous(0.2_f64.exp() * cos, -0.2_f64.exp() * sin);
        assert!((mode.re - 0.4).abs() < ROUNDING && (mode.im + 0.6).abs() < ROUNDING);
        // Scales that differ by ten orders.
        let found = eigenvalues(&[[1.0, 1e10], [1e-10, 1.0]]).unwrap();
        assert!(found[0].re.abs() < ROUNDING && (found[1].re - 2.0).abs() < ROUNDING);
    }

    #[test]
    fn sampled_double_integrator() {
        let plant = Plant { a: [[0.0, 1.0], [0.0, 0.0]], b: [[0.0], [1.0]] }.sampled(0.2).unwrap();
        for (found, expected) in
            [(plant.a[0][1], 0.2), (plant.a[1][1], 1.0), (plant.b[0][0], 0.02), (plant.b[1][0], 0.2)]
        {
            assert!((found - expected).abs() < ROUNDING);
        }
        assert!(plant.sampled(0.0).is_err());
        assert!(Plant { a: [[f64::NAN]], b: [[1.0]] }.sampled(0.1).is_err());
    }

    struct Polar;

    impl VectorFunction<2, 2> for Polar {
        fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 2] {
            [(z[0] * z[0] + z[1] * z[1]).sqrt(), z[1].atan2(z[0])]
        }
    }

    #[test]
    fn jacobian_of_quantities() {
        let found = jacobian(&Polar, &[3.0, 4.0]);
        let expected = [[0.6, 0.8], [-0.16, 0.12]];
        for (f, e) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((f - e).abs() < ROUNDING);
        }
    }
}
