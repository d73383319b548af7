//! Values, first and second derivatives of a formula over a box, as intervals: all that a bound by Taylor's formula needs.
//!
//! ```text
//! f(v) >= f(c) + g(c) . (v - c) + min over H in the box of (v - c)' H (v - c) / 2          for c and v in the box
//! ```
//!
//! Where a formula has a kink, its second derivative is what smooth functions near it have, which may be infinite of one sign: the bound
//! above holds for a convex kink. Where a formula may jump, or has a pole or a table of two variables within, derivatives are not known. R. B. Kearfott, Rigorous Global Search: Continuous
//! Problems, Kluwer 1996, chapter 1.

use std::sync::Arc;

use crate::formula::{Binary, Formula, Operation, Unary};
use crate::interval::{
    ALL, Interval, ONE, ZERO, add, binary, contains_zero, hull, known, minus, power, product, quotient,
    real_power, scale, square, unary,
};
use crate::table::Table;

/// Curvature of a kink that is convex.
const CONVEX_KINK: Interval = [0.0, f64::INFINITY];

/// The highest derivatives that are bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Derivatives {
    /// Values alone.
    Values,
    /// Values and gradients.
    Slopes,
    /// Values, gradients and Hessians.
    Curvatures,
}

/// A formula with the intervals of its values and derivatives over the last box.
#[derive(Clone, Debug)]
pub struct Expansion {
    formula: Formula,
    /// The inputs that each value depends on, ascending: its derivatives by the others are zero.
    inputs_of: Vec<Vec<usize>>,
    /// Intervals of one value: itself, the gradient, the lower triangle of the Hessian by rows.
    stride: usize,
    intervals: Vec<Interval>,
}

impl Expansion {
    /// A formula that is to be bounded.
    #[must_use]
    pub fn new(formula: Formula) -> Self {
        let n = formula.inputs();
        let mut inputs_of: Vec<Vec<usize>> = (0..n).map(|k| vec![k]).collect();
        for operation in formula.operations() {
            let mut inputs: Vec<usize> = operation.operands().flat_map(|k| inputs_of[k].clone()).collect();
            inputs.sort_unstable();
            inputs.dedup();
            inputs_of.push(inputs);
        }
        let stride = 1 + n + n * (n + 1) / 2;
        let mut intervals = vec![ZERO; stride * inputs_of.len()];
        for k in 0..n {
            intervals[k * stride + 1 + k] = ONE;
        }
        let mut expansion = Self { formula, inputs_of, stride, intervals };
        // What depends on no input stays as it is.
        let constants = (n..expansion.inputs_of.len()).filter(|k| expansion.inputs_of[*k].is_empty());
        constants.collect::<Vec<_>>().into_iter().for_each(|k| expansion.operate(k, Derivatives::Values));
        expansion
    }

    /// The formula.
    #[must_use]
    pub fn formula(&self) -> &Formula {
        &self.formula
    }

    /// Goes to a box, given by least and largest value of each input, which may be infinite.
    ///
    /// # Panics
    /// When there are not as many intervals as inputs.
    pub fn set(&mut self, inputs: &[[f64; 2]]) {
        self.set_to(Derivatives::Curvatures, inputs);
    }

    /// Goes to a box and bounds derivatives up to an order; those above it are those of an earlier box.
    ///
    /// # Panics
    /// When there are not as many intervals as inputs.
    pub fn set_to(&mut self, order: Derivatives, inputs: &[[f64; 2]]) {
        let n = self.formula.inputs();
        assert_eq!(inputs.len(), n, "one interval for each input");
        for (value, range) in self.intervals.chunks_exact_mut(self.stride).zip(inputs) {
            value[0] = *range;
        }
        for k in n..self.inputs_of.len() {
            if !self.inputs_of[k].is_empty() {
                self.operate(k, order);
            }
        }
    }

    /// Bounds a value by those before it.
    fn operate(&mut self, place: usize, order: Derivatives) {
        let n = self.formula.inputs();
        let (before, after) = self.intervals.split_at_mut(place * self.stride);
        let inputs = &self.inputs_of[place];
        let values = Values { n, stride: self.stride, before, inputs, order, tables: self.formula.tables() };
        values.operate(self.formula.operations()[place - n], &mut after[..self.stride]);
    }

    /// The inputs that an output depends on, ascending.
    #[must_use]
    pub fn inputs_of(&self, output: usize) -> &[usize] {
        &self.inputs_of[self.formula.outputs()[output]]
    }

    /// Bounds of an output.
    #[must_use]
    pub fn value(&self, output: usize) -> [f64; 2] {
        self.intervals[self.formula.outputs()[output] * self.stride]
    }

    /// Bounds of the derivatives of an output.
    #[must_use]
    pub fn gradient(&self, output: usize) -> &[[f64; 2]] {
        let first = self.formula.outputs()[output] * self.stride + 1;
        &self.intervals[first..first + self.formula.inputs()]
    }

    /// Bounds of the second derivatives of an output: the lower triangle by rows.
    #[must_use]
    pub fn hessian(&self, output: usize) -> &[[f64; 2]] {
        let first = self.formula.outputs()[output] * self.stride;
        &self.intervals[first + 1 + self.formula.inputs()..first + self.stride]
    }

    /// Number of intervals of one value: itself, its gradient, the lower triangle of its Hessian by rows.
    #[must_use]
    pub fn width(&self) -> usize {
        self.stride
    }

    /// Adds the outputs, each times its weight, to `sum`: values, then gradients and Hessians as far as `sum` has room, of length
    /// [`width`](Self::width) at most.
    pub fn add_weighted(&self, weights: &[f64], sum: &mut [[f64; 2]]) {
        for (place, weight) in self.formula.outputs().iter().zip(weights).filter(|(_, w)| **w != 0.0) {
            let value = &self.intervals[place * self.stride..(place + 1) * self.stride];
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum = add(*sum, scale(*value, *weight));
            }
        }
    }
}

/// Derivatives of a function of two values: by each, then twice by the first, by both, twice by the second.
struct Partials {
    first: [Interval; 2],
    second: [Interval; 3],
}

const UNKNOWN: Partials = Partials { first: [ALL; 2], second: [ALL; 3] };

/// The values before one that is computed.
struct Values<'a> {
    n: usize,
    stride: usize,
    before: &'a [Interval],
    /// The inputs that the value depends on, ascending.
    inputs: &'a [usize],
    order: Derivatives,
    tables: &'a [Arc<Table>],
}

impl Values<'_> {
    fn range(&self, k: usize) -> Interval {
        self.before[k * self.stride]
    }

    fn gradient(&self, k: usize) -> &[Interval] {
        &self.before[k * self.stride + 1..k * self.stride + 1 + self.n]
    }

    fn hessian(&self, k: usize) -> &[Interval] {
        &self.before[k * self.stride + 1 + self.n..(k + 1) * self.stride]
    }

    fn operate(&self, operation: Operation, out: &mut [Interval]) {
        let range = |k: usize| self.range(k);
        match operation {
            Operation::Constant(c) => out[0] = known([c, c]),
            Operation::Unary(f, k) => self.of_one(k, unary(f, range(k)), || derivatives(f, range(k)), out),
            Operation::Powi(k, n) => {
                let pole = n < 0 && has_pole(range(k));
                let derivatives = || {
                    if pole {
                        [ALL, ALL]
                    } else {
                        powers(f64::from(n), |less| power(range(k), n.saturating_sub(less)))
                    }
                };
                self.of_one(k, power(range(k), n), derivatives, out);
            }
            Operation::Powf(k, p) => {
                let derivatives = || powers(p, |less| real_power(range(k), p - f64::from(less)));
                self.of_one(k, real_power(range(k), p), derivatives, out);
            }
            Operation::Binary(Binary::Mul, a, b) if a == b => {
                self.of_one(a, square(range(a)), || [scale(range(a), 2.0), [2.0, 2.0]], out);
            }
            Operation::Binary(Binary::Add | Binary::Sub, a, b) => {
                let is_sum = matches!(operation, Operation::Binary(Binary::Add, ..));
                let (a, b) = (self.all_of(a), self.all_of(b));
                self.each(out, |k| add(a[k], if is_sum { b[k] } else { minus(b[k]) }));
            }
            Operation::Binary(f @ (Binary::Min | Binary::Max), a, b) => {
                let (less, more) = if f == Binary::Min { (a, b) } else { (b, a) };
                if range(less)[1] < range(more)[0] {
                    self.copy(a, out);
                } else if range(more)[1] < range(less)[0] {
                    self.copy(b, out);
                } else {
                    self.either(f, a, b, out);
                }
            }
            Operation::Binary(f, a, b) => {
                let value = binary(f, range(a), range(b));
                self.of_two(a, b, value, || partials(f, range(a), range(b), value), out);
            }
            Operation::Select(condition, a, b) => match range(condition) {
                [least, _] if least >= 0.0 => self.copy(a, out),
                [_, largest] if largest < 0.0 => self.copy(b, out),
                _ => {
                    self.each(out, |_| ALL);
                    out[0] = hull(range(a), range(b));
                }
            },
            Operation::Curve(t, k) => {
                let [value, first, second] = self.tables[t].curve_enclosure(range(k));
                self.of_one(k, value, || [first, second], out);
            }
            Operation::Surface(..) => self.each(out, |_| ALL),
        }
    }

    /// Value, gradient and Hessian of a value.
    fn all_of(&self, k: usize) -> &[Interval] {
        &self.before[k * self.stride..(k + 1) * self.stride]
    }

    /// Fills what is bounded: the place of each entry among value, gradient and Hessian.
    fn each(&self, out: &mut [Interval], entry: impl Fn(usize) -> Interval) {
        out[0] = entry(0);
        self.each_derivative(out, |i| entry(1 + i), |_, _, at| entry(1 + self.n + at));
    }

    /// Fills the derivatives that are bounded: by input, and by two inputs and the place in the lower triangle.
    fn each_derivative(
        &self,
        out: &mut [Interval],
        slope: impl Fn(usize) -> Interval,
        curvature: impl Fn(usize, usize, usize) -> Interval,
    ) {
        if self.order == Derivatives::Values {
            return;
        }
        for &i in self.inputs {
            out[1 + i] = slope(i);
        }
        if self.order == Derivatives::Slopes {
            return;
        }
        for (k, &i) in self.inputs.iter().enumerate() {
            for &j in &self.inputs[..=k] {
                let at = i * (i + 1) / 2 + j;
                out[1 + self.n + at] = curvature(i, j, at);
            }
        }
    }

    fn copy(&self, k: usize, out: &mut [Interval]) {
        let all = self.all_of(k);
        self.each(out, |at| all[at]);
    }

    /// The smaller or the larger of two values: half their sum and half their distance, which has a kink.
    fn either(&self, f: Binary, a: usize, b: usize, out: &mut [Interval]) {
        let kink = if f == Binary::Min { [f64::NEG_INFINITY, 0.0] } else { CONVEX_KINK };
        out[0] = known(binary(f, self.range(a), self.range(b)));
        let (ga, gb, ha, hb) = (self.gradient(a), self.gradient(b), self.hessian(a), self.hessian(b));
        let apart = |i: usize| add(ga[i], minus(gb[i]));
        let slope = |i: usize| hull(ga[i], gb[i]);
        self.each_derivative(out, slope, |i, j, at| {
            let both = if i == j { square(apart(i)) } else { product(apart(i), apart(j)) };
            add(hull(ha[at], hb[at]), product(kink, both))
        });
    }

    fn of_one(
        &self,
        k: usize,
        value: Interval,
        derivatives: impl FnOnce() -> [Interval; 2],
        out: &mut [Interval],
    ) {
        out[0] = known(value);
        if self.order == Derivatives::Values {
            return;
        }
        let [first, second] = derivatives().map(known);
        let (gradient, hessian) = (self.gradient(k), self.hessian(k));
        let slope = |i: usize| product(first, gradient[i]);
        self.each_derivative(out, slope, |i, j, at| {
            let both = if i == j { square(gradient[i]) } else { product(gradient[i], gradient[j]) };
            add(product(second, both), product(first, hessian[at]))
        });
    }

    fn of_two(
        &self,
        a: usize,
        b: usize,
        value: Interval,
        partials: impl FnOnce() -> Partials,
        out: &mut [Interval],
    ) {
        out[0] = known(value);
        if self.order == Derivatives::Values {
            return;
        }
        let Partials { first: [x, y], second: [xx, xy, yy] } = partials();
        let (ga, gb, ha, hb) = (self.gradient(a), self.gradient(b), self.hessian(a), self.hessian(b));
        let times = |factor: Interval, of: &[Interval], i: usize, j: usize| {
            product(factor, if i == j { square(of[i]) } else { product(of[i], of[j]) })
        };
        let slope = |i: usize| add(product(x, ga[i]), product(y, gb[i]));
        self.each_derivative(out, slope, |i, j, at| {
            let mixed = add(product(ga[i], gb[j]), product(ga[j], gb[i]));
            let second = add(times(xx, ga, i, j), times(yy, gb, i, j));
            let second = add(second, product(xy, mixed));
            let first = add(product(x, ha[at]), product(y, hb[at]));
            add(second, first)
        });
    }
}

/// Returns true if the reciprocal of what is in the interval comes from both sides of its pole.
fn has_pole(x: Interval) -> bool {
    (x[0] < 0.0 && x[1] > 0.0) || x == ZERO
}

/// First and second derivative of a power with exponent `p`, by the powers with exponents less by a number.
fn powers(p: f64, lower: impl Fn(i32) -> Interval) -> [Interval; 2] {
    let times = |factor: f64, less: i32| if factor == 0.0 { ZERO } else { scale(lower(less), factor) };
    [times(p, 1), times(p * (p - 1.0), 2)]
}

/// First and second derivative of a function over an interval.
fn derivatives(f: Unary, x: Interval) -> [Interval; 2] {
    let v = unary(f, x);
    let recip = |x: Interval| quotient(ONE, x);
    // 1 + sign x^2
    let one_and = |sign: f64| add(ONE, scale(square(x), sign));
    // 1 / sqrt(y), and x / y^(3/2)
    let of_roots = |y: Interval| {
        let root = recip(unary(Unary::Sqrt, y));
        [root, product(x, power(root, 3))]
    };
    match f {
        Unary::Neg => [[-1.0, -1.0], ZERO],
        Unary::Sin => [unary(Unary::Cos, x), minus(v)],
        Unary::Cos => [minus(unary(Unary::Sin, x)), minus(v)],
        Unary::Tan if v == ALL => [ALL, ALL],
        Unary::Tan => {
            let first = add(ONE, square(v));
            [first, scale(product(v, first), 2.0)]
        }
        Unary::Asin => of_roots(one_and(-1.0)),
        Unary::Acos => of_roots(one_and(-1.0)).map(minus),
        Unary::Atan => {
            let first = recip(one_and(1.0));
            [first, scale(product(x, square(first)), -2.0)]
        }
        Unary::Sqrt => {
            // It has no value below zero.
            let first = scale(recip(v), 0.5);
            [first, scale(product(first, recip([x[0].max(0.0), x[1].max(0.0)])), -0.5)]
        }
        // One third of v / x, which does not grow from zero.
        Unary::Cbrt => [scale(recip(square(v)), 1.0 / 3.0), scale(recip(power(v, 5)), -2.0 / 9.0)],
        Unary::Exp => [v, v],
        Unary::Ln => {
            let first = recip([x[0].max(0.0), x[1].max(0.0)]);
            [first, minus(square(first))]
        }
        Unary::Sinh => [unary(Unary::Cosh, x), v],
        Unary::Cosh => [unary(Unary::Sinh, x), v],
        Unary::Tanh => {
            let first = add(ONE, scale(square(v), -1.0));
            [first, scale(product(v, first), -2.0)]
        }
        Unary::Asinh => {
            let [first, second] = of_roots(one_and(1.0));
            [first, minus(second)]
        }
        Unary::Acosh => {
            let [first, second] = of_roots(add(square(x), [-1.0, -1.0]));
            [first, minus(second)]
        }
        Unary::Atanh => {
            let first = recip(one_and(-1.0));
            [first, scale(product(x, square(first)), 2.0)]
        }
        Unary::Recip if has_pole(x) => [ALL, ALL],
        Unary::Recip => {
            let square = square(v);
            [minus(square), scale(product(square, v), 2.0)]
        }
        Unary::Abs if x[0] > 0.0 => [ONE, ZERO],
        Unary::Abs if x[1] < 0.0 => [[-1.0, -1.0], ZERO],
        Unary::Abs => [[-1.0, 1.0], CONVEX_KINK],
        Unary::Sign if !contains_zero(x) => [ZERO, ZERO],
        Unary::Sign => [ALL, ALL],
    }
}

fn partials(f: Binary, x: Interval, y: Interval, value: Interval) -> Partials {
    let recip = |x: Interval| quotient(ONE, x);
    match f {
        Binary::Add => Partials { first: [ONE; 2], second: [ZERO; 3] },
        Binary::Sub => Partials { first: [ONE, [-1.0, -1.0]], second: [ZERO; 3] },
        Binary::Mul => Partials { first: [y, x], second: [ZERO, ONE, ZERO] },
        Binary::Div if has_pole(y) => UNKNOWN,
        Binary::Div => {
            let inverse = recip(y);
            let square = square(inverse);
            let cube = product(square, inverse);
            Partials {
                first: [inverse, scale(product(x, square), -1.0)],
                second: [ZERO, scale(square, -1.0), scale(product(x, cube), 2.0)],
            }
        }
        // Of ordinate `x` and abscissa `y`; it jumps where the abscissa is negative.
        Binary::Atan2 if y[0] > 0.0 || !contains_zero(x) => {
            let inverse = recip(add(square(x), square(y)));
            let fourth = square(inverse);
            let mixed = scale(product(product(x, y), fourth), 2.0);
            Partials {
                first: [product(y, inverse), scale(product(x, inverse), -1.0)],
                second: [scale(mixed, -1.0), product(add(square(x), scale(square(y), -1.0)), fourth), mixed],
            }
        }
        Binary::Pow if x[0] > 0.0 => {
            let (inverse, ln) = (recip(x), unary(Unary::Ln, x));
            let by_x = product(product(value, y), inverse);
            let by_y = product(value, ln);
            let lower = add(y, [-1.0, -1.0]);
            Partials {
                first: [by_x, by_y],
                second: [
                    product(product(by_x, lower), inverse),
                    product(product(value, inverse), add(ONE, product(y, ln))),
                    product(by_y, ln),
                ],
            }
        }
        Binary::Atan2 | Binary::Pow | Binary::Min | Binary::Max => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CubicSpline, FormulaBuilder, Outside, Pchip, formula_node};

    /// With room for rounding.
    fn has([least, largest]: [f64; 2], value: f64) -> bool {
        let room = 1e-9 * value.abs().max(1.0);
        !value.is_finite() || (value >= least - room && value <= largest + room)
    }

    /// Values and derivatives at points of a box are within the intervals of the box.
    fn assert_encloses(formula: &Formula, ranges: &[[f64; 2]], what: &str) {
        let n = formula.inputs();
        let function = formula_node(formula.clone());
        let mut expansion = Expansion::new(formula.clone());
        expansion.set(ranges);
        let entries = function.pattern().jacobian_len();
        for k in 0..64_u32 {
            let fraction = |j: usize| f64::from((k / 4_u32.pow(j as u32)) % 8) / 7.0;
            let z: Vec<f64> =
                ranges.iter().enumerate().map(|(j, r)| r[0] + fraction(j) * (r[1] - r[0])).collect();
            let (mut value, mut jacobian) = ([0.0], vec![0.0; entries]);
            function.jacobian(&z, &mut value, &mut jacobian);
            // Where there is no value there are no derivatives.
            if !value[0].is_finite() {
                continue;
            }
            let mut hessian = vec![0.0; function.pattern().hessian_len()];
            function.hessian(&z, &[1.0], &mut hessian);
            assert!(has(expansion.value(0), value[0]), "{what} {ranges:?} at {z:?}");
            for ((_, j), entry) in function.pattern().jacobian_entries().zip(&jacobian) {
                let found = expansion.gradient(0)[j];
                assert!(has(found, *entry), "{what} {ranges:?} at {z:?}: {entry} in {found:?}");
            }
            for (&(i, j), entry) in function.pattern().hessian.iter().zip(&hessian) {
                let (i, j) = (i.max(j), i.min(j));
                let found = expansion.hessian(0)[i * (i + 1) / 2 + j];
                assert!(has(found, *entry), "{what} {ranges:?} at {z:?}: {entry} in {found:?}");
            }
        }
        assert_eq!(expansion.hessian(0).len(), n * (n + 1) / 2);
    }

    const RANGES: [[f64; 2]; 6] =
        [[-2.5, -0.5], [-0.7, 0.9], [0.2, 0.9], [1.1, 3.0], [-4.0, 5.0], [0.6, 0.6]];

    #[test]
    fn derivatives_at_points_of_the_box_are_between_the_bounds() {
        for f in Unary::ALL {
            for range in RANGES {
                let mut b = FormulaBuilder::new(1);
                let x = b.input(0);
                let value = b.unary(f, x);
                assert_encloses(&b.formula(&[value]).expect("well formed"), &[range], f.name());
            }
        }
        for f in Binary::ALL {
            for (x, y) in RANGES.iter().flat_map(|x| RANGES.iter().map(move |y| (*x, *y))) {
                // A base is not negative.
                let x = if f == Binary::Pow { x.map(|v| v.max(0.0)) } else { x };
                let mut b = FormulaBuilder::new(2);
                let (p, q) = (b.input(0), b.input(1));
                let value = b.binary(f, p, q);
                assert_encloses(&b.formula(&[value]).expect("well formed"), &[x, y], f.name());
            }
        }
        for n in [-3, -1, 2, 3, 4] {
            for range in RANGES {
                let mut b = FormulaBuilder::new(1);
                let x = b.input(0);
                let value = b.powi(x, n);
                assert_encloses(&b.formula(&[value]).expect("well formed"), &[range], "powi");
                let value = b.powf(x, 0.5 * f64::from(n) + 0.25);
                assert_encloses(&b.formula(&[value]).expect("well formed"), &[range], "powf");
            }
        }
    }

    #[test]
    fn values_and_slopes_alone_are_those_with_curvatures() {
        // sin(a) b + c, of which c is a number.
        let mut f = FormulaBuilder::new(2);
        let (a, b, c) = (f.input(0), f.input(1), f.constant(2.0));
        let sine = f.sin(a);
        let product = f.mul(sine, b);
        let sum = f.add(product, c);
        let formula = f.formula(&[sum, sine]).expect("well formed");
        let (mut whole, mut part) = (Expansion::new(formula.clone()), Expansion::new(formula));
        assert_eq!((whole.inputs_of(0), whole.inputs_of(1)), (&[0, 1][..], &[0][..]));
        for ranges in [[[0.1, 0.2], [3.0, 4.0]], [[-1.0, 0.5], [-2.0, 1.0]]] {
            whole.set(&ranges);
            part.set_to(Derivatives::Values, &ranges);
            assert_eq!((part.value(0), part.value(1)), (whole.value(0), whole.value(1)));
            part.set_to(Derivatives::Slopes, &ranges);
            assert_eq!(part.gradient(0), whole.gradient(0));
            assert_eq!(whole.gradient(1)[1], ZERO);
        }
    }

    #[test]
    fn derivatives_of_tables_are_between_the_bounds() {
        let (knots, values) = ([-2.0, -0.5, 0.4, 1.0, 2.5], [1.0, -0.5, 0.0, 2.0, 1.5]);
        let tables: [Table; 3] = [
            CubicSpline::new(&knots, &values).expect("a table").into(),
            Pchip::new(&knots, &values, Outside::Constant).expect("a table").into(),
            Pchip::new(&knots, &values, Outside::Linear).expect("a table").into(),
        ];
        for table in tables {
            for range in RANGES.into_iter().chain([[-6.0, -3.0], [3.0, 3.5]]) {
                let mut b = FormulaBuilder::new(1);
                let (x, table) = (b.input(0), b.table(table.clone()));
                let looked_up = b.curve(table, x);
                assert_encloses(&b.formula(&[looked_up]).expect("well formed"), &[range], "table");
            }
        }
    }

    #[test]
    fn a_quadratic_has_its_second_derivatives_anywhere() {
        // 3 a^2 + a b - 2 a over all numbers.
        let mut f = FormulaBuilder::new(2);
        let (a, b) = (f.input(0), f.input(1));
        let (square, product) = (f.square(a), f.mul(a, b));
        let (three, two) = (f.constant(3.0), f.constant(2.0));
        let (square, twice) = (f.mul(three, square), f.mul(two, a));
        let sum = f.add(square, product);
        let value = f.sub(sum, twice);
        let mut expansion = Expansion::new(f.formula(&[value]).expect("well formed"));
        expansion.set(&[ALL; 2]);
        assert_eq!(expansion.hessian(0), [[6.0, 6.0], [1.0, 1.0], ZERO]);
        expansion.set(&[[1.0, 2.0], [0.0, 1.0]]);
        assert_eq!(expansion.gradient(0), [[4.0, 11.0], [1.0, 2.0]]);
        assert_eq!(expansion.value(0), [-1.0, 12.0]);
    }

    /// A reciprocal falls on both sides of its pole, and is larger behind it all the same.
    #[test]
    fn across_a_pole_nothing_is_known() {
        let mut f = FormulaBuilder::new(1);
        let (x, one) = (f.input(0), f.constant(1.0));
        let (recip, cube, tan, shifted) = (f.recip(x), f.powi(x, -3), f.tan(x), f.add(x, one));
        let quotient = f.div(one, shifted);
        let two = f.constant(2.0);
        let other = f.div(two, x);
        let formula = f.formula(&[recip, cube, tan, quotient, other]).expect("well formed");
        let mut expansion = Expansion::new(formula);
        expansion.set(&[[-2.0, 2.0]]);
        for output in 0..5 {
            assert_eq!(expansion.value(output), ALL);
            assert_eq!((expansion.gradient(output), expansion.hessian(output)), (&[ALL][..], &[ALL][..]));
        }
        expansion.set(&[[0.5, 1.0]]);
        assert_eq!(
            (expansion.gradient(0), expansion.gradient(4)),
            (&[[-4.0, -1.0]][..], &[[-8.0, -2.0]][..])
        );
    }

    #[test]
    fn a_kink_is_convex_and_a_jump_is_not_known() {
        let mut f = FormulaBuilder::new(1);
        let x = f.input(0);
        let (kink, jump) = (f.abs(x), f.sign(x));
        let mut expansion = Expansion::new(f.formula(&[kink, jump]).expect("well formed"));
        expansion.set(&[[-1.0, 2.0]]);
        assert_eq!((expansion.gradient(0), expansion.hessian(0)), (&[[-1.0, 1.0]][..], &[CONVEX_KINK][..]));
        assert_eq!((expansion.gradient(1), expansion.hessian(1)), (&[ALL][..], &[ALL][..]));
    }
}
