//! Numeric factorisations on a fixed structure: simplicial and supernodal LDL^T, and supernodal LBL^T with pivoting
//! inside each supernode. Nothing is allocated after construction.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, simplicial, supernodal,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::pattern::Pattern;
use crate::{Inertia, KktError};

/// Multiples of the size of a row: a pivot up to the first counts as zero and is replaced by the second, whose digits
/// mark it (no static shift equals it by accident).
const ZERO_PIVOT: f64 = f64::EPSILON;
const REPLACED_PIVOT: f64 = 1.048_317_592_648_13e-8;

/// Work (entries of the factor's columns squared) per entry of the factor from which `Auto` takes the supernodal kernel.
pub(crate) const SUPERNODAL_WORK_PER_ENTRY: f64 = 20.0;

/// Which factorisation a [`Factor`] holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kernel {
    SimplicialLdlt,
    SupernodalLdlt,
    SupernodalLblt,
}

/// A matrix in the layout its kernel reads, and its factor.
pub(crate) struct Factor {
    symbolic: SymbolicCholesky<u32>,
    /// Upper triangle by columns for the simplicial kernel, lower triangle for the supernodal ones.
    matrix: SparseColMat<u32, f64>,
    /// Position in `matrix` of each entry of the upper triangle; empty if the layouts agree.
    position: Vec<u32>,
    /// Position in `matrix` of each diagonal entry.
    diagonal: Vec<u32>,
    entries: Vec<f64>,
    scratch: MemBuffer,
    pivoting: Option<Pivoting>,
    complete: bool,
}

/// Pivoting inside supernodes: the sub-diagonal of B and the permutation.
struct Pivoting {
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    permuted: Vec<f64>,
}

impl Factor {
    /// Symbolic factorisation and memory for `kernel`.
    pub(crate) fn new(pattern: &Pattern, kernel: Kernel) -> Result<Self, KktError> {
        let n = pattern.n;
        let too_large = |_| KktError::TooLarge { n };
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &pattern.col_ptr, None, &pattern.row_idx);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: match kernel {
                Kernel::SimplicialLdlt => SupernodalThreshold::FORCE_SIMPLICIAL,
                Kernel::SupernodalLdlt | Kernel::SupernodalLblt => SupernodalThreshold::FORCE_SUPERNODAL,
            },
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
            .map_err(|_| KktError::TooLarge { n })?;

        let scratch = match symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => {
                let factor = simplicial::factorize_simplicial_numeric_ldlt_scratch::<u32, f64>(n);
                StackReq::or(factor, s.solve_in_place_scratch::<f64>(1))
            }
            SymbolicCholeskyRaw::Supernodal(s) => {
                let factor = if kernel == Kernel::SupernodalLblt {
                    supernodal::factorize_supernodal_numeric_intranode_lblt_scratch::<u32, f64>(
                        s,
                        Par::Seq,
                        Default::default(),
                    )
                } else {
                    supernodal::factorize_supernodal_numeric_ldlt_scratch::<u32, f64>(
                        s,
                        Par::Seq,
                        Default::default(),
                    )
                };
                StackReq::or(factor, s.solve_in_place_scratch::<f64>(1, Par::Seq))
            }
        };
        let (col_ptr, row_idx, position) = match symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(_) => {
                (pattern.col_ptr.clone(), pattern.row_idx.clone(), Vec::new())
            }
            SymbolicCholeskyRaw::Supernodal(_) => transpose(pattern),
        };
        let diagonal = (0..n)
            .map(|j| pattern.diagonal(j))
            .map(|p| if position.is_empty() { p as u32 } else { position[p] })
            .collect();
        let matrix = SparseColMat::new(
            SymbolicSparseColMat::new_checked(n, n, col_ptr, None, row_idx),
            vec![0.0; pattern.nonzeros()],
        );
        let pivoting = (kernel == Kernel::SupernodalLblt).then(|| Pivoting {
            subdiagonal: vec![0.0; n],
            forward: vec![0; n],
            inverse: vec![0; n],
            permuted: vec![0.0; n],
        });
        Ok(Self {
            entries: vec![0.0; symbolic.len_val()],
            scratch: MemBuffer::try_new(scratch).map_err(too_large)?,
            symbolic,
            matrix,
            position,
            diagonal,
            pivoting,
            complete: false,
        })
    }

    /// Entries stored for L and D, with the explicit zeros of supernodes.
    pub(crate) fn nonzeros(&self) -> usize {
        self.entries.len()
    }

    /// Sum of the squared column lengths of L over their sum; `None` for a supernodal structure.
    pub(crate) fn work_per_entry(&self) -> Option<f64> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => {
                let lengths = || s.col_ptr().windows(2).map(|w| f64::from(w[1] - w[0]));
                Some(lengths().map(|c| c * c).sum::<f64>() / lengths().sum::<f64>())
            }
            SymbolicCholeskyRaw::Supernodal(_) => None,
        }
    }

    /// Factors the matrix with these upper-triangle values and `shift(j)` added to diagonal entry `j`. Signs of D are
    /// counted; pivots that are zero to rounding in rows of size `unit` count as zero. After an overflow all do.
    pub(crate) fn factor(&mut self, values: &[f64], unit: f64, shift: impl Fn(usize) -> f64) -> Inertia {
        let target = self.matrix.val_mut();
        if self.position.is_empty() {
            target.copy_from_slice(values);
        } else {
            for (&p, &v) in self.position.iter().zip(values) {
                target[p as usize] = v;
            }
        }
        for (j, &p) in self.diagonal.iter().enumerate() {
            target[p as usize] += shift(j);
        }
        let replaced = REPLACED_PIVOT * unit;
        let regularization = LdltRegularization {
            dynamic_regularization_signs: None,
            dynamic_regularization_delta: replaced,
            dynamic_regularization_epsilon: ZERO_PIVOT * unit,
        };
        let stack = MemStack::new(&mut self.scratch);
        self.complete = match (self.symbolic.raw(), &mut self.pivoting) {
            (SymbolicCholeskyRaw::Simplicial(s), _) => simplicial::factorize_simplicial_numeric_ldlt(
                &mut self.entries,
                self.matrix.as_ref(),
                regularization,
                s,
                stack,
            )
            .is_ok(),
            (SymbolicCholeskyRaw::Supernodal(s), None) => supernodal::factorize_supernodal_numeric_ldlt(
                &mut self.entries,
                self.matrix.as_ref(),
                regularization,
                s,
                Par::Seq,
                stack,
                Default::default(),
            )
            .is_ok(),
            (SymbolicCholeskyRaw::Supernodal(s), Some(pivoting)) => {
                supernodal::factorize_supernodal_numeric_intranode_lblt(
                    &mut self.entries,
                    &mut pivoting.subdiagonal,
                    &mut pivoting.forward,
                    &mut pivoting.inverse,
                    self.matrix.as_ref(),
                    s,
                    Par::Seq,
                    stack,
                    Default::default(),
                );
                true
            }
        };
        self.inertia(replaced)
    }

    /// Signs of D. A pivot equal to `replaced` was zero; an incomplete factor has no known signs at all.
    fn inertia(&self, replaced: f64) -> Inertia {
        let mut inertia = Inertia::default();
        if !self.complete {
            inertia.zero = self.matrix.nrows();
            return inertia;
        }
        let mut count = |d: f64| {
            if d == 0.0 || !d.is_finite() || d.abs() == replaced {
                inertia.zero += 1;
            } else if d > 0.0 {
                inertia.positive += 1;
            } else {
                inertia.negative += 1;
            }
        };
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => {
                for &start in &s.col_ptr()[..s.nrows()] {
                    count(self.entries[start as usize]);
                }
            }
            SymbolicCholeskyRaw::Supernodal(s) => {
                let extents = s.supernode_begin().iter().zip(s.supernode_end()).zip(s.nnz_per_super());
                for (((&begin, &end), &below), &start) in extents.zip(s.col_ptr_for_val()) {
                    let width = (end - begin) as usize;
                    let stride = width + below as usize;
                    for c in 0..width {
                        count(self.entries[start as usize + c * (stride + 1)]);
                    }
                }
            }
        }
        inertia
    }

    /// Solves with the factor in place. False, with `x` of no use, if there is no complete factor or the result is
    /// not finite.
    pub(crate) fn solve(&mut self, x: &mut [f64]) -> bool {
        if !self.complete {
            return false;
        }
        let n = x.len();
        let stack = MemStack::new(&mut self.scratch);
        match (self.symbolic.raw(), &mut self.pivoting) {
            (SymbolicCholeskyRaw::Simplicial(s), _) => {
                simplicial::SimplicialLdltRef::new(s, &self.entries).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, n, 1),
                    Par::Seq,
                    stack,
                );
            }
            (SymbolicCholeskyRaw::Supernodal(s), None) => {
                supernodal::SupernodalLdltRef::new(s, &self.entries).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(x, n, 1),
                    Par::Seq,
                    stack,
                );
            }
            (SymbolicCholeskyRaw::Supernodal(s), Some(pivoting)) => {
                let Pivoting { subdiagonal, forward, inverse, permuted } = pivoting;
                for (p, &f) in permuted.iter_mut().zip(&*forward) {
                    *p = x[f as usize];
                }
                supernodal::SupernodalIntranodeLbltRef::new(
                    s,
                    &self.entries,
                    subdiagonal,
                    PermRef::new_checked(forward, inverse, n),
                )
                .solve_in_place_no_numeric_permute_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(permuted, n, 1),
                    Par::Seq,
                    stack,
                );
                for (x, &i) in x.iter_mut().zip(&*inverse) {
                    *x = permuted[i as usize];
                }
            }
        }
        x.iter().all(|v| v.is_finite())
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
