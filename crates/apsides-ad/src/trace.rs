//! Models as formulas.
//!
//! [`NodeFunction::formula`](crate::NodeFunction::formula) runs a model once on a scalar that records every operation.
//! The result is a [`Formula`], which evaluates to the same numbers as the model on `f64` and is written as JSON by
//! [`Formula::to_json`]. A composition with a closure ([`Scalar::map`], [`Scalar::map2`]) has no formula.
//!
//! ```
//! use apsides_ad::{Scalar, VectorFunction, vector_node};
//!
//! struct Area;
//! impl VectorFunction<2, 1> for Area {
//!     fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
//!         [z[0] * z[1].sin() * 0.5]
//!     }
//! }
//!
//! let formula = vector_node(Area).formula()?;
//! let json = r#"{"inputs":2,"operations":[["sin",1],["mul",0,2],["constant",0.5],["mul",3,4]],"outputs":[5]}"#;
//! assert_eq!(formula.to_json(), json);
//! # Ok::<(), apsides_ad::trace::OpaqueFunction>(())
//! ```

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::Arc;

use crate::formula::{Binary, Formula, Operation, Unary};
use crate::pchip::Pchip;
use crate::scalar::{Scalar, derived_operators};
use crate::spline::{BicubicSpline, CubicSpline};
use crate::table::Table;
use crate::tape::Tape;

/// A model contains a function that is known by its values alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpaqueFunction {
    /// Path of the closure in its crate.
    pub name: String,
}

impl std::fmt::Display for OpaqueFunction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` is known by its values alone and cannot be written as a formula", self.name)
    }
}

impl std::error::Error for OpaqueFunction {}

/// The operations that a recording has seen so far.
#[derive(Default)]
struct Recording {
    tape: Tape,
    opaque: Option<OpaqueFunction>,
}

thread_local! {
    // A scalar is `Copy` and cannot hold its recording.
    static RECORDING: RefCell<Recording> = RefCell::default();
}

/// A value of the recording that runs on this thread. It exists inside [`record`] alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trace(usize);

/// Runs `model`, which takes its inputs one by one and returns its outputs, and keeps what it did.
pub(crate) fn record(
    inputs: usize,
    model: impl FnOnce(&dyn Fn(usize) -> Trace) -> Vec<Trace>,
) -> Result<Formula, OpaqueFunction> {
    // A model may itself ask for the formula of another one.
    let outer = RECORDING.replace(Recording { tape: Tape::new(inputs), opaque: None });
    let outputs: Vec<usize> = model(&Trace).iter().map(|v| v.0).collect();
    let Recording { tape, opaque } = RECORDING.replace(outer);
    match opaque {
        Some(function) => Err(function),
        None => Ok(tape.formula(&outputs)),
    }
}

impl Trace {
    fn push(operation: Operation) -> Self {
        RECORDING.with_borrow_mut(|r| Self(r.tape.push(operation)))
    }

    fn unary(self, op: Unary) -> Self {
        Self::push(Operation::Unary(op, self.0))
    }

    fn binary(self, op: Binary, other: Self) -> Self {
        Self::push(Operation::Binary(op, self.0, other.0))
    }

    fn table(table: impl Into<Table>) -> usize {
        let table = Arc::new(table.into());
        RECORDING.with_borrow_mut(|r| r.tape.table(table))
    }

    fn opaque<G>(self, _: &G) -> Self {
        RECORDING.with_borrow_mut(|r| {
            r.opaque.get_or_insert_with(|| OpaqueFunction { name: std::any::type_name::<G>().into() });
        });
        self
    }
}
impl From<f64> for Trace {
    fn from(c: f64) -> Self {
        Self::push(Operation::Constant(c))
    }
}

impl Neg for Trace {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(Unary::Neg)
    }
}

macro_rules! recorded_operators {
    ($($trait:ident<$other:ty> $method:ident),*) => {$(
        impl $trait<$other> for Trace {
            type Output = Self;
            fn $method(self, other: $other) -> Self {
                self.binary(Binary::$trait, other.into())
            }
        }
    )*};
}
recorded_operators!(
    Add<Trace> add, Sub<Trace> sub, Mul<Trace> mul, Div<Trace> div, Add<f64> add, Mul<f64> mul, Div<f64> div
);

derived_operators!([] Trace);

/// Functions of one operand, by their variant.
macro_rules! recorded_functions {
    ($($method:ident $variant:ident),*) => {$(
        fn $method(self) -> Self {
            self.unary(Unary::$variant)
        }
    )*};
}

impl Scalar for Trace {
    fn map(self, g: impl Fn(f64) -> [f64; 3]) -> Self {
        self.opaque(&g)
    }

    fn map2(self, _: Self, g: impl Fn(f64, f64) -> [f64; 6]) -> Self {
        self.opaque(&g)
    }

    recorded_functions!(
        sin Sin, cos Cos, tan Tan, asin Asin, acos Acos, atan Atan, sqrt Sqrt, exp Exp, ln Ln, sinh Sinh, cosh Cosh,
        tanh Tanh, asinh Asinh, acosh Acosh, atanh Atanh, cbrt Cbrt, recip Recip, abs Abs, sign Sign
    );

    fn atan2(self, x: Self) -> Self {
        self.binary(Binary::Atan2, x)
    }

    fn pow(self, exponent: Self) -> Self {
        self.binary(Binary::Pow, exponent)
    }

    fn min(self, other: Self) -> Self {
        self.binary(Binary::Min, other)
    }

    fn max(self, other: Self) -> Self {
        self.binary(Binary::Max, other)
    }

    fn select(self, a: Self, b: Self) -> Self {
        Self::push(Operation::Select(self.0, a.0, b.0))
    }

    fn cubic_spline(self, table: &CubicSpline) -> Self {
        Self::push(Operation::Curve(Self::table(table.clone()), self.0))
    }

    fn pchip(self, table: &Pchip) -> Self {
        Self::push(Operation::Curve(Self::table(table.clone()), self.0))
    }

    fn bicubic_spline(self, y: Self, table: &BicubicSpline) -> Self {
        Self::push(Operation::Surface(Self::table(table.clone()), self.0, y.0))
    }

    fn powi(self, n: i32) -> Self {
        match n {
            0 => Self::from(1.0),
            1 => self,
            _ => Self::push(Operation::Powi(self.0, n)),
        }
    }

    fn powf(self, n: f64) -> Self {
        Self::push(Operation::Powf(self.0, n))
    }
}

#[cfg(test)]
mod tests;
