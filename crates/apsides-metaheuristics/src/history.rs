//! The course of a search, for plots.

use serde::{Deserialize, Serialize};

/// Points that are kept at most; at this number every second one is dropped.
const CAPACITY: usize = 2048;

/// The state after one generation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HistoryPoint {
    /// Generations so far.
    pub generation: usize,
    /// Evaluations so far.
    pub evaluations: usize,
    /// Objective of the best point so far.
    pub objective: f64,
    /// Its violation, 0 where it is feasible.
    pub violation: f64,
    /// Extent of the population as a part of the box.
    pub spread: f64,
}

/// A course that is thinned out as it grows, so that a long search needs no more memory than a short one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct History {
    stride: usize,
    seen: usize,
    points: Vec<HistoryPoint>,
}

impl History {
    pub(crate) fn new() -> Self {
        Self { stride: 1, seen: 0, points: Vec::with_capacity(CAPACITY) }
    }

    /// Counts a generation, and keeps its point where it is a multiple of the stride.
    pub(crate) fn push(&mut self, point: impl FnOnce() -> HistoryPoint) {
        if self.points.len() == CAPACITY {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
        if self.seen.is_multiple_of(self.stride) {
            self.points.push(point());
        }
        self.seen += 1;
    }

    /// The points in order, the newest one last, kept or not.
    pub(crate) fn with_last(&self, last: Option<HistoryPoint>) -> Vec<HistoryPoint> {
        let kept = self.points.last().map(|p| p.generation);
        self.points.iter().copied().chain(last.filter(|p| Some(p.generation) != kept)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_course_keeps_its_ends_and_even_steps() {
        let mut history = History::new();
        let point = |generation| HistoryPoint {
            generation,
            evaluations: generation,
            objective: 0.0,
            violation: 0.0,
            spread: 0.0,
        };
        (0..100_001).for_each(|generation| history.push(|| point(generation)));
        let points = history.with_last(Some(point(100_000)));
        assert!(points.windows(2).all(|w| w[0].generation < w[1].generation));
        assert!(points.len() <= CAPACITY + 1 && points.len() >= CAPACITY / 2);
        assert_eq!(points[0].generation, 0);
        assert_eq!(points[points.len() - 1].generation, 100_000);
        let steps = points.windows(2).map(|w| w[1].generation - w[0].generation);
        assert!(steps.take(points.len() - 2).all(|step| step == history.stride));
    }
}
