//! A sparse row over the variables of a stage.

/// A linear function of the `NW` variables of a stage: its entries by growing columns, and the same with zeros between them. Products with whole
/// rows of one length are vectors, and cost less than those with the entries alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<const NW: usize> {
    length: usize,
    columns: [u8; NW],
    /// By column.
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
        self.values[column] += value;
        if place < self.length && usize::from(self.columns[place]) == column {
            return;
        }
        self.columns.copy_within(place..self.length, place + 1);
        self.columns[place] = column as u8;
        self.length += 1;
    }

    /// The entries as `(column, value)`, by growing columns.
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> {
        self.columns[..self.length].iter().map(|&c| (usize::from(c), self.values[usize::from(c)]))
    }

    pub(crate) fn is_valid(&self) -> bool {
        !self.outside && self.values.iter().all(|v| v.is_finite())
    }

    /// Value at a point.
    #[inline(always)]
    #[must_use]
    pub fn dot(&self, w: &[f64; NW]) -> f64 {
        // Sums side by side: none waits for each term of the others.
        let mut sums = [0.0; 4];
        for c in 0..NW {
            sums[c % 4] += self.values[c] * w[c];
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }

    /// Adds a multiple of the row to a vector.
    #[inline(always)]
    pub(crate) fn add_to(&self, factor: f64, out: &mut [f64; NW]) {
        for (out, value) in out.iter_mut().zip(&self.values) {
            *out += factor * value;
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
