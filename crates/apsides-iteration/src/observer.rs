//! Watching and interrupting a solve.

/// One line of the iteration log.
///
/// The fields are those of an interior-point method. Another method fills those that have a meaning for it and leaves the others at zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IterationRecord {
    /// Iteration number from zero, those of the restoration phase included.
    pub iteration: usize,
    /// True for an iteration of the restoration phase.
    pub restoration: bool,
    /// Objective in the user's units; in the restoration phase that of the restoration problem.
    pub objective: f64,
    /// Largest constraint violation, scaled.
    pub primal_infeasibility: f64,
    /// Largest entry of the gradient of the Lagrangian, scaled.
    pub dual_infeasibility: f64,
    /// Barrier parameter.
    pub barrier: f64,
    /// Largest entry of the last search direction, scaled.
    pub step_norm: f64,
    /// Primal regularisation of the last linear system; zero if none was needed.
    pub regularisation: f64,
    /// Step length of the bound multipliers.
    pub dual_step: f64,
    /// Step length of the variables.
    pub primal_step: f64,
    /// Trial points of the last line search.
    pub line_search_trials: usize,
    /// Kind of the last step: `f` objective, `h` constraint violation, capitals after a second-order correction, `w`
    /// watchdog, `t` tiny, `s` soft restoration, `R` restoration, `-` none.
    pub step_kind: char,
}

impl Default for IterationRecord {
    /// Iteration zero, with all figures zero and no step.
    fn default() -> Self {
        Self {
            iteration: 0,
            restoration: false,
            objective: 0.0,
            primal_infeasibility: 0.0,
            dual_infeasibility: 0.0,
            barrier: 0.0,
            step_norm: 0.0,
            regularisation: 0.0,
            dual_step: 0.0,
            primal_step: 0.0,
            line_search_trials: 0,
            step_kind: '-',
        }
    }
}

/// The answer of an observer: continue or stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// The solve continues.
    Continue,
    /// The solve stops; its status becomes [`Status::Interrupted`](crate::Status::Interrupted).
    Stop,
}

/// A search without derivatives after one of its generations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchProgress {
    /// Generations so far.
    pub generation: usize,
    /// Evaluations so far.
    pub evaluations: usize,
    /// Most evaluations.
    pub budget: usize,
    /// Objective of the best candidate, with what its violations cost; none where all evaluations failed.
    pub best: Option<f64>,
    /// Extent of the population as a part of the box.
    pub spread: f64,
}

/// Receives a record at every iteration of a solve, the starting point included, and at every generation of a search. The observer `()`
/// ignores them, and a function of a record receives those of iterations.
pub trait Observer {
    /// Called once per iteration.
    fn iteration(&mut self, record: &IterationRecord) -> Flow;

    /// Called once per generation. [`Flow::Stop`] ends the search; a solve that follows goes on from the best candidate found.
    fn generation(&mut self, _progress: &SearchProgress) -> Flow {
        Flow::Continue
    }
}

impl Observer for () {
    fn iteration(&mut self, _record: &IterationRecord) -> Flow {
        Flow::Continue
    }
}

impl<F: FnMut(&IterationRecord) -> Flow> Observer for F {
    fn iteration(&mut self, record: &IterationRecord) -> Flow {
        self(record)
    }
}
