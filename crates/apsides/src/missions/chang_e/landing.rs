//! The whole landing: main braking, quick adjustment, coarse avoidance, hover, fine avoidance, slow descent.
//!
//! Attitude: in the main braking the thrust may point anywhere; in the adjustment it tilts from the vertical by a limit at most; from then
//! on the flight is vertical above the site, the thrust upright but for what the rotation of the Moon takes.

use apsides_dynamics::planar;
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpBuilder, Phase, PhaseGuess};
use apsides_radau::Radau;

use super::guess::Sample;
use super::lander::{Lander, Order};
use super::phases::{ADJUSTMENT, AVOIDANCE, DESCENT, FINE_AVOIDANCE};
use crate::Error;
use crate::missions::Posed;

/// Guessed upward speeds at the end of the adjustment and of the fine avoidance, m/s.
const AFTER_ADJUSTMENT: f64 = -50.0;
const AFTER_FINE_AVOIDANCE: f64 = -8.0;

impl Lander {
    /// From the perilune to the cut-off of the engine.
    pub(super) fn landing(&self) -> Result<Posed, Error> {
        let braking = match self.order {
            Order::Joint => self.braking_phase(),
            Order::Stages => self.as_alone(self.braking_phase())?,
        };
        let mut phases = vec![braking];
        let mut guesses = vec![self.steered_guess(&self.braking_samples())?];
        self.add_descent(&mut phases, &mut guesses)?;
        let names: Vec<String> = phases.iter().map(|p| p.name.clone()).collect();
        let ocp = phases.into_iter().fold(Ocp::builder("landing from the perilune"), OcpBuilder::phase);
        let ocp = names.windows(2).fold(ocp, |ocp, pair| ocp.link(&pair[0], &pair[1]));
        let ocp = match self.order {
            Order::Joint => self.with_gate_speed(ocp),
            // All components are fixed.
            Order::Stages => ocp,
        };
        let ocp = self
            .on_orbital_plane(ocp)
            .maximize("final_mass", "kg", At::FinalState(DESCENT, planar::MASS.name))
            .objective_scale(self.initial_mass)
            .build()?;
        let guess = Guess::from_phases(&ocp, guesses);
        Ok(Posed::new(ocp, guess))
    }

    /// The phases after the main braking.
    fn add_descent(&self, phases: &mut Vec<Phase>, guesses: &mut Vec<PhaseGuess>) -> Result<(), Error> {
        let [_, gate] = self.braking_samples();
        let adjustment =
            self.steered(ADJUSTMENT, self.adjustment_tilt, [self.coarse_radius, self.gate_radius]);
        let mut adjustment = self.ends_with(self.ending_at_site(adjustment), None, Some(0.0));
        adjustment.states[0].terminal = Bounds::fixed(self.coarse_radius);
        phases.push(adjustment);
        let adjusted = self.next_sample(gate, self.coarse_radius, AFTER_ADJUSTMENT);
        guesses.push(self.steered_guess(&[gate, adjusted])?);

        let avoidance = self.vertical(AVOIDANCE, [self.hover_radius, self.coarse_radius]);
        phases.push(self.ends_with(avoidance, Some(0.0), None));
        let mut at = self.next_sample(adjusted, self.hover_radius, 0.0);
        guesses.push(self.vertical_guess(&[adjusted, at], Some(0.5))?);

        if self.hover_time > 0.0 {
            phases.push(self.hovering(self.hover_radius));
            let velocity_change = self.hover_time * self.body.surface_gravity();
            let mass = self.descent.engine.mass_after(at.mass, velocity_change);
            let after = Sample { time: at.time + self.hover_time, mass, ..at };
            guesses.push(self.vertical_guess(&[at, after], None)?);
            at = after;
        }
        phases.push(self.vertical(FINE_AVOIDANCE, [self.fine_radius, self.hover_radius]));
        let fine = self.next_sample(at, self.fine_radius, AFTER_FINE_AVOIDANCE);
        guesses.push(self.vertical_guess(&[at, fine], Some(0.3))?);

        let descent = self.vertical(DESCENT, [self.cutoff_radius, self.fine_radius]);
        phases.push(self.ends_with(descent, Some(0.0), None));
        let end = self.next_sample(fine, self.cutoff_radius, 0.0);
        guesses.push(self.vertical_guess(&[fine, end], Some(0.8))?);
        Ok(())
    }

    /// The main braking with the velocity at the gate of its own optimum: the paper's way, one stage after the other.
    fn as_alone(&self, mut phase: Phase) -> Result<Phase, Error> {
        let posed = self.braking()?;
        let solved = Radau::default().solve(&posed.ocp, &posed.guess)?;
        if !solved.status.is_success() {
            let reason = format!("the main braking alone has no solution: {}", solved.status);
            return Err(Error::Conflict { place: "mission".into(), reason });
        }
        let end = solved.trajectory.phases[0].final_state();
        let (up, across) = self.speeds();
        for (s, value) in phase.states.iter_mut().zip(end) {
            let name = &s.variable.name;
            if *name == up.name || across.iter().any(|q| *name == q.name) {
                s.terminal = Bounds::fixed(value);
            }
        }
        Ok(phase)
    }
}
