//! Matrices by entries, and where each entry goes in a matrix by columns.

use crate::error::{ConicError, require_finite, require_length};

/// A sparse matrix as a list of `(row, column, value)`. Entries of one place add up; zeros keep their place in the pattern.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triplets {
    /// Row of each entry.
    pub rows: Vec<usize>,
    /// Column of each entry.
    pub columns: Vec<usize>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl Triplets {
    /// Adds an entry.
    pub fn push(&mut self, row: usize, column: usize, value: f64) {
        self.rows.push(row);
        self.columns.push(column);
        self.values.push(value);
    }

    /// Number of entries.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns true if there is no entry.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub(crate) fn check(&self, what: &'static str, rows: usize, columns: usize) -> Result<(), ConicError> {
        require_length(what, self.len(), self.rows.len())?;
        require_length(what, self.len(), self.columns.len())?;
        require_finite(what, &self.values)?;
        for (index, (&row, &column)) in self.rows.iter().zip(&self.columns).enumerate() {
            if row >= rows || column >= columns {
                return Err(ConicError::OutOfBounds { what, index, row, column, rows, columns });
            }
        }
        Ok(())
    }
}

/// A pattern by columns, with the place of each entry of the list it was made from.
#[derive(Clone, Debug)]
pub(crate) struct ColumnPattern {
    pub(crate) starts: Vec<usize>,
    pub(crate) rows: Vec<usize>,
    /// Index among the values by columns, per entry of the list.
    places: Vec<usize>,
}

impl ColumnPattern {
    /// Sorts entries that are in bounds into compressed columns.
    pub(crate) fn new(entries: &Triplets, columns: usize) -> Self {
        let mut order: Vec<usize> = (0..entries.len()).collect();
        order.sort_by_key(|&k| (entries.columns[k], entries.rows[k]));
        let (mut starts, mut rows) = (vec![0; columns + 1], Vec::new());
        let mut places = vec![0; entries.len()];
        let mut previous = None;
        for k in order {
            let at = (entries.columns[k], entries.rows[k]);
            if previous != Some(at) {
                rows.push(at.1);
                starts[at.0 + 1] += 1;
                previous = Some(at);
            }
            places[k] = rows.len() - 1;
        }
        for c in 0..columns {
            starts[c + 1] += starts[c];
        }
        Self { starts, rows, places }
    }

    /// Number of entries of the list.
    pub(crate) fn entries(&self) -> usize {
        self.places.len()
    }

    /// Sums values of the list into values by columns.
    pub(crate) fn scatter(&self, values: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (&place, value) in self.places.iter().zip(values) {
            out[place] += value;
        }
    }
}
