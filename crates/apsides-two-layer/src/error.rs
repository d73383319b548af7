//! Reasons to refuse a search.

use apsides_metaheuristics::SearchError;
use apsides_shooting::ShootingError;

/// An ill-posed request, or a checkpoint that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwoLayerError {
    /// The profiles do not fit the problem.
    #[error(transparent)]
    Profile(#[from] ShootingError),
    /// The search refuses its settings.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// The checkpoint cannot be read, or belongs to another search.
    #[error("checkpoint of the search: {0}")]
    Checkpoint(#[source] Box<dyn std::error::Error + Send + Sync + 'static>),
}
