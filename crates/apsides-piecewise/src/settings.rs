//! Settings of the method.

use apsides_shooting::ShootingError;
use apsides_shooting::direct::MultipleShootingSettings;

/// Lengths of the segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lengths {
    /// Equal.
    Equal,
    /// Unknowns: the time-scaling transform.
    Free(FreeLengths),
}

/// Lengths as unknowns. They have many local optima, so that several starts are tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeLengths {
    /// Least length relative to that at the start, above 0 and below 1; 0.05. A segment that vanishes leaves its control open.
    pub least: f64,
    /// Starts: the solution with equal lengths, then random lengths; 1 to 10000; 6.
    pub starts: usize,
    /// Seed of the random lengths.
    pub seed: u64,
}

impl Default for FreeLengths {
    fn default() -> Self {
        Self { least: 0.05, starts: 6, seed: 1 }
    }
}

/// The treatment of inequalities along a phase: path constraints and bounds on states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraints {
    /// At so many Lobatto points of each segment, both ends included, or its middle; at up to 17 where they are exceeded between.
    Points(usize),
    /// As integrals of `L_eps` (see [`smoothing`](crate::smoothing)).
    LEpsilon(Transcription),
}

/// Parameters of the `L_eps` transcription. All are in units of the scales of the constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transcription {
    /// `eps` of the first pass; 1e-2.
    pub epsilon: f64,
    /// `eps` of the last pass, not above the first; 1e-4.
    pub least_epsilon: f64,
    /// `tau` of the first pass, relative to `eps` times the duration; 0.1. A constraint that is active all along has `1/4`.
    pub tau: f64,
    /// Most refinements of `eps` and `tau` after the first pass, 0 to 999; 39.
    pub max_refinements: usize,
}

impl Default for Transcription {
    fn default() -> Self {
        Self { epsilon: 1e-2, least_epsilon: 1e-4, tau: 0.1, max_refinements: 39 }
    }
}

/// Settings of the method.
#[derive(Clone, Debug)]
pub struct PiecewiseSettings {
    /// Intervals per phase of the first mesh, each with constant controls; 10.
    pub intervals: usize,
    /// Their lengths; equal.
    pub lengths: Lengths,
    /// Inequalities along a phase; at three points of each segment.
    pub constraints: Constraints,
    /// Largest gain that more segments would bring by extrapolation, relative to the objective, which division brings down to this;
    /// 5e-7. It is no condition where segments are not divided.
    pub tolerance: f64,
    /// Most divisions of the first segments; 0, which leaves them as they are.
    pub max_refinements: usize,
    /// Most intervals of all phases after refinement; 1000.
    pub max_intervals: usize,
    /// Integration, program, threads, tolerances between the points. What concerns segments and control points is set by this
    /// method.
    pub shooting: MultipleShootingSettings,
}

impl Default for PiecewiseSettings {
    fn default() -> Self {
        Self {
            intervals: 10,
            lengths: Lengths::Equal,
            constraints: Constraints::Points(3),
            tolerance: 5e-7,
            max_refinements: 0,
            max_intervals: 1000,
            shooting: MultipleShootingSettings::default(),
        }
    }
}

impl PiecewiseSettings {
    pub(crate) fn check(&self) -> Result<(), ShootingError> {
        count("intervals", self.intervals, 1_000_000, "a whole number from 1 to 1000000")?;
        count("max_intervals", self.max_intervals, usize::MAX, "a whole number from 1")?;
        positive("tolerance", self.tolerance)?;
        if let Lengths::Free(free) = self.lengths {
            if !(free.least > 0.0 && free.least < 1.0) {
                let allowed = "above 0 and below 1";
                return Err(ShootingError::Setting { name: "least", value: free.least, allowed });
            }
            count("starts", free.starts, 10_000, "a whole number from 1 to 10000")?;
        }
        match self.constraints {
            Constraints::Points(points) => {
                count("constraints", points, apsides_basis::MAX_POINTS, "a whole number from 1 to 60")
            }
            Constraints::LEpsilon(t) => {
                positive("epsilon", t.epsilon)?;
                positive("least_epsilon", t.least_epsilon)?;
                positive("tau", t.tau)?;
                if t.least_epsilon > t.epsilon {
                    let allowed = "at most `epsilon`";
                    return Err(ShootingError::Setting {
                        name: "least_epsilon",
                        value: t.least_epsilon,
                        allowed,
                    });
                }
                if t.max_refinements > 999 {
                    let (name, value) = ("max_refinements", t.max_refinements as f64);
                    return Err(ShootingError::Setting {
                        name,
                        value,
                        allowed: "a whole number from 0 to 999",
                    });
                }
                Ok(())
            }
        }
    }
}

fn count(name: &'static str, value: usize, most: usize, allowed: &'static str) -> Result<(), ShootingError> {
    if (1..=most).contains(&value) {
        Ok(())
    } else {
        Err(ShootingError::Setting { name, value: value as f64, allowed })
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), ShootingError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(ShootingError::Setting { name, value, allowed: "a positive number" })
    }
}
