//! Stationarity in the controls, signs of the path multipliers, and the Hamiltonian along the phase, at the nodes.

use super::{GAUSS, KIND, Node, PhaseConditions, natural_residual};
use crate::place::place;
use crate::worst::{Worst, is_worse, relative};
use crate::{Check, VerifySettings};

impl PhaseConditions<'_> {
    /// `dL/du = 0`, or pushing against a bound or a kink.
    pub(super) fn stationarity(&mut self, settings: &VerifySettings) -> Option<Check> {
        let phase = self.equations.phase;
        let mut worst = Worst::default();
        for k in 0..self.nodes.len() {
            for (j, control) in phase.controls.iter().enumerate() {
                let node = &self.nodes[k];
                let scale = self.scaling.controls[j];
                let slope = relative(node.slope[j] * scale, self.slope_size);
                let mut residual = natural_residual(slope, node.control[j], &control.bounds, scale);
                if residual > settings.stationarity_tolerance {
                    let (segment, time) = (node.segment, node.time);
                    self.evaluate(segment, time);
                    if let Some([left, right]) = self.slopes_at_kink(j) {
                        let outwards = relative(left.max(-right).max(0.0) * scale, self.slope_size);
                        residual = residual.min(outwards);
                    }
                }
                let node = &self.nodes[k];
                let at = || format!("{}, {}", control.name, place(phase, node.time));
                worst.consider(residual, settings.stationarity_tolerance, "-", at);
            }
        }
        let without = phase.path_rows() > 0 && self.found.path_multipliers.is_none();
        let remark = without.then(|| "path multipliers taken as zero, the trajectory has none".to_owned());
        worst.into_check_with(
            format!("stationarity of the Hamiltonian in the controls of {}", phase.name),
            KIND,
            remark,
        )
    }

    /// A path multiplier is zero inside the bounds, positive at the upper, negative at the lower one. That of a row without controls is the second or a
    /// higher derivative of what holds it, by a method, and has the rounding of such: it counts by what it makes of the costates along the
    /// phase, where that is less.
    pub(super) fn path_multipliers(&mut self, settings: &VerifySettings) -> Option<Check> {
        if self.found.path_multipliers.is_none() && self.impulses.is_empty() {
            return None;
        }
        let phase = self.equations.phase;
        let mut worst = Worst::default();
        for (r, row) in phase.path.iter().flat_map(|p| &p.rows).enumerate() {
            let scale = self.row_scales[r];
            let residual = |node: &Node| {
                let slope = relative(-node.multipliers[r] * scale, self.slope_size);
                natural_residual(slope, node.path[r], &row.bounds, scale)
            };
            let residuals: Vec<f64> = self.nodes.iter().map(residual).collect();
            let is_wrong = residuals.iter().any(|v| is_worse(*v, settings.stationarity_tolerance));
            let driven = if is_wrong { self.driven_costates(r, &residuals) } else { None };
            for (node, residual) in self.nodes.iter().zip(&residuals) {
                let residual = driven.map_or(*residual, |driven| residual.min(driven));
                let at = || format!("{}, {}", row.name, place(phase, node.time));
                worst.consider(residual, settings.stationarity_tolerance, "-", at);
            }
        }
        self.consider_signs(&mut worst, settings);
        worst.into_check(format!("signs of the path multipliers of {}", phase.name), KIND)
    }

    /// The change of costates, relative to the largest, along the phase by what the multipliers of a row have of the wrong sign; none where controls
    /// enter the row.
    fn driven_costates(&mut self, row: usize, residuals: &[f64]) -> Option<f64> {
        let (nx, nu) = (self.equations.nx, self.equations.nu);
        let breaks = self.found.control.breaks();
        let mut sum = 0.0;
        let mut gradient = vec![0.0; self.equations.width()];
        for k in 0..self.nodes.len() {
            let (segment, time) = (self.nodes[k].segment, self.nodes[k].time);
            self.evaluate(segment, time);
            self.equations.row_gradient(row, &mut gradient);
            if gradient[nx..nx + nu].iter().any(|g| *g != 0.0) {
                return None;
            }
            let ends = [breaks[segment], breaks[segment + 1]];
            let beside = |other: Option<&Node>, end: f64| {
                other.filter(|n| n.segment == segment).map_or(end, |n| 0.5 * (n.time + time))
            };
            let before = beside(k.checked_sub(1).map(|before| &self.nodes[before]), ends[0]);
            let share = beside(self.nodes.get(k + 1), ends[1]) - before;
            let in_scales = |(g, scale): (&f64, &f64)| (g * scale).abs();
            let slope = gradient[..nx].iter().zip(&self.scaling.states).map(in_scales).fold(0.0, f64::max);
            let multiplier = residuals[k] * self.slope_size / self.row_scales[row];
            sum += relative(multiplier * share * slope, self.costate_size);
        }
        Some(sum)
    }

    /// `dH/dt = partial L/partial t`: deviation from its mean of the Hamiltonian less what explicit time adds to it since the start.
    pub(super) fn hamiltonian(&mut self, settings: &VerifySettings) -> Option<Check> {
        let autonomous = self.equations.is_autonomous() && self.instants.is_empty();
        let added = if autonomous { vec![0.0; self.nodes.len()] } else { self.added_by_time() };
        let rest = |(node, added): (&Node, &f64)| node.hamiltonian - added;
        let mean = self.nodes.iter().zip(&added).map(rest).sum::<f64>() / self.nodes.len() as f64;
        let (mut largest, mut time) = (f64::NEG_INFINITY, 0.0);
        for (node, added) in self.nodes.iter().zip(&added) {
            let deviation = (rest((node, added)) - mean).abs();
            if is_worse(deviation, largest) {
                (largest, time) = (deviation, node.time);
            }
        }
        let value = relative(largest, self.hamiltonian_size);
        let phase = self.equations.phase;
        let law = if autonomous { "constant" } else { "by its explicit time" };
        let name = format!("Hamiltonian {law} along {}", phase.name);
        Some(Check::new(name, KIND, value, settings.hamiltonian_tolerance, "-", place(phase, time)))
    }

    /// Integral of `partial L/partial t` from the start to each node, with what contacts add, and jumps of the equations at a time.
    fn added_by_time(&mut self) -> Vec<f64> {
        let found = self.found;
        let breaks = found.control.breaks();
        let (mut sum, mut at) = (0.0, found.initial_time);
        let mut added = Vec::with_capacity(self.nodes.len());
        for segment in 0..found.control.segments().len() {
            // H(t+) = H(t-) + nu dg/dt.
            for impulse in self.impulses.iter().filter(|i| i.end == segment) {
                sum += impulse.jump.last().copied().unwrap_or(f64::NAN);
            }
            if self.instants.contains(&segment) {
                let before = self.evaluate_within_bounds(segment - 1, breaks[segment]).value;
                sum += self.evaluate_within_bounds(segment, breaks[segment]).value - before;
            }
            for time in found.control.node_times(segment) {
                sum += self.integral_of_time_slope(segment, at, time);
                at = time;
                added.push(sum);
            }
            sum += self.integral_of_time_slope(segment, at, breaks[segment + 1]);
            at = breaks[segment + 1];
        }
        added
    }

    fn integral_of_time_slope(&mut self, segment: usize, a: f64, b: f64) -> f64 {
        let mut sum = 0.0;
        for (abscissa, weight) in GAUSS {
            self.evaluate(segment, a + abscissa * (b - a));
            sum += weight * (b - a) * self.point.gradient.last().copied().unwrap_or(f64::NAN);
        }
        sum
    }

    pub(super) fn mean_hamiltonian(&self) -> f64 {
        self.nodes.iter().map(|n| n.hamiltonian).sum::<f64>() / self.nodes.len() as f64
    }
}
