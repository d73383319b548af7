//! Direct multiple shooting by `apsides-shooting`.

use std::sync::Arc;

use apsides_ocp::Method;
use apsides_shooting::direct::{MultipleShooting, MultipleShootingSettings};

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::{Key, Range};
use crate::memory::{Foreseen, of_shooting};
use crate::values::Values;

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::MultipleShooting,
    keys: KEYS,
    names: NAMES,
    refuses: None,
    read: |values| Ok(Arc::new(MultipleShootingMethod::read(values)?)),
};

/// Most threads that integrate segments.
const MAX_THREADS: usize = 1024;

const KEYS: &[Key] = &[
    Key::count("shooting.intervals", 4, 1, 100_000, "segments per phase at the start; 1 is single shooting"),
    Key::count(
        "shooting.points",
        6,
        1,
        60,
        "points of the control polynomial of each segment at the start; 1 is constant",
    ),
    Key::number(
        "shooting.integration_tolerance",
        1e-10,
        Range::TOLERANCE,
        "largest relative error of the integration of a segment",
    ),
    Key::number("shooting.nlp_tolerance", 1e-10, Range::TOLERANCE, "scaled optimality error of each solve"),
    Key::count(
        "shooting.max_refinements",
        14,
        0,
        999,
        "most refinements of the first division; 0 switches refinement off",
    ),
];

/// Keys of settings, by the names of their fields.
const NAMES: &[(&str, &str)] = &[
    ("integration_tolerance", "shooting.integration_tolerance"),
    ("max_refinements", "shooting.max_refinements"),
];

/// Settings of the method.
#[derive(Clone, Debug)]
struct MultipleShootingMethod {
    settings: MultipleShootingSettings,
}

impl MultipleShootingMethod {
    fn read(v: &Values) -> Result<Self, Error> {
        let mut settings = MultipleShootingSettings {
            intervals: v.count("shooting.intervals")?,
            points: v.count("shooting.points")?,
            integration_tolerance: v.number("shooting.integration_tolerance")?,
            max_refinements: v.count("shooting.max_refinements")?,
            ..MultipleShootingSettings::default()
        };
        settings.nlp.tolerance = v.number("shooting.nlp_tolerance")?;
        Ok(Self { settings })
    }
}

impl MethodSettings for MultipleShootingMethod {
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        let threads = case.threads.clamp(1, MAX_THREADS);
        Ok(Box::new(MultipleShooting {
            settings: MultipleShootingSettings { threads, ..self.settings.clone() },
        }))
    }

    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        let MultipleShootingSettings { intervals, points, .. } = self.settings;
        let bytes = of_shooting(&case.posed.ocp, intervals, points);
        Foreseen::new(bytes, &[("shooting.intervals", intervals), ("shooting.points", points)])
    }
}
