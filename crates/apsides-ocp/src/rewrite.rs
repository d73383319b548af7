//! Formulas of a phase written again over other controls.

use apsides_ad::formula::Operation;
use apsides_ad::{Formula, FormulaBuilder, Value};

/// Writes the operations of a formula again; `input` gives the value in place of an input, `replace` one in place of the operation at an index
/// where it is not the operation itself. Returns the values of all inputs and operations.
pub(crate) fn rewrite(
    formula: &Formula,
    b: &mut FormulaBuilder,
    mut input: impl FnMut(&mut FormulaBuilder, usize) -> Value,
    mut replace: impl FnMut(&mut FormulaBuilder, usize, &[Value]) -> Option<Value>,
) -> Vec<Value> {
    let tables: Vec<usize> = formula.tables().iter().map(|t| b.table((**t).clone())).collect();
    let mut values: Vec<Value> = (0..formula.inputs()).map(|i| input(b, i)).collect();
    for (place, operation) in formula.operations().iter().enumerate() {
        let value = replace(b, place, &values).unwrap_or_else(|| {
            let v = |k: usize| values[k];
            match *operation {
                Operation::Constant(c) => b.constant(c),
                Operation::Unary(f, a) => b.unary(f, v(a)),
                Operation::Binary(f, x, y) => b.binary(f, v(x), v(y)),
                Operation::Powi(a, n) => b.powi(v(a), n),
                Operation::Powf(a, e) => b.powf(v(a), e),
                Operation::Select(c, x, y) => b.select(v(c), v(x), v(y)),
                Operation::Curve(t, x) => b.curve(tables[t], v(x)),
                Operation::Surface(t, x, y) => b.surface(tables[t], v(x), v(y)),
            }
        });
        values.push(value);
    }
    values
}
