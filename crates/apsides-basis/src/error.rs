//! Reasons to refuse a request.

use thiserror::Error;

/// The reasons for which a request for nodes or an interpolant is ill-posed.
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
    /// No splines of this order, or not for this purpose.
    #[error("{what}: order {order} requested, {min} to {max} are allowed")]
    SplineOrder {
        /// The rule or spline that was asked for.
        what: &'static str,
        /// The order asked for.
        order: usize,
        /// Smallest allowed order.
        min: usize,
        /// Largest allowed order.
        max: usize,
    },
    /// Too few knots.
    #[error("B-splines of order {order}: {knots} knots, {min} are needed")]
    KnotCount {
        /// Order of the splines.
        order: usize,
        /// Number of knots.
        knots: usize,
        /// Smallest number, or the one that fits the breaks.
        min: usize,
    },
    /// A knot is NaN, infinite, below the one before it or outside the interval.
    #[error(
        "B-splines: knot {index} is {value}, a finite number of at least {least} within the interval is needed"
    )]
    Knot {
        /// Position in the list of knots.
        index: usize,
        /// The offending value.
        value: f64,
        /// Smallest allowed value.
        least: f64,
    },
    /// A knot occurs too often, or never.
    #[error("B-splines: knot {value} has multiplicity {multiplicity}, 1 to {max} (the order) are allowed")]
    Multiplicity {
        /// The knot.
        value: f64,
        /// Its multiplicity.
        multiplicity: usize,
        /// Largest allowed multiplicity.
        max: usize,
    },
    /// The coefficients are not whole rows, one per basis function.
    #[error("B-splines: {found} coefficients, a positive multiple of {rows} is needed")]
    CoefficientCount {
        /// Number of coefficients.
        found: usize,
        /// Number of basis functions.
        rows: usize,
    },
}
