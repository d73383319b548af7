//! The observer of a solve: progress for a function of Python, and Ctrl-C.

use apsides::nlp::{Flow, IterationRecord, Observer, SearchProgress};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Passes iterations on, and stops at a signal or an exception.
pub(crate) struct Watch {
    callback: Option<Py<PyAny>>,
    /// The exception that ends the solve.
    pub(crate) raised: Option<PyErr>,
    last: Option<std::time::Instant>,
}

/// Signals are looked for no more often than this.
const PAUSE: std::time::Duration = std::time::Duration::from_millis(20);

impl Watch {
    pub(crate) fn new(callback: Option<Py<PyAny>>) -> Self {
        Self { callback, raised: None, last: None }
    }

    fn report(&mut self, entries: &[(&str, f64)]) -> Flow {
        if self.raised.is_some() {
            return Flow::Stop;
        }
        if self.callback.is_none() && self.last.is_some_and(|t| t.elapsed() < PAUSE) {
            return Flow::Continue;
        }
        self.last = Some(std::time::Instant::now());
        let found = Python::attach(|py| -> PyResult<bool> {
            py.check_signals()?;
            let Some(callback) = &self.callback else { return Ok(true) };
            let record = PyDict::new(py);
            for (name, value) in entries {
                record.set_item(name, value)?;
            }
            // A callback that returns False stops the solve.
            let answer = callback.call1(py, (record,))?;
            Ok(!answer.bind(py).is_exact_instance_of::<pyo3::types::PyBool>() || answer.is_truthy(py)?)
        });
        match found {
            Ok(true) => Flow::Continue,
            Ok(false) => Flow::Stop,
            Err(e) => {
                self.raised = Some(e);
                Flow::Stop
            }
        }
    }

    /// The result, unless an exception was raised on the way.
    pub(crate) fn finish<T>(self, found: T) -> PyResult<T> {
        match self.raised {
            Some(e) => Err(e),
            None => Ok(found),
        }
    }
}

impl Observer for Watch {
    fn iteration(&mut self, r: &IterationRecord) -> Flow {
        self.report(&[
            ("iteration", r.iteration as f64),
            ("objective", r.objective),
            ("primal_infeasibility", r.primal_infeasibility),
            ("dual_infeasibility", r.dual_infeasibility),
            ("barrier", r.barrier),
        ])
    }

    fn generation(&mut self, p: &SearchProgress) -> Flow {
        self.report(&[
            ("generation", p.generation as f64),
            ("evaluations", p.evaluations as f64),
            ("best", p.best.unwrap_or(f64::NAN)),
        ])
    }
}
