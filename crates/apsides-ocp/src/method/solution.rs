//! The solution that every method returns.

use std::error::Error;
use std::time::Duration;

use apsides_iteration::{SolveReport, Status};

use super::accuracy::Accuracy;
use super::deficiency::Deficiency;
use super::switch::Switch;
use super::warning::Warning;
use crate::{Trajectory, Unmet};

/// A solution by any method, or the best approximation that it reached.
#[derive(Debug)]
pub struct Solution {
    /// States, controls and times; costates where the method yields them.
    pub trajectory: Trajectory,
    /// The end of the solve.
    pub status: Status,
    /// The measures of accuracy that the method looks at, the decisive one first.
    pub accuracy: Vec<Accuracy>,
    /// The reason why a converged solution is not one of the problem, if there is one.
    pub deficiency: Option<Deficiency>,
    /// The work that the solve took.
    pub counters: Counters,
    /// Point and multipliers of the last discretised problem, if the method solves one.
    pub report: Option<SolveReport>,
    /// The constraint that could not be met.
    pub unmet: Option<Unmet>,
    /// Doubts that remain though the solve succeeded.
    pub warnings: Vec<Warning>,
    /// Jumps of controls and path constraints, in order of phase and time.
    pub switches: Vec<Switch>,
    /// The search that came before the solve, if there was one.
    pub search: Option<SearchRecord>,
    /// The method that gave the trajectory, where it is another one than was asked.
    pub instead: Option<&'static str>,
}

impl Solution {
    /// A trajectory and how the solve ended, with nothing else known.
    #[must_use]
    pub fn new(trajectory: Trajectory, status: Status) -> Self {
        Self {
            trajectory,
            status,
            accuracy: Vec::new(),
            deficiency: None,
            counters: Counters::default(),
            report: None,
            unmet: None,
            warnings: Vec::new(),
            switches: Vec::new(),
            search: None,
            instead: None,
        }
    }

    /// Returns true if the trajectory solves the problem to the tolerances asked for.
    #[must_use]
    pub fn is_success(&self) -> bool {
        self.status.is_success() && self.deficiency.is_none()
    }

    /// The word for files and scripts: that of the deficiency of a converged solution, else that of the status.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match &self.deficiency {
            Some(deficiency) if self.status.is_success() => deficiency.word(),
            _ => self.status.word(),
        }
    }
}

/// The work that a solve took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Iterations over all discretised problems.
    pub iterations: usize,
    /// Factorisations over all discretised problems; zero where they are not counted.
    pub factorisations: usize,
    /// Variables of the last discretised problem.
    pub variables: usize,
    /// Constraints of the last discretised problem.
    pub constraints: usize,
    /// Discretised problems solved: the first one and its refinements.
    pub discretisations: usize,
}

impl Counters {
    /// The work of one discretised problem with so many variables and constraints.
    #[must_use]
    pub fn of(variables: usize, constraints: usize, report: &SolveReport) -> Self {
        let done = &report.counters;
        Self {
            iterations: done.iterations,
            factorisations: done.factorisations,
            variables,
            constraints,
            discretisations: 1,
        }
    }

    /// The work of several solves, one after the other: iterations, factorisations and discretisations are added, and sizes are those of
    /// the last one.
    #[must_use]
    pub fn total(solves: impl IntoIterator<Item = Self>) -> Self {
        solves.into_iter().fold(Self::default(), |sum, one| Self {
            iterations: sum.iterations + one.iterations,
            factorisations: sum.factorisations + one.factorisations,
            discretisations: sum.discretisations + one.discretisations,
            ..one
        })
    }
}

/// The reason for which a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SearchEnd {
    /// The population converged, or made no progress.
    Converged,
    /// All evaluations that were allowed are spent.
    Budget,
    /// The time limit was reached.
    TimeLimit,
    /// The observer asked to stop.
    Interrupted,
    /// Every flight failed.
    AllFailed,
}

impl SearchEnd {
    /// The word for files and scripts.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Budget => "budget",
            Self::TimeLimit => "time-limit",
            Self::Interrupted => "interrupted",
            Self::AllFailed => "all-failed",
        }
    }
}

/// A search without derivatives that found the start of a solve.
#[derive(Debug)]
pub struct SearchRecord {
    /// Number of decision variables.
    pub variables: usize,
    /// Flights.
    pub evaluations: usize,
    /// Generations.
    pub generations: usize,
    /// Flights that failed.
    pub failures: usize,
    /// The reason for which it ended.
    pub end: SearchEnd,
    /// Objective of the start that was found, without what misses and excesses cost; none where all flights failed.
    pub objective: Option<f64>,
    /// Distance by which the end of that start misses its target, in the unit of length of the search.
    pub miss: Option<f64>,
    /// Wall-clock time.
    pub time: Duration,
    /// Flights so far, and the best objective with what misses and excesses cost, per generation.
    pub history: Vec<[f64; 2]>,
    /// The search went on, but could not be saved.
    pub not_saved: Option<Box<dyn Error + Send + Sync + 'static>>,
}
