//! Solutions: arrays, summary, certificate, report.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use apsides::Outcome;
use apsides::ephemeris::{Ephemeris, Epoch, Format, Sampling, Step};
use apsides::missions::problem::OwnProblem;
use apsides::ocp::{Phase, PhaseTrajectory, Trajectory};
use apsides::pipeline::Pipeline;
use apsides_report::{Presentation, ephemeris_files, replace, write_outcome_with};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{Error, SettingError, refused};
use crate::mission::to_json;

/// The result of a solve.
#[pyclass(frozen, module = "apsides")]
pub(crate) struct Solution {
    pipeline: Pipeline,
    outcome: Arc<Outcome>,
}

impl Solution {
    pub(crate) fn new(pipeline: Pipeline, outcome: Outcome) -> Self {
        Self { pipeline, outcome: Arc::new(outcome) }
    }

    pub(crate) fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    /// The start of a neighbouring case.
    pub(crate) fn start(&self) -> &Trajectory {
        self.outcome.solved().1
    }

    /// Name and size of the unit of a quantity of a phase.
    fn unit(&self, phase: &Phase, name: &str, si: &str) -> (String, f64) {
        let own = self.pipeline.mission_as::<OwnProblem>();
        match own.and_then(|o| o.statement().unit_of(&phase.name, name)) {
            Some(unit) => (unit.name, unit.factor),
            None => (si.to_owned(), 1.0),
        }
    }

    fn time_unit(&self, phase: &Phase) -> (String, f64) {
        let own = self.pipeline.mission_as::<OwnProblem>();
        match own.and_then(|o| o.statement().time_unit(&phase.name)) {
            Some(unit) => (unit.name, unit.factor),
            None => (phase.time_unit.clone(), 1.0),
        }
    }

    /// The flight as an ephemeris.
    fn rows(&self, sampling: Sampling) -> PyResult<Ephemeris> {
        let Outcome { decisions, ocp, trajectory, .. } = &*self.outcome;
        self.pipeline.ephemeris(decisions, ocp, trajectory, sampling).map_err(refused)
    }

    fn phase(&self, index: usize) -> PyResult<(&Phase, &PhaseTrajectory)> {
        let found = self.outcome.ocp.phases.get(index).zip(self.outcome.trajectory.phases.get(index));
        found.ok_or_else(|| Error::new_err(format!("there is no phase {index}")))
    }
}

/// Columns of texts and of numbers, by their headers.
type Rows<V> = (Vec<(String, Vec<String>)>, Vec<(String, V)>);

/// The spacing of rows that Python asks for.
fn sampling(step: Option<&str>, points: Option<u64>) -> PyResult<Sampling> {
    let refused = |reason: String| Err(SettingError::new_err(reason));
    match (step, points) {
        (Some(step), None) => match step.parse::<Step>() {
            Ok(Step(step)) => Ok(Sampling::Step(step)),
            Err(e) => refused(e.to_string()),
        },
        (None, Some(points)) if points >= 2 => Ok(Sampling::Points(points)),
        (None, Some(points)) => refused(format!("{points} points: allowed are at least 2")),
        _ => refused("say how far apart the rows are: step=\"10s\", or points=500".into()),
    }
}

fn texts(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|p| p.display().to_string()).collect()
}

/// Name, unit, sort and values of a quantity at points.
type Column<V> = (String, String, &'static str, V);

#[pymethods]
impl Solution {
    /// The summary of the solve as JSON.
    fn summary(&self) -> PyResult<String> {
        to_json(&self.outcome.summary)
    }

    /// The certificate as JSON.
    fn certificate(&self) -> PyResult<String> {
        to_json(&self.outcome.summary.certificate)
    }

    /// Names of the phases.
    fn phases(&self) -> Vec<&str> {
        self.outcome.ocp.phases.iter().map(|p| p.name.as_str()).collect()
    }

    /// Names and values of the parameters, in their units.
    fn parameters(&self) -> HashMap<String, f64> {
        let own = self.pipeline.mission_as::<OwnProblem>();
        let factor =
            |name: &str| own.and_then(|o| o.statement().parameter_unit(name)).map_or(1.0, |u| u.factor);
        let values = self.outcome.ocp.parameters.iter().zip(&self.outcome.trajectory.parameters);
        values.map(|(p, v)| (p.name.clone(), v / factor(&p.name))).collect()
    }

    /// The objective with all its digits, in its unit.
    fn objective(&self) -> f64 {
        self.outcome.trajectory.objective
    }

    /// Times, states, controls, path constraints and costates of a phase: at the nodes, at so many points, or at given times. Each is a list of
    /// name, unit, sort, values.
    fn columns<'py>(
        &self,
        py: Python<'py>,
        phase: usize,
        count: Option<usize>,
        times: Option<Vec<f64>>,
    ) -> PyResult<Vec<Column<Bound<'py, PyArray1<f64>>>>> {
        let (stated, flight) = self.phase(phase)?;
        let points: Vec<(f64, usize)> = match (count, times) {
            (_, Some(times)) => {
                let (_, factor) = self.time_unit(stated);
                times.iter().map(|t| (t * factor, flight.state.segment_at(t * factor))).collect()
            }
            (Some(count), None) => (0..count)
                .map(|k| flight.time_at(k as f64 / (count - 1).max(1) as f64))
                .map(|t| (t, flight.state.segment_at(t)))
                .collect(),
            (None, None) => flight.nodes().collect(),
        };
        let columns = self.values(stated, flight, &points);
        Ok(columns.into_iter().map(|(n, u, s, v)| (n, u, s, PyArray1::from_vec(py, v))).collect())
    }

    /// The page of the report.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| apsides_report::render_html(&self.outcome, &[]))
            .map_err(|e| Error::new_err(e.to_string()))
    }

    /// Writes the report and its data files into a directory, and returns their paths.
    fn report(&self, py: Python<'_>, directory: &str) -> PyResult<Vec<String>> {
        let found = py.detach(|| {
            let shown = Presentation::of_mission(self.pipeline.title(), &self.pipeline, &self.outcome);
            write_outcome_with(directory.as_ref(), &self.outcome, &shown, Vec::new())
        });
        found.map(|paths| texts(&paths)).map_err(|e| Error::new_err(e.to_string()))
    }

    /// Writes the ephemeris of the flight in some formats into a directory, and returns the paths.
    fn write(
        &self,
        py: Python<'_>,
        directory: &str,
        formats: Vec<String>,
        step: Option<&str>,
        points: Option<u64>,
    ) -> PyResult<Vec<String>> {
        let formats = formats.iter().map(|word| word.parse::<Format>());
        let formats =
            formats.collect::<Result<Vec<_>, _>>().map_err(|e| SettingError::new_err(e.to_string()))?;
        self.pipeline.check_formats(&formats).map_err(refused)?;
        let sampling = sampling(step, points)?;
        py.detach(|| {
            let table = self.rows(sampling)?;
            let files = ephemeris_files(&table, &formats, &Epoch::now());
            let files = files.map_err(|e| Error::new_err(e.to_string()))?;
            let written = replace(directory.as_ref(), &files);
            written.map(|paths| texts(&paths)).map_err(|e| Error::new_err(e.to_string()))
        })
    }

    /// The phases and instants of the rows of an ephemeris, and its columns.
    fn ephemeris<'py>(
        &self,
        py: Python<'py>,
        step: Option<&str>,
        points: Option<u64>,
    ) -> PyResult<Rows<Bound<'py, PyArray1<f64>>>> {
        let sampling = sampling(step, points)?;
        let table = py.detach(|| self.rows(sampling))?;
        let of_rows = |text: &dyn Fn(usize) -> String| (0..table.times.len()).map(text).collect::<Vec<_>>();
        let texts = vec![
            ("phase".to_owned(), of_rows(&|row| table.phase_of(row).to_owned())),
            (table.epoch_header(), of_rows(&|row| table.epoch_of(row).calendar())),
        ];
        let columns = table.columns.into_iter().map(|(column, values)| (column.header(), values));
        let columns = std::iter::once(("time_s".to_owned(), table.times)).chain(columns);
        Ok((texts, columns.map(|(name, values)| (name, PyArray1::from_vec(py, values))).collect()))
    }

    /// The mission file that gives this result again.
    fn mission_file(&self) -> &str {
        &self.outcome.mission_file
    }

    /// Counters of the solve.
    fn counters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (c, found) = (&self.outcome.summary.counters, PyDict::new(py));
        found.set_item("iterations", c.iterations)?;
        found.set_item("factorisations", c.factorisations)?;
        found.set_item("variables", c.variables)?;
        found.set_item("constraints", c.constraints)?;
        found.set_item("mesh_iterations", c.mesh_iterations)?;
        Ok(found)
    }
}

impl Solution {
    fn values(
        &self,
        stated: &Phase,
        flight: &PhaseTrajectory,
        points: &[(f64, usize)],
    ) -> Vec<Column<Vec<f64>>> {
        let (unit, factor) = self.time_unit(stated);
        let mut columns =
            vec![("time".to_owned(), unit, "time", points.iter().map(|(t, _)| t / factor).collect())];
        let (nx, nu) = (stated.states.len(), stated.controls.len());
        let parameters = &self.outcome.trajectory.parameters;
        let (mut x, mut u, mut lambda) = (Vec::new(), Vec::new(), Vec::new());
        for (t, piece) in points {
            let mut row = vec![0.0; nx];
            flight.state.evaluate_in(*piece, *t, &mut row);
            x.push(row);
            let mut row = vec![0.0; nu];
            flight.control.evaluate_in(*piece, *t, &mut row);
            u.push(row);
            if let Some(costate) = &flight.costate {
                let mut row = vec![0.0; nx];
                costate.evaluate_in(*piece, *t, &mut row);
                lambda.push(row);
            }
        }
        let of =
            |rows: &[Vec<f64>], k: usize, factor: f64| rows.iter().map(|r| r[k] / factor).collect::<Vec<_>>();
        for (k, state) in stated.states.iter().enumerate() {
            let v = &state.variable;
            let (unit, factor) = self.unit(stated, &v.name, &v.unit);
            columns.push((v.name.clone(), unit, "state", of(&x, k, factor)));
        }
        for (k, v) in stated.controls.iter().enumerate() {
            let (unit, factor) = self.unit(stated, &v.name, &v.unit);
            columns.push((v.name.clone(), unit, "control", of(&u, k, factor)));
        }
        for path in &stated.path {
            let mut rows = Vec::new();
            for ((t, _), (x, u)) in points.iter().zip(x.iter().zip(&u)) {
                let z: Vec<f64> = x.iter().chain(u).chain(parameters).chain([t]).copied().collect();
                let mut row = vec![0.0; path.function.outputs()];
                path.function.value(&z, &mut row);
                rows.push(row);
            }
            for (k, v) in path.rows.iter().enumerate() {
                let (unit, factor) = self.unit(stated, &v.name, &v.unit);
                columns.push((v.name.clone(), unit, "path", of(&rows, k, factor)));
            }
        }
        if flight.costate.is_some() {
            for (k, state) in stated.states.iter().enumerate() {
                columns.push((state.variable.name.clone(), "SI".into(), "costate", of(&lambda, k, 1.0)));
            }
        }
        columns
    }
}
