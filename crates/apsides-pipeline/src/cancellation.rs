//! Work that has no iterations of its own, ended before its end.

use std::fmt;
use std::sync::Arc;

use apsides_nlp::{Flow, IterationRecord};

use crate::observer::Observer;

/// Says from any thread whether work is to end: a search for a site on a map, which no [`Observer`] sees. As an observer it
/// ends a solve.
#[derive(Clone, Default)]
pub struct Cancellation(Option<Arc<dyn Fn() -> bool + Send + Sync>>);

impl Cancellation {
    /// Work ends once `is_asked` is true.
    pub fn when(is_asked: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(is_asked)))
    }

    /// Returns true once the work is to end.
    #[must_use]
    pub fn is_asked(&self) -> bool {
        self.0.as_ref().is_some_and(|is_asked| is_asked())
    }
}

impl Observer for Cancellation {
    fn iteration(&mut self, _record: &IterationRecord) -> Flow {
        if self.is_asked() { Flow::Stop } else { Flow::Continue }
    }
}

impl fmt::Debug for Cancellation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Cancellation::when(..)" } else { "Cancellation::default()" })
    }
}
