//! Models behind one object-safe interface: value, Jacobian and weighted Hessian in the caller's slices.

use std::sync::Arc;

use crate::formula::Formula;
use crate::model::{Dynamics, FlatMap, PathFunction, VectorFunction};
use crate::pattern::{MAX_INPUTS, NodePattern};
use crate::plan::Plan;
use crate::trace::{self, OpaqueFunction, Trace};
use crate::{Dependence, Dual, HyperDual, Scalar};

/// Lanes of the hyper-dual pass: four fill the vector registers without spilling.
const HESSIAN_LANES: usize = 4;

/// A function of a few inputs with exact sparse derivatives.
///
/// Inputs `z` have length [`inputs`](Self::inputs). For dynamics and path functions `z = [x, u, p, t]`.
/// All slices belong to the caller and must have the stated lengths; no method but [`formula`](Self::formula) allocates.
pub trait NodeFunction: Send + Sync {
    /// Number of inputs.
    fn inputs(&self) -> usize;

    /// Number of outputs.
    fn outputs(&self) -> usize;

    /// Structure of the derivatives; the same at every point.
    fn pattern(&self) -> &NodePattern;

    /// Writes the outputs.
    fn value(&self, z: &[f64], out: &mut [f64]);

    /// Writes the outputs and the Jacobian entries in the order of [`NodePattern::jacobian_entries`].
    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]);

    /// Writes the entries of the Hessian of `sum_k weights[k] out[k]` in the order of [`NodePattern::hessian`].
    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]);

    /// [`value`](Self::value) at several points: `z` and `out` hold those of the first point, then of the next one.
    ///
    /// Each point has the numbers of a call for it alone, to the last bit but for the signs of zeros, however many points there are; that
    /// holds for the two methods below, too.
    fn values(&self, points: usize, z: &[f64], out: &mut [f64]) {
        let (n, m) = (self.inputs(), self.outputs());
        for p in 0..points {
            self.value(&z[p * n..(p + 1) * n], &mut out[p * m..(p + 1) * m]);
        }
    }

    /// [`jacobian`](Self::jacobian) at several points.
    fn jacobians(&self, points: usize, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        one_by_one(self, points, z, out, entries);
    }

    /// [`hessian`](Self::hessian) at several points, each with weights of its own.
    fn hessians(&self, points: usize, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let (n, m, e) = (self.inputs(), self.outputs(), self.pattern().hessian_len());
        for p in 0..points {
            let entries = &mut entries[p * e..(p + 1) * e];
            self.hessian(&z[p * n..(p + 1) * n], &weights[p * m..(p + 1) * m], entries);
        }
    }

    /// The function as a straight-line program, for other tools.
    ///
    /// # Errors
    /// The function contains one that is known by its values alone ([`Scalar::map`], [`Scalar::map2`]).
    fn formula(&self) -> Result<Formula, OpaqueFunction>;
}

/// Jacobians at several points, one after the other.
fn one_by_one<F: NodeFunction + ?Sized>(
    f: &F,
    points: usize,
    z: &[f64],
    out: &mut [f64],
    entries: &mut [f64],
) {
    let (n, m, e) = (f.inputs(), f.outputs(), f.pattern().jacobian_len());
    for p in 0..points {
        let (out, entries) = (&mut out[p * m..(p + 1) * m], &mut entries[p * e..(p + 1) * e]);
        f.jacobian(&z[p * n..(p + 1) * n], out, entries);
    }
}

/// Erases the equations of motion: `z = [x, u, p, t]`, outputs `dx/dt`.
///
/// At most 64 inputs; more do not compile.
pub fn dynamics_node<D, const NX: usize, const NU: usize, const NP: usize>(model: D) -> Arc<dyn NodeFunction>
where
    D: Dynamics<NX, NU, NP> + 'static,
{
    Arc::new(Node::new(DynamicsNode::<D, NX, NU, NP>(model)))
}

/// Erases a path function: `z = [x, u, p, t]`.
///
/// At most 64 inputs; more do not compile.
pub fn path_node<F, const NX: usize, const NU: usize, const NF: usize, const NP: usize>(
    function: F,
) -> Arc<dyn NodeFunction>
where
    F: PathFunction<NX, NU, NF, NP> + 'static,
{
    Arc::new(Node::new(PathNode::<F, NX, NU, NF, NP>(function)))
}

/// Erases a vector function.
///
/// At most 64 inputs; more do not compile.
pub fn vector_node<F, const N: usize, const M: usize>(function: F) -> Arc<dyn NodeFunction>
where
    F: VectorFunction<N, M> + 'static,
{
    Arc::new(Node::new(VectorNode::<F, N, M>(function)))
}

/// Erases a flat map: `z = [y, p, t]` with all derivatives of the first output, then those of the next; outputs states, controls,
/// residuals.
///
/// At most 64 inputs; more do not compile.
pub fn flat_node<
    M,
    const NY: usize,
    const ND: usize,
    const NX: usize,
    const NU: usize,
    const NR: usize,
    const NP: usize,
>(
    map: Arc<M>,
) -> Arc<dyn NodeFunction>
where
    M: FlatMap<NY, ND, NX, NU, NR, NP> + 'static,
{
    Arc::new(Node::new(FlatNode::<M, NY, ND, NX, NU, NR, NP>(map)))
}

/// A model that takes its inputs one by one from a closure, so that no array of all inputs is needed.
trait Seeded: Send + Sync {
    const INPUTS: usize;
    const OUTPUTS: usize;
    fn run<S: Scalar>(&self, input: impl Fn(usize) -> S, output: impl FnMut(usize, S));
}

struct DynamicsNode<D, const NX: usize, const NU: usize, const NP: usize>(D);

impl<D, const NX: usize, const NU: usize, const NP: usize> Seeded for DynamicsNode<D, NX, NU, NP>
where
    D: Dynamics<NX, NU, NP>,
{
    const INPUTS: usize = NX + NU + NP + 1;
    const OUTPUTS: usize = NX;

    #[inline]
    fn run<S: Scalar>(&self, input: impl Fn(usize) -> S, output: impl FnMut(usize, S)) {
        let x: [S; NX] = std::array::from_fn(&input);
        let u: [S; NU] = std::array::from_fn(|k| input(NX + k));
        let p: [S; NP] = std::array::from_fn(|k| input(NX + NU + k));
        emit(self.0.rate(input(NX + NU + NP), &x, &u, &p), output);
    }
}

struct PathNode<F, const NX: usize, const NU: usize, const NF: usize, const NP: usize>(F);

impl<F, const NX: usize, const NU: usize, const NF: usize, const NP: usize> Seeded
    for PathNode<F, NX, NU, NF, NP>
where
    F: PathFunction<NX, NU, NF, NP>,
{
    const INPUTS: usize = NX + NU + NP + 1;
    const OUTPUTS: usize = NF;

    #[inline]
    fn run<S: Scalar>(&self, input: impl Fn(usize) -> S, output: impl FnMut(usize, S)) {
        let x: [S; NX] = std::array::from_fn(&input);
        let u: [S; NU] = std::array::from_fn(|k| input(NX + k));
        let p: [S; NP] = std::array::from_fn(|k| input(NX + NU + k));
        emit(self.0.evaluate(input(NX + NU + NP), &x, &u, &p), output);
    }
}

struct VectorNode<F, const N: usize, const M: usize>(F);

impl<F, const N: usize, const M: usize> Seeded for VectorNode<F, N, M>
where
    F: VectorFunction<N, M>,
{
    const INPUTS: usize = N;
    const OUTPUTS: usize = M;

    #[inline]
    fn run<S: Scalar>(&self, input: impl Fn(usize) -> S, output: impl FnMut(usize, S)) {
        let z: [S; N] = std::array::from_fn(input);
        emit(self.0.evaluate(&z), output);
    }
}

struct FlatNode<
    M,
    const NY: usize,
    const ND: usize,
    const NX: usize,
    const NU: usize,
    const NR: usize,
    const NP: usize,
>(Arc<M>);

impl<M, const NY: usize, const ND: usize, const NX: usize, const NU: usize, const NR: usize, const NP: usize>
    Seeded for FlatNode<M, NY, ND, NX, NU, NR, NP>
where
    M: FlatMap<NY, ND, NX, NU, NR, NP>,
{
    const INPUTS: usize = NY * ND + NP + 1;
    const OUTPUTS: usize = NX + NU + NR;

    #[inline]
    fn run<S: Scalar>(&self, input: impl Fn(usize) -> S, mut output: impl FnMut(usize, S)) {
        let y: [[S; ND]; NY] = std::array::from_fn(|i| std::array::from_fn(|d| input(i * ND + d)));
        let p: [S; NP] = std::array::from_fn(|k| input(NY * ND + k));
        let (x, u, r) = self.0.evaluate(input(NY * ND + NP), &y, &p);
        emit(x, &mut output);
        emit(u, |k, v| output(NX + k, v));
        emit(r, |k, v| output(NX + NU + k, v));
    }
}

#[inline]
fn emit<S: Scalar, const N: usize>(values: [S; N], mut output: impl FnMut(usize, S)) {
    for (k, v) in values.into_iter().enumerate() {
        output(k, v);
    }
}

/// An erased model with its structure and the plan of its derivative passes.
struct Node<E> {
    model: E,
    pattern: NodePattern,
    /// Per Jacobian pass, the inputs of its lanes; only inputs that reach an output take part.
    active: Vec<usize>,
    /// Lane of each Jacobian entry within its pass, and the pass.
    entry_lane: Vec<(usize, usize)>,
    /// The model as it was recorded once; an error where a function is known by its values alone.
    formula: Result<Formula, OpaqueFunction>,
    /// None without a formula: the Hessian comes from passes of hyper-dual numbers.
    plan: Option<Plan>,
}

/// Lane that no input has: seeds a constant.
const NO_LANE: usize = usize::MAX;

impl<E: Seeded> Node<E> {
    fn new(model: E) -> Self {
        const { assert!(E::INPUTS <= MAX_INPUTS, "a node function has at most 64 inputs") };
        let mut pattern = NodePattern { row_offsets: vec![0], columns: Vec::new(), hessian: Vec::new() };
        let mut rows = vec![Dependence::from(0.0); E::OUTPUTS];
        model.run(Dependence::input, |k, v| rows[k] = v);
        for row in &rows {
            pattern.columns.extend((0..E::INPUTS).filter(|&c| row.depends_on(c)));
            pattern.row_offsets.push(pattern.columns.len());
        }
        for i in 0..E::INPUTS {
            pattern
                .hessian
                .extend((0..=i).filter(|&j| rows.iter().any(|r| r.is_nonlinear_in(i, j))).map(|j| (i, j)));
        }
        let active: Vec<usize> = (0..E::INPUTS).filter(|&c| rows.iter().any(|r| r.depends_on(c))).collect();
        let lanes = jacobian_lanes(E::INPUTS - usize::from(active.len() < E::INPUTS));
        let entry_lane = pattern
            .columns
            .iter()
            .filter_map(|c| active.iter().position(|a| a == c))
            .map(|k| (k / lanes, k % lanes))
            .collect();
        let formula = trace::record(E::INPUTS, |input| {
            let mut outputs = Vec::<Trace>::with_capacity(E::OUTPUTS);
            model.run(input, |_, v| outputs.push(v));
            outputs
        });
        let plan = formula.as_ref().ok().map(|f| Plan::of_model(f, &pattern));
        Self { model, pattern, active, entry_lane, formula, plan }
    }

    fn jacobian_in<const N: usize>(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        if self.active.is_empty() {
            self.value(z, out);
        }
        for (pass, chunk) in self.active.chunks(N).enumerate() {
            let mut lane_of = [NO_LANE; MAX_INPUTS];
            for (lane, &input) in chunk.iter().enumerate() {
                lane_of[input] = lane;
            }
            self.model.run(
                |i| Dual::<N>::variable(z[i], lane_of[i]),
                |r, v| {
                    out[r] = v.re;
                    for k in self.pattern.row_offsets[r]..self.pattern.row_offsets[r + 1] {
                        let (p, lane) = self.entry_lane[k];
                        if p == pass {
                            entries[k] = v.eps[lane];
                        }
                    }
                },
            );
        }
    }

    /// Computes the Hessian by hyper-dual numbers, a few entries per pass.
    fn hessian_in_lanes(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        for (pairs, values) in
            self.pattern.hessian.chunks(HESSIAN_LANES).zip(entries.chunks_mut(HESSIAN_LANES))
        {
            let mut sum = [0.0; HESSIAN_LANES];
            self.model.run(
                |input| {
                    let mut h = HyperDual::<HESSIAN_LANES>::constant(z[input]);
                    for (lane, &(i, j)) in pairs.iter().enumerate() {
                        h.e1[lane] = f64::from(u8::from(i == input));
                        h.e2[lane] = f64::from(u8::from(j == input));
                    }
                    h
                },
                |k, v| {
                    for (s, e) in sum.iter_mut().zip(&v.e12) {
                        *s += weights[k] * e;
                    }
                },
            );
            values.copy_from_slice(&sum[..pairs.len()]);
        }
    }
}

/// Lanes of the Jacobian pass for a number of inputs: whole vector registers, and even passes where one would spill.
const fn jacobian_lanes(inputs: usize) -> usize {
    match inputs {
        0..=16 => inputs.next_multiple_of(2),
        17..=24 => 12,
        _ => 16,
    }
}

/// Calls the Jacobian with a constant number of lanes; one instance per model and constant is compiled.
macro_rules! jacobian_in_lanes {
    ($lanes:expr, $node:expr, $z:expr, $out:expr, $entries:expr, $($n:literal)*) => {
        match const { $lanes } {
            $($n => $node.jacobian_in::<$n>($z, $out, $entries),)*
            _ => $node.jacobian_in::<16>($z, $out, $entries),
        }
    };
}

impl<E: Seeded> NodeFunction for Node<E> {
    fn inputs(&self) -> usize {
        E::INPUTS
    }

    fn outputs(&self) -> usize {
        E::OUTPUTS
    }

    fn pattern(&self) -> &NodePattern {
        &self.pattern
    }

    fn value(&self, z: &[f64], out: &mut [f64]) {
        self.model.run(|i| z[i], |k, v| out[k] = v);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        // Most models do not depend on time.
        if self.active.len() < E::INPUTS {
            jacobian_in_lanes!(jacobian_lanes(E::INPUTS.saturating_sub(1)), self, z, out, entries, 2 4 6 8 10 12 14);
        } else {
            jacobian_in_lanes!(jacobian_lanes(E::INPUTS), self, z, out, entries, 2 4 6 8 10 12 14);
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        match &self.plan {
            Some(plan) => plan.hessians(1, z, weights, entries),
            None => self.hessian_in_lanes(z, weights, entries),
        }
    }

    // A pass over one point is slower than dual numbers, one over many points faster.
    fn jacobians(&self, points: usize, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        match &self.plan {
            Some(plan) => plan.jacobians(points, z, out, entries),
            None => one_by_one(self, points, z, out, entries),
        }
    }

    fn hessians(&self, points: usize, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let (n, m, e) = (E::INPUTS, E::OUTPUTS, self.pattern.hessian_len());
        match &self.plan {
            Some(plan) => plan.hessians(points, z, weights, entries),
            None => (0..points).for_each(|p| {
                let entries = &mut entries[p * e..(p + 1) * e];
                self.hessian_in_lanes(&z[p * n..(p + 1) * n], &weights[p * m..(p + 1) * m], entries);
            }),
        }
    }

    fn formula(&self) -> Result<Formula, OpaqueFunction> {
        self.formula.clone()
    }
}

#[cfg(test)]
mod tests;
