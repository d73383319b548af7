//! Where a formula has cosines and sines of an input.

use std::f64::consts::FRAC_PI_2;

use apsides_ad::Formula;
use apsides_ad::formula::{Binary, Operation, Unary};

/// Rounding of angles, that of degrees included.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Per operation, slope and offset of the angle that it is the cosine of, over an input; none if the input occurs in anything else.
pub(crate) fn angles(formula: &Formula, input: usize) -> Option<Vec<Option<[f64; 2]>>> {
    let n = formula.inputs();
    // Per value, its slope and offset over the input if it is linear in it alone.
    let mut linear: Vec<Option<[f64; 2]>> = (0..n).map(|i| (i == input).then_some([1.0, 0.0])).collect();
    let mut cosines = Vec::new();
    for operation in formula.operations() {
        let constant = |v: usize| match v.checked_sub(n).map(|o| formula.operations()[o]) {
            Some(Operation::Constant(c)) => Some(c),
            _ => None,
        };
        let of = |v: usize| linear[v];
        let (mut value, mut cosine) = (None, None);
        if operation.operands().any(|v| of(v).is_some()) {
            match *operation {
                Operation::Unary(Unary::Cos, a) => cosine = of(a),
                Operation::Unary(Unary::Sin, a) => cosine = of(a).map(|[s, o]| [s, o - FRAC_PI_2]),
                Operation::Unary(Unary::Neg, a) => value = of(a).map(|[s, o]| [-s, -o]),
                Operation::Binary(binary, a, b) => {
                    let [s, o] = of(a).or(of(b))?;
                    let is_first = of(a).is_some();
                    let c = constant(if is_first { b } else { a })?;
                    value = Some(match (binary, is_first) {
                        (Binary::Add, _) => [s, o + c],
                        (Binary::Sub, true) => [s, o - c],
                        (Binary::Sub, false) => [-s, c - o],
                        (Binary::Mul, _) => [s * c, o * c],
                        (Binary::Div, true) => [s / c, o / c],
                        _ => return None,
                    });
                }
                _ => return None,
            }
            if value.or(cosine).is_none_or(|[s, o]| s == 0.0 || !s.is_finite() || !o.is_finite()) {
                return None;
            }
        }
        linear.push(value);
        cosines.push(cosine);
    }
    formula.outputs().iter().all(|v| linear[*v].is_none()).then_some(cosines)
}
