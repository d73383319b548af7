//! Search without derivatives for functions of Python.

use std::ops::ControlFlow;
use std::sync::Mutex;

use apsides::metaheuristics::{
    AnnealingSettings, AntColonySettings, CmaEsSettings, CooperationSettings, DifferentialEvolutionSettings,
    Evaluation, GeneticSettings, IslandsSettings, Method, ParticleSwarmSettings, Search, SearchSpace,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Error, SettingError};

const METHODS: &str = "\"differential-evolution\", \"cma-es\", \"particle-swarm\", \"genetic\", \"ant-colony\", \"annealing\", \"cooperation\" \
                       or \"islands\"";

fn method(word: &str) -> PyResult<Method> {
    Ok(match word {
        "differential-evolution" => Method::DifferentialEvolution(DifferentialEvolutionSettings::default()),
        "cma-es" => Method::CmaEs(CmaEsSettings::default()),
        "particle-swarm" => Method::ParticleSwarm(ParticleSwarmSettings::default()),
        "genetic" => Method::Genetic(GeneticSettings::default()),
        "ant-colony" => Method::AntColony(AntColonySettings::default()),
        "annealing" => Method::SimulatedAnnealing(AnnealingSettings::default()),
        "cooperation" => Method::Cooperation(CooperationSettings::default()),
        "islands" => Method::Islands(IslandsSettings::default()),
        _ => return Err(SettingError::new_err(format!("`method` is \"{word}\", allowed is {METHODS}"))),
    })
}

/// Searches a box for the least value of a function of Python, which returns a number, or a number and violations that are to be at most zero.
#[pyfunction]
pub(crate) fn search<'py>(
    py: Python<'py>,
    function: Py<PyAny>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    word: &str,
    budget: usize,
    seed: u64,
    target: Option<f64>,
    start: Vec<Vec<f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    let refused = |e: apsides::metaheuristics::SearchError| Error::new_err(e.to_string());
    let space = SearchSpace::new(lower, upper).map_err(refused)?;
    // Python's functions run one at a time.
    let search =
        Search { method: method(word)?, seed, budget, target, start, threads: 1, ..Search::default() };
    let raised: Mutex<Option<PyErr>> = Mutex::new(None);
    let keep = |e: PyErr| {
        if let Ok(mut raised) = raised.lock() {
            raised.get_or_insert(e);
        }
    };
    let failed = || raised.lock().is_ok_and(|r| r.is_some());
    let objective = |x: &[f64]| {
        if failed() {
            return Evaluation::FAILED;
        }
        let value = Python::attach(|py| -> PyResult<Evaluation> {
            let found = function.bind(py).call1((PyArray1::from_slice(py, x),))?;
            match found.extract::<(f64, Vec<f64>)>() {
                Ok((objective, violations)) => Ok(Evaluation::constrained(objective, &violations)),
                Err(_) => found.extract::<f64>().map(Evaluation::new).map_err(|_| {
                    let kind = found.get_type().name().map_or_else(|_| String::new(), |n| n.to_string());
                    Error::new_err(format!(
                        "the function returns a value of type {kind}, allowed is a number, or a number and a list of violations"
                    ))
                }),
            }
        });
        value.unwrap_or_else(|e| {
            keep(e);
            Evaluation::FAILED
        })
    };
    let report = py.detach(|| {
        search.minimize_observed(&space, &objective, &mut |_| {
            if let Err(e) = Python::attach(|py| py.check_signals()) {
                keep(e);
            }
            if failed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    });
    if let Some(e) = raised.lock().ok().and_then(|mut r| r.take()) {
        return Err(e);
    }
    let report = report.map_err(refused)?;
    let answer = PyDict::new(py);
    let best = report.best.as_ref();
    answer.set_item("x", best.map(|b| PyArray1::from_slice(py, &b.x)))?;
    answer.set_item("fun", best.map_or(f64::NAN, |b| b.evaluation.objective))?;
    answer.set_item("violation", best.map_or(f64::NAN, |b| b.evaluation.violation))?;
    answer.set_item("feasible", report.feasible().is_some())?;
    answer.set_item("evaluations", report.evaluations)?;
    answer.set_item("generations", report.generations)?;
    answer.set_item("stop", format!("{:?}", report.stop))?;
    Ok(answer)
}
