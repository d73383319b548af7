//! The controls that are admissible at one point, and the search over them: a grid, projections onto path constraints, a compass search.

use apsides_basis::golden_section;

use super::PhaseConditions;
use crate::boundary::row_scale;

/// Points of the grid in one, two, three, four controls per axis; more controls take a sequence of low discrepancy.
const GRID: [usize; 4] = [33, 13, 7, 5];
/// Length of that sequence.
const SEQUENCE: usize = 600;
/// Halvings of the steps of the compass search.
const HALVINGS: usize = 12;
/// Sweeps of projections onto path constraints.
const SWEEPS: usize = 30;
/// Controls are apart if one of them differs by more than this part of its range.
const APART: f64 = 0.1;
/// Values of one control alone between its bounds, and powers of ten of its range about its own value.
const ALONE: usize = 33;
const DECADES: i32 = 6;
/// Evaluations of the search about the best of them.
const EVALUATIONS: usize = 24;
/// A candidate meets a path constraint within this times the scale of the row.
const ROW_TOLERANCE: f64 = 1e-9;

/// A Hamiltonian and the control that has it.
pub(super) type Found = (f64, Vec<f64>);

/// The least Hamiltonian with one control changed, the others those of the trajectory.
pub(super) struct Alone {
    pub(super) least: Found,
    /// Distance of the largest Hamiltonian found above the least one.
    pub(super) range: f64,
}

/// A path constraint row in which controls occur.
pub(super) struct ControlRow {
    pub(super) row: usize,
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) tolerance: f64,
}

/// The control set at one point, and the search over it.
pub(super) struct ControlSet {
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
    pub(super) rows: Vec<ControlRow>,
    /// The grid, one control after the other, and better controls that were found at other points.
    pub(super) grid: Vec<f64>,
}

impl PhaseConditions<'_> {
    /// The control set of the phase; a control without bounds is looked for about the range met.
    pub(super) fn control_set(&self) -> ControlSet {
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
            // What is met of an equality is rounding: no candidate would be as near.
            let tolerance = ROW_TOLERANCE * row_scale(variable, largest.max(self.scaling.path[row]));
            ControlRow { row, lower: variable.bounds.lower, upper: variable.bounds.upper, tolerance }
        });
        let rows = rows.collect();
        let grid = grid(&lower, &upper);
        ControlSet { lower, upper, rows, grid }
    }
}

impl ControlSet {
    /// Adds a control, which may be beyond the range met, to those that are looked at.
    pub(super) fn include(&mut self, control: &[f64]) {
        for ((lower, upper), u) in self.lower.iter_mut().zip(&mut self.upper).zip(control) {
            (*lower, *upper) = (lower.min(*u), upper.max(*u));
        }
        self.grid.extend(control);
    }

    /// First steps of a compass search: half the distances of the grid.
    pub(super) fn steps(&self) -> Vec<f64> {
        let widths = self.upper.iter().zip(&self.lower).map(|(b, a)| b - a);
        let per_axis = GRID.get(self.lower.len() - 1).copied().unwrap_or(4) as f64;
        widths.map(|w| 0.5 * w / (per_axis - 1.0)).collect()
    }

    pub(super) fn are_apart(&self, one: &[f64], other: &[f64]) -> bool {
        let widths = self.upper.iter().zip(&self.lower).map(|(b, a)| b - a);
        one.iter().zip(other).zip(widths).any(|((a, b), width)| (a - b).abs() > APART * width)
    }
}

/// The search at the point as it was evaluated, between bounds; `trial` is the last admissible candidate.
pub(super) struct Search<'c, 'a, 's> {
    conditions: &'c mut PhaseConditions<'a>,
    set: &'s ControlSet,
    lower: &'s [f64],
    upper: &'s [f64],
    pub(super) trial: Vec<f64>,
}

impl<'c, 'a, 's> Search<'c, 'a, 's> {
    pub(super) fn within(
        conditions: &'c mut PhaseConditions<'a>,
        set: &'s ControlSet,
        lower: &'s [f64],
        upper: &'s [f64],
    ) -> Self {
        let trial = vec![0.0; lower.len()];
        Self { conditions, set, lower, upper, trial }
    }

    /// Moves a candidate into the control set, as `trial`, and gives its Hamiltonian; none if it cannot be moved there.
    pub(super) fn admissible(&mut self, candidate: &[f64]) -> Option<f64> {
        self.trial.copy_from_slice(candidate);
        self.clamp();
        if !self.set.rows.is_empty() && !self.project() {
            return None;
        }
        let h = self.hamiltonian();
        h.is_finite().then_some(h)
    }

    fn clamp(&mut self) {
        for ((u, lower), upper) in self.trial.iter_mut().zip(self.lower).zip(self.upper) {
            *u = u.max(*lower).min(*upper);
        }
    }

    fn hamiltonian(&mut self) -> f64 {
        let PhaseConditions { equations, point, .. } = &mut *self.conditions;
        equations.set(point.time, &point.x, &self.trial);
        equations.hamiltonian(&point.costate)
    }

    /// Projections onto one violated row after the other (S. Kaczmarz, 1937); returns true if all hold.
    fn project(&mut self) -> bool {
        let controls = self.conditions.equations.nx..self.conditions.equations.nx + self.trial.len();
        for _ in 0..SWEEPS {
            let mut inside = true;
            for r in &self.set.rows {
                let PhaseConditions { equations, point, .. } = &mut *self.conditions;
                equations.set(point.time, &point.x, &self.trial);
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

    /// The Hamiltonian with one control changed from an admissible one; none where that would not be admissible.
    fn changed(&mut self, own: &[f64], control: usize, value: f64) -> Option<f64> {
        let mut candidate = own.to_vec();
        candidate[control] = value;
        let h = self.admissible(&candidate)?;
        let is_kept = self.trial.iter().zip(own).enumerate().all(|(j, (a, b))| j == control || a == b);
        is_kept.then_some(h)
    }

    /// Searches one control alone, on the scale of its own range.
    pub(super) fn alone(&mut self, own: &[f64], control: usize) -> Option<Alone> {
        let (lower, upper) = (self.lower[control], self.upper[control]);
        let width = upper - lower;
        if !(width > 0.0 && width.is_finite()) {
            return None;
        }
        // Within the bounds.
        self.admissible(own)?;
        let own = self.trial.clone();
        let mut values: Vec<f64> =
            (0..ALONE).map(|k| lower + width * k as f64 / (ALONE - 1) as f64).collect();
        for decade in 1..=DECADES {
            let step = width * 10f64.powi(-decade);
            values.extend([own[control] - step, own[control] + step].map(|v| v.max(lower).min(upper)));
        }
        values.push(own[control]);
        values.sort_by(f64::total_cmp);
        values.dedup();
        let found: Vec<Option<f64>> = values.iter().map(|v| self.changed(&own, control, *v)).collect();
        let all = || found.iter().flatten();
        let largest = all().fold(f64::NEG_INFINITY, |m, h| m.max(*h));
        let hamiltonian = |k: &usize| found[*k].unwrap_or(f64::INFINITY);
        let best = (0..values.len())
            .filter(|k| found[*k].is_some())
            .min_by(|a, b| hamiltonian(a).total_cmp(&hamiltonian(b)))?;
        let around = [values[best.saturating_sub(1)], values[(best + 1).min(values.len() - 1)]];
        let [value, h] =
            golden_section(around, EVALUATIONS, |v| self.changed(&own, control, v).unwrap_or(f64::INFINITY));
        let (h, value) = if h < hamiltonian(&best) { (h, value) } else { (hamiltonian(&best), values[best]) };
        // What constraints made of the value.
        self.changed(&own, control, value)?;
        Some(Alone { least: (h, self.trial.clone()), range: largest - h })
    }

    /// Compass search from an admissible control.
    pub(super) fn descend(&mut self, mut h: f64, mut u: Vec<f64>, mut steps: Vec<f64>) -> Found {
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
