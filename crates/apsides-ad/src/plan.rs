//! Programs for the value of a formula and its derivatives.

use crate::derivatives::{
    Budget, along_direction, by_adjoints, by_edges, by_tangents, gradient_along_direction,
};
use crate::formula::Formula;
use crate::graph::Term;
use crate::linear::{Linearised, Order};
use crate::pattern::NodePattern;
use crate::program::{Program, Results};
use crate::structure;

/// Terms of derivatives for each operation, and in addition, before directions are preferred.
const TERMS: (usize, usize) = (12, 50_000);

/// A derivative.
enum Derivative {
    /// All entries in one program.
    Entries(Program),
    /// A program along a direction, once for each.
    Directions { program: Program, directions: Directions },
}

/// A way to find the entries of a Jacobian.
type Way = fn(&mut Linearised, &NodePattern, Budget) -> Option<Vec<Term>>;

impl Derivative {
    fn jacobian(mut f: Linearised, outputs: &[Term], pattern: &NodePattern, ways: &[Way]) -> Self {
        let mut programs = Vec::new();
        for way in ways {
            let limit = budget(&f);
            if let Some(entries) = way(&mut f, pattern, limit) {
                let all: Vec<_> = outputs.iter().copied().chain(entries).collect();
                programs.push(f.graph.program(&all));
            }
        }
        match programs.into_iter().min_by_key(|p| p.instructions.len()) {
            Some(program) => Self::Entries(program),
            None => {
                let along = along_direction(&mut f);
                let entries = pattern.jacobian_entries().map(|(r, c)| (c, r));
                let directions = Directions::new(f.inputs, entries);
                Self::Directions { program: f.graph.program(&along), directions }
            }
        }
    }

    fn hessian(mut f: Linearised, pattern: &NodePattern) -> Self {
        let limit = budget(&f);
        match by_edges(&mut f, pattern, limit) {
            Some(entries) => Self::Entries(f.graph.program(&entries)),
            None => {
                let turned = gradient_along_direction(&mut f);
                let entries = pattern.hessian.iter().map(|&(i, j)| (j, i));
                let directions = Directions::new(f.inputs, entries);
                Self::Directions { program: f.graph.program(&turned), directions }
            }
        }
    }
}

fn budget(f: &Linearised) -> Budget {
    Budget(f.graph.len() + TERMS.0 * f.variables.len() + TERMS.1)
}

/// Unit directions and what they give.
struct Directions {
    /// Inputs that take part.
    inputs: Vec<u32>,
    /// For each of them the outputs of the program that are entries, in ascending order, and the entries.
    entries: Vec<Vec<(u32, u32)>>,
}

/// Programs of one formula.
pub(crate) struct Plan {
    inputs: usize,
    outputs: usize,
    /// Entries of the Jacobian and of the Hessian.
    entries: (usize, usize),
    value: Program,
    /// Outputs come first.
    jacobian: Derivative,
    hessian: Derivative,
}

impl Plan {
    /// The plan of a formula, and its pattern.
    pub(crate) fn with_pattern(formula: &Formula) -> (Self, NodePattern) {
        let second = Linearised::new(formula, Order::Second);
        let pattern = structure::pattern(&second);
        (Self::of(formula, &pattern, second, &[by_tangents, by_adjoints]), pattern)
    }

    /// The plan of the formula of a model with its pattern, which may have entries that are always zero. Jacobians have every bit of
    /// those by dual numbers.
    pub(crate) fn of_model(formula: &Formula, pattern: &NodePattern) -> Self {
        Self::of(formula, pattern, Linearised::new(formula, Order::Second), &[by_tangents])
    }

    fn of(formula: &Formula, pattern: &NodePattern, second: Linearised, ways: &[Way]) -> Self {
        let first = Linearised::new(formula, Order::First);
        let outputs: Vec<_> = first.outputs.iter().map(|o| o.0).collect();
        Self {
            inputs: formula.inputs(),
            outputs: outputs.len(),
            entries: (pattern.jacobian_len(), pattern.hessian_len()),
            value: first.graph.program(&outputs),
            jacobian: Derivative::jacobian(first, &outputs, pattern, ways),
            hessian: Derivative::hessian(second, pattern),
        }
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

    /// Writes the outputs at `points` points, each of which has its inputs and outputs together.
    pub(crate) fn values(&self, points: usize, z: &[f64], out: &mut [f64]) {
        let (n, m) = (self.inputs, self.outputs);
        self.value.run(
            points,
            |k, p| z[p * n + k],
            |p, results| results.write(0, &mut out[p * m..(p + 1) * m]),
        );
    }

    /// Writes the outputs and the entries of the Jacobians.
    pub(crate) fn jacobians(&self, points: usize, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let (n, m, e) = (self.inputs, self.outputs, self.entries.0);
        match &self.jacobian {
            Derivative::Entries(program) => program.run(
                points,
                |k, p| z[p * n + k],
                |p, results| {
                    results.write(0, &mut out[p * m..(p + 1) * m]);
                    results.write(m, &mut entries[p * e..(p + 1) * e]);
                },
            ),
            Derivative::Directions { program, directions } => {
                self.values(points, z, out);
                for p in 0..points {
                    let (z, entries) = (&z[p * n..(p + 1) * n], &mut entries[p * e..(p + 1) * e]);
                    program.run(
                        directions.inputs.len(),
                        |k, d| if k < n { z[k] } else { directions.component(d, k - n - m) },
                        |d, results| directions.put(d, results, entries),
                    );
                }
            }
        }
    }

    /// Writes the entries of the weighted Hessians.
    pub(crate) fn hessians(&self, points: usize, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let (n, m, e) = (self.inputs, self.outputs, self.entries.1);
        match &self.hessian {
            Derivative::Entries(program) => program.run(
                points,
                |k, p| if k < n { z[p * n + k] } else { weights[p * m + k - n] },
                |p, results| results.write(0, &mut entries[p * e..(p + 1) * e]),
            ),
            Derivative::Directions { program, directions } => {
                for p in 0..points {
                    let (z, weights) = (&z[p * n..(p + 1) * n], &weights[p * m..(p + 1) * m]);
                    let entries = &mut entries[p * e..(p + 1) * e];
                    program.run(
                        directions.inputs.len(),
                        |k, d| match k {
                            k if k < n => z[k],
                            k if k < n + m => weights[k - n],
                            k => directions.component(d, k - n - m),
                        },
                        |d, results| directions.put(d, results, entries),
                    );
                }
            }
        }
    }
}

impl Directions {
    /// `entries` gives the input and the output of the program for each entry.
    fn new(inputs: usize, entries: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut of_input: Vec<Vec<(u32, u32)>> = vec![Vec::new(); inputs];
        for (entry, (input, output)) in (0..).zip(entries) {
            of_input[input].push((output as u32, entry));
        }
        let used = (0..).zip(of_input).filter(|(_, places)| !places.is_empty());
        let (inputs, mut entries): (Vec<u32>, Vec<Vec<(u32, u32)>>) = used.unzip();
        entries.iter_mut().for_each(|places| places.sort_unstable());
        Self { inputs, entries }
    }

    /// Component of a unit direction.
    fn component(&self, direction: usize, component: usize) -> f64 {
        if self.inputs[direction] as usize == component { 1.0 } else { 0.0 }
    }

    /// Writes the results of a direction to its entries.
    fn put(&self, direction: usize, results: Results<'_>, entries: &mut [f64]) {
        let mut places = self.entries[direction].iter().peekable();
        for (output, number) in (0..).zip(results.iter()) {
            if let Some(&(_, entry)) = places.next_if(|p| p.0 == output) {
                entries[entry as usize] = number;
            }
        }
    }
}
