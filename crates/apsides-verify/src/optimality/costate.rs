//! The costate equation `lambda' = -dL/dx`, integrated over each interval and compared with the costate at its end,
//! jumps at contacts included.
//!
//! Where a state passes a value at which the equations of motion jump, its costate may jump: by as much as keeps the Hamiltonian the same on
//! both sides, which is the subject of another check (L. S. Pontryagin et al., The Mathematical Theory of Optimal Processes, Interscience
//! 1962, chapter 6; A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, section 3.7).
//!
//! Where a state is at one of its bounds, the multiplier of the bound, which is not part of a trajectory, drives its costate:
//! `lambda' = -dL/dx - eta`. There the costate is taken as stated, and the integral of `eta` must have the sign of the bound.

use std::cell::RefCell;

use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};

use apsides_ocp::Kink;

use super::{KIND, PhaseConditions, evaluate_piece};
use crate::place::place;
use crate::worst::{Worst, relative, violation};
use crate::{Check, VerifySettings};

/// Accuracy of the integration, as a part of the tolerance of the check.
const ACCURACY: f64 = 1e-4;
/// Distance from a kink, relative to the scale of the state, at which the equations are looked at on both sides of it.
const BESIDE: f64 = 1e-9;
/// Rates on both sides that differ by more, relative, jump there.
const JUMPING: f64 = 1e-6;
/// Distance from an end of an interval, as a part of it, at which the slope is taken where it is not defined at the end itself.
const INSIDE: f64 = 1e-9;
/// Nodes closer to an end of the phase than this part of its duration are at the end.
const END: f64 = 1e-9;

/// A costate that jumps since the equations of motion do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jump {
    pub(crate) state: usize,
    pub(crate) time: f64,
    /// Relative to the largest costate.
    pub(crate) size: f64,
}

/// The bound that a state is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    None,
    Lower,
    Upper,
}

/// An interval, the costates at its start, those that they must come to, and the bounds that states are at in it.
struct Walk<'a> {
    segment: usize,
    times: [f64; 2],
    start: &'a [f64],
    last: &'a [f64],
    bounds: &'a [Side],
}

/// The costates of an interval, each from a stated value to the next.
struct BetweenNodes {
    /// Sums of the misses.
    sums: Vec<f64>,
    /// The largest integral of the multiplier of a bound between two nodes that has the wrong sign, or is away from the bound: the impulse at
    /// the end of an arc may hide it in that over the whole.
    wrong: Vec<f64>,
}

impl Side {
    /// The integral of the multiplier of a bound, as far as it has the wrong sign.
    fn violation(self, driven: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Lower => violation(driven),
            Self::Upper => violation(-driven),
        }
    }
}

impl PhaseConditions<'_> {
    pub(super) fn costate_equation(&mut self, settings: &VerifySettings) -> Option<Check> {
        let (nx, phase) = (self.equations.nx, self.equations.phase);
        let breaks = self.found.control.breaks();
        let mut integrator = self.costate_integrator(settings);
        let intervals = breaks.len() - 1;
        let mut worst = Worst::default();
        let (mut start, mut end, mut stated) = (vec![0.0; nx], vec![0.0; nx], vec![0.0; nx]);
        let mut bounds = vec![Side::None; nx];
        for k in 0..intervals {
            self.active_state_bounds(k, settings, &mut bounds);
            let (a, b) = (breaks[k], breaks[k + 1]);
            evaluate_piece(self.costate, intervals, k, a, &mut start);
            // The next interval's start, so that the costate is one continuous solution.
            let next = (k + 1).min(intervals - 1);
            evaluate_piece(self.costate, intervals, next, b, &mut stated);
            self.add_jump(k + 1, &mut stated);
            let reached =
                integrator.as_mut().is_some_and(|i| self.integrate(i, k, [a, b], &start, &bounds, &mut end));
            // Over a long interval errors of fast costates grow beyond all measure: those between its nodes add up.
            let in_units = |miss: f64, i: usize| relative(miss * self.scaling.states[i], self.costate_size);
            let is_accurate =
                |i: usize| reached && in_units((end[i] - stated[i]).abs(), i) <= settings.costate_tolerance;
            let wants_nodes = (0..nx).any(|i| bounds[i] != Side::None || !is_accurate(i));
            let walk = Walk { segment: k, times: [a, b], start: &start, last: &stated, bounds: &bounds };
            let between = integrator
                .as_mut()
                .filter(|_| wants_nodes)
                .and_then(|i| self.between_nodes(i, settings, &walk));
            for i in 0..nx {
                // The integral of the multiplier of a bound, jumps included.
                let driven = end[i] - stated[i];
                let miss = match (bounds[i], &between) {
                    (Side::None, Some(between)) if reached => between.sums[i].min(driven.abs()),
                    (Side::None, Some(between)) => between.sums[i],
                    (Side::None, None) if reached => driven.abs(),
                    (side, Some(between)) if reached => side.violation(driven).max(between.wrong[i]),
                    _ => f64::NAN,
                };
                let residual = relative(miss * self.scaling.states[i], self.costate_size);
                if residual > settings.costate_tolerance && k + 1 < intervals && self.jumps_at(b, i, settings)
                {
                    let size = residual;
                    self.jump.get_or_insert(Jump { state: i, time: b, size });
                    continue;
                }
                let at = || format!("costate of {}, {}", phase.states[i].variable.name, place(phase, b));
                worst.consider(residual, settings.costate_tolerance, "-", at);
            }
        }
        worst.into_check(format!("costate equation along {}", phase.name), KIND)
    }

    /// The integrator of costates, whose errors are far below the tolerance of the check.
    pub(super) fn costate_integrator(&self, settings: &VerifySettings) -> Option<Integrator> {
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
        Integrator::new(self.equations.nx, ode).ok()
    }

    /// Says whether a state passes a kink at an end of an interval, and the equations of motion differ there between both sides of it.
    fn jumps_at(&mut self, time: f64, state: usize, settings: &VerifySettings) -> bool {
        let scale = self.scaling.states[state];
        let values = self.equations.phase.kinks.iter().filter_map(|k| match *k {
            Kink::State { state: of, value } if of == state => Some(value),
            _ => None,
        });
        self.found.state.evaluate(time, &mut self.point.x);
        let met =
            values.into_iter().find(|v| (self.point.x[state] - v).abs() <= settings.path_tolerance * scale);
        let Some(value) = met else { return false };
        let segment = self.found.control.segment_at(time);
        self.found.control.evaluate_in(segment, time, &mut self.point.u);
        let mut sides = [-BESIDE, BESIDE].map(|step| {
            self.point.x[state] = value + step * scale;
            self.equations.set(time, &self.point.x, &self.point.u);
            let mut rates = vec![0.0; self.equations.nx + self.equations.phase.integrals.len()];
            self.equations.rates(&mut rates);
            rates
        });
        let [before, after] = &mut sides;
        before.iter().zip(after.iter()).any(|(a, b)| (a - b).abs() > JUMPING * a.abs().max(b.abs()))
    }

    /// The costates from each stated value of an interval to the next; none where one is not reached.
    fn between_nodes(
        &mut self,
        integrator: &mut Integrator,
        settings: &VerifySettings,
        walk: &Walk<'_>,
    ) -> Option<BetweenNodes> {
        let &Walk { segment, times: [a, b], start, last, bounds } = walk;
        let pieces = self.found.control.segments().len();
        let inner = self.found.control.node_times(segment).filter(|t| *t > a && *t < b);
        let nodes: Vec<f64> = inner.chain([b]).collect();
        let (mut from, mut before) = (a, start.to_vec());
        let (mut reached, mut stated) = (before.clone(), before.clone());
        let mut found = BetweenNodes { sums: vec![0.0; start.len()], wrong: vec![0.0; start.len()] };
        let mut here = vec![Side::None; bounds.len()];
        for to in nodes {
            if !self.integrate(integrator, segment, [from, to], &before, bounds, &mut reached) {
                return None;
            }
            if to < b {
                evaluate_piece(self.costate, pieces, segment, to, &mut stated);
            } else {
                stated.copy_from_slice(last);
            }
            here.fill(Side::None);
            [from, to]
                .into_iter()
                .for_each(|t| self.add_active_state_bounds(segment, t, settings, &mut here));
            for i in 0..start.len() {
                let driven = reached[i] - stated[i];
                found.sums[i] += driven.abs();
                // Between two nodes away from a bound nothing drives the costate. The last part has the impulse at the end.
                if to < b && bounds[i] != Side::None {
                    let is_away = here[i] == Side::None;
                    let wrong = if is_away { driven.abs() } else { bounds[i].violation(driven) };
                    found.wrong[i] = found.wrong[i].max(wrong);
                }
            }
            (from, before) = (to, stated.clone());
        }
        Some(found)
    }

    /// Integrates from `start` at `a` to `b` along the trajectory, costates of states at their bounds as stated; returns true if
    /// `b` was reached.
    pub(super) fn integrate(
        &mut self,
        integrator: &mut Integrator,
        segment: usize,
        [a, b]: [f64; 2],
        start: &[f64],
        bounds: &[Side],
        end: &mut [f64],
    ) -> bool {
        let (nx, pieces) = (self.equations.nx, self.found.control.segments().len());
        let (found, costate) = (self.found, self.costate);
        let scratch = RefCell::new((&mut self.equations, &mut self.point));
        let system = FnSystem::new(nx, |t: f64, lambda: &[f64], rate: &mut [f64]| {
            let (equations, point) = &mut *scratch.borrow_mut();
            // At rest the slope of a speed is not defined: there the limit from inside counts.
            let inside = t.clamp(a + INSIDE * (b - a), b - INSIDE * (b - a));
            for t in [t, inside] {
                found.control.evaluate_in(segment, t, &mut point.u);
                evaluate_piece(&found.state, pieces, segment, t, &mut point.x);
                if let Some(mu) = &found.path_multipliers {
                    evaluate_piece(mu, pieces, segment, t, &mut point.multipliers);
                }
                equations.set(found.control.within(segment, t), &point.x, &point.u);
                evaluate_piece(costate, pieces, segment, t, &mut point.costate);
                for ((used, integrated), bound) in point.costate.iter_mut().zip(lambda).zip(bounds) {
                    if *bound == Side::None {
                        *used = *integrated;
                    }
                }
                equations.lagrangian(&point.costate, &point.multipliers, &mut point.gradient);
                if point.gradient[..nx].iter().all(|g| g.is_finite()) {
                    break;
                }
            }
            for (r, g) in rate.iter_mut().zip(&point.gradient[..nx]) {
                *r = -g;
            }
        });
        matches!(integrator.integrate(&system, a, start, b, end), Ok(s) if s.status == Status::Completed)
    }

    /// The bound that each state touches at a node or an end of an interval, ends of the phase apart.
    pub(super) fn active_state_bounds(
        &mut self,
        segment: usize,
        settings: &VerifySettings,
        bounds: &mut [Side],
    ) {
        bounds.fill(Side::None);
        let (t0, tf) = (self.found.initial_time, self.found.final_time);
        let inner = END * (tf - t0);
        let breaks = &self.found.control.breaks()[segment..segment + 2];
        for t in self.found.control.node_times(segment).chain(breaks.iter().copied()) {
            if t > t0 + inner && t < tf - inner {
                self.add_active_state_bounds(segment, t, settings, bounds);
            }
        }
    }

    /// Adds the bounds that the states are at at a time of an interval.
    fn add_active_state_bounds(
        &mut self,
        segment: usize,
        t: f64,
        settings: &VerifySettings,
        bounds: &mut [Side],
    ) {
        let pieces = self.found.control.segments().len();
        let x = &mut self.point.x;
        evaluate_piece(&self.found.state, pieces, segment, t, x);
        for (i, state) in self.equations.phase.states.iter().enumerate() {
            let allowed = settings.activity_tolerance * self.scaling.states[i];
            if x[i] >= state.variable.bounds.upper - allowed {
                bounds[i] = Side::Upper;
            } else if x[i] <= state.variable.bounds.lower + allowed {
                bounds[i] = Side::Lower;
            }
        }
    }
}
