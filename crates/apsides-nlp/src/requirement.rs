//! Requirements of a problem, the limits that each consists of, and how far they have to be relaxed.

use apsides_iteration::SolveReport;

use crate::problem::{Nlp, Scaling};

/// Amounts below this part of a requirement's unit count as zero.
const NEGLIGIBLE: f64 = 1e-5;
/// Requirements with a smaller part in the conflict are no candidates for a remedy.
const LEAST_SHARE: f64 = 1e-3;

/// The quantity that a limit bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// A variable, by index.
    Variable(usize),
    /// A constraint function, by index.
    Constraint(usize),
}

/// The side on which a limit bounds a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// A lower bound; it is relaxed by lowering.
    Lower,
    /// An upper bound; it is relaxed by raising.
    Upper,
}

/// One bound on one variable or constraint function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The quantity that is bounded.
    pub place: Place,
    /// The side of the bound.
    pub side: Side,
    /// The bound; finite.
    pub value: f64,
}

impl Limit {
    /// Returns the amount by which `value` violates the limit; negative inside.
    pub fn excess(&self, value: f64) -> f64 {
        match self.side {
            Side::Lower => self.value - value,
            Side::Upper => value - self.value,
        }
    }
}

/// Limits that are relaxed together by one amount.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// The limits; all in the same unit.
    pub limits: Vec<Limit>,
    /// Typical size of the bounded quantity, positive.
    pub unit: f64,
    /// Preference among requirements: the one with the smaller weight is named first; 1.
    pub weight: f64,
    /// Largest relaxation that makes sense; infinite if any does.
    pub most: f64,
}

/// The outcome of relaxing some requirements as little as possible.
#[derive(Debug, Clone, PartialEq)]
pub struct Relaxation {
    /// Relaxation of each requirement in the user's units; zero where it is hard or holds.
    pub amounts: Vec<f64>,
    /// Part of each elastic requirement in the conflict, from 0 (none) to 1 (it gives way).
    pub shares: Vec<f64>,
    /// Largest amount that counts as zero, relative to the unit of a requirement; 1e-5. A smaller one tells smaller conflicts from none where
    /// the tolerances of the solve are below it.
    pub resolution: f64,
    /// The solve, with vectors of the size of the problem itself; the objective is the weighted sum.
    pub report: SolveReport,
}

impl Relaxation {
    pub(crate) fn new(amounts: Vec<f64>, shares: Vec<f64>, report: SolveReport) -> Self {
        Self { amounts, shares, resolution: NEGLIGIBLE, report }
    }

    /// Returns true if the amounts are those of a solution.
    pub fn is_success(&self) -> bool {
        self.report.status.is_success()
    }

    /// Requirements that give way, by relative amount, largest first.
    pub fn conflicts(&self, requirements: &[Requirement]) -> Vec<usize> {
        let relative = |g: usize| self.amounts[g] / requirements[g].unit;
        let mut found: Vec<usize> =
            (0..requirements.len()).filter(|&g| relative(g) > self.resolution).collect();
        found.sort_by(|&a, &b| relative(b).total_cmp(&relative(a)));
        found
    }

    /// Requirements worth relaxing alone: those that give way, then at most `more` others by their part.
    pub fn candidates(&self, requirements: &[Requirement], more: usize) -> Vec<usize> {
        let mut found = self.conflicts(requirements);
        let mut others: Vec<usize> =
            (0..requirements.len()).filter(|g| self.shares[*g] > LEAST_SHARE && !found.contains(g)).collect();
        others.sort_by(|&a, &b| self.shares[b].total_cmp(&self.shares[a]));
        found.extend(others.into_iter().take(more));
        found
    }
}

/// One requirement per finite bound of a problem, in the order of the variables, then the constraints.
///
/// # Examples
/// ```
/// use apsides_nlp::{Limit, Place, Side, requirements_of};
/// # use apsides_nlp::{Nlp, Pattern};
/// # struct Box;
/// # impl Nlp for Box {
/// #     fn variables(&self) -> usize { 1 }
/// #     fn constraints(&self) -> usize { 0 }
/// #     fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) { (lower[0], upper[0]) = (f64::NEG_INFINITY, 5.0) }
/// #     fn constraint_bounds(&self, _: &mut [f64], _: &mut [f64]) {}
/// #     fn initial_point(&self, x: &mut [f64]) { x[0] = 3.0 }
/// #     fn jacobian_pattern(&self) -> Pattern { Pattern::dense(0, 1) }
/// #     fn hessian_pattern(&self) -> Pattern { Pattern::lower_triangle(1) }
/// #     fn objective(&mut self, x: &[f64]) -> f64 { x[0] }
/// #     fn gradient(&mut self, _: &[f64], gradient: &mut [f64]) { gradient[0] = 1.0 }
/// #     fn constraint_values(&mut self, _: &[f64], _: &mut [f64]) {}
/// #     fn jacobian(&mut self, _: &[f64], _: &mut [f64]) {}
/// #     fn hessian(&mut self, _: &[f64], _: f64, _: &[f64], values: &mut [f64]) { values[0] = 0.0 }
/// # }
///
/// // A variable without a lower bound and of at most 5 has one requirement.
/// let requirements = requirements_of(&Box);
/// assert_eq!(requirements.len(), 1);
/// assert_eq!(requirements[0].limits, [Limit { place: Place::Variable(0), side: Side::Upper, value: 5.0 }]);
/// ```
pub fn requirements_of<N: Nlp + ?Sized>(nlp: &N) -> Vec<Requirement> {
    let (n, m) = (nlp.variables(), nlp.constraints());
    let bounds = |size: usize, read: &dyn Fn(&mut [f64], &mut [f64])| {
        let (mut lower, mut upper) = (vec![0.0; size], vec![0.0; size]);
        read(&mut lower, &mut upper);
        lower.into_iter().zip(upper).collect::<Vec<_>>()
    };
    let scaling = nlp.scaling();
    let variables = bounds(n, &|l, u| nlp.variable_bounds(l, u));
    let constraints = bounds(m, &|l, u| nlp.constraint_bounds(l, u));
    let units = |of: fn(&Scaling) -> &Vec<f64>, i: usize| scaling.as_ref().map(|s| of(s)[i]);
    let places = (0..n).map(|i| (Place::Variable(i), variables[i], units(|s| &s.variables, i)));
    let rows = (0..m).map(|i| (Place::Constraint(i), constraints[i], units(|s| &s.constraints, i)));
    let sides = places.chain(rows).flat_map(|(place, (lower, upper), unit)| {
        [(Side::Lower, lower), (Side::Upper, upper)].map(|(side, value)| (place, side, value, unit))
    });
    sides
        .filter(|(_, _, value, _)| value.is_finite())
        .map(|(place, side, value, unit)| Requirement {
            limits: vec![Limit { place, side, value }],
            unit: unit.unwrap_or(1.0),
            weight: 1.0,
            most: f64::INFINITY,
        })
        .collect()
}
