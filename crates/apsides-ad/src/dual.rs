//! First-order dual numbers with `N` derivative lanes: one pass gives `N` columns of a Jacobian.

// Product and quotient rules mix operators by nature.
#![allow(clippy::suspicious_arithmetic_impl)]

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Scalar, branches, derived_operators};

/// A value and its derivatives along `N` directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// The derivative along each direction.
    pub eps: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A constant: all derivatives zero.
    #[inline]
    #[must_use]
    pub fn constant(re: f64) -> Self {
        Self { re, eps: [0.0; N] }
    }

    /// An independent variable, seeded in `lane`; a lane out of range gives a constant.
    #[inline]
    #[must_use]
    pub fn variable(re: f64, lane: usize) -> Self {
        let mut eps = [0.0; N];
        if let Some(e) = eps.get_mut(lane) {
            *e = 1.0;
        }
        Self { re, eps }
    }

    #[inline]
    fn linear(re: f64, a: f64, x: &[f64; N], b: f64, y: &[f64; N]) -> Self {
        Self { re, eps: std::array::from_fn(|k| a * x[k] + b * y[k]) }
    }

    #[inline]
    fn scaled(re: f64, a: f64, x: &[f64; N]) -> Self {
        Self { re, eps: x.map(|e| a * e) }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline]
    fn from(re: f64) -> Self {
        Self::constant(re)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::scaled(-self.re, -1.0, &self.eps)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self { re: self.re + o.re, eps: std::array::from_fn(|k| self.eps[k] + o.eps[k]) }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self { re: self.re - o.re, eps: std::array::from_fn(|k| self.eps[k] - o.eps[k]) }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self::linear(self.re * o.re, o.re, &self.eps, self.re, &o.eps)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let r = 1.0 / o.re;
        let q = self.re * r;
        Self::linear(self.re / o.re, r, &self.eps, -q * r, &o.eps)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, o: f64) -> Self {
        Self { re: self.re + o, eps: self.eps }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: f64) -> Self {
        Self::scaled(self.re * o, o, &self.eps)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, o: f64) -> Self {
        Self::scaled(self.re / o, 1.0 / o, &self.eps)
    }
}

derived_operators!([const N: usize] Dual<N>);

impl<const N: usize> Scalar for Dual<N> {
    const ORDER: usize = 1;

    #[inline]
    fn map(self, g: impl Fn(f64) -> [f64; 3]) -> Self {
        let [v, d, _] = g(self.re);
        Self::scaled(v, d, &self.eps)
    }

    #[inline]
    fn map2(self, other: Self, g: impl Fn(f64, f64) -> [f64; 6]) -> Self {
        let [v, gx, gy, ..] = g(self.re, other.re);
        Self::linear(v, gx, &self.eps, gy, &other.eps)
    }

    #[inline]
    fn map_all<const K: usize>(self, g: impl Fn(f64) -> [[f64; 3]; K]) -> [Self; K] {
        g(self.re).map(|jet| self.map(|_| jet))
    }

    #[inline]
    fn map2_all<const K: usize>(self, other: Self, g: impl Fn(f64, f64) -> [[f64; 6]; K]) -> [Self; K] {
        g(self.re, other.re).map(|jet| self.map2(other, |_, _| jet))
    }

    branches!(|x| x.re);
}
