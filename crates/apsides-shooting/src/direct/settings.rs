//! Settings of direct shooting.

use apsides_basis::MAX_POINTS;
use apsides_nlp::NlpSettings;
use apsides_ode::Method;
use apsides_transcription::solve::trajectory_settings;

use crate::error::ShootingError;

/// The ends of the segments of a phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SegmentEnds {
    /// At the fractions of the phase that the mesh has.
    #[default]
    Fixed,
    /// At times that are unknowns, from those of the mesh on.
    Free {
        /// Least length of a segment, relative to that which it has in the mesh; above 0, below 1.
        least_length: f64,
    },
}

/// Settings of the method.
#[derive(Clone, Debug)]
pub struct MultipleShootingSettings {
    /// Intervals per phase of the first mesh, which are the shooting segments; 10. One is single shooting, which refinement keeps.
    pub intervals: usize,
    /// Points of the control polynomial of each segment at the start: 1 is constant, 2 linear and so on, through the Lobatto points
    /// of the segment, or its middle; 4.
    pub points: usize,
    /// Most points of the control polynomial of a phase that began with one segment, which refinement raises; at 1 controls stay
    /// constant and segments are divided instead; 40.
    pub max_points: usize,
    /// Points of each segment at which path constraints and bounds on states hold, Lobatto points of the segment or its middle. Where
    /// nothing is stated, path constraints hold at the control points, bounds on states there where they would be overstepped.
    pub constraint_points: Option<usize>,
    /// The ends of the segments; at the fractions of the mesh.
    pub segment_ends: SegmentEnds,
    /// True if controls are continuous from segment to segment, which needs two control points; false.
    pub continuous_controls: bool,
    /// Runge-Kutta method of the segments; order 8.
    pub method: Method,
    /// Least steps of each segment, for integrands that vary faster than the states; 1.
    pub least_steps: usize,
    /// Largest error of the steps of a segment, relative to the scale of the state; 1e-10.
    pub integration_tolerance: f64,
    /// Largest gain that the estimate expects of richer controls in the whole, relative to the objective, which refinement brings down
    /// to this; 1e-11.
    pub tolerance: f64,
    /// Largest excess between the control points of a bound or of a path constraint, relative to its scale; 5e-7. Excess of bounds on
    /// controls is reduced as far as refinement goes, but no condition of accuracy: next to a jump it stays.
    pub path_tolerance: f64,
    /// Most refinements of the first mesh; 0 switches refinement off; 14.
    pub max_refinements: usize,
    /// Most intervals of all phases; refinement divides none beyond; 2000.
    pub max_intervals: usize,
    /// Threads that integrate the segments, 1 to 1024; the results do not depend on it; 1.
    pub threads: usize,
    /// Settings of the interior-point method; problem scaling, tolerance 1e-9, adaptive barrier from 1e-3.
    pub nlp: NlpSettings,
}

impl Default for MultipleShootingSettings {
    fn default() -> Self {
        Self {
            intervals: 10,
            points: 4,
            max_points: 40,
            constraint_points: None,
            segment_ends: SegmentEnds::Fixed,
            continuous_controls: false,
            method: Method::Dop853,
            least_steps: 1,
            integration_tolerance: 1e-10,
            tolerance: 1e-11,
            path_tolerance: 5e-7,
            max_refinements: 14,
            max_intervals: 2000,
            threads: 1,
            nlp: trajectory_settings(),
        }
    }
}

impl MultipleShootingSettings {
    pub(crate) fn check(&self) -> Result<(), ShootingError> {
        let least_points = if self.continuous_controls { 2 } else { 1 };
        let counts = [
            ("intervals", self.intervals, 1, 1_000_000, "a whole number from 1 to 1000000"),
            (
                "points",
                self.points,
                least_points,
                MAX_POINTS,
                "a whole number from 1, or 2 for continuous controls, to 60",
            ),
            ("max_points", self.max_points, 1, MAX_POINTS, "a whole number from 1 to 60"),
            (
                "constraint_points",
                self.constraint_points.unwrap_or(1),
                1,
                MAX_POINTS,
                "a whole number from 1 to 60",
            ),
            ("least_steps", self.least_steps, 1, 100_000, "a whole number from 1 to 100000"),
            ("max_refinements", self.max_refinements, 0, 999, "a whole number from 0 to 999"),
            ("threads", self.threads, 1, 1024, "a whole number from 1 to 1024"),
        ];
        for (name, value, least, most, allowed) in counts {
            if value < least || value > most {
                return Err(ShootingError::Setting { name, value: value as f64, allowed });
            }
        }
        for (name, value) in [
            ("integration_tolerance", self.integration_tolerance),
            ("tolerance", self.tolerance),
            ("path_tolerance", self.path_tolerance),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ShootingError::Setting { name, value, allowed: "a positive number" });
            }
        }
        if let SegmentEnds::Free { least_length } = self.segment_ends
            && !(least_length > 0.0 && least_length < 1.0)
        {
            let allowed = "above 0 and below 1";
            return Err(ShootingError::Setting { name: "least_length", value: least_length, allowed });
        }
        Ok(())
    }
}
