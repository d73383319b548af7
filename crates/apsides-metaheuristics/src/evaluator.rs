//! Results of a generation of points: on several threads, of noisy objectives, with penalties.

use crate::{Constraints, Evaluation, Noise, Objective, Points, SearchError};
use rayon::ThreadPool;
use rayon::prelude::*;

/// Threads that are started when they are first needed.
#[derive(Debug, Default)]
pub(crate) struct Evaluator {
    pool: Option<ThreadPool>,
}

impl Evaluator {
    /// Threads as asked for: 0 is one for each core, 1 is the calling thread.
    pub(crate) fn new(threads: usize) -> Result<Self, SearchError> {
        if threads == 1 {
            return Ok(Self { pool: None });
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        Ok(Self { pool: Some(pool?) })
    }

    /// Results of all points in their order. `first` is the number of the first evaluation.
    pub(crate) fn evaluate<O: Objective + ?Sized>(
        &self,
        objective: &O,
        points: &Points,
        noise: Noise,
        first: u64,
        evaluations: &mut Vec<Evaluation>,
    ) {
        let samples = noise.samples();
        let one = |k: usize, x: &[f64]| {
            let first = first + k as u64 * samples;
            match samples {
                1 => objective.evaluate_sample(x, first),
                _ => Evaluation::mean((first..first + samples).map(|k| objective.evaluate_sample(x, k))),
            }
        };
        evaluations.clear();
        match &self.pool {
            None => evaluations.extend(points.rows().enumerate().map(|(k, x)| one(k, x))),
            Some(pool) => {
                evaluations.resize(points.len(), Evaluation::FAILED);
                let rows = points.values().par_chunks_exact(points.dimension());
                let results = evaluations.par_iter_mut().zip(rows).enumerate();
                pool.install(|| results.for_each(|(k, (result, x))| *result = one(k, x)));
            }
        }
    }
}

/// A result as the algorithm sees it.
pub(crate) fn seen(evaluation: Evaluation, constraints: Constraints) -> Evaluation {
    match constraints {
        Constraints::FeasibilityRules => evaluation,
        Constraints::Penalty { .. } if evaluation.is_failed() => Evaluation::FAILED,
        Constraints::Penalty { weight } => {
            Evaluation::new(evaluation.objective + weight * evaluation.violation.max(0.0))
        }
    }
}
