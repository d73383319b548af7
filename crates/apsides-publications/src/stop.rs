//! The reasons that end the work on a number early.

use apsides_nlp::Status;
use apsides_ocp::Trajectory;

use super::sheet::Sheet;
use crate::change::Change;
use crate::{Error, Observer, Outcome, Pipeline};

/// The reason that ends the work on a number.
pub(super) enum Stop {
    /// The request is ill-posed.
    Refused(Error),
    /// The observer stopped a solve.
    Interrupted,
    /// A solve that did not converge, in words.
    NotSolved(String),
}

impl<E: Into<Error>> From<E> for Stop {
    fn from(e: E) -> Self {
        Self::Refused(e.into())
    }
}

impl Stop {
    /// The result that a publication's computation returns for it.
    pub(super) fn end(self, place: &str) -> Result<bool, Error> {
        match self {
            Self::Interrupted => Ok(false),
            Self::Refused(e) => Err(e),
            Self::NotSolved(reason) => Err(Error::Conflict { place: place.into(), reason }),
        }
    }
}

/// Checks that a method came to its end.
pub(super) fn ended(problem: &str, method: &str, status: Status) -> Result<(), Stop> {
    match status {
        Status::Interrupted => Err(Stop::Interrupted),
        s if s.is_success() => Ok(()),
        s => Err(Stop::NotSolved(format!("{problem}: {method} does not converge: {s}"))),
    }
}

/// A mission by its own method, from its own guess or from a solution.
pub(super) fn solved(
    name: &str,
    changes: &[Change<'_>],
    threads: usize,
    start: Option<&Trajectory>,
    observer: &mut dyn Observer,
) -> Result<(Pipeline, Outcome), Stop> {
    let mission = crate::load(name, changes)?.with_threads(threads);
    let outcome = mission.solve(start, observer)?;
    let changed: Vec<String> = changes.iter().map(ToString::to_string).collect();
    let place = format!("{name} with {}", changed.join(", "));
    ended(&place, &outcome.summary.method, outcome.status)?;
    match outcome.explanation {
        Some(why) => Err(Stop::NotSolved(format!("{place}: {why}"))),
        None => Ok((mission, outcome)),
    }
}

/// The result, or its failure among those of the sheet.
pub(super) fn keep<T>(sheet: &mut Sheet, result: Result<T, Stop>) -> Result<Option<T>, Stop> {
    match result {
        Err(Stop::NotSolved(why)) => {
            sheet.failures.push(why);
            Ok(None)
        }
        other => other.map(Some),
    }
}
