//! Formulas at given values of some of their inputs.

use crate::formula::{Formula, Operation};

/// A value that is known, or its place in the new formula.
#[derive(Clone, Copy)]
enum Part {
    Number(f64),
    At(usize),
}

impl Formula {
    /// The formula of the inputs that have no value here, in their order. What depends on the others alone is a number in it, and of a choice that
    /// is known by then what is not chosen is left out.
    ///
    /// # Panics
    /// When there are not as many values as inputs.
    #[must_use]
    pub fn specialised(&self, values: &[Option<f64>]) -> Self {
        assert_eq!(values.len(), self.inputs(), "one value or none for each input");
        let mut inputs = 0;
        let mut parts: Vec<Part> = Vec::with_capacity(self.inputs() + self.operations().len());
        for value in values {
            parts.push(value.map_or_else(
                || {
                    inputs += 1;
                    Part::At(inputs - 1)
                },
                Part::Number,
            ));
        }
        let mut operations = Vec::new();
        for operation in self.operations() {
            let number = |k: usize| match parts[k] {
                Part::Number(c) => Some(c),
                Part::At(_) => None,
            };
            let part = if let Operation::Select(condition, a, b) = *operation
                && let Some(c) = number(condition)
            {
                parts[if c >= 0.0 { a } else { b }]
            } else if operation.operands().all(|k| number(k).is_some()) {
                Part::Number(operation.apply(|k| number(k).unwrap_or(f64::NAN), self.tables()))
            } else {
                let places: Vec<(usize, usize)> =
                    operation.operands().map(|k| (k, placed(parts[k], inputs, &mut operations))).collect();
                let place = |k: usize| places.iter().find(|(of, _)| *of == k).map_or(0, |(_, place)| *place);
                operations.push(operation.with_operands(place, |table| table));
                Part::At(inputs + operations.len() - 1)
            };
            parts.push(part);
        }
        let outputs: Vec<usize> =
            self.outputs().iter().map(|k| placed(parts[*k], inputs, &mut operations)).collect();
        Self::pruned(inputs, &operations, self.tables(), &outputs)
    }
}

/// The place of a value; a number becomes an operation.
fn placed(part: Part, inputs: usize, operations: &mut Vec<Operation>) -> usize {
    match part {
        Part::At(place) => place,
        Part::Number(c) => {
            operations.push(Operation::Constant(c));
            inputs + operations.len() - 1
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Formula, FormulaBuilder};

    #[test]
    fn what_is_known_becomes_a_number() {
        let mut f = FormulaBuilder::new(3);
        let (a, b, c) = (f.input(0), f.input(1), f.input(2));
        let (sine, root) = (f.sin(a), f.sqrt(a));
        let chosen = f.select(a, root, sine);
        let product = f.mul(sine, b);
        let sum = f.add(product, c);
        let all = f.mul(sum, chosen);
        let formula: Formula = f.formula(&[all, sine, c]).expect("well formed");
        // At -0.5 the root has no value, and is not chosen.
        let special = formula.specialised(&[Some(-0.5), None, None]);
        assert_eq!(special.inputs(), 2);
        // Two numbers for `all`, one for `sine`; product, sum and product.
        assert_eq!(special.operations().len(), 6);
        let (sine, expected) = ((-0.5_f64).sin(), formula.evaluate(&[-0.5, 2.0, 3.0]));
        assert_eq!(special.evaluate(&[2.0, 3.0]), expected);
        assert_eq!(expected, [(sine * 2.0 + 3.0) * sine, sine, 3.0]);
        let known = formula.specialised(&[Some(0.25), Some(2.0), Some(3.0)]);
        assert_eq!(known.evaluate::<f64>(&[]), formula.evaluate(&[0.25, 2.0, 3.0]));
    }
}
