use num_dual::{Dual2_64, DualNum, HyperDual64};
use proptest::prelude::*;

use super::*;
use crate::error::Taker;
use crate::formula::{Binary, Operation, Unary};
use crate::{
    AdError, BicubicSpline, CubicSpline, Dual, FormulaBuilder, HyperDual, Outside, Pchip, Scalar, Table,
    Value, VectorFunction, vector, vector_node,
};

/// Round-off of two orders of the same sums, relative to the largest number of a derivative.
const ROUNDING: f64 = 1e-11;

pub(crate) fn near(found: f64, expected: f64, scale: f64) -> bool {
    found == expected
        || found.is_nan() && expected.is_nan()
        || (found - expected).abs() <= ROUNDING * scale.max(expected.abs())
}

/// Checks value, Jacobian and Hessian of a formula at a point against dual and hyper-dual numbers.
fn assert_derivatives(formula: &Formula, z: &[f64]) {
    let node = formula_node(formula.clone());
    let pattern = node.pattern();
    let (n, m) = (node.inputs(), node.outputs());
    let values = formula.evaluate(z);
    let mut out = vec![f64::NAN; m];
    node.value(z, &mut out);
    assert!(out.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()), "{out:?} {values:?}");
    let (mut again, mut entries) = (vec![f64::NAN; m], vec![f64::NAN; pattern.jacobian_len()]);
    node.jacobian(z, &mut again, &mut entries);
    assert!(again.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()), "{again:?} {values:?}");
    let mut dense = vec![vec![0.0; n]; m];
    for ((r, c), v) in pattern.jacobian_entries().zip(&entries) {
        dense[r][c] = *v;
    }
    for c in 0..n {
        let seeded: Vec<_> =
            z.iter().enumerate().map(|(k, &x)| Dual::<1>::variable(x, usize::from(k != c))).collect();
        for (r, v) in formula.evaluate(&seeded).iter().enumerate() {
            assert!(near(dense[r][c], v.eps[0], 1.0), "d{r}/d{c}: {} {} at {z:?}", dense[r][c], v.eps[0]);
        }
    }
    let weights: Vec<f64> = (0..m).map(|k| 1.5 - 0.7 * k as f64).collect();
    let mut hessian = vec![f64::NAN; pattern.hessian_len()];
    node.hessian(z, &weights, &mut hessian);
    let mut dense = vec![vec![0.0; n]; n];
    for (&(i, j), h) in pattern.hessian.iter().zip(&hessian) {
        assert!(j <= i);
        dense[i][j] = *h;
    }
    for i in 0..n {
        for j in 0..=i {
            let seed = |k: usize, x: f64| HyperDual::<1> {
                re: x,
                e1: [f64::from(u8::from(k == i))],
                e2: [f64::from(u8::from(k == j))],
                e12: [0.0],
            };
            let seeded: Vec<_> = z.iter().enumerate().map(|(k, &x)| seed(k, x)).collect();
            let parts = formula.evaluate(&seeded);
            let expected: f64 = parts.iter().zip(&weights).map(|(v, w)| w * v.e12[0]).sum();
            let size =
                parts.iter().fold(1.0_f64, |s, v| s.max(v.e12[0].abs()).max((v.e1[0] * v.e2[0]).abs()));
            assert!(near(dense[i][j], expected, size), "d2/d{i}d{j}: {} {expected} at {z:?}", dense[i][j]);
        }
    }
}

/// Points in the domain of a function.
fn domain(f: Unary) -> [f64; 2] {
    match f {
        Unary::Asin | Unary::Acos | Unary::Atanh => [-0.95, 0.95],
        Unary::Acosh => [1.05, 9.0],
        Unary::Sqrt | Unary::Ln => [0.05, 9.0],
        Unary::Tan => [-1.5, 1.5],
        _ => [-3.0, 3.1],
    }
}

/// The oracle's function; none for those that it does not have.
fn oracle<D: DualNum<Primitive = f64>>(f: Unary, x: D) -> Option<D> {
    Some(match f {
        Unary::Neg => -x,
        Unary::Sin => x.sin(),
        Unary::Cos => x.cos(),
        Unary::Tan => x.tan(),
        Unary::Asin => x.asin(),
        Unary::Acos => x.acos(),
        Unary::Atan => x.atan(),
        Unary::Sqrt => x.sqrt(),
        Unary::Cbrt => x.cbrt(),
        Unary::Exp => x.exp(),
        Unary::Ln => x.ln(),
        Unary::Sinh => x.sinh(),
        Unary::Cosh => x.cosh(),
        Unary::Tanh => x.tanh(),
        Unary::Asinh => x.asinh(),
        Unary::Acosh => x.acosh(),
        Unary::Atanh => x.atanh(),
        Unary::Recip => x.recip(),
        Unary::Abs | Unary::Sign => return None,
    })
}

fn hessian(formula: &Formula, z: &[f64]) -> Vec<f64> {
    let node = formula_node(formula.clone());
    let mut entries = vec![f64::NAN; node.pattern().hessian_len()];
    node.hessian(z, &vec![1.0; node.outputs()], &mut entries);
    entries
}

fn jacobian(formula: &Formula, z: &[f64]) -> Vec<f64> {
    let node = formula_node(formula.clone());
    let mut entries = vec![f64::NAN; node.pattern().jacobian_len()];
    node.jacobian(z, &mut vec![0.0; node.outputs()], &mut entries);
    entries
}

#[test]
fn functions_of_one_value_agree_with_num_dual() {
    for f in Unary::ALL {
        let mut b = FormulaBuilder::new(1);
        let x = b.input(0);
        let y = b.unary(f, x);
        let formula = b.formula(&[y]).unwrap();
        let [from, to] = domain(f);
        for k in 0..=200 {
            let x = from + (to - from) * (f64::from(k) + 0.37) / 201.0;
            assert_derivatives(&formula, &[x]);
            let Some(expected) = oracle(f, Dual2_64::from(x).derivative()) else { continue };
            assert!(near(formula.evaluate(&[x])[0], expected.re, 1.0), "{f:?}");
            assert!(near(jacobian(&formula, &[x])[0], expected.v1, 1.0), "{f:?}' at {x}");
            if f != Unary::Neg {
                assert!(near(hessian(&formula, &[x])[0], expected.v2, 1.0), "{f:?}'' at {x}");
            }
        }
    }
}

#[test]
fn functions_of_two_values_agree_with_num_dual() {
    for f in Binary::ALL {
        let mut b = FormulaBuilder::new(2);
        let (x, y) = (b.input(0), b.input(1));
        let z = b.binary(f, x, y);
        let formula = b.formula(&[z]).unwrap();
        for i in 0..20 {
            for j in 0..20 {
                let (x, y) = (0.07 + 0.21 * f64::from(i), -1.93 + 0.217 * f64::from(j));
                assert_derivatives(&formula, &[x, y]);
                let (p, q) = (HyperDual64::from(x).derivative1(), HyperDual64::from(y).derivative2());
                let expected = match f {
                    Binary::Add => p + q,
                    Binary::Sub => p - q,
                    Binary::Mul => p * q,
                    Binary::Div => p / q,
                    Binary::Atan2 => DualNum::atan2(&p, q),
                    Binary::Pow => p.powd(q),
                    Binary::Min => {
                        if x <= y {
                            p
                        } else {
                            q
                        }
                    }
                    Binary::Max => {
                        if x >= y {
                            p
                        } else {
                            q
                        }
                    }
                };
                let entries = jacobian(&formula, &[x, y]);
                assert!(
                    near(entries[0], expected.eps1, 1.0) && near(entries[1], expected.eps2, 1.0),
                    "{f:?}"
                );
                let pattern = formula_node(formula.clone());
                let place = pattern.pattern().hessian.iter().position(|p| *p == (1, 0));
                let mixed = place.map_or(0.0, |k| hessian(&formula, &[x, y])[k]);
                assert!(near(mixed, expected.eps1eps2, 1.0), "{f:?} at {x}, {y}: {mixed} {expected:?}");
            }
        }
    }
}

#[test]
fn powers() {
    for n in [-7, -3, -2, -1, 0, 1, 2, 3, 4, 5, 12] {
        let mut b = FormulaBuilder::new(1);
        let x = b.input(0);
        let (p, q) = (b.powi(x, n), b.powf(x, f64::from(n) + 0.3));
        let formula = b.formula(&[p, q]).unwrap();
        for k in 1..50 {
            assert_derivatives(&formula, &[0.1 * f64::from(k)]);
        }
    }
}

pub(crate) fn tables() -> [Table; 3] {
    let (x, y) = ([-1.0, 0.0, 0.4, 1.5, 2.0, 3.0], [0.0, 0.5, 1.0, 2.5, 4.0]);
    let values = [2.0, 1.0, 1.0, -0.5, -0.6, 4.0];
    let surface: Vec<f64> =
        x.iter().flat_map(|a: &f64| y.map(|b: f64| (a * 1.3).sin() * (b + a).cos())).collect();
    [
        CubicSpline::new(&x, &values).unwrap().into(),
        Pchip::new(&x, &values, Outside::Constant).unwrap().into(),
        BicubicSpline::new(&x, &y, &surface).unwrap().into(),
    ]
}

#[test]
fn tables_are_operations() {
    let mut b = FormulaBuilder::new(2);
    let (x, y) = (b.input(0), b.input(1));
    let [spline, pchip, surface] = tables().map(|t| b.table(t));
    let outputs = [b.curve(spline, x), b.curve(pchip, x), b.surface(surface, x, y), b.surface(surface, x, x)];
    let product = b.mul(outputs[0], outputs[2]);
    let formula = b.formula(&[outputs[0], outputs[1], outputs[2], outputs[3], product]).unwrap();
    for k in 0..40 {
        let (x, y) = (-1.7 + 0.13 * f64::from(k), 0.1 * f64::from(k) - 0.3);
        assert_derivatives(&formula, &[x, y]);
    }
    assert_eq!(formula.tables().len(), 3);
    let json = formula.to_json();
    assert!(json.contains(r#"["curve",1,0]"#) && json.contains(r#"["surface",2,0,1]"#), "{json}");
    assert!(
        json.contains(r#""outside":"constant""#) && json.contains(r#"{"kind":"bicubic","x":[-1.0,"#),
        "{json}"
    );
}

/// The same table in a Rust model: an operation of its formula, too.
#[test]
fn tables_of_models_have_formulas() {
    struct Model([Table; 3]);
    impl VectorFunction<2, 3> for Model {
        fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 3] {
            let [Table::Cubic(a), Table::Pchip(b), Table::Bicubic(c)] = &self.0 else { unreachable!() };
            [a.at(z[0]), b.at(z[1] * z[0]), c.at(z[0], z[1])]
        }
    }
    let node = vector_node(Model(tables()));
    let formula = node.formula().unwrap();
    assert_eq!(formula.tables().len(), 3);
    for k in 0..20 {
        let z = [0.1 * f64::from(k) - 0.5, 0.2 * f64::from(k)];
        let mut out = [0.0; 3];
        node.value(&z, &mut out);
        assert_eq!(formula.evaluate(&z), out);
        assert_derivatives(&formula, &z);
    }
}

#[test]
fn choices_hide_what_they_leave_out() {
    let mut b = FormulaBuilder::new(1);
    let x = b.input(0);
    let root = b.sqrt(x);
    let (zero, ln) = (b.constant(0.0), b.ln(x));
    let (first, second) = (b.select(x, root, zero), b.select(x, zero, ln));
    let square = b.square(first);
    let formula = b.formula(&[first, second, square]).unwrap();
    for x in [-2.0, 2.0] {
        assert_derivatives(&formula, &[x]);
    }
    let node = formula_node(formula);
    let (mut out, mut entries, mut h) = ([0.0; 3], [f64::NAN; 3], [f64::NAN]);
    node.jacobian(&[-4.0], &mut out, &mut entries);
    node.hessian(&[-4.0], &[1.0, 0.0, 1.0], &mut h);
    assert!(out[1].is_nan() && (out[0], out[2]) == (0.0, 0.0));
    assert_eq!((entries[0], entries[2], h), (0.0, 0.0, [0.0]), "nothing of the root of a negative number");
    node.value(&[f64::NAN], &mut out);
    assert!(out[0].is_nan(), "a condition that is no number has no side");
}

#[test]
fn smooth_functions_are_what_they_say() {
    let mut b = FormulaBuilder::new(2);
    let (x, y) = (b.input(0), b.input(1));
    let outputs = [
        b.smooth_abs(x, 0.1),
        b.smooth_max(x, y, 0.1),
        b.smooth_min(x, y, 0.1),
        b.smooth_step(x, 0.5),
        b.smooth_select(x, x, y, 0.5),
        b.log10(x),
        b.log2(x),
        b.hypot(x, y),
    ];
    let formula = b.formula(&outputs).unwrap();
    let [abs, max, min, step, ..] = formula.evaluate(&[0.0, 0.0])[..] else { unreachable!() };
    assert_eq!([abs, max, min, step], [0.1, 0.05, -0.05, 0.5]);
    let values = formula.evaluate(&[1000.0, 512.0]);
    // The error of the maximum is half the width squared by twice the distance.
    let far = 0.1 * 0.1 / (4.0 * 488.0);
    assert!(
        near(values[5], 3.0, 0.0) && near(values[1], 1000.0 + far, 0.0) && near(values[2], 512.0 - far, 0.0)
    );
    assert!(values[4] == 1000.0 && near(formula.evaluate(&[512.0, 1.0])[6], 9.0, 0.0));
    for k in 0..30 {
        assert_derivatives(&formula, &[0.2 * f64::from(k) + 0.1, 1.0 - 0.1 * f64::from(k)]);
    }
    assert!(formula.kinks().is_empty());
}

#[test]
fn common_parts_are_shared_and_constants_folded() {
    let mut b = FormulaBuilder::new(2);
    let (x, y) = (b.input(0), b.input(1));
    let (p, q) = (b.mul(x, y), b.mul(y, x));
    assert_eq!(p, q);
    let (zero, one) = (b.constant(0.0), b.constant(1.0));
    assert_eq!(b.add(p, zero), p);
    assert_eq!(b.add(zero, p), p);
    assert_eq!(b.mul(p, one), p);
    assert_eq!(b.div(p, one), p);
    assert_eq!(b.mul(p, zero), zero);
    let opposite = b.neg(p);
    assert_eq!(b.neg(opposite), p);
    assert_eq!(b.sub(zero, p), opposite);
    let (sum, difference) = (b.add(x, opposite), b.sub(x, p));
    assert_eq!(sum, difference);
    let two = b.add(one, one);
    assert_eq!(b.number(two), Some(2.0));
    let root = b.sqrt(two);
    assert_eq!(b.number(root), Some(2.0_f64.sqrt()));
    assert_eq!(b.number(x), None);
    assert_eq!((b.pow(x, two), b.powf(x, 1.0)), (b.square(x), x));
    assert_eq!(b.select(one, x, y), x);
    let formula = b.formula(&[sum, p]).unwrap();
    assert_eq!(
        formula.operations(),
        [Operation::Binary(Binary::Mul, 0, 1), Operation::Binary(Binary::Sub, 0, 2)]
    );
}

#[test]
fn mistakes_are_errors() {
    let new = |operations: Vec<Operation>, tables: Vec<Table>, outputs| {
        Formula::new(2, operations, tables, outputs).unwrap_err()
    };
    let sum = |a, b| Operation::Binary(Binary::Add, a, b);
    assert_eq!(
        new(vec![sum(0, 2)], vec![], vec![]),
        AdError::Operand { taker: Taker::Operation(0), value: 2 }
    );
    assert_eq!(new(vec![sum(0, 1)], vec![], vec![3]), AdError::Operand { taker: Taker::Output(0), value: 3 });
    let table = || tables()[0].clone();
    let outside = AdError::Table { operation: 0, table: 1 };
    assert_eq!(new(vec![Operation::Curve(1, 0)], vec![table()], vec![]), outside);
    let surface = AdError::Table { operation: 0, table: 0 };
    assert_eq!(new(vec![Operation::Surface(0, 0, 1)], vec![table()], vec![]), surface);
    let nan = AdError::NotANumber { operation: 0 };
    assert_eq!(new(vec![Operation::Constant(f64::NAN)], vec![], vec![]), nan);
    assert_eq!(new(vec![Operation::Powf(0, f64::NAN)], vec![], vec![]), nan);
    assert_eq!(Formula::new(usize::MAX, vec![], vec![], vec![]), Err(AdError::TooLarge));

    let build = |f: fn(&mut FormulaBuilder, Value) -> Value| {
        let mut b = FormulaBuilder::new(2);
        let x = b.input(1);
        let y = f(&mut b, x);
        let y = b.sin(y);
        assert_eq!(b.error(), b.formula(&[y]).err());
        b.formula(&[y]).unwrap_err()
    };
    assert_eq!(build(|b, _| b.input(2)), AdError::Input { index: 2, inputs: 2 });
    assert_eq!(build(|b, _| b.constant(f64::NAN)), nan);
    assert_eq!(build(|b, x| b.powf(x, f64::NAN)), nan);
    assert_eq!(build(|b, x| b.smooth_abs(x, 0.0)), AdError::Width);
    assert_eq!(build(|b, x| b.smooth_step(x, f64::NAN)), AdError::Width);
    assert_eq!(build(|b, x| b.curve(0, x)), surface);
    assert_eq!(build(|b, _| FormulaBuilder::new(1).input(0).pipe(|x| b.cos(x))), AdError::Foreign);
    assert_eq!(build(|b, x| FormulaBuilder::new(1).input(0).pipe(|y| b.add(x, y))), AdError::Foreign);
    let no_root = |b: &mut FormulaBuilder, _: Value| {
        let minus = b.constant(-1.0);
        b.sqrt(minus)
    };
    assert_eq!(build(no_root), AdError::NotANumber { operation: 1 });
    assert_eq!(FormulaBuilder::new(usize::MAX).error(), Some(AdError::TooLarge));
    let foreign = FormulaBuilder::new(1).input(0);
    assert_eq!(FormulaBuilder::new(1).formula(&[foreign]), Err(AdError::Foreign));
    for error in [nan, outside, AdError::Foreign, AdError::Width, AdError::TooLarge] {
        assert!(!error.to_string().is_empty());
    }
}

/// A value as the argument of a closure.
trait Pipe: Sized {
    fn pipe<T>(self, f: impl FnOnce(Self) -> T) -> T {
        f(self)
    }
}
impl Pipe for Value {}

/// A formula from random numbers: each operation stands on values before it, in the domain of its function.
fn random(inputs: usize, codes: &[(u8, u16, u16, f64)]) -> Formula {
    let mut b = FormulaBuilder::new(inputs);
    let tables = tables().map(|t| b.table(t));
    let mut values: Vec<Value> = (0..inputs).map(|k| b.input(k)).collect();
    for &(code, i, j, c) in codes {
        // Values near the end are taken more often, so that formulas are deep.
        let pick = |k: u16| values[values.len() - 1 - usize::from(k) % values.len().min(12)];
        let (x, y) = (pick(i), pick(j));
        let small = {
            let t = b.tanh(x);
            let c = b.constant(0.9);
            b.mul(t, c)
        };
        let positive = b.smooth_abs(x, 0.5);
        let value = match code % 34 {
            0 => b.add(x, y),
            1 => b.sub(x, y),
            2 => b.mul(small, y),
            3 => b.div(y, positive),
            4 => b.sin(x),
            5 => b.cos(x),
            6 => b.tan(small),
            7 => b.asin(small),
            8 => b.acos(small),
            9 => b.atan(x),
            10 => b.atan2(y, positive),
            11 => b.sinh(small),
            12 => b.cosh(small),
            13 => b.tanh(x),
            14 => b.asinh(x),
            15 => {
                let one = b.constant(1.0);
                let above = b.add(positive, one);
                b.acosh(above)
            }
            16 => b.atanh(small),
            17 => b.sqrt(positive),
            18 => b.cbrt(positive),
            19 => b.exp(small),
            20 => b.ln(positive),
            21 => b.recip(positive),
            22 => b.abs(x),
            23 => b.min(x, y),
            24 => b.max(x, y),
            25 => b.sign(x),
            26 => b.select(x, y, small),
            27 => b.powi(positive, (c * 4.0) as i32),
            28 => b.powf(positive, c),
            29 => b.pow(positive, small),
            30 => b.curve(tables[0], small),
            31 => b.curve(tables[1], small),
            32 => b.surface(tables[2], small, y),
            _ => {
                let c = b.constant(c);
                let scaled = b.mul(x, c);
                b.add(scaled, c)
            }
        };
        // Numbers stay small.
        let value = if code % 3 == 0 { b.atan(value) } else { value };
        values.push(value);
    }
    let outputs: Vec<Value> = values.iter().rev().take(4).copied().collect();
    b.formula(&outputs).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn random_formulas_agree_with_hyper_dual_numbers(
        codes in prop::collection::vec((any::<u8>(), any::<u16>(), any::<u16>(), -1.0..1.0), 1..40),
        z in prop::array::uniform4(-1.5..1.5),
    ) {
        assert_derivatives(&random(4, &codes), &z);
    }
}

#[test]
fn patterns_hold_only_what_can_be_non_zero() {
    let mut b = FormulaBuilder::new(200);
    let z: Vec<Value> = (0..200).map(|k| b.input(k)).collect();
    let five = b.constant(5.0);
    let outputs = [
        b.add(z[199], five),
        b.mul(z[3], z[150]),
        b.min(z[7], z[8]),
        b.div(z[0], z[100]),
        b.sign(z[4]),
        b.select(z[5], z[6], z[6]),
        b.sub(z[9], z[9]),
        b.atan2(z[11], z[10]),
    ];
    let node = formula_node(b.formula(&outputs).unwrap());
    let entries: Vec<_> = node.pattern().jacobian_entries().collect();
    let expected = [(0, 199), (1, 3), (1, 150), (2, 7), (2, 8), (3, 0), (3, 100), (5, 6), (7, 10), (7, 11)];
    assert_eq!(entries, expected);
    assert_eq!(node.pattern().hessian, [(10, 10), (11, 10), (11, 11), (100, 0), (100, 100), (150, 3)]);
    // The bit-set scalar finds the same for a model.
    let node = vector_node(Model);
    assert_eq!(formula_node(node.formula().unwrap()).pattern(), node.pattern());
}

struct Model;
impl VectorFunction<5, 3> for Model {
    fn evaluate<S: Scalar>(&self, z: &[S; 5]) -> [S; 3] {
        let [a, b, c, d, _] = *z;
        [(a * b).sin() + c.abs().max(d) / 3.0, (c - d).powi(3) / (a + 2.0), b.atan2(d).exp() + a.sign()]
    }
}

/// Operations whose derivatives are written in more than one way.
struct Compositions;
impl VectorFunction<5, 5> for Compositions {
    fn evaluate<S: Scalar>(&self, z: &[S; 5]) -> [S; 5] {
        let [a, b, c, d, e] = *z;
        let shifted = a + 2.0;
        [
            shifted * (a - 1.0) * c / (shifted + 0.5) - (-b).exp() * 3.0 / d,
            a.atan2(a + 1.0) + S::from(2.0).atan2(b) + c.atan2(S::from(3.0)) * (S::from(2.0).sqrt() - d),
            (b * c).powi(2).powi(-3) * d.powf(0.7) + (a * b + 4.0).powf(2.5) / 3.0,
            (e * 0.1).tanh() * a.tan() + (b * 0.1).asin() * (c * 0.2).acos() - d.ln() * e.atan() + a.cosh(),
            vector::norm(&[a, b, c], 1e-3) * (a.sin() * e.cos() + d.sinh()) + c.cbrt() * b.asinh()
                - S::from(1.0) / e,
        ]
    }
}

/// Sums of functions of a few inputs each, chains, and values that all reach each other.
fn large(kind: usize, operations: usize, inputs: usize) -> Formula {
    let mut b = FormulaBuilder::new(inputs);
    let z: Vec<Value> = (0..inputs).map(|k| b.input(k)).collect();
    let mut value = b.constant(0.1);
    let mut values = z.clone();
    let mut k = 0;
    while values.len() < operations {
        let (x, y) = match kind {
            0 => (z[k % inputs], z[(k + 1) % inputs]),
            1 => (value, z[k % inputs]),
            _ => (values[k * 7919 % values.len()], values[k * 104_729 % values.len()]),
        };
        let c = b.constant(1.0 + 1e-3 * (k % 997) as f64);
        let product = b.mul(x, y);
        let scaled = b.mul(product, c);
        let sine = b.sin(scaled);
        value = if kind == 1 { sine } else { b.add(value, sine) };
        values.extend([product, scaled, sine]);
        k += 1;
    }
    b.formula(&[value]).unwrap()
}

#[test]
fn a_hundred_thousand_operations() {
    for (kind, inputs) in [(0, 5), (0, 2000), (1, 8), (2, 6)] {
        let [small, large] = [10_000, 100_000].map(|operations| {
            let formula = large(kind, operations, inputs);
            let (plan, pattern) = Plan::with_pattern(&formula);
            let sizes = plan.sizes();
            let node = FormulaNode { formula: formula.clone(), pattern, plan };
            let z: Vec<f64> = (0..inputs).map(|k| 0.3 + 0.1 * (k % 7) as f64).collect();
            let mut entries = vec![f64::NAN; node.pattern().jacobian_len()];
            let mut out = [0.0];
            node.jacobian(&z, &mut out, &mut entries);
            assert_eq!(out[0], formula.evaluate(&z)[0]);
            let mut hessian = vec![f64::NAN; node.pattern().hessian_len()];
            node.hessian(&z, &[1.0], &mut hessian);
            // A column of each against hyper-dual numbers.
            let seed = |k: usize, x: f64| HyperDual::<1> {
                re: x,
                e1: [f64::from(u8::from(k == 1))],
                e2: [f64::from(u8::from(k == 2))],
                e12: [0.0],
            };
            let seeded: Vec<_> = z.iter().enumerate().map(|(k, &x)| seed(k, x)).collect();
            let expected = formula.evaluate(&seeded)[0];
            let at = |c| node.pattern().columns.iter().position(|&k| k == c).map(|k| entries[k]);
            assert!(near(at(1).unwrap_or(0.0), expected.e1[0], expected.e1[0].abs()), "kind {kind}");
            let place = node.pattern().hessian.iter().position(|&p| p == (2, 1));
            let mixed = place.map_or(0.0, |k| hessian[k]);
            let scale = hessian.iter().fold(1.0_f64, |m, h| m.max(h.abs()));
            assert!(near(mixed, expected.e12[0], scale), "kind {kind}: {mixed} {}", expected.e12[0]);
            sizes
        });
        // Ten times the operations, about ten times the instructions.
        assert!(small.iter().zip(large).all(|(s, l)| l <= 12 * s), "kind {kind}: {small:?} {large:?}");
    }
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    // What is not a number has no sign.
    numbers.iter().map(|x| if x.is_nan() { u64::MAX } else { x.to_bits() }).collect()
}

/// Any number of points at once gives, to the last bit, what each point gives alone.
fn assert_lanes(node: &dyn NodeFunction, z: &[f64]) {
    let (n, m, pattern) = (node.inputs(), node.outputs(), node.pattern());
    let (e, h) = (pattern.jacobian_len(), pattern.hessian_len());
    let points = z.len() / n;
    let weights: Vec<f64> = (0..points * m).map(|k| 1.0 - 0.3 * (k % 7) as f64).collect();
    let fill = |counts: &[usize]| {
        let (mut out, mut values) = (vec![f64::NAN; points * m], vec![f64::NAN; points * m]);
        let (mut entries, mut hessian) = (vec![f64::NAN; points * e], vec![f64::NAN; points * h]);
        let mut first = 0;
        for &count in counts {
            let last = first + count;
            let z = &z[first * n..last * n];
            node.values(count, z, &mut out[first * m..last * m]);
            node.jacobians(count, z, &mut values[first * m..last * m], &mut entries[first * e..last * e]);
            node.hessians(count, z, &weights[first * m..last * m], &mut hessian[first * h..last * h]);
            first = last;
        }
        assert_eq!(first, points);
        [out, values, entries, hessian].map(|list| bits(&list))
    };
    let alone = fill(&vec![1; points]);
    assert_eq!(alone[0], alone[1]);
    let (mut rest, mut row, mut own) = (vec![0.0; h], vec![0.0; e], vec![0.0; m]);
    for p in 0..points {
        node.jacobian(&z[p * n..(p + 1) * n], &mut own, &mut row);
        assert_eq!(bits(&own), alone[1][p * m..(p + 1) * m]);
        // Zeros of models have either sign.
        let same = |(a, b): (&f64, &u64)| *a == f64::from_bits(*b) || bits(&[*a]) == [*b];
        assert!(row.iter().zip(&alone[2][p * e..(p + 1) * e]).all(same), "{row:?}");
        node.hessian(&z[p * n..(p + 1) * n], &weights[p * m..(p + 1) * m], &mut rest);
        assert_eq!(bits(&rest), alone[3][p * h..(p + 1) * h]);
    }
    for split in [vec![points], vec![2, points - 2], vec![8, 0, 3, points - 11], vec![points - 9, 9]] {
        assert_eq!(fill(&split), alone, "{split:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn lanes_do_not_change_a_bit(
        codes in prop::collection::vec((any::<u8>(), any::<u16>(), any::<u16>(), -1.0..1.0), 1..40),
        z in prop::collection::vec(-1e3..1e3, 21 * 4),
    ) {
        let formula = random(4, &codes);
        assert_lanes(&*formula_node(formula), &z);
    }
}

#[test]
fn lanes_of_models_and_of_directions() {
    let z: Vec<f64> = (0..21 * 5).map(|k| (f64::from(k) * 0.7).sin() * 2.0).collect();
    assert_lanes(&*vector_node(Model), &z);
    assert_lanes(&*vector_node(Compositions), &z.iter().map(|x| 2.5 + x).collect::<Vec<_>>());
    let z: Vec<f64> = (0..13 * 8).map(|k| (f64::from(k) * 0.7).sin() + 0.2).collect();
    // Its derivatives come from directions.
    let formula = large(2, 30_000, 8);
    let plan = Plan::with_pattern(&formula).0;
    assert!(plan.sizes()[2] < 8 * formula.operations().len());
    assert_lanes(&*formula_node(formula), &z);
    struct Opaque;
    impl VectorFunction<1, 1> for Opaque {
        fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
            [z[0].map(|x| [x * x * x, 3.0 * x * x, 6.0 * x])]
        }
    }
    assert_lanes(&*vector_node(Opaque), &z);
}
