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
//! large term that no control enters, or that cancels another one, would hide a better control. Each control is searched alone too, and what it
//! gains is held to two percent against what it can change alone: so would another control that changes much.
//!
//! The least value is searched: a grid over the bounds (over the range met and its surroundings where there is none), each
//! point moved onto the path constraints, then a compass search from the best ones. What is found is admissible, so that a
//! failing check shows a better control. Where the functions are formulas, branch and bound proves at some of the points that there is
//! nothing better, or finds it ([`mod@super::proof`]), and the others are searched again from there; where it does not, the check says so.
//!
//! Between nodes the control set is not searched, but where a switching function comes down to zero there it is looked at ([`mod@super::touch`]).
//!
//! A strict minimum needs a strict least Hamiltonian: where along an arc, and not in one instant alone, another control with other
//! rates has the same Hamiltonian, controls that alternate between the two are as good to first order (N. P. Osmolovskii and H.
//! Maurer, Applications to Regular and Bang-Bang Control, SIAM 2012, doi 10.1137/1.9781611972368, section 2.1).

use apsides_ocp::{Phase, PiecewisePolynomial, Variable};

use super::control_set::ControlSet;
use super::proof::{Proof, Searched};
use super::search::{Alone, Found, Search};
use super::{KIND, PhaseConditions};
use crate::certificate::LEAST_HAMILTONIAN;
use crate::many_points::AtTime;
use crate::place::place;
use crate::worst::Worst;
use crate::{Check, VerifySettings};

/// Points of a phase at which the control set is searched, at most.
const POINTS: usize = 160;
/// Best points of the grid from which the compass search starts, besides the control itself.
const STARTS: usize = 2;
/// Hamiltonians that differ by less, relative to the largest term, are equal: rounding of costates.
const EQUAL: f64 = 1e-9;
/// Rates that differ by less, over the duration and relative to the scales of their states or to themselves, are those of one motion: a
/// control found by search to the root of [`EQUAL`] has them.
const SAME_RATES: f64 = 1e-3;
/// A change over the duration below this part of the scale is that of a control which is nothing but for rounding.
const NO_CHANGE: f64 = 1e-9;

/// The outcome of the search over the control set at one point.
struct Compared {
    segment: usize,
    time: f64,
    /// The Hamiltonian of the trajectory.
    stated: f64,
    /// Distance of the largest one found above the least one.
    range: f64,
    /// The least one found, and the control that has it.
    least: Found,
    /// The least one with each control changed alone.
    alone: Vec<Option<Alone>>,
    /// Another control far from the trajectory's with the same Hamiltonian.
    rival: Option<Vec<f64>>,
}

impl PhaseConditions<'_> {
    /// The largest excess of the Hamiltonian over its least admissible value.
    pub(super) fn minimum_principle(&mut self, settings: &VerifySettings) -> Option<Check> {
        if self.equations.nu == 0 {
            return None;
        }
        let phase = self.equations.phase;
        let (searched, remark) = self.search_points(settings);
        let set = self.control_set();
        self.touches = self.find_touches(&set, settings);
        let mut shared = (usize::MAX, false);
        for point in &searched {
            // Along a bound of a state the rate of the state is determined.
            let rival = point.rival.as_ref();
            let rival = rival.filter(|u| self.keeps_to_state_bounds(point.segment, point.time, u, settings));
            if let Some(rival) = rival.filter(|_| self.rival.is_none() && shared == (point.segment, true)) {
                let own = self.found_control(point.segment, point.time);
                self.rival = Some(format!("{}, {}", in_words(phase, rival, &own), place(phase, point.time)));
            }
            shared = (point.segment, rival.is_some());
        }
        let mut worst = Worst::default();
        for point in &searched {
            let own = self.found_control(point.segment, point.time);
            let (excess, control) = self.excess(point);
            let at = || {
                let (place, better) = (place(phase, point.time), in_words(phase, control, &own));
                if better.is_empty() { place } else { format!("{place}; smaller with {better}") }
            };
            worst.consider(excess, settings.minimum_tolerance, "-", at);
        }
        // Between the nodes.
        for touch in &self.touches {
            let control = &phase.controls[touch.control].name;
            let at = || format!("{}; smaller with {control} {:.6}", place(phase, touch.time), touch.other);
            let excess = self.relative_to_controls(-touch.gap).max(0.0);
            worst.consider(excess, settings.minimum_tolerance, "-", at);
        }
        worst.into_check_with(format!("{LEAST_HAMILTONIAN} of {}", phase.name), KIND, remark)
    }

    /// The control with the least Hamiltonian found at each node; none where nowhere one is lower by more than the limit of the check.
    pub(super) fn least_controls(&mut self, settings: &VerifySettings) -> Option<PiecewisePolynomial> {
        let nu = self.equations.nu;
        if nu == 0 {
            return None;
        }
        let (searched, _) = self.search_points(settings);
        let largest = searched.iter().map(|point| self.excess(point).0).fold(0.0, f64::max);
        let mut segments = self.found.control.segments().to_vec();
        let nodes = segments.iter_mut().flat_map(|piece| piece.values.chunks_mut(nu));
        let stride = self.stride();
        for (k, values) in nodes.enumerate() {
            // Between the nodes that are searched the control is that of the one before.
            values.copy_from_slice(&searched[k / stride].least.1);
        }
        let is_evident = largest > settings.minimum_tolerance;
        let breaks = self.found.control.breaks().to_vec();
        is_evident.then(|| PiecewisePolynomial::new(nu, breaks, segments).ok()).flatten()
    }

    /// Searches the control set at the points of the phase, and gives a remark where it is not proved that nothing was missed.
    fn search_points(&mut self, settings: &VerifySettings) -> (Vec<Compared>, Option<String>) {
        let mut set = self.settled_control_set();
        let mut searched = self.compare_all(&set);
        let points: Vec<Searched<'_>> =
            searched.iter().map(|p| Searched { segment: p.segment, time: p.time, least: &p.least }).collect();
        let Proof { better, remark, is_open_far_away } =
            self.prove(&set, &points, self.allowed_gap(settings.minimum_tolerance));
        if !better.is_empty() {
            better.iter().for_each(|(_, (_, control))| set.include(control));
            searched = self.compare_all(&set);
            for (k, found) in better {
                let point = &mut searched[k];
                point.range = point.range.max(point.stated - found.0);
                if found.0 < point.least.0 {
                    point.least = found;
                }
                self.control_range = self.control_range.max(point.range);
            }
        }
        let is_open = |c: &Variable| !c.bounds.lower.is_finite() || !c.bounds.upper.is_finite();
        let open = is_open_far_away && self.equations.phase.controls.iter().any(is_open);
        let about = if open { "; controls without bounds searched about the range met" } else { "" };
        (searched, remark.map(|why| format!("searched, not proved: {why}{about}")))
    }

    /// The largest relative excess of the Hamiltonian at a point, by all controls or one alone, and the control that shows it.
    fn excess<'c>(&self, point: &'c Compared) -> (f64, &'c [f64]) {
        let mut largest = (self.relative_to_controls(point.gap()), point.least.1.as_slice());
        for (j, alone) in point.alone.iter().enumerate() {
            if let Some(Alone { least: (h, control), .. }) = alone {
                let excess = self.relative_to_control(point.stated - h, j);
                if excess > largest.0 {
                    largest = (excess, control);
                }
            }
        }
        largest
    }

    fn stride(&self) -> usize {
        self.nodes.len().div_ceil(POINTS).max(1)
    }

    fn compare_all(&mut self, set: &ControlSet) -> Vec<Compared> {
        let nodes = self.nodes.iter().step_by(self.stride()).map(|n| (n.segment, n.time));
        let points: Vec<(usize, f64)> = nodes.collect();
        let (mut stated, mut owns, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for &(segment, time) in &points {
            stated.push(self.evaluate(segment, time).value);
            owns.push(self.point.u.clone());
            places.push(self.place());
        }
        let mut compared = self.compare(self.search(set, &places), &points, &stated, &owns);
        for point in compared.iter_mut().filter(|p| p.rival.is_some()) {
            self.evaluate(point.segment, point.time);
            let own = self.point.u.clone();
            point.rival = point.rival.take().filter(|u| self.has_other_rates(u, &own));
        }
        self.control_range = compared.iter().fold(self.control_range, |range, c| range.max(c.range));
        for (j, range) in self.ranges_alone.iter_mut().enumerate() {
            let alone = compared.iter().filter_map(|c| c.alone[j].as_ref());
            *range = alone.fold(*range, |range, a| range.max(a.range));
        }
        compared
    }

    /// The point as it was evaluated.
    pub(super) fn place(&self) -> AtTime {
        AtTime { time: self.point.time, x: self.point.x.clone(), costate: self.point.costate.clone() }
    }

    /// The control set with the grid moved into it, where that is the same at all points: no state, parameter or time enters its rows.
    fn settled_control_set(&self) -> ControlSet {
        let mut set = self.control_set();
        if set.rows.iter().all(|r| self.equations.is_of_controls_alone(r.row)) {
            let nu = self.equations.nu;
            let at = vec![0; set.grid.len() / nu];
            let mut grid = set.grid.clone();
            let is_moved = self.search(&set, &[self.place()]).moved(&at, &mut grid);
            set.grid = (grid.chunks(nu).zip(is_moved))
                .filter(|(_, is_moved)| *is_moved)
                .flat_map(|(u, _)| u.iter().copied())
                .collect();
            set.settled = set.grid.len();
        }
        set
    }

    fn search<'s>(&'s self, set: &'s ControlSet, places: &'s [AtTime]) -> Search<'s> {
        Search { equations: &self.equations, set, lower: &set.lower, upper: &set.upper, places }
    }

    fn found_control(&self, segment: usize, time: f64) -> Vec<f64> {
        let mut control = vec![0.0; self.equations.nu];
        self.found.control.evaluate_in(segment, time, &mut control);
        control
    }

    /// Compares the trajectory's Hamiltonians and controls at points, the places of the search, with all others that are admissible there. Rivals
    /// may have the same rates.
    fn compare(
        &self,
        search: Search<'_>,
        points: &[(usize, f64)],
        stated: &[f64],
        owns: &[Vec<f64>],
    ) -> Vec<Compared> {
        let (nu, set) = (self.equations.nu, search.set);
        let steps = set.steps();
        let all: Vec<usize> = (0..points.len()).collect();
        let grids: Vec<OfGrid> = all.iter().map(|&k| of_grid(search, k, &owns[k], stated[k])).collect();
        let fars = grids.iter().enumerate().filter_map(|(k, grid)| Some((k, grid.far.clone()?)));
        let mut fars = search.descend(fars, &steps).into_iter();
        let mut moved = owns.concat();
        let hamiltonians = search.admissible(&all, &mut moved);
        let moved = hamiltonians.into_iter().zip(moved.chunks(nu));
        let moved: Vec<Option<Found>> = moved.map(|(h, u)| Some((h?, u.to_vec()))).collect();
        let starts: Vec<(usize, Found)> = (grids.iter().zip(&moved).enumerate())
            .flat_map(|(k, (grid, own))| grid.best.iter().chain(own).cloned().map(move |found| (k, found)))
            .collect();
        let of: Vec<usize> = starts.iter().map(|(k, _)| *k).collect();
        let mut least: Vec<Found> = stated.iter().copied().zip(owns.iter().cloned()).collect();
        let is_less = |found: &Found, than: &Found| found.0 < than.0;
        for (k, found) in of.into_iter().zip(search.descend(starts, &steps)) {
            if is_less(&found, &least[k]) {
                least[k] = found;
            }
        }
        let mut alone: Vec<Vec<Option<Alone>>> = all.iter().map(|_| Vec::with_capacity(nu)).collect();
        for j in 0..nu {
            for ((alone, least), found) in alone.iter_mut().zip(&mut least).zip(search.alone(&moved, j)) {
                if let Some(found) = found.as_ref().filter(|found| is_less(&found.least, least)) {
                    *least = found.least.clone();
                }
                alone.push(found);
            }
        }
        let mut compared = Vec::with_capacity(points.len());
        for (k, ((grid, least), alone)) in grids.into_iter().zip(least).zip(alone).enumerate() {
            let ((segment, time), stated) = (points[k], stated[k]);
            let far = grid.far.and_then(|_| fars.next()).filter(|(_, u)| set.are_apart(u, &owns[k]));
            let rival = far.filter(|(h, _)| h - stated <= EQUAL * self.hamiltonian_size).map(|(_, u)| u);
            let range = grid.largest - least.0;
            compared.push(Compared { segment, time, stated, range, least, alone, rival });
        }
        compared
    }

    /// Says whether a control leaves the states that are at their bounds, those of path constraints without controls that are, and those
    /// that the rates of these take, the rates that they have.
    pub(super) fn keeps_to_state_bounds(
        &mut self,
        segment: usize,
        time: f64,
        control: &[f64],
        settings: &VerifySettings,
    ) -> bool {
        self.evaluate(segment, time);
        let Self { equations, point, scaling, .. } = self;
        let phase = equations.phase;
        let is_at = |variable: &Variable, value: f64, scale: f64| {
            variable.bounds.excess(value) >= -settings.activity_tolerance * scale
        };
        let states = phase.states.iter().zip(&point.x).zip(&scaling.states);
        let mut bound: Vec<bool> = states.map(|((s, x), scale)| is_at(&s.variable, *x, *scale)).collect();
        let mut values = vec![0.0; phase.path_rows()];
        equations.path(&mut values);
        let rows = phase.path.iter().flat_map(|p| &p.rows).zip(&values).zip(&scaling.path).enumerate();
        for (row, _) in rows.filter(|(_, ((row, value), scale))| is_at(row, **value, **scale)) {
            if equations.is_free_of_controls(row) {
                equations.states_of_row(row).for_each(|state| bound[state] = true);
            }
        }
        // The rate of a state at its bound keeps still as well, and so do the states that it takes.
        let pattern = phase.dynamics.pattern();
        while let Some((_, state)) =
            pattern.jacobian_entries().find(|(of, column)| bound[*of] && bound.get(*column) == Some(&false))
        {
            bound[state] = true;
        }
        let own = point.u.clone();
        !self.rates_differ(control, &own, &|k| bound.get(k) == Some(&true), f64::min)
    }

    /// True if a control changes the rates of states and integrals at the point as it was evaluated, whatever its derivatives there.
    pub(crate) fn has_effect(&mut self, control: usize) -> bool {
        let own = self.point.u.clone();
        let bounds = self.equations.phase.controls[control].bounds;
        let scale = self.scaling.controls[control];
        let others = [bounds.lower, bounds.upper, own[control] - scale, own[control] + scale];
        others.into_iter().filter(|v| v.is_finite()).any(|value| {
            let mut other = own.clone();
            other[control] = bounds.clamp(value);
            // By the scales of the states alone: what a barrier leaves of a thrust gives its direction rates, and no effect.
            self.rates_differ(&other, &own, &|_| true, |_, scale| scale)
        })
    }

    /// True if the rates of states and integrals differ: the controls are not two descriptions of one motion, as an angle and
    /// itself after a full turn.
    pub(super) fn has_other_rates(&mut self, one: &[f64], other: &[f64]) -> bool {
        // Beside wide bounds the rates themselves tell what is much.
        self.rates_differ(one, other, &|_| true, f64::min)
    }

    /// True if the changes over the duration of `those` states and integrals differ by much, relative to `size(largest change, scale)`.
    fn rates_differ(
        &mut self,
        one: &[f64],
        other: &[f64],
        those: &dyn Fn(usize) -> bool,
        size: impl Fn(f64, f64) -> f64,
    ) -> bool {
        let Self { equations, point, scaling, .. } = self;
        let mut rates = |u: &[f64]| {
            let mut out = vec![0.0; equations.nx + equations.phase.integrals.len()];
            equations.set(point.time, &point.x, u);
            equations.rates(&mut out);
            out
        };
        let (one, other) = (rates(one), rates(other));
        let scales = scaling.states.iter().chain(&scaling.integrals);
        let mut compared = one.iter().zip(&other).zip(scales).enumerate().filter(|(k, _)| those(*k));
        compared.any(|(_, ((a, b), scale))| {
            let largest = a.abs().max(b.abs()) * scaling.time;
            (a - b).abs() * scaling.time > SAME_RATES * size(largest, *scale).max(NO_CHANGE * scale)
        })
    }
}

impl Compared {
    /// Distance of the trajectory's Hamiltonian above the least one found.
    fn gap(&self) -> f64 {
        self.stated - self.least.0
    }
}

/// The grid at one point.
struct OfGrid {
    /// The best of it.
    best: Vec<Found>,
    /// The largest Hamiltonian, not below that of the trajectory.
    largest: f64,
    /// The best that is far from the trajectory's control.
    far: Option<Found>,
}

fn of_grid(search: Search<'_>, place: usize, own: &[f64], stated: f64) -> OfGrid {
    let Search { set, .. } = search;
    let nu = own.len();
    let (settled, others) = set.grid.split_at(set.settled);
    let hamiltonians = search.hamiltonians(&vec![place; settled.len() / nu], settled);
    let settled = hamiltonians.into_iter().map(|h| Some(h).filter(|h| h.is_finite())).zip(settled.chunks(nu));
    let mut moved = others.to_vec();
    let others = search.admissible(&vec![place; others.len() / nu], &mut moved).into_iter();
    let mut grid = OfGrid { best: Vec::new(), largest: stated, far: None };
    for (h, u) in settled.chain(others.zip(moved.chunks(nu))) {
        let Some(h) = h else { continue };
        grid.largest = grid.largest.max(h);
        let at = grid.best.partition_point(|(other, _)| *other <= h);
        if at < STARTS {
            grid.best.insert(at, (h, u.to_vec()));
            grid.best.truncate(STARTS);
        }
        if set.are_apart(u, own) && grid.far.as_ref().is_none_or(|(other, _)| h < *other) {
            grid.far = Some((h, u.to_vec()));
        }
    }
    grid
}

/// The controls that differ, with those of the trajectory.
fn in_words(phase: &Phase, controls: &[f64], own: &[f64]) -> String {
    let differ = phase.controls.iter().zip(controls).zip(own).filter(|((_, u), own)| u != own);
    let words = differ.map(|((c, u), own)| format!("{} {u:.6} for {own:.6}", c.name));
    words.collect::<Vec<_>>().join(", ")
}
