//! Points in one flat array, alone and with their results.

use crate::{Evaluation, SearchError, SearchSpace};
use serde::{Deserialize, Serialize};

/// Points of the same dimension, one after the other in one array.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Flat")]
pub struct Points {
    dimension: usize,
    values: Vec<f64>,
}

/// The points as read, before they are checked.
#[derive(Deserialize)]
struct Flat {
    dimension: usize,
    values: Vec<f64>,
}

impl TryFrom<Flat> for Points {
    type Error = SearchError;

    fn try_from(Flat { dimension, values }: Flat) -> Result<Self, SearchError> {
        let rest = values.len().checked_rem(dimension).ok_or(SearchError::EmptyBox)?;
        if rest > 0 {
            let what = "the last point".to_string();
            return Err(SearchError::Length { what, found: rest, expected: dimension });
        }
        Ok(Self { dimension, values })
    }
}

impl Points {
    /// No points of `dimension` coordinates, which is at least 1.
    pub fn new(dimension: usize) -> Self {
        Self { dimension: dimension.max(1), values: Vec::new() }
    }

    /// Coordinates of a point.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.values.len() / self.dimension
    }

    /// Tells whether there are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Removes all points and keeps the memory.
    pub fn clear(&mut self) {
        self.values.clear();
    }

    /// Removes the points from `count` on.
    pub fn truncate(&mut self, count: usize) {
        self.values.truncate(count * self.dimension);
    }

    /// Gets memory for `count` more points.
    pub fn reserve(&mut self, count: usize) {
        self.values.reserve(count * self.dimension);
    }

    /// Adds a copy of a point.
    pub fn push(&mut self, x: &[f64]) {
        debug_assert_eq!(x.len(), self.dimension);
        self.values.extend_from_slice(x);
    }

    /// Adds the origin and returns it, to be filled.
    pub fn add(&mut self) -> &mut [f64] {
        let start = self.values.len();
        self.values.resize(start + self.dimension, 0.0);
        &mut self.values[start..]
    }

    /// Adds all points of another array.
    pub fn extend(&mut self, other: &Self) {
        debug_assert_eq!(other.dimension, self.dimension);
        self.values.extend_from_slice(&other.values);
    }

    /// A point.
    pub fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.dimension..][..self.dimension]
    }

    /// A point, to be changed.
    pub fn row_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.values[index * self.dimension..][..self.dimension]
    }

    /// Removes a point; the last one takes its index.
    pub fn swap_remove(&mut self, index: usize) {
        let last = self.values.len() - self.dimension;
        self.values.copy_within(last.., index * self.dimension);
        self.values.truncate(last);
    }

    /// The points in order.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.dimension)
    }

    /// All coordinates, point after point.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Standard deviation of a coordinate as a part of the box, as the mean over all coordinates that are not fixed.
    pub fn spread(&self, space: &SearchSpace) -> f64 {
        const BLOCK: usize = 8;
        let (count, mut sum, mut free) = (self.len() as f64, 0.0, 0);
        for first in (0..self.dimension).step_by(BLOCK) {
            // Several columns at a time, in the order of the memory.
            let block = first..self.dimension.min(first + BLOCK);
            let (mut means, mut squares) = ([0.0; BLOCK], [0.0; BLOCK]);
            for x in self.rows() {
                means.iter_mut().zip(&x[block.clone()]).for_each(|(m, x)| *m += x);
            }
            means.iter_mut().for_each(|m| *m /= count);
            for x in self.rows() {
                let columns = squares.iter_mut().zip(&means).zip(&x[block.clone()]);
                columns.for_each(|((s, m), x)| *s += (x - m).powi(2));
            }
            for (i, square) in block.zip(squares).filter(|&(i, _)| space.width(i) > 0.0) {
                sum += (square / count).sqrt() / space.width(i);
                free += 1;
            }
        }
        if free == 0 || self.is_empty() { 0.0 } else { sum / f64::from(free) }
    }
}

impl Points {
    /// Tells whether all points are nearly at one place: no coordinate differs from that of the first point by more than rounding of the
    /// width of the box.
    pub(crate) fn coincide(&self, space: &SearchSpace) -> bool {
        let near = |i: usize, a: f64, b: f64| (a - b).abs() <= f64::EPSILON * space.width(i);
        let Some(first) = self.rows().next() else { return true };
        self.rows().all(|x| x.iter().zip(first).enumerate().all(|(i, (&a, &b))| near(i, a, b)))
    }
}

/// Points with their results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Members")]
pub struct Population {
    /// The points.
    pub points: Points,
    /// The result of each.
    pub evaluations: Vec<Evaluation>,
}

/// The points as read, before they are checked.
#[derive(Deserialize)]
struct Members {
    points: Points,
    evaluations: Vec<Evaluation>,
}

impl TryFrom<Members> for Population {
    type Error = SearchError;

    fn try_from(Members { points, evaluations }: Members) -> Result<Self, SearchError> {
        let (expected, found) = (points.len(), evaluations.len());
        if found != expected {
            return Err(SearchError::Length { what: "results of points".to_string(), found, expected });
        }
        Ok(Self { points, evaluations })
    }
}

impl Population {
    /// No members, of `dimension` coordinates.
    pub fn new(dimension: usize) -> Self {
        Self { points: Points::new(dimension), evaluations: Vec::new() }
    }

    /// Number of members.
    pub fn len(&self) -> usize {
        self.evaluations.len()
    }

    /// Tells whether there are none.
    pub fn is_empty(&self) -> bool {
        self.evaluations.is_empty()
    }

    /// Removes all members and keeps the memory.
    pub fn clear(&mut self) {
        self.points.clear();
        self.evaluations.clear();
    }

    /// Adds a copy of a member.
    pub fn push(&mut self, x: &[f64], evaluation: Evaluation) {
        self.points.push(x);
        self.evaluations.push(evaluation);
    }

    /// Replaces a member.
    pub fn set(&mut self, index: usize, x: &[f64], evaluation: Evaluation) {
        self.points.row_mut(index).copy_from_slice(x);
        self.evaluations[index] = evaluation;
    }

    /// Removes a member; the last one takes its index.
    pub fn swap_remove(&mut self, index: usize) {
        self.points.swap_remove(index);
        self.evaluations.swap_remove(index);
    }

    /// Members with their results.
    pub fn iter(&self) -> impl Iterator<Item = (&[f64], &Evaluation)> {
        self.points.rows().zip(&self.evaluations)
    }

    /// The best member, the first of equals.
    pub fn best(&self) -> Option<usize> {
        (0..self.len()).min_by(|&i, &j| self.evaluations[i].order(&self.evaluations[j]))
    }

    /// The worst member, the last of equals.
    pub fn worst(&self) -> Option<usize> {
        (0..self.len()).max_by(|&i, &j| self.evaluations[i].order(&self.evaluations[j]))
    }

    /// Adds copies of the `count` best members to `into`, best first; failed ones are left out.
    pub fn copy_best(&self, count: usize, into: &mut Self) {
        let order = |&i: &usize, &j: &usize| self.evaluations[i].order(&self.evaluations[j]).then(i.cmp(&j));
        let mut last = None;
        for _ in 0..count {
            // Few are wanted, so that looking through all for each costs less than memory for sorting.
            let rest = (0..self.len()).filter(|i| last.is_none_or(|last| order(&last, i).is_lt()));
            let Some(next) = rest.min_by(order).filter(|&i| !self.evaluations[i].is_failed()) else { break };
            into.push(self.points.row(next), self.evaluations[next]);
            last = Some(next);
        }
    }

    /// Adds copies of the first `count` members to `into`; failed ones are left out. For a population that stands in order.
    pub fn copy_first(&self, count: usize, into: &mut Self) {
        for (x, evaluation) in self.iter().take(count).filter(|(_, e)| !e.is_failed()) {
            into.push(x, *evaluation);
        }
    }

    /// Keeps the `count` best of the members from index `first` on, best first.
    pub fn keep_best(&mut self, first: usize, count: usize) {
        let kept = count.min(self.len() - first);
        for place in first..first + kept {
            let rest = place..self.len();
            let next = rest.min_by(|&i, &j| self.evaluations[i].order(&self.evaluations[j])).unwrap_or(place);
            self.evaluations[place..=next].rotate_right(1);
            let n = self.points.dimension;
            self.points.values[place * n..(next + 1) * n].rotate_right(n);
        }
        self.points.truncate(first + kept);
        self.evaluations.truncate(first + kept);
    }

    /// Puts the members in order, best first; equals keep theirs.
    pub fn sort(&mut self) {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&i, &j| self.evaluations[i].order(&self.evaluations[j]));
        let old = self.clone();
        for (new, &k) in order.iter().enumerate() {
            self.set(new, old.points.row(k), old.evaluations[k]);
        }
    }

    /// Puts a member in its place in a population that stands in order, and drops the last one. One that is no better than the
    /// last, or there already, is left out.
    pub fn insert_sorted(&mut self, x: &[f64], evaluation: Evaluation) {
        let Some(last) = self.len().checked_sub(1) else { return };
        if !evaluation.is_better_than(&self.evaluations[last]) || self.contains(x, &evaluation) {
            return;
        }
        let place = self.evaluations.partition_point(|e| !evaluation.is_better_than(e));
        let n = self.points.dimension;
        self.points.values.copy_within(place * n..last * n, (place + 1) * n);
        self.evaluations.copy_within(place..last, place + 1);
        self.set(place, x, evaluation);
    }

    /// Puts migrants in place of as many of the worst members, whether they are better or not; a population in order stays in order.
    pub fn take_in(&mut self, migrants: &Self) {
        self.sort();
        let kept = self.len() - migrants.len().min(self.len());
        for (place, (x, evaluation)) in (kept..self.len()).zip(migrants.iter()) {
            self.set(place, x, *evaluation);
        }
        self.sort();
    }

    /// Tells whether a member is there already.
    fn contains(&self, x: &[f64], evaluation: &Evaluation) -> bool {
        // Few results are equal, so that few points are compared.
        self.iter().any(|(y, e)| e == evaluation && y == x)
    }

    /// Lets each migrant that is better than the worst member, and not there already, take its place. `replaced` gets the index and
    /// the new point of each member that changed.
    pub fn replace_worst(&mut self, migrants: &Self, mut replaced: impl FnMut(usize, &[f64])) {
        for (x, evaluation) in migrants.iter() {
            let Some(worst) = self.worst() else { return };
            if evaluation.is_better_than(&self.evaluations[worst]) && !self.contains(x, evaluation) {
                self.set(worst, x, *evaluation);
                replaced(worst, x);
            }
        }
    }
}
