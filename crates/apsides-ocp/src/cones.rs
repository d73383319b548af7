//! Path constraints that keep a vector in a cone.
//!
//! ```text
//! u . u <= r^2,   r >= 0,   the same as   |u| <= r
//! ```
//!
//! The second form is convex where `u` and `r` are affine. At the tip of the cone, as along a coast, the first one has no slope in anything, and
//! so no multiplier that holds the controls there (S. Boyd, L. Vandenberghe, Convex Optimization, Cambridge 2004, section 4.4.2).

use apsides_ad::formula::{Binary, Operation, Unary};
use apsides_ad::{AdError, Formula, FormulaBuilder, Value, formula_node};

use crate::rewrite::rewrite;
use crate::squares::{Root, Summand, root, terms, vector_of_controls};
use crate::{Bounds, PathConstraint, Phase, Variable};

/// The sign of a value as the bounds of states and controls have it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sign {
    NotNegative,
    Positive,
}

/// A row that keeps a vector in a cone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cone {
    vector: Vec<Root>,
    radius: Root,
    /// True if the bounds of states and controls allow a radius of nothing.
    pub(crate) may_be_at_tip: bool,
    /// True if the row is the square of the radius less that of the vector, else the other way round.
    pub(crate) is_reversed: bool,
}

impl Cone {
    /// The cone of an output with these bounds; none where it is none, or nothing says that its radius is never below zero.
    fn of(phase: &Phase, formula: &Formula, output: usize, bounds: Bounds) -> Option<Self> {
        let is_reversed = match (bounds.lower, bounds.upper) {
            (f64::NEG_INFINITY, 0.0) => false,
            (0.0, f64::INFINITY) => true,
            _ => return None,
        };
        let values = Values { phase, formula };
        let (mut vector, mut radius) = (Vec::new(), None);
        for Summand { value, is_added } in terms(formula, output)? {
            let root = root(formula, value)?;
            match is_added == is_reversed {
                false => vector.push(root),
                true if radius.is_none() => radius = Some(root),
                true => return None,
            }
        }
        let radius = radius.filter(|_| !vector.is_empty())?;
        let may_be_at_tip = values.sign(radius.value)? == Sign::NotNegative;
        Some(Self { vector, radius, may_be_at_tip, is_reversed })
    }

    /// The cones of the rows of a path constraint with this formula.
    pub(crate) fn of_rows(
        phase: &Phase,
        constraint: &PathConstraint,
        formula: &Formula,
    ) -> Vec<Option<Self>> {
        let rows = constraint.rows.iter().zip(formula.outputs());
        rows.map(|(row, output)| Self::of(phase, formula, *output, row.bounds)).collect()
    }

    /// The controls of which the vector consists, in their order; none if they are fewer than two, or anything else.
    pub(crate) fn controls(&self, phase: &Phase) -> Option<Vec<usize>> {
        vector_of_controls(phase, &self.vector)
    }

    /// A row by the length of the vector in place of its square.
    pub(crate) fn row(&self, row: &Variable) -> Variable {
        Variable { scale: row.scale.map(f64::sqrt), ..row.clone() }
    }
}

/// A formula with `|u| - r`, or `r - |u|`, in place of the outputs that are rows of cones.
pub(crate) fn by_lengths(formula: &Formula, cones: &[Option<Cone>]) -> Result<Formula, AdError> {
    let mut b = FormulaBuilder::new(formula.inputs());
    let values = rewrite(formula, &mut b, |b, i| b.input(i), |_, _, _| None);
    let scaled = |b: &mut FormulaBuilder, root: &Root| match root.factor {
        1.0 => values[root.value],
        factor => {
            let factor = b.constant(factor);
            b.mul(factor, values[root.value])
        }
    };
    let mut outputs: Vec<Value> = Vec::with_capacity(cones.len());
    for (output, cone) in formula.outputs().iter().zip(cones) {
        let Some(cone) = cone else {
            outputs.push(values[*output]);
            continue;
        };
        let mut square = None;
        for root in &cone.vector {
            let component = scaled(&mut b, root);
            let term = b.square(component);
            square = Some(square.map_or(term, |sum| b.add(sum, term)));
        }
        let square = square.unwrap_or_else(|| b.constant(0.0));
        let (length, radius) = (b.sqrt(square), scaled(&mut b, &cone.radius));
        let (more, less) = if cone.is_reversed { (radius, length) } else { (length, radius) };
        outputs.push(b.sub(more, less));
    }
    b.formula(&outputs)
}

/// The path constraint with the rows that keep a vector in a cone by its length; none where there are none, or it is no formula.
#[must_use]
pub fn with_lengths(phase: &Phase, constraint: &PathConstraint) -> Option<PathConstraint> {
    let formula = constraint.function.formula().ok()?;
    let cones = Cone::of_rows(phase, constraint, &formula);
    if cones.iter().all(Option::is_none) {
        return None;
    }
    let function = formula_node(by_lengths(&formula, &cones).ok()?);
    let rows = constraint.rows.iter().zip(&cones);
    let rows = rows.map(|(row, cone)| cone.as_ref().map_or_else(|| row.clone(), |cone| cone.row(row)));
    Some(PathConstraint { rows: rows.collect(), function })
}

/// The values of a formula of a phase.
struct Values<'a> {
    phase: &'a Phase,
    formula: &'a Formula,
}

impl Values<'_> {
    /// The least value of a state or a control along the phase.
    fn least(&self, input: usize) -> f64 {
        let (states, controls) = (&self.phase.states, &self.phase.controls);
        let bounds = match input.checked_sub(states.len()) {
            None => Some(states[input].variable.bounds),
            Some(control) => controls.get(control).map(|c| c.bounds),
        };
        bounds.map_or(f64::NEG_INFINITY, |b| b.lower)
    }

    /// The sign of a value; none where the bounds of states and controls do not say that it is never below zero.
    fn sign(&self, value: usize) -> Option<Sign> {
        let of = |number: f64| match number {
            _ if number > 0.0 => Some(Sign::Positive),
            0.0 => Some(Sign::NotNegative),
            _ => None,
        };
        let first = self.formula.inputs();
        let mut signs: Vec<Option<Sign>> = (0..first).map(|input| of(self.least(input))).collect();
        for operation in self.formula.operations().iter().take((value + 1).saturating_sub(first)) {
            let both = |a: usize, b: usize| Some((signs[a]?, signs[b]?));
            let sign = match *operation {
                Operation::Constant(c) => of(c),
                Operation::Unary(Unary::Sqrt, a) => Some(signs[a].unwrap_or(Sign::NotNegative)),
                Operation::Binary(Binary::Add, a, b) => {
                    both(a, b).map(|(a, b)| if a == Sign::Positive { a } else { b })
                }
                Operation::Binary(Binary::Mul, a, b) => {
                    both(a, b).map(|(a, b)| if a == Sign::Positive { b } else { a })
                }
                Operation::Binary(Binary::Div, a, b) => both(a, b).map(|(a, _)| a),
                _ => None,
            };
            signs.push(sign);
        }
        signs[value]
    }
}
