//! Six functions of any dimension, least value 0.
//!
//! Definitions, factors and offsets are those of the basic functions and of the shifted and rotated ones of CEC 2014
//! (Liang, Qu, Suganthan 2013, Problem Definitions and Evaluation Criteria for the CEC 2014 Special Session, sections 1.1
//! and 1.4; the sphere is function 1 of CEC 2013): arguments `x` in `[-100, 100]` become `z = factor M (x - o) + offset`.

use std::f64::consts::{E, TAU};

/// One of the functions, of `z`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Landscape {
    /// `sum z_i^2`.
    Sphere,
    /// `sum 100 (z_i^2 - z_(i+1))^2 + (z_i - 1)^2`: a curved valley; from 4 dimensions on a second local minimum.
    Rosenbrock,
    /// `sum z_i^2 - 10 cos(2 pi z_i) + 10`: local minima on a lattice, in a wide bowl.
    Rastrigin,
    /// `1 + sum z_i^2 / 4000 - prod cos(z_i / sqrt(i))`: small waves on a wide bowl.
    Griewank,
    /// `418.98 n - sum z_i sin(sqrt(abs(z_i)))` for `abs(z_i) <= 500`, continued by its mirror image and a small
    /// penalty: the best local minima are far apart.
    Schwefel,
    /// `20 - 20 exp(-0.2 sqrt(sum z_i^2 / n)) + e - exp(sum cos(2 pi z_i) / n)`: a narrow hole in a wavy plain.
    Ackley,
}

/// Position and value of the maximum of `z sin(sqrt(z))` on `[0, 500]`: root of `2 tan(s) = -s`, `s = sqrt(z)`.
const SCHWEFEL_POINT: f64 = 420.968_746_359_982;
const SCHWEFEL_VALUE: f64 = 418.982_887_272_433_8;

impl Landscape {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Sphere, Self::Rosenbrock, Self::Rastrigin, Self::Griewank, Self::Schwefel, Self::Ackley];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Rosenbrock => "rosenbrock",
            Self::Rastrigin => "rastrigin",
            Self::Griewank => "griewank",
            Self::Schwefel => "schwefel",
            Self::Ackley => "ackley",
        }
    }

    /// Returns the factor by which the box `[-100, 100]` is scaled.
    #[must_use]
    pub fn factor(self) -> f64 {
        match self {
            Self::Sphere | Self::Ackley => 1.0,
            Self::Rosenbrock => 0.02048,
            Self::Rastrigin => 0.0512,
            Self::Griewank => 6.0,
            Self::Schwefel => 10.0,
        }
    }

    /// Every component of `z` at the minimum.
    #[must_use]
    pub fn offset(self) -> f64 {
        match self {
            Self::Rosenbrock => 1.0,
            Self::Schwefel => SCHWEFEL_POINT,
            _ => 0.0,
        }
    }

    /// The value at `z`, at least one component.
    #[must_use]
    pub fn value(self, z: &[f64]) -> f64 {
        self.of_components(z.len(), |i| z[i])
    }

    /// The value at `n` components, each asked for once and in order.
    pub(super) fn of_components(self, n: usize, mut z: impl FnMut(usize) -> f64) -> f64 {
        match self {
            Self::Sphere => (0..n).map(|i| z(i).powi(2)).sum(),
            Self::Rosenbrock => {
                let (mut sum, mut here) = (0.0, z(0));
                for i in 1..n {
                    let next = z(i);
                    sum += 100.0 * (here * here - next).powi(2) + (here - 1.0).powi(2);
                    here = next;
                }
                sum
            }
            Self::Rastrigin => (0..n)
                .map(|i| {
                    let v = z(i);
                    v * v - 10.0 * (TAU * v).cos() + 10.0
                })
                .sum(),
            Self::Griewank => {
                let (mut sum, mut product) = (0.0, 1.0);
                for i in 0..n {
                    let v = z(i);
                    sum += v * v;
                    product *= (v / ((i + 1) as f64).sqrt()).cos();
                }
                1.0 + sum / 4000.0 - product
            }
            Self::Schwefel => (0..n).map(|i| SCHWEFEL_VALUE - schwefel(z(i), n)).sum(),
            Self::Ackley => {
                let (mut squares, mut cosines) = (0.0, 0.0);
                for i in 0..n {
                    let v = z(i);
                    squares += v * v;
                    cosines += (TAU * v).cos();
                }
                let n = n as f64;
                -20.0 * ((-0.2 * (squares / n).sqrt()).exp() - 1.0) + (E - (cosines / n).exp())
            }
        }
    }
}

/// One term of the function of Schwefel with its continuation outside of `[-500, 500]`.
fn schwefel(z: f64, n: usize) -> f64 {
    let size = z.abs();
    if size <= 500.0 {
        return z * size.sqrt().sin();
    }
    let mirrored = 500.0 - size % 500.0;
    let penalty = (size - 500.0).powi(2) / (10_000.0 * n as f64);
    z.signum() * mirrored * mirrored.sqrt().sin() - penalty
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-11;

    /// Discretisation: what the function changes over 1e-7.
    const ACROSS_THE_END: f64 = 1e-5;

    #[test]
    fn the_least_value_is_0_at_the_offset() {
        for landscape in Landscape::ALL {
            for n in [1, 2, 10, 30] {
                let z = vec![landscape.offset(); n];
                let least = landscape.value(&z);
                assert!(least.abs() < ROUNDING, "{landscape:?} {n}: {least:e}");
                // Every direction goes up, the diagonal too.
                for i in 0..=n {
                    for step in [-1e-3, 1e-3] {
                        let mut near = z.clone();
                        for (k, v) in near.iter_mut().enumerate() {
                            *v += if i == k || i == n { step } else { 0.0 };
                        }
                        // One component of the valley is on its own: nothing to see.
                        let flat = landscape == Landscape::Rosenbrock && n == 1;
                        assert!(flat || landscape.value(&near) > least, "{landscape:?} {n} {i}");
                    }
                }
            }
        }
    }

    #[test]
    fn values_by_hand() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 0.1 * ROUNDING * b.abs().max(1.0), "{a} {b}");
        near(Landscape::Sphere.value(&[3.0, -4.0]), 25.0);
        near(Landscape::Rosenbrock.value(&[-1.2, 1.0]), 24.2);
        near(Landscape::Rosenbrock.value(&[0.0, 0.0, 0.0]), 2.0);
        near(Landscape::Rastrigin.value(&[0.5, 1.0]), 0.25 + 20.0 + 1.0);
        let pi = std::f64::consts::PI;
        near(Landscape::Griewank.value(&[pi, 0.0]), 2.0 + pi * pi / 4000.0);
        near(Landscape::Schwefel.value(&[0.0, 0.0]), 2.0 * SCHWEFEL_VALUE);
        near(
            Landscape::Ackley.value(&[1.0, 1.0]),
            20.0 - 20.0 * (-0.2_f64).exp(), // 3.6254
        );
    }

    #[test]
    fn schwefel_continues_without_a_jump() {
        // At the end of the interval, and the mirror image of the minimum with its penalty of 79.03^2 / 10000 n.
        for side in [-1.0, 1.0] {
            assert!((schwefel(side * 500.0, 2) - schwefel(side * 500.000_000_1, 2)).abs() < ACROSS_THE_END);
        }
        let mirrored = schwefel(1000.0 - SCHWEFEL_POINT, 2);
        let penalty = (500.0 - SCHWEFEL_POINT).powi(2) / 20_000.0;
        assert!((mirrored - (SCHWEFEL_VALUE - penalty)).abs() < 10.0 * ROUNDING);
    }
}
