//! Settings of a powered descent.

use apsides_conic::ConicSettings;

use super::transition::Hold;
use crate::ConvexError;
use crate::error::require;

/// Convex form of the least thrust.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LowerBound {
    /// Tangent at the reference mass: one row; exact when the reference has settled, below the limit before.
    #[default]
    Tangent,
    /// Second-order expansion of Acikmese and Ploen: a cone; with their reference it holds the limit in the first pass.
    Quadratic,
}

/// The solver of the conic programs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ConeSolver {
    /// `apsides-stage-cone`: factors stage after stage, allocates nothing.
    #[default]
    Stages,
    /// Clarabel, on states eliminated in blocks of intervals.
    Clarabel,
}

/// The choice of the flight time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlightTime {
    /// Given, s.
    Fixed(f64),
    /// Golden section between two times, s, with so many solves; between those of
    /// [`DescentProblem::time_range`](super::DescentProblem::time_range) if none are given.
    GoldenSection {
        /// Interval, s.
        range: Option<[f64; 2]>,
        /// Solves, at least 2; each makes the interval shorter by 0.618.
        solves: usize,
    },
}

/// Settings of a [`DescentSolver`](super::DescentSolver).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DescentSettings {
    /// Intervals of equal length, default 50.
    pub intervals: usize,
    /// Controls over an interval, default linear.
    pub hold: Hold,
    /// Solver of the conic programs.
    pub cone_solver: ConeSolver,
    /// Intervals per block whose states are eliminated for Clarabel, default 5; more than `intervals` eliminates all.
    pub block: usize,
    /// Convex form of the least thrust.
    pub lower_bound: LowerBound,
    /// Flight time, default golden section with 24 solves.
    pub flight_time: FlightTime,
    /// Solves at the final time, each with the masses of the one before as the reference of the thrust bounds, default 3.
    pub mass_passes: usize,
    /// Largest miss on the horizontal plane (m), of height (m) and velocity (m/s) that counts as landed, default 0.01.
    pub miss_tolerance: f64,
    /// Settings of the conic solver; its limit of iterations bounds the time of a solve.
    pub conic: ConicSettings,
}

impl Default for DescentSettings {
    fn default() -> Self {
        Self {
            intervals: 50,
            hold: Hold::First,
            cone_solver: ConeSolver::Stages,
            block: 5,
            lower_bound: LowerBound::Tangent,
            flight_time: FlightTime::GoldenSection { range: None, solves: 24 },
            mass_passes: 3,
            miss_tolerance: 0.01,
            conic: ConicSettings::default(),
        }
    }
}

impl DescentSettings {
    pub(crate) fn check(&self) -> Result<(), ConvexError> {
        let count = |n: usize, what, least: usize, allowed| require(n >= least, what, n as f64, "", allowed);
        count(self.intervals, "number of intervals", 2, "at least 2")?;
        count(self.block, "intervals per block", 1, "at least 1")?;
        count(self.mass_passes, "number of mass passes", 1, "at least 1")?;
        require(self.miss_tolerance > 0.0, "miss tolerance", self.miss_tolerance, "m", "positive")?;
        match self.flight_time {
            FlightTime::Fixed(t) => {
                require(t > 0.0 && t.is_finite(), "flight time", t, "s", "positive and finite")
            }
            FlightTime::GoldenSection { range, solves } => {
                count(solves, "solves of the golden section", 2, "at least 2")?;
                let Some([lower, upper]) = range else { return Ok(()) };
                require(lower > 0.0, "shortest flight time", lower, "s", "positive")?;
                require(upper.is_finite(), "longest flight time", upper, "s", "finite")?;
                if lower < upper {
                    return Ok(());
                }
                let (lower, upper) = (lower.to_string(), upper.to_string());
                Err(ConvexError::Bounds { what: "flight time", lower, upper, unit: "s" })
            }
        }
    }
}
