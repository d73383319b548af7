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

/// For each phase with costates, the stated costate inside of an interval that is farthest from the solution of the costate equation through the
/// one before it while that solution comes to the one behind it, with the stated multipliers of the path constraints. Intervals in which a state
/// is at its bound are left out: the multiplier of the bound is not part of a trajectory.
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

/// A costate stands out if it is missed by this factor more than the one behind it is when the flight goes past it. Where all are missed alike, as beside a
/// singular slope, that is the error of the mesh, which the certificate holds against the whole interval.
const OUTSTANDING: f64 = 10.0;

impl PhaseConditions<'_> {
    fn worst_stated_costate(&mut self, settings: &VerifySettings) -> Option<StatedCostate> {
        let (nx, phase) = (self.equations.nx, self.equations.phase);
        let mut integrator = self.costate_integrator(settings)?;
        let pieces = self.found.control.segments().len();
        let [mut start, mut reached, mut further, mut stated, mut after] =
            std::array::from_fn(|_| vec![0.0; nx]);
        let mut bounds = vec![Side::None; nx];
        let mut worst: Option<StatedCostate> = None;
        for k in 0..pieces {
            self.active_state_bounds(k, settings, &mut bounds);
            // What the bound of one state adds to its costate comes into the others.
            if bounds.iter().any(|b| *b != Side::None) {
                continue;
            }
            let (from, to) = (self.found.control.breaks()[k], self.found.control.breaks()[k + 1]);
            let inner = self.found.control.node_times(k).filter(|t| *t > from && *t < to);
            let times: Vec<f64> = std::iter::once(from).chain(inner).chain([to]).collect();
            for around in times.windows(3) {
                let &[before, time, next] = around else { continue };
                evaluate_piece(self.costate, pieces, k, before, &mut start);
                evaluate_piece(self.costate, pieces, k, time, &mut stated);
                evaluate_piece(self.costate, pieces, k, next, &mut after);
                if !self.integrate(&mut integrator, k, [before, time], &start, &bounds, &mut reached)
                    || !self.integrate(&mut integrator, k, [time, next], &reached, &bounds, &mut further)
                {
                    break;
                }
                for i in 0..nx {
                    let distance =
                        |a: f64, b: f64| relative((a - b).abs() * self.scaling.states[i], self.costate_size);
                    let (miss, beyond) = (distance(reached[i], stated[i]), distance(further[i], after[i]));
                    let stands_out = miss.is_nan() || miss > OUTSTANDING * beyond;
                    if stands_out && worst.as_ref().is_none_or(|w| miss > w.miss || miss.is_nan()) {
                        let state = &phase.states[i].variable.name;
                        let place = format!("costate of {state}, {}", place(phase, time));
                        worst = Some(StatedCostate { phase: phase.name.clone(), place, miss });
                    }
                }
            }
        }
        worst
    }
}
