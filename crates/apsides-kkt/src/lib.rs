//! Sparse symmetric indefinite systems: analyse once, refactor, inertia, refinement.
//!
//! ```text
//! [ H + delta_w I      J^T      ] [ dx ]   [ r_x ]
//! [       J       C - delta_c I ] [ dl ] = [ r_l ]
//! ```
//!
//! The Karush-Kuhn-Tucker systems of an interior-point method keep their structure and change their values.
//! [`KktSystem::analyse`] does the symbolic work once; [`KktSystem::factor`] computes an LDL^T factorisation and counts
//! the inertia, by which the caller chooses `delta_w` and `delta_c`; [`KktSystem::solve`] refines the solution and
//! tells the residual it reached. After the first call nothing is allocated, and results repeat bit by bit.
//!
//! The crate chooses no regularisation and estimates no condition number. A matrix that neither static
//! shifts nor pivots inside supernodes make stable is not solved, and the residual says so.
//!
//! ```
//! use apsides_kkt::{Inertia, KktSettings, KktSystem};
//!
//! // min x0^2 + x1^2 subject to x0 + x1 = 1: Hessian diag(2, 2), Jacobian (1 1).
//! let (rows, cols) = ([0, 1, 2, 2], [0, 1, 0, 1]);
//! let mut system = KktSystem::analyse(3, 2, &rows, &cols, KktSettings::default())?;
//! let inertia = system.factor(&[2.0, 2.0, 1.0, 1.0], 0.0, 0.0)?;
//! assert_eq!(inertia, Inertia { positive: 2, negative: 1, zero: 0 });
//! let mut x = [0.0; 3];
//! let quality = system.solve(&[0.0, 0.0, 1.0], &mut x)?;
//! assert!(quality.residual <= 1e-10);
//! assert!((x[0] - 0.5).abs() < 1e-9 && (x[2] + 1.0).abs() < 1e-9);
//! # Ok::<(), apsides_kkt::KktError>(())
//! ```
//!
//! # Method
//!
//! 1. The triplets are placed once, permuted by the elimination order. Subtrees of the elimination forest that are alike, such as
//!    those of what the intervals of a mesh have inside, become bundles of four: their rows stand side by side, and all work on
//!    them (scaling, factorisation, substitution, product) goes through one list of indices, one subtree in each lane of a vector.
//! 2. `factor` scales rows and columns by powers of two (Ruiz) and runs a multifrontal LDL^T without pivoting, with the static
//!    shift of pivots: of those of dual rows, and of small ones of primal rows. Expected signs are never imposed. A pivot that is zero to rounding
//!    is replaced by a small one, and the signs are counted anew in the pivoted factor of step 4: only what is zero
//!    there, too, counts in [`Inertia::zero`].
//!    Dense blocks are eliminated with the vector instructions that the processor has.
//! 3. `solve` refines against the matrix without the static shift: classical steps while they contract by ten, then
//!    GMRES with the factor as preconditioner. A factor of tiny pivots (zero Hessian diagonals) still serves. Primal and dual rows are
//!    also solved to a thousand times the tolerance relative to their own right-hand sides: a violation that is small beside
//!    a gradient is brought down, too.
//! 4. If that misses the tolerance, the LBL^T of faer with pivoting inside supernodes takes over.
//!
//! # Stages
//!
//! [`Ordering::Stages`] takes any numbers that ascend in time, with variables before the multipliers of the equations
//! they enter. For a Radau transcription (node `i` of all nodes in time, `x_i` states, `u_i` controls, `l_i` the
//! multipliers of the defects collocated at node `i`) these rules suit; parameters and the final time come last:
//!
//! | rule | stage of `u_i` | of `x_i` | of `l_i` |
//! | --- | --- | --- | --- |
//! | inside first, node `i` inside interval `k` (use this) | `3 k` | `3 k + 1` | `3 k + 2` |
//! | and the first node of interval `k` of `K` | `3 (K + k)` | `3 (K + k) + 1` | `3 (K + k) + 2` |
//! | node by node | `3 i` | `3 i + 1` | `3 i + 2` |
//! | interval by interval, node `i` in interval `k` | `3 k` | `3 k + 1` | `3 k + 2` |
//!
//! Rows inside of intervals are coupled with their ends and with parameters alone, so that intervals of as many points are
//! bundles: on the landing of 1000 intervals of `cargo bench -p apsides-kkt -- order` a factorisation takes 1.6 ms by the first
//! rule and 2.0 ms by the last one, a solve 1.0 and 1.3 ms. The node rule keeps the growth of the factor in bounds: on 54 landing systems of 20 to 1000 intervals, with zero to regular Hessians and barrier terms over 16 decades,
//! it never needed the fallback; the interval rule needed it in 6 of 108 runs. Minimum degree costs 1.5 to 4 times as much to analyse; it also
//! eliminates multipliers before their variables: 20 of 108 runs needed the fallback and 10 lost the inertia. Without
//! equilibration more than half of the runs fell back.
//!
//! # Modules
//!
//! | module | subject |
//! | --- | --- |
//! | `system` | [`KktSystem`], the flow from triplets to a refined solution |
//! | `settings`, `inertia`, `error` | [`KktSettings`], [`Inertia`], [`KktError`] |
//! | `analysis` | the symbolic work in one place |
//! | `elimination`, `tree` | elimination order: minimum degree, stages, custom; elimination forest, postorder |
//! | `supernodes`, `twins` | structure of the factor; subtrees that are alike |
//! | `structure`, `lane_entries`, `pattern` | where values stand, lane by lane and by columns; product, scales applied |
//! | `scaling` | equilibration |
//! | `multifrontal`, `assembly`, `dense` | LDL^T, inertia; sizes of fronts and where their parts go; kernels on dense blocks |
//! | `pivot` | pivots counted and replaced |
//! | `bundle`, `lanes` | the same for bundles of subtrees that are alike; kernels in lanes |
//! | `room`, `columns` | places in an array that are used again; right-hand sides that are treated at once |
//! | `pivoted` | LBL^T, the fallback |
//! | `refine`, `norms` | refinement and GMRES; largest magnitudes |
//!
//! # References
//!
//! * Waechter and Biegler, Math. Program. 106 (2006) 25-57, [doi:10.1007/s10107-004-0559-y](https://doi.org/10.1007/s10107-004-0559-y):
//!   inertia and the shifts `delta_w`, `delta_c`.
//! * Vanderbei, SIAM J. Optim. 5 (1995) 100-113, [doi:10.1137/0805005](https://doi.org/10.1137/0805005): a quasi-definite
//!   matrix has an LDL^T factorisation in every order, which the static shift provides.
//! * Arioli, Duff, Gratton and Pralet, SIAM J. Sci. Comput. 29 (2007) 2024-2044,
//!   [doi:10.1137/060661545](https://doi.org/10.1137/060661545): GMRES preconditioned by a perturbed LDL^T.
//! * Ruiz, RAL-TR-2001-034 (2001): equilibration.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod analysis;
mod assembly;
mod bundle;
mod columns;
mod dense;
mod elimination;
mod error;
mod inertia;
mod lane_entries;
mod lanes;
mod multifrontal;
mod norms;
mod pattern;
mod pivot;
mod pivoted;
mod refine;
mod room;
mod scaling;
mod settings;
mod structure;
mod supernodes;
mod system;
mod tree;
mod twins;

pub use error::KktError;
pub use inertia::Inertia;
pub use settings::{KktSettings, Ordering};
pub use system::{KktCounters, KktSystem, SolveQuality};
