//! States at their bounds in an interval: their costates are not determined by the adjoint equation.
//!
//! ```text
//! lambda' = -H_x - mu . c_x - eta,   eta of the sign of the bound along it, zero away from it
//! ```
//!
//! Such a costate is known by its values at the nodes of the states, which are unknowns: between two nodes at the bound, and where the state
//! comes to it, it may miss its equation to one side. Where controls are at bounds besides, as those of a full store that is neither filled nor
//! emptied, many costates satisfy the conditions of an optimum, and none follows from stationarity: the conditions are inequalities
//! (R. F. Hartl, S. P. Sethi, R. G. Vickson, SIAM Review 37 (1995) 181, section 4, doi 10.1137/1037043).

use apsides_ocp::Bounds;

/// Weight of the adjoint equation.
pub(super) const ADJOINT_WEIGHT: f64 = 1e4;
/// Weight of the adjoint equation of a state at its bound: its multiplier is rather zero than not.
const HELD_WEIGHT: f64 = 1e-4;

/// BoundSide of the bound that a state is at: the integral of its multiplier has this sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BoundSide {
    Lower,
    Upper,
}

impl BoundSide {
    /// The bound that a value is at, to a tolerance.
    pub(super) fn of(value: f64, bounds: &Bounds, tolerance: f64) -> Option<Self> {
        if value >= bounds.upper - tolerance {
            Some(Self::Upper)
        } else if value <= bounds.lower + tolerance {
            Some(Self::Lower)
        } else {
            None
        }
    }

    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Lower => -1.0,
            Self::Upper => 1.0,
        }
    }
}

/// A state that is at a bound somewhere in an interval.
pub(super) struct Held {
    pub(super) state: usize,
    /// Per node of the states, the bound that it is at there; the first and the last node are the ends of the interval.
    pub(super) sides: Vec<Option<BoundSide>>,
    /// Its first column among the inner unknowns: the costate at each node but the last.
    pub(super) first: usize,
}

impl Held {
    /// The bound that drives the costate between a node and the next. An arc begins and ends at ends of intervals: that the state is at its bound at one of
    /// them alone says nothing about the inside.
    pub(super) fn driven(&self, node: usize) -> Option<BoundSide> {
        let last = self.sides.len() - 1;
        let (before, after) = (self.sides[node], self.sides[node + 1]);
        let inner_before = before.filter(|_| node > 0);
        let inner_after = after.filter(|_| node + 1 < last);
        let both = before.filter(|_| before == after);
        both.or(inner_before).or(inner_after)
    }
}

/// An inequality that is missed by less, relative to its largest term, is met.
const ROUNDING: f64 = 1e-13;

/// A linear function of the unknowns of an interval, `[costates before its start, inner, costates at its end, shared, 1]`, or at an end of the phase.
pub(super) struct LinearCondition {
    /// Times the weight of the condition.
    pub(super) coefficients: Vec<f64>,
    /// To be zero or more, instead of zero.
    is_inequality: bool,
    /// Says whether it is among the equations: an inequality is while it is missed.
    pub(super) counts: bool,
}

impl LinearCondition {
    pub(super) fn equation(coefficients: Vec<f64>, weight: f64) -> Self {
        Self::new(coefficients, weight, false)
    }

    pub(super) fn at_least_zero(coefficients: Vec<f64>, weight: f64) -> Self {
        Self::new(coefficients, weight, true)
    }

    fn new(mut coefficients: Vec<f64>, weight: f64, is_inequality: bool) -> Self {
        coefficients.iter_mut().for_each(|c| *c *= weight);
        Self { coefficients, is_inequality, counts: !is_inequality }
    }

    /// Lets an inequality count if it is missed; true if it did not before, or does not any more.
    pub(super) fn settle(&mut self, unknowns: &[f64]) -> bool {
        if !self.is_inequality {
            return false;
        }
        let terms = self.coefficients.iter().zip(unknowns).map(|(c, v)| c * v);
        let (sum, largest) = terms.fold((0.0, 0.0_f64), |(sum, m), term| (sum + term, m.max(term.abs())));
        let is_missed = sum < -ROUNDING * largest;
        std::mem::replace(&mut self.counts, is_missed) != is_missed
    }
}

/// The quantities that enter the adjoint equation along an interval besides states and controls.
pub(super) struct Course {
    /// Path rows with stated multipliers, and those whose multipliers follow from the costates.
    pub(super) given: Vec<usize>,
    pub(super) followed: Vec<usize>,
    /// Controls that are free at all nodes.
    pub(super) always: Vec<usize>,
    pub(super) held: Vec<Held>,
}

impl Course {
    pub(super) fn inner(&self) -> usize {
        self.held.iter().map(|h| h.sides.len() - 1).sum()
    }
}

/// The conditions for what the bound of a state adds to its costate: nothing where it is not at it.
pub(super) fn driven(row: Vec<f64>, side: Option<BoundSide>) -> Vec<LinearCondition> {
    let Some(side) = side else { return vec![LinearCondition::equation(row, ADJOINT_WEIGHT)] };
    let signed = row.iter().map(|v| side.sign() * v).collect();
    vec![LinearCondition::at_least_zero(signed, 1.0), LinearCondition::equation(row, HELD_WEIGHT)]
}
