//! Controls at a kink of the Hamiltonian, such as a thrust of zero that is paid for by its magnitude.
//!
//! A derivative there is that of one side or none. Where the slope is negative on one side and positive on the other the control is as
//! stationary as at a bound that it pushes against from either side: zero is a subgradient (F. H. Clarke, Optimization and Nonsmooth
//! Analysis, SIAM 1990, section 2.3).

use super::PhaseConditions;

/// Steps to both sides, relative to the scale of the control: a kink has the same slopes at both, a smooth minimum has not.
const STEPS: [f64; 2] = [1e-4, 1e-5];
/// Slopes that differ by less than this part of the jump from one side to the other are the same.
const SAME: f64 = 0.1;
/// A jump of the slope, times the scale of the control and relative to the Hamiltonian, that is none is rounding of values at those steps.
const LEAST_JUMP: f64 = 1e-8;

impl PhaseConditions<'_> {
    /// The slopes of the Lagrangian to both sides in a control, where it has a convex kink at the point as it was evaluated.
    pub(crate) fn slopes_at_kink(&mut self, control: usize) -> Option<[f64; 2]> {
        let scale = self.scaling.controls[control];
        let [far, near] = STEPS.map(|step| self.one_sided_slopes(control, step * scale));
        self.equations.set(self.point.time, &self.point.x, &self.point.u);
        let jump = far[1] - far[0];
        let is_same = |side: usize| (far[side] - near[side]).abs() <= SAME * jump;
        let is_jump = jump * scale > LEAST_JUMP * self.hamiltonian_size;
        (is_jump && is_same(0) && is_same(1)).then_some(near)
    }

    fn one_sided_slopes(&mut self, control: usize, step: f64) -> [f64; 2] {
        let mut at = |change: f64| {
            let mut u = self.point.u.clone();
            u[control] += change;
            self.equations.set(self.point.time, &self.point.x, &u);
            let mut rows = vec![0.0; self.point.multipliers.len()];
            self.equations.path(&mut rows);
            let of_rows: f64 = rows.iter().zip(&self.point.multipliers).map(|(c, mu)| mu * c).sum();
            self.equations.hamiltonian(&self.point.costate) + of_rows
        };
        let (below, here, above) = (at(-step), at(0.0), at(step));
        [(here - below) / step, (above - here) / step]
    }
}
