//! The main braking alone.

use std::f64::consts::PI;

use apsides_dynamics::planar;
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase};
use apsides_pipeline::{Error, Posed};

use super::lander::Lander;
use super::phases::BRAKING;

impl Lander {
    /// The flight from the perilune to the gate, the thrust in any direction.
    pub(super) fn braking_phase(&self) -> Phase {
        let phase = self.steered(BRAKING, PI, [self.gate_radius, self.perilune_radius]);
        let phase = self.ending_at_gate(self.starting_at_perilune(phase));
        phase.final_time(Bounds::new(0.1 * self.expected_braking(), self.longest_burn()))
    }

    /// The flight to the gate, above the site.
    pub(super) fn braking(&self) -> Result<Posed, Error> {
        let phase = self.ending_at_site(self.braking_phase());
        let ocp = self.on_orbital_plane(Ocp::builder("main braking").phase(phase));
        let ocp = self
            .with_gate_speed(ocp)
            .maximize("final_mass", "kg", At::FinalState(BRAKING, planar::MASS.name))
            .objective_scale(self.initial_mass)
            .build()?;
        let guess = Guess::from_phases(&ocp, vec![self.steered_guess(&self.braking_samples())?]);
        Ok(Posed::new(ocp, guess))
    }
}
