//! Bounds of a formula over a box, by interval arithmetic (R. E. Moore, R. B. Kearfott, M. J. Cloud: Introduction to Interval Analysis,
//! SIAM 2009).

use crate::formula::{Binary, Formula, Operation};
use crate::interval::{ALL, binary, hull, known, power, real_power, unary};

impl Formula {
    /// Least and largest values of the outputs where each input is anywhere between its own, which may be infinite.
    ///
    /// The bounds are valid to rounding, but not tight where an input occurs several times; what is not known is infinite. A point of the
    /// box at which the formula has no value counts for nothing.
    ///
    /// # Panics
    /// When there are not as many intervals as inputs.
    #[must_use]
    pub fn enclosure(&self, inputs: &[[f64; 2]]) -> Vec<[f64; 2]> {
        assert_eq!(inputs.len(), self.inputs(), "one interval for each input");
        let mut values = inputs.to_vec();
        for operation in self.operations() {
            let value = match *operation {
                Operation::Constant(c) => [c, c],
                Operation::Unary(f, k) => unary(f, values[k]),
                Operation::Binary(Binary::Mul, a, b) if a == b => power(values[a], 2),
                Operation::Binary(f, a, b) => binary(f, values[a], values[b]),
                Operation::Powi(k, n) => power(values[k], n),
                Operation::Powf(k, p) => real_power(values[k], p),
                Operation::Select(k, a, b) => match values[k] {
                    [least, _] if least >= 0.0 => values[a],
                    [_, largest] if largest < 0.0 => values[b],
                    _ => hull(values[a], values[b]),
                },
                Operation::Curve(t, k) => self.tables()[t].curve_enclosure(values[k])[0],
                Operation::Surface(..) => ALL,
            };
            values.push(known(value));
        }
        self.outputs().iter().map(|k| values[*k]).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::formula::{Binary, Unary};
    use crate::{Formula, FormulaBuilder};

    fn enclosed(build: impl Fn(&mut FormulaBuilder) -> crate::Value, inputs: &[[f64; 2]]) -> [f64; 2] {
        let mut builder = FormulaBuilder::new(inputs.len());
        let value = build(&mut builder);
        let formula: Formula = builder.formula(&[value]).expect("a formula");
        formula.enclosure(inputs)[0]
    }

    #[test]
    fn propellant_flows_one_way() {
        let flow = |b: &mut FormulaBuilder| {
            let (t, c) = (b.input(0), b.constant(-2.0));
            b.mul(c, t)
        };
        assert_eq!(enclosed(flow, &[[0.0, 3.5]]), [-7.0, 0.0]);
        assert_eq!(enclosed(flow, &[[0.0, f64::INFINITY]]), [f64::NEG_INFINITY, 0.0]);
    }

    #[test]
    fn an_interval_that_contains_zero_has_no_bounded_reciprocal() {
        let recip = |b: &mut FormulaBuilder| {
            let x = b.input(0);
            b.unary(Unary::Recip, x)
        };
        assert_eq!(enclosed(recip, &[[2.0, 4.0]]), [0.25, 0.5]);
        assert_eq!(enclosed(recip, &[[0.0, 4.0]]), [0.25, f64::INFINITY]);
        assert_eq!(enclosed(recip, &[[-4.0, 0.0]]), [f64::NEG_INFINITY, -0.25]);
        assert_eq!(enclosed(recip, &[[-1.0, 1.0]]), [f64::NEG_INFINITY, f64::INFINITY]);
    }

    #[test]
    fn a_square_is_not_negative() {
        let square = |b: &mut FormulaBuilder| {
            let x = b.input(0);
            b.binary(Binary::Mul, x, x)
        };
        assert_eq!(enclosed(square, &[[-3.0, 2.0]]), [0.0, 9.0]);
        assert_eq!(enclosed(square, &[[-3.0, -2.0]]), [4.0, 9.0]);
    }

    /// With room for rounding.
    fn widened([least, largest]: [f64; 2]) -> [f64; 2] {
        [least - 1e-12 * least.abs(), largest + 1e-12 * largest.abs()]
    }

    #[test]
    fn values_at_points_of_the_box_are_between_the_bounds() {
        let functions = [
            Unary::Neg,
            Unary::Sin,
            Unary::Cos,
            Unary::Tan,
            Unary::Asin,
            Unary::Acos,
            Unary::Atan,
            Unary::Sqrt,
            Unary::Cbrt,
            Unary::Exp,
            Unary::Ln,
            Unary::Sinh,
            Unary::Cosh,
            Unary::Tanh,
            Unary::Asinh,
            Unary::Acosh,
            Unary::Atanh,
            Unary::Recip,
            Unary::Abs,
            Unary::Sign,
        ];
        let boxes = [[-2.5, -0.5], [-0.7, 0.9], [0.2, 3.0], [-4.0, 5.0], [1.5, 1.5]];
        for f in functions {
            for range in boxes {
                let apply = |b: &mut FormulaBuilder| {
                    let x = b.input(0);
                    b.unary(f, x)
                };
                let [least, largest] = widened(enclosed(apply, &[range]));
                for k in 0..=100 {
                    let value: f64 = f.apply(range[0] + 0.01 * f64::from(k) * (range[1] - range[0]));
                    assert!(
                        !(value < least || value > largest),
                        "{f:?} {range:?}: {value} in {least}..{largest}"
                    );
                }
            }
        }
        let operations = [
            Binary::Add,
            Binary::Sub,
            Binary::Mul,
            Binary::Div,
            Binary::Atan2,
            Binary::Min,
            Binary::Max,
            Binary::Pow,
        ];
        for f in operations {
            for (x, y) in boxes.iter().flat_map(|x| boxes.iter().map(move |y| (*x, *y))) {
                let apply = |b: &mut FormulaBuilder| {
                    let (x, y) = (b.input(0), b.input(1));
                    b.binary(f, x, y)
                };
                let [least, largest] = widened(enclosed(apply, &[x, y]));
                for k in 0..=100 {
                    let (s, t) = (0.1 * f64::from(k % 11), 0.1 * f64::from(k / 11));
                    let value: f64 = f.apply(x[0] + s * (x[1] - x[0]), y[0] + t * (y[1] - y[0]));
                    assert!(
                        !(value < least || value > largest),
                        "{f:?} {x:?} {y:?}: {value} in {least}..{largest}"
                    );
                }
            }
        }
    }
}
