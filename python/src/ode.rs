//! Integration of traced equations of motion, with events.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::Arc;

use apsides::ad::NodeFunction;
use apsides::ode::{
    DenseSolution, Direction, Event, EventRecord, Integrator, Method, Observer, Occurrence, OdeSettings,
    OdeSystem, Step, Tolerance,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Error, SettingError};
use crate::symbol::Symbol;
use crate::trace::function;

type EventFunction = dyn Fn(f64, &[f64]) -> f64;

/// Inputs `[x, t]`.
struct Traced {
    rate: Arc<dyn NodeFunction>,
    dimension: usize,
    input: RefCell<Vec<f64>>,
}

impl OdeSystem for Traced {
    fn dimension(&self) -> usize {
        self.dimension
    }
    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        let mut z = self.input.borrow_mut();
        z[..x.len()].copy_from_slice(x);
        z[x.len()] = t;
        self.rate.value(&z, dx);
    }
}

/// Keeps dense output and events, and looks for signals.
struct Record {
    dense: DenseSolution,
    events: Vec<EventRecord>,
    raised: Option<PyErr>,
    steps: usize,
}

impl Observer for Record {
    fn step(&mut self, step: &Step<'_>) -> ControlFlow<()> {
        self.steps += 1;
        if self.steps.is_multiple_of(1000)
            && let Err(e) = Python::attach(|py| py.check_signals())
        {
            self.raised = Some(e);
            return ControlFlow::Break(());
        }
        self.dense.step(step)
    }
    fn event(&mut self, found: &Occurrence<'_>) -> ControlFlow<()> {
        let &Occurrence { event, time, state, rising } = found;
        self.events.push(EventRecord { event, time, state: state.to_vec(), rising });
        ControlFlow::Continue(())
    }
}

/// Integrates traced rates; events are `(formula, direction, terminal)`.
#[pyfunction]
pub(crate) fn integrate<'py>(
    py: Python<'py>,
    owner: u64,
    rates: Vec<Symbol>,
    events: Vec<(Symbol, i32, bool)>,
    span: (f64, f64),
    start: Vec<f64>,
    times: Option<Vec<f64>>,
    method: &str,
    tolerances: (f64, f64),
    max_step: f64,
    max_steps: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let n = start.len();
    let refused = |e: apsides::ode::OdeError| Error::new_err(e.to_string());
    let method = match method {
        "dop853" => Method::Dop853,
        "dopri5" => Method::Dopri5,
        other => {
            return Err(SettingError::new_err(format!(
                "`method` is \"{other}\", allowed is \"dop853\" or \"dopri5\""
            )));
        }
    };
    let settings = OdeSettings {
        method,
        relative_tolerance: tolerances.0,
        absolute_tolerance: Tolerance::Scalar(tolerances.1),
        max_step,
        max_steps,
        ..OdeSettings::default()
    };
    let rate = function(owner, n + 1, &rates)?;
    let functions: Vec<_> = events
        .iter()
        .map(|(f, ..)| function(owner, n + 1, std::slice::from_ref(f)))
        .collect::<PyResult<_>>()?;
    let rules: Vec<(i32, bool)> =
        events.iter().map(|(_, direction, terminal)| (*direction, *terminal)).collect();
    let result = py.detach(|| -> PyResult<_> {
        let system = Traced { rate, dimension: n, input: RefCell::new(vec![0.0; n + 1]) };
        let of = |f: &Arc<dyn NodeFunction>| {
            let (f, z) = (Arc::clone(f), RefCell::new(vec![0.0; n + 1]));
            move |t: f64, x: &[f64]| {
                let (mut z, mut out) = (z.borrow_mut(), [0.0]);
                z[..n].copy_from_slice(x);
                z[n] = t;
                f.value(&z, &mut out);
                out[0]
            }
        };
        let functions: Vec<_> = functions.iter().map(of).collect();
        let event = |(f, (direction, terminal)): (_, &(i32, bool))| {
            let event = Event::new(f).directed(match direction {
                1 => Direction::Rising,
                -1 => Direction::Falling,
                _ => Direction::Any,
            });
            if *terminal { event.terminal() } else { event }
        };
        let functions: Vec<&EventFunction> = functions.iter().map(|f| f as _).collect();
        let events: Vec<Event<'_>> = functions.into_iter().zip(&rules).map(event).collect();
        let mut integrator = Integrator::new(n, settings).map_err(refused)?;
        let mut record =
            Record { dense: DenseSolution::new(span.0, &start), events: Vec::new(), raised: None, steps: 0 };
        let mut end = vec![0.0; n];
        let found =
            integrator.integrate_observed(&system, span.0, &start, span.1, &mut end, &events, &mut record);
        let summary = found.map_err(refused)?;
        if let Some(e) = record.raised.take() {
            return Err(e);
        }
        let times = times.unwrap_or_else(|| record.dense.times().to_vec());
        let mut states = vec![f64::NAN; times.len() * n];
        let (low, high) = (span.0.min(summary.time), span.0.max(summary.time));
        for (row, t) in times.iter().enumerate().filter(|(_, t)| (low..=high).contains(*t)) {
            record.dense.evaluate(*t, &mut states[row * n..(row + 1) * n]).map_err(refused)?;
        }
        Ok((summary, end, times, states, record.events))
    });
    let (summary, end, times, states, found) = result?;
    let answer = PyDict::new(py);
    answer.set_item("t", PyArray1::from_vec(py, times))?;
    answer.set_item("states", PyArray1::from_vec(py, states))?;
    answer.set_item("end_time", summary.time)?;
    answer.set_item("end_state", PyArray1::from_vec(py, end))?;
    answer.set_item("status", format!("{:?}", summary.status))?;
    answer.set_item("steps", summary.statistics.accepted)?;
    answer.set_item("evaluations", summary.statistics.evaluations)?;
    let rows: Vec<_> =
        found.into_iter().map(|e| (e.event, e.time, PyArray1::from_vec(py, e.state), e.rising)).collect();
    answer.set_item("events", rows)?;
    Ok(answer)
}
