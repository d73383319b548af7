//! Programs for the value of a formula and its derivatives.

use crate::derivatives::{
    Budget, along_direction, by_adjoints, by_edges, by_tangents, gradient_along_direction,
};
use crate::formula::Formula;
use crate::linear::Linearised;
use crate::pattern::NodePattern;
use crate::program::Program;
use crate::structure;

/// Terms of derivatives for each operation, and in addition, before directions are preferred.
const TERMS: (usize, usize) = (12, 50_000);

/// Directions that are computed at once.
const DIRECTIONS: usize = 8;

/// A derivative.
enum Derivative {
    /// All entries in one program.
    Entries(Program),
    /// A program along a direction, once for each.
    Directions {
        program: Program,
        /// Inputs that take part.
        inputs: Vec<u32>,
        /// For each of them the entries, and the output of the program that each is.
        entries: Vec<Vec<(u32, u32)>>,
    },
}

/// Programs of one formula.
pub(crate) struct Plan {
    inputs: usize,
    outputs: usize,
    value: Program,
    /// Outputs come first.
    jacobian: Derivative,
    hessian: Derivative,
}

impl Plan {
    /// The plan of a formula, and its pattern.
    pub(crate) fn with_pattern(formula: &Formula) -> (Self, NodePattern) {
        let linearised = Linearised::new(formula);
        let pattern = structure::pattern(&linearised);
        (Self::of(linearised, formula, &pattern), pattern)
    }

    fn of(mut f: Linearised, formula: &Formula, pattern: &NodePattern) -> Self {
        let outputs: Vec<_> = f.outputs.iter().map(|o| o.0).collect();
        let value = f.graph.program(&outputs);
        let budget = |f: &Linearised| Budget(f.graph.len() + TERMS.0 * formula.operations().len() + TERMS.1);
        let mut entries = Vec::new();
        for derive in [by_tangents, by_adjoints] {
            let limit = budget(&f);
            if let Some(terms) = derive(&mut f, pattern, limit) {
                let all: Vec<_> = outputs.iter().copied().chain(terms).collect();
                entries.push(f.graph.program(&all));
            }
        }
        let jacobian = match entries.into_iter().min_by_key(|p| p.instructions.len()) {
            Some(program) => Derivative::Entries(program),
            None => {
                let along = along_direction(&mut f);
                let all: Vec<_> = outputs.iter().copied().chain(along).collect();
                let first = outputs.len();
                let entries = pattern.jacobian_entries().map(|(r, c)| (c, first + r));
                Derivative::directions(f.graph.program(&all), f.inputs, entries)
            }
        };
        let limit = budget(&f);
        let hessian = match by_edges(&mut f, pattern, limit) {
            Some(terms) => Derivative::Entries(f.graph.program(&terms)),
            None => {
                let (_, turned) = gradient_along_direction(&mut f);
                let entries = pattern.hessian.iter().map(|&(i, j)| (j, i));
                Derivative::directions(f.graph.program(&turned), f.inputs, entries)
            }
        };
        Self { inputs: formula.inputs(), outputs: outputs.len(), value, jacobian, hessian }
    }

    /// Instructions of the value, of the Jacobian and of the Hessian.
    #[cfg(test)]
    pub(crate) fn sizes(&self) -> [usize; 3] {
        let of = |derivative: &Derivative| match derivative {
            Derivative::Entries(program) | Derivative::Directions { program, .. } => {
                program.instructions.len()
            }
        };
        [self.value.instructions.len(), of(&self.jacobian), of(&self.hessian)]
    }

    /// Writes the outputs at `z`.
    pub(crate) fn value(&self, z: &[f64], out: &mut [f64]) {
        self.value.run::<1>(|k, _| z[k], |k, &[v]| out[k] = v);
    }

    /// Writes the outputs and the entries of the Jacobian.
    pub(crate) fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let m = self.outputs;
        match &self.jacobian {
            Derivative::Entries(program) => program.run::<1>(
                |k, _| z[k],
                |k, &[v]| match k.checked_sub(m) {
                    Some(entry) => entries[entry] = v,
                    None => out[k] = v,
                },
            ),
            Derivative::Directions { program, inputs, entries: places } => {
                if inputs.is_empty() {
                    self.value(z, out);
                }
                let n = self.inputs;
                for (inputs, places) in inputs.chunks(DIRECTIONS).zip(places.chunks(DIRECTIONS)) {
                    let mut next = places_by_output(places);
                    program.run::<DIRECTIONS>(
                        |k, lane| if k < n { z[k] } else { direction(inputs, k - n - m, lane) },
                        |k, v| {
                            if k < m {
                                out[k] = v[0];
                            }
                            next(k, v, entries);
                        },
                    );
                }
            }
        }
    }

    /// Writes the entries of the weighted Hessian.
    pub(crate) fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let (n, m) = (self.inputs, self.outputs);
        match &self.hessian {
            Derivative::Entries(program) => {
                program.run::<1>(|k, _| if k < n { z[k] } else { weights[k - n] }, |k, &[v]| entries[k] = v);
            }
            Derivative::Directions { program, inputs, entries: places } => {
                for (inputs, places) in inputs.chunks(DIRECTIONS).zip(places.chunks(DIRECTIONS)) {
                    let mut next = places_by_output(places);
                    program.run::<DIRECTIONS>(
                        |k, lane| match k {
                            k if k < n => z[k],
                            k if k < n + m => weights[k - n],
                            k => direction(inputs, k - n - m, lane),
                        },
                        |k, v| next(k, v, entries),
                    );
                }
            }
        }
    }
}

/// Component of the unit direction of a lane.
fn direction(inputs: &[u32], component: usize, lane: usize) -> f64 {
    if inputs.get(lane).is_some_and(|&k| k as usize == component) { 1.0 } else { 0.0 }
}

/// Puts the results of directions into their entries; outputs come in ascending order.
fn places_by_output(places: &[Vec<(u32, u32)>]) -> impl FnMut(usize, &[f64; DIRECTIONS], &mut [f64]) + '_ {
    let mut next = [0; DIRECTIONS];
    move |output, values, entries| {
        for ((places, next), value) in places.iter().zip(&mut next).zip(values) {
            if let Some(&(entry, of)) = places.get(*next)
                && of as usize == output
            {
                entries[entry as usize] = *value;
                *next += 1;
            }
        }
    }
}

impl Derivative {
    /// `entries` gives the input and the output of the program for each entry.
    fn directions(program: Program, inputs: usize, entries: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut of_input: Vec<Vec<(u32, u32)>> = vec![Vec::new(); inputs];
        for (entry, (input, output)) in (0..).zip(entries) {
            of_input[input].push((entry, output as u32));
        }
        for places in &mut of_input {
            places.sort_unstable_by_key(|p| p.1);
        }
        let used = (0..).zip(of_input).filter(|(_, places)| !places.is_empty());
        let (inputs, entries) = used.unzip();
        Self::Directions { program, inputs, entries }
    }
}
