//! Equations of motion and integrands of a phase along one segment, on its normalised time from 0 to 1.

use std::sync::Arc;

use apsides_ad::NodeFunction;
use apsides_ode::SmoothSystem;

use super::chain::{Chain, TermKind};

/// The states and, as quadratures, the integrals of a segment as functions of `v` (see [`Chain`]).
#[derive(Clone)]
pub(crate) struct SegmentSystem {
    pub(crate) chain: Chain,
    /// Equations of motion, then integrands.
    functions: Vec<Part>,
    entries: usize,
    /// Inputs of a function, and values of its outputs.
    inputs: Vec<f64>,
}

#[derive(Clone)]
struct Part {
    function: Arc<dyn NodeFunction>,
    /// First component of the rates, first entry.
    output: usize,
    entry: usize,
}

impl SegmentSystem {
    pub(crate) fn new(
        mut chain: Chain,
        dynamics: &Arc<dyn NodeFunction>,
        integrands: &[Arc<dyn NodeFunction>],
    ) -> Self {
        let (mut output, mut entry) = (0, 0);
        let mut functions = Vec::with_capacity(1 + integrands.len());
        for function in std::iter::once(dynamics).chain(integrands) {
            chain.admit(function.as_ref());
            functions.push(Part { function: Arc::clone(function), output, entry });
            output += function.outputs();
            entry += function.pattern().jacobian_len();
        }
        let inputs = functions.iter().map(|p| p.function.inputs()).max().unwrap_or(0);
        Self { chain, functions, entries: entry, inputs: vec![0.0; inputs] }
    }
}

impl SmoothSystem for SegmentSystem {
    fn states(&self) -> usize {
        self.chain.states
    }

    fn quadratures(&self) -> usize {
        self.functions.len() - 1
    }

    fn inputs(&self) -> usize {
        self.chain.inputs()
    }

    fn entries(&self) -> usize {
        self.entries
    }

    fn rate(&mut self, s: f64, x: &[f64], w: &[f64], rate: &mut [f64]) {
        self.chain.set(s);
        let factor = self.chain.factor(TermKind::Rate, w);
        for Part { function, output, .. } in &self.functions {
            let z = &mut self.inputs[..function.inputs()];
            self.chain.fill(x, w, z);
            let out = &mut rate[*output..][..function.outputs()];
            function.value(z, out);
            out.iter_mut().for_each(|v| *v *= factor);
        }
    }

    fn tangent(
        &mut self,
        s: f64,
        x: &[f64],
        w: &[f64],
        sensitivity: &[f64],
        rate: &mut [f64],
        tangent: &mut [f64],
        entries: &mut [f64],
    ) {
        self.chain.set(s);
        let (factor, columns) = (self.chain.factor(TermKind::Rate, w), self.chain.columns());
        for Part { function, output, entry } in &self.functions {
            let z = &mut self.inputs[..function.inputs()];
            self.chain.fill(x, w, z);
            let out = &mut rate[*output..][..function.outputs()];
            let entries = &mut entries[*entry..][..function.pattern().jacobian_len()];
            function.jacobian(z, out, entries);
            let rows = &mut tangent[output * columns..][..out.len() * columns];
            self.chain.rows(function.as_ref(), TermKind::Rate, w, out, entries, sensitivity, rows);
            out.iter_mut().for_each(|v| *v *= factor);
        }
    }

    fn add_transposed(&mut self, w: &[f64], entries: &[f64], weights: &[f64], out: &mut [f64]) {
        let factor = self.chain.factor(TermKind::Rate, w);
        for Part { function, output, entry } in &self.functions {
            for ((r, c), v) in function.pattern().jacobian_entries().zip(&entries[*entry..]) {
                if c < out.len() {
                    out[c] += factor * v * weights[output + r];
                }
            }
        }
    }

    fn add_hessian(
        &mut self,
        s: f64,
        x: &[f64],
        w: &[f64],
        sensitivity: &[f64],
        entries: &[f64],
        weights: &[f64],
        hessian: &mut [f64],
    ) {
        self.chain.set(s);
        self.chain.clear();
        for Part { function, output, entry } in &self.functions {
            let z = &mut self.inputs[..function.inputs()];
            self.chain.fill(x, w, z);
            let weights = &weights[*output..][..function.outputs()];
            self.chain.add_local(function.as_ref(), TermKind::Rate, w, z, &entries[*entry..], weights);
        }
        self.chain.add_products(sensitivity, hessian);
    }
}
