//! One accepted step with its dense output.

use std::ops::ControlFlow;

/// An accepted step with its dense output.
///
/// With `s = (t - t_0) / h` the interpolant is `r_0 + s (r_1 + (1 - s) (r_2 + s (r_3 + (1 - s) (r_4 + ...))))`, where
/// the rows `r` are vectors of the dimension of the system; 8 rows for DOP853 (order 7), 5 for DOPRI5 (order 4). That of a Taylor
/// series is `r_0 + s (r_1 + s (r_2 + ...))` with a row more than its order.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    pub(crate) form: Form,
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) size: f64,
    pub(crate) dimension: usize,
    pub(crate) rows: &'a [f64],
}

/// The form of an interpolant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// In powers of `s` and `1 - s` by turns.
    Alternating,
    /// In powers of `s`.
    Powers,
}

impl<'a> Step<'a> {
    /// A step between two times, with an interpolant of a form and a size.
    pub(crate) fn new(
        form: Form,
        (start, end): (f64, f64),
        size: f64,
        dimension: usize,
        rows: &'a [f64],
    ) -> Self {
        Self { form, start, end, size, dimension, rows }
    }

    /// Time at the start of the step.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Time at the end of the step, before `start` when integrating backward. A step cut short by a terminal event
    /// ends at the event.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// State at the start of the step.
    pub fn start_state(&self) -> &'a [f64] {
        &self.rows[..self.dimension]
    }

    /// Returns true if `t` lies in the step, ends included.
    pub fn contains(&self, t: f64) -> bool {
        (self.start.min(self.end)..=self.start.max(self.end)).contains(&t)
    }

    /// Writes the state at `t` to `out`; accurate inside the step, an extrapolation outside.
    pub fn evaluate(&self, t: f64, out: &mut [f64]) {
        self.form.evaluate(self.rows, self.dimension, (t - self.start) / self.size, out);
    }
}

impl Form {
    /// The interpolant of [`Step`] at the relative time `s`.
    pub(crate) fn evaluate(self, rows: &[f64], n: usize, s: f64, out: &mut [f64]) {
        // Small sizes as constants: the state stays in registers.
        match n {
            2 => self.evaluate_small::<2>(rows, s, out),
            4 => self.evaluate_small::<4>(rows, s, out),
            6 => self.evaluate_small::<6>(rows, s, out),
            7 => self.evaluate_small::<7>(rows, s, out),
            _ => self.evaluate_any(rows, n, s, out),
        }
    }

    /// The factor of what follows after row `k`.
    #[inline(always)]
    fn factor(self, k: usize, s: f64) -> f64 {
        if k.is_multiple_of(2) || self == Self::Powers { s } else { 1.0 - s }
    }

    fn evaluate_small<const N: usize>(self, rows: &[f64], s: f64, out: &mut [f64]) {
        let mut sum = [0.0; N];
        for (k, row) in rows.as_chunks::<N>().0.iter().enumerate().rev() {
            let factor = self.factor(k, s);
            for i in 0..N {
                sum[i] = row[i] + factor * sum[i];
            }
        }
        out[..N].copy_from_slice(&sum);
    }

    fn evaluate_any(self, rows: &[f64], n: usize, s: f64, out: &mut [f64]) {
        let out = &mut out[..n];
        out.fill(0.0);
        for (k, row) in rows.chunks_exact(n).enumerate().rev() {
            let factor = self.factor(k, s);
            for (o, r) in out.iter_mut().zip(row) {
                *o = r + factor * *o;
            }
        }
    }
}

/// An event found inside a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Occurrence<'a> {
    /// Position of the event in the list given to the integrator.
    pub event: usize,
    /// Time of the event.
    pub time: f64,
    /// State at that time, from the dense output.
    pub state: &'a [f64],
    /// True if the event function rises through zero (in the direction of integration).
    pub rising: bool,
}

/// Sees the steps and events of an integration, in time order; the events of a step come before the step.
///
/// A closure `FnMut(&Step) -> ControlFlow<()>` is an observer of steps, `()` one of nothing.
pub trait Observer {
    /// True if [`step`](Self::step) is to be called; otherwise the dense output is computed where an event may be.
    const OBSERVES_STEPS: bool = true;

    /// Called after each accepted step; `Break` ends the integration at the end of the step.
    fn step(&mut self, _step: &Step<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called for each event; `Break` ends the integration there, as a terminal event does.
    fn event(&mut self, _occurrence: &Occurrence<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl Observer for () {
    const OBSERVES_STEPS: bool = false;
}

impl<F: FnMut(&Step<'_>) -> ControlFlow<()>> Observer for F {
    fn step(&mut self, step: &Step<'_>) -> ControlFlow<()> {
        self(step)
    }
}
