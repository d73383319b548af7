//! The box that is searched.

use crate::SearchError;
use serde::{Deserialize, Serialize};

/// A box `lower <= x <= upper` with finite bounds. Equal bounds fix a coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Bounds")]
pub struct SearchSpace {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

/// The box as read, before it is checked.
#[derive(Deserialize)]
struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl TryFrom<Bounds> for SearchSpace {
    type Error = SearchError;

    fn try_from(bounds: Bounds) -> Result<Self, SearchError> {
        Self::new(bounds.lower, bounds.upper)
    }
}

impl SearchSpace {
    /// A box from its bounds.
    ///
    /// # Errors
    /// No coordinates, different lengths, and bounds that are NaN, infinite or reversed, by their index.
    pub fn new(lower: Vec<f64>, upper: Vec<f64>) -> Result<Self, SearchError> {
        if lower.is_empty() {
            return Err(SearchError::EmptyBox);
        }
        if lower.len() != upper.len() {
            let what = "upper bounds".to_string();
            return Err(SearchError::Length { what, found: upper.len(), expected: lower.len() });
        }
        for (index, (&lower, &upper)) in lower.iter().zip(&upper).enumerate() {
            // The width is finite only where both bounds are.
            if !((upper - lower).is_finite() && lower <= upper) {
                return Err(SearchError::Bounds { index, lower, upper });
            }
        }
        Ok(Self { lower, upper })
    }

    /// The same bounds for every one of `dimension` coordinates.
    ///
    /// # Errors
    /// As [`SearchSpace::new`].
    pub fn cube(dimension: usize, lower: f64, upper: f64) -> Result<Self, SearchError> {
        Self::new(vec![lower; dimension], vec![upper; dimension])
    }

    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// Lower bounds.
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Upper bounds.
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// Width of a coordinate.
    pub fn width(&self, index: usize) -> f64 {
        self.upper[index] - self.lower[index]
    }

    /// Tells whether a point of the right length lies in the box.
    pub fn contains(&self, x: &[f64]) -> bool {
        x.len() == self.dimension() && self.first_outside(x).is_none()
    }

    /// The first coordinate outside of its bounds, NaN included.
    pub(crate) fn first_outside(&self, x: &[f64]) -> Option<usize> {
        (0..self.dimension()).find(|&i| !(self.lower[i] <= x[i] && x[i] <= self.upper[i]))
    }

    /// The nearest value within the bounds of a coordinate; NaN becomes the lower bound.
    pub fn clamp(&self, index: usize, value: f64) -> f64 {
        // `max` and `min` drop a NaN, where `clamp` keeps it.
        value.max(self.lower[index]).min(self.upper[index])
    }

    /// A value mirrored at the bounds of its coordinate until it lies between them.
    pub fn reflect(&self, index: usize, value: f64) -> f64 {
        let (lower, upper, width) = (self.lower[index], self.upper[index], self.width(index));
        if (lower..=upper).contains(&value) {
            return value;
        }
        if width <= 0.0 || !value.is_finite() {
            return self.clamp(index, value);
        }
        let folded = (value - lower).rem_euclid(2.0 * width);
        self.clamp(index, lower + if folded > width { 2.0 * width - folded } else { folded })
    }

    /// The value at a fraction `[0, 1]` of the width of a coordinate.
    pub fn at(&self, index: usize, fraction: f64) -> f64 {
        self.clamp(index, self.lower[index] + fraction * self.width(index))
    }

    /// The fraction `[0, 1]` of the width at which a value stands; 0 where the coordinate is fixed.
    pub fn fraction(&self, index: usize, value: f64) -> f64 {
        let width = self.width(index);
        if width > 0.0 { (value - self.lower[index]) / width } else { 0.0 }
    }
}
