//! The way out of a solution that meets the first-order conditions and is no minimum.
//!
//! It is sought once, from the solution that would be returned: coarser discretisations have directions of negative curvature of their
//! own, along which a control oscillates and gains from the error of the rule.

use apsides_nlp::{Counters, Flow, IterationRecord, NlpSettings, Observer, SolveReport, Status};
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory};
use apsides_transcription::Workers;

use crate::RadauError;
use crate::transcription::Transcription;

/// Least gain of the objective, relative to its size where that is above one.
const LEAST_GAIN: f64 = 1e-6;

/// An observer that remembers the last iteration.
pub(crate) struct Watch<'a> {
    inner: &'a mut dyn Observer,
    regularisation: f64,
    iteration: usize,
}

impl<'a> Watch<'a> {
    pub(crate) fn new(inner: &'a mut dyn Observer) -> Self {
        Self { inner, regularisation: 0.0, iteration: 0 }
    }

    /// Returns true if nothing shows that the last point is a minimum: no step, or one that needed regularisation.
    pub(crate) fn is_in_doubt(&self) -> bool {
        self.iteration == 0 || self.regularisation > 0.0
    }
}

impl Observer for Watch<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> Flow {
        (self.regularisation, self.iteration) = (record.regularisation, record.iteration);
        self.inner.iteration(record)
    }
}

/// The solution on the same mesh that a direction of negative curvature leads to, if there is one, and the work it took.
pub(crate) fn beyond_saddle(
    ocp: &Ocp,
    mesh: &Mesh,
    (trajectory, report): (&Trajectory, &SolveReport),
    settings: &NlpSettings,
    workers: &Workers,
    observer: &mut dyn Observer,
) -> Result<(Option<(Trajectory, SolveReport)>, Counters), RadauError> {
    let guess = Guess::earlier(trajectory);
    let mut nlp = Transcription::new(ocp, mesh, &guess)?.with_workers(workers);
    nlp.scale_as_stationary(ocp);
    let found = nlp.solve(ocp, &guess, settings, observer)?;
    let gain = LEAST_GAIN * report.objective.abs().max(1.0);
    let is_better = found.objective < report.objective - gain;
    if !(is_better && matches!(found.status, Status::Optimal | Status::Diverging)) {
        return Ok((None, found.counters));
    }
    let counters = found.counters;
    Ok((Some((nlp.trajectory(ocp, &found)?, found)), counters))
}
