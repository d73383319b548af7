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

/// Halvings of the way to other unknowns in the search of the best part of it.
const HALVINGS: usize = 40;

/// A linear function of the unknowns of an interval, `[costates before its start, inner, costates at its end, shared, 1]`, or at an end of the phase.
pub(super) struct LinearCondition {
    /// Times the weight of the condition.
    pub(super) coefficients: Vec<f64>,
    /// To be zero or more, instead of zero.
    is_inequality: bool,
    /// Says whether it is among the equations: an inequality is while it is missed.
    pub(super) counts: bool,
    /// Its value for the unknowns so far, none before the first ones, and for those that come closest to the conditions that count.
    value: Option<f64>,
    next: f64,
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
        Self { coefficients, is_inequality, counts: !is_inequality, value: None, next: 0.0 }
    }

    /// Takes the unknowns that come closest to the conditions that count.
    pub(super) fn evaluate(&mut self, unknowns: &[f64]) {
        self.next = self.coefficients.iter().zip(unknowns).map(|(c, v)| c * v).sum();
    }

    /// Goes a part of the way to them, and lets an inequality count if it is missed there; true if it did not before, or does not any more.
    pub(super) fn settle(&mut self, part: f64) -> bool {
        let value = self.at(part);
        self.value = Some(value);
        if !self.is_inequality {
            return false;
        }
        let is_missed = value < 0.0;
        std::mem::replace(&mut self.counts, is_missed) != is_missed
    }

    /// Its value a part of the way.
    fn at(&self, part: f64) -> f64 {
        self.value.map_or(self.next, |value| value + part * (self.next - value))
    }

    /// Half the slope of the square of what it is missed by, over the part of the way.
    fn slope(&self, part: f64) -> f64 {
        let (value, change) = (self.at(part), self.value.map_or(0.0, |value| self.next - value));
        if self.is_inequality && value >= 0.0 { 0.0 } else { value * change }
    }
}

/// The part of the way from the unknowns so far to the next ones at which the sum of the squares of all that is missed is least. Newton's
/// method for this convex function, with equations for the inequalities that are missed, may go to and fro for ever without.
pub(super) fn best_part<'a>(conditions: impl Iterator<Item = &'a LinearCondition>) -> f64 {
    let conditions: Vec<&LinearCondition> = conditions.collect();
    let slope = |part: f64| conditions.iter().map(|c| c.slope(part)).sum::<f64>();
    if slope(1.0) <= 0.0 {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if slope(middle) <= 0.0 { low = middle } else { high = middle }
    }
    high
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The last one of the halvings.
    const HALVED: f64 = 1e-12;

    /// Conditions on one unknown that were taken at one value and then at another one.
    fn between(conditions: &mut [LinearCondition], before: f64, next: f64) {
        for c in conditions.iter_mut() {
            c.evaluate(&[before, 1.0]);
            c.settle(1.0);
            c.evaluate(&[next, 1.0]);
        }
    }

    #[test]
    fn the_way_ends_where_what_is_missed_is_least() {
        // (x - 1)^2, and x >= 3 with as much weight: least at 2.
        let conditions = || {
            [
                LinearCondition::equation(vec![1.0, -1.0], 1.0),
                LinearCondition::at_least_zero(vec![1.0, -3.0], 1.0),
            ]
        };
        let mut far = conditions();
        between(&mut far, 0.0, 8.0);
        let part = best_part(far.iter());
        assert!((0.25..0.25 + HALVED).contains(&part), "{part}");
        // Up to there all the way is best.
        let mut near = conditions();
        between(&mut near, 0.0, 1.5);
        assert_eq!(best_part(near.iter()), 1.0);
        // Before there are unknowns nothing is known of the way.
        let mut first = conditions();
        first.iter_mut().for_each(|c| c.evaluate(&[8.0, 1.0]));
        assert_eq!(best_part(first.iter()), 1.0);
    }

    #[test]
    fn an_inequality_counts_where_it_is_missed() {
        let mut conditions = [LinearCondition::at_least_zero(vec![1.0, -3.0], 1.0)];
        between(&mut conditions, 0.0, 8.0);
        let [condition] = &mut conditions;
        assert!(condition.counts);
        assert!(!condition.settle(0.25) && condition.counts, "at 2");
        condition.evaluate(&[8.0, 1.0]);
        assert!(condition.settle(1.0) && !condition.counts, "at 8");
    }
}
