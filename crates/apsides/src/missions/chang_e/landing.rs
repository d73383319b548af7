//! The whole landing: main braking, quick adjustment, coarse avoidance, hover, fine avoidance, slow descent.
//!
//! Attitude: in the main braking the thrust may point anywhere; in the adjustment it tilts from the vertical by a limit at most; from then
//! on the flight is vertical, the thrust upright but for what the rotation of the Moon takes, or, where maps ask for a divert, in the
//! vertical plane through both places with a limited tilt.

use apsides_dynamics::planar;
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpBuilder, Phase, PhaseGuess, Sense, Term};

use super::guess::Sample;
use super::lander::Lander;
use super::phases::{ADJUSTMENT, AVOIDANCE, DESCENT, FINE_AVOIDANCE, PATH};
use crate::Error;
use crate::missions::Posed;

/// Guessed upward speeds at the end of the adjustment and of the fine avoidance, m/s.
const AFTER_ADJUSTMENT: f64 = -50.0;
pub(super) const AFTER_FINE_AVOIDANCE: f64 = -8.0;

impl Lander {
    /// From the perilune to the cut-off of the engine.
    pub(super) fn landing(&self) -> Result<Posed, Error> {
        let mut phases = vec![self.braking_phase()];
        let mut guesses = vec![self.steered_guess(&self.braking_samples())?];
        self.add_descent(&mut phases, &mut guesses)?;
        let names: Vec<String> = phases.iter().map(|p| p.name.clone()).collect();
        let ocp = phases.into_iter().fold(Ocp::builder("landing from the perilune"), OcpBuilder::phase);
        let ocp = names.windows(2).fold(ocp, |ocp, pair| ocp.link(&pair[0], &pair[1]));
        let ocp = self
            .on_orbital_plane(self.with_gate_speed(ocp))
            .objective(Sense::Maximize, "final_mass", "kg", self.worth())
            .objective_scale(self.initial_mass)
            .build()?;
        let guess = Guess::from_phases(&ocp, guesses);
        Ok(Posed::new(ocp, guess))
    }

    /// The final mass, less what the path of the adjustment counts as.
    fn worth(&self) -> impl Iterator<Item = Term<'static>> {
        let path = (self.path_weight > 0.0).then_some(Term::Integral(ADJUSTMENT, PATH, -self.path_weight));
        [Term::End(At::FinalState(DESCENT, planar::MASS.name), 1.0)].into_iter().chain(path)
    }

    /// The phases after the main braking.
    fn add_descent(&self, phases: &mut Vec<Phase>, guesses: &mut Vec<PhaseGuess>) -> Result<(), Error> {
        let [_, gate] = self.braking_samples();
        let adjustment =
            self.steered(ADJUSTMENT, self.adjustment_tilt, [self.coarse_radius, self.gate_radius]);
        let mut adjustment = self.ends_with(self.ending_at_site(adjustment), self.adjusted_speed, Some(0.0));
        adjustment.states[0].terminal = Bounds::fixed(self.coarse_radius);
        phases.push(self.with_path(adjustment));
        let adjusted = self.next_sample(gate, self.coarse_radius, AFTER_ADJUSTMENT);
        guesses.push(self.steered_guess(&[gate, adjusted])?);

        let coarse = &self.coarse_divert;
        let avoidance = self.avoidance(AVOIDANCE, coarse, [self.hover_radius, self.coarse_radius]);
        phases.push(self.ends_with(avoidance, Some(0.0), None));
        let mut at = self.next_sample(adjusted, self.hover_radius, 0.0);
        guesses.push(self.avoidance_guess(coarse, &[adjusted, at], 0.5)?);

        if self.hover_time > 0.0 {
            phases.push(self.hovering(coarse.to, self.hover_radius));
            let velocity_change = self.hover_time * self.body.surface_gravity();
            let mass = self.descent.engine.mass_after(at.mass, velocity_change);
            let after = Sample { time: at.time + self.hover_time, mass, ..at };
            guesses.push(self.vertical_guess(&[at, after], None)?);
            at = after;
        }
        phases.push(self.avoidance(FINE_AVOIDANCE, &self.fine_divert, [self.fine_radius, self.hover_radius]));
        let fine = self.next_sample(at, self.fine_radius, AFTER_FINE_AVOIDANCE);
        guesses.push(self.avoidance_guess(&self.fine_divert, &[at, fine], 0.3)?);

        let descent = self.vertical(DESCENT, self.fine_divert.to, [self.cutoff_radius, self.fine_radius]);
        phases.push(self.ends_with(descent, Some(0.0), None));
        let end = self.next_sample(fine, self.cutoff_radius, 0.0);
        guesses.push(self.vertical_guess(&[fine, end], Some(0.8))?);
        Ok(())
    }
}
