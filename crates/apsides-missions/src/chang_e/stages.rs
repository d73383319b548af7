//! The whole landing: main braking, quick adjustment, coarse avoidance, hover, fine avoidance, slow descent.
//!
//! Attitude: in the main braking the thrust may point anywhere; in the adjustment it tilts from the vertical by a limit at most; from then
//! on the flight is vertical, the thrust upright but for what the rotation of the Moon takes, or, where maps ask for a divert, in the
//! vertical plane through both places with a limited tilt.

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::planar;
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpBuilder, Phase, PhaseGuess, Sense, Term};
use apsides_pipeline::{Error, Posed};
use apsides_terrain::synthetic::Terrain;

use super::guess::Sample;
use super::keys::{COARSE, FINE};
use super::lander::Lander;
use super::landing::{SixStageLanding, StageOrder};
use super::one_plane::PATH;
use super::phases::{ADJUSTMENT, AVOIDANCE, BRAKING, DESCENT, FINE_AVOIDANCE, ends_at};

/// Guessed upward speeds at the end of the adjustment and of the fine avoidance, m/s.
const AFTER_ADJUSTMENT: f64 = -50.0;
pub(super) const AFTER_FINE_AVOIDANCE: f64 = -8.0;

/// The worth of a mass at the gate above or below that of the main braking's own optimum: zero there.
struct OwnOptimum {
    mass: f64,
    weight: f64,
}

impl VectorFunction<1, 1> for OwnOptimum {
    fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
        [(z[0] - self.mass) * self.weight]
    }
}

impl SixStageLanding {
    /// The flight from the perilune to the cut-off of the engine.
    pub(super) fn problem(&self) -> Result<Posed, Error> {
        let lander = &self.lander;
        let mut phases = vec![lander.braking_phase()];
        let mut guesses = vec![lander.steered_guess(&lander.braking_samples())?];
        self.add_descent(&mut phases, &mut guesses)?;
        let names: Vec<String> = phases.iter().map(|p| p.name.clone()).collect();
        let ocp = phases.into_iter().fold(Ocp::builder("landing from the perilune"), OcpBuilder::phase);
        let ocp = names.windows(2).fold(ocp, |ocp, pair| ocp.link(&pair[0], &pair[1]));
        let ocp = lander
            .on_orbital_plane(lander.with_gate_speed(ocp))
            .objective(Sense::Maximize, self.objective_name(), "kg", self.worth())
            .objective_scale(lander.initial_mass)
            .build()?;
        let guess = Guess::from_phases(&ocp, guesses);
        Ok(Posed::new(ocp, guess))
    }

    /// The objective is called what it is.
    fn objective_name(&self) -> &'static str {
        if self.path_weight > 0.0 { "final_mass_less_weighted_path" } else { "final_mass" }
    }

    /// The final mass, less what the path of the adjustment counts as. A main braking that is optimised for itself stays at its optimum: a
    /// lighter lander stops on a shorter path, so that propellant would be burnt in vain before.
    fn worth(&self) -> Vec<Term<'static>> {
        let mut worth = vec![Term::End(At::FinalState(DESCENT, planar::MASS.name), 1.0)];
        if self.path_weight > 0.0 {
            worth.push(Term::Integral(ADJUSTMENT, PATH, -self.path_weight));
            if let Some(optimum) = self.gate_mass.filter(|_| self.order == StageOrder::ByStages) {
                let Lander { gate_speed, descent, .. } = &self.lander;
                // Of the way to a stop, v^2 m / (2 T), by the mass.
                let weight = self.path_weight * gate_speed.powi(2) / (2.0 * descent.engine.thrust);
                let at_gate = [At::FinalState(BRAKING, planar::MASS.name)];
                worth.push(Term::function(at_gate, OwnOptimum { mass: optimum, weight }));
            }
        }
        worth
    }

    /// The flight from the gate to above the site that is aimed at, with the length of its path as an integral, where it counts.
    fn adjustment(&self) -> Phase {
        let lander = &self.lander;
        let phase =
            lander.steered(ADJUSTMENT, self.adjustment_tilt, [self.coarse_radius(), lander.gate_radius]);
        let mut phase = lander.ends_with(lander.ending_at_site(phase), self.adjusted_speed, Some(0.0));
        ends_at(&mut phase, &[(planar::RADIUS, Bounds::fixed(self.coarse_radius()))]);
        if self.path_weight > 0.0 { lander.with_path(phase) } else { phase }
    }

    /// Adds the phases after the main braking.
    fn add_descent(&self, phases: &mut Vec<Phase>, guesses: &mut Vec<PhaseGuess>) -> Result<(), Error> {
        let lander = &self.lander;
        let [_, gate] = lander.braking_samples();
        phases.push(self.adjustment());
        let adjusted = lander.next_sample(gate, self.coarse_radius(), AFTER_ADJUSTMENT);
        let samples = [gate, adjusted];
        let weighted = self.path_weight > 0.0;
        guesses.push(if weighted {
            lander.guess_with_path(samples)?
        } else {
            lander.steered_guess(&samples)?
        });

        let coarse = self.coarse_divert();
        let avoidance = lander.avoidance(AVOIDANCE, &coarse, [self.hover_radius(), self.coarse_radius()]);
        let over_map = (&self.coarse, &COARSE, Terrain::coarse());
        let avoidance = self.above_map(avoidance, over_map, &coarse, lander.body.radius)?;
        phases.push(lander.ends_with(avoidance, Some(0.0), None));
        let mut at = lander.next_sample(adjusted, self.hover_radius(), 0.0);
        guesses.push(lander.avoidance_guess(&coarse, &[adjusted, at], 0.5)?);

        if self.hover_time > 0.0 {
            phases.push(lander.hovering(coarse.to, self.hover_radius(), self.hover_time));
            let velocity_change = self.hover_time * lander.body.surface_gravity();
            let mass = lander.descent.engine.mass_after(at.mass, velocity_change);
            let after = Sample { time: at.time + self.hover_time, mass, ..at };
            guesses.push(lander.vertical_guess(&[at, after], None)?);
            at = after;
        }
        let fine = self.fine_divert();
        let avoidance = lander.avoidance(FINE_AVOIDANCE, &fine, [self.fine_radius(), self.hover_radius()]);
        let over_map = (&self.fine, &FINE, Terrain::fine());
        phases.push(self.above_map(avoidance, over_map, &fine, lander.body.radius + coarse.rise)?);
        let avoided = lander.next_sample(at, self.fine_radius(), AFTER_FINE_AVOIDANCE);
        guesses.push(lander.avoidance_guess(&fine, &[at, avoided], 0.3)?);

        let descent = lander.vertical(DESCENT, fine.to, [self.cutoff_radius(), self.fine_radius()]);
        phases.push(lander.ends_with(descent, Some(0.0), None));
        let end = lander.next_sample(avoided, self.cutoff_radius(), 0.0);
        guesses.push(lander.vertical_guess(&[avoided, end], Some(0.8))?);
        Ok(())
    }
}
