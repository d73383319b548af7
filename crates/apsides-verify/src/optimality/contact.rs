//! Contacts: instants at which a path constraint row `g` without controls touches its bound.
//!
//! ```text
//! lambda(t-) = lambda(t+) + nu dg/dx,   H(t-) = H(t+) - nu dg/dt,   nu zero inside the bounds,   g' = 0 on both sides
//! ```
//!
//! A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975, sections 3.7 and 3.11; R. F. Hartl, S. P. Sethi, R. G. Vickson, SIAM
//! Review 37 (1995) 181, doi 10.1137/1037043. The second condition and the last one follow from each other where the control is
//! continuous.

use apsides_ocp::{Bounds, Contact, Variable};

use super::{KIND, PhaseConditions, natural_residual};
use crate::place::place;
use crate::worst::{Worst, relative};
use crate::{Check, VerifySettings};

/// Jumps of the costates at a contact; NaN all over where the trajectory states one that cannot be.
pub(super) struct Impulse {
    /// Interval of the control that starts at the contact.
    pub(super) end: usize,
    pub(super) time: f64,
    row: usize,
    multiplier: f64,
    /// Value of the row at the contact.
    value: f64,
    /// Multiplier times the gradient of the row with respect to `[x, u, p, t]`.
    pub(super) jump: Vec<f64>,
    /// Rate of the row on both sides, the one of larger magnitude.
    rate: f64,
    /// `H(t-) - H(t+) + nu dg/dt`.
    hamiltonian_miss: f64,
}

impl PhaseConditions<'_> {
    /// The impulses of the trajectory's contacts.
    pub(super) fn find_impulses(&mut self) {
        self.impulses = self.found.contacts.iter().map(|c| self.impulse(c)).collect();
    }

    fn impulse(&mut self, contact: &Contact) -> Impulse {
        let &Contact { end, row, multiplier } = contact;
        let (nx, time) = (self.equations.nx, self.found.contact_time(contact));
        let mut impulse = Impulse {
            end,
            time,
            row,
            multiplier,
            value: f64::NAN,
            jump: vec![f64::NAN; self.point.gradient.len()],
            rate: f64::NAN,
            hamiltonian_miss: f64::NAN,
        };
        let intervals = self.found.control.segments().len();
        if !(1..intervals).contains(&end) || !self.equations.is_free_of_controls(row) {
            return impulse;
        }
        let mut rates = vec![0.0; nx + self.equations.phase.integrals.len()];
        let mut sides = [(0.0, 0.0); 2];
        for (side, segment) in sides.iter_mut().zip([end - 1, end]) {
            let h = self.evaluate_within_bounds(segment, time);
            impulse.value = self.equations.row_gradient(row, &mut impulse.jump);
            self.equations.rates(&mut rates);
            let by_time = impulse.jump.last().copied().unwrap_or(f64::NAN);
            let by_state: f64 = impulse.jump[..nx].iter().zip(&rates).map(|(g, f)| g * f).sum();
            *side = (h.value, by_state + by_time);
        }
        let [(h_before, before), (h_after, after)] = sides;
        impulse.rate = if after.abs() < before.abs() { before } else { after };
        impulse.jump.iter_mut().for_each(|g| *g *= multiplier);
        impulse.hamiltonian_miss = h_before - h_after + impulse.jump.last().copied().unwrap_or(f64::NAN);
        impulse
    }

    /// Adds the jump of the costates at the start of an interval of the control, going back in time.
    pub(super) fn add_jump(&self, interval: usize, costate: &mut [f64]) {
        for impulse in self.impulses.iter().filter(|i| i.end == interval) {
            for (lambda, jump) in costate.iter_mut().zip(&impulse.jump) {
                *lambda += jump;
            }
        }
    }

    /// Row and scale of an impulse; none where the problem has no such row.
    fn touched(&self, impulse: &Impulse) -> Option<(&Variable, f64)> {
        let row = self.equations.phase.path.iter().flat_map(|p| &p.rows).nth(impulse.row)?;
        Some((row, self.row_scales[impulse.row]))
    }

    /// The multiplier of a contact times the scale of its row, relative to the largest costate.
    fn size(&self, impulse: &Impulse, scale: f64) -> f64 {
        relative(impulse.multiplier * scale, self.costate_size)
    }

    /// Signs of the multipliers, which are zero inside the bounds.
    pub(super) fn consider_signs(&self, worst: &mut Worst, settings: &VerifySettings) {
        for impulse in &self.impulses {
            let touched = self.touched(impulse);
            let residual = touched.map_or(f64::NAN, |(row, scale)| {
                natural_residual(-self.size(impulse, scale), impulse.value, &row.bounds, scale)
            });
            worst.consider(residual, settings.path_tolerance, "-", || self.place_of(impulse));
        }
    }

    /// The row has an extremum where it touches its bound: its rate vanishes, or the multiplier does.
    pub(super) fn contact_rates(&self, settings: &VerifySettings) -> Option<Check> {
        let duration = self.found.final_time - self.found.initial_time;
        let mut worst = Worst::default();
        for impulse in &self.impulses {
            let residual = self.touched(impulse).map_or(f64::NAN, |(_, scale)| {
                // As a multiplier that is zero away from the bound: the distance is that of the rate from zero.
                let rate = Bounds::at_least(0.0);
                natural_residual(
                    self.size(impulse, scale).abs(),
                    (impulse.rate * duration).abs(),
                    &rate,
                    scale,
                )
            });
            worst.consider(residual, settings.contact_tolerance, "-", || self.place_of(impulse));
        }
        worst.into_check(
            format!("rates of the path constraints at contacts of {}", self.equations.phase.name),
            KIND,
        )
    }

    /// The Hamiltonian across each contact.
    pub(super) fn contact_hamiltonian(&self, settings: &VerifySettings) -> Option<Check> {
        let mut worst = Worst::default();
        for impulse in &self.impulses {
            let residual = relative(impulse.hamiltonian_miss.abs(), self.hamiltonian_size);
            worst.consider(residual, settings.hamiltonian_tolerance, "-", || self.place_of(impulse));
        }
        worst.into_check(format!("Hamiltonian across contacts of {}", self.equations.phase.name), KIND)
    }

    fn place_of(&self, impulse: &Impulse) -> String {
        let name = self.touched(impulse).map_or("a row that does not exist", |(row, _)| row.name.as_str());
        format!("contact of {name}, {}", place(self.equations.phase, impulse.time))
    }
}
