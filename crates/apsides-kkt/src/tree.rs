//! The elimination forest of a symmetric matrix, and its postorder.

/// Parent of a root.
pub(crate) const ROOT: u32 = u32::MAX;

/// For each row of an elimination order, the rows before it that it is coupled with: some of them more than once, in
/// any order.
pub(crate) struct Couplings {
    start: Vec<u32>,
    rows: Vec<u32>,
}

impl Couplings {
    /// Couplings of the triplets with row `i` moved to `position[i]`; all indices are below `n`.
    pub(crate) fn new(n: usize, rows: &[usize], cols: &[usize], position: &[u32]) -> Self {
        let mut start = vec![0u32; n + 1];
        let pairs =
            || rows.iter().zip(cols).filter(|(i, j)| i != j).map(|(&i, &j)| (position[i], position[j]));
        for (a, b) in pairs() {
            start[a.max(b) as usize] += 1;
        }
        let mut sum = 0;
        for entries in &mut start {
            sum += *entries;
            *entries = sum;
        }
        let mut list = vec![0; sum as usize];
        for (a, b) in pairs() {
            let next = &mut start[a.max(b) as usize];
            *next -= 1;
            list[*next as usize] = a.min(b);
        }
        Self { start, rows: list }
    }

    /// The same couplings with row `i` moved to `place[i]`, which keeps every row behind those that it is coupled with, as a postorder does.
    pub(crate) fn moved(&self, place: &[u32]) -> Self {
        let mut start = vec![0u32; self.start.len()];
        for (row, &place) in place.iter().enumerate() {
            start[place as usize + 1] = self.before(row).len() as u32;
        }
        for row in 0..self.len() {
            start[row + 1] += start[row];
        }
        let mut rows = vec![0; self.rows.len()];
        for (row, &to) in place.iter().enumerate() {
            let list = &mut rows[start[to as usize] as usize..];
            for (moved, &before) in list.iter_mut().zip(self.before(row)) {
                *moved = place[before as usize];
            }
        }
        Self { start, rows }
    }

    /// Rows.
    pub(crate) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// The rows before `row`.
    pub(crate) fn before(&self, row: usize) -> &[u32] {
        &self.rows[self.start[row] as usize..self.start[row + 1] as usize]
    }

    /// Parent of each row in the elimination forest (Liu, doi:10.1137/0611010), by path compression.
    pub(crate) fn elimination_forest(&self) -> Vec<u32> {
        let mut parent = vec![ROOT; self.len()];
        let mut ancestor = vec![ROOT; self.len()];
        for row in 0..self.len() {
            for &before in self.before(row) {
                let mut i = before;
                while i != ROOT && (i as usize) < row {
                    let next = ancestor[i as usize];
                    ancestor[i as usize] = row as u32;
                    if next == ROOT {
                        parent[i as usize] = row as u32;
                    }
                    i = next;
                }
            }
        }
        parent
    }
}

/// The forest with row `i` moved to `place[i]`.
pub(crate) fn moved(parent: &[u32], place: &[u32]) -> Vec<u32> {
    let mut moved = vec![ROOT; parent.len()];
    for (&parent, &place_of_child) in parent.iter().zip(place) {
        if parent != ROOT {
            moved[place_of_child as usize] = place[parent as usize];
        }
    }
    moved
}

/// Elimination order that is a postorder of the forest: `order[k]` is the row for place `k`. `None` if the rows are in
/// postorder already.
pub(crate) fn postorder(parent: &[u32]) -> Option<Vec<u32>> {
    let n = parent.len();
    let mut first_child = vec![ROOT; n];
    let mut next_sibling = vec![ROOT; n];
    let mut roots = ROOT;
    for j in (0..n).rev() {
        let head = match parent[j] {
            ROOT => &mut roots,
            p => &mut first_child[p as usize],
        };
        next_sibling[j] = *head;
        *head = j as u32;
    }
    let mut order = Vec::with_capacity(n);
    let mut stack = Vec::new();
    let mut root = roots;
    while root != ROOT {
        stack.push(root);
        while let Some(&node) = stack.last() {
            let child = first_child[node as usize];
            if child == ROOT {
                order.push(node);
                stack.pop();
            } else {
                first_child[node as usize] = next_sibling[child as usize];
                stack.push(child);
            }
        }
        root = next_sibling[root as usize];
    }
    let sorted = order.iter().enumerate().all(|(k, &j)| k == j as usize);
    (!sorted).then_some(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn postorder_gathers_subtrees() {
        // Arrow of two chains 0-2-4 and 1-3-4: the tree order 0 2 1 3 4 is a postorder, 0 1 2 3 4 is not.
        let couplings = Couplings::new(5, &[0, 2, 1, 3], &[2, 4, 3, 4], &[0, 1, 2, 3, 4]);
        let parent = couplings.elimination_forest();
        assert_eq!(postorder(&parent), Some(vec![0, 2, 1, 3, 4]));
        // Moved there, couplings and forest are those of the rows in that order.
        let place = [0, 2, 1, 3, 4];
        let (again, couplings) =
            (Couplings::new(5, &[0, 2, 1, 3], &[2, 4, 3, 4], &place), couplings.moved(&place));
        let sorted = |couplings: &Couplings, row| {
            let mut before = couplings.before(row).to_vec();
            before.sort_unstable();
            before
        };
        assert!((0..5).all(|row| sorted(&again, row) == sorted(&couplings, row)));
        assert_eq!(moved(&parent, &place), again.elimination_forest());
        let chain = Couplings::new(3, &[0, 1], &[1, 2], &[0, 1, 2]);
        assert_eq!(postorder(&chain.elimination_forest()), None);
    }
}
