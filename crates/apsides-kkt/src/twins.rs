//! Subtrees of the elimination forest that are alike, such as those of what the intervals of a mesh have inside: they
//! are factored together, one in each lane of a vector.

use std::cmp::Reverse;

use crate::supernodes::Supernodes;

/// Subtrees that are treated at once; a multiple of the lanes of every vector that is used.
pub(crate) const LANES: usize = 4;
/// Fewest rows of a subtree that is worth it.
const FEWEST_ROWS: usize = 4;
/// Most rows of a block in it: vectors along the columns of larger ones are as fast, and take less memory.
pub(crate) const MOST_ROWS: usize = 64;

/// Subtrees that are alike.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Twins {
    /// Supernodes of each.
    pub(crate) size: usize,
    /// The supernode at the root of each, ascending.
    pub(crate) roots: [usize; LANES],
}

/// The largest subtrees of which there are [`LANES`] alike, apart from each other, by their first root.
pub(crate) fn twins(supernodes: &Supernodes) -> Vec<Twins> {
    let mut candidates = candidates(supernodes);
    // Larger subtrees first, then those that may be alike.
    candidates.sort_unstable_by_key(|c| (Reverse(c.size), c.shape, c.root));
    let mut taken = vec![false; supernodes.count()];
    let mut found = Vec::new();
    let mut group: Vec<usize> = Vec::new();
    for same in candidates.chunk_by(|a, b| (a.size, a.shape) == (b.size, b.shape)) {
        let size = same[0].size;
        group.clear();
        for candidate in same {
            if taken[candidate.root] {
                continue;
            }
            if group.first().is_some_and(|&first| !are_alike(supernodes, first, candidate.root, size)) {
                continue;
            }
            group.push(candidate.root);
            if let Ok(roots) = <[usize; LANES]>::try_from(group.as_slice()) {
                for root in roots {
                    taken[root + 1 - size..=root].fill(true);
                }
                found.push(Twins { size, roots });
                group.clear();
            }
        }
    }
    found.sort_unstable_by_key(|twins| twins.roots[0]);
    found
}

/// The final place of each row of a postorder: those of twins first, lane beside lane, then the others.
pub(crate) fn places(supernodes: &Supernodes, twins: &[Twins]) -> Vec<u32> {
    let mut place = vec![u32::MAX; supernodes.of_column.len()];
    let mut next = 0;
    for Twins { size, roots } in twins {
        let starts = roots.map(|root| supernodes.first[root + 1 - size]);
        for row in 0..supernodes.first[roots[0] + 1] - starts[0] {
            for start in starts {
                place[(start + row) as usize] = next;
                next += 1;
            }
        }
    }
    for place in place.iter_mut().filter(|place| **place == u32::MAX) {
        *place = next;
        next += 1;
    }
    place
}

/// A subtree.
struct Candidate {
    root: usize,
    /// Supernodes.
    size: usize,
    /// A number that subtrees which are alike have in common.
    shape: u64,
}

/// Subtrees of sizes that are worth it.
fn candidates(supernodes: &Supernodes) -> Vec<Candidate> {
    let count = supernodes.count();
    let mut size = vec![1; count];
    let mut shape = vec![0u64; count];
    let mut highest = vec![0; count];
    let mut list = Vec::new();
    for s in 0..count {
        let (width, below) = (supernodes.width(s), supernodes.below(s).len());
        shape[s] = mix(shape[s], (width as u64) << 32 | below as u64);
        highest[s] = highest[s].max(width + below);
        if let Some(parent) = supernodes.parent(s) {
            size[parent] += size[s];
            shape[parent] = mix(shape[parent], shape[s]);
            highest[parent] = highest[parent].max(highest[s]);
        }
        let rows = supernodes.first[s + 1] - supernodes.first[s + 1 - size[s]];
        if highest[s] <= MOST_ROWS && rows as usize >= FEWEST_ROWS {
            list.push(Candidate { root: s, size: size[s], shape: shape[s] });
        }
    }
    list
}

/// A number of two, different for most pairs.
fn mix(a: u64, b: u64) -> u64 {
    (a.rotate_left(5) ^ b).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// Says whether the subtrees of two roots have the same blocks with the same rows.
pub(crate) fn are_alike(supernodes: &Supernodes, a: usize, b: usize, size: usize) -> bool {
    let (first_a, first_b) = (a + 1 - size, b + 1 - size);
    let (start_a, start_b) = (supernodes.first[first_a], supernodes.first[first_b]);
    let (end_a, end_b) = (supernodes.first[a + 1], supernodes.first[b + 1]);
    let (outer_a, outer_b) = (supernodes.below(a), supernodes.below(b));
    if end_a - start_a != end_b - start_b || outer_a.len() != outer_b.len() {
        return false;
    }
    (0..size).all(|k| {
        let (s, t) = (first_a + k, first_b + k);
        let (rows_s, rows_t) = (supernodes.below(s), supernodes.below(t));
        if supernodes.first[s] - start_a != supernodes.first[t] - start_b || rows_s.len() != rows_t.len() {
            return false;
        }
        let mut at = 0;
        rows_s.iter().zip(rows_t).all(|(&row_s, &row_t)| {
            if row_s < end_a || row_t < end_b {
                return row_s < end_a && row_t < end_b && row_s - start_a == row_t - start_b;
            }
            // A row outside that a supernode of the subtree is coupled with is one of its root, too.
            while outer_a[at] != row_s {
                at += 1;
            }
            outer_b[at] == row_t
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Couplings;

    /// Dense intervals of so many rows each, all coupled with a last row, and with a chain of one row each.
    fn supernodes(sizes: &[usize]) -> Supernodes {
        let inside: usize = sizes.iter().sum();
        let n = inside + sizes.len() + 1;
        let (mut rows, mut cols) = (Vec::new(), Vec::new());
        let mut couple = |i: usize, j: usize| {
            rows.push(i);
            cols.push(j);
        };
        let mut first = 0;
        for (k, size) in sizes.iter().enumerate() {
            for i in first..first + size {
                (first..i).for_each(|j| couple(i, j));
                couple(inside + k, i);
                couple(n - 1, i);
            }
            couple(inside + k + 1, inside + k);
            first += size;
        }
        let position: Vec<u32> = (0..n as u32).collect();
        let couplings = Couplings::new(n, &rows, &cols, &position);
        Supernodes::new(&couplings, &couplings.elimination_forest())
    }

    #[test]
    fn intervals_of_one_size_are_twins() {
        // The sixth interval is another one; nine of the others are left, one without company.
        let sizes = [4, 4, 4, 4, 4, 7, 4, 4, 4, 4];
        let found = twins(&supernodes(&sizes));
        assert_eq!(found.len(), 2);
        let roots: Vec<usize> = found.iter().flat_map(|twins| twins.roots).collect();
        assert!(roots.iter().all(|root| *root != 5) && found.iter().all(|twins| twins.size == 1));
        let place = places(&supernodes(&sizes), &found);
        let mut sorted = place.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..place.len() as u32), "a permutation");
        // Lane beside lane.
        let rows = found[0].roots.map(|root| supernodes(&sizes).first[root] as usize);
        assert_eq!(rows.map(|row| place[row]), [0, 1, 2, 3]);
        assert_eq!(rows.map(|row| place[row + 1]), [4, 5, 6, 7]);
    }

    #[test]
    fn intervals_of_two_kinds_are_twins_of_their_kind() {
        // Alternating kinds, with as many supernodes.
        let sizes = [4, 6, 4, 6, 4, 6, 4, 6, 4, 6];
        let supernodes = supernodes(&sizes);
        let found = twins(&supernodes);
        assert_eq!(found.iter().map(|twins| twins.size).collect::<Vec<_>>(), [1, 1]);
        for twins in &found {
            let widths = twins.roots.map(|root| supernodes.width(root));
            assert_eq!(widths, [widths[0]; LANES]);
        }
        assert!(!are_alike(&supernodes, found[0].roots[0], found[1].roots[0], 1));
    }

    #[test]
    fn fewer_intervals_than_lanes_and_large_ones_are_none() {
        assert_eq!(twins(&supernodes(&[5; LANES - 1])), []);
        assert_eq!(twins(&supernodes(&[MOST_ROWS; LANES + 1])), []);
    }
}
