//! Piecewise-constant controls by `apsides-piecewise`.

use std::sync::Arc;

use apsides_ocp::Method;
use apsides_piecewise::{
    Constraints, FreeLengths, Lengths, PiecewiseConstant, PiecewiseSettings, Transcription,
};

use super::{Entry, MethodName, MethodSettings, PosedCase};
use crate::Error;
use crate::key::{Key, Range};
use crate::memory::{Foreseen, of_segments};
use crate::values::Values;

/// Most threads that integrate segments.
const MAX_THREADS: usize = 1024;

const FREE: &str = "free";
const L_EPSILON: &str = "l-epsilon";

pub(super) const ENTRY: Entry = Entry {
    name: MethodName::Piecewise,
    keys: KEYS,
    names: NAMES,
    refuses: None,
    read: |values| Ok(Arc::new(PiecewiseMethod::read(values)?)),
};

const KEYS: &[Key] = &[
    Key::count("piecewise.intervals", 30, 1, 10_000, "segments per phase at the start"),
    Key::choice("piecewise.lengths", &["equal", FREE], "lengths of the segments; free ones are unknowns"),
    Key::number(
        "piecewise.least_length",
        0.05,
        Range::open(0.0, 1.0),
        "least free length relative to that at the start",
    ),
    Key::count("piecewise.starts", 6, 1, 10_000, "starts of free lengths: the equal ones, then random ones"),
    Key::count("piecewise.seed", 1, 0, u32::MAX, "seed of the random lengths"),
    Key::choice(
        "piecewise.constraints",
        &["points", L_EPSILON],
        "how limits along the flight are kept: at points, or as an integral of the smoothed violation",
    ),
    Key::count("piecewise.points", 3, 1, 60, "points of each segment at which limits are kept"),
    Key::number(
        "piecewise.epsilon",
        1e-2,
        Range::open(0.0, 1.0),
        "relative width of the smoothing at the start",
    ),
    Key::number("piecewise.least_epsilon", 1e-4, Range::open(0.0, 1.0), "the same at the end"),
    Key::number(
        "piecewise.tau",
        0.1,
        Range::open(0.0, 1.0),
        "largest integral at the start, relative to `piecewise.epsilon` times the duration",
    ),
    Key::count(
        "piecewise.max_refinements",
        100,
        0,
        999,
        "most divisions of segments until `piecewise.tolerance` is met; 0 switches refinement off",
    ),
    Key::number(
        "piecewise.tolerance",
        5e-7,
        Range::TOLERANCE,
        "what more segments would gain by extrapolation, relative to the objective",
    ),
    Key::count("piecewise.max_intervals", 1000, 1, 100_000, "most segments of all phases after refinement"),
    Key::number("piecewise.nlp_tolerance", 1e-10, Range::TOLERANCE, "scaled optimality error of each solve"),
];

/// Keys of settings, by the names of their fields.
const NAMES: &[(&str, &str)] = &[
    ("intervals", "piecewise.intervals"),
    ("max_intervals", "piecewise.max_intervals"),
    ("points", "piecewise.points"),
    ("tolerance", "piecewise.tolerance"),
    ("max_refinements", "piecewise.max_refinements"),
];

/// Settings of the method.
#[derive(Clone, Debug)]
struct PiecewiseMethod {
    settings: PiecewiseSettings,
}

impl PiecewiseMethod {
    fn read(values: &Values) -> Result<Self, Error> {
        let lengths = if values.word("piecewise.lengths")? == FREE {
            Lengths::Free(FreeLengths {
                least: values.number("piecewise.least_length")?,
                starts: values.count("piecewise.starts")?,
                seed: values.count("piecewise.seed")? as u64,
            })
        } else {
            Lengths::Equal
        };
        let constraints = if values.word("piecewise.constraints")? == L_EPSILON {
            Constraints::LEpsilon(Transcription {
                epsilon: values.number("piecewise.epsilon")?,
                least_epsilon: values.number("piecewise.least_epsilon")?,
                tau: values.number("piecewise.tau")?,
                ..Transcription::default()
            })
        } else {
            Constraints::Points(values.count("piecewise.points")?)
        };
        let mut shooting = PiecewiseSettings::default().shooting;
        shooting.nlp.tolerance = values.number("piecewise.nlp_tolerance")?;
        let settings = PiecewiseSettings {
            intervals: values.count("piecewise.intervals")?,
            lengths,
            constraints,
            tolerance: values.number("piecewise.tolerance")?,
            max_refinements: values.count("piecewise.max_refinements")?,
            max_intervals: values.count("piecewise.max_intervals")?,
            shooting,
        };
        Ok(Self { settings })
    }
}

impl MethodSettings for PiecewiseMethod {
    fn method(&self, case: &PosedCase<'_>) -> Result<Box<dyn Method>, Error> {
        let mut settings = self.settings.clone();
        settings.shooting.threads = case.threads.clamp(1, MAX_THREADS);
        Ok(Box::new(PiecewiseConstant { settings }))
    }

    fn foreseen(&self, case: &PosedCase<'_>) -> Foreseen {
        let intervals = self.settings.intervals;
        Foreseen::new(of_segments(&case.posed.ocp, intervals), &[("piecewise.intervals", intervals)])
    }
}
