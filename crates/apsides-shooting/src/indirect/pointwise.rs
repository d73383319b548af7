//! The pointwise minimisation: Newton's method with a working set of bounds and path constraints, safeguarded.

use apsides_ocp::Bounds;

use super::hamiltonian::{ControlKind, Hamiltonian, Place};
use super::small;

/// Newton iterations for the controls of one time.
const MAX_ITERATIONS: usize = 60;
/// Largest step of a converged control, relative to its size or one.
const STEP_TOLERANCE: f64 = 1e-12;
/// Largest step, relative to the size of a control or one, that is taken without looking at the value.
const NEAR: f64 = 0.1;
/// Samples per control in the search for the least value.
const SCAN: usize = 24;
/// Violation of an inactive row that makes it active, relative to its bound or one.
const ROW_TOLERANCE: f64 = 1e-12;

impl Hamiltonian {
    /// Looks for the least value of the Hamiltonian over a grid between the bounds, for one or two smooth controls without path
    /// constraints; so that a Newton iteration starts at the right minimum.
    pub(super) fn scan(&mut self, t: f64, x: &[f64], costate: &[f64], p: &[f64]) {
        let smooth: Vec<usize> =
            (0..self.controls).filter(|&u| self.kinds[u] == ControlKind::Smooth).collect();
        let bounded = |&u: &usize| (self.bounds[u].upper - self.bounds[u].lower).is_finite();
        if smooth.is_empty() || smooth.len() > 2 || self.row_count > 0 || !smooth.iter().all(bounded) {
            return;
        }
        self.find_control(t, x, costate, p);
        let nx = self.states;
        let mut best: Vec<f64> = smooth.iter().map(|&u| self.z[nx + u]).collect();
        let mut least = self.hamiltonian();
        let grid = |b: Bounds, k: usize| b.lower + (b.upper - b.lower) * k as f64 / SCAN as f64;
        for k in 0..(SCAN + 1).pow(smooth.len() as u32) {
            for (place, &u) in smooth.iter().enumerate() {
                self.z[nx + u] = grid(self.bounds[u], k / (SCAN + 1).pow(place as u32) % (SCAN + 1));
            }
            let value = self.hamiltonian();
            if value < least {
                least = value;
                best = smooth.iter().map(|&u| self.z[nx + u]).collect();
            }
        }
        for (&u, value) in smooth.iter().zip(best) {
            self.z[nx + u] = value;
            self.control_places[u] = Place::Inside;
        }
    }

    /// Moves the smooth controls to the nearest minimum, else to the best that is found from other starts. False where none is found; the
    /// next search then starts afresh.
    pub(super) fn minimise(&mut self) -> bool {
        let from = self.control().to_vec();
        if self.iterate().is_some() {
            return true;
        }
        let mut best: Option<(f64, Vec<f64>)> = None;
        for start in self.other_starts(&from) {
            self.start_control(&start);
            if self.iterate().is_some() {
                let value = self.value;
                if best.as_ref().is_none_or(|(least, _)| value < *least) {
                    best = Some((value, self.control().to_vec()));
                }
            }
        }
        self.start_control(best.as_ref().map_or(&from, |(_, control)| control));
        best.is_some() && self.iterate().is_some()
    }

    /// Controls against the gradient, opposite to `from`, and in the middle between the bounds.
    fn other_starts(&mut self, from: &[f64]) -> [Vec<f64>; 3] {
        let nx = self.states;
        self.start_control(from);
        self.linearise();
        let slope = &self.gradient[nx..nx + self.controls];
        let steepest = slope.iter().map(|g| g * g).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let size = from.iter().map(|u| u * u).sum::<f64>().sqrt();
        let down = slope.iter().map(|g| -g / steepest * size).collect();
        let opposite = from.iter().map(|u| -u).collect();
        [down, opposite, self.bounds.iter().map(Bounds::representative).collect()]
    }

    fn iterate(&mut self) -> Option<()> {
        let nx = self.states;
        for iteration in 0..MAX_ITERATIONS {
            self.linearise();
            let (free, active) = self.working_set();
            if iteration == 0 && self.multipliers.iter().all(|m| *m == 0.0) {
                self.estimate_row_multipliers(&free, &active);
            }
            self.curve();
            let step = self.newton_step(&free, &active)?;
            let (length, blocking) = self.longest_step(&free, &step);
            let before = self.merit();
            let from: Vec<f64> = free.iter().map(|&u| self.z[nx + u]).collect();
            let sizes = free.iter().zip(&step).map(|(&u, d)| d.abs() / self.z[nx + u].abs().max(1.0));
            let size = sizes.fold(0.0, f64::max);
            let (small, near) = (size <= STEP_TOLERANCE, size <= NEAR);
            let mut fraction = length;
            loop {
                for ((&u, &start), d) in free.iter().zip(&from).zip(&step) {
                    self.z[nx + u] = start + fraction * d;
                }
                // Close to the minimum rounding and the curvature of the rows decide about the value.
                if near || fraction < 1e-8 || self.merit() <= before + 1e-12 * before.abs().max(1e-300) {
                    break;
                }
                fraction *= 0.5;
            }
            if let Some((u, place)) = blocking.filter(|_| fraction == length) {
                self.control_places[u] = place;
                let b = self.bounds[u];
                self.z[nx + u] = if place == Place::Lower { b.lower } else { b.upper };
                continue;
            }
            if small {
                self.linearise();
                if !self.change_working_set() {
                    return Some(());
                }
            }
        }
        None
    }

    /// `H` and a weight times the violation of the path constraints.
    fn merit(&mut self) -> f64 {
        let mut merit = self.hamiltonian();
        for &u in &self.smoothed {
            merit += self.square(u);
        }
        let mut first = 0;
        for k in 0..self.rows.len() {
            let (term, bounds) = &mut self.rows[k];
            term.evaluate(&self.z);
            for (r, b) in bounds.iter().enumerate() {
                let weight = 2.0 * self.multipliers[first + r].abs();
                merit += weight * b.excess(term.values[r]).max(0.0);
            }
            first += bounds.len();
        }
        merit
    }

    /// Multipliers of the active rows that fit the gradient best, as if the Hessian were the unit matrix.
    fn estimate_row_multipliers(&mut self, free: &[usize], active: &[usize]) {
        if active.is_empty() {
            return;
        }
        self.curvature.fill(0.0);
        self.fill_kkt(free, active, 1.0);
        let (n, nx) = (free.len(), self.states);
        for (i, &u) in free.iter().enumerate() {
            self.right[i] = -self.gradient[nx + u];
        }
        self.right[n..n + active.len()].fill(0.0);
        if small::solve(n + active.len(), &mut self.scratch, &mut self.right, 1) {
            for (k, &r) in active.iter().enumerate() {
                self.multipliers[r] = self.right[n + k];
            }
            self.linearise();
        }
    }

    /// The Newton step of the free controls; updates the multipliers of the active rows.
    fn newton_step(&mut self, free: &[usize], active: &[usize]) -> Option<Vec<f64>> {
        let (n, m) = (free.len(), active.len());
        let shift = self.convexity_shift(free, active)?;
        self.fill_kkt(free, active, shift);
        let (nx, nz) = (self.states, self.inputs());
        // The gradient without the multipliers, which are solved for.
        for (i, &u) in free.iter().enumerate() {
            let held: f64 =
                (0..self.row_count).map(|r| self.multipliers[r] * self.row_slopes[r * nz + nx + u]).sum();
            self.right[i] = held - self.gradient[nx + u];
        }
        for (k, &r) in active.iter().enumerate() {
            self.right[n + k] = self.row_target(r) - self.row_values[r];
        }
        if !small::solve(n + m, &mut self.scratch, &mut self.right, 1) {
            return None;
        }
        for r in 0..self.row_count {
            self.multipliers[r] = 0.0;
        }
        for (k, &r) in active.iter().enumerate() {
            self.multipliers[r] = self.right[n + k];
        }
        let step = self.right[..n].to_vec();
        step.iter().all(|d| d.is_finite()).then_some(step)
    }

    /// The value that an active row is to have.
    fn row_target(&self, row: usize) -> f64 {
        let b = self.row_bounds().nth(row).unwrap_or(Bounds::FREE);
        if self.row_places[row] == Place::Lower { b.lower } else { b.upper }
    }

    /// The least of a few multiples of the unit matrix that makes the Hessian positive definite where the active rows are
    /// constant.
    fn convexity_shift(&mut self, free: &[usize], active: &[usize]) -> Option<f64> {
        let (n, nx, nz) = (free.len(), self.states, self.inputs());
        let size = free.iter().fold(0.0_f64, |m, &u| m.max(self.curvature[(nx + u) * nz + nx + u].abs()));
        let slope = free.iter().fold(0.0_f64, |m, &u| m.max(self.gradient[nx + u].abs()));
        let unit = size.max(slope).max(f64::MIN_POSITIVE);
        let mut shift = 0.0;
        for _ in 0..40 {
            for (i, &u) in free.iter().enumerate() {
                for (j, &v) in free.iter().enumerate() {
                    let rows: f64 = active
                        .iter()
                        .map(|r| self.row_slopes[r * nz + nx + u] * self.row_slopes[r * nz + nx + v])
                        .sum();
                    let diagonal = if i == j { shift } else { 0.0 };
                    self.scratch[i * n + j] =
                        self.curvature[(nx + u) * nz + nx + v] + diagonal + 1e3 * unit * rows;
                }
            }
            if small::is_positive_definite(n, &mut self.scratch) {
                return Some(shift);
            }
            shift = if shift == 0.0 { unit } else { 4.0 * shift };
        }
        None
    }

    /// The matrix `[Huu, A^T; A, 0]` of free controls and active rows.
    fn fill_kkt(&mut self, free: &[usize], active: &[usize], shift: f64) {
        let (n, nx, nz) = (free.len(), self.states, self.inputs());
        let order = n + active.len();
        self.scratch[..order * order].fill(0.0);
        for (i, &u) in free.iter().enumerate() {
            for (j, &v) in free.iter().enumerate() {
                self.scratch[i * order + j] = self.curvature[(nx + u) * nz + nx + v];
            }
            self.scratch[i * order + i] += shift;
            for (k, &r) in active.iter().enumerate() {
                let slope = self.row_slopes[r * nz + nx + u];
                self.scratch[i * order + n + k] = slope;
                self.scratch[(n + k) * order + i] = slope;
            }
        }
    }

    /// The longest part of a step, at most one, that stays between the bounds, and the bound that ends it.
    fn longest_step(&self, free: &[usize], step: &[f64]) -> (f64, Option<(usize, Place)>) {
        let mut length = 1.0;
        let mut blocking = None;
        for (&u, &d) in free.iter().zip(step) {
            let (b, value) = (self.bounds[u], self.z[self.states + u]);
            let (room, place) =
                if d > 0.0 { (b.upper - value, Place::Upper) } else { (b.lower - value, Place::Lower) };
            if d != 0.0 && room / d < length {
                length = (room / d).max(0.0);
                blocking = Some((u, place));
            }
        }
        (length, blocking)
    }

    /// Releases bounds and rows that push the wrong way and adds rows that are violated; whether anything changed.
    fn change_working_set(&mut self) -> bool {
        let mut changed = false;
        for u in 0..self.controls {
            let slope = self.gradient[self.states + u];
            let wrong = match self.control_places[u] {
                Place::Lower => slope < 0.0,
                Place::Upper => slope > 0.0,
                Place::Inside => false,
            };
            if wrong && self.kinds[u] == ControlKind::Smooth {
                self.control_places[u] = Place::Inside;
                changed = true;
            }
        }
        let bounds: Vec<Bounds> = self.row_bounds().collect();
        for (r, b) in bounds.into_iter().enumerate().filter(|(_, b)| !b.is_fixed()) {
            let value = self.row_values[r];
            let tolerance = ROW_TOLERANCE * value.abs().max(1.0);
            let place = match self.row_places[r] {
                Place::Lower if self.multipliers[r] > 0.0 => Place::Inside,
                Place::Upper if self.multipliers[r] < 0.0 => Place::Inside,
                Place::Inside if value > b.upper + tolerance => Place::Upper,
                Place::Inside if value < b.lower - tolerance => Place::Lower,
                same => same,
            };
            changed |= place != self.row_places[r];
            self.row_places[r] = place;
        }
        changed
    }

    /// The same for one control without path constraints.
    fn differentiate_single_control(&mut self) {
        let (nx, nz) = (self.states, self.inputs());
        let bend = self.curvature[nx * nz + nx];
        let moves =
            self.kinds[0] != ControlKind::Switching && self.control_places[0] == Place::Inside && bend != 0.0;
        let scale = if moves { -1.0 / bend } else { 0.0 };
        for x in 0..nx {
            self.control_slopes[x] = scale * self.curvature[nx * nz + x];
            self.control_slopes[nx + x] = scale * self.rate_slopes[x * nz + nx];
        }
        for p in 0..self.parameters {
            self.control_slopes[2 * nx + p] = scale * self.curvature[nx * nz + nx + 1 + p];
        }
    }

    /// Derivatives of controls and multipliers with respect to `[x, lambda, p]`, from the stationarity of `Hbar`; needs
    /// [`linearise`](Self::linearise) and [`curve`](Self::curve) at the point.
    pub(super) fn differentiate_control(&mut self) {
        let (nx, nu, np, nz) = (self.states, self.controls, self.parameters, self.inputs());
        let columns = 2 * nx + np;
        if nu == 1 && self.row_count == 0 {
            return self.differentiate_single_control();
        }
        let (free, active) = self.working_set();
        let n = free.len();
        self.control_slopes.fill(0.0);
        self.multiplier_slopes.fill(0.0);
        if n == 0 {
            return;
        }
        self.fill_kkt(&free, &active, 0.0);
        for (i, &u) in free.iter().enumerate() {
            let right = &mut self.right[i * columns..(i + 1) * columns];
            for x in 0..nx {
                right[x] = -self.curvature[(nx + u) * nz + x];
                right[nx + x] = -self.rate_slopes[x * nz + nx + u];
            }
            for p in 0..np {
                right[2 * nx + p] = -self.curvature[(nx + u) * nz + nx + nu + p];
            }
        }
        for (k, &r) in active.iter().enumerate() {
            let right = &mut self.right[(n + k) * columns..(n + k + 1) * columns];
            right.fill(0.0);
            for x in 0..nx {
                right[x] = -self.row_slopes[r * nz + x];
            }
            for p in 0..np {
                right[2 * nx + p] = -self.row_slopes[r * nz + nx + nu + p];
            }
        }
        // A singular system is that of a direction without a thrust: it moves nothing.
        if small::solve(n + active.len(), &mut self.scratch, &mut self.right, columns) {
            for (i, &u) in free.iter().enumerate() {
                let row = &self.right[i * columns..(i + 1) * columns];
                self.control_slopes[u * columns..(u + 1) * columns].copy_from_slice(row);
            }
            for (k, &r) in active.iter().enumerate() {
                let row = &self.right[(n + k) * columns..(n + k + 1) * columns];
                self.multiplier_slopes[r * columns..(r + 1) * columns].copy_from_slice(row);
            }
        }
    }
}
