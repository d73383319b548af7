//! Hazard maps of heights, and landing sites on them.

use apsides::terrain::hazard::{
    HazardMap, HazardOptions, LayerChoice, SiteCriteria, Verdict, hazard_map_with,
};
use apsides::terrain::site::{SiteRequest, choose_sites};
use apsides::terrain::{ElevationMap, Geometry, TerrainError};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::error::Error;
use crate::mission::to_json;

/// Heights and their hazards.
#[pyclass(frozen, module = "apsides")]
pub(crate) struct Hazards {
    map: ElevationMap,
    hazards: HazardMap,
}

fn refused(e: TerrainError) -> PyErr {
    Error::new_err(e.to_string())
}

#[pymethods]
impl Hazards {
    /// Heights (m) of shape (rows, columns), the length of a cell (m), and criteria as JSON.
    #[new]
    fn new(py: Python<'_>, heights: PyReadonlyArray2<'_, f64>, cell: f64, criteria: &str) -> PyResult<Self> {
        let view = heights.as_array();
        let (rows, columns) = view.dim();
        let values: Vec<f64> = view.iter().copied().collect();
        let criteria: SiteCriteria =
            serde_json::from_str(criteria).map_err(|e| Error::new_err(format!("criteria of a site: {e}")))?;
        py.detach(|| {
            let map = ElevationMap::from_heights(Geometry::square(rows, columns, cell)?, &values)?;
            let options = HazardOptions { layers: LayerChoice::All, ..HazardOptions::default() };
            let hazards = hazard_map_with(&map, &criteria, &options)?;
            Ok(Self { map, hazards })
        })
        .map_err(refused)
    }

    fn shape(&self) -> (usize, usize) {
        (self.map.geometry().rows(), self.map.geometry().cols())
    }

    /// Criteria as JSON.
    fn criteria(&self) -> PyResult<String> {
        to_json(self.hazards.criteria())
    }

    /// Names of the layers.
    fn layers(&self) -> Vec<&'static str> {
        self.hazards.layers().map(|(layer, _)| layer.name()).collect()
    }

    /// A layer row by row: rad or m.
    fn layer<'py>(&self, py: Python<'py>, name: &str) -> Option<Bound<'py, PyArray1<f32>>> {
        let found = self.hazards.layers().find(|(layer, _)| layer.name() == name);
        found.map(|(_, raster)| PyArray1::from_slice(py, raster.data()))
    }

    /// Distance to the nearest pixel that is not safe, m, row by row.
    fn clearance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, self.hazards.clearance().data())
    }

    /// 1 safe, 0 unsafe, -1 unknown, row by row.
    fn verdict<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i8>> {
        let code = |v: &Verdict| match v {
            Verdict::Safe => 1,
            Verdict::Unsafe(_) => 0,
            Verdict::Unknown => -1,
        };
        PyArray1::from_vec(py, self.hazards.verdict().data().iter().map(code).collect())
    }

    /// The best sites of a request as JSON, as JSON.
    fn sites(&self, py: Python<'_>, request: &str) -> PyResult<String> {
        let request: SiteRequest =
            serde_json::from_str(request).map_err(|e| Error::new_err(format!("a request for sites: {e}")))?;
        let found = py.detach(|| choose_sites(&self.map, &self.hazards, &request)).map_err(refused)?;
        to_json(&found.sites)
    }
}

/// Known criteria by their name, as JSON.
#[pyfunction]
pub(crate) fn known_criteria(name: &str) -> PyResult<String> {
    let found = SiteCriteria::preset(name).ok_or_else(|| {
        let known: Vec<&str> = SiteCriteria::presets().collect();
        Error::new_err(format!("no criteria are named \"{name}\"; there are {}", known.join(", ")))
    });
    to_json(&found?)
}
