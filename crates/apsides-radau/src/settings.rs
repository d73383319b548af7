//! Settings of the method.

use apsides_basis::MAX_POINTS;
use apsides_nlp::{BarrierStrategy, NlpSettings};
use apsides_transcription::solve::trajectory_settings;

use crate::RadauError;

/// Settings of the method.
#[derive(Clone, Debug)]
pub struct RadauSettings {
    /// Intervals per phase of the first mesh; 10.
    pub intervals: usize,
    /// Collocation points per interval of the first mesh; 4.
    pub points: usize,
    /// Largest relative error between the points, which refinement brings down to this; 1e-8.
    pub tolerance: f64,
    /// Largest excess between the points of a bound on a state or of a path constraint without controls, relative to its
    /// scale; 5e-7. Bounds on controls are not looked at: next to a jump a polynomial oversteps them on any mesh.
    pub path_tolerance: f64,
    /// Largest error of the costates over an interval, relative to the largest costate, both in the scales of their states. Meshes for the sake
    /// of the states are made for the costates, too, unless arcs lie along bounds of rows; where the states are accurate, up to three more are made as long as they help. Infinity
    /// switches it off; 2e-6, a fifth of what certificates allow.
    pub costate_tolerance: f64,
    /// True if switches of controls and path constraints between their bounds are looked for after each mesh. The next one has
    /// breaks there, whose times are unknowns, and holds along each arc what is active there, so that jumps are met
    /// exactly. So are contacts, where a path constraint without controls touches its bound in one instant; on.
    pub switches: bool,
    /// Most refinements of the first mesh; 0 switches refinement off; 19.
    pub max_refinements: usize,
    /// Guesses bent to either side ([`Guess::bent`](apsides_ocp::Guess::bent)) from which a solve begins anew where its first meshes do not come to
    /// carry the flight that it follows; 0 switches them off; 3.
    pub bent_starts: usize,
    /// Points of an interval that comes from a division; 3.
    pub min_points: usize,
    /// Most points per interval before it is divided; 14.
    pub max_points: usize,
    /// Most parts an interval is divided into at once; 4.
    pub max_parts: usize,
    /// Most collocation points of all phases; refinement stops there; 20000.
    pub max_total_points: usize,
    /// Threads that evaluate the nodes of long phases, 1 to 1024; the results do not depend on it; 1.
    pub threads: usize,
    /// Settings of the interior-point method; problem scaling, tolerance 1e-9, adaptive barrier from 1e-3: a guess of a
    /// trajectory is seldom so bad that a larger one pays; the last solution is left if it is a saddle. Where the error of meshes hangs
    /// close above [`tolerance`](Self::tolerance), they are solved to a tenth of the tolerance given here.
    pub nlp: NlpSettings,
}

impl Default for RadauSettings {
    fn default() -> Self {
        Self {
            intervals: 10,
            points: 4,
            tolerance: 1e-8,
            path_tolerance: 5e-7,
            costate_tolerance: 2e-6,
            switches: true,
            max_refinements: 19,
            bent_starts: 3,
            min_points: 3,
            max_points: 14,
            max_parts: 4,
            max_total_points: 20_000,
            threads: 1,
            nlp: NlpSettings { max_saddle_escapes: 3, polish: POLISH, ..trajectory_settings() },
        }
    }
}

/// Part of the bounds up to which a solution is made exact on any mesh: what lies along bounds as an arc leaves its exact set to the mesh.
const POLISH: f64 = 0.05;

/// Barrier parameter, multipliers of bounds and largest violation of a second solve from a guess from which the first one went astray.
const CAREFUL_BARRIER: f64 = 0.1;
const CAREFUL_MULTIPLIER: f64 = 1.0;
const CAREFUL_VIOLATION: f64 = 1.0;

impl RadauSettings {
    /// The settings with short steps from a guess: where constraints alone bend the problem, such as a length that bounds an area, small
    /// multipliers make steps that leave the guess far behind.
    pub(crate) fn careful(&self) -> Self {
        let nlp = NlpSettings {
            barrier: BarrierStrategy::Monotone,
            initial_barrier: CAREFUL_BARRIER,
            initial_bound_multiplier: CAREFUL_MULTIPLIER,
            largest_violation: CAREFUL_VIOLATION,
            ..self.nlp.clone()
        };
        Self { nlp, ..self.clone() }
    }

    pub(crate) fn check(&self) -> Result<(), RadauError> {
        let counts = [
            ("intervals", self.intervals, 1, 1_000_000),
            ("points", self.points, 1, MAX_POINTS),
            ("max_refinements", self.max_refinements, 0, 999),
            ("bent_starts", self.bent_starts, 0, 999),
            ("min_points", self.min_points, 1, self.max_points.min(MAX_POINTS)),
            ("max_points", self.max_points, 1, MAX_POINTS),
            ("max_parts", self.max_parts, 2, 1000),
            ("threads", self.threads, 1, 1024),
        ];
        for (name, value, least, most) in counts {
            if value < least || value > most {
                let allowed = "a whole number from 1 (parts: 2, refinements, bent starts: 0) to 60 points, 999 refinements and bent starts, 1000 parts, 1024 threads or 1000000 intervals";
                return Err(RadauError::Setting { name, value: value as f64, allowed });
            }
        }
        for (name, value) in [("tolerance", self.tolerance), ("path_tolerance", self.path_tolerance)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(RadauError::Setting { name, value, allowed: "a positive number" });
            }
        }
        let value = self.costate_tolerance;
        if value.is_nan() || value <= 0.0 {
            let allowed = "a positive number or infinity";
            return Err(RadauError::Setting { name: "costate_tolerance", value, allowed });
        }
        Ok(())
    }
}
