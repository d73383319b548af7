use super::*;
use crate::formula_node::tests::{near, tables};
use crate::{FormulaBuilder, formula_node};

#[test]
fn kinks_are_listed_with_their_inputs() {
    let mut b = FormulaBuilder::new(3);
    let [x, y, z] = [0, 1, 2].map(|k| b.input(k));
    let (two, five) = (b.constant(2.0), b.constant(5.0));
    let scaled = b.mul(x, two);
    let shifted = b.sub(scaled, five);
    let [abs, sign] = [b.abs(shifted), b.sign(y)];
    let (min, max) = (b.min(z, five), b.max(y, z));
    let chosen = b.select(shifted, y, z);
    let again = b.abs(shifted);
    let pchip = b.table(tables()[1].clone());
    let table = b.curve(pchip, z);
    let formula = b.formula(&[abs, sign, min, max, chosen, again, table]).unwrap();
    let kinks = formula.kinks();
    let places: Vec<_> = kinks.iter().map(|k| (k.input, k.jumps)).collect();
    let expected = [
        (Some((0, 2.5)), false),
        (Some((1, 0.0)), true),
        (Some((2, 5.0)), false),
        (None, false),
        (Some((0, 2.5)), true),
        (Some((2, -1.0)), false),
        (Some((2, 3.0)), false),
    ];
    assert_eq!(places, expected);
    assert_eq!(kinks[3].condition, Condition::Equal(1, 2));
    let Condition::Number { value, number } = kinks[0].condition else { unreachable!() };
    assert_eq!((number, formula.operations()[value - 3]), (0.0, Operation::Binary(Binary::Sub, 5, 4)));
}

/// Between two pieces of a spline with not-a-knot ends stands no second knot; a table that is looked up twice with one argument has its joints once.
#[test]
fn joints_are_those_between_pieces_of_tables() {
    let mut b = FormulaBuilder::new(2);
    let (x, y) = (b.input(0), b.input(1));
    let [spline, pchip, surface] = tables().map(|t| b.table(t));
    let double = b.add(x, x);
    let outputs = [b.curve(spline, x), b.curve(spline, x), b.curve(pchip, double), b.surface(surface, x, y)];
    let formula = b.formula(&outputs).unwrap();
    let joints = formula.joints();
    let numbers: Vec<f64> = (joints.iter())
        .map(|j| {
            let Condition::Number { number, .. } = j.condition else { unreachable!() };
            number
        })
        .collect();
    // The surface has the knots of the spline along x.
    assert_eq!(numbers, [0.4, 1.5, 0.0, 0.4, 1.5, 2.0, 1.0]);
    let arguments = formula.arguments_of(&joints);
    assert_eq!(arguments.evaluate(&[0.4, 1.0]), [0.0, 0.4 - 1.5, 0.8, 0.4, 0.8 - 1.5, 0.8 - 2.0, 0.0]);
}

/// The gradient of a sum jumps at a kink by that of the jump, and its value by the value.
#[test]
fn jumps_at_kinks_are_those_of_the_two_sides() {
    let mut b = FormulaBuilder::new(2);
    let [x, y] = [0, 1].map(|k| b.input(k));
    let two = b.constant(2.0);
    let scaled = b.mul(x, two);
    let abs = b.abs(scaled);
    let product = b.mul(abs, y);
    let sign = b.sign(y);
    let signed = b.mul(sign, y);
    let least = b.min(x, y);
    let chosen = b.select(x, x, y);
    let pchip = b.table(tables()[1].clone());
    let table = b.curve(pchip, x);
    let formula = b.formula(&[product, signed, least, chosen, table]).unwrap();
    let kinks = formula.kinks();
    let at = |z: &[f64], node: &Formula| {
        let node = formula_node(node.clone());
        let (mut values, mut entries) = (vec![0.0; node.outputs()], vec![0.0; node.pattern().jacobian_len()]);
        node.jacobian(z, &mut values, &mut entries);
        let mut gradients = vec![[0.0; 2]; node.outputs()];
        for ((row, column), entry) in node.pattern().jacobian_entries().zip(&entries) {
            gradients[row][column] += entry;
        }
        (values, gradients)
    };
    // Where the argument of each kink is zero, its gradient, and the jump of value and gradient of one output there.
    let slope = formula_slope_below(&tables()[1], 3.0);
    let cases = [
        ([0.0, 3.0], [2.0, 0.0], 0, 0.0, [12.0, 0.0]),
        ([3.5, 0.0], [0.0, 1.0], 1, 0.0, [0.0, 2.0]),
        ([0.5, 0.5], [1.0, -1.0], 2, 0.0, [-1.0, 1.0]),
        ([0.0, 3.0], [1.0, 0.0], 3, -3.0, [1.0, -1.0]),
        ([-1.0, 0.0], [1.0, 0.0], 4, 0.0, [f64::NAN, 0.0]),
        ([3.0, 0.0], [1.0, 0.0], 4, 0.0, [-slope, 0.0]),
    ];
    assert_eq!(kinks.len(), cases.len());
    for (kink, (z, argument, output, value, gradient)) in kinks.iter().zip(cases) {
        let (values, gradients) = at(&z, &formula.arguments_of(&[*kink]));
        assert_eq!((values[0], gradients[0]), (0.0, argument));
        let (values, gradients) = at(&z, &formula.jump_at(kink));
        assert_eq!(values[output], value, "{kink:?}");
        for (found, expected) in gradients[output].iter().zip(gradient) {
            assert!(expected.is_nan() || near(*found, expected, 1.0), "{kink:?}: {found} {expected}");
        }
    }
}

#[test]
fn radicands_are_what_roots_are_taken_of() {
    let mut b = FormulaBuilder::new(2);
    let [x, y] = [0, 1].map(|k| b.input(k));
    let length = b.hypot(x, y);
    let root = b.cbrt(y);
    let powers = [1.5, 2.5, 3.0].map(|e| b.powf(x, e));
    let again = b.sqrt(y);
    let formula = b.formula(&[length, root, powers[0], powers[1], powers[2], again]).unwrap();
    // The bases of the roots of y and of x^1.5, and x^2 + y^2.
    assert_eq!(formula.radicands().evaluate(&[3.0, 4.0]), [3.0, 4.0, 25.0]);
}

/// The slope of a table just below a knot.
fn formula_slope_below(table: &Table, knot: f64) -> f64 {
    table.curve_jet(knot - 1e-12)[1]
}
