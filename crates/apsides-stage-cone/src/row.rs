//! A sparse row over the variables of a stage.

/// A linear function of the `NW` variables of a stage: the entries that are not zero, by growing columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<const NW: usize> {
    length: usize,
    columns: [u8; NW],
    values: [f64; NW],
    outside: bool,
}

impl<const NW: usize> Default for Row<NW> {
    fn default() -> Self {
        Self::ZERO
    }
}

impl<const NW: usize> Row<NW> {
    /// The row without entries.
    pub const ZERO: Self = Self { length: 0, columns: [0; NW], values: [0.0; NW], outside: false };

    /// A row of given `(column, value)`; values of one column add up.
    #[must_use]
    pub fn of(terms: &[(usize, f64)]) -> Self {
        let mut row = Self::ZERO;
        for &(column, value) in terms {
            row.add(column, value);
        }
        row
    }

    /// Adds to the entry of a column. A column outside `0..NW` is noted, and the program with this row refused.
    pub fn add(&mut self, column: usize, value: f64) {
        if column >= NW || column > usize::from(u8::MAX) {
            self.outside = true;
            return;
        }
        let place = self.columns[..self.length].partition_point(|&c| usize::from(c) < column);
        if place < self.length && usize::from(self.columns[place]) == column {
            self.values[place] += value;
            return;
        }
        self.columns.copy_within(place..self.length, place + 1);
        self.values.copy_within(place..self.length, place + 1);
        (self.columns[place], self.values[place]) = (column as u8, value);
        self.length += 1;
    }

    /// The entries as `(column, value)`, by growing columns.
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> {
        let columns = self.columns[..self.length].iter();
        columns.zip(&self.values[..self.length]).map(|(&c, &v)| (usize::from(c), v))
    }

    pub(crate) fn is_valid(&self) -> bool {
        !self.outside && self.values[..self.length].iter().all(|v| v.is_finite())
    }

    /// Value at a point.
    #[inline]
    #[must_use]
    pub fn dot(&self, w: &[f64; NW]) -> f64 {
        self.terms().map(|(c, v)| v * w[c]).sum()
    }

    /// Adds a multiple of the row to a vector.
    #[inline]
    pub(crate) fn add_to(&self, factor: f64, out: &mut [f64; NW]) {
        for (c, v) in self.terms() {
            out[c] += factor * v;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_sorted_and_add_up() {
        let row = Row::<4>::of(&[(3, 1.0), (0, 2.0), (3, 0.5), (1, -1.0)]);
        assert!(row.terms().eq([(0, 2.0), (1, -1.0), (3, 1.5)]));
        assert!(row.dot(&[1.0, 10.0, 100.0, 1000.0]) == 1492.0 && row.is_valid());
        assert!(!Row::<4>::of(&[(4, 1.0)]).is_valid() && !Row::<4>::of(&[(0, f64::NAN)]).is_valid());
    }
}
