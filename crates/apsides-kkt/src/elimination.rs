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
            Ok(sorted(stages))
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

/// Indices of these numbers so that they ascend, equal ones in the order given: by their digits, the last first.
fn sorted(numbers: &[u32]) -> Vec<u32> {
    const BITS: u32 = 11;
    let digit = |number: u32, shift: u32| (number >> shift) as usize & ((1 << BITS) - 1);
    let used = u32::BITS - numbers.iter().fold(0, |all, number| all | number).leading_zeros();
    let mut order: Vec<u32> = (0..numbers.len() as u32).collect();
    let mut before = vec![0; numbers.len()];
    for shift in (0..used).step_by(BITS as usize) {
        let mut next = [0_u32; 1 << BITS];
        for &number in numbers {
            next[digit(number, shift)] += 1;
        }
        let mut start = 0;
        for count in &mut next {
            start += std::mem::replace(count, start);
        }
        std::mem::swap(&mut order, &mut before);
        for &index in &before {
            let place = &mut next[digit(numbers[index as usize], shift)];
            order[*place as usize] = index;
            *place += 1;
        }
    }
    order
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_ascend_and_equal_ones_stay(numbers in prop::collection::vec(any::<u32>(), 0..200), shift in 0_u32..32) {
            let numbers: Vec<u32> = numbers.into_iter().map(|number| number >> shift).collect();
            let mut expected: Vec<u32> = (0..numbers.len() as u32).collect();
            expected.sort_by_key(|&i| numbers[i as usize]);
            prop_assert_eq!(sorted(&numbers), expected);
        }
    }
}
