//! Collocation by `apsides-radau`.

use std::sync::Arc;

use apsides_ocp::{Mesh, Method, Ocp};
use apsides_radau::{Radau, RadauSettings};

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::{Key, Range};
use crate::memory::{Foreseen, of_collocation};
use crate::values::Values;

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::Radau,
    keys: KEYS,
    names: NAMES,
    refuses: None,
    read: |values| Ok(Arc::new(RadauMethod::read(values)?)),
};

const KEYS: &[Key] = &[
    Key::count("radau.intervals", 10, 1, 100_000, "mesh intervals per phase of the first mesh"),
    Key::count("radau.points", 5, 1, 60, "collocation points per interval of the first mesh"),
    Key::number("radau.tolerance", 1e-10, Range::TOLERANCE, "largest relative error between points"),
    Key::count(
        "radau.max_refinements",
        19,
        0,
        999,
        "most refinements of the first mesh; 0 switches refinement off",
    ),
    Key::count(
        "radau.max_total_points",
        3000,
        100,
        1_000_000,
        "most collocation points of all phases; refinement ends there",
    ),
    Key::number(
        "radau.nlp_tolerance",
        1e-10,
        Range::TOLERANCE,
        "scaled optimality error of each solve; a tenth of it where the error between the points hangs above its tolerance",
    ),
];

/// Keys of settings, by the names of their fields.
const NAMES: &[(&str, &str)] = &[
    ("tolerance", "radau.tolerance"),
    ("max_refinements", "radau.max_refinements"),
    ("max_total_points", "radau.max_total_points"),
];

/// Settings of collocation and of its first mesh.
#[derive(Clone, Debug)]
pub struct RadauMethod {
    /// Settings of the method.
    pub settings: RadauSettings,
}

impl RadauMethod {
    pub(super) fn read(v: &Values) -> Result<Self, Error> {
        let mut settings = RadauSettings {
            intervals: v.count("radau.intervals")?,
            points: v.count("radau.points")?,
            tolerance: v.number("radau.tolerance")?,
            max_refinements: v.count("radau.max_refinements")?,
            max_total_points: v.count("radau.max_total_points")?,
            ..RadauSettings::default()
        };
        settings.nlp.tolerance = v.number("radau.nlp_tolerance")?;
        Ok(Self { settings })
    }

    /// The method.
    #[must_use]
    pub fn method(&self) -> Radau {
        Radau { settings: self.settings.clone() }
    }

    /// The memory of a solve on the first mesh.
    pub(super) fn foreseen(&self, ocp: &Ocp) -> Foreseen {
        let RadauSettings { intervals, points, .. } = self.settings;
        let bytes = of_collocation(ocp, intervals, points);
        Foreseen::new(bytes, &[("radau.intervals", intervals), ("radau.points", points)])
    }

    /// The first mesh.
    ///
    /// # Errors
    /// No intervals, or no points in them.
    pub fn first_mesh(&self, ocp: &Ocp) -> Result<Mesh, Error> {
        Ok(self.method().uniform_mesh(ocp)?)
    }
}

impl MethodSettings for RadauMethod {
    /// The one of the case, which knows threads and accuracy of a run.
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        Ok(Box::new(case.radau.method()))
    }

    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        case.radau.foreseen(&case.posed.ocp)
    }
}
