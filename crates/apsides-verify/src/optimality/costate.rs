//! The costate equation `lambda' = -dL/dx`, integrated over each interval and compared with the costate at its end,
//! jumps at contacts included.

use std::cell::RefCell;

use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};

use super::{KIND, PhaseConditions, evaluate_piece};
use crate::place::place;
use crate::worst::{Worst, relative};
use crate::{Check, VerifySettings};

/// Accuracy of the integration, as a part of the tolerance of the check.
const ACCURACY: f64 = 1e-4;
/// Nodes closer to an end of the phase than this part of its duration are at the end.
const END: f64 = 1e-9;

impl PhaseConditions<'_> {
    pub(super) fn costate_equation(&mut self, settings: &VerifySettings) -> Option<Check> {
        let (nx, phase) = (self.equations.nx, self.equations.phase);
        let breaks = self.found.control.breaks();
        let tolerance = settings.costate_tolerance * ACCURACY;
        // Costates are compared in units of the largest one times its state's scale.
        let size = if self.costate_size > 0.0 { self.costate_size } else { 1.0 };
        let absolute = self.scaling.states.iter().map(|s| tolerance * size / s);
        let ode = OdeSettings {
            relative_tolerance: tolerance.max(1e-14),
            absolute_tolerance: Tolerance::PerComponent(absolute.collect()),
            max_steps: settings.max_steps,
            stiffness_interval: None,
            ..OdeSettings::default()
        };
        let mut integrator = Integrator::new(nx, ode).ok();
        let intervals = breaks.len() - 1;
        let mut skipped = 0;
        let mut worst = Worst::default();
        let (mut start, mut end, mut stated) = (vec![0.0; nx], vec![0.0; nx], vec![0.0; nx]);
        for k in 0..intervals {
            if self.state_bound_is_active(k, settings) {
                skipped += 1;
                continue;
            }
            let (a, b) = (breaks[k], breaks[k + 1]);
            evaluate_piece(self.costate, intervals, k, a, &mut start);
            // The next interval's start, so that the costate is one continuous solution.
            let next = (k + 1).min(intervals - 1);
            evaluate_piece(self.costate, intervals, next, b, &mut stated);
            self.add_jump(k + 1, &mut stated);
            let reached = integrator.as_mut().is_some_and(|i| self.integrate(i, k, a, &start, b, &mut end));
            for i in 0..nx {
                let miss = if reached { (end[i] - stated[i]).abs() } else { f64::NAN };
                let residual = relative(miss * self.scaling.states[i], self.costate_size);
                let at = || format!("costate of {}, {}", phase.states[i].variable.name, place(phase, b));
                worst.consider(residual, settings.costate_tolerance, "-", at);
            }
        }
        let remark = (skipped > 0)
            .then(|| format!("{skipped} of {intervals} intervals left out because a state bound is active"));
        worst.into_check_with(format!("costate equation along {}", phase.name), KIND, remark)
    }

    /// Integrates from `start` at `a` to `b` along the trajectory; returns true if `b` was reached.
    fn integrate(
        &mut self,
        integrator: &mut Integrator,
        segment: usize,
        a: f64,
        start: &[f64],
        b: f64,
        end: &mut [f64],
    ) -> bool {
        let (nx, pieces) = (self.equations.nx, self.found.control.segments().len());
        let found = self.found;
        let scratch = RefCell::new((&mut self.equations, &mut self.point));
        let system = FnSystem::new(nx, |t: f64, lambda: &[f64], rate: &mut [f64]| {
            let (equations, point) = &mut *scratch.borrow_mut();
            found.control.evaluate_in(segment, t, &mut point.u);
            evaluate_piece(&found.state, pieces, segment, t, &mut point.x);
            if let Some(mu) = &found.path_multipliers {
                evaluate_piece(mu, pieces, segment, t, &mut point.multipliers);
            }
            equations.set(t, &point.x, &point.u);
            equations.lagrangian(lambda, &point.multipliers, &mut point.gradient);
            for (r, g) in rate.iter_mut().zip(&point.gradient[..nx]) {
                *r = -g;
            }
        });
        matches!(integrator.integrate(&system, a, start, b, end), Ok(s) if s.status == Status::Completed)
    }

    /// Returns true if a state bound is active at a node or an end of an interval, ends of the phase apart.
    fn state_bound_is_active(&mut self, segment: usize, settings: &VerifySettings) -> bool {
        let (t0, tf) = (self.found.initial_time, self.found.final_time);
        let inner = END * (tf - t0);
        let breaks = &self.found.control.breaks()[segment..segment + 2];
        let pieces = self.found.control.segments().len();
        let x = &mut self.point.x;
        self.found.control.node_times(segment).chain(breaks.iter().copied()).any(|t| {
            if t <= t0 + inner || t >= tf - inner {
                return false;
            }
            evaluate_piece(&self.found.state, pieces, segment, t, x);
            let states = self.equations.phase.states.iter().zip(&*x).zip(&self.scaling.states);
            states
                .into_iter()
                .any(|((s, x), scale)| s.variable.bounds.excess(*x) >= -settings.activity_tolerance * scale)
        })
    }
}
