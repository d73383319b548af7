//! The controls that are admissible along a phase, and the grid over them.

use super::PhaseConditions;

/// Points of the grid in one, two, three, four controls per axis; more controls take a sequence of low discrepancy.
const GRID: [usize; 4] = [33, 13, 7, 5];
/// Length of that sequence.
const SEQUENCE: usize = 600;
/// Controls are apart if one of them differs by more than this part of its range.
const APART: f64 = 0.1;
/// A candidate meets a path constraint within this times the scale of the row.
const ROW_TOLERANCE: f64 = 1e-9;

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
    /// The length of the part of it, the first one, that is admissible whatever the point.
    pub(super) settled: usize,
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
            let tolerance = ROW_TOLERANCE * self.row_scales[row];
            ControlRow { row, lower: variable.bounds.lower, upper: variable.bounds.upper, tolerance }
        });
        let rows = rows.collect();
        let grid = grid(&lower, &upper);
        ControlSet { lower, upper, rows, grid, settled: 0 }
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
