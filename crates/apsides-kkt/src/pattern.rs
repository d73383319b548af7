//! Structure of the permuted matrix: upper triangle by columns, with the position of every triplet.

use crate::KktError;

/// Upper triangle of a symmetric `n` x `n` matrix by columns; rows ascend in each column, the diagonal entry is always
/// present and last.
#[derive(Debug, Clone)]
pub(crate) struct Pattern {
    pub(crate) n: usize,
    /// Length `n + 1`.
    pub(crate) col_ptr: Vec<u32>,
    /// Length `col_ptr[n]`.
    pub(crate) row_idx: Vec<u32>,
    /// Position in `row_idx` of each triplet.
    pub(crate) triplet_position: Vec<u32>,
}

impl Pattern {
    /// Structure of the triplets with row `i` moved to `position[i]`. Duplicates share one position.
    ///
    /// The caller has checked that every index is below `n` and that `rows` and `cols` have equal length.
    pub(crate) fn new(n: usize, rows: &[usize], cols: &[usize], position: &[u32]) -> Result<Self, KktError> {
        let triplets = rows.len();
        let entries = triplets + n;
        if entries > i32::MAX as usize {
            return Err(KktError::TooLarge { n });
        }
        let pairs = || {
            let ends = rows.iter().zip(cols).map(|(&row, &col)| (position[row], position[col]));
            ends.map(|(a, b)| (a.min(b), a.max(b)))
        };
        // By column, each with its diagonal: row and triplet in one number, and short lists to sort.
        let mut next = vec![1u32; n + 1];
        for (_, col) in pairs() {
            next[col as usize] += 1;
        }
        let mut begin = 0;
        for count in &mut next {
            begin += std::mem::replace(count, begin);
        }
        let key = |row: u32, entry: usize| u64::from(row) << 32 | entry as u64;
        let mut sorted = vec![0u64; entries];
        for (entry, (row, col)) in pairs().enumerate().chain((triplets..).zip((0..n as u32).map(|j| (j, j))))
        {
            let place = &mut next[col as usize];
            sorted[*place as usize] = key(row, entry);
            *place += 1;
        }
        let mut col_ptr = vec![0u32; n + 1];
        let mut row_idx = Vec::with_capacity(entries);
        let mut triplet_position = vec![0u32; triplets];
        let mut begin = 0;
        for (col, &end) in next[..n].iter().enumerate() {
            let column = &mut sorted[begin..end as usize];
            column.sort_unstable();
            let first = row_idx.len();
            for key in column {
                let (row, entry) = ((*key >> 32) as u32, *key as u32 as usize);
                if row_idx.len() == first || row_idx.last() != Some(&row) {
                    row_idx.push(row);
                }
                if let Some(p) = triplet_position.get_mut(entry) {
                    *p = (row_idx.len() - 1) as u32;
                }
            }
            col_ptr[col + 1] = row_idx.len() as u32;
            begin = end as usize;
        }
        Ok(Self { n, col_ptr, row_idx, triplet_position })
    }

    pub(crate) fn nonzeros(&self) -> usize {
        self.row_idx.len()
    }

    /// Position of the diagonal entry of column `j`.
    pub(crate) fn diagonal(&self, j: usize) -> usize {
        self.col_ptr[j + 1] as usize - 1
    }

    /// Positions of the entries of column `j`.
    pub(crate) fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.col_ptr[j] as usize..self.col_ptr[j + 1] as usize
    }

    /// `out -= A x` for the symmetric matrix with these values.
    pub(crate) fn subtract_product(&self, values: &[f64], x: &[f64], out: &mut [f64]) {
        for j in 0..self.n {
            let column = self.column(j);
            let last = column.end - 1;
            let xj = x[j];
            let mut sum = values[last] * xj;
            for (&i, &a) in self.row_idx[column.start..last].iter().zip(&values[column.start..last]) {
                let i = i as usize;
                out[i] -= a * xj;
                sum += a * x[i];
            }
            out[j] -= sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duplicates_and_both_triangles_share_positions() {
        let pattern = Pattern::new(3, &[0, 2, 0, 1], &[2, 0, 2, 1], &[0, 1, 2]).expect("small");
        assert_eq!(pattern.col_ptr, [0, 1, 2, 4]);
        assert_eq!(pattern.row_idx, [0, 1, 0, 2]);
        assert_eq!(pattern.triplet_position, [2, 2, 2, 1]);
    }

    #[test]
    fn product_with_a_small_matrix() {
        // [2 1; 1 -3] x = b with x = (1, 2): A x = (4, -5).
        let pattern = Pattern::new(2, &[0, 0, 1], &[0, 1, 1], &[0, 1]).expect("small");
        let mut out = [5.0, -5.0];
        pattern.subtract_product(&[2.0, 1.0, -3.0], &[1.0, 2.0], &mut out);
        assert_eq!(out, [1.0, 0.0]);
    }
}
