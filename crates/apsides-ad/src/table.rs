//! Tables of one and two variables as operations of a formula, and their values on scalars.

use std::fmt::Write;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::Scalar;
use crate::pchip::{Outside, Pchip};
use crate::spline::{BicubicSpline, CubicSpline};

/// A table that a formula looks up.
#[derive(Clone, Debug, PartialEq)]
pub enum Table {
    /// A cubic spline of one variable.
    Cubic(CubicSpline),
    /// A shape-preserving piecewise cubic of one variable.
    Pchip(Pchip),
    /// A cubic spline of two variables.
    Bicubic(BicubicSpline),
}

impl From<CubicSpline> for Table {
    fn from(table: CubicSpline) -> Self {
        Self::Cubic(table)
    }
}

impl From<Pchip> for Table {
    fn from(table: Pchip) -> Self {
        Self::Pchip(table)
    }
}

impl From<BicubicSpline> for Table {
    fn from(table: BicubicSpline) -> Self {
        Self::Bicubic(table)
    }
}

impl CubicSpline {
    /// The value at `x`.
    #[inline]
    pub fn at<S: Scalar>(&self, x: S) -> S {
        x.cubic_spline(self)
    }
}

impl Pchip {
    /// The value at `x`.
    #[inline]
    pub fn at<S: Scalar>(&self, x: S) -> S {
        x.pchip(self)
    }
}

impl BicubicSpline {
    /// The value at `(x, y)`.
    #[inline]
    pub fn at<S: Scalar>(&self, x: S, y: S) -> S {
        x.bicubic_spline(y, self)
    }
}

impl Table {
    /// Number of variables: one or two.
    #[must_use]
    pub fn variables(&self) -> usize {
        match self {
            Self::Cubic(_) | Self::Pchip(_) => 1,
            Self::Bicubic(_) => 2,
        }
    }

    /// The value of a table of one variable; the first column of one of two is not asked for.
    pub(crate) fn curve<S: Scalar>(&self, x: S) -> S {
        match self {
            Self::Cubic(table) => table.at(x),
            Self::Pchip(table) => table.at(x),
            Self::Bicubic(_) => S::from(f64::NAN),
        }
    }

    /// The value of a table of two variables.
    pub(crate) fn surface<S: Scalar>(&self, x: S, y: S) -> S {
        match self {
            Self::Bicubic(table) => table.at(x, y),
            Self::Cubic(_) | Self::Pchip(_) => S::from(f64::NAN),
        }
    }

    /// Value, first and second derivative of a table of one variable.
    #[inline]
    pub(crate) fn curve_jet(&self, x: f64) -> [f64; 3] {
        match self {
            Self::Cubic(table) => table.derivatives(x),
            Self::Pchip(table) => table.derivatives(x),
            Self::Bicubic(_) => [f64::NAN; 3],
        }
    }

    /// Value and derivatives of a table of two variables, in the order of [`Scalar::map2`].
    #[inline]
    pub(crate) fn surface_jet(&self, x: f64, y: f64) -> [f64; 6] {
        match self {
            Self::Bicubic(table) => table.derivatives(x, y),
            Self::Cubic(_) | Self::Pchip(_) => [f64::NAN; 6],
        }
    }

    /// Arguments at which the slope of a table of one variable jumps.
    pub(crate) fn kinks(&self) -> Vec<f64> {
        match self {
            Self::Pchip(table) => table.kinks().collect(),
            Self::Cubic(_) | Self::Bicubic(_) => Vec::new(),
        }
    }

    /// Arguments of one variable between two pieces. A spline with not-a-knot ends has the same piece on both sides of its second knot, and of the
    /// last but one.
    pub(crate) fn joints(&self, variable: usize) -> Vec<f64> {
        let (knots, same) = match self {
            Self::Cubic(table) => (table.knots(), 2),
            Self::Pchip(table) => (table.knots(), 1),
            Self::Bicubic(table) => (table.knots()[variable], 2),
        };
        knots.get(same..knots.len().saturating_sub(same)).unwrap_or_default().to_vec()
    }

    /// A number that equal tables share.
    pub(crate) fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        let mut put = |x: f64| x.to_bits().hash(&mut hasher);
        match self {
            Self::Cubic(t) => t.knots().iter().chain(t.values()).for_each(|x| put(*x)),
            Self::Pchip(t) => t.knots().iter().copied().chain(t.values()).for_each(put),
            Self::Bicubic(t) => t.knots().concat().into_iter().chain(t.values()).for_each(put),
        }
        hasher.finish()
    }

    /// One JSON object: `kind`, knots and values.
    pub(crate) fn to_json(&self) -> String {
        match self {
            Self::Cubic(t) => format!(
                r#"{{"kind":"cubic","knots":[{}],"values":[{}]}}"#,
                numbers(t.knots().iter().copied()),
                numbers(t.values().iter().copied())
            ),
            Self::Pchip(t) => format!(
                r#"{{"kind":"pchip","knots":[{}],"values":[{}],"outside":"{}"}}"#,
                numbers(t.knots().iter().copied()),
                numbers(t.values()),
                match t.outside() {
                    Outside::Constant => "constant",
                    Outside::Linear => "linear",
                }
            ),
            Self::Bicubic(t) => {
                let [x, y] = t.knots().map(|knots| numbers(knots.iter().copied()));
                format!(r#"{{"kind":"bicubic","x":[{x}],"y":[{y}],"values":[{}]}}"#, numbers(t.values()))
            }
        }
    }
}

fn numbers(items: impl Iterator<Item = f64>) -> String {
    let mut list = String::new();
    for x in items {
        let comma = if list.is_empty() { "" } else { "," };
        // Writing to a string does not fail.
        let _ = write!(list, "{comma}{x:?}");
    }
    list
}
