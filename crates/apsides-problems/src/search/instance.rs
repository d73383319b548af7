//! Random places and axes.

use super::landscape::Landscape;
use super::random::SplitMix;

/// The position of the minimum and the rotation of the axes.
#[derive(Clone, Debug)]
pub struct Transform {
    /// The minimum, each component uniform in `[-80, 80]`.
    pub shift: Vec<f64>,
    /// An orthogonal matrix, row by row, all directions alike.
    pub rotation: Vec<f64>,
}

impl Transform {
    /// The instance `seed` of a dimension: normal numbers made orthonormal row by row.
    ///
    /// Such a matrix has no preferred direction (Stewart 1980, <https://doi.org/10.1137/0717034>).
    #[must_use]
    pub fn seeded(dimension: usize, seed: u64) -> Self {
        let n = dimension;
        let mut random = SplitMix::new(seed);
        let shift = (0..n).map(|_| 160.0 * random.uniform() - 80.0).collect();
        let mut rotation: Vec<f64> = (0..n * n).map(|_| random.normal()).collect();
        for i in 0..n {
            let (above, row) = rotation[..(i + 1) * n].split_at_mut(i * n);
            // Twice, so that the rows stay orthogonal to rounding.
            for _ in 0..2 {
                for other in above.chunks_exact(n) {
                    let along: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                    row.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
                }
            }
            let norm = row.iter().map(|v| v * v).sum::<f64>().sqrt();
            row.iter_mut().for_each(|v| *v /= norm);
        }
        Self { shift, rotation }
    }

    /// Number of variables.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.shift.len()
    }
}

/// A function with its minimum, 0, at the shift of the transform; on the box `[-100, 100]` in each variable.
///
/// ```
/// use apsides_problems::search::{Landscape, ShiftedRotated, Transform};
/// let function = ShiftedRotated { landscape: Landscape::Rastrigin, transform: Transform::seeded(10, 1) };
/// assert!(function.value(&function.transform.shift) < 1e-8);
/// assert!(function.value(&[0.0; 10]) > 1.0);
/// ```
#[derive(Clone, Debug)]
pub struct ShiftedRotated {
    /// The function of `z = factor M (x - o) + offset`.
    pub landscape: Landscape,
    /// `o` and `M`.
    pub transform: Transform,
}

impl ShiftedRotated {
    /// Largest size of every variable.
    pub const BOUND: f64 = 100.0;

    /// The value at `x`. Allocates nothing.
    ///
    /// # Panics
    /// When `x` has not the dimension of the transform.
    #[must_use]
    pub fn value(&self, x: &[f64]) -> f64 {
        let Transform { shift, rotation } = &self.transform;
        let n = shift.len();
        assert_eq!(x.len(), n, "components of x");
        let (factor, offset) = (self.landscape.factor(), self.landscape.offset());
        self.landscape.of_components(n, |i| {
            let row = &rotation[i * n..(i + 1) * n];
            factor * distance_along(row, x, shift) + offset
        })
    }
}

/// `row . (x - o)`, in four sums that a processor adds at once.
fn distance_along(row: &[f64], x: &[f64], o: &[f64]) -> f64 {
    let n = row.len();
    let (x, o) = (&x[..n], &o[..n]);
    let mut sums = [0.0; 4];
    let whole = n - n % 4;
    for k in (0..whole).step_by(4) {
        for lane in 0..4 {
            sums[lane] += row[k + lane] * (x[k + lane] - o[k + lane]);
        }
    }
    let rest: f64 = (whole..n).map(|k| row[k] * (x[k] - o[k])).sum();
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn rows_are_orthonormal() {
        for n in [1, 2, 10, 30] {
            let rotation = Transform::seeded(n, 7).rotation;
            for i in 0..n {
                for j in 0..n {
                    let product: f64 = (0..n).map(|k| rotation[i * n + k] * rotation[j * n + k]).sum();
                    assert!(
                        (product - f64::from(u8::from(i == j))).abs() < ROUNDING,
                        "{n} {i} {j} {product}"
                    );
                }
            }
        }
    }

    #[test]
    fn instances_differ_and_repeat() {
        let (a, b) = (Transform::seeded(10, 1), Transform::seeded(10, 2));
        assert_ne!(a.shift, b.shift);
        assert_eq!(a.rotation, Transform::seeded(10, 1).rotation);
        assert!(a.shift.iter().all(|v| v.abs() < 80.0));
    }

    #[test]
    fn the_minimum_is_at_the_shift() {
        for landscape in Landscape::ALL {
            for n in [2, 10, 30] {
                let transform = Transform::seeded(n, 3);
                let x = transform.shift.clone();
                let function = ShiftedRotated { landscape, transform };
                assert!(
                    function.value(&x).abs() < 1e3 * ROUNDING,
                    "{landscape:?} {n} {:e}",
                    function.value(&x)
                );
                let near: Vec<f64> = x.iter().map(|v| v + 1e-2).collect();
                assert!(function.value(&near) > 1e-5, "{landscape:?} {n}");
            }
        }
    }

    #[test]
    fn the_sphere_does_not_see_the_rotation() {
        let transform = Transform::seeded(10, 3);
        let far: f64 = transform.shift.iter().map(|v| v * v).sum();
        let function = ShiftedRotated { landscape: Landscape::Sphere, transform };
        assert!((function.value(&[0.0; 10]) / far - 1.0).abs() < ROUNDING);
    }
}
