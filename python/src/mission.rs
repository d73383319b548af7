//! Missions: their keys, solves, certificates, prices, sweeps.

use apsides::pipeline::Pipeline;
use apsides::pipeline::key::{KeyKind, Value};
use apsides::verify::Certificate;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};

use crate::error::{Error, SettingError, refused};
use crate::solution::Solution;
use crate::watch::Watch;

/// A mission that was read, or a problem that was stated, with the values of its keys and the settings of its method.
#[pyclass(frozen, module = "apsides")]
pub(crate) struct Mission {
    pipeline: Pipeline,
}

impl Mission {
    pub(crate) fn new(pipeline: Pipeline) -> Self {
        Self { pipeline }
    }
}

/// Reads a mission from a file, or by its name from those that come with the package.
#[pyfunction]
pub(crate) fn load(py: Python<'_>, file_or_name: &str) -> PyResult<Mission> {
    py.detach(|| apsides::load(file_or_name, &[])).map(Mission::new).map_err(refused)
}

/// Name and title of each mission that comes with the package.
#[pyfunction]
pub(crate) fn missions() -> Vec<(&'static str, &'static str)> {
    apsides::registry().files().collect()
}

/// A value of Python for a key.
fn value(pipeline: &Pipeline, path: &str, given: &Bound<'_, PyAny>) -> PyResult<Value> {
    if given.is_exact_instance_of::<PyBool>() {
        return Ok(Value::Flag(given.extract()?));
    }
    if let Ok(word) = given.extract::<String>() {
        return Ok(Value::Word(word));
    }
    if let Ok(number) = given.extract::<f64>() {
        return Ok(Value::Number(number));
    }
    let allowed = pipeline
        .keys()
        .find(|k| k.path == path)
        .map_or_else(String::new, |k| format!(", allowed is {}", k.allowed()));
    let found = given.get_type().name().map_or_else(|_| "an object".into(), |n| n.to_string());
    Err(SettingError::new_err(format!("`{path}` is of type {found}{allowed}")))
}

/// The path of a setting: a key as it is, or a setting of the method by its last word.
fn path(pipeline: &Pipeline, method: &str, name: &str) -> String {
    let declared = |path: &str| pipeline.keys().any(|k| k.path == path);
    let constant = format!("constants.{name}");
    let of_method = format!("{}.{name}", method.replace('-', "_"));
    let dotted = name.replacen("__", ".", 1);
    // A constant of the problem comes before a setting of the same name, which has a path of its own.
    [name.to_owned(), constant, of_method].into_iter().find(|p| declared(p)).unwrap_or(dotted)
}

#[pymethods]
impl Mission {
    /// Name of the mission.
    #[getter]
    fn name(&self) -> &str {
        self.pipeline.name()
    }

    /// Its purpose, in one line.
    #[getter]
    fn title(&self) -> &str {
        self.pipeline.title()
    }

    /// The mission file with every value written out.
    fn to_file(&self) -> String {
        self.pipeline.to_file()
    }

    /// Every key: path, value, unit, meaning, what is allowed.
    fn keys<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let key = |k: &apsides::pipeline::key::Key| {
            let found = PyDict::new(py);
            found.set_item("key", &*k.path)?;
            match (self.pipeline.values().get(&k.path), &k.kind) {
                (Some(Value::Number(v)), KeyKind::Count(..)) => found.set_item("value", *v as i64)?,
                (Some(Value::Number(v)), _) => found.set_item("value", *v)?,
                (Some(Value::Word(w)), _) => found.set_item("value", w)?,
                (Some(Value::Flag(v)), _) => found.set_item("value", *v)?,
                _ => found.set_item("value", py.None())?,
            }
            found.set_item("unit", &*k.unit())?;
            found.set_item("meaning", &*k.meaning)?;
            found.set_item("allowed", k.allowed())?;
            Ok(found)
        };
        self.pipeline.keys().map(key).collect()
    }

    /// The same mission with other values of keys and settings.
    fn having(&self, py: Python<'_>, settings: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut pipeline = self.pipeline.clone();
        let method = match settings.get_item("method")? {
            Some(method) => {
                method.extract::<String>().map_err(|_| PyTypeError::new_err("`method` is a word"))?
            }
            None => pipeline.methods().name.word().to_owned(),
        };
        for (name, given) in settings {
            let name: String = name.extract()?;
            let path = path(&pipeline, &method, &name);
            let value = value(&pipeline, &path, &given)?;
            pipeline = py.detach(|| pipeline.with(&path, value)).map_err(refused)?;
        }
        Ok(Self { pipeline })
    }

    /// Solves the mission and verifies the answer.
    fn solve(
        &self,
        py: Python<'_>,
        start: Option<&Solution>,
        callback: Option<Py<PyAny>>,
        threads: usize,
        seed: u64,
    ) -> PyResult<Solution> {
        if !(1..=1024).contains(&threads) {
            return Err(SettingError::new_err(format!(
                "`threads` is {threads}, allowed is a whole number from 1 to 1024"
            )));
        }
        let mut watch = Watch::new(callback);
        let pipeline = self.pipeline.clone().with_threads(threads).with_seed(seed);
        let found = py.detach(|| {
            let start = start.map(Solution::start);
            pipeline.solve(start, &mut watch)
        });
        let outcome = watch.finish(found)?.map_err(refused)?;
        Ok(Solution::new(pipeline, outcome))
    }

    /// The certificate of a solution under this mission, as JSON.
    fn verify(&self, py: Python<'_>, solution: &Solution) -> PyResult<String> {
        let found = py.detach(|| self.pipeline.verify(&solution.outcome().trajectory));
        found.map_err(refused).and_then(|c| to_json(&c))
    }

    /// The certificate of the trajectory of a file: `trajectory.csv` of a result directory, or samples of another program. JSON.
    fn certify(&self, py: Python<'_>, directory: &str) -> PyResult<String> {
        let found = py.detach(|| -> Result<Certificate, PyErr> {
            let posed = self.pipeline.pose().map_err(refused)?;
            let trajectory = apsides_report::read_outcome_trajectory(directory.as_ref(), posed.flight());
            let trajectory = trajectory.map_err(|e| Error::new_err(e.to_string()))?;
            self.pipeline.verify(&trajectory).map_err(refused)
        });
        found.and_then(|c| to_json(&c))
    }

    /// Derivatives of the objective and of the results with respect to keys, as JSON; of all keys that have a price where none are named.
    fn sensitivities(
        &self,
        py: Python<'_>,
        solution: &Solution,
        keys: Option<Vec<String>>,
    ) -> PyResult<String> {
        let method = self.pipeline.methods().name.word();
        let keys: Vec<String> = match keys {
            Some(keys) => keys.iter().map(|k| path(&self.pipeline, method, k)).collect(),
            None => self.pipeline.priced_keys().map(|k| k.path.to_string()).collect(),
        };
        let found = py.detach(|| {
            let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
            self.pipeline.sensitivities(solution.outcome(), &keys)
        });
        found.map_err(refused).and_then(|prices| to_json(&prices))
    }
}

pub(crate) fn to_json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| Error::new_err(e.to_string()))
}
