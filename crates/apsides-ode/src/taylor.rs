//! Integration by Taylor series of formulas, with the order from the tolerance.
//!
//! With the coefficients `x[k]` of the solution at the start of a step, the order `p` below for the relative tolerance `r` and the norm
//! `|y|^2 = mean_i (y_i / (a_i + r s_i))^2`, where `s_i` is the size of component `i` over the step before, the step is
//!
//! ```text
//! h = min_k (r^(k / p - 1) / (10 |x[k]|))^(1 / k)      over k = p - 1 and p
//! ```
//!
//! so that the last term is a tenth of what is tolerated, for the terms that are left out, and the last but one by as much larger as a
//! geometric series from the size of the state to the tolerance has it. Where the step would be more than twice the one before, as
//! where coefficients vanish by symmetry, the last third of the orders is looked at, and all of them if these vanish.
//!
//! A. Jorba, M. Zou, Exp. Math. 14 (2005) 99, sections 3.1 and 3.2, doi:10.1080/10586458.2005.10128904, have one size for all components,
//! which does not suit states of several units, and `p = 1 - ln(r) / 2`, the best order where its cost is `p^2`. In small systems the
//! coefficients of an order wait for those before, so that the cost is nearer to `p`, and longer steps of higher order take less time:
//! here `p` is at most `1 - 0.8 ln r`.
//!
//! Terms of long steps grow before they fall, and cancel in the sum and in products within the recurrences: of a circle, whose terms are
//! `h^k / k!`, a square has terms as large as `exp(2 h)`, and leaves a rounding `u` of `u exp(2 h)`. With Stirling's formula a step of
//! order `p` has the length `h = (p / e) r^(1 / p)`. Near the tolerance where this rounding is a quarter of `r` the order is lower, so that
//! steps are shorter, and errors go on falling with the tolerance; it is not below `1 - ln(r) / 2`.

use std::f64::consts::E;
use std::ops::Range;

use apsides_ad::{Formula, TaylorSeries};

use crate::dense::DenseSolution;
use crate::error::{require_dimension, require_finite};
use crate::event::{Event, EventTracker};
use crate::integrator::{RESOLUTION, SMALLEST_TIME, STRETCH, all_finite, show};
use crate::step::{Form, Observer, Step};
use crate::{OdeError, OdeSettings, Statistics, Status, Summary};

/// Rows that tell whether an event may be in a step: a third to the ninth is what they leave out, at most.
const ROUGH_ROWS: usize = 9;
/// Part of what is tolerated that the last term has.
const LAST_TERM: f64 = 0.1;
/// A step that grows by more than this is looked at more closely.
const GROWTH: f64 = 2.0;
/// The last orders that are looked at then are this part of all.
const LAST_PART: usize = 3;
/// Order by the logarithm of the tolerance: the least, and that of the least time where rounding does not matter.
const ORDER: [f64; 2] = [0.5, 0.8];
/// Part of what is tolerated that rounding may have in the longest step.
const ROUNDING_PART: f64 = 0.25;
/// Orders below this one have steps that are too short to be worth their start.
const LOWEST_ORDER: usize = 4;
/// Orders above this one are beyond double precision.
const HIGHEST_ORDER: usize = 28;

/// Integrates `x' = f(x, p, t)` given as a formula by Taylor series of an order that follows from the tolerance.
///
/// Beside [`Integrator`](crate::Integrator), whose systems are any functions: faster at tolerances below about 1e-8, and of smooth
/// formulas alone. The dense output is the series itself. Of the settings, `method`, `initial_step` and `stiffness_interval` have no
/// effect. An evaluation in [`Statistics`] is one expansion. Owns all storage: nothing is allocated while it runs.
///
/// ```
/// use apsides_ad::{Dynamics, Scalar, dynamics_node};
/// use apsides_ode::{OdeSettings, Status, TaylorIntegrator};
///
/// /// A pendulum of length 1 m under a gravity of 9.8 m/s2.
/// struct Pendulum;
///
/// impl Dynamics<2, 0> for Pendulum {
///     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 0], _p: &[S; 0]) -> [S; 2] {
///         [x[1], x[0].sin() * -9.8]
///     }
/// }
///
/// let formula = dynamics_node(Pendulum).formula()?;
/// let mut integrator = TaylorIntegrator::new(&formula, OdeSettings::with_tolerance(1e-14))?;
/// let mut end = [0.0; 2];
/// let summary = integrator.integrate(0.0, &[1.0, 0.0], &[], 2.0, &mut end)?;
/// assert_eq!(summary.status, Status::Completed);
/// // The energy is what it was.
/// let energy = |x: &[f64; 2]| 0.5 * x[1] * x[1] - 9.8 * x[0].cos();
/// assert!((energy(&end) - energy(&[1.0, 0.0])).abs() < 1e-13);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct TaylorIntegrator {
    settings: OdeSettings,
    series: TaylorSeries,
    /// Absolute tolerances of the controlled components.
    absolute: Vec<f64>,
    x: Vec<f64>,
    next: Vec<f64>,
    /// Logarithm of the norm that the terms of each order may have.
    tolerated: Vec<f64>,
    /// Size of each component over the step before.
    sizes: Vec<f64>,
    /// One over what is tolerated of each controlled component.
    weights: Vec<f64>,
    /// Coefficients times powers of the step.
    rows: Vec<f64>,
    events: EventTracker,
}

impl TaylorIntegrator {
    /// An integrator of a formula whose inputs are the states, any number of parameters and the time, and whose outputs are the rates of
    /// the states: that of [`dynamics_node`](apsides_ad::dynamics_node), with the controls as parameters.
    ///
    /// # Errors
    /// [`OdeError::Taylor`] where the formula has an operation without a recurrence or not these inputs, [`OdeError::Setting`] or
    /// [`OdeError::Dimension`] where the settings are out of range or do not fit.
    pub fn new(formula: &Formula, settings: OdeSettings) -> Result<Self, OdeError> {
        let n = formula.outputs().len();
        if n == 0 {
            return Err(OdeError::Dimension { argument: "the formula", expected: 1, found: 0 });
        }
        let absolute = settings.checked(n)?;
        let series = TaylorSeries::new(formula, best_order(settings.relative_tolerance))?;
        let zeros = vec![0.0; n];
        let (relative, p) = (settings.relative_tolerance, series.order() as f64);
        Ok(Self {
            tolerated: (0..=series.order())
                .map(|k| LAST_TERM.ln() + (k as f64 / p - 1.0) * relative.ln())
                .collect(),
            weights: vec![0.0; absolute.len()],
            settings,
            absolute,
            x: zeros.clone(),
            next: zeros.clone(),
            sizes: zeros,
            rows: vec![0.0; n * (series.order() + 1)],
            events: EventTracker::new(n),
            series,
        })
    }

    /// Number of components.
    pub fn dimension(&self) -> usize {
        self.series.states()
    }

    /// Order of the series.
    pub fn order(&self) -> usize {
        self.series.order()
    }

    /// The settings.
    pub fn settings(&self) -> &OdeSettings {
        &self.settings
    }

    /// Integrates from `x0` at `t0` to `t1` with these parameters; the state reached is written to `x1`.
    ///
    /// # Errors
    /// [`OdeError::Dimension`] or [`OdeError::NotFinite`] where an argument does not fit or is NaN or infinite.
    pub fn integrate(
        &mut self,
        t0: f64,
        x0: &[f64],
        parameters: &[f64],
        t1: f64,
        x1: &mut [f64],
    ) -> Result<Summary, OdeError> {
        self.integrate_observed(t0, x0, parameters, t1, x1, &[], &mut ())
    }

    /// Like [`integrate`](Self::integrate), locating `events` and showing steps and events to `observer`.
    ///
    /// # Errors
    /// As [`integrate`](Self::integrate).
    pub fn integrate_observed<O: Observer>(
        &mut self,
        t0: f64,
        x0: &[f64],
        parameters: &[f64],
        t1: f64,
        x1: &mut [f64],
        events: &[Event<'_>],
        observer: &mut O,
    ) -> Result<Summary, OdeError> {
        let n = self.dimension();
        require_dimension("x0", n, x0.len())?;
        require_dimension("x1", n, x1.len())?;
        require_dimension("parameters", self.series.parameters(), parameters.len())?;
        require_finite("t0", &[t0])?;
        require_finite("t1", &[t1])?;
        require_finite("x0", x0)?;
        require_finite("parameters", parameters)?;
        require_finite("t1 - t0", &[t1 - t0])?;
        self.x.copy_from_slice(x0);
        let summary = self.run(t0, parameters, t1, events, observer);
        x1.copy_from_slice(&self.x);
        Ok(summary)
    }

    /// Integrates from `x0` at `t0` to `t1` and keeps the series of every step (this allocates).
    ///
    /// # Errors
    /// As [`integrate`](Self::integrate).
    pub fn solve_dense(
        &mut self,
        t0: f64,
        x0: &[f64],
        parameters: &[f64],
        t1: f64,
    ) -> Result<(Summary, DenseSolution), OdeError> {
        let mut solution = DenseSolution::new(t0, x0);
        let mut end = vec![0.0; self.dimension()];
        let summary = self.integrate_observed(t0, x0, parameters, t1, &mut end, &[], &mut solution)?;
        Ok((summary, solution))
    }

    fn run<O: Observer>(
        &mut self,
        t0: f64,
        parameters: &[f64],
        t1: f64,
        events: &[Event<'_>],
        observer: &mut O,
    ) -> Summary {
        let n = self.dimension();
        let mut statistics = Statistics::default();
        let direction = (t1 - t0).signum();
        let limit = self.settings.fixed_step.unwrap_or(self.settings.max_step);
        let stretch = if self.settings.fixed_step.is_some() { STRETCH } else { 1.0 };
        let (mut t, mut size) = (t0, 0.0);
        self.events.start(events, t, &self.x);
        for (size, x) in self.sizes.iter_mut().zip(&self.x) {
            *size = x.abs();
        }
        let status = loop {
            if t == t1 {
                break Status::Completed;
            }
            if statistics.accepted >= self.settings.max_steps {
                break Status::TooManySteps;
            }
            self.series.expand(t, &self.x, parameters);
            statistics.evaluations += 1;
            if !all_finite(self.series.coefficients(1)) {
                break Status::NotFinite;
            }
            size = match self.settings.fixed_step {
                Some(step) => step,
                None => self.step_size(size).min(limit),
            };
            let remaining = (t1 - t).abs();
            let last = remaining <= stretch * size;
            if !last && size <= RESOLUTION * t.abs().max(SMALLEST_TIME) {
                break Status::StepTooSmall;
            }
            let end = if last { t1 } else { t + direction * size };
            // The step that times have: rounded times would add up to a delay.
            let h = end - t;
            self.series.evaluate(h, &mut self.next);
            if !all_finite(&self.next) {
                break Status::NotFinite;
            }
            statistics.accepted += 1;
            let mut status = None;
            let start = std::mem::replace(&mut t, end);
            let dense = O::OBSERVES_STEPS
                || (!events.is_empty() && {
                    let rough = n * ROUGH_ROWS.min(self.series.order() + 1);
                    fill_rows(&self.series, h, &mut self.rows[..rough]);
                    let step = Step::new(Form::Powers, (start, end), h, n, &self.rows[..rough]);
                    !self.events.quiet(&step, &self.next, events)
                });
            if dense {
                fill_rows(&self.series, h, &mut self.rows);
                let mut step = Step::new(Form::Powers, (start, end), h, n, &self.rows);
                status = show(&mut step, &self.next, &mut self.events, events, observer);
                t = step.end;
            }
            if let Some(Status::Event(_)) = status {
                self.x.copy_from_slice(self.events.state());
            } else {
                for ((size, x), next) in self.sizes.iter_mut().zip(&self.x).zip(&self.next) {
                    *size = x.abs().max(next.abs());
                }
                std::mem::swap(&mut self.x, &mut self.next);
            }
            if let Some(status) = status {
                break status;
            }
        };
        Summary { status, time: t, next_step: size, statistics }
    }

    /// Magnitude of the step, given that of the one before, zero for the first; zero where coefficients are not finite.
    fn step_size(&mut self, previous: f64) -> f64 {
        let p = self.series.order();
        self.weigh();
        let size = self.step_for(p - 1..p + 1);
        if size <= GROWTH * previous {
            return size;
        }
        let last = p - p / LAST_PART..p + 1;
        let orders = if self.step_for(last.clone()) == f64::INFINITY { 2..p + 1 } else { last };
        if previous == 0.0 {
            // A component that starts at zero has the size to which it grows.
            let size = self.step_for(orders.clone()).min(f64::MAX);
            for (scale, rate) in self.sizes.iter_mut().zip(self.series.coefficients(1)) {
                *scale = scale.max((rate * size).abs());
            }
            self.weigh();
        }
        self.step_for(orders)
    }

    fn weigh(&mut self) {
        let relative = self.settings.relative_tolerance;
        for ((weight, a), s) in self.weights.iter_mut().zip(&self.absolute).zip(&self.sizes) {
            *weight = (a + relative * s).recip();
        }
    }

    /// Magnitude of the step at which the terms of these orders have the norms that are tolerated; infinite where the terms vanish.
    fn step_for(&self, orders: Range<usize>) -> f64 {
        // Of the logarithms of all steps the least, which takes one exponential.
        let step = |order: usize| {
            let terms = self.series.coefficients(order).iter().zip(&self.weights);
            let sum: f64 = terms.map(|(c, w)| (c * w).powi(2)).sum();
            (self.tolerated[order] + 0.5 * (self.weights.len() as f64 / sum).ln()) / order as f64
        };
        // NaN, of a coefficient that is not a number, leaves no step.
        let least = orders.map(step).fold(f64::INFINITY, |least, h| {
            if h >= least {
                least
            } else if h.is_nan() {
                f64::NEG_INFINITY
            } else {
                h
            }
        });
        least.exp()
    }
}

/// The highest order whose steps are not too long for rounding, within the bounds.
fn best_order(relative: f64) -> usize {
    let [least, most] = ORDER.map(|part| {
        ((1.0 - part * relative.ln()).ceil().max(0.0) as usize).clamp(LOWEST_ORDER, HIGHEST_ORDER)
    });
    // Rounding relative to the size of the state is half of the distance between numbers.
    let longest = 0.5 * (ROUNDING_PART * relative / (0.5 * f64::EPSILON)).ln();
    let length = |p: f64| p / E * relative.powf(1.0 / p);
    (least..=most).rev().find(|&p| length(p as f64) <= longest).unwrap_or(least)
}

/// Fills rows of a step, from the first on.
fn fill_rows(series: &TaylorSeries, h: f64, rows: &mut [f64]) {
    let mut power = 1.0;
    for (k, row) in rows.chunks_exact_mut(series.states()).enumerate() {
        for (r, c) in row.iter_mut().zip(series.coefficients(k)) {
            *r = c * power;
        }
        power *= h;
    }
}
