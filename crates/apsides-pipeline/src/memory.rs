//! The memory that a solve takes, foreseen from the size of its first discretisation.
//!
//! The formulas are fits to measured peaks, from small problems to gigabytes, rounded up; most of it is the factor of the linear systems, in
//! which each interval is a dense block.

use apsides_ocp::{Ocp, Phase};

use crate::Error;

/// Bytes in a gibibyte.
const GIBIBYTE: f64 = (1_u64 << 30) as f64;

/// The foreseen memory of a solve, and what to lower for less.
#[derive(Clone, Debug, PartialEq)]
pub struct Foreseen {
    /// Bytes.
    pub bytes: f64,
    /// The setting that it grows with, with its value.
    pub cause: String,
}

/// Memory of a solve beside that of its discretisation, bytes.
const BESIDE: f64 = 3e7;

/// Rows of path constraints of a phase, as the number of variables that take as much.
fn rows(phase: &Phase) -> f64 {
    phase.path.len() as f64 / 3.0
}

/// States and controls of a phase.
fn width(phase: &Phase) -> f64 {
    (phase.states.len() + phase.controls.len()) as f64
}

/// The sum over the phases of a problem.
fn over_phases(ocp: &Ocp, bytes: impl Fn(&Phase) -> f64) -> f64 {
    BESIDE + ocp.phases.iter().map(bytes).sum::<f64>()
}

/// Collocation: a block of all points of an interval, and the derivatives at each point.
pub(crate) fn of_collocation(ocp: &Ocp, intervals: usize, points: usize) -> f64 {
    let (intervals, points) = (intervals as f64, points as f64);
    let block = |phase: &Phase| (points * (width(phase) + rows(phase))).powi(2) * (130.0 + 1.5 * points);
    over_phases(ocp, |phase| intervals * block(phase))
}

/// Multiple shooting: a block of the states and control points of a segment, and the flight through it.
#[cfg(feature = "multiple-shooting")]
pub(crate) fn of_shooting(ocp: &Ocp, intervals: usize, points: usize) -> f64 {
    let points = points as f64;
    let segment = |phase: &Phase| {
        let controls = points * (phase.controls.len() as f64 + rows(phase));
        1.2e3 * controls.powi(2) + 2.2e3 * width(phase) * controls + 1e3 * width(phase).powi(2)
    };
    over_phases(ocp, |phase| intervals as f64 * segment(phase))
}

/// Constant controls on segments, which are joined to their neighbours alone.
#[cfg(feature = "piecewise")]
pub(crate) fn of_segments(ocp: &Ocp, intervals: usize) -> f64 {
    over_phases(ocp, |phase| intervals as f64 * 2e3 * width(phase).powi(2))
}

/// Cone programs over intervals, which are joined to their neighbours alone.
#[cfg(feature = "successive-convexification")]
pub(crate) fn of_cones(ocp: &Ocp, intervals: usize) -> f64 {
    over_phases(ocp, |phase| intervals as f64 * 1e3 * width(phase).powi(2))
}

/// Segments whose systems are dense.
#[cfg(any(feature = "flatness", feature = "indirect"))]
pub(crate) fn of_dense(ocp: &Ocp, intervals: usize) -> f64 {
    over_phases(ocp, |phase| (intervals as f64).powi(2) * 50.0 * width(phase).powi(2))
}

impl Foreseen {
    /// Memory that grows with settings, by their keys and values.
    pub(crate) fn new(bytes: f64, settings: &[(&str, usize)]) -> Self {
        let settings: Vec<_> = settings.iter().map(|(key, value)| format!("`{key}` = {value}")).collect();
        Self { bytes, cause: settings.join(", ") }
    }

    /// Refuses what takes more than the memory there is for it.
    ///
    /// # Errors
    /// The sentence says how much it takes, how much is allowed, and what to change.
    pub fn within(&self, most: u64) -> Result<(), Error> {
        if self.bytes <= most as f64 {
            return Ok(());
        }
        let [takes, allowed] = [self.bytes, most as f64].map(|bytes| bytes / GIBIBYTE);
        let reason = format!(
            "{}: this takes about {takes:.3} GiB, {allowed:.3} GiB are allowed: lower it, or allow more (`--memory` in MiB)",
            self.cause
        );
        Err(Error::Conflict { place: "memory".into(), reason })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_is_too_much_says_how_much_and_what_to_change() {
        let foreseen = Foreseen::new(3.0 * GIBIBYTE, &[("radau.intervals", 1000), ("radau.points", 60)]);
        foreseen.within(3 << 30).unwrap();
        assert_eq!(
            foreseen.within(1 << 30).unwrap_err().to_string(),
            "memory: `radau.intervals` = 1000, `radau.points` = 60: this takes about 3.000 GiB, 1.000 GiB are allowed: \
             lower it, or allow more (`--memory` in MiB)"
        );
    }
}
