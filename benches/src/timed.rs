//! One nonlinear program solved again and again, for a stable time.

use apsides::nlp::{InteriorPoint, Nlp, SolveReport, Status};
use serde::Serialize;

use crate::CpuTime;
use crate::landing::Failure;

/// Result of all repetitions. Times are ms of CPU time, one entry per repetition.
#[derive(Debug, Serialize)]
pub struct Timed {
    /// Variables.
    pub variables: usize,
    /// Constraints.
    pub constraints: usize,
    /// `optimal`, `acceptable`, or what went wrong.
    pub status: String,
    /// Objective at the end.
    pub objective: f64,
    /// Interior-point iterations.
    pub iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// Set-up of the program.
    pub setup_ms: Vec<f64>,
    /// Solve, analysis of the linear systems included.
    pub solve_ms: Vec<f64>,
    /// Part of a solve that functions and derivatives take, wall clock; the least of all repetitions.
    pub evaluation_ms: f64,
}

impl Timed {
    /// Sets up and solves until `milliseconds` are spent on solving, once at least.
    ///
    /// # Errors
    /// When the program cannot be set up or is malformed.
    pub fn run<P: Nlp>(
        solver: &InteriorPoint,
        milliseconds: f64,
        mut pose: impl FnMut() -> Result<P, Failure>,
    ) -> Result<Self, Failure> {
        let (mut setup_ms, mut solve_ms) = (Vec::new(), Vec::new());
        let mut evaluation_ms = f64::INFINITY;
        loop {
            let clock = CpuTime::start();
            let mut nlp = pose()?;
            setup_ms.push(clock.milliseconds());
            let clock = CpuTime::start();
            let report = solver.solve(&mut nlp)?;
            solve_ms.push(clock.milliseconds());
            evaluation_ms = evaluation_ms.min(report.timing.evaluation.as_secs_f64() * 1e3);
            if solve_ms.iter().sum::<f64>() >= milliseconds {
                return Ok(Self {
                    variables: nlp.variables(),
                    constraints: nlp.constraints(),
                    status: status(&report),
                    objective: report.objective,
                    iterations: report.counters.iterations,
                    factorisations: report.counters.factorisations,
                    setup_ms,
                    solve_ms,
                    evaluation_ms,
                });
            }
        }
    }
}

/// `optimal`, `acceptable`, or what went wrong.
#[must_use]
pub fn status(report: &SolveReport) -> String {
    match report.status {
        Status::Optimal => "optimal".into(),
        Status::Acceptable => "acceptable".into(),
        other => other.to_string(),
    }
}
