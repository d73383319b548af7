//! Reasons to refuse a request.

use thiserror::Error;

/// What can be wrong with a request for nodes or an interpolant.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BasisError {
    /// The rule exists for no such number of points, or its accuracy is not guaranteed there.
    #[error("{rule} rule: {points} points requested, {min} to {max} are allowed")]
    PointCount {
        /// Name of the quadrature rule.
        rule: &'static str,
        /// Number of points asked for.
        points: usize,
        /// Smallest allowed number.
        min: usize,
        /// Largest allowed number.
        max: usize,
    },
    /// An interpolant needs at least one node.
    #[error("interpolation: no node given, at least 1 is needed")]
    NoNodes,
    /// A node is NaN or infinite.
    #[error("interpolation: node {index} is {value}, a finite number is needed")]
    NotFinite {
        /// Position in the list of nodes.
        index: usize,
        /// The offending value.
        value: f64,
    },
    /// Two nodes are equal.
    #[error("interpolation: nodes {first} and {second} are both {value}, distinct nodes are needed")]
    Coincident {
        /// Position of the first of the pair.
        first: usize,
        /// Position of the second of the pair.
        second: usize,
        /// The common value.
        value: f64,
    },
}
