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
    ALL, Interval, ONE, ZERO, add, binary, contains_zero, hull, known, power, product, quotient, real_power,
    scale, square, unary,
};
use crate::table::Table;

/// Curvature of a kink that is convex.
const CONVEX_KINK: Interval = [0.0, f64::INFINITY];

/// A formula with the intervals of its values and derivatives over the last box.
#[derive(Clone, Debug)]
pub struct Expansion {
    formula: Formula,
    /// One for each value: it depends on inputs.
    depends: Vec<bool>,
    /// Intervals of one value: itself, the gradient, the lower triangle of the Hessian by rows.
    stride: usize,
    intervals: Vec<Interval>,
}

impl Expansion {
    /// A formula that is to be bounded.
    #[must_use]
    pub fn new(formula: Formula) -> Self {
        let n = formula.inputs();
        let mut depends = vec![true; n];
        for operation in formula.operations() {
            let any = operation.operands().any(|k| depends[k]);
            depends.push(any);
        }
        let stride = 1 + n + n * (n + 1) / 2;
        let intervals = vec![ZERO; stride * depends.len()];
        Self { formula, depends, stride, intervals }
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
        let n = self.formula.inputs();
        assert_eq!(inputs.len(), n, "one interval for each input");
        for (k, range) in inputs.iter().enumerate() {
            let value = &mut self.intervals[k * self.stride..(k + 1) * self.stride];
            value.fill(ZERO);
            value[0] = *range;
            value[1 + k] = ONE;
        }
        for k in 0..self.formula.operations().len() {
            let place = n + k;
            let (before, after) = self.intervals.split_at_mut(place * self.stride);
            let (depends, tables) = (&self.depends, self.formula.tables());
            let values = Values { n, stride: self.stride, before, depends, tables };
            values.operate(self.formula.operations()[k], &mut after[..self.stride]);
        }
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

    /// Adds the outputs, each times its weight, with their gradients and Hessians to `sum`, of length [`width`](Self::width).
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
    depends: &'a [bool],
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
            Operation::Constant(c) => {
                out.fill(ZERO);
                out[0] = [c, c];
            }
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
                let sign = if matches!(operation, Operation::Binary(Binary::Add, ..)) { 1.0 } else { -1.0 };
                let (a, b) = (a * self.stride, b * self.stride);
                for (k, out) in out.iter_mut().enumerate() {
                    *out = add(self.before[a + k], scale(self.before[b + k], sign));
                }
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
                self.of_two(a, b, value, partials(f, range(a), range(b), value), out);
            }
            Operation::Select(condition, a, b) => match range(condition) {
                [least, _] if least >= 0.0 => self.copy(a, out),
                [_, largest] if largest < 0.0 => self.copy(b, out),
                _ => {
                    out.fill(ALL);
                    out[0] = hull(range(a), range(b));
                }
            },
            Operation::Curve(t, k) => {
                let [value, first, second] = self.tables[t].curve_enclosure(range(k));
                self.of_one(k, value, || [first, second], out);
            }
            Operation::Surface(..) => out.fill(ALL),
        }
        out.iter_mut().for_each(|v| *v = known(*v));
    }

    fn copy(&self, k: usize, out: &mut [Interval]) {
        out.copy_from_slice(&self.before[k * self.stride..(k + 1) * self.stride]);
    }

    /// The smaller or the larger of two values: half their sum and half their distance, which has a kink.
    fn either(&self, f: Binary, a: usize, b: usize, out: &mut [Interval]) {
        let kink = if f == Binary::Min { [f64::NEG_INFINITY, 0.0] } else { CONVEX_KINK };
        out[0] = binary(f, self.range(a), self.range(b));
        let (ga, gb, ha, hb) = (self.gradient(a), self.gradient(b), self.hessian(a), self.hessian(b));
        let apart = |i: usize| add(ga[i], scale(gb[i], -1.0));
        let mut entry = 0;
        for i in 0..self.n {
            out[1 + i] = hull(ga[i], gb[i]);
            for j in 0..=i {
                let both = if i == j { square(apart(i)) } else { product(apart(i), apart(j)) };
                out[1 + self.n + entry] = add(hull(ha[entry], hb[entry]), product(kink, both));
                entry += 1;
            }
        }
    }

    fn of_one(
        &self,
        k: usize,
        value: Interval,
        derivatives: impl FnOnce() -> [Interval; 2],
        out: &mut [Interval],
    ) {
        out.fill(ZERO);
        out[0] = value;
        if !self.depends[k] {
            return;
        }
        let [first, second] = derivatives().map(known);
        let (gradient, hessian) = (self.gradient(k), self.hessian(k));
        let mut entry = 0;
        for i in 0..self.n {
            out[1 + i] = product(first, gradient[i]);
            for j in 0..=i {
                let both = if i == j { square(gradient[i]) } else { product(gradient[i], gradient[j]) };
                out[1 + self.n + entry] = add(product(second, both), product(first, hessian[entry]));
                entry += 1;
            }
        }
    }

    fn of_two(&self, a: usize, b: usize, value: Interval, partials: Partials, out: &mut [Interval]) {
        out.fill(ZERO);
        out[0] = value;
        let Partials { first: [x, y], second: [xx, xy, yy] } = partials;
        let (ga, gb, ha, hb) = (self.gradient(a), self.gradient(b), self.hessian(a), self.hessian(b));
        let times = |factor: Interval, one: &[Interval], other: &[Interval], i: usize, j: usize| {
            let both =
                if i == j && std::ptr::eq(one, other) { square(one[i]) } else { product(one[i], other[j]) };
            product(factor, both)
        };
        let mut entry = 0;
        for i in 0..self.n {
            out[1 + i] = add(product(x, ga[i]), product(y, gb[i]));
            for j in 0..=i {
                let mixed = add(product(ga[i], gb[j]), product(ga[j], gb[i]));
                let second = add(times(xx, ga, ga, i, j), times(yy, gb, gb, i, j));
                let second = add(second, product(xy, mixed));
                let first = add(product(x, ha[entry]), product(y, hb[entry]));
                out[1 + self.n + entry] = add(second, first);
                entry += 1;
            }
        }
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
    let minus = |x: Interval| scale(x, -1.0);
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
