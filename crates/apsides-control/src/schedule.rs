//! Gains against a scheduling variable, such as dynamic pressure or Mach number.

use crate::error::{ControlError, finite};
use crate::lqr::feedback;

/// A table of gains `K(s)`, linear between its rows and held beyond its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct GainSchedule<const NX: usize, const NU: usize> {
    rows: Vec<(f64, [[f64; NX]; NU])>,
}

impl<const NX: usize, const NU: usize> GainSchedule<NX, NU> {
    /// A table of rows (scheduling variable, gain), the variable increasing.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] for an empty table, [`ControlError::Parameter`] for numbers that are not finite,
    /// [`ControlError::Limits`] where the variable does not increase.
    pub fn new(rows: Vec<(f64, [[f64; NX]; NU])>) -> Result<Self, ControlError> {
        if rows.is_empty() {
            return Err(ControlError::Dimension { what: "rows of a gain schedule", expected: 1, found: 0 });
        }
        for (s, gain) in &rows {
            finite("scheduling variable", *s)?;
            for value in gain.iter().flatten() {
                finite("scheduled gain", *value)?;
            }
        }
        for pair in rows.windows(2) {
            crate::error::ordered("scheduling variable from row to row", [pair[0].0, pair[1].0])?;
        }
        Ok(Self { rows })
    }

    /// The gain at a value of the variable; NaN where that is NaN.
    #[must_use]
    pub fn gain(&self, s: f64) -> [[f64; NX]; NU] {
        let above = self.rows.partition_point(|row| row.0 < s);
        let (first, last) = (&self.rows[0], &self.rows[self.rows.len() - 1]);
        if s.is_nan() {
            return [[f64::NAN; NX]; NU];
        }
        if above == 0 {
            return first.1;
        }
        if above == self.rows.len() {
            return last.1;
        }
        let ((s0, k0), (s1, k1)) = (&self.rows[above - 1], &self.rows[above]);
        let w = (s - s0) / (s1 - s0);
        std::array::from_fn(|i| std::array::from_fn(|j| (1.0 - w) * k0[i][j] + w * k1[i][j]))
    }

    /// Least and largest value of the variable in the table.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        [self.rows[0].0, self.rows[self.rows.len() - 1].0]
    }

    /// `-K(s) (x - target)`.
    #[must_use]
    pub fn control(&self, s: f64, x: &[f64; NX], target: &[f64; NX]) -> [f64; NU] {
        feedback(&self.gain(s), x, target)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_between_rows_and_held_beyond() {
        let table =
            GainSchedule::new(vec![(1.0, [[2.0, 0.0]]), (3.0, [[6.0, 1.0]]), (4.0, [[0.0, 0.0]])]).unwrap();
        assert_eq!(table.gain(0.0), [[2.0, 0.0]]);
        assert_eq!(table.gain(1.0), [[2.0, 0.0]]);
        assert_eq!(table.gain(2.0), [[4.0, 0.5]]);
        assert_eq!(table.gain(3.5), [[3.0, 0.5]]);
        assert_eq!(table.gain(9.0), [[0.0, 0.0]]);
        assert_eq!(table.range(), [1.0, 4.0]);
        assert_eq!(table.control(2.0, &[1.0, 3.0], &[0.0, 1.0]), [-5.0]);
        assert!(table.gain(f64::NAN)[0][0].is_nan());
    }

    #[test]
    fn refusals() {
        assert!(matches!(GainSchedule::<1, 1>::new(vec![]), Err(ControlError::Dimension { .. })));
        assert!(matches!(
            GainSchedule::new(vec![(1.0, [[1.0]]), (1.0, [[2.0]])]),
            Err(ControlError::Limits { lower: 1.0, upper: 1.0, .. })
        ));
        assert!(GainSchedule::new(vec![(f64::NAN, [[1.0]])]).is_err());
        assert!(GainSchedule::new(vec![(0.0, [[f64::INFINITY]])]).is_err());
    }
}
