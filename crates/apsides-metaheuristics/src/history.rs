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
    /// The newest point, where it is not among `points`.
    last: Option<HistoryPoint>,
}

impl History {
    pub(crate) fn new() -> Self {
        Self { stride: 1, seen: 0, points: Vec::with_capacity(CAPACITY), last: None }
    }

    pub(crate) fn push(&mut self, point: HistoryPoint) {
        if self.points.len() == CAPACITY {
            let mut index = 0;
            self.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride *= 2;
        }
        self.last = None;
        if self.seen.is_multiple_of(self.stride) {
            self.points.push(point);
        } else {
            self.last = Some(point);
        }
        self.seen += 1;
    }

    /// The points in order, the newest one last.
    pub(crate) fn to_vec(&self) -> Vec<HistoryPoint> {
        self.points.iter().chain(&self.last).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_course_keeps_its_ends_and_even_steps() {
        let mut history = History::new();
        for generation in 0..100_001 {
            history.push(HistoryPoint {
                generation,
                evaluations: generation,
                objective: 0.0,
                violation: 0.0,
                spread: 0.0,
            });
        }
        let points = history.to_vec();
        assert!(points.len() <= CAPACITY + 1 && points.len() >= CAPACITY / 2);
        assert_eq!(points[0].generation, 0);
        assert_eq!(points[points.len() - 1].generation, 100_000);
        let steps = points.windows(2).map(|w| w[1].generation - w[0].generation);
        assert!(steps.take(points.len() - 2).all(|step| step == history.stride));
    }
}
