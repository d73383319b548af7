use proptest::prelude::*;

use super::{TaylorError, TaylorSeries};
use crate::formula::{Binary, Operation, Unary};
use crate::{CubicSpline, Dynamics, Formula, FormulaBuilder, Scalar, dynamics_node};

/// Rounding of some tens of terms, relative to the largest.
const ROUNDING: f64 = 1e-13;
/// Highest order here; what is left out at the distances here is below rounding.
const ORDER: usize = 24;

/// States `x' = x`, `y' = c y + t` and `z' = f(x, y, c, t)`, with the parameter `c`.
fn system(f: impl FnOnce(&mut FormulaBuilder, [crate::Value; 4]) -> crate::Value) -> Formula {
    let mut b = FormulaBuilder::new(5);
    let [x, y, _, c, t] = [0, 1, 2, 3, 4].map(|k| b.input(k));
    let product = b.mul(c, y);
    let rate = b.add(product, t);
    let f = f(&mut b, [x, y, c, t]);
    b.formula(&[x, rate, f]).expect("well formed")
}

/// The series of `f` along the solution from `x`, `y` at time `t`, summed at `h`, and `f` itself there.
fn summed(formula: &Formula, [x, y, c, t]: [f64; 4], h: f64) -> (f64, f64, f64) {
    let mut series = TaylorSeries::new(formula, ORDER).expect("recurrences");
    series.expand(t, &[x, y, 0.0], &[c]);
    let terms = |state: usize| (0..=ORDER).map(|k| series.coefficients(k)[state]).collect::<Vec<_>>();
    // The coefficients of f are those of z' = f.
    let z = terms(2);
    let rates: Vec<f64> = (1..=ORDER).map(|k| z[k] * k as f64).collect();
    let found = rates.iter().rev().fold(0.0, |sum, r| sum * h + r);
    let largest =
        rates.iter().enumerate().fold(0.0, |most: f64, (k, r)| most.max(r.abs() * h.abs().powi(k as i32)));
    // Closed forms: x e^h, and y' = c y + t.
    let at = x * h.exp();
    let y = (y + t / c + 1.0 / (c * c)) * (c * h).exp() - (t + h) / c - 1.0 / (c * c);
    (found, formula.evaluate(&[at, y, 0.0, c, t + h])[2], largest)
}

fn assert_expands(formula: &Formula, start: [f64; 4], h: f64, name: &str) {
    let (found, expected, largest) = summed(formula, start, h);
    assert!((found - expected).abs() <= ROUNDING * largest.max(1.0), "{name}: {found} {expected}");
}

const START: [f64; 4] = [0.4, 0.3, -0.7, 0.2];

#[test]
fn many_values_have_the_coefficients_of_few() {
    // More values than fit into a row of fixed length.
    const PAIRS: usize = 60;
    let pairs = |count: usize| {
        let mut b = FormulaBuilder::new(2 * count + 1);
        let mut rates = Vec::new();
        for k in 0..count {
            let [x, y] = [2 * k, 2 * k + 1].map(|k| b.input(k));
            let [sine, product, root] = [b.unary(Unary::Sin, x), b.mul(x, y), b.unary(Unary::Sqrt, y)];
            let quotient = b.div(sine, root);
            rates.extend([b.add(quotient, product), b.sub(product, x)]);
        }
        let formula = b.formula(&rates).expect("well formed");
        TaylorSeries::new(&formula, ORDER).expect("recurrences")
    };
    let (mut few, mut many) = (pairs(1), pairs(PAIRS));
    few.expand(0.0, &[0.4, 0.3], &[]);
    many.expand(0.0, &[0.4, 0.3].repeat(PAIRS), &[]);
    for order in 0..=ORDER {
        assert_eq!(many.coefficients(order), few.coefficients(order).repeat(PAIRS));
    }
}

#[test]
fn coefficients_of_the_time_end_with_order_one() {
    // x' = t y and y' = t: y = t^2 / 2 and x = t^4 / 8 from zero.
    let mut b = FormulaBuilder::new(3);
    let [y, t] = [1, 2].map(|k| b.input(k));
    let rate = b.mul(t, y);
    let formula = b.formula(&[rate, t]).expect("well formed");
    let mut series = TaylorSeries::new(&formula, 6).expect("recurrences");
    // The second expansion starts from what the first one left.
    for _ in 0..2 {
        series.expand(0.0, &[0.0; 2], &[]);
        let found: Vec<f64> = (0..=6).flat_map(|k| series.coefficients(k).to_vec()).collect();
        let mut expected = [0.0; 14];
        (expected[5], expected[8]) = (0.5, 0.125);
        assert_eq!(found, expected);
    }
}

#[test]
fn every_function_has_its_series() {
    for f in Unary::ALL {
        if matches!(f, Unary::Abs | Unary::Sign) {
            continue;
        }
        let formula = system(|b, [x, ..]| {
            // The inverse hyperbolic cosine is of numbers above one.
            let one = b.constant(1.0);
            let x = if f == Unary::Acosh { b.add(x, one) } else { x };
            b.unary(f, x)
        });
        assert_expands(&formula, START, 0.05, f.name());
    }
    for f in Binary::ALL {
        if matches!(f, Binary::Min | Binary::Max) {
            continue;
        }
        assert_expands(&system(|b, [x, y, ..]| b.binary(f, x, y)), START, 0.04, f.name());
        assert_expands(&system(|b, [x, _, c, _]| b.binary(f, x, c)), START, 0.04, f.name());
        // A parameter that is no base of a real power.
        let of_fixed = system(|b, [x, _, c, _]| {
            let square = b.square(c);
            b.binary(f, square, x)
        });
        assert_expands(&of_fixed, START, 0.04, f.name());
    }
}

/// Values of one rule that are ready together are computed together, three here.
#[test]
fn values_side_by_side_have_their_series() {
    let product = |b: &mut FormulaBuilder, values: [crate::Value; 3]| {
        let first = b.mul(values[0], values[1]);
        b.mul(first, values[2])
    };
    for f in Unary::ALL {
        if matches!(f, Unary::Abs | Unary::Sign) {
            continue;
        }
        let formula = system(|b, [x, y, _, t]| {
            let one = b.constant(1.0);
            let values = [x, y, t].map(|v| {
                let v = if f == Unary::Acosh { b.add(v, one) } else { v };
                b.unary(f, v)
            });
            product(b, values)
        });
        assert_expands(&formula, START, 0.02, f.name());
    }
    let powers = system(|b, [x, y, _, t]| {
        let values = [(x, 1.5), (y, -0.4), (t, 2.7)].map(|(v, c)| b.powf(v, c));
        product(b, values)
    });
    assert_expands(&powers, START, 0.02, "powf");
    let squares = system(|b, [x, y, _, t]| {
        let [x, y, t] = [x, y, t].map(|v| b.square(v));
        let sum = b.add(x, y);
        b.sub(sum, t)
    });
    assert_expands(&squares, START, 0.05, "squares");
}

#[test]
fn powers_and_what_is_made_of_them_have_their_series() {
    for n in [-7, -2, -1, 2, 3, 6, 13] {
        assert_expands(&system(|b, [x, ..]| b.powi(x, n)), START, 0.02, "powi");
    }
    for c in [-1.5, -0.5, 0.25, 1.5, 2.7] {
        assert_expands(&system(|b, [x, ..]| b.powf(x, c)), START, 0.04, "powf");
    }
    // Powers of one base become one.
    let merged = system(|b, [x, y, c, t]| {
        let (squares, other) = (b.square(x), b.square(y));
        let sum = b.add(squares, other);
        let root = b.sqrt(sum);
        let cube = b.mul(sum, root);
        let (first, second) = (b.div(c, cube), b.div(t, root));
        let both = b.add(first, second);
        b.mul(both, cube)
    });
    assert_expands(&merged, START, 0.03, "merged");
    // An integer power of zero is smooth.
    let cube = system(|b, [x, ..]| b.powi(x, 3));
    let mut series = TaylorSeries::new(&cube, 4).unwrap();
    series.expand(0.0, &[0.0, 1.0, 0.0], &[1.0]);
    assert_eq!((0..=4).map(|k| series.coefficients(k)[2]).collect::<Vec<_>>(), [0.0; 5]);
}

/// Angles have their series on both sides of the cut and where the abscissa is zero.
#[test]
fn angles_have_their_series_anywhere() {
    for (x, y) in [(0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (1e-3, 0.5)] {
        let angle = system(|b, [x, y, ..]| b.atan2(y, x));
        assert_expands(&angle, [x, y, -0.7, 0.2], 0.01, "atan2");
        let two = system(|b, [x, y, _, t]| {
            let (first, second) = (b.atan2(y, x), b.atan2(t, x));
            b.mul(first, second)
        });
        assert_expands(&two, [x, y, -0.7, 0.2], 0.01, "two angles of one abscissa");
    }
}

/// Equations of motion with fixed parts, sums and shared terms: an oscillator with a driven, damped spring.
#[test]
fn a_model_has_the_coefficients_of_its_solution() {
    struct Spiral;
    impl Dynamics<2, 1> for Spiral {
        fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            // x + i y = e^(t (-1/2 + i u)), times t.
            let decay = (t * -0.5).exp();
            let (sin, cos) = (t * u[0]).sin_cos();
            let growth = [decay * cos, decay * sin];
            [growth[0] - x[0] * 0.5 - u[0] * x[1], growth[1] - x[1] * 0.5 + u[0] * x[0]]
        }
    }
    let mut series = TaylorSeries::new(&dynamics_node(Spiral).formula().unwrap(), 28).unwrap();
    assert_eq!((series.states(), series.parameters(), series.order()), (2, 1, 28));
    let (t, u, h) = (0.3_f64, 1.3, 0.8);
    let exact = |t: f64| [t * (-0.5 * t).exp() * (u * t).cos(), t * (-0.5 * t).exp() * (u * t).sin()];
    series.expand(t, &exact(t), &[u]);
    let mut x = [0.0; 2];
    series.evaluate(h, &mut x);
    for (found, expected) in x.iter().zip(exact(t + h)) {
        assert!((found - expected).abs() < ROUNDING, "{found} {expected}");
    }
    // What an expansion leaves behind does not reach the next one.
    let first: Vec<f64> = (0..=28).flat_map(|k| series.coefficients(k).to_vec()).collect();
    series.expand(5.0, &[1e3, -7.0], &[20.0]);
    series.expand(f64::NAN, &[1e3, f64::INFINITY], &[20.0]);
    series.expand(t, &exact(t), &[u]);
    let again: Vec<f64> = (0..=28).flat_map(|k| series.coefficients(k).to_vec()).collect();
    assert_eq!(first, again);
}

/// A polynomial by Horner's rule in twice the precision: the rounded sum and its rest.
fn in_twice_the_precision(coefficients: &[f64], h: f64) -> (f64, f64) {
    coefficients.iter().rev().fold((0.0, 0.0), |(high, low): (f64, f64), &c| {
        let product = high * h;
        let rest = high.mul_add(h, -product) + low * h;
        let sum = product + c;
        let second = sum - product;
        let rest = rest + ((product - (sum - second)) + (c - second));
        (sum + rest, rest - ((sum + rest) - sum))
    })
}

/// Circles of radius one: where every addition rounds, the worst of these is 1.35 units.
#[test]
fn the_sum_of_a_series_is_rounded_little_more_than_once() {
    let mut b = FormulaBuilder::new(3);
    let [x, v] = [0, 1].map(|k| b.input(k));
    let rate = b.neg(x);
    let mut series =
        TaylorSeries::new(&b.formula(&[v, rate]).expect("well formed"), ORDER).expect("recurrences");
    let (h, unit) = (0.7, 0.5 * f64::EPSILON);
    for k in 0..200 {
        let (sine, cosine) = (0.1 * f64::from(k) + 0.05).sin_cos();
        series.expand(0.0, &[cosine, -sine], &[]);
        let mut found = [0.0; 2];
        series.evaluate(h, &mut found);
        for (state, found) in found.into_iter().enumerate() {
            let coefficients: Vec<f64> = (0..=ORDER).map(|k| series.coefficients(k)[state]).collect();
            let (high, low) = in_twice_the_precision(&coefficients, h);
            let error = ((found - high) - low).abs();
            assert!(error < 0.75 * unit, "start {k}, state {state}: {}", error / unit);
        }
    }
}

#[test]
fn operations_without_a_recurrence_are_named() {
    let refused = |formula: &Formula| TaylorSeries::new(formula, 8).unwrap_err();
    let name = |formula: &Formula| match refused(formula) {
        TaylorError::NoRecurrence { name, .. } => name,
        other => panic!("{other}"),
    };
    assert_eq!(name(&system(|b, [x, ..]| b.abs(x))), "abs");
    assert_eq!(name(&system(|b, [x, ..]| b.sign(x))), "sign");
    assert_eq!(name(&system(|b, [x, y, ..]| b.min(x, y))), "min");
    assert_eq!(name(&system(|b, [x, y, _, t]| b.select(t, x, y))), "select");
    let knots = [0.0, 1.0, 2.0, 3.0];
    let curve = system(|b, [x, ..]| {
        let table = b.table(CubicSpline::new(&knots, &knots).unwrap());
        b.curve(table, x)
    });
    assert_eq!(name(&curve), "curve");
    // Of values that stay the same anything may be made.
    let fixed = system(|b, [x, _, c, _]| {
        let size = b.abs(c);
        b.mul(size, x)
    });
    assert_expands(&fixed, START, 0.1, "of a parameter");

    let message = refused(&system(|b, [x, ..]| b.abs(x))).to_string();
    assert!(message.starts_with("operation 2 (`abs`) has no recurrence"), "{message}");
    let square = Formula::new(1, vec![Operation::Binary(Binary::Mul, 0, 0)], vec![], vec![1]).unwrap();
    assert_eq!(refused(&square), TaylorError::Inputs { inputs: 1, outputs: 1 });
    let formula = system(|_, [x, ..]| x);
    for order in [0, 29, usize::MAX] {
        assert_eq!(TaylorSeries::new(&formula, order).unwrap_err(), TaylorError::Order { order });
    }
}

/// One operation on two values that stand before it; arguments are kept where functions are defined and smooth.
fn operation(b: &mut FormulaBuilder, kind: usize, p: crate::Value, q: crate::Value) -> crate::Value {
    let one = b.constant(1.0);
    let (square, half) = (b.square(p), b.constant(0.5));
    let above = b.add(square, one);
    let within = b.sin(p);
    let within = b.mul(within, half);
    match kind % 14 {
        0 => b.add(p, q),
        1 => b.sub(p, q),
        2 => b.mul(p, q),
        3 => b.div(q, above),
        4 => b.sqrt(above),
        5 => b.powf(above, -1.5),
        6 => b.exp(within),
        7 => b.ln(above),
        8 => b.cos(p),
        9 => b.tanh(q),
        10 => b.asin(within),
        11 => b.atan2(q, above),
        12 => {
            // At one it has a kink.
            let above = b.add(above, half);
            b.acosh(above)
        }
        _ => b.pow(above, within),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever a formula is made of, its series is that of its values along the solution.
    #[test]
    fn formulas_have_their_series(
        program in prop::collection::vec((0_usize..14, 0_usize..20, 0_usize..20), 1..9),
        x in 0.2..0.8_f64, y in -0.8..0.8_f64, c in 0.5..1.0_f64, t in -0.5..0.5_f64,
    ) {
        let formula = system(|b, start| {
            let mut values = start.to_vec();
            for (kind, p, q) in program {
                let (p, q) = (values[p % values.len()], values[q % values.len()]);
                let value = operation(b, kind, p, q);
                // Bounded, so that the radius of convergence is not small.
                let bounded = b.sin(value);
                values.push(bounded);
            }
            values[values.len() - 1]
        });
        let (found, expected, largest) = summed(&formula, [x, y, c, t], 1e-2);
        prop_assert!((found - expected).abs() <= ROUNDING * largest.max(1.0), "{found} {expected}");
    }
}
