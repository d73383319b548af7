//! Successive convexification by `apsides-convex`.

use std::sync::Arc;

use apsides_convex::{SuccessiveConvexification, SuccessiveSettings};
use apsides_ocp::Method;

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::{Key, Range};
use crate::memory::{Foreseen, of_cones};
use crate::values::Values;

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::SuccessiveConvexification,
    keys: KEYS,
    names: NAMES,
    refuses: None,
    read: |values| Ok(Arc::new(ConvexificationMethod::read(values)?)),
};

const KEYS: &[Key] = &[
    Key::count(
        "convexification.intervals",
        40,
        1,
        10_000,
        "equal intervals per phase, controls linear on each",
    ),
    Key::count("convexification.max_iterations", 100, 1, 100_000, "most convex programs"),
    Key::number(
        "convexification.tolerance",
        1e-7,
        Range::TOLERANCE,
        "gain promised by the convex model at which the method ends, relative to the objective",
    ),
    Key::number(
        "convexification.feasibility_tolerance",
        1e-6,
        Range::TOLERANCE,
        "largest violation of equations of motion and constraints, relative to their scales",
    ),
];

/// Keys of settings, by the names of their fields.
const NAMES: &[(&str, &str)] = &[
    ("intervals", "convexification.intervals"),
    ("max_iterations", "convexification.max_iterations"),
    ("tolerance", "convexification.tolerance"),
    ("feasibility_tolerance", "convexification.feasibility_tolerance"),
];

/// Settings of the method.
#[derive(Clone, Debug)]
struct ConvexificationMethod {
    settings: SuccessiveSettings,
}

impl ConvexificationMethod {
    fn read(v: &Values) -> Result<Self, Error> {
        let settings = SuccessiveSettings {
            intervals: v.count("convexification.intervals")?,
            max_iterations: v.count("convexification.max_iterations")?,
            tolerance: v.number("convexification.tolerance")?,
            feasibility_tolerance: v.number("convexification.feasibility_tolerance")?,
            ..SuccessiveSettings::default()
        };
        Ok(Self { settings })
    }
}

impl MethodSettings for ConvexificationMethod {
    /// Refuses a path constraint that is an equality, which controls cannot keep between the nodes.
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        for phase in &case.posed.ocp.phases {
            let mut rows = phase.path.iter().flat_map(|path| &path.rows);
            if let Some(row) = rows.find(|row| row.bounds.is_fixed()) {
                return Err(Error::in_mission(format!(
                    "`method` is \"successive-convexification\", whose controls are linear between the nodes: they cannot keep the \
                     equality `{}` of phase `{}` there; choose `method` = \"radau\"",
                    row.name, phase.name
                )));
            }
        }
        Ok(Box::new(SuccessiveConvexification { settings: self.settings }))
    }

    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        let intervals = self.settings.intervals;
        Foreseen::new(of_cones(&case.posed.ocp, intervals), &[("convexification.intervals", intervals)])
    }
}
