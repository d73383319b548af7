//! Rules that are computed once in a process.

use std::sync::{Arc, OnceLock};

use crate::{BasisError, MAX_POINTS};

/// The rules of a kind that were asked for so far, by their numbers of points.
pub(crate) struct Shared<R> {
    kept: [OnceLock<Arc<R>>; MAX_POINTS + 1],
}

impl<R> Shared<R> {
    pub(crate) const fn new() -> Self {
        Self { kept: [const { OnceLock::new() }; MAX_POINTS + 1] }
    }

    /// The rule of `points` points, which `make` computes; its errors are not kept.
    pub(crate) fn get(
        &self,
        points: usize,
        make: impl FnOnce(usize) -> Result<R, BasisError>,
    ) -> Result<Arc<R>, BasisError> {
        let Some(kept) = self.kept.get(points) else { return make(points).map(Arc::new) };
        if let Some(rule) = kept.get() {
            return Ok(Arc::clone(rule));
        }
        let rule = Arc::new(make(points)?);
        Ok(Arc::clone(kept.get_or_init(|| rule)))
    }
}
