//! Instants between nodes at which a control at its bound has no less Hamiltonian than at the opposite one.
//!
//! Along an arc at a bound the switching function, here the difference of the Hamiltonian between the two bounds, is positive, and vanishes where
//! the control switches. Where it comes down to zero inside the arc, or is zero at an end of the phase, there is no strict bang-bang property:
//! a short time at the other bound costs nothing to first order, and to second order what the second variation says of it. Where it is
//! negative between two nodes the control is not the best one (N. P. Osmolovskii and H. Maurer, Applications to Regular and Bang-Bang Control,
//! SIAM 2012, doi 10.1137/1.9781611972368, section 5.2).

use apsides_basis::golden_section;

use super::PhaseConditions;
use super::control_set::ControlSet;
use crate::VerifySettings;

/// Samples over the nodes of an interval of a phase's control.
const SAMPLES_PER_NODE: usize = 4;
/// A control closer to a bound than this, relative to its scale, is there.
const AT_BOUND: f64 = 1e-5;
/// Minima above this part of the largest value of an arc do not come near zero.
const NEAR: f64 = 0.1;
/// Evaluations of the search for a minimum.
const EVALUATIONS: usize = 40;

/// The part of a phase at which a control is as good as the opposite one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    Start,
    Inside,
    End,
}

/// An instant at which a control is as good at its opposite bound.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub(crate) segment: usize,
    pub(crate) time: f64,
    pub(crate) control: usize,
    /// The control there.
    pub(crate) other: f64,
    /// Its Hamiltonian less that of the trajectory.
    pub(super) gap: f64,
    pub(crate) part: Place,
}

/// The gradient of the Hamiltonian over `[x, u, p, t]` and the rates of states and integrals, with one control.
pub(crate) struct WithControl {
    pub(crate) gradient: Vec<f64>,
    pub(crate) rates: Vec<f64>,
}

/// A sample along an arc of one control at one bound.
#[derive(Clone, Copy)]
struct Gap {
    segment: usize,
    time: f64,
    other: f64,
    gap: f64,
}

impl PhaseConditions<'_> {
    /// The touches of all controls, those at which the opposite bound is better among them.
    pub(super) fn find_touches(&mut self, set: &ControlSet, settings: &VerifySettings) -> Vec<Touch> {
        let allowed = self.allowed_gap(settings.minimum_tolerance);
        let times = self.sample_times(SAMPLES_PER_NODE);
        let mut touches = Vec::new();
        for control in 0..self.equations.nu {
            let samples: Vec<Option<Gap>> =
                times.iter().map(|(segment, time)| self.sample(control, *segment, *time)).collect();
            let mut first = 0;
            while first < samples.len() {
                let other = |k: usize| samples.get(k).copied().flatten().map(|s| s.other);
                let Some(bound) = other(first) else {
                    first += 1;
                    continue;
                };
                let mut end = first + 1;
                while other(end) == Some(bound) {
                    end += 1;
                }
                let arc: Vec<Gap> = samples[first..end].iter().copied().flatten().collect();
                let ends = [first == 0, end == samples.len()];
                touches.extend(self.touches_of(control, &arc, ends, allowed));
                first = end;
            }
        }
        touches.retain(|touch| self.is_another_motion(set, touch, settings));
        touches
    }

    /// The opposite bound and the gap to it; none where the control is at no bound.
    fn sample(&mut self, control: usize, segment: usize, time: f64) -> Option<Gap> {
        let own = self.evaluate_within_bounds(segment, time).value;
        let bounds = self.equations.phase.controls[control].bounds;
        let (u, near) = (self.point.u[control], AT_BOUND * self.scaling.controls[control]);
        let other = match (u - bounds.lower <= near, bounds.upper - u <= near) {
            (true, false) => bounds.upper,
            (false, true) => bounds.lower,
            _ => return None,
        };
        if !other.is_finite() {
            return None;
        }
        let gap = self.with_control(control, other, |c| c.equations.hamiltonian(&c.point.costate)) - own;
        Some(Gap { segment, time, other, gap })
    }

    /// Evaluates something with one control changed at the point as it was evaluated.
    fn with_control<T>(&mut self, control: usize, value: f64, mut f: impl FnMut(&mut Self) -> T) -> T {
        let own = self.point.u[control];
        self.point.u[control] = value;
        self.equations.set(self.point.time, &self.point.x, &self.point.u);
        let found = f(self);
        self.point.u[control] = own;
        self.equations.set(self.point.time, &self.point.x, &self.point.u);
        found
    }

    /// The touches along one arc; `ends` says whether it begins and ends with the phase, not with a switch.
    fn touches_of(&mut self, control: usize, arc: &[Gap], ends: [bool; 2], allowed: f64) -> Vec<Touch> {
        let largest = arc.iter().fold(0.0, |m: f64, s| m.max(s.gap));
        let last = arc.len() - 1;
        let touch = |s: &Gap, part| Touch {
            segment: s.segment,
            time: s.time,
            control,
            other: s.other,
            gap: s.gap,
            part,
        };
        let mut touches: Vec<Touch> = Vec::new();
        let is_minimum = |k: usize| k > 0 && k < last && arc[k].gap <= arc[k - 1].gap.min(arc[k + 1].gap);
        for k in (0..=last).filter(|k| is_minimum(*k) && arc[*k].gap <= NEAR * largest) {
            let mut least = arc[k];
            for pair in [[k - 1, k], [k, k + 1]].map(|p| p.map(|k| arc[k])) {
                if pair[0].segment == pair[1].segment && pair[0].time < pair[1].time {
                    let found = self.least_between(control, pair);
                    if found.gap < least.gap {
                        least = found;
                    }
                }
            }
            // Next to a switch the gap is small from there on.
            let reaches = |mut range: std::ops::Range<usize>| range.all(|k| arc[k].gap <= allowed);
            let is_of_switch = reaches(0..k) && !ends[0] || reaches(k..arc.len()) && !ends[1];
            let is_of_end = reaches(0..k) && ends[0] || reaches(k..arc.len()) && ends[1];
            if least.gap <= allowed && (least.gap < -allowed || !is_of_switch && !is_of_end) {
                match touches.last_mut().filter(|t| is_one(arc, [t.time, least.time], allowed)) {
                    Some(before) if before.gap > least.gap => *before = touch(&least, Place::Inside),
                    Some(_) => {}
                    None => touches.push(touch(&least, Place::Inside)),
                }
            }
        }
        for (is_end, k, part) in [(ends[0], 0, Place::Start), (ends[1], last, Place::End)] {
            if is_end && arc[k].gap <= allowed {
                touches.push(touch(&arc[k], part));
            }
        }
        touches
    }

    fn least_between(&mut self, control: usize, [from, to]: [Gap; 2]) -> Gap {
        let gap = |conditions: &mut Self, time| {
            conditions.sample(control, from.segment, time).map_or(f64::INFINITY, |s| s.gap)
        };
        let [time, gap] = golden_section([from.time, to.time], EVALUATIONS, |time| gap(self, time));
        Gap { time, gap, ..from }
    }

    /// Says whether the opposite bound is admissible and another motion.
    fn is_another_motion(&mut self, set: &ControlSet, touch: &Touch, settings: &VerifySettings) -> bool {
        self.evaluate_within_bounds(touch.segment, touch.time);
        let own = self.point.u.clone();
        let mut other = own.clone();
        other[touch.control] = touch.other;
        let values = self.with_control(touch.control, touch.other, |c| {
            let mut values = vec![0.0; c.point.multipliers.len()];
            c.equations.path(&mut values);
            values
        });
        let is_admissible = set.rows.iter().all(|row| {
            let value = values[row.row];
            value <= row.upper + row.tolerance && value >= row.lower - row.tolerance
        });
        is_admissible
            && self.has_other_rates(&other, &own)
            && self.keeps_to_state_bounds(touch.segment, touch.time, &other, settings)
    }

    /// Gradients and rates with the control of the trajectory and with the one of a touch; then the rates of the costates.
    pub(crate) fn both_at(&mut self, touch: &Touch) -> ([WithControl; 2], Vec<f64>) {
        self.evaluate_within_bounds(touch.segment, touch.time);
        let nx = self.equations.nx;
        let costate_rates = self.point.gradient[..nx].iter().map(|g| -g).collect();
        let one = |c: &mut Self| {
            let mut gradient = vec![0.0; c.equations.width()];
            let none = vec![0.0; c.point.multipliers.len()];
            c.equations.lagrangian(&c.point.costate, &none, &mut gradient);
            let mut rates = vec![0.0; nx + c.equations.phase.integrals.len()];
            c.equations.rates(&mut rates);
            WithControl { gradient, rates }
        };
        let own = one(self);
        let other = self.with_control(touch.control, touch.other, one);
        ([own, other], costate_rates)
    }
}

/// Says whether the gap stays at zero from one time of an arc to another.
fn is_one(arc: &[Gap], [from, to]: [f64; 2], allowed: f64) -> bool {
    arc.iter().filter(|s| s.time >= from && s.time <= to).all(|s| s.gap <= allowed)
}
