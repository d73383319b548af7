//! Taylor coefficients of solutions of `x' = f(t, x, p)`, where `f` is a formula.
//!
//! The coefficients of order `k` of all values of the formula follow from those of lower orders by recurrences, and
//! `x[k + 1] = f[k] / (k + 1)`: order `n` takes `O(n^2)` operations and no derivative is written down. Products
//! of coefficients are taken four at a time, with the vector instructions of the machine and no fused multiplication and addition, so that
//! results do not depend on it.
//!
//! R. E. Moore, *Interval Analysis*, Prentice-Hall 1966, section 11; A. Jorba, M. Zou, A software package for the numerical integration of
//! ODEs by means of high-order Taylor methods, Exp. Math. 14 (2005) 99, doi 10.1080/10586458.2005.10128904.

mod history;
mod lowering;
mod places;
mod rules;
mod schedule;
mod substitution;

use pulp::{Arch, Simd, WithSimd};

use crate::formula::{Formula, Operation};
use crate::table::Table;
use lowering::{Lowered, Rule};
use places::{Places, SMALL};
use schedule::Group;
use std::sync::Arc;
use substitution::Substitution;

/// Highest order; double precision needs 20.
const HIGHEST_ORDER: usize = 28;

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
    /// Values that are the same all along the solution, with their operations.
    fixed: Vec<(usize, Operation)>,
    tables: Vec<Arc<Table>>,
    groups: Vec<Group>,
    substitution: Substitution,
    outputs: Vec<usize>,
    /// Values of one order and of the order before, and what they are made of.
    values: [Vec<f64>; 2],
    /// Coefficients of the states, a row for each order.
    rows: Vec<f64>,
    /// Length of a row of them.
    stride: usize,
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
        let fixed = lowered.rules.iter().enumerate().filter_map(|(v, rule)| match rule {
            Rule::Fixed(operation) => Some((v, *operation)),
            _ => None,
        });
        let groups = schedule::groups(&lowered);
        let substitution = Substitution::new(&groups, &lowered.moves, &lowered.outputs);
        // By four, so that states are summed in lanes.
        let stride = states.next_multiple_of(LANES);
        Ok(Self {
            states,
            parameters: inputs - states - 1,
            order,
            fixed: fixed.collect(),
            tables: formula.tables().to_vec(),
            groups,
            outputs: lowered.outputs,
            values: std::array::from_fn(|_| vec![0.0; substitution.places().max(SMALL)]),
            substitution,
            rows: vec![0.0; stride * (order + 1)],
            stride,
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
        &self.rows[order * self.stride..order * self.stride + self.states]
    }

    /// Expands the solution through the states `x` at the time `t`. Outside the domain of the formula coefficients are not finite.
    ///
    /// # Panics
    /// When `x` or `parameters` have another length than [`states`](Self::states) and [`parameters`](Self::parameters).
    pub fn expand(&mut self, t: f64, x: &[f64], parameters: &[f64]) {
        assert_eq!((x.len(), parameters.len()), (self.states, self.parameters), "one number for each input");
        self.start(t, x, parameters);
        Arch::new().dispatch(Orders(self));
    }

    /// Writes the sum of the series at a distance `h` from the start of the expansion to `x`, of length [`states`](Self::states).
    ///
    /// # Panics
    /// When `x` has another length.
    pub fn evaluate(&self, h: f64, x: &mut [f64]) {
        assert_eq!(x.len(), self.states, "one number for each state");
        Arch::new().dispatch(Summation { series: self, h, x });
    }

    /// Everything of order zero, and the states of order one.
    fn start(&mut self, t: f64, x: &[f64], parameters: &[f64]) {
        let (n, m, [row, later]) = (self.states, self.parameters, &mut self.values);
        row[..n].copy_from_slice(x);
        row[n..n + m].copy_from_slice(parameters);
        row[n + m] = t;
        for &(v, operation) in &self.fixed {
            row[v] = operation.apply(|k| row[k], &self.tables);
        }
        self.groups.iter().for_each(|group| group.begin(row));
        self.substitution.take(row);
        let (zeroth, first) = self.rows.split_at_mut(self.stride);
        zeroth[..n].copy_from_slice(x);
        first.iter_mut().zip(&self.outputs).for_each(|(x, &v)| *x = row[v]);
        // Fixed values are zero from order one on, and sums of products at order one.
        later[..n].copy_from_slice(&first[..n]);
        later[n + m] = 1.0;
        later[self.substitution.sums()..self.substitution.places()].fill(0.0);
        row[n..n + m].fill(0.0);
        row[n + m] = 0.0;
        self.fixed.iter().for_each(|&(v, _)| row[v] = 0.0);
    }
}

/// The orders above zero of an expansion.
struct Recursion<'a> {
    substitution: &'a mut Substitution,
    rows: &'a mut [f64],
    stride: usize,
    time: u32,
    reciprocals: &'a [f64],
}

impl Recursion<'_> {
    #[inline(always)]
    fn advance<R: Places + ?Sized>(self, values: [&mut R; 2]) {
        let Self { substitution, rows, stride, time, reciprocals } = self;
        let [mut before, mut row] = values;
        for (k, by) in reciprocals.windows(2).enumerate().skip(1) {
            substitution.sum(k, by[0], before, row);
            if k == 2 {
                before.put(time, 0.0);
            }
            substitution.substitute(by[1], row, before);
            // Those of the next order are not read back at once, which would wait until they are written.
            row.copy_to(&mut rows[k * stride..(k + 1) * stride]);
            std::mem::swap(&mut before, &mut row);
        }
        row.copy_to(&mut rows[(reciprocals.len() - 1) * stride..][..stride]);
    }
}

/// An expansion with the vector instructions of the machine.
struct Orders<'a>(&'a mut TaylorSeries);

impl WithSimd for Orders<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let TaylorSeries { states, parameters, substitution, values, rows, stride, reciprocals, .. } = self.0;
        let (stride, time) = (*stride, (*states + *parameters) as u32);
        let recursion = Recursion { substitution, rows, stride, time, reciprocals };
        let [before, row] = values;
        match (before.as_mut_slice().try_into(), row.as_mut_slice().try_into()) {
            (Ok(before), Ok(row)) => recursion.advance::<[f64; SMALL]>([before, row]),
            _ => recursion.advance([before.as_mut_slice(), row.as_mut_slice()]),
        }
    }
}

/// Powers of a number from the first on, four by four. Those of halves make those above them: less rounding, and none waits for all
/// before it.
#[inline(always)]
fn powers(h: f64) -> [[f64; LANES]; HIGHEST_ORDER / LANES] {
    let square = h * h;
    let mut by = square * square;
    let mut powers = [[h, square, square * h, by]; HIGHEST_ORDER / LANES];
    for half in [1, 2, 4] {
        for k in half..(2 * half).min(powers.len()) {
            powers[k] = powers[k - half].map(|power| power * by);
        }
        by *= by;
    }
    powers
}

/// A sum of the series of all states: the small terms first, the first three in twice the precision, so that the rounding of long steps
/// is that of the sum.
struct Summation<'a> {
    series: &'a TaylorSeries,
    h: f64,
    x: &'a mut [f64],
}

impl WithSimd for Summation<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let TaylorSeries { rows, stride, .. } = self.series;
        let (h, order, powers) = (self.h, self.series.order.min(HIGHEST_ORDER), powers(self.h));
        let powers = powers.as_flattened();
        let power = |k: usize| powers[k - 1];
        for (lanes, x) in self.x.chunks_mut(LANES).enumerate() {
            let row = |k: usize| {
                let row = rows.get(k * stride + lanes * LANES..).and_then(|row| row.first_chunk::<LANES>());
                row.copied().unwrap_or_default()
            };
            // Two sums of every other term: neither waits for all additions.
            let mut sums = [[0.0; LANES]; 2];
            let mut k = order + 1;
            if k % 2 == 0 {
                k -= 1;
                sums[1] = row(k).map(|c| c * power(k));
            }
            while k > 3 {
                k -= 2;
                let (even, odd) = (row(k + 1), row(k));
                for l in 0..LANES {
                    sums[0][l] += even[l] * power(k + 1);
                    sums[1][l] += odd[l] * power(k);
                }
            }
            let (start, slope, bend) = (row(0), row(1), row(2));
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
