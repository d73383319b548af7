//! Hyper-dual numbers in lanes: lane `l` carries the second derivative along its own pair of directions
//! (Fike & Alonso 2011, doi 10.2514/6.2011-886). One pass gives `L` entries of a Hessian.

// Product and quotient rules mix operators by nature.
#![allow(clippy::suspicious_arithmetic_impl)]

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Scalar, branches, derived_operators};

/// A value with, per lane, two first derivatives and their mixed second derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HyperDual<const L: usize> {
    /// The value, shared by all lanes.
    pub re: f64,
    /// Derivative along the first direction of each lane.
    pub e1: [f64; L],
    /// Derivative along the second direction of each lane.
    pub e2: [f64; L],
    /// Second derivative along both directions of each lane.
    pub e12: [f64; L],
}

impl<const L: usize> HyperDual<L> {
    /// A constant: all derivatives zero.
    #[inline]
    #[must_use]
    pub fn constant(re: f64) -> Self {
        Self { re, e1: [0.0; L], e2: [0.0; L], e12: [0.0; L] }
    }

    /// Composition of one variable, given `[g, g', g'']`.
    #[inline]
    fn chain(&self, [v, d, dd]: [f64; 3]) -> Self {
        Self {
            re: v,
            e1: self.e1.map(|e| d * e),
            e2: self.e2.map(|e| d * e),
            e12: std::array::from_fn(|k| d * self.e12[k] + dd * self.e1[k] * self.e2[k]),
        }
    }
}

impl<const L: usize> From<f64> for HyperDual<L> {
    #[inline]
    fn from(re: f64) -> Self {
        Self::constant(re)
    }
}

impl<const L: usize> Neg for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl<const L: usize> Add for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self {
            re: self.re + o.re,
            e1: std::array::from_fn(|k| self.e1[k] + o.e1[k]),
            e2: std::array::from_fn(|k| self.e2[k] + o.e2[k]),
            e12: std::array::from_fn(|k| self.e12[k] + o.e12[k]),
        }
    }
}

impl<const L: usize> Sub for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self {
            re: self.re - o.re,
            e1: std::array::from_fn(|k| self.e1[k] - o.e1[k]),
            e2: std::array::from_fn(|k| self.e2[k] - o.e2[k]),
            e12: std::array::from_fn(|k| self.e12[k] - o.e12[k]),
        }
    }
}

impl<const L: usize> Mul for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self {
            re: self.re * o.re,
            e1: std::array::from_fn(|k| self.re * o.e1[k] + self.e1[k] * o.re),
            e2: std::array::from_fn(|k| self.re * o.e2[k] + self.e2[k] * o.re),
            e12: std::array::from_fn(|k| {
                self.re * o.e12[k] + self.e12[k] * o.re + self.e1[k] * o.e2[k] + self.e2[k] * o.e1[k]
            }),
        }
    }
}

impl<const L: usize> Div for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        self * o.recip()
    }
}

impl<const L: usize> Add<f64> for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn add(self, o: f64) -> Self {
        Self { re: self.re + o, ..self }
    }
}

impl<const L: usize> Mul<f64> for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn mul(self, o: f64) -> Self {
        Self {
            re: self.re * o,
            e1: self.e1.map(|e| e * o),
            e2: self.e2.map(|e| e * o),
            e12: self.e12.map(|e| e * o),
        }
    }
}

impl<const L: usize> Div<f64> for HyperDual<L> {
    type Output = Self;
    #[inline]
    fn div(self, o: f64) -> Self {
        self * (1.0 / o)
    }
}

derived_operators!([const L: usize] HyperDual<L>);

impl<const L: usize> Scalar for HyperDual<L> {
    #[inline]
    fn map(self, g: impl Fn(f64) -> [f64; 3]) -> Self {
        self.chain(g(self.re))
    }

    #[inline]
    fn map2(self, o: Self, g: impl Fn(f64, f64) -> [f64; 6]) -> Self {
        let [v, gx, gy, gxx, gxy, gyy] = g(self.re, o.re);
        Self {
            re: v,
            e1: std::array::from_fn(|k| gx * self.e1[k] + gy * o.e1[k]),
            e2: std::array::from_fn(|k| gx * self.e2[k] + gy * o.e2[k]),
            e12: std::array::from_fn(|k| {
                gx * self.e12[k]
                    + gy * o.e12[k]
                    + gxx * self.e1[k] * self.e2[k]
                    + gxy * (self.e1[k] * o.e2[k] + o.e1[k] * self.e2[k])
                    + gyy * o.e1[k] * o.e2[k]
            }),
        }
    }

    #[inline]
    fn map_all<const K: usize>(self, g: impl Fn(f64) -> [[f64; 3]; K]) -> [Self; K] {
        g(self.re).map(|jet| self.map(|_| jet))
    }

    #[inline]
    fn map2_all<const K: usize>(self, o: Self, g: impl Fn(f64, f64) -> [[f64; 6]; K]) -> [Self; K] {
        g(self.re, o.re).map(|jet| self.map2(o, |_, _| jet))
    }

    branches!(|x| x.re);
}
