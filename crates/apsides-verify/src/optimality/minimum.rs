//! Pontryagin's minimum principle: at each point the control has the least Hamiltonian among all admissible controls, not
//! among its neighbours alone.
//!
//! ```text
//! H(t, x, lambda, u) <= H(t, x, lambda, v)   for all v with   lower <= v <= upper,   c(t, x, v) within its bounds
//! ```
//!
//! `c` are the path constraint rows in which controls occur. L. S. Pontryagin, V. G. Boltyanskii, R. V. Gamkrelidze, E. F.
//! Mishchenko, The Mathematical Theory of Optimal Processes, Interscience 1962, chapter 1.
//!
//! The excess is held against the largest term of the Hamiltonian, and to two percent against what controls can change of it: a
//! large term that no control enters, or that cancels another one, would hide a better control.
//!
//! The least value is searched: a grid over the bounds (over the range met and its surroundings where there is none), each
//! point moved onto the path constraints, then a compass search from the best ones. What is found is admissible, so that a
//! failing check shows a better control; a passing one says that the search found none.
//!
//! A strict minimum needs a strict least Hamiltonian: where along an arc, and not in one instant alone, another control with other
//! rates has the same Hamiltonian, controls that alternate between the two are as good to first order (N. P. Osmolovskii and H.
//! Maurer, Applications to Regular and Bang-Bang Control, SIAM 2012, doi 10.1137/1.9781611972368, section 2.1).

use apsides_ocp::{Phase, PiecewisePolynomial, Variable};

use super::{KIND, PhaseConditions};
use crate::boundary::row_scale;
use crate::certificate::LEAST_HAMILTONIAN;
use crate::place::place;
use crate::worst::Worst;
use crate::{Check, VerifySettings};

/// Points of a phase at which the control set is searched, at most.
const POINTS: usize = 160;
/// Points of the grid in one, two, three, four controls per axis; more controls take a sequence of low discrepancy.
const GRID: [usize; 4] = [33, 13, 7, 5];
/// Length of that sequence.
const SEQUENCE: usize = 600;
/// Best points of the grid from which the compass search starts, besides the control itself.
const STARTS: usize = 2;
/// Halvings of the steps of the compass search.
const HALVINGS: usize = 12;
/// Sweeps of projections onto path constraints.
const SWEEPS: usize = 30;
/// Controls are apart if one of them differs by more than this part of its range.
const APART: f64 = 0.1;
/// Hamiltonians that differ by less, relative to the largest term, are equal: rounding of costates.
const EQUAL: f64 = 1e-9;
/// Rates that differ by less, over the duration and relative to the scales of their states or to themselves, are those of one motion: a
/// control found by search to the root of [`EQUAL`] has them.
const SAME_RATES: f64 = 1e-3;
/// A candidate meets a path constraint within this times the scale of the row.
const ROW_TOLERANCE: f64 = 1e-9;

/// A path constraint row in which controls occur.
struct ControlRow {
    row: usize,
    lower: f64,
    upper: f64,
    tolerance: f64,
}

/// The outcome of the search over the control set at one point.
struct Compared {
    /// Distance of the trajectory's Hamiltonian above the least one found.
    gap: f64,
    /// Distance of the largest one found above the least one.
    range: f64,
    /// The control that has it.
    least: Vec<f64>,
    /// Another control far from the trajectory's with the same Hamiltonian.
    rival: Option<Vec<f64>>,
}

/// The control set at one point, and the search over it.
struct ControlSet {
    lower: Vec<f64>,
    upper: Vec<f64>,
    rows: Vec<ControlRow>,
    /// The grid, one control after the other.
    grid: Vec<f64>,
}

impl PhaseConditions<'_> {
    /// The largest excess of the Hamiltonian over its least admissible value.
    pub(super) fn minimum_principle(&mut self, settings: &VerifySettings) -> Option<Check> {
        if self.equations.nu == 0 {
            return None;
        }
        let phase = self.equations.phase;
        let set = self.control_set();
        let stride = self.nodes.len().div_ceil(POINTS).max(1);
        let mut worst = Worst::default();
        let mut gaps: Vec<(f64, f64, String)> = Vec::new();
        let mut k = 0;
        for segment in 0..self.found.control.segments().len() {
            let mut shared = false;
            for time in self.found.control.node_times(segment) {
                if k % stride == 0 {
                    let own = self.found_control(segment, time);
                    let Compared { gap, range, least, rival } = self.compare(&set, segment, time);
                    self.control_range = self.control_range.max(range);
                    // Along a bound of a state the state itself determines the control.
                    let rival = rival.filter(|_| !self.is_at_state_bound(segment, time, settings));
                    if let Some(rival) = rival.as_ref().filter(|_| self.rival.is_none() && shared) {
                        self.rival =
                            Some(format!("{}, {}", in_words(phase, rival, &own), place(phase, time)));
                    }
                    shared = rival.is_some();
                    gaps.push((gap, time, in_words(phase, &least, &own)));
                }
                k += 1;
            }
        }
        for (gap, time, better) in gaps {
            let at = || {
                let place = place(phase, time);
                if better.is_empty() { place } else { format!("{place}; smaller with {better}") }
            };
            let excess = self.relative_to_controls(gap);
            worst.consider(excess, settings.minimum_tolerance, "-", at);
        }
        let open = phase.controls.iter().any(|c| !c.bounds.lower.is_finite() || !c.bounds.upper.is_finite());
        let remark = open.then(|| "controls without bounds searched about the range met".to_owned());
        worst.into_check_with(format!("{LEAST_HAMILTONIAN} of {}", phase.name), KIND, remark)
    }

    /// The control with the least Hamiltonian found at each node; none where nowhere one is lower by more than the limit of the check.
    pub(super) fn least_controls(&mut self, settings: &VerifySettings) -> Option<PiecewisePolynomial> {
        let set = self.control_set();
        let stride = self.nodes.len().div_ceil(POINTS).max(1);
        let mut largest = 0.0_f64;
        let mut least = Vec::new();
        let mut segments = self.found.control.segments().to_vec();
        let mut k = 0;
        for (segment, piece) in segments.iter_mut().enumerate() {
            let times = self.found.control.node_times(segment);
            for (time, values) in times.zip(piece.values.chunks_mut(self.equations.nu.max(1))) {
                // Between the nodes that are searched the control is that of the one before.
                if k % stride == 0 {
                    let found = self.compare(&set, segment, time);
                    self.control_range = self.control_range.max(found.range);
                    largest = largest.max(found.gap);
                    least = found.least;
                }
                values.copy_from_slice(&least);
                k += 1;
            }
        }
        let is_evident = self.relative_to_controls(largest) > settings.minimum_tolerance;
        let breaks = self.found.control.breaks().to_vec();
        is_evident.then(|| PiecewisePolynomial::new(self.equations.nu, breaks, segments).ok()).flatten()
    }

    fn control_set(&self) -> ControlSet {
        let phase = self.equations.phase;
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        for (j, control) in phase.controls.iter().enumerate() {
            let values = || self.nodes.iter().map(|n| n.control[j]);
            let (least, largest) =
                values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
            let reach = (largest - least).max(largest.abs()).max(least.abs()).max(self.scaling.controls[j]);
            let bounds = control.bounds;
            lower.push(if bounds.lower.is_finite() { bounds.lower } else { least - reach });
            upper.push(if bounds.upper.is_finite() { bounds.upper } else { largest + reach });
        }
        let rows = phase.path.iter().flat_map(|p| &p.rows).enumerate();
        let rows = rows.filter(|(r, _)| !self.equations.is_free_of_controls(*r)).map(|(row, variable)| {
            let largest = self.nodes.iter().fold(0.0, |m: f64, n| m.max(n.path[row].abs()));
            let tolerance = ROW_TOLERANCE * row_scale(variable, largest);
            ControlRow { row, lower: variable.bounds.lower, upper: variable.bounds.upper, tolerance }
        });
        let rows = rows.collect();
        let grid = grid(&lower, &upper);
        ControlSet { lower, upper, rows, grid }
    }

    fn found_control(&self, segment: usize, time: f64) -> Vec<f64> {
        let mut control = vec![0.0; self.equations.nu];
        self.found.control.evaluate_in(segment, time, &mut control);
        control
    }

    /// Compares the trajectory's control at a point with all others that are admissible there.
    fn compare(&mut self, set: &ControlSet, segment: usize, time: f64) -> Compared {
        let nu = self.equations.nu;
        let stated = self.evaluate(segment, time).value;
        let own = self.point.u.clone();
        let mut search = Search { conditions: self, set, time, trial: vec![0.0; nu] };
        let mut best: Vec<(f64, Vec<f64>)> = Vec::new();
        let mut largest = stated;
        let mut far: Option<(f64, Vec<f64>)> = None;
        for candidate in set.grid.chunks(nu) {
            if let Some(h) = search.admissible(candidate) {
                largest = largest.max(h);
                let at = best.partition_point(|(other, _)| *other <= h);
                if at < STARTS {
                    best.insert(at, (h, search.trial.clone()));
                    best.truncate(STARTS);
                }
                if set.are_apart(&search.trial, &own) && far.as_ref().is_none_or(|(other, _)| h < *other) {
                    far = Some((h, search.trial.clone()));
                }
            }
        }
        let far = far.map(|(h, u)| search.descend(h, u));
        let far = far.filter(|(_, u)| set.are_apart(u, &own));
        if let Some(h) = search.admissible(&own) {
            best.push((h, search.trial.clone()));
        }
        let mut least = (stated, own.clone());
        for (h, u) in best {
            let (h, u) = search.descend(h, u);
            if h < least.0 {
                least = (h, u);
            }
        }
        let rival = far.filter(|(h, u)| {
            h - stated <= EQUAL * self.hamiltonian_size && self.has_other_rates(time, u, &own)
        });
        let (gap, range) = (stated - least.0, largest - least.0);
        Compared { gap, range, least: least.1, rival: rival.map(|(_, u)| u) }
    }

    /// Says whether a state, or a path constraint without controls, is at a bound.
    fn is_at_state_bound(&mut self, segment: usize, time: f64, settings: &VerifySettings) -> bool {
        self.evaluate(segment, time);
        let Self { equations, point, scaling, .. } = self;
        let phase = equations.phase;
        let is_at = |variable: &Variable, value: f64, scale: f64| {
            variable.bounds.excess(value) >= -settings.activity_tolerance * scale
        };
        let mut states = phase.states.iter().zip(&point.x).zip(&scaling.states);
        if states.any(|((s, x), scale)| is_at(&s.variable, *x, *scale)) {
            return true;
        }
        let mut values = vec![0.0; phase.path_rows()];
        equations.path(&mut values);
        let rows = phase.path.iter().flat_map(|p| &p.rows).zip(&values).zip(&scaling.path).enumerate();
        let mut met = rows.filter(|(_, ((row, value), scale))| is_at(row, **value, **scale));
        met.any(|(row, _)| equations.is_free_of_controls(row))
    }

    /// True if a control changes the rates of states and integrals at the point as it was evaluated, whatever its derivatives there.
    pub(crate) fn has_effect(&mut self, time: f64, control: usize) -> bool {
        let own = self.point.u.clone();
        let bounds = self.equations.phase.controls[control].bounds;
        let scale = self.scaling.controls[control];
        let others = [bounds.lower, bounds.upper, own[control] - scale, own[control] + scale];
        others.into_iter().filter(|v| v.is_finite()).any(|value| {
            let mut other = own.clone();
            other[control] = bounds.clamp(value);
            // By the scales of the states alone: what a barrier leaves of a thrust gives its direction rates, and no effect.
            self.rates_differ(time, &other, &own, |_, scale| scale)
        })
    }

    /// True if the rates of states and integrals differ: the controls are not two descriptions of one motion, as an angle and
    /// itself after a full turn.
    fn has_other_rates(&mut self, time: f64, one: &[f64], other: &[f64]) -> bool {
        // Beside wide bounds the rates themselves tell what is much.
        self.rates_differ(time, one, other, f64::min)
    }

    /// True if the changes of states and integrals over the duration differ by much, relative to `size(largest change, scale)`.
    fn rates_differ(
        &mut self,
        time: f64,
        one: &[f64],
        other: &[f64],
        size: impl Fn(f64, f64) -> f64,
    ) -> bool {
        let Self { equations, point, scaling, .. } = self;
        let mut rates = |u: &[f64]| {
            let mut out = vec![0.0; equations.nx + equations.phase.integrals.len()];
            equations.set(time, &point.x, u);
            equations.rates(&mut out);
            out
        };
        let (one, other) = (rates(one), rates(other));
        let scales = scaling.states.iter().chain(&scaling.integrals);
        one.iter().zip(&other).zip(scales).any(|((a, b), scale)| {
            let largest = a.abs().max(b.abs()) * scaling.time;
            (a - b).abs() * scaling.time > SAME_RATES * size(largest, *scale)
        })
    }
}

impl ControlSet {
    fn are_apart(&self, one: &[f64], other: &[f64]) -> bool {
        let widths = self.upper.iter().zip(&self.lower).map(|(b, a)| b - a);
        one.iter().zip(other).zip(widths).any(|((a, b), width)| (a - b).abs() > APART * width)
    }
}

/// The search at one point; `trial` is the last admissible candidate.
struct Search<'c, 'a, 's> {
    conditions: &'c mut PhaseConditions<'a>,
    set: &'s ControlSet,
    time: f64,
    trial: Vec<f64>,
}

impl Search<'_, '_, '_> {
    /// Moves a candidate into the control set, as `trial`, and gives its Hamiltonian; none if it cannot be moved there.
    fn admissible(&mut self, candidate: &[f64]) -> Option<f64> {
        self.trial.copy_from_slice(candidate);
        self.clamp();
        if !self.set.rows.is_empty() && !self.project() {
            return None;
        }
        let h = self.hamiltonian();
        h.is_finite().then_some(h)
    }

    fn clamp(&mut self) {
        for ((u, lower), upper) in self.trial.iter_mut().zip(&self.set.lower).zip(&self.set.upper) {
            *u = u.max(*lower).min(*upper);
        }
    }

    fn hamiltonian(&mut self) -> f64 {
        let PhaseConditions { equations, point, .. } = &mut *self.conditions;
        equations.set(self.time, &point.x, &self.trial);
        equations.hamiltonian(&point.costate)
    }

    /// Projections onto one violated row after the other (S. Kaczmarz, 1937); returns true if all hold.
    fn project(&mut self) -> bool {
        let controls = self.conditions.equations.nx..self.conditions.equations.nx + self.trial.len();
        for _ in 0..SWEEPS {
            let mut inside = true;
            for r in &self.set.rows {
                let PhaseConditions { equations, point, .. } = &mut *self.conditions;
                equations.set(self.time, &point.x, &self.trial);
                let value = equations.row_gradient(r.row, &mut point.gradient);
                let excess = (value - r.upper).max(0.0) + (value - r.lower).min(0.0);
                if excess.abs() <= r.tolerance {
                    continue;
                }
                inside = false;
                let slope = &point.gradient[controls.clone()];
                let square: f64 = slope.iter().map(|g| g * g).sum();
                if !(square > 0.0 && excess.is_finite()) {
                    return false;
                }
                for (u, g) in self.trial.iter_mut().zip(slope) {
                    *u -= excess * g / square;
                }
                self.clamp();
            }
            if inside {
                return true;
            }
        }
        false
    }

    /// Compass search from an admissible control.
    fn descend(&mut self, mut h: f64, mut u: Vec<f64>) -> (f64, Vec<f64>) {
        let widths = self.set.upper.iter().zip(&self.set.lower).map(|(b, a)| b - a);
        let per_axis = GRID.get(u.len() - 1).copied().unwrap_or(4) as f64;
        let mut steps: Vec<f64> = widths.map(|w| 0.5 * w / (per_axis - 1.0)).collect();
        for _ in 0..HALVINGS {
            let mut improved = false;
            for j in 0..u.len() {
                for sign in [1.0, -1.0] {
                    let mut candidate = u.clone();
                    candidate[j] += sign * steps[j];
                    if let Some(lower) = self.admissible(&candidate)
                        && lower < h
                    {
                        (h, improved) = (lower, true);
                        u.copy_from_slice(&self.trial);
                        break;
                    }
                }
            }
            if !improved {
                steps.iter_mut().for_each(|s| *s *= 0.5);
            }
        }
        (h, u)
    }
}

/// The controls that differ, with those of the trajectory.
fn in_words(phase: &Phase, controls: &[f64], own: &[f64]) -> String {
    let differ = phase.controls.iter().zip(controls).zip(own).filter(|((_, u), own)| u != own);
    let words = differ.map(|((c, u), own)| format!("{} {u:.6} for {own:.6}", c.name));
    words.collect::<Vec<_>>().join(", ")
}

/// Points over a box, ends included: a grid, or the sequence of Halton with the corners along each axis.
fn grid(lower: &[f64], upper: &[f64]) -> Vec<f64> {
    let nu = lower.len();
    let mut points = Vec::new();
    let at = |j: usize, fraction: f64| lower[j] + fraction * (upper[j] - lower[j]);
    if let Some(&n) = GRID.get(nu - 1) {
        for k in 0..n.pow(nu as u32) {
            let mut rest = k;
            for j in 0..nu {
                points.push(at(j, (rest % n) as f64 / (n - 1) as f64));
                rest /= n;
            }
        }
    } else {
        for k in 0..SEQUENCE {
            for j in 0..nu {
                // Stretched, so that bounds are among the points.
                let fraction = 1.2 * radical_inverse(k + 1, PRIMES[j % PRIMES.len()]) - 0.1;
                points.push(at(j, fraction.clamp(0.0, 1.0)));
            }
        }
    }
    points
}

const PRIMES: [usize; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];

/// Digits of `k` mirrored at the point (J. H. Halton, 1960).
fn radical_inverse(mut k: usize, base: usize) -> f64 {
    let (mut value, mut unit) = (0.0, 1.0 / base as f64);
    while k > 0 {
        value += unit * (k % base) as f64;
        k /= base;
        unit /= base as f64;
    }
    value
}
