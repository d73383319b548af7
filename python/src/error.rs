//! Exceptions, and how errors of the Rust crates become them.

use apsides_problem_file::ProblemError as Mistake;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

create_exception!(
    apsides,
    Error,
    PyValueError,
    "A request that apsides refuses; the message is a sentence that says why."
);
create_exception!(apsides, ProblemError, Error, "A mistake in the statement of a problem.");
create_exception!(
    apsides,
    IncompleteError,
    ProblemError,
    "A problem that is not complete; the message lists all that is missing."
);
create_exception!(
    apsides,
    SettingError,
    Error,
    "A key or a setting that does not exist, or does not take a value."
);
create_exception!(apsides, SolveError, Error, "A method that refuses a problem.");

pub(crate) fn add(m: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = m.py();
    m.add("Error", py.get_type::<Error>())?;
    m.add("ProblemError", py.get_type::<ProblemError>())?;
    m.add("IncompleteError", py.get_type::<IncompleteError>())?;
    m.add("SettingError", py.get_type::<SettingError>())?;
    m.add("SolveError", py.get_type::<SolveError>())
}

/// The refusal of a mission, a key, a method.
pub(crate) fn refused(e: apsides::Error) -> PyErr {
    use apsides::Error as E;
    match e {
        E::UnknownKey { .. } | E::Value { .. } | E::UnknownMission { .. } => {
            SettingError::new_err(e.to_string())
        }
        E::Model { source, place } => match source.downcast::<Mistake>() {
            Ok(mistake) => of_problem(&mistake),
            Err(source) => Error::new_err(format!("{place}{source}")),
        },
        E::Method(_) => SolveError::new_err(e.to_string()),
        E::Problem(_) => ProblemError::new_err(e.to_string()),
        _ => Error::new_err(e.to_string()),
    }
}

/// A mistake in a problem, as Python states problems.
pub(crate) fn of_problem(e: &Mistake) -> PyErr {
    match e {
        Mistake::Missing { file, missing } => {
            let verb = if missing.len() == 1 { "is" } else { "are" };
            let list: String =
                missing.iter().map(|m| format!("\n  - {}", crate::statement::in_python(m))).collect();
            IncompleteError::new_err(format!("{file}: the problem is not complete; missing {verb}:{list}"))
        }
        _ => ProblemError::new_err(e.to_string()),
    }
}
