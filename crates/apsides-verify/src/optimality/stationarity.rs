//! Stationarity in the controls, signs of the path multipliers, and constancy of the Hamiltonian, at the nodes.

use super::{KIND, PhaseConditions, natural_residual};
use crate::boundary::row_scale;
use crate::place::place;
use crate::worst::{Worst, is_worse, relative};
use crate::{Check, VerifySettings};

impl PhaseConditions<'_> {
    /// `dL/du = 0`, or pushing against a bound.
    pub(super) fn stationarity(&self, settings: &VerifySettings) -> Option<Check> {
        let phase = self.equations.phase;
        let mut worst = Worst::default();
        for node in &self.nodes {
            for (j, control) in phase.controls.iter().enumerate() {
                let scale = self.scaling.controls[j];
                let slope = relative(node.slope[j] * scale, self.hamiltonian_size);
                let residual = natural_residual(slope, node.control[j], &control.bounds, scale);
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

    /// A path multiplier is zero inside the bounds, positive at the upper, negative at the lower one.
    pub(super) fn path_multipliers(&self, settings: &VerifySettings) -> Option<Check> {
        if self.found.path_multipliers.is_none() && self.impulses.is_empty() {
            return None;
        }
        let phase = self.equations.phase;
        let mut worst = Worst::default();
        for (r, row) in phase.path.iter().flat_map(|p| &p.rows).enumerate() {
            let largest = self.nodes.iter().fold(0.0, |m: f64, n| m.max(n.path[r].abs()));
            let scale = row_scale(row, largest);
            for node in &self.nodes {
                let slope = relative(-node.multipliers[r] * scale, self.hamiltonian_size);
                let residual = natural_residual(slope, node.path[r], &row.bounds, scale);
                let at = || format!("{}, {}", row.name, place(phase, node.time));
                worst.consider(residual, settings.stationarity_tolerance, "-", at);
            }
        }
        self.consider_signs(&mut worst, settings);
        worst.into_check(format!("signs of the path multipliers of {}", phase.name), KIND)
    }

    /// Deviation of the Hamiltonian from its mean, in phases without explicit time.
    pub(super) fn hamiltonian(&self, settings: &VerifySettings) -> Option<Check> {
        if !self.equations.is_autonomous() {
            return None;
        }
        let phase = self.equations.phase;
        let mean = self.mean_hamiltonian();
        let (mut largest, mut time) = (f64::NEG_INFINITY, 0.0);
        for node in &self.nodes {
            let deviation = (node.hamiltonian - mean).abs();
            if is_worse(deviation, largest) {
                (largest, time) = (deviation, node.time);
            }
        }
        let value = relative(largest, self.hamiltonian_size);
        let name = format!("Hamiltonian constant along {}", phase.name);
        Some(Check::new(name, KIND, value, settings.hamiltonian_tolerance, "-", place(phase, time)))
    }

    pub(super) fn mean_hamiltonian(&self) -> f64 {
        self.nodes.iter().map(|n| n.hamiltonian).sum::<f64>() / self.nodes.len() as f64
    }
}
