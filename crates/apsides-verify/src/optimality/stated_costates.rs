//! Costates that a trajectory states inside of its intervals, held against the costate equation.
//!
//! A certificate needs the costates of a problem, not those of a file: where the ends of an interval agree, those between do not change its
//! verdict. Who vouches for a file looks at each of them.

use apsides_ocp::{Guess, Ocp, Scaling, Trajectory};

use super::costate::Side;
use super::{Among, PhaseConditions, evaluate_piece, phases};
use crate::place::place;
use crate::worst::relative;
use crate::{VerifyError, VerifySettings, shape};

/// The stated costate of a phase that is farthest from the costate equation.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedCostate {
    /// Name of the phase.
    pub phase: String,
    /// The state and the time, in words.
    pub place: String,
    /// Distance from the solution of the costate equation that starts at the stated value before it, relative to the
    /// largest costate of the phase, each times the scale of its state.
    pub miss: f64,
}

/// For each phase with costates and without path constraints, the stated costate inside of an interval that is farthest from the solution of
/// the costate equation through the one before it. Costates of states at their bounds are left out: the multiplier of the
/// bound is not part of a trajectory.
///
/// # Errors
/// [`VerifyError`] when the trajectory does not have the sizes of the problem.
pub fn stated_costates(
    ocp: &Ocp,
    trajectory: &Trajectory,
    settings: &VerifySettings,
) -> Result<Vec<StatedCostate>, VerifyError> {
    let guess = Guess::earlier(trajectory);
    shape::check(ocp, trajectory, &guess)?;
    let scaling = Scaling::new(ocp, &guess);
    let conditions = phases(ocp, trajectory, &scaling, Among::All).unwrap_or_default();
    let of_phase = |mut phase: PhaseConditions<'_>| phase.worst_stated_costate(settings);
    Ok(conditions.into_iter().filter_map(of_phase).collect())
}

impl PhaseConditions<'_> {
    fn worst_stated_costate(&mut self, settings: &VerifySettings) -> Option<StatedCostate> {
        let (nx, phase) = (self.equations.nx, self.equations.phase);
        if phase.path_rows() > 0 {
            return None;
        }
        let mut integrator = self.costate_integrator(settings)?;
        let pieces = self.found.control.segments().len();
        let (mut start, mut reached, mut stated) = (vec![0.0; nx], vec![0.0; nx], vec![0.0; nx]);
        let mut bounds = vec![Side::None; nx];
        let mut worst: Option<StatedCostate> = None;
        for k in 0..pieces {
            self.active_state_bounds(k, settings, &mut bounds);
            let (from, to) = (self.found.control.breaks()[k], self.found.control.breaks()[k + 1]);
            let inner: Vec<f64> = self.found.control.node_times(k).filter(|t| *t > from && *t < to).collect();
            let mut at = from;
            evaluate_piece(self.costate, pieces, k, from, &mut start);
            for time in inner {
                if !self.integrate(&mut integrator, k, [at, time], &start, &bounds, &mut reached) {
                    break;
                }
                evaluate_piece(self.costate, pieces, k, time, &mut stated);
                for i in (0..nx).filter(|i| bounds[*i] == Side::None) {
                    let miss = (reached[i] - stated[i]).abs() * self.scaling.states[i];
                    let miss = relative(miss, self.costate_size);
                    if worst.as_ref().is_none_or(|w| miss > w.miss || miss.is_nan()) {
                        let state = &phase.states[i].variable.name;
                        let place = format!("costate of {state}, {}", place(phase, time));
                        worst = Some(StatedCostate { phase: phase.name.clone(), place, miss });
                    }
                }
                at = time;
                start.copy_from_slice(&stated);
            }
        }
        worst
    }
}
