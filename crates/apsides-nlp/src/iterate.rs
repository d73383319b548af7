//! Points, directions and the bounds they respect. All vectors are allocated once.

use crate::model::BarrierModel;
use crate::vector::{LogarithmSum, largest, sum, sum_abs};

/// A primal-dual point with the values that the line search needs there.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    pub v: Vec<f64>,
    pub y: Vec<f64>,
    pub zl: Vec<f64>,
    pub zu: Vec<f64>,
    /// Distance to the bounds; infinite where there is none.
    pub lower_slack: Vec<f64>,
    pub upper_slack: Vec<f64>,
    pub objective: f64,
    pub constraints: Vec<f64>,
    /// 1-norm of the constraints.
    pub violation: f64,
}

impl Point {
    pub(crate) fn new(n: usize, m: usize) -> Self {
        Self {
            v: vec![0.0; n],
            y: vec![0.0; m],
            zl: vec![0.0; n],
            zu: vec![0.0; n],
            lower_slack: vec![f64::INFINITY; n],
            upper_slack: vec![f64::INFINITY; n],
            objective: 0.0,
            constraints: vec![0.0; m],
            violation: 0.0,
        }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.v.copy_from_slice(&other.v);
        self.y.copy_from_slice(&other.y);
        self.zl.copy_from_slice(&other.zl);
        self.zu.copy_from_slice(&other.zu);
        self.lower_slack.copy_from_slice(&other.lower_slack);
        self.upper_slack.copy_from_slice(&other.upper_slack);
        self.constraints.copy_from_slice(&other.constraints);
        self.objective = other.objective;
        self.violation = other.violation;
    }

    /// Evaluates objective and constraints; false if something is not finite.
    pub(crate) fn evaluate(&mut self, model: &mut impl BarrierModel) -> bool {
        self.objective = model.objective(&self.v);
        if !self.objective.is_finite() {
            return false;
        }
        model.constraints(&self.v, &mut self.constraints);
        self.violation = sum_abs(&self.constraints);
        self.violation.is_finite()
    }
}

/// A search direction.
#[derive(Debug, Clone)]
pub(crate) struct Direction {
    pub v: Vec<f64>,
    pub y: Vec<f64>,
    pub zl: Vec<f64>,
    pub zu: Vec<f64>,
}

impl Direction {
    pub(crate) fn new(n: usize, m: usize) -> Self {
        Self { v: vec![0.0; n], y: vec![0.0; m], zl: vec![0.0; n], zu: vec![0.0; n] }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.v.copy_from_slice(&other.v);
        self.y.copy_from_slice(&other.y);
        self.zl.copy_from_slice(&other.zl);
        self.zu.copy_from_slice(&other.zu);
    }
}

/// Bounds on the variables, with the lists of those that exist.
#[derive(Debug, Clone)]
pub(crate) struct Bounds {
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub lower_set: Vec<usize>,
    pub upper_set: Vec<usize>,
    /// +1 with a lower bound only, -1 with an upper bound only, else 0.
    pub single: Vec<f64>,
}

impl Bounds {
    pub(crate) fn new(lower: &[f64], upper: &[f64]) -> Self {
        let n = lower.len();
        Self {
            lower: lower.to_vec(),
            upper: upper.to_vec(),
            lower_set: (0..n).filter(|&i| lower[i].is_finite()).collect(),
            upper_set: (0..n).filter(|&i| upper[i].is_finite()).collect(),
            single: (0..n)
                .map(|i| {
                    f64::from(u8::from(lower[i].is_finite())) - f64::from(u8::from(upper[i].is_finite()))
                })
                .collect(),
        }
    }

    /// Number of bounds.
    pub(crate) fn len(&self) -> usize {
        self.lower_set.len() + self.upper_set.len()
    }

    /// Distances of `point` to its bounds. A bound that the point has reached in floating point is moved outwards by a rounding error (Waechter
    /// and Biegler, section 3.5); with the `last` barrier parameter no farther than where the multiplier of the point, or of the one it comes
    /// `from`, has it on the central path, since a larger complementarity would come back with each step.
    pub(crate) fn measure(&mut self, point: &mut Point, from: Option<&Point>, barrier: f64, last: f64) {
        let Point { v, zl, zu, lower_slack, upper_slack, .. } = point;
        let (zl, zu) = from.map_or((&*zl, &*zu), |from| (&from.zl, &from.zu));
        let least = f64::EPSILON * barrier.min(1.0);
        let moved = |multiplier: f64, bound: f64| {
            let most = f64::EPSILON.powf(0.75) * bound.abs().max(1.0);
            if barrier > last { most } else { (barrier / multiplier).max(least).min(most) }
        };
        for &i in &self.lower_set {
            let mut slack = v[i] - self.lower[i];
            if slack < least {
                slack = moved(zl[i], self.lower[i]);
                self.lower[i] = self.lower[i].min(v[i]) - slack;
            }
            lower_slack[i] = slack;
        }
        for &i in &self.upper_set {
            let mut slack = self.upper[i] - v[i];
            if slack < least {
                slack = moved(zu[i], self.upper[i]);
                self.upper[i] = self.upper[i].max(v[i]) + slack;
            }
            upper_slack[i] = slack;
        }
    }

    /// `-sum ln slack`, plus the damping term.
    pub(crate) fn barrier_term(&self, point: &Point, damping: f64) -> f64 {
        let (lower, upper) = (&point.lower_slack, &point.upper_slack);
        let damped = |i: usize, slack: &[f64], sign| if self.single[i] == sign { slack[i] } else { 0.0 };
        let single = sum(&self.lower_set, |&i| damped(i, lower, 1.0))
            + sum(&self.upper_set, |&i| damped(i, upper, -1.0));
        let mut logarithms = LogarithmSum::new();
        logarithms.add(&self.lower_set, |&i| lower[i]);
        logarithms.add(&self.upper_set, |&i| upper[i]);
        damping * single - logarithms.value()
    }

    /// Longest step along `dv` that keeps the fraction `1 - tau` of every slack.
    pub(crate) fn longest_primal(&self, point: &Point, dv: &[f64], tau: f64) -> f64 {
        let lower = self.lower_set.iter().map(|&i| (point.lower_slack[i], -dv[i]));
        let upper = self.upper_set.iter().map(|&i| (point.upper_slack[i], dv[i]));
        longest(upper, longest(lower, 1.0, tau), tau)
    }

    /// The same for the bound multipliers.
    pub(crate) fn longest_dual(&self, point: &Point, dzl: &[f64], dzu: &[f64], tau: f64) -> f64 {
        let lower = self.lower_set.iter().map(|&i| (point.zl[i], -dzl[i]));
        let upper = self.upper_set.iter().map(|&i| (point.zu[i], -dzu[i]));
        longest(upper, longest(lower, 1.0, tau), tau)
    }

    /// Average of slack times multiplier; zero without bounds.
    pub(crate) fn average_complementarity(&self, point: &Point) -> f64 {
        if self.len() == 0 {
            return 0.0;
        }
        let lower = sum(&self.lower_set, |&i| point.lower_slack[i] * point.zl[i]);
        let upper = sum(&self.upper_set, |&i| point.upper_slack[i] * point.zu[i]);
        (lower + upper) / self.len() as f64
    }

    /// Largest `|slack * multiplier - barrier|`.
    pub(crate) fn complementarity_error(&self, point: &Point, barrier: f64) -> f64 {
        let lower = largest(&self.lower_set, |&i| point.lower_slack[i] * point.zl[i] - barrier);
        let upper = largest(&self.upper_set, |&i| point.upper_slack[i] * point.zu[i] - barrier);
        lower.max(upper)
    }

    /// Keeps the multipliers within a factor of `barrier / slack` (Waechter and Biegler, eq. 16).
    pub(crate) fn safeguard_multipliers(&self, point: &mut Point, barrier: f64, factor: f64) {
        let (least, most) = (barrier / factor, barrier * factor);
        let keep = |multiplier: &mut f64, slack: f64| {
            let product = *multiplier * slack;
            if product < least {
                *multiplier = least / slack;
            } else if product > most {
                *multiplier = most / slack;
            }
        };
        for &i in &self.lower_set {
            keep(&mut point.zl[i], point.lower_slack[i]);
        }
        for &i in &self.upper_set {
            keep(&mut point.zu[i], point.upper_slack[i]);
        }
    }

    /// Moves `v` inside its bounds by `push` relative to max(1, |bound|), at most `fraction` of the interval.
    pub(crate) fn push_inside(&self, v: &mut [f64], push: f64, fraction: f64) {
        for (i, value) in v.iter_mut().enumerate() {
            let (low, high) = (self.lower[i], self.upper[i]);
            let width = high - low;
            let from_low = (push * low.abs().max(1.0)).min(fraction * width);
            let from_high = (push * high.abs().max(1.0)).min(fraction * width);
            if low.is_finite() {
                *value = value.max(low + from_low);
            }
            if high.is_finite() {
                *value = value.min(high - from_high);
            }
        }
    }
}

/// The longest step up to `step` for which each amount, of the pairs of amount and decrease, keeps its fraction `1 - tau`.
fn longest(pairs: impl Iterator<Item = (f64, f64)>, step: f64, tau: f64) -> f64 {
    // A division only where the step becomes shorter.
    pairs.fold(
        step,
        |step, (amount, decrease)| {
            if tau * amount < step * decrease { tau * amount / decrease } else { step }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far from the end a bound that was reached moves by a rounding error; at the end its complementarity is the barrier parameter, however
    /// large the multiplier, and again at the next point there.
    #[test]
    fn a_bound_that_was_reached_keeps_the_central_path() {
        let mut bounds = Bounds::new(&[1.0, f64::NEG_INFINITY], &[f64::INFINITY, 0.5]);
        let mut point = Point::new(2, 0);
        point.v.copy_from_slice(&[1.0, 0.5]);
        (point.zl[0], point.zu[1]) = (8e5, 8e8);
        let (barrier, last) = (1e-11, 1e-11);
        for _ in 0..2 {
            bounds.measure(&mut point, None, barrier, last);
            let products = [point.lower_slack[0] * point.zl[0], point.upper_slack[1] * point.zu[1]];
            assert!(products.iter().all(|p| (p / barrier - 1.0).abs() < 4.0 * f64::EPSILON), "{products:?}");
            assert!(bounds.complementarity_error(&point, 0.0) < 2.0 * barrier);
        }
        let mut bounds = Bounds::new(&[1.0], &[f64::INFINITY]);
        let mut point = Point::new(1, 0);
        point.v[0] = 1.0;
        bounds.measure(&mut point, None, 1e-3, last);
        assert_eq!(point.lower_slack[0], f64::EPSILON.powf(0.75));
    }
}
