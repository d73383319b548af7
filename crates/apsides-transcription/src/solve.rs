//! The call of the interior-point method, from a guess or from the multipliers of an earlier trajectory.

use apsides_nlp::{
    BarrierOracle, BarrierStrategy, InteriorPoint, NlpError, NlpSettings, Observer, ScalingMethod,
    SolveReport, WarmStart,
};
use apsides_ocp::{Guess, Ocp, PhaseTrajectory};

use crate::discretisation::Discretisation;
use crate::phase::PhaseLayout;
use crate::transcription::Transcription;

/// A fall of the objective, in scales of its quantities and relative to its first value, beyond which nothing bounds it.
const UNBOUNDED: f64 = 1e8;

/// Settings of the interior-point method for a trajectory and a guess of it: the scales of the problem, tolerance 1e-9, and an adaptive barrier
/// from 1e-3, since such a guess is seldom so bad that a larger one pays.
#[must_use]
pub fn trajectory_settings() -> NlpSettings {
    NlpSettings {
        tolerance: 1e-9,
        scaling: ScalingMethod::UserThenGradient { max: 100.0 },
        barrier: BarrierStrategy::Adaptive,
        barrier_oracle: BarrierOracle::Probing,
        initial_barrier: 1e-3,
        initial_bound_multiplier: 1e-3,
        unbounded_objective: UNBOUNDED,
        ..NlpSettings::default()
    }
}

impl<D: Discretisation> Transcription<D> {
    /// Solves from the start, with the multipliers that the guess gives if it is an earlier trajectory with costates.
    ///
    /// # Errors
    /// When the program or the settings are refused; not converging is a status of the report.
    pub fn solve(
        &mut self,
        ocp: &Ocp,
        guess: &Guess,
        settings: &NlpSettings,
        observer: &mut dyn Observer,
    ) -> Result<SolveReport, NlpError> {
        let solver = InteriorPoint::new(settings.clone());
        match self.warm_start(ocp, guess) {
            Some(warm) => solver.solve_from(self, &warm, observer),
            None => solver.solve_observed(self, observer),
        }
    }

    /// The start with the multipliers of an earlier trajectory: none unless every phase of the guess is one with costates.
    ///
    /// The multipliers of the bounds are what the gradient of the Lagrangian leaves at the start.
    pub fn warm_start(&mut self, ocp: &Ocp, guess: &Guess) -> Option<WarmStart> {
        let earlier: Option<Vec<&PhaseTrajectory>> = guess.phases.iter().map(|g| g.as_trajectory()).collect();
        let earlier = earlier?;
        if earlier.iter().any(|t| t.costate.is_none()) {
            return None;
        }
        let x = self.start.clone();
        let mut y = vec![0.0; self.layout.constraints];
        for ((phase, p), t) in ocp.phases.iter().zip(&self.layout.phases).zip(earlier) {
            for (row, &multiplier) in
                p.ends().integral_rows.iter().zip(t.integral_multipliers.iter().flatten())
            {
                if let Some(r) = row {
                    y[*r] = multiplier;
                }
            }
            p.set_multipliers(phase, t, &x, &mut y);
        }
        let multipliers = guess.constraint_multipliers.iter().flatten();
        for ((c, &first), values) in ocp.constraints.iter().zip(&self.layout.endpoint_rows).zip(multipliers) {
            if values.len() == c.rows.len() {
                y[first..first + values.len()].copy_from_slice(values);
            }
        }
        WarmStart::from_multipliers(self, x, y)
    }
}
