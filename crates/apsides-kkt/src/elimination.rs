//! Elimination order of the rows.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::pattern::Pattern;
use crate::{KktError, Ordering};

/// Rows in elimination order, before postordering. Indices of the triplets have been checked.
pub(crate) fn order(
    n: usize,
    rows: &[usize],
    cols: &[usize],
    ordering: &Ordering,
) -> Result<Vec<u32>, KktError> {
    match ordering {
        Ordering::Amd => minimum_degree(n, rows, cols),
        Ordering::Stages(stages) => {
            if stages.len() != n {
                return Err(KktError::Dimension { what: "stages", found: stages.len(), expected: n });
            }
            let mut order: Vec<u32> = (0..n as u32).collect();
            order.sort_by_key(|&i| stages[i as usize]);
            Ok(order)
        }
        Ordering::Custom(order) => {
            if order.len() != n {
                return Err(KktError::Dimension {
                    what: "elimination order",
                    found: order.len(),
                    expected: n,
                });
            }
            let mut seen = vec![false; n];
            for (position, &row) in order.iter().enumerate() {
                if row >= n || std::mem::replace(&mut seen[row], true) {
                    return Err(KktError::Permutation { position, row, n });
                }
            }
            Ok(order.iter().map(|&row| row as u32).collect())
        }
    }
}

/// Inverse of a permutation.
pub(crate) fn inverse(order: &[u32]) -> Vec<u32> {
    let mut position = vec![0u32; order.len()];
    for (k, &row) in order.iter().enumerate() {
        position[row as usize] = k as u32;
    }
    position
}

fn minimum_degree(n: usize, rows: &[usize], cols: &[usize]) -> Result<Vec<u32>, KktError> {
    let identity: Vec<u32> = (0..n as u32).collect();
    let pattern = Pattern::new(n, rows, cols, &identity)?;
    let matrix = SymbolicSparseColMatRef::new_checked(n, n, &pattern.col_ptr, None, &pattern.row_idx);
    let mut scratch = MemBuffer::try_new(amd::order_scratch::<u32>(n, pattern.nonzeros()))
        .map_err(|_| KktError::TooLarge { n })?;
    let (mut order, mut position) = (identity, vec![0u32; n]);
    amd::order(&mut order, &mut position, matrix, amd::Control::default(), MemStack::new(&mut scratch))
        .map_err(|_| KktError::TooLarge { n })?;
    Ok(order)
}
