//! Bounds of all variables, or of all rows, of a nonlinear program.

use apsides_ocp::Bounds;

/// Lower and upper bounds, one of each per variable or per row.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// The lower bounds.
    pub lower: Vec<f64>,
    /// The upper bounds.
    pub upper: Vec<f64>,
}

impl Limits {
    /// The same bounds for all.
    #[must_use]
    pub fn new(count: usize, bounds: Bounds) -> Self {
        Self { lower: vec![bounds.lower; count], upper: vec![bounds.upper; count] }
    }

    /// Sets the bounds of one variable or row.
    pub fn set(&mut self, index: usize, bounds: Bounds) {
        self.lower[index] = bounds.lower;
        self.upper[index] = bounds.upper;
    }

    /// Tightens the bounds of one variable or row to what both allow.
    pub fn intersect(&mut self, index: usize, bounds: Bounds) {
        self.lower[index] = bounds.lower.max(self.lower[index]);
        self.upper[index] = bounds.upper.min(self.upper[index]);
    }

    /// Moves every value between its bounds.
    pub fn clamp(&self, values: &mut [f64]) {
        for ((v, l), u) in values.iter_mut().zip(&self.lower).zip(&self.upper) {
            *v = v.max(*l).min(*u);
        }
    }

    /// Copies the bounds to slices of the same lengths.
    pub fn copy_to(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_move_between_their_bounds() {
        let mut limits = Limits::new(3, Bounds::FREE);
        limits.set(0, Bounds::new(-1.0, 2.0));
        limits.intersect(0, Bounds::new(0.0, 5.0));
        limits.intersect(1, Bounds::at_most(4.0));
        assert_eq!((limits.lower[0], limits.upper[0]), (0.0, 2.0));
        let mut values = [-3.0, 7.0, 1e300];
        limits.clamp(&mut values);
        assert_eq!(values, [0.0, 4.0, 1e300]);
    }
}
