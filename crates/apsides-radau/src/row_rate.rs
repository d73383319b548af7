//! The first rate of a path constraint row as a function of the states: `g' = dg/dx f + dg/dt`.
//!
//! Its second derivatives hold third ones of the row. Where the conditions that it stands in have multipliers which vanish at the solution they are
//! left out: Newton's method is as fast without them. Elsewhere the third derivatives, along the flow alone, are central differences of the
//! second ones.

use std::sync::{Arc, Mutex, PoisonError};

use apsides_ad::trace::OpaqueFunction;
use apsides_ad::{Formula, NodeFunction, NodePattern};

/// The rate of one output of a path function along the equations of motion, both of the same inputs.
pub(crate) struct RowRate {
    row: Arc<dyn NodeFunction>,
    output: usize,
    dynamics: Arc<dyn NodeFunction>,
    pattern: NodePattern,
    /// Step in time of the differences along the flow.
    step: f64,
    work: Mutex<Work>,
}

/// Values and derivatives of the parts.
struct Work {
    values: Vec<f64>,
    slopes: Vec<f64>,
    weights: Vec<f64>,
    bends: Vec<f64>,
    rates: Vec<f64>,
    entries: Vec<f64>,
    gradient: Vec<f64>,
    /// Slopes of the row by the states.
    own: Vec<f64>,
    of_rates: Vec<f64>,
    bends_before: Vec<f64>,
    moved: Vec<f64>,
    /// Second derivatives, over all inputs.
    square: Vec<f64>,
}

impl RowRate {
    /// The rate, if both have the same inputs.
    pub(crate) fn new(
        row: &Arc<dyn NodeFunction>,
        output: usize,
        dynamics: &Arc<dyn NodeFunction>,
    ) -> Option<Self> {
        let inputs = row.inputs();
        if dynamics.inputs() != inputs {
            return None;
        }
        let (of_row, of_rates) = (row.pattern(), dynamics.pattern());
        let own = &of_row.columns[of_row.row_offsets[output]..of_row.row_offsets[output + 1]];
        let states = own.iter().copied().filter(|c| *c < dynamics.outputs());
        let beyond =
            states.flat_map(|s| &of_rates.columns[of_rates.row_offsets[s]..of_rates.row_offsets[s + 1]]);
        let mut columns: Vec<usize> = own.iter().chain(beyond).copied().collect();
        columns.sort_unstable();
        columns.dedup();
        let work = Work {
            values: vec![0.0; row.outputs()],
            slopes: vec![0.0; of_row.jacobian_len()],
            weights: (0..row.outputs()).map(|k| f64::from(u8::from(k == output))).collect(),
            bends: vec![0.0; of_row.hessian_len()],
            rates: vec![0.0; dynamics.outputs()],
            entries: vec![0.0; of_rates.jacobian_len()],
            gradient: vec![0.0; inputs],
            own: vec![0.0; dynamics.outputs()],
            of_rates: vec![0.0; of_rates.hessian_len()],
            bends_before: vec![0.0; of_row.hessian_len()],
            moved: vec![0.0; inputs],
            square: vec![0.0; inputs * inputs],
        };
        let pattern = NodePattern { row_offsets: vec![0, columns.len()], columns, hessian: Vec::new() };
        Some(Self {
            row: Arc::clone(row),
            output,
            dynamics: Arc::clone(dynamics),
            pattern,
            step: 0.0,
            work: work.into(),
        })
    }

    /// The same with second derivatives, from differences with this step in time.
    pub(crate) fn with_bends(mut self, step: f64) -> Self {
        let columns = &self.pattern.columns;
        let pairs = columns.iter().enumerate().flat_map(|(k, i)| columns[..=k].iter().map(|j| (*i, *j)));
        self.pattern.hessian = pairs.collect();
        self.step = step;
        self
    }

    /// Second derivatives in the work space, from the slopes, the bends and the rates there.
    fn bend(&self, z: &[f64], work: &mut Work) {
        let Work {
            values,
            slopes,
            weights,
            bends,
            rates,
            entries,
            own,
            of_rates,
            bends_before,
            moved,
            square,
            ..
        } = work;
        let (row, dynamics) = (self.row.as_ref(), self.dynamics.as_ref());
        let n = z.len();
        row.jacobian(z, values, slopes);
        row.hessian(z, weights, bends);
        dynamics.jacobian(z, rates, entries);
        square.fill(0.0);
        // The second derivatives of the rates.
        own.fill(0.0);
        for ((r, c), slope) in row.pattern().jacobian_entries().zip(slopes.iter()) {
            if r == self.output && c < own.len() {
                own[c] += slope;
            }
        }
        dynamics.hessian(z, own, of_rates);
        for (&(i, j), v) in dynamics.pattern().hessian.iter().zip(of_rates.iter()) {
            square[i * n + j] += v;
        }
        // Bends of the row times slopes of the rates.
        let mut add = |i: usize, c: usize, bend: f64| {
            if c < rates.len() {
                for k in dynamics.pattern().row_offsets[c]..dynamics.pattern().row_offsets[c + 1] {
                    let j = dynamics.pattern().columns[k];
                    let twice = if i == j { 2.0 } else { 1.0 };
                    square[i.max(j) * n + i.min(j)] += twice * bend * entries[k];
                }
            }
        };
        for (&(i, j), bend) in row.pattern().hessian.iter().zip(bends.iter()) {
            add(i, j, *bend);
            if i != j {
                add(j, i, *bend);
            }
        }
        // The third derivatives of the row along the flow, where it is known on both sides.
        let mut bends_at = |step: f64, bends: &mut [f64]| {
            moved.copy_from_slice(z);
            moved.iter_mut().zip(rates.iter()).for_each(|(m, rate)| *m += step * rate);
            moved[n - 1] += step;
            row.hessian(moved, weights, bends);
        };
        bends_at(self.step, bends);
        bends_at(-self.step, bends_before);
        let pairs = row.pattern().hessian.iter().zip(bends.iter().zip(bends_before.iter()));
        for (&(i, j), (after, before)) in pairs {
            let third = (after - before) / (2.0 * self.step);
            square[i * n + j] += if third.is_finite() { third } else { 0.0 };
        }
    }

    /// The rate, with its gradient in the work space.
    fn evaluate(&self, z: &[f64], work: &mut Work) -> f64 {
        let Work { values, slopes, weights, bends, rates, entries, gradient, .. } = work;
        let (row, dynamics) = (self.row.as_ref(), self.dynamics.as_ref());
        row.jacobian(z, values, slopes);
        row.hessian(z, weights, bends);
        dynamics.jacobian(z, rates, entries);
        let time = z.len() - 1;
        let speed = |i: usize| rates.get(i).copied().unwrap_or(f64::from(u8::from(i == time)));
        gradient.fill(0.0);
        let mut value = 0.0;
        for ((r, c), slope) in row.pattern().jacobian_entries().zip(slopes.iter()) {
            if r == self.output {
                value += slope * speed(c);
                if let Some(start) = dynamics.pattern().row_offsets.get(c).filter(|_| c < rates.len()) {
                    for k in *start..dynamics.pattern().row_offsets[c + 1] {
                        gradient[dynamics.pattern().columns[k]] += slope * entries[k];
                    }
                }
            }
        }
        for (&(i, j), bend) in row.pattern().hessian.iter().zip(bends.iter()) {
            gradient[i] += bend * speed(j);
            if i != j {
                gradient[j] += bend * speed(i);
            }
        }
        value
    }
}

impl NodeFunction for RowRate {
    fn inputs(&self) -> usize {
        self.row.inputs()
    }

    fn outputs(&self) -> usize {
        1
    }

    fn pattern(&self) -> &NodePattern {
        &self.pattern
    }

    fn value(&self, z: &[f64], out: &mut [f64]) {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        out[0] = self.evaluate(z, &mut work);
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        out[0] = self.evaluate(z, &mut work);
        for (entry, column) in entries.iter_mut().zip(&self.pattern.columns) {
            *entry = work.gradient[*column];
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        if entries.is_empty() {
            return;
        }
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        self.bend(z, &mut work);
        for (entry, (i, j)) in entries.iter_mut().zip(&self.pattern.hessian) {
            *entry = weights[0] * work.square[i * z.len() + j];
        }
    }

    fn formula(&self) -> Result<Formula, OpaqueFunction> {
        Err(OpaqueFunction { name: "rate of a path constraint".into() })
    }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, PathFunction, Scalar, dynamics_node, path_node};

    use super::*;

    /// A body on a line with a drag that depends on the time: `x' = v`, `v' = u - t v^2`.
    struct Body;

    impl Dynamics<2, 1> for Body {
        fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            [x[1], u[0] - t * x[1].square()]
        }
    }

    /// A function without use, and `t x^2 v`.
    struct Row;

    impl PathFunction<2, 1, 2> for Row {
        fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            [x[0].sin(), t * x[0].square() * x[1]]
        }
    }

    #[test]
    fn the_rate_and_its_gradient_follow_from_the_product_rule() {
        let (row, dynamics) = (path_node(Row), dynamics_node(Body));
        let rate = RowRate::new(&row, 1, &dynamics).expect("both have the same inputs");
        let [x, v, u, t] = [1.5, -0.7, 0.4, 2.0];
        assert_eq!(rate.pattern().columns, [0, 1, 2, 3]);
        let (mut value, mut gradient) = ([0.0], [0.0; 4]);
        rate.jacobian(&[x, v, u, t], &mut value, &mut gradient);
        let acceleration = u - t * v * v;
        let expected = 2.0 * t * x * v * v + t * x * x * acceleration + x * x * v;
        let by_x = 2.0 * t * v * v + 2.0 * t * x * acceleration + 2.0 * x * v;
        let by_v = 4.0 * t * x * v - 2.0 * t * t * x * x * v + x * x;
        let by_t = 2.0 * x * v * v + x * x * acceleration - t * x * x * v * v;
        // Rounding of a few operations.
        const ROUNDING: f64 = 1e-14;
        assert!((value[0] - expected).abs() < ROUNDING);
        for (found, expected) in gradient.iter().zip([by_x, by_v, t * x * x, by_t]) {
            assert!((found - expected).abs() < ROUNDING, "{found} {expected}");
        }
        let mut again = [0.0];
        rate.value(&[x, v, u, t], &mut again);
        assert_eq!(again, value);
    }

    #[test]
    fn second_derivatives_hold_those_of_the_row_along_the_flow() {
        let rate = RowRate::new(&path_node(Row), 1, &dynamics_node(Body)).expect("both have the same inputs");
        let rate = rate.with_bends(1e-4);
        let [x, v, u, t] = [1.5, -0.7, 0.4, 2.0];
        let mut entries = vec![0.0; rate.pattern().hessian_len()];
        rate.hessian(&[x, v, u, t], &[3.0], &mut entries);
        let a = u - t * v * v;
        // By x, v, u and t, of `2 t x v^2 + t x^2 (u - t v^2) + x^2 v`.
        let expected = [
            ((0, 0), 2.0 * t * a + 2.0 * v),
            ((1, 0), 4.0 * t * v - 4.0 * t * t * x * v + 2.0 * x),
            ((1, 1), 4.0 * t * x - 2.0 * t * t * x * x),
            ((2, 0), 2.0 * t * x),
            ((2, 1), 0.0),
            ((2, 2), 0.0),
            ((3, 0), 2.0 * v * v + 2.0 * x * a - 2.0 * t * x * v * v),
            ((3, 1), 4.0 * x * v - 4.0 * t * x * x * v),
            ((3, 2), x * x),
            ((3, 3), -2.0 * x * x * v * v),
        ];
        assert_eq!(rate.pattern().hessian, expected.map(|(pair, _)| pair));
        // Of central differences with this step.
        const DIFFERENCES: f64 = 1e-7;
        for (found, (pair, expected)) in entries.iter().zip(expected) {
            assert!((found - 3.0 * expected).abs() < DIFFERENCES, "{pair:?}: {found} {expected}");
        }
    }

    #[test]
    fn functions_of_other_inputs_have_no_rate() {
        struct WithParameter;
        impl Dynamics<2, 1, 1> for WithParameter {
            fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
                [x[1], u[0] * p[0]]
            }
        }
        assert!(RowRate::new(&path_node(Row), 1, &dynamics_node(WithParameter)).is_none());
    }
}
