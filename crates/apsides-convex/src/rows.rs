//! Rows of the conic program, written in one fixed order so that values can be replaced in place.

use apsides_conic::{Cone, ConicData, Triplets};

/// Writes `s = b - Ax` row by row. The first time it records the pattern, afterwards only values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    matrix: Triplets,
    right_hand_side: Vec<f64>,
    cones: Vec<Cone>,
    recorded: bool,
    /// Constant of the present row.
    constant: f64,
}

impl Rows {
    /// Starts anew.
    pub(crate) fn start(&mut self) {
        self.matrix.values.clear();
        self.right_hand_side.clear();
        self.constant = 0.0;
    }

    /// Ends the first pass.
    pub(crate) fn end(&mut self) {
        self.recorded = true;
    }

    /// Adds `factor x[column]` to the present row of `s`.
    pub(crate) fn term(&mut self, column: usize, factor: f64) {
        if self.recorded {
            self.matrix.values.push(-factor);
        } else {
            self.matrix.push(self.right_hand_side.len(), column, -factor);
        }
    }

    /// Adds a constant to the present row of `s`.
    pub(crate) fn constant(&mut self, value: f64) {
        self.constant += value;
    }

    /// Ends the present row.
    pub(crate) fn next(&mut self) {
        self.right_hand_side.push(self.constant);
        self.constant = 0.0;
    }

    /// The rows since the last call, or the start, form a cone.
    pub(crate) fn cone(&mut self, cone: Cone) {
        if !self.recorded && cone.size() > 0 {
            self.cones.push(cone);
        }
    }

    /// Number of rows so far.
    pub(crate) fn len(&self) -> usize {
        self.right_hand_side.len()
    }

    pub(crate) fn matrix_values(&self) -> &[f64] {
        &self.matrix.values
    }

    pub(crate) fn right_hand_side(&self) -> &[f64] {
        &self.right_hand_side
    }

    /// All data, with an objective.
    pub(crate) fn data(&self, linear: Vec<f64>, quadratic: Triplets) -> ConicData {
        ConicData {
            linear,
            quadratic,
            matrix: self.matrix.clone(),
            right_hand_side: self.right_hand_side.clone(),
            cones: self.cones.clone(),
        }
    }
}
