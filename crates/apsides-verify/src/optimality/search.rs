//! The search for the least Hamiltonian over the control set, at many points of a phase at once: projections onto path constraints, a compass
//! search, and a search of each control alone. Every point is searched as it would be alone.

use apsides_basis::golden_sections;

use super::control_set::ControlSet;
use crate::equations::Equations;
use crate::many_points::{AtTime, Controls};

/// Halvings of the steps of the compass search.
const HALVINGS: usize = 12;
/// Sweeps of projections onto path constraints.
const SWEEPS: usize = 30;
/// Values of one control alone between its bounds, and powers of ten of its range about its own value.
const ALONE: usize = 33;
const DECADES: i32 = 6;
/// Evaluations of the search about the best of them.
const EVALUATIONS: usize = 24;

/// A Hamiltonian and the control that has it.
pub(super) type Found = (f64, Vec<f64>);

/// The least Hamiltonian with one control changed, the others those of the trajectory.
pub(super) struct Alone {
    pub(super) least: Found,
    /// Distance of the largest Hamiltonian found above the least one.
    pub(super) range: f64,
}

/// A search at places of a phase, between bounds.
#[derive(Clone, Copy)]
pub(super) struct Search<'s> {
    pub(super) equations: &'s Equations<'s>,
    pub(super) set: &'s ControlSet,
    pub(super) lower: &'s [f64],
    pub(super) upper: &'s [f64],
    pub(super) places: &'s [AtTime],
}

impl Search<'_> {
    /// Moves candidates of these places, one after the other, into the control set, and gives their Hamiltonians; none for those that cannot be
    /// moved there.
    pub(super) fn admissible(&self, at: &[usize], candidates: &mut [f64]) -> Vec<Option<f64>> {
        let if_finite = |h: f64| Some(h).filter(|h| h.is_finite());
        let is_moved = self.moved(at, candidates);
        if self.set.rows.is_empty() {
            return self.hamiltonians(at, candidates).into_iter().map(if_finite).collect();
        }
        let which: Vec<usize> = (0..at.len()).filter(|i| is_moved[*i]).collect();
        let (at_those, values) = self.gathered(at, candidates, &which);
        let mut found = vec![None; at.len()];
        for (i, h) in which.into_iter().zip(self.hamiltonians(&at_those, &values)) {
            found[i] = if_finite(h);
        }
        found
    }

    /// The Hamiltonians of controls of these places.
    pub(super) fn hamiltonians(&self, at: &[usize], controls: &[f64]) -> Vec<f64> {
        self.equations.hamiltonians(self.controls(at, controls))
    }

    /// Moves one candidate into the control set.
    pub(super) fn one(&self, place: usize, candidate: &[f64]) -> Option<Found> {
        let mut control = candidate.to_vec();
        let h = self.admissible(&[place], &mut control)[0]?;
        Some((h, control))
    }

    fn controls<'p>(&'p self, at: &'p [usize], values: &'p [f64]) -> Controls<'p> {
        Controls { places: self.places, at, values }
    }

    fn gathered(&self, at: &[usize], candidates: &[f64], which: &[usize]) -> (Vec<usize>, Vec<f64>) {
        let nu = self.lower.len();
        let mut values = Vec::with_capacity(which.len() * nu);
        which.iter().for_each(|i| values.extend_from_slice(&candidates[i * nu..(i + 1) * nu]));
        (which.iter().map(|i| at[*i]).collect(), values)
    }

    fn clamp(&self, control: &mut [f64]) {
        for ((u, lower), upper) in control.iter_mut().zip(self.lower).zip(self.upper) {
            *u = u.max(*lower).min(*upper);
        }
    }

    /// Projections onto one violated row after the other (S. Kaczmarz, 1937); tells for each candidate if all hold.
    pub(super) fn moved(&self, at: &[usize], candidates: &mut [f64]) -> Vec<bool> {
        let (nu, rows) = (self.lower.len(), &self.set.rows);
        candidates.chunks_mut(nu).for_each(|u| self.clamp(u));
        if rows.is_empty() {
            return vec![true; at.len()];
        }
        let mut is_moved = vec![false; at.len()];
        let mut left: Vec<usize> = (0..at.len()).collect();
        for _ in 0..SWEEPS {
            let mut is_inside = vec![true; at.len()];
            for r in rows {
                let (at_left, values) = self.gathered(at, candidates, &left);
                let found = self.equations.row_values(r.row, self.controls(&at_left, &values));
                // A row without a value is not met.
                let excess = |value: f64| {
                    let excess = (value - r.upper).max(0.0) + (value - r.lower).min(0.0);
                    if value.is_nan() { value } else { excess }
                };
                let outside: Vec<(usize, f64)> = (left.iter().copied().zip(found.into_iter().map(excess)))
                    .filter(|(_, excess)| excess.is_nan() || excess.abs() > r.tolerance)
                    .collect();
                let which: Vec<usize> = outside.iter().map(|o| o.0).collect();
                let (at_those, values) = self.gathered(at, candidates, &which);
                let slopes = self.equations.row_slopes(r.row, self.controls(&at_those, &values));
                for (&(i, excess), slope) in outside.iter().zip(slopes.chunks(nu)) {
                    is_inside[i] = false;
                    let square: f64 = slope.iter().map(|g| g * g).sum();
                    if !(square > 0.0 && excess.is_finite()) {
                        left.retain(|k| *k != i);
                        continue;
                    }
                    let control = &mut candidates[i * nu..(i + 1) * nu];
                    for (u, g) in control.iter_mut().zip(slope) {
                        *u -= excess * g / square;
                    }
                    self.clamp(control);
                }
            }
            left.retain(|&i| {
                is_moved[i] = is_inside[i];
                !is_inside[i]
            });
            if left.is_empty() {
                break;
            }
        }
        is_moved
    }

    /// Compass searches from admissible controls of places.
    pub(super) fn descend(
        &self,
        starts: impl IntoIterator<Item = (usize, Found)>,
        steps: &[f64],
    ) -> Vec<Found> {
        let compass = |(place, (h, u))| Compass {
            place,
            h,
            u,
            steps: steps.to_vec(),
            axis: 0,
            is_back: false,
            has_improved: false,
            rounds: 0,
        };
        let mut all: Vec<Compass> = starts.into_iter().map(compass).collect();
        loop {
            let mut open: Vec<&mut Compass> = all.iter_mut().filter(|c| c.rounds < HALVINGS).collect();
            if open.is_empty() {
                break;
            }
            let at: Vec<usize> = open.iter().map(|c| c.place).collect();
            let mut candidates = Vec::with_capacity(open.len() * self.lower.len());
            open.iter().for_each(|c| c.add_candidate(&mut candidates));
            let found = self.admissible(&at, &mut candidates);
            for ((compass, h), u) in open.iter_mut().zip(found).zip(candidates.chunks(self.lower.len())) {
                compass.take(h, u);
            }
        }
        all.into_iter().map(|c| (c.h, c.u)).collect()
    }

    /// The Hamiltonians with one control changed to values, from admissible controls of places, and what constraints make of the controls;
    /// none where another control would change, or nothing is admissible.
    fn changed(
        &self,
        owns: &[Own<'_>],
        at: &[usize],
        control: usize,
        values: &[f64],
    ) -> (Vec<Option<f64>>, Vec<f64>) {
        let nu = self.lower.len();
        let mut candidates = Vec::with_capacity(at.len() * nu);
        for (&k, value) in at.iter().zip(values) {
            candidates.extend_from_slice(owns[k].control);
            let last = candidates.len() - nu;
            candidates[last + control] = *value;
        }
        let places: Vec<usize> = at.iter().map(|k| owns[*k].place).collect();
        let mut found = self.admissible(&places, &mut candidates);
        for ((h, u), k) in found.iter_mut().zip(candidates.chunks(nu)).zip(at) {
            let own = owns[*k].control;
            *h = h.filter(|_| u.iter().zip(own).enumerate().all(|(j, (a, b))| j == control || a == b));
        }
        (found, candidates)
    }

    /// Searches one control alone at all places, on the scale of its own range, beside the controls of the trajectory as they were moved into the
    /// control set.
    pub(super) fn alone<'o>(&self, moved: &'o [Option<Found>], control: usize) -> Vec<Option<Alone>> {
        let nu = self.lower.len();
        let (lower, upper) = (self.lower[control], self.upper[control]);
        let width = upper - lower;
        let mut alone: Vec<Option<Alone>> = self.places.iter().map(|_| None).collect();
        if !(width > 0.0 && width.is_finite()) {
            return alone;
        }
        let own =
            |(place, found): (usize, &'o Option<Found>)| Some(Own { place, control: &found.as_ref()?.1 });
        let owns: Vec<Own<'o>> = moved.iter().enumerate().filter_map(own).collect();
        let of_grid = |k: usize| -> Option<OnScale> {
            let own = owns[k].control[control];
            let mut values: Vec<f64> =
                (0..ALONE).map(|k| lower + width * k as f64 / (ALONE - 1) as f64).collect();
            for decade in 1..=DECADES {
                let step = width * 10f64.powi(-decade);
                values.extend([own - step, own + step].map(|v| v.max(lower).min(upper)));
            }
            values.push(own);
            values.sort_by(f64::total_cmp);
            values.dedup();
            let (found, _) = self.changed(&owns, &vec![k; values.len()], control, &values);
            let largest = found.iter().flatten().fold(f64::NEG_INFINITY, |m, h| m.max(*h));
            let hamiltonian = |k: &usize| found[*k].unwrap_or(f64::INFINITY);
            let best = (0..values.len())
                .filter(|k| found[*k].is_some())
                .min_by(|a, b| hamiltonian(a).total_cmp(&hamiltonian(b)))?;
            let around = [values[best.saturating_sub(1)], values[(best + 1).min(values.len() - 1)]];
            Some(OnScale { own: k, largest, best: [values[best], hamiltonian(&best)], around })
        };
        let scales: Vec<OnScale> = (0..owns.len()).filter_map(of_grid).collect();
        let at: Vec<usize> = scales.iter().map(|s| s.own).collect();
        let around: Vec<[f64; 2]> = scales.iter().map(|s| s.around).collect();
        let refined = golden_sections(&around, EVALUATIONS, |values| {
            let (found, _) = self.changed(&owns, &at, control, values);
            found.into_iter().map(|h| h.unwrap_or(f64::INFINITY)).collect()
        });
        let better = |(s, [value, h]): (&OnScale, [f64; 2])| if h < s.best[1] { [value, h] } else { s.best };
        let best: Vec<[f64; 2]> = scales.iter().zip(refined).map(better).collect();
        // The controls that constraints make of the values.
        let values: Vec<f64> = best.iter().map(|b| b[0]).collect();
        let (found, moved) = self.changed(&owns, &at, control, &values);
        for (((scale, [_, h]), found), u) in scales.iter().zip(best).zip(found).zip(moved.chunks(nu)) {
            let range = scale.largest - h;
            alone[owns[scale.own].place] = found.map(|_| Alone { least: (h, u.to_vec()), range });
        }
        alone
    }
}

/// An admissible control of a place.
struct Own<'o> {
    place: usize,
    control: &'o [f64],
}

/// The course of the Hamiltonian over the range of one control alone.
struct OnScale {
    own: usize,
    largest: f64,
    /// The best value looked at, and its Hamiltonian.
    best: [f64; 2],
    /// The values beside it.
    around: [f64; 2],
}

/// A compass search, one candidate after the other.
struct Compass {
    place: usize,
    h: f64,
    u: Vec<f64>,
    steps: Vec<f64>,
    axis: usize,
    /// True for the step back along the axis.
    is_back: bool,
    has_improved: bool,
    rounds: usize,
}

impl Compass {
    fn add_candidate(&self, candidates: &mut Vec<f64>) {
        let (first, step) = (candidates.len(), self.steps[self.axis]);
        candidates.extend_from_slice(&self.u);
        candidates[first + self.axis] += if self.is_back { -step } else { step };
    }

    /// Takes the Hamiltonian of the candidate, and what it was moved to.
    fn take(&mut self, h: Option<f64>, moved: &[f64]) {
        if let Some(lower) = h.filter(|h| *h < self.h) {
            (self.h, self.has_improved) = (lower, true);
            self.u.copy_from_slice(moved);
        } else if !self.is_back {
            self.is_back = true;
            return;
        }
        self.is_back = false;
        self.axis += 1;
        if self.axis == self.u.len() {
            if !self.has_improved {
                self.steps.iter_mut().for_each(|s| *s *= 0.5);
            }
            (self.axis, self.has_improved) = (0, false);
            self.rounds += 1;
        }
    }
}
