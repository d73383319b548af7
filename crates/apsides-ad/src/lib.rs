//! Exact derivatives of small vector functions, with their sparsity.
//!
//! A model is written once, generic in a [`Scalar`]:
//!
//! ```text
//! dx/dt = f(t, x, u, p)
//! ```
//!
//! and evaluated on `f64` for values, on [`Dual`] for Jacobians, on [`HyperDual`] for Hessians weighted by
//! multipliers, and on [`Dependence`] for the structure of both. Where the model is made of elementary functions, choices and tables alone,
//! Hessians, and Jacobians at many points, come from its formula by straight-line programs in vector lanes instead, which are several times as
//! fast. A [`NodeFunction`] hides the scalar and the array sizes, so that a transcription can hold models of any size. A
//! [`FormulaBuilder`] makes node functions of operations, for models that are read at run time.
//!
//! The crate does not differentiate loops over time and does not build global sparse matrices: it is meant for functions that are evaluated at many points. Models in Rust
//! have at most 64 inputs, formulas any number.
//!
//! ```
//! use apsides_ad::{Dynamics, NodeFunction, Scalar, dynamics_node};
//!
//! struct Pendulum { gravity: f64, length: f64 }
//!
//! impl Dynamics<2, 1> for Pendulum {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], u[0] - x[0].sin() * (self.gravity / self.length)]
//!     }
//! }
//!
//! let node = dynamics_node(Pendulum { gravity: 9.8, length: 2.0 });
//! let z = [0.0, 0.5, 0.1, 0.0]; // angle, rate, torque, time
//! let (mut rate, mut jacobian) = ([0.0; 2], [0.0; 3]);
//! node.jacobian(&z, &mut rate, &mut jacobian);
//! assert_eq!(rate, [0.5, 0.1]);
//! assert_eq!(jacobian, [1.0, -4.9, 1.0]); // d(angle')/d(rate), d(rate')/d(angle), d(rate')/d(torque)
//! ```
//!
//! The same from a formula, evaluated at two points in one call:
//!
//! ```
//! use apsides_ad::{FormulaBuilder, formula_node};
//!
//! let mut b = FormulaBuilder::new(4);
//! let [angle, rate, torque] = [0, 1, 2].map(|k| b.input(k));
//! let (stiffness, sine) = (b.constant(4.9), b.sin(angle));
//! let pull = b.mul(sine, stiffness);
//! let acceleration = b.sub(torque, pull);
//! let node = formula_node(b.formula(&[rate, acceleration])?);
//!
//! let mut rates = [0.0; 4];
//! node.values(2, &[0.0, 0.5, 0.1, 0.0, 0.0, 0.7, 0.2, 1.0], &mut rates);
//! assert_eq!(rates, [0.5, 0.1, 0.7, 0.2]);
//! # Ok::<(), apsides_ad::AdError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`scalar`] | the trait and its elementary functions |
//! | [`dual`], [`hyper_dual`] | first and second derivatives in lanes |
//! | [`pattern`] | structure of Jacobian and Hessian |
//! | [`model`] | the traits that a user implements |
//! | [`node`] | models with sizes and scalar erased |
//! | [`formula`] | straight-line programs as data, and their JSON |
//! | [`builder`] | formulas made operation by operation |
//! | [`expansion`] | values and derivatives of a formula over a box |
//! | [`kinks`] | where a formula is not smooth |
//! | [`trace`] | models as formulas |
//! | [`spline`] | tables in one and two variables as functions of scalars |
//! | [`pchip`] | tables in one variable that keep the shape of their data |
//! | [`table`] | tables as operations of formulas |
//! | [`taylor`] | Taylor coefficients of solutions of `x' = f`, by recurrences |
//! | [`vector`] | products and smooth norms |
//! | [`error`] | reasons to refuse a formula or a table |
//!
//! References: J. Fike and J. Alonso, The development of hyper-dual numbers for exact second-derivative calculations,
//! AIAA 2011-886, doi 10.2514/6.2011-886. R. Gower and M. Mello, A new framework for the computation of Hessians,
//! Optim. Methods Softw. 27 (2012), doi 10.1080/10556788.2011.580098.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod builder;
mod curve_enclosure;
mod derivatives;
pub mod divisions;
pub mod dual;
mod enclosure;
pub mod error;
pub mod expansion;
pub mod formula;
mod formula_node;
mod graph;
pub mod hyper_dual;
mod interval;
pub mod kinks;
mod linear;
pub mod model;
pub mod node;
pub mod pattern;
pub mod pchip;
mod plan;
mod program;
pub mod scalar;
mod specialised;
pub mod spline;
mod structure;
pub mod table;
mod tape;
pub mod taylor;
pub mod trace;
pub mod vector;

pub use builder::{FormulaBuilder, Value};
pub use divisions::Divisions;
pub use dual::Dual;
pub use error::{AdError, Taker};
pub use expansion::{Derivatives, Expansion};
pub use formula::Formula;
pub use formula_node::formula_node;
pub use hyper_dual::HyperDual;
pub use kinks::{Condition, FormulaKink};
pub use model::{Dynamics, FlatMap, PathFunction, VectorFunction};
pub use node::{NodeFunction, dynamics_node, flat_node, path_node, vector_node};
pub use pattern::{Dependence, NodePattern};
pub use pchip::{Outside, Pchip};
pub use scalar::Scalar;
pub use spline::{BicubicSpline, CubicSpline};
pub use table::Table;
pub use taylor::{TaylorError, TaylorSeries};
