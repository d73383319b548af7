//! Pontryagin's conditions by `apsides-shooting`.

use std::sync::Arc;

use apsides_ocp::Method;
use apsides_shooting::indirect::{DirectIndirect, IndirectSettings, IndirectShooting};

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::{Key, Range};
use crate::memory::{Foreseen, of_dense};
use crate::values::Values;

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::Indirect,
    keys: KEYS,
    names: NAMES,
    refuses: None,
    read: |values| Ok(Arc::new(IndirectMethod::read(values)?)),
};

const KEYS: &[Key] = &[
    Key::count("indirect.intervals", 1, 1, 1000, "shooting segments per phase"),
    Key::number("indirect.tolerance", 1e-9, Range::TOLERANCE, "largest scaled correction of a solution"),
    Key::number(
        "indirect.integration_tolerance",
        1e-11,
        Range::TOLERANCE,
        "relative tolerance of the integration",
    ),
];

/// Keys of settings, by the names of their fields.
const NAMES: &[(&str, &str)] = &[("intervals", "indirect.intervals"), ("tolerance", "indirect.tolerance")];

/// Settings of the method.
#[derive(Clone, Debug)]
struct IndirectMethod {
    settings: IndirectSettings,
}

impl IndirectMethod {
    fn read(v: &Values) -> Result<Self, Error> {
        let settings = IndirectSettings {
            intervals: v.count("indirect.intervals")?,
            tolerance: v.number("indirect.tolerance")?,
            integration_tolerance: v.number("indirect.integration_tolerance")?,
            ..IndirectSettings::default()
        };
        Ok(Self { settings })
    }
}

impl MethodSettings for IndirectMethod {
    /// From the costates of a start, or where there are none or they lead nowhere from those of a collocation.
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        let indirect = IndirectShooting {
            settings: IndirectSettings { threads: case.threads, ..self.settings.clone() },
        };
        Ok(Box::new(DirectIndirect { direct: Box::new(case.radau.method()), indirect }))
    }

    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        let intervals = self.settings.intervals;
        Foreseen::new(of_dense(&case.posed.ocp, intervals), &[("indirect.intervals", intervals)])
    }
}
