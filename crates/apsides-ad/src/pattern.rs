//! The structure of Jacobian and Hessian, and a scalar without a value that finds it: the scalar records which inputs
//! reach an output and which pairs of inputs interact nonlinearly, so that one run of the model is enough.

// Product and quotient rules mix operators by nature.
#![allow(clippy::suspicious_arithmetic_impl)]

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Scalar, derived_operators};

/// Most inputs of a function whose pattern can be recorded.
pub const MAX_INPUTS: usize = 64;

/// Structure of a [`NodeFunction`](crate::NodeFunction)'s derivatives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodePattern {
    /// `outputs + 1` offsets into `columns`: the Jacobian by rows.
    pub row_offsets: Vec<usize>,
    /// Input index of each Jacobian entry, ascending within a row.
    pub columns: Vec<usize>,
    /// `(i, j)` with `i >= j`: entries of the lower triangle of the weighted Hessian, in ascending order.
    pub hessian: Vec<(usize, usize)>,
}

impl NodePattern {
    /// Number of Jacobian entries.
    #[must_use]
    pub fn jacobian_len(&self) -> usize {
        self.columns.len()
    }

    /// Number of Hessian entries.
    #[must_use]
    pub fn hessian_len(&self) -> usize {
        self.hessian.len()
    }

    /// `(row, column)` of each Jacobian entry, in the order of the values.
    pub fn jacobian_entries(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.row_offsets.len() - 1).flat_map(move |r| {
            self.columns[self.row_offsets[r]..self.row_offsets[r + 1]].iter().map(move |&c| (r, c))
        })
    }
}

/// Dependence of a quantity on up to [`MAX_INPUTS`] inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dependence {
    /// Bit `i`: the first derivative with respect to input `i` may be non-zero.
    inputs: u64,
    /// Bit `j` of word `i`: the second derivative with respect to inputs `i` and `j` may be non-zero.
    pairs: [u64; MAX_INPUTS],
}

impl Dependence {
    /// The input of index `i < MAX_INPUTS`.
    #[must_use]
    pub fn input(i: usize) -> Self {
        debug_assert!(i < MAX_INPUTS);
        Self { inputs: 1 << i, pairs: [0; MAX_INPUTS] }
    }

    /// Returns true if the first derivative with respect to input `i` may be non-zero.
    #[must_use]
    pub fn depends_on(&self, i: usize) -> bool {
        self.inputs >> i & 1 == 1
    }

    /// Returns true if the second derivative with respect to inputs `i` and `j` may be non-zero.
    #[must_use]
    pub fn is_nonlinear_in(&self, i: usize, j: usize) -> bool {
        self.pairs[i] >> j & 1 == 1
    }

    fn union(mut self, o: &Self) -> Self {
        self.inputs |= o.inputs;
        for (a, b) in self.pairs.iter_mut().zip(&o.pairs) {
            *a |= b;
        }
        self
    }

    /// Adds the pairs with one member in `a` and one in `b`.
    fn cross(mut self, a: u64, b: u64) -> Self {
        for (i, row) in self.pairs.iter_mut().enumerate() {
            if a >> i & 1 == 1 {
                *row |= b;
            }
            if b >> i & 1 == 1 {
                *row |= a;
            }
        }
        self
    }
}

impl From<f64> for Dependence {
    fn from(_: f64) -> Self {
        Self { inputs: 0, pairs: [0; MAX_INPUTS] }
    }
}

impl Neg for Dependence {
    type Output = Self;
    fn neg(self) -> Self {
        self
    }
}

impl Add for Dependence {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        self.union(&o)
    }
}

impl Sub for Dependence {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self.union(&o)
    }
}

impl Mul for Dependence {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        self.union(&o).cross(self.inputs, o.inputs)
    }
}

impl Div for Dependence {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        self.union(&o).cross(self.inputs, o.inputs).cross(o.inputs, o.inputs)
    }
}

impl Add<f64> for Dependence {
    type Output = Self;
    fn add(self, _: f64) -> Self {
        self
    }
}

impl Mul<f64> for Dependence {
    type Output = Self;
    // A factor of zero may be a parameter that changes later: the entry stays in the pattern.
    fn mul(self, _: f64) -> Self {
        self
    }
}

impl Div<f64> for Dependence {
    type Output = Self;
    fn div(self, _: f64) -> Self {
        self
    }
}

derived_operators!([] Dependence);

impl Scalar for Dependence {
    fn map(self, _: impl Fn(f64) -> [f64; 3]) -> Self {
        self.cross(self.inputs, self.inputs)
    }

    fn map2(self, other: Self, _: impl Fn(f64, f64) -> [f64; 6]) -> Self {
        let all = self.inputs | other.inputs;
        self.union(&other).cross(all, all)
    }

    // One side or the other, of which each is linear.
    fn abs(self) -> Self {
        self
    }

    fn sign(self) -> Self {
        Self::from(0.0)
    }

    fn min(self, other: Self) -> Self {
        self.union(&other)
    }

    fn max(self, other: Self) -> Self {
        self.union(&other)
    }

    fn select(self, a: Self, b: Self) -> Self {
        a.union(&b)
    }
}
