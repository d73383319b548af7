//! Structure of the factor L in supernodes: runs of columns that are stored with one list of rows.
//!
//! A supernode takes in its neighbour below in the elimination tree while few zeros are stored for that (relaxed
//! amalgamation: Ashcraft and Grimes, ACM TOMS 15 (1989) 291, doi 10.1145/76909.76910).

use crate::tree::Couplings;

/// Neighbours merge if at most this part of the merged block are zeros.
const MOST_ZEROS: f64 = 0.25;
/// Supernodes are no wider than this.
const WIDEST: usize = 32;

/// Supernodes, ascending. Supernode `s` has the columns `first[s]..first[s + 1]`, which are also its first rows.
#[derive(Debug)]
pub(crate) struct Supernodes {
    /// Length `count + 1`.
    pub(crate) first: Vec<u32>,
    /// Offsets into `rows` of the rows below the columns of each supernode, length `count + 1`.
    pub(crate) row_start: Vec<u32>,
    /// Rows below, ascending for each supernode.
    pub(crate) rows: Vec<u32>,
    /// Supernode of each column.
    pub(crate) of_column: Vec<u32>,
}

impl Supernodes {
    /// Finds the supernodes of rows in postorder of their elimination forest.
    pub(crate) fn new(couplings: &Couplings, parent: &[u32]) -> Self {
        let n = couplings.len();
        let (first, row_start) = partition(parent, &column_lengths(couplings, parent));
        let count = first.len() - 1;
        let mut of_column = vec![0; n];
        for s in 0..count {
            of_column[first[s] as usize..first[s + 1] as usize].fill(s as u32);
        }
        let rows = vec![0; row_start[count] as usize];
        let mut structure = Self { first, row_start, rows, of_column };
        structure.list_rows(couplings, parent);
        structure
    }

    /// Lists the rows below every supernode: row after row, those of the supernodes that the rows before it lead to in the forest.
    fn list_rows(&mut self, couplings: &Couplings, parent: &[u32]) {
        let mut next = self.row_start.clone();
        for row in 0..couplings.len() {
            for &column in couplings.before(row) {
                let mut column = column as usize;
                while column < row {
                    let s = self.of_column[column] as usize;
                    let end = self.first[s + 1] as usize;
                    let at = next[s];
                    let listed = at > self.row_start[s] && self.rows[at as usize - 1] == row as u32;
                    if end > row || listed {
                        break;
                    }
                    self.rows[at as usize] = row as u32;
                    next[s] = at + 1;
                    column = parent[end - 1] as usize;
                }
            }
        }
    }

    /// The supernodes without columns before `start`, with their rows where `place` puts them in the same order.
    pub(crate) fn moved(&self, place: &[u32], start: usize) -> Self {
        let mut moved = Self {
            first: vec![start as u32],
            row_start: vec![0],
            rows: Vec::new(),
            of_column: vec![u32::MAX; place.len()],
        };
        for s in (0..self.count()).filter(|&s| place[self.first[s] as usize] as usize >= start) {
            let first = place[self.first[s] as usize] as usize;
            let end = first + self.width(s);
            let index = moved.count() as u32;
            moved.of_column[first..end].fill(index);
            moved.first.push(end as u32);
            moved.rows.extend(self.below(s).iter().map(|&row| place[row as usize]));
            moved.row_start.push(moved.rows.len() as u32);
        }
        moved
    }

    pub(crate) fn count(&self) -> usize {
        self.first.len() - 1
    }

    pub(crate) fn width(&self, s: usize) -> usize {
        (self.first[s + 1] - self.first[s]) as usize
    }

    /// Rows below the columns of a supernode.
    pub(crate) fn below(&self, s: usize) -> &[u32] {
        &self.rows[self.row_range(s)]
    }

    /// Range of the rows below in `rows`.
    pub(crate) fn row_range(&self, s: usize) -> std::ops::Range<usize> {
        self.row_start[s] as usize..self.row_start[s + 1] as usize
    }

    /// The supernode that holds the first row below.
    pub(crate) fn parent(&self, s: usize) -> Option<usize> {
        self.below(s).first().map(|&row| self.of_column[row as usize] as usize)
    }

    /// Children of all supernodes, ascending: those of `s` are `list[start[s]..start[s + 1]]`.
    pub(crate) fn children(&self) -> (Vec<u32>, Vec<u32>) {
        let count = self.count();
        let mut start = vec![0u32; count + 1];
        for parent in (0..count).filter_map(|s| self.parent(s)) {
            start[parent + 1] += 1;
        }
        for s in 0..count {
            start[s + 1] += start[s];
        }
        let mut next = start.clone();
        let mut list = vec![0; start[count] as usize];
        for s in 0..count {
            if let Some(parent) = self.parent(s) {
                list[next[parent] as usize] = s as u32;
                next[parent] += 1;
            }
        }
        (start, list)
    }
}

/// Entries below the diagonal of each column of L.
fn column_lengths(couplings: &Couplings, parent: &[u32]) -> Vec<u32> {
    let mut lengths = vec![0u32; couplings.len()];
    let mut seen = vec![u32::MAX; couplings.len()];
    for row in 0..couplings.len() {
        seen[row] = row as u32;
        for &column in couplings.before(row) {
            let mut column = column as usize;
            while seen[column] != row as u32 {
                seen[column] = row as u32;
                lengths[column] += 1;
                column = parent[column] as usize;
            }
        }
    }
    lengths
}

/// A supernode under construction.
struct Run {
    first: usize,
    end: usize,
    /// Rows below.
    below: usize,
    /// Zeros stored.
    zeros: usize,
}

impl Run {
    fn entries(&self) -> usize {
        let width = self.end - self.first;
        width * (width + 1) / 2 + width * self.below
    }

    /// The union of two neighbours, the second of which holds the parent of the first.
    fn merged(&self, next: &Self) -> Self {
        let width = self.end - self.first;
        let more = next.end - next.first + next.below - self.below;
        Self {
            first: self.first,
            end: next.end,
            below: next.below,
            zeros: self.zeros + next.zeros + width * more,
        }
    }
}

/// First columns of the supernodes and the number of columns; offsets of the rows below each, and their number.
fn partition(parent: &[u32], lengths: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let n = parent.len();
    let mut runs: Vec<Run> = Vec::new();
    for column in 0..n {
        let mut run = Run { first: column, end: column + 1, below: lengths[column] as usize, zeros: 0 };
        while let Some(last) = runs.last() {
            let child = parent[last.end - 1] as usize;
            if last.end != run.first || !(run.first..run.end).contains(&child) {
                break;
            }
            let merged = last.merged(&run);
            let few = merged.zeros as f64 <= MOST_ZEROS * merged.entries() as f64;
            if !few || merged.end - merged.first > WIDEST {
                break;
            }
            runs.pop();
            run = merged;
        }
        runs.push(run);
    }
    let first = runs.iter().map(|run| run.first as u32).chain([n as u32]).collect();
    let mut row_start = Vec::with_capacity(runs.len() + 1);
    row_start.push(0);
    let mut rows = 0;
    for run in runs {
        rows += run.below as u32;
        row_start.push(rows);
    }
    (first, row_start)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn supernodes(n: usize, rows: &[usize], cols: &[usize]) -> Supernodes {
        let position: Vec<u32> = (0..n as u32).collect();
        let couplings = Couplings::new(n, rows, cols, &position);
        Supernodes::new(&couplings, &couplings.elimination_forest())
    }

    #[test]
    fn a_dense_matrix_is_one_supernode() {
        let (rows, cols): (Vec<_>, Vec<_>) = (0..5).flat_map(|i| (0..=i).map(move |j| (i, j))).unzip();
        let supernodes = supernodes(5, &rows, &cols);
        assert_eq!((supernodes.first.as_slice(), supernodes.below(0).len()), (&[0, 5][..], 0));
    }

    #[test]
    fn rows_of_an_arrow() {
        // Two independent pairs (0, 1), (2, 3) and a last row 4 that is full.
        let supernodes = supernodes(5, &[1, 3, 4, 4, 4, 4], &[0, 2, 0, 1, 2, 3]);
        assert_eq!(supernodes.of_column[0], supernodes.of_column[1]);
        assert_ne!(supernodes.of_column[1], supernodes.of_column[2]);
        assert_eq!(supernodes.below(0), [4]);
    }

    #[test]
    fn a_chain_stores_few_zeros() {
        let n = 100;
        let rows: Vec<usize> = (1..n).collect();
        let cols: Vec<usize> = (0..n - 1).collect();
        let supernodes = supernodes(n, &rows, &cols);
        let values = |s| supernodes.width(s) * (supernodes.width(s) + supernodes.below(s).len());
        let sum: usize = (0..supernodes.count()).map(values).sum();
        assert!(sum < 4 * n, "{sum}");
        assert_eq!(supernodes.first.last(), Some(&(n as u32)));
    }
}
