//! The curvature of a formula in its variables, by the rules of disciplined convex programming (M. Grant, S. Boyd, Y. Ye, Disciplined
//! Convex Programming, in Global Optimization: From Theory to Implementation, Springer 2006, doi 10.1007/0-387-30528-9_7).
//!
//! The rules are sufficient: a function that they call convex is so at every point, and where they do not apply nothing is said. Besides
//! them a polynomial of degree two is what its second derivatives are, which are the same everywhere.

use apsides_ad::formula::{Binary, Formula, Operation, Unary};
use apsides_ad::{AdError, NodeFunction};
use nalgebra::DMatrix;

/// Eigenvalues above minus this, beside a diagonal of ones, are zero.
const ROUNDING: f64 = 1e-12;

/// The curvature of a function over the whole range of its variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Curvature {
    /// The variables do not occur.
    Constant,
    Affine,
    Convex,
    Concave,
    Unknown,
}

impl Curvature {
    pub(super) fn is_affine(self) -> bool {
        matches!(self, Self::Constant | Self::Affine)
    }

    pub(super) fn is_convex(self) -> bool {
        self.is_affine() || self == Self::Convex
    }

    pub(super) fn is_concave(self) -> bool {
        self.is_affine() || self == Self::Concave
    }

    fn negated(self) -> Self {
        match self {
            Self::Convex => Self::Concave,
            Self::Concave => Self::Convex,
            same => same,
        }
    }

    fn plus(self, other: Self) -> Self {
        match (self, other) {
            (Self::Constant, Self::Constant) => Self::Constant,
            (a, b) if a.is_affine() && b.is_affine() => Self::Affine,
            (a, b) if a.is_convex() && b.is_convex() => Self::Convex,
            (a, b) if a.is_concave() && b.is_concave() => Self::Concave,
            _ => Self::Unknown,
        }
    }

    /// Times a number within an interval.
    fn times(self, factor: [f64; 2]) -> Self {
        match self {
            same if same.is_affine() || factor[0] >= 0.0 => same,
            same if factor[1] <= 0.0 => same.negated(),
            _ => Self::Unknown,
        }
    }

    /// Convex or concave where the rule holds, else unknown.
    fn when(holds: bool, curvature: Self) -> Self {
        if holds { curvature } else { Self::Unknown }
    }

    /// The curvature of the function times a number.
    pub(super) fn weighted(self, weight: f64) -> Self {
        if weight == 0.0 { Self::Constant } else { self.times([weight; 2]) }
    }
}

/// One value of a formula.
#[derive(Clone, Copy)]
struct Shape {
    curvature: Curvature,
    /// Degree as a polynomial of the variables, if at most two, with coefficients that time does not change.
    degree: Option<u32>,
    /// Time, or another input that is no variable, occurs.
    is_timed: bool,
    /// A sum of squares of affine functions and of a number that is not negative.
    is_sum_of_squares: bool,
}

/// The curvature of each output of a function in those inputs that are variables, each input within its bounds. Unknown where the function
/// has parts that are known by their values alone.
pub(super) fn curvatures(
    function: &dyn NodeFunction,
    bounds: &[[f64; 2]],
    is_variable: &[bool],
) -> Vec<Curvature> {
    let unknown = || vec![Curvature::Unknown; function.outputs()];
    let Ok(formula) = function.formula() else { return unknown() };
    let Ok(shapes) = shapes(&formula, bounds, is_variable) else { return unknown() };
    let output = |(k, value): (usize, &usize)| match shapes[*value] {
        Shape { curvature: Curvature::Unknown, degree: Some(2), .. } => quadratic(function, k),
        shape => shape.curvature,
    };
    formula.outputs().iter().enumerate().map(output).collect()
}

/// The curvature of each output of a formula by the rules alone, in all inputs.
pub(super) fn by_rules(formula: &Formula, bounds: &[[f64; 2]]) -> Vec<Curvature> {
    let outputs = formula.outputs();
    shapes(formula, bounds, &vec![true; bounds.len()]).map_or_else(
        |_| vec![Curvature::Unknown; outputs.len()],
        |shapes| outputs.iter().map(|value| shapes[*value].curvature).collect(),
    )
}

/// The curvature of an output that is a polynomial of degree two.
fn quadratic(function: &dyn NodeFunction, output: usize) -> Curvature {
    let pairs = &function.pattern().hessian;
    let n = function.inputs();
    let mut weights = vec![0.0; function.outputs()];
    weights[output] = 1.0;
    let mut entries = vec![0.0; pairs.len()];
    function.hessian(&vec![0.0; n], &weights, &mut entries);
    if !entries.iter().all(|v| v.is_finite()) {
        return Curvature::Unknown;
    }
    let mut hessian = DMatrix::zeros(n, n);
    for (&(i, j), v) in pairs.iter().zip(&entries) {
        hessian[(i, j)] = *v;
        hessian[(j, i)] = *v;
    }
    if is_positive_semidefinite(&hessian) {
        Curvature::Convex
    } else {
        Curvature::when(is_positive_semidefinite(&-hessian), Curvature::Concave)
    }
}

/// By the eigenvalues with a diagonal of ones: a variable of a large weight says nothing of the others.
fn is_positive_semidefinite(matrix: &DMatrix<f64>) -> bool {
    let n = matrix.nrows();
    let sizes: Vec<f64> = (0..n).map(|i| matrix[(i, i)].sqrt()).collect();
    // A negative entry of the diagonal has no root. Beside one that is zero nothing else may stand.
    let is_possible =
        (0..n).all(|i| sizes[i] > 0.0 || sizes[i] == 0.0 && matrix.row(i).iter().all(|v| *v == 0.0));
    let scaled = |i: usize, j: usize| {
        if sizes[i] == 0.0 || sizes[j] == 0.0 { 0.0 } else { matrix[(i, j)] / sizes[i] / sizes[j] }
    };
    is_possible && DMatrix::from_fn(n, n, scaled).symmetric_eigenvalues().min() >= -ROUNDING
}

fn shapes(formula: &Formula, bounds: &[[f64; 2]], is_variable: &[bool]) -> Result<Vec<Shape>, AdError> {
    let inputs = formula.inputs();
    // The same operations with every value as an output.
    let tables = formula.tables().iter().map(|t| (**t).clone()).collect();
    let count = inputs + formula.operations().len();
    let all = Formula::new(inputs, formula.operations().to_vec(), tables, (0..count).collect())?;
    let ranges = all.enclosure(bounds);
    let mut shapes: Vec<Shape> = is_variable
        .iter()
        .map(|variable| Shape {
            curvature: if *variable { Curvature::Affine } else { Curvature::Constant },
            degree: Some(u32::from(*variable)),
            is_timed: !variable,
            is_sum_of_squares: false,
        })
        .collect();
    for operation in formula.operations() {
        shapes.push(shape(*operation, &shapes, &ranges));
    }
    Ok(shapes)
}

fn shape(operation: Operation, shapes: &[Shape], ranges: &[[f64; 2]]) -> Shape {
    let of = |k: usize| shapes[k];
    if operation.operands().all(|k| of(k).curvature == Curvature::Constant) {
        let at_least_zero = matches!(operation, Operation::Constant(c) if c >= 0.0)
            || operation.operands().all(|k| of(k).is_sum_of_squares) && is_sum(operation);
        return Shape {
            curvature: Curvature::Constant,
            degree: Some(0),
            is_timed: operation.operands().any(|k| of(k).is_timed),
            is_sum_of_squares: at_least_zero,
        };
    }
    let is_constant = |k: usize| of(k).curvature == Curvature::Constant;
    let is_square = |k: usize| of(k).curvature.is_affine();
    let mut squares = false;
    let curvature = match operation {
        Operation::Constant(_) => Curvature::Constant,
        Operation::Unary(f, k) => unary(f, of(k), ranges[k]),
        Operation::Binary(Binary::Add, a, b) => {
            squares = of(a).is_sum_of_squares && of(b).is_sum_of_squares;
            of(a).curvature.plus(of(b).curvature)
        }
        Operation::Binary(Binary::Sub, a, b) => of(a).curvature.plus(of(b).curvature.negated()),
        Operation::Binary(Binary::Mul, a, b) if a == b => {
            squares = is_square(a);
            power(of(a).curvature, ranges[a], 2)
        }
        Operation::Binary(Binary::Mul, a, b) if is_constant(a) || is_constant(b) => {
            let (factor, other) = if is_constant(a) { (a, b) } else { (b, a) };
            squares = ranges[factor][0] >= 0.0 && of(other).is_sum_of_squares;
            of(other).curvature.times(ranges[factor])
        }
        // A divisor of either sign changes the sign of the whole.
        Operation::Binary(Binary::Div, a, b) if is_constant(b) => of(a).curvature.times(ranges[b]),
        Operation::Binary(Binary::Div, a, b) if is_constant(a) => {
            let inverse =
                Curvature::when(of(b).curvature.is_concave() && ranges[b][0] > 0.0, Curvature::Convex);
            inverse.times(ranges[a])
        }
        Operation::Binary(Binary::Max, a, b) => {
            Curvature::when(of(a).curvature.is_convex() && of(b).curvature.is_convex(), Curvature::Convex)
        }
        Operation::Binary(Binary::Min, a, b) => {
            Curvature::when(of(a).curvature.is_concave() && of(b).curvature.is_concave(), Curvature::Concave)
        }
        Operation::Powi(k, n) => {
            squares = n == 2 && is_square(k);
            power(of(k).curvature, ranges[k], n)
        }
        Operation::Powf(k, p) => real_power(of(k).curvature, ranges[k], p),
        Operation::Select(c, a, _) if ranges[c][0] >= 0.0 => of(a).curvature,
        Operation::Select(c, _, b) if ranges[c][1] < 0.0 => of(b).curvature,
        Operation::Binary(..) | Operation::Select(..) | Operation::Curve(..) | Operation::Surface(..) => {
            Curvature::Unknown
        }
    };
    let (degree, is_timed) = degree(operation, shapes);
    Shape { curvature, degree, is_timed, is_sum_of_squares: squares }
}

fn is_sum(operation: Operation) -> bool {
    matches!(operation, Operation::Binary(Binary::Add | Binary::Mul, ..) | Operation::Powi(_, 2))
}

/// The degree in the variables, and whether time occurs.
fn degree(operation: Operation, shapes: &[Shape]) -> (Option<u32>, bool) {
    let of = |k: usize| shapes[k];
    let is_timed = operation.operands().any(|k| of(k).is_timed);
    let degree = match operation {
        Operation::Unary(Unary::Neg, k) => of(k).degree,
        Operation::Binary(Binary::Add | Binary::Sub, a, b) => {
            of(a).degree.zip(of(b).degree).map(|(a, b)| a.max(b))
        }
        Operation::Binary(Binary::Mul, a, b) => of(a).degree.zip(of(b).degree).map(|(a, b)| a + b),
        Operation::Binary(Binary::Div, a, b) if of(b).degree == Some(0) => of(a).degree,
        Operation::Powi(k, n) if n >= 1 => of(k).degree.map(|d| d.saturating_mul(n.unsigned_abs())),
        _ => None,
    };
    // Coefficients that change with time are left to the rules.
    (degree.filter(|d| *d <= 1 || (*d == 2 && !is_timed)), is_timed)
}

fn unary(f: Unary, of: Shape, range: [f64; 2]) -> Curvature {
    let c = of.curvature;
    match f {
        Unary::Neg => c.negated(),
        Unary::Exp => Curvature::when(c.is_convex(), Curvature::Convex),
        Unary::Ln => Curvature::when(c.is_concave(), Curvature::Concave),
        // The length of a vector of affine functions.
        Unary::Sqrt if of.is_sum_of_squares => Curvature::Convex,
        Unary::Sqrt => Curvature::when(c.is_concave(), Curvature::Concave),
        Unary::Abs | Unary::Cosh => {
            let grows = c.is_convex() && range[0] >= 0.0 || c.is_concave() && range[1] <= 0.0;
            Curvature::when(c.is_affine() || grows, Curvature::Convex)
        }
        Unary::Recip => Curvature::when(c.is_concave() && range[0] > 0.0, Curvature::Convex),
        _ => Curvature::Unknown,
    }
}

fn power(c: Curvature, range: [f64; 2], n: i32) -> Curvature {
    match n {
        0 => Curvature::Constant,
        1 => c,
        n if n < 0 => Curvature::when(c.is_concave() && range[0] > 0.0, Curvature::Convex),
        n if n % 2 == 0 => {
            let grows = c.is_convex() && range[0] >= 0.0 || c.is_concave() && range[1] <= 0.0;
            Curvature::when(c.is_affine() || grows, Curvature::Convex)
        }
        _ if c.is_convex() && range[0] >= 0.0 => Curvature::Convex,
        _ => Curvature::when(c.is_concave() && range[1] <= 0.0, Curvature::Concave),
    }
}

/// Where the base is negative there is no value, so that the rest is a convex set.
fn real_power(c: Curvature, range: [f64; 2], p: f64) -> Curvature {
    if p >= 1.0 {
        Curvature::when(c.is_affine() || c.is_convex() && range[0] >= 0.0, Curvature::Convex)
    } else if p > 0.0 {
        Curvature::when(c.is_concave(), Curvature::Concave)
    } else {
        Curvature::when(c.is_concave() && range[0] >= 0.0, Curvature::Convex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use apsides_ad::{FormulaBuilder, Scalar, VectorFunction, formula_node, vector_node};

    /// Functions of two variables and a time.
    struct Case(u8);
    impl VectorFunction<3, 1> for Case {
        fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 1] {
            let [a, b, t] = *z;
            [match self.0 {
                0 => a * 2.0 + b * t.sin() - t,
                1 => a * a + a * b + b * b,
                2 => a * a + a * b * 3.0 + b * b,
                3 => -(a * a),
                4 => a.abs(),
                5 => a.abs().abs() * -1.0,
                6 => (-t).exp() * a.square(),
                7 => t.sin() * a.square(),
                8 => (a.square() + b.square() + 1.0).sqrt(),
                9 => (a * b).sqrt(),
                10 => a.exp() + b * b,
                11 => a.max(b * 3.0),
                12 => a.min(b),
                13 => a.square() - (-((a - 9.0) * 10.0).square()).exp() * 90.0,
                14 => (b - t.cos()).square(),
                15 => a * b,
                16 => a.powi(4),
                17 => a.powi(3),
                18 => a.sin(),
                // A large weight beside a small one of the other sign is no rounding.
                19 => b.square() * 1e13 - a.square(),
                20 => (a * 1e-7 + b * 1e7).square(),
                _ => (a - 30.0).select(a * 900.0, a.square()),
            }]
        }
    }

    #[test]
    fn curvature_by_case() {
        use Curvature::{Affine, Concave, Convex, Unknown};
        let expected = [
            Affine, Convex, Unknown, Concave, Convex, Concave, Convex, Unknown, Convex, Unknown, Convex,
            Convex, Concave, Unknown, Convex, Unknown, Convex, Unknown, Unknown, Unknown, Convex, Unknown,
        ];
        for (case, expected) in expected.into_iter().enumerate() {
            let function = vector_node(Case(case as u8));
            let bounds = [[f64::NEG_INFINITY, f64::INFINITY], [-1.0, 2.0], [0.0, 5.0]];
            let found = curvatures(function.as_ref(), &bounds, &[true, true, false]);
            assert_eq!(found, [expected], "case {case}");
        }
    }

    #[test]
    fn signs_come_from_bounds() {
        for (lower, expected) in [(0.0, Curvature::Convex), (-1.0, Curvature::Unknown)] {
            let mut f = FormulaBuilder::new(1);
            let x = f.input(0);
            let cube = f.powi(x, 3);
            let function = formula_node(f.formula(&[cube]).expect("well formed"));
            assert_eq!(curvatures(function.as_ref(), &[[lower, 2.0]], &[true]), [expected]);
        }
    }
}
