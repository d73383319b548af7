//! Solutions that can be evaluated at any time.

use std::ops::ControlFlow;

use crate::step::{Form, Observer, Step};
use crate::{OdeError, error};

/// A solution kept as a whole: the dense output of every step.
///
/// An [`Observer`]; hand `&mut` of it to the integrator, or use
/// [`Integrator::solve_dense`](crate::Integrator::solve_dense).
#[derive(Debug, Clone, PartialEq)]
pub struct DenseSolution {
    dimension: usize,
    /// Times at the ends of the steps, the start first.
    times: Vec<f64>,
    /// Size of the interpolant of each step; a step cut short by an event has a larger one than its length.
    sizes: Vec<f64>,
    rows: Vec<f64>,
    row_count: usize,
    form: Form,
}

impl DenseSolution {
    /// A solution that starts, and so far ends, at `t0` with the state `x0`.
    pub fn new(t0: f64, x0: &[f64]) -> Self {
        Self {
            dimension: x0.len(),
            times: vec![t0],
            sizes: vec![],
            rows: x0.to_vec(),
            row_count: 1,
            form: Form::Powers,
        }
    }

    /// Number of components of the state.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Times at the ends of the steps in the order of integration, the start time first.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Start time.
    pub fn start(&self) -> f64 {
        self.times[0]
    }

    /// End time.
    pub fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Writes the state at `t` to `out`.
    ///
    /// # Errors
    /// [`OdeError::OutsideInterval`] where `t` is NaN or not covered, [`OdeError::Dimension`] for the wrong length.
    pub fn evaluate(&self, t: f64, out: &mut [f64]) -> Result<(), OdeError> {
        error::require_dimension("out", self.dimension, out.len())?;
        let (start, end) = (self.start(), self.end());
        if !(start.min(end)..=start.max(end)).contains(&t) {
            return Err(OdeError::OutsideInterval { time: t, start, end });
        }
        if self.sizes.is_empty() {
            out.copy_from_slice(&self.rows);
            return Ok(());
        }
        let backward = end < start;
        let after = self.times.partition_point(|&time| if backward { time >= t } else { time <= t });
        let step = after.clamp(1, self.sizes.len()) - 1;
        let length = self.row_count * self.dimension;
        let rows = &self.rows[step * length..(step + 1) * length];
        self.form.evaluate(rows, self.dimension, (t - self.times[step]) / self.sizes[step], out);
        Ok(())
    }
}

impl Observer for DenseSolution {
    fn step(&mut self, step: &Step<'_>) -> ControlFlow<()> {
        if self.sizes.is_empty() {
            self.rows.clear();
            self.row_count = step.rows.len() / self.dimension;
            self.form = step.form;
        }
        self.times.push(step.end);
        self.sizes.push(step.size);
        self.rows.extend_from_slice(step.rows);
        ControlFlow::Continue(())
    }
}
