//! A row of the reference beside its solution.

use super::model::{Begin, SolveNumbers};
use super::reference::ReferenceRow;

/// A row with what was found for it.
pub(super) struct Found<'a> {
    pub(super) reference: &'a ReferenceRow,
    pub(super) solved: Option<SolveNumbers>,
    /// The start of the solve that succeeded: with the search only where straight lines fail.
    pub(super) begin: Begin,
}
