//! LBL^T factorisation with Bunch-Kaufman pivoting inside each supernode, by faer: the fallback of the LDL^T. Nothing is
//! allocated after construction.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::elimination::inverse;
use crate::pattern::Pattern;
use crate::pivot::ZERO_PIVOT;
use crate::refine::Substitution;
use crate::structure::Structure;
use crate::tree::{Couplings, postorder};
use crate::{Inertia, KktError};

/// A matrix and its factor.
pub(crate) struct Pivoted {
    symbolic: SymbolicCholesky<u32>,
    /// Lower triangle by columns.
    matrix: SparseColMat<u32, f64>,
    /// Position in `matrix` of each value of the structure.
    position: Vec<u32>,
    /// Elimination order: place `k` holds row `order[k]` of the structure.
    order: Vec<u32>,
    /// Position in `matrix` of the diagonal of each row of the structure.
    diagonal: Vec<u32>,
    /// Blocks of L, with the diagonal of B.
    entries: Vec<f64>,
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    permuted: Vec<f64>,
    scratch: MemBuffer,
}

impl Pivoted {
    /// Symbolic factorisation and memory, in a postorder: pivots are found among columns that are neighbours.
    pub(crate) fn new(structure: &Structure) -> Result<Self, KktError> {
        let n = structure.n;
        let (rows, cols) = structure.entries();
        let identity: Vec<u32> = (0..n as u32).collect();
        let parent = Couplings::new(n, &rows, &cols, &identity).elimination_forest();
        let order = postorder(&parent).unwrap_or(identity);
        let ordered = &Pattern::new(n, &rows, &cols, &inverse(&order))?;
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &ordered.col_ptr, None, &ordered.row_idx);
        // A simplicial structure would silently be factored without pivoting.
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
            .map_err(|_| KktError::TooLarge { n })?;
        let supernodes = supernodes(&symbolic);
        let scratch = StackReq::or(
            supernodal::factorize_supernodal_numeric_intranode_lblt_scratch::<u32, f64>(
                supernodes,
                Par::Seq,
                Default::default(),
            ),
            supernodes.solve_in_place_scratch::<f64>(1, Par::Seq),
        );
        let (col_ptr, row_idx, moved) = transpose(ordered);
        let position: Vec<u32> = ordered.triplet_position.iter().map(|&p| moved[p as usize]).collect();
        let matrix = SparseColMat::new(
            SymbolicSparseColMat::new_checked(n, n, col_ptr, None, row_idx),
            vec![0.0; ordered.nonzeros()],
        );
        let diagonal = structure.diagonal.iter().map(|&p| position[p as usize]).collect();
        Ok(Self {
            entries: vec![0.0; symbolic.len_val()],
            scratch: MemBuffer::try_new(scratch).map_err(|_| KktError::TooLarge { n })?,
            symbolic,
            matrix,
            position,
            order,
            diagonal,
            subdiagonal: vec![0.0; n],
            forward: vec![0; n],
            inverse: vec![0; n],
            permuted: vec![0.0; n],
        })
    }

    /// Factors the matrix with these values of the structure and the shifts added to its diagonal.
    pub(crate) fn factor(&mut self, values: &[f64], shifts: &[f64]) {
        let target = self.matrix.val_mut();
        for (&p, &v) in self.position.iter().zip(values) {
            target[p as usize] = v;
        }
        for (&p, shift) in self.diagonal.iter().zip(shifts) {
            target[p as usize] += shift;
        }
        supernodal::factorize_supernodal_numeric_intranode_lblt(
            &mut self.entries,
            &mut self.subdiagonal,
            &mut self.forward,
            &mut self.inverse,
            self.matrix.as_ref(),
            supernodes(&self.symbolic),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
    }

    /// The inertia of the factor: the signs of the blocks of B. `unit` is the size of the smallest row of the matrix.
    /// `None` after an overflow.
    pub(crate) fn inertia(&self, unit: f64) -> Option<Inertia> {
        let mut inertia = Inertia::default();
        let factor = self.factored();
        for s in 0..supernodes(&self.symbolic).n_supernodes() {
            let block = factor.supernode(s);
            let (start, values) = (block.start(), block.val());
            let mut i = 0;
            while i < values.ncols() {
                let (first, below) = (values[(i, i)], self.subdiagonal[start + i]);
                if below == 0.0 {
                    inertia.count(first, ZERO_PIVOT * unit);
                    i += 1;
                } else {
                    let determinant = first * values[(i + 1, i + 1)] - below * below;
                    if !determinant.is_finite() {
                        return None;
                    }
                    inertia.count(first.signum(), 0.0);
                    inertia.count(first.signum() * determinant, 0.0);
                    i += 2;
                }
                if !first.is_finite() {
                    return None;
                }
            }
        }
        Some(inertia)
    }

    fn factored(&self) -> supernodal::SupernodalIntranodeLbltRef<'_, u32, f64> {
        supernodal::SupernodalIntranodeLbltRef::new(
            supernodes(&self.symbolic),
            &self.entries,
            &self.subdiagonal,
            PermRef::new_checked(&self.forward, &self.inverse, self.permuted.len()),
        )
    }
}

impl Substitution for Pivoted {
    fn solve(&mut self, x: &mut [f64]) -> bool {
        let n = x.len();
        for (p, &f) in self.permuted.iter_mut().zip(&self.forward) {
            *p = x[self.order[f as usize] as usize];
        }
        // `factored` would borrow the vector that is solved in place.
        supernodal::SupernodalIntranodeLbltRef::new(
            supernodes(&self.symbolic),
            &self.entries,
            &self.subdiagonal,
            PermRef::new_checked(&self.forward, &self.inverse, n),
        )
        .solve_in_place_no_numeric_permute_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.permuted, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for (&row, &i) in self.order.iter().zip(&self.inverse) {
            x[row as usize] = self.permuted[i as usize];
        }
        x.iter().all(|v| v.is_finite())
    }
}

#[expect(clippy::unreachable, reason = "invariant: a supernodal structure was asked for")]
fn supernodes(symbolic: &SymbolicCholesky<u32>) -> &supernodal::SymbolicSupernodalCholesky<u32> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("invariant: a supernodal structure was asked for"),
    }
}

/// Lower triangle by columns of the same matrix: column pointers, row indices, and the place of each upper entry.
fn transpose(pattern: &Pattern) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
    let n = pattern.n;
    let mut col_ptr = vec![0u32; n + 1];
    for &i in &pattern.row_idx {
        col_ptr[i as usize + 1] += 1;
    }
    for j in 0..n {
        col_ptr[j + 1] += col_ptr[j];
    }
    let mut next = col_ptr.clone();
    let mut row_idx = vec![0u32; pattern.nonzeros()];
    let mut position = vec![0u32; pattern.nonzeros()];
    for j in 0..n {
        for p in pattern.column(j) {
            let slot = &mut next[pattern.row_idx[p] as usize];
            row_idx[*slot as usize] = j as u32;
            position[p] = *slot;
            *slot += 1;
        }
    }
    (col_ptr, row_idx, position)
}
