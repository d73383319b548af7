//! Pontryagin's conditions by `apsides-shooting`.

use apsides_shooting::indirect::{DirectIndirect, IndirectSettings, IndirectShooting};

use super::radau::RadauMethod;
use crate::Error;
use crate::key::{Key, Range};
use crate::values::Values;

pub(super) const KEYS: &[Key] = &[
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
pub(super) const NAMES: &[(&str, &str)] =
    &[("intervals", "indirect.intervals"), ("tolerance", "indirect.tolerance")];

/// Settings of the method.
#[derive(Clone, Debug)]
pub(super) struct IndirectMethod {
    pub(super) settings: IndirectSettings,
}

impl IndirectMethod {
    pub(super) fn read(v: &Values) -> Result<Self, Error> {
        let settings = IndirectSettings {
            intervals: v.count("indirect.intervals")?,
            tolerance: v.number("indirect.tolerance")?,
            integration_tolerance: v.number("indirect.integration_tolerance")?,
            ..IndirectSettings::default()
        };
        Ok(Self { settings })
    }

    /// The method: from the costates of a start, or where there are none or they lead nowhere from those of a collocation.
    pub(super) fn method(&self, radau: &RadauMethod) -> DirectIndirect {
        let indirect = IndirectShooting { settings: self.settings.clone() };
        DirectIndirect { direct: Box::new(radau.method()), indirect }
    }
}
