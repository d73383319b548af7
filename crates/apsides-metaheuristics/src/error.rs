//! Reasons to refuse a search.

/// A request that no search can serve.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SearchError {
    /// The box has no coordinates.
    #[error("the box has no coordinates")]
    EmptyBox,
    /// Things that belong together differ in length: lower and upper bounds, a point and the box.
    #[error("{what}: {found} numbers instead of {expected}")]
    Length {
        /// The list of the wrong length.
        what: String,
        /// Its length.
        found: usize,
        /// The length it should have.
        expected: usize,
    },
    /// A coordinate has no usable bounds.
    #[error(
        "bounds of coordinate {index}: [{lower}, {upper}]; bounds in rising order, a finite width apart, are needed"
    )]
    Bounds {
        /// The coordinate, from 0.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A start point lies outside of the box.
    #[error("start point {point}: coordinate {index} is {value}, outside of [{lower}, {upper}]")]
    StartOutside {
        /// The start point, from 0.
        point: usize,
        /// The coordinate, from 0.
        index: usize,
        /// Its value.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// No evaluation is allowed.
    #[error("the budget is 0 evaluations; at least 1 is needed")]
    NoBudget,
    /// A population is too small to work with.
    #[error("{method}: a population of {found}; at least {least} are needed")]
    Population {
        /// The method.
        method: &'static str,
        /// The size that was asked for.
        found: usize,
        /// The least size.
        least: usize,
    },
    /// A setting is out of range.
    #[error("{setting} is {value}; {allowed}")]
    Setting {
        /// The setting with its owner.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// The range allowed, in words.
        allowed: &'static str,
    },
    /// The threads of a search could not be started.
    #[error("threads for evaluations: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Refuses a setting that is not in `allowed`; NaN is never allowed.
pub(crate) fn require(
    setting: &'static str,
    value: f64,
    holds: bool,
    allowed: &'static str,
) -> Result<(), SearchError> {
    if holds && !value.is_nan() { Ok(()) } else { Err(SearchError::Setting { setting, value, allowed }) }
}
