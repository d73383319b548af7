//! From the inputs of a node function to those of a segment, by the chain rule to second order.
//!
//! A segment depends on `v = (x_0, c, p, t0, tf)`: the state at its start, the values of its controls at their points, the static
//! parameters and the times of the phase. At the normalised time `s` of the segment a node function takes `x(s; v)` with a given
//! sensitivity, `u = sum_l L_l(s) c_l`, `p` and `t = (1 - f) t0 + f tf`, `f` the fraction of the phase. Rates are multiplied by the
//! duration `tf - t0`, the last of the local quantities `(x, u, p, t, tf - t0)`. Where the ends of the segment are unknowns, `t0` and
//! `tf` are these, and the segment is the whole from 0 to 1.

use std::sync::Arc;

use apsides_ad::{NodeFunction, NodePattern};
use apsides_basis::Barycentric;
use pulp::{Arch, Simd, WithSimd};

/// Sizes and places of one segment, and the chain rule at one time of it.
#[derive(Clone)]
pub(crate) struct Chain {
    pub(crate) states: usize,
    pub(crate) controls: usize,
    pub(crate) parameters: usize,
    /// Control points on [-1, 1].
    pub(crate) basis: Arc<Barycentric>,
    /// Fraction of the phase at the start of the segment, and its width.
    pub(crate) start: f64,
    pub(crate) width: f64,
    /// The time that was set: fraction of the phase, Lagrange polynomials of the control points.
    fraction: f64,
    lagrange: Vec<f64>,
    /// Hessian in the local quantities, full, and its products with their sensitivities.
    local: Vec<f64>,
    products: Vec<f64>,
    weighted: Vec<f64>,
    slope: Vec<f64>,
    arch: Arch,
}

/// The factor of a node function: a rate is multiplied by the duration of the phase.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum TermKind {
    Rate,
    Plain,
}

impl Chain {
    pub(crate) fn new(
        (states, controls, parameters): (usize, usize, usize),
        basis: Arc<Barycentric>,
        start: f64,
        width: f64,
    ) -> Self {
        let quantities = states + controls + parameters + 2;
        let points = basis.nodes().len();
        let columns = states + points * controls + parameters + 2;
        Self {
            states,
            controls,
            parameters,
            start,
            width,
            fraction: start,
            lagrange: vec![0.0; points],
            local: vec![0.0; quantities * quantities],
            products: vec![0.0; quantities * columns],
            weighted: Vec::new(),
            slope: vec![0.0; quantities],
            arch: Arch::new(),
            basis,
        }
    }

    /// Storage for the Hessians of a function.
    pub(crate) fn admit(&mut self, function: &dyn NodeFunction) {
        let length = self.weighted.len().max(function.pattern().hessian_len());
        self.weighted.resize(length, 0.0);
    }

    /// Inputs `c`, `p`, `t0`, `tf`.
    pub(crate) fn inputs(&self) -> usize {
        self.lagrange.len() * self.controls + self.parameters + 2
    }

    /// Number of `v`.
    pub(crate) fn columns(&self) -> usize {
        self.states + self.inputs()
    }

    /// Local quantities.
    pub(crate) fn quantities(&self) -> usize {
        self.states + self.controls + self.parameters + 2
    }

    pub(crate) fn duration(&self, w: &[f64]) -> f64 {
        w[w.len() - 1] - w[w.len() - 2]
    }

    /// Sets the normalised time of the segment, from 0 to 1.
    pub(crate) fn set(&mut self, s: f64) {
        self.fraction = self.start + s * self.width;
        self.basis.basis(2.0 * s - 1.0, &mut self.lagrange);
    }

    /// Inputs `[x, u, p, t]` of a node function; the parameters only if it takes them.
    pub(crate) fn fill(&self, x: &[f64], w: &[f64], z: &mut [f64]) {
        let (nx, nu) = (self.states, self.controls);
        z[..nx].copy_from_slice(x);
        for (k, u) in z[nx..nx + nu].iter_mut().enumerate() {
            *u = self.lagrange.iter().zip(w.iter().skip(k).step_by(nu)).map(|(l, c)| l * c).sum();
        }
        let time = z.len() - 1;
        let parameters = self.lagrange.len() * nu;
        z[nx + nu..time].copy_from_slice(&w[parameters..][..time - nx - nu]);
        let (t0, tf) = (w[w.len() - 2], w[w.len() - 1]);
        z[time] = (1.0 - self.fraction) * t0 + self.fraction * tf;
    }

    /// Local quantity of an input of a node function with so many inputs.
    fn quantity(&self, input: usize, inputs: usize) -> usize {
        if input + 1 == inputs { self.quantities() - 2 } else { input }
    }

    /// Adds `factor` times the derivative of a local quantity by `v`.
    #[inline(always)]
    fn add_quantity(&self, quantity: usize, factor: f64, sensitivity: &[f64], out: &mut [f64]) {
        let (nx, nu, columns) = (self.states, self.controls, self.columns());
        if quantity < nx {
            for (o, s) in out.iter_mut().zip(&sensitivity[quantity * columns..][..columns]) {
                *o += factor * s;
            }
            return;
        }
        self.each_direct(quantity - nx, nu, columns, |column, d| out[column] += factor * d);
    }

    /// `emit(column, derivative)` for the quantities after the states.
    #[inline(always)]
    fn each_direct(&self, after: usize, nu: usize, columns: usize, mut emit: impl FnMut(usize, f64)) {
        let points = self.lagrange.len();
        if after < nu {
            for (l, value) in self.lagrange.iter().enumerate() {
                emit(self.states + l * nu + after, *value);
            }
        } else if after < nu + self.parameters {
            emit(self.states + points * nu + after - nu, 1.0);
        } else if after == nu + self.parameters {
            emit(columns - 2, 1.0 - self.fraction);
            emit(columns - 1, self.fraction);
        } else {
            emit(columns - 2, -1.0);
            emit(columns - 1, 1.0);
        }
    }

    /// Writes the derivatives by `v` of the outputs of a function, `outputs x columns`, from its values and its Jacobian entries
    /// at the time that was set.
    pub(crate) fn rows(
        &self,
        function: &dyn NodeFunction,
        kind: TermKind,
        w: &[f64],
        values: &[f64],
        entries: &[f64],
        sensitivity: &[f64],
        out: &mut [f64],
    ) {
        let factor = self.factor(kind, w);
        let (pattern, inputs, columns) = (function.pattern(), function.inputs(), self.columns());
        self.arch.dispatch(Rows {
            chain: self,
            pattern,
            inputs,
            factor,
            entries,
            sensitivity,
            out: &mut *out,
        });
        if kind == TermKind::Rate {
            for (value, row) in values.iter().zip(out.chunks_exact_mut(columns)) {
                row[columns - 2] -= self.width * value;
                row[columns - 1] += self.width * value;
            }
        }
    }

    /// Factor of the outputs: the derivative by the normalised time of the segment, or one.
    pub(crate) fn factor(&self, kind: TermKind, w: &[f64]) -> f64 {
        match kind {
            TermKind::Rate => self.width * self.duration(w),
            TermKind::Plain => 1.0,
        }
    }

    /// Forgets the local Hessian.
    pub(crate) fn clear(&mut self) {
        self.local.fill(0.0);
    }

    /// Adds the weighted Hessian of a function with the inputs `z` to the local one.
    pub(crate) fn add_local(
        &mut self,
        function: &dyn NodeFunction,
        kind: TermKind,
        w: &[f64],
        z: &[f64],
        entries: &[f64],
        weights: &[f64],
    ) {
        if weights.iter().all(|w| *w == 0.0) {
            return;
        }
        let (pattern, inputs, order) = (function.pattern(), function.inputs(), self.quantities());
        let factor = self.factor(kind, w);
        let weighted = &mut self.weighted[..pattern.hessian_len()];
        function.hessian(z, weights, weighted);
        for (k, &(i, j)) in pattern.hessian.iter().enumerate() {
            let (a, b) = (self.quantity(i, inputs), self.quantity(j, inputs));
            let h = factor * self.weighted[k];
            self.local[a * order + b] += h;
            if a != b {
                self.local[b * order + a] += h;
            }
        }
        if kind == TermKind::Rate {
            self.slope.fill(0.0);
            for ((r, c), v) in pattern.jacobian_entries().zip(entries) {
                let quantity = self.quantity(c, inputs);
                self.slope[quantity] += self.width * weights[r] * v;
            }
            let duration = order - 1;
            for (k, slope) in self.slope[..duration].iter().enumerate() {
                self.local[k * order + duration] += slope;
                self.local[duration * order + k] += slope;
            }
        }
    }

    /// Adds the local Hessian, seen through the sensitivities of all quantities, to a square matrix, of which the lower triangle is to be used.
    pub(crate) fn add_products(&mut self, sensitivity: &[f64], hessian: &mut [f64]) {
        let mut products = std::mem::take(&mut self.products);
        self.arch.dispatch(Products { chain: self, sensitivity, products: &mut products, hessian });
        self.products = products;
    }
}

/// Compiled for the vectors of the machine, which treat the columns alike: what [`Chain::rows`] does for all entries.
struct Rows<'a> {
    chain: &'a Chain,
    pattern: &'a NodePattern,
    inputs: usize,
    factor: f64,
    entries: &'a [f64],
    sensitivity: &'a [f64],
    out: &'a mut [f64],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { chain, pattern, inputs, factor, entries, sensitivity, out } = self;
        let columns = chain.columns();
        out.fill(0.0);
        for ((r, c), v) in pattern.jacobian_entries().zip(entries) {
            let row = &mut out[r * columns..][..columns];
            chain.add_quantity(chain.quantity(c, inputs), factor * v, sensitivity, row);
        }
    }
}

/// The same for [`Chain::add_products`].
struct Products<'a> {
    chain: &'a Chain,
    sensitivity: &'a [f64],
    products: &'a mut [f64],
    hessian: &'a mut [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { chain, sensitivity, products, hessian } = self;
        let (nx, nu, columns, order) = (chain.states, chain.controls, chain.columns(), chain.quantities());
        products.fill(0.0);
        for (row, product) in chain.local.chunks_exact(order).zip(products.chunks_exact_mut(columns)) {
            for (k, h) in row.iter().enumerate() {
                if *h != 0.0 {
                    chain.add_quantity(k, *h, sensitivity, product);
                }
            }
        }
        for (k, product) in products.chunks_exact(columns).enumerate() {
            if chain.local[k * order..][..order].iter().all(|h| *h == 0.0) {
                continue;
            }
            // Whole rows: they are of one length, and short.
            let mut add = |column: usize, factor: f64| {
                for (h, p) in hessian[column * columns..][..columns].iter_mut().zip(product) {
                    *h += factor * p;
                }
            };
            if k < nx {
                for (column, s) in sensitivity[k * columns..][..columns].iter().enumerate() {
                    add(column, *s);
                }
            } else {
                chain.each_direct(k - nx, nu, columns, add);
            }
        }
    }
}
