//! Formulas as text: parsed, their names resolved, their units checked, and made into operations one by one.
//!
//! ```text
//! "0.5*density(h)*v^2*area" -> parts -> value in SI with its dimension -> operations of a Recorder
//! ```
//!
//! The crate evaluates nothing but numbers: what depends on more goes to a [`Recorder`], which makes a program of it. It knows no
//! problems and no files; a mistake has its place in a text ([`Span`]), and whoever has the text says which line that is.
//!
//! ```
//! use apsides_expressions::{Compiler, Expression, Library, Numbers, Quantity, Unit, Value};
//!
//! let library = Library::default();
//! let mut compiler = Compiler::new(Numbers, &library, true);
//! let kilometres = Unit::parse("km")?;
//! compiler.name("h", Quantity::new(Value::Number(3.0 * kilometres.factor), kilometres.dimension));
//! let found = compiler.compile(&Expression::parse("sqrt(2*g0*h)", 0)?, None, "speed")?;
//! assert_eq!(found.dimension.to_string(), "m/s");
//! assert_eq!(found.number(), Some((2.0_f64 * 9.80665 * 3000.0).sqrt()));
//! let refused = compiler.compile(&Expression::parse("h + 3 [s]", 0)?, None, "speed").unwrap_err();
//! assert_eq!(refused.to_string(), "`+` takes quantities of one unit, these are m and s");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`dimension`], [`unit`](mod@unit) | exponents of base units; units by name |
//! | [`syntax`] | the parser |
//! | [`build`], [`text`] | formulas that are not written as text; formulas as text again |
//! | [`function`] | the functions that every formula knows |
//! | [`library`], [`quantity`] | definitions and tables; values with dimensions |
//! | [`compile`], [`recorder`], [`numbers`] | operations from formulas, and what takes them |
//! | [`suggestion`], [`toml_mistake`] | the name that may be meant; mistakes in the syntax of files, in words |
//!
//! Reference: V. Pratt, Top down operator precedence, POPL 1973, doi 10.1145/512927.512931.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod build;
pub mod compile;
pub mod dimension;
pub mod error;
pub mod function;
pub mod library;
pub mod numbers;
pub mod quantity;
pub mod recorder;
pub mod suggestion;
pub mod syntax;
pub mod text;
mod token;
pub mod toml_mistake;
pub mod unit;

pub use compile::Compiler;
pub use dimension::Dimension;
pub use error::{ExpressionError, Span};
pub use function::{constant_names, function_names};
pub use library::{Definition, Library, Table, heading};
pub use numbers::Numbers;
pub use quantity::{Quantity, Value};
pub use recorder::Recorder;
pub use syntax::{Expression, Relation};
pub use token::{Comparison, is_name};
pub use unit::{Unit, UnitError};

#[cfg(test)]
mod tests;
