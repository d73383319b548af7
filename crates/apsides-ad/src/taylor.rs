//! Taylor coefficients of solutions of `x' = f(t, x, p)`, where `f` is a formula.
//!
//! The coefficients of order `k` of all values of the formula follow from those of lower orders by recurrences, and
//! `x[k + 1] = f[k] / (k + 1)`: order `n` takes `O(n^2)` operations and no derivative is written down. Products
//! of coefficients are taken eight at a time, with the vector instructions of the machine and no fused multiplication and addition, so that
//! results do not depend on it.
//!
//! R. E. Moore, *Interval Analysis*, Prentice-Hall 1966, section 11; A. Jorba, M. Zou, A software package for the numerical integration of
//! ODEs by means of high-order Taylor methods, Exp. Math. 14 (2005) 99, doi 10.1080/10586458.2005.10128904.

mod convolutions;
mod lanes;
mod lowering;
mod rules;
mod schedule;

use pulp::{Arch, Simd, WithSimd};

use crate::formula::{Formula, Operation};
use crate::table::Table;
use convolutions::Convolution;
use lowering::{Lowered, Rule};
use schedule::Group;
use std::sync::Arc;

/// Highest order; double precision needs 20.
const HIGHEST_ORDER: usize = convolutions::ROOM - 4;

/// States that are summed at once.
const LANES: usize = 4;

/// A formula without Taylor coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TaylorError {
    /// An operation that is not smooth, or known by a table alone, on a value that changes along the solution.
    #[error(
        "operation {operation} (`{name}`) has no recurrence for Taylor coefficients; write the formula without it, or integrate by a \
         Runge-Kutta method"
    )]
    NoRecurrence {
        /// Index of the operation in the formula.
        operation: usize,
        /// Its name, as in [`Formula::to_json`].
        name: &'static str,
    },
    /// The formula does not have its states, its parameters and the time as inputs.
    #[error(
        "a formula with {outputs} rates needs {outputs} states, its parameters and the time as inputs, it has {inputs} inputs"
    )]
    Inputs {
        /// Number of inputs.
        inputs: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// The order is zero or too high.
    #[error("order {order} is not between 1 and {HIGHEST_ORDER}")]
    Order {
        /// The order.
        order: usize,
    },
}

/// The recurrences of a formula `f(x, p, t)`, whose inputs are the states, any number of parameters and the time, as those of
/// [`dynamics_node`](crate::dynamics_node) with the controls among the parameters; its outputs are the rates of the states.
///
/// ```
/// use apsides_ad::taylor::TaylorSeries;
/// use apsides_ad::FormulaBuilder;
///
/// // x' = x has the coefficients 1 / k! at x = 1.
/// let mut b = FormulaBuilder::new(2);
/// let x = b.input(0);
/// let mut series = TaylorSeries::new(&b.formula(&[x])?, 4)?;
/// series.expand(0.0, &[1.0], &[]);
/// let found: Vec<f64> = (0..=4).map(|k| series.coefficients(k)[0]).collect();
/// assert_eq!(found, [1.0, 1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct TaylorSeries {
    states: usize,
    parameters: usize,
    order: usize,
    /// Number of values, the length of a row of coefficients.
    values: usize,
    /// Values that are the same all along the solution, with their operations.
    fixed: Vec<(usize, Operation)>,
    tables: Vec<Arc<Table>>,
    groups: Vec<Group>,
    convolutions: Vec<Convolution>,
    /// Sums of the convolutions at an order.
    sums: Vec<f64>,
    outputs: Vec<usize>,
    /// Coefficients of all values, a row for each order.
    rows: Vec<f64>,
    /// `1 / k`.
    reciprocals: Vec<f64>,
}

impl TaylorSeries {
    /// The recurrences of a formula up to an order.
    ///
    /// # Errors
    /// [`TaylorError`]: an operation has no recurrence, inputs are missing, or the order is not between 1 and 28.
    pub fn new(formula: &Formula, order: usize) -> Result<Self, TaylorError> {
        let (inputs, states) = (formula.inputs(), formula.outputs().len());
        if inputs <= states {
            return Err(TaylorError::Inputs { inputs, outputs: states });
        }
        if !(1..=HIGHEST_ORDER).contains(&order) {
            return Err(TaylorError::Order { order });
        }
        let lowered = Lowered::new(formula, states)?;
        // By four, so that states are summed in lanes.
        let values = lowered.rules.len().next_multiple_of(LANES);
        let fixed = lowered.rules.iter().enumerate().filter_map(|(v, rule)| match rule {
            Rule::Fixed(operation) => Some((v, *operation)),
            _ => None,
        });
        let mut groups = schedule::groups(&lowered);
        let convolutions = schedule::convolutions(&mut groups);
        Ok(Self {
            states,
            parameters: inputs - states - 1,
            order,
            values,
            fixed: fixed.collect(),
            tables: formula.tables().to_vec(),
            sums: vec![0.0; convolutions.len()],
            convolutions,
            groups,
            outputs: lowered.outputs.clone(),
            rows: vec![0.0; values * (order + 1)],
            reciprocals: (0..=order).map(|k| 1.0 / k as f64).collect(),
        })
    }

    /// Number of states.
    #[must_use]
    pub fn states(&self) -> usize {
        self.states
    }

    /// Number of parameters.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Highest order.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// Coefficients of the states of one order, `x^(k) / k!`, of the last expansion; zero before the first.
    ///
    /// # Panics
    /// When the order is above [`order`](Self::order).
    #[must_use]
    pub fn coefficients(&self, order: usize) -> &[f64] {
        assert!(order <= self.order, "order {order} is above {}", self.order);
        &self.rows[order * self.values..order * self.values + self.states]
    }

    /// Expands the solution through the states `x` at the time `t`. Outside the domain of the formula coefficients are not finite.
    ///
    /// # Panics
    /// When `x` or `parameters` have another length than [`states`](Self::states) and [`parameters`](Self::parameters).
    pub fn expand(&mut self, t: f64, x: &[f64], parameters: &[f64]) {
        assert_eq!((x.len(), parameters.len()), (self.states, self.parameters), "one number for each input");
        self.start(t, x, parameters);
        Arch::new().dispatch(Recursion(self));
    }

    /// Writes the sum of the series at a distance `h` from the start of the expansion to `x`, of length [`states`](Self::states).
    ///
    /// # Panics
    /// When `x` has another length.
    pub fn evaluate(&self, h: f64, x: &mut [f64]) {
        assert_eq!(x.len(), self.states, "one number for each state");
        let mut powers = [1.0; HIGHEST_ORDER + 1];
        powers[1] = h;
        // Of halves: less rounding, and none waits for all before it.
        for k in 2..=self.order {
            powers[k] = powers[k / 2] * powers[k.div_ceil(2)];
        }
        Arch::new().dispatch(Summation { series: self, powers: &powers[..=self.order], x });
    }

    /// The values of order zero that are known, and all fixed ones.
    fn start(&mut self, t: f64, x: &[f64], parameters: &[f64]) {
        let (n, m) = (self.states, self.parameters);
        let (row, later) = self.rows.split_at_mut(self.values);
        row[..n].copy_from_slice(x);
        row[n..n + m].copy_from_slice(parameters);
        row[n + m] = t;
        // Fixed values, also of the last expansion, are zero from order one on: nothing writes there.
        later[n + m] = 1.0;
        for &(v, operation) in &self.fixed {
            row[v] = operation.apply(|k| row[k], &self.tables);
        }
        for group in &mut self.groups {
            match group {
                Group::Sums(sums) => {
                    sums.weigh(row);
                    sums.advance(0, row);
                }
                Group::Rules(kind, _, items) => kind.begin(items, row),
                Group::Lanes(lanes) => lanes.begin(row),
            }
        }
        for group in &mut self.groups {
            match group {
                Group::Sums(_) => {}
                Group::Rules(kind, _, items) => kind.take(items, row),
                Group::Lanes(lanes) => lanes.take(row),
            }
        }
    }

    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S) {
        let Self { order, values, groups, convolutions, sums, outputs, rows, reciprocals, .. } = self;
        let (zeroth, later) = rows.split_at_mut(*values);
        scale(later, zeroth, outputs, 1.0);
        for k in 1..*order {
            let (earlier, row) = rows.split_at_mut(k * *values);
            let before = &earlier[(k - 1) * *values..];
            let (row, next) = row.split_at_mut(*values);
            convolutions::advance(convolutions, simd, k, before, sums);
            for group in &mut *groups {
                match group {
                    Group::Sums(sums) => sums.advance(k, row),
                    Group::Rules(kind, from, items) => {
                        kind.advance(items, &sums[*from..], k as f64, reciprocals[k], row);
                    }
                    Group::Lanes(lanes) => lanes.advance(k, reciprocals[k], before, row),
                }
            }
            scale(next, row, outputs, reciprocals[k + 1]);
        }
    }
}

/// Coefficients of the states of the next order, those of their rates by that order.
#[inline(always)]
fn scale(next: &mut [f64], row: &[f64], outputs: &[usize], by: f64) {
    for (next, &v) in next.iter_mut().zip(outputs) {
        *next = row[v] * by;
    }
}

/// An expansion with the vector instructions of the machine.
struct Recursion<'a>(&'a mut TaylorSeries);

impl WithSimd for Recursion<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.advance(simd);
    }
}

/// A sum of the series of all states: the small terms first, the first three in twice the precision, so that the rounding of long steps
/// is that of the sum.
struct Summation<'a> {
    series: &'a TaylorSeries,
    powers: &'a [f64],
    x: &'a mut [f64],
}

impl WithSimd for Summation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let TaylorSeries { rows, values, .. } = self.series;
        for (lanes, x) in self.x.chunks_mut(LANES).enumerate() {
            let row = |k: usize| {
                let row = rows.get(k * values + lanes * LANES..).and_then(|row| row.first_chunk::<LANES>());
                row.copied().unwrap_or_default()
            };
            // Two sums of every other term: neither waits for all additions.
            let mut sums = [[0.0; LANES]; 2];
            for k in (3..self.powers.len()).rev() {
                let (row, power) = (row(k), self.powers[k]);
                for l in 0..LANES {
                    sums[k % 2][l] += row[l] * power;
                }
            }
            let (start, slope, bend) = (row(0), row(1), row(2));
            let h = self.powers[1];
            let (square, square_rest) = product(h, h);
            let sum: [f64; LANES] = std::array::from_fn(|l| {
                let (first, first_rest) = product(slope[l], h);
                let (second, second_rest) = product(bend[l], square);
                let (sum, lost) = exact_sum(start[l], first);
                let (sum, lost_next) = exact_sum(sum, second);
                let rest = (first_rest + (second_rest + bend[l] * square_rest)) + (lost + lost_next);
                sum + ((sums[0][l] + sums[1][l]) + rest)
            });
            x.copy_from_slice(&sum[..x.len()]);
        }
    }
}

/// A product and what its rounding left out, by a fused multiplication, which is exact on any machine.
#[inline(always)]
fn product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

/// A sum and what its rounding left out.
///
/// D. E. Knuth, The Art of Computer Programming 2, section 4.2.2, theorem B.
#[inline(always)]
fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let second = sum - a;
    (sum, (a - (sum - second)) + (b - second))
}

#[cfg(test)]
mod tests;
