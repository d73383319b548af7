//! The functions that every formula knows.

use crate::dimension::Dimension;

/// An elementary function of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// Opposite number.
    Negate,
    /// Absolute value.
    Abs,
    /// Sign: -1, 0 or 1.
    Sign,
    /// Square root.
    Sqrt,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Sine of an angle in rad.
    Sin,
    /// Cosine of an angle in rad.
    Cos,
    /// Tangent of an angle in rad.
    Tan,
    /// Arc sine, in rad.
    Asin,
    /// Arc cosine, in rad.
    Acos,
    /// Arc tangent, in rad.
    Atan,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Inverse hyperbolic sine.
    Asinh,
    /// Inverse hyperbolic cosine.
    Acosh,
    /// Inverse hyperbolic tangent.
    Atanh,
    /// Cube root.
    Cbrt,
}

/// An elementary function of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binary {
    /// Sum.
    Add,
    /// Difference.
    Subtract,
    /// Product.
    Multiply,
    /// Quotient.
    Divide,
    /// Power.
    Power,
    /// Angle of the point (second, first operand) in (-pi, pi].
    Atan2,
    /// The smaller one.
    Min,
    /// The larger one.
    Max,
}

/// The rule by which a function treats dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    /// Pure numbers in, a pure number out.
    Number,
    /// Any dimension, which stays.
    Keeps,
    /// Any dimension; a pure number out.
    Any,
}

impl Unary {
    /// The functions by name, with the rule of each.
    const NAMES: [(&'static str, Self, Rule); 19] = [
        ("sin", Self::Sin, Rule::Number),
        ("cos", Self::Cos, Rule::Number),
        ("tan", Self::Tan, Rule::Number),
        ("asin", Self::Asin, Rule::Number),
        ("acos", Self::Acos, Rule::Number),
        ("atan", Self::Atan, Rule::Number),
        ("sinh", Self::Sinh, Rule::Number),
        ("cosh", Self::Cosh, Rule::Number),
        ("tanh", Self::Tanh, Rule::Number),
        ("asinh", Self::Asinh, Rule::Number),
        ("acosh", Self::Acosh, Rule::Number),
        ("atanh", Self::Atanh, Rule::Number),
        ("exp", Self::Exp, Rule::Number),
        ("ln", Self::Ln, Rule::Number),
        ("log", Self::Ln, Rule::Number),
        ("sqrt", Self::Sqrt, Rule::Any),
        ("cbrt", Self::Cbrt, Rule::Any),
        ("abs", Self::Abs, Rule::Keeps),
        ("sign", Self::Sign, Rule::Any),
    ];

    /// Its name in formulas; the opposite number is a sign and has none.
    #[must_use]
    pub fn name(self) -> Option<&'static str> {
        Self::NAMES.iter().find(|(_, f, _)| *f == self).map(|(name, ..)| *name)
    }

    /// The function at a number.
    #[must_use]
    pub fn at(self, x: f64) -> f64 {
        match self {
            Self::Negate => -x,
            Self::Abs => x.abs(),
            Self::Sign if x == 0.0 => 0.0,
            Self::Sign => x.signum(),
            Self::Sqrt => x.sqrt(),
            Self::Exp => x.exp(),
            Self::Ln => x.ln(),
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Sinh => x.sinh(),
            Self::Cosh => x.cosh(),
            Self::Tanh => x.tanh(),
            Self::Asinh => x.asinh(),
            Self::Acosh => x.acosh(),
            Self::Atanh => x.atanh(),
            Self::Cbrt => x.cbrt(),
        }
    }
}

impl Binary {
    /// The function at two numbers.
    #[must_use]
    pub fn at(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Add => x + y,
            Self::Subtract => x - y,
            Self::Multiply => x * y,
            Self::Divide => x / y,
            Self::Power if y.fract() == 0.0 && y.abs() <= f64::from(i32::MAX) => x.powi(y as i32),
            Self::Power => x.powf(y),
            Self::Atan2 => x.atan2(y),
            Self::Min => x.min(y),
            Self::Max => x.max(y),
        }
    }
}

/// A function of one name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Known {
    Unary(Unary, Rule),
    /// `atan2(y, x)`
    Atan2,
    /// `hypot(x, y, ..)`: the length of a vector.
    Hypot,
    /// `min(a, b, ..)`, `max(a, b, ..)`.
    Extreme(Binary),
    /// `if(condition, then, else)`.
    If,
    /// `clamp(x, least, most)`.
    Clamp,
    /// `pow(x, y)`, `log10(x)`.
    Power,
    Log10,
}

/// The functions that are written in terms of others.
const COMPOSED: [(&str, Known); 8] = [
    ("atan2", Known::Atan2),
    ("hypot", Known::Hypot),
    ("min", Known::Extreme(Binary::Min)),
    ("max", Known::Extreme(Binary::Max)),
    ("if", Known::If),
    ("clamp", Known::Clamp),
    ("pow", Known::Power),
    ("log10", Known::Log10),
];

/// The function of a name.
pub(crate) fn known(name: &str) -> Option<Known> {
    let unary = Unary::NAMES.iter().find(|(n, ..)| *n == name).map(|(_, f, rule)| Known::Unary(*f, *rule));
    unary.or_else(|| COMPOSED.iter().find(|(n, _)| *n == name).map(|(_, known)| *known))
}

/// Names of the functions that every formula knows.
pub fn function_names() -> impl Iterator<Item = &'static str> {
    Unary::NAMES.iter().map(|(name, ..)| *name).chain(COMPOSED.iter().map(|(name, _)| *name))
}

/// Numbers that every formula knows: name, value, dimension.
pub(crate) const CONSTANTS: [(&str, f64, Dimension); 2] = [
    ("pi", std::f64::consts::PI, Dimension::NONE),
    // Standard gravity, which also is the unit of a specific impulse (CGPM 1901).
    ("g0", 9.80665, Dimension::new([1.0, 0.0, -2.0, 0.0, 0.0, 0.0])),
];

/// Names of the numbers that every formula knows, unless it is given others of these names.
pub fn constant_names() -> impl Iterator<Item = &'static str> {
    CONSTANTS.iter().map(|(name, ..)| *name)
}
