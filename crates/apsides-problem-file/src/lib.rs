//! Optimal control problems as files: equations, bounds, units and guess in TOML.
//!
//! ```text
//! text -> parts with their places -> formulas with their units checked -> Ocp and Guess of apsides-ocp, in SI
//! ```
//!
//! A program can state the same parts ([`Model`]) and has the same checks and messages. The whole language of [`apsides_ocp`] can be written in a file; `docs/problems.md` of the project describes it. Every mistake is
//! refused with line, column and what is allowed; all that is missing is said at once. The crate reads no files by itself and holds no
//! method.
//!
//! ```
//! use apsides_problem_file::ProblemFile;
//!
//! let text = r#"
//! kind = "problem"
//! constants.gravity = "9.80665 m/s2"
//! [phase.slide]
//! time.end = [0.5, 10]
//! states.x = { unit = "m", min = 0, max = 10, start = 0, end = 10 }
//! states.depth = { unit = "m", min = 0, max = 10, start = 0, end = 5 }
//! states.v = { unit = "m/s", min = 0, max = 20, start = 0 }
//! controls.angle = { unit = "deg", min = 0, max = 180 }
//! dynamics = { x = "v*sin(angle)", depth = "v*cos(angle)", v = "gravity*cos(angle)" }
//! [objective]
//! minimize = "end.time"
//! "#;
//! let file = ProblemFile::parse(text, "slide.toml", &|_| Err(std::io::ErrorKind::NotFound.into()), &[])?;
//! let values: Vec<f64> = file.statement().constants().iter().map(|c| c.value).collect();
//! let posed = file.statement().pose(&values)?;
//! assert_eq!(posed.ocp.phases[0].controls[0].bounds.upper, std::f64::consts::PI);
//!
//! let wrong = text.replace("v*cos(angle)", "v + x");
//! let refused = ProblemFile::parse(&wrong, "slide.toml", &|_| Err(std::io::ErrorKind::NotFound.into()), &[])?.statement().pose(&values);
//! let sentence = refused.err().map(|e| e.to_string()).unwrap_or_default();
//! assert!(sentence.starts_with("slide.toml, line 10, column 43: `+` takes quantities of one unit, these are m/s and m"));
//! # Ok::<(), apsides_problem_file::ProblemError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`file`](mod@file) | [`ProblemFile`]: reading |
//! | [`write`](mod@write), [`export`] | the file with other values; the file of a problem that a program states |
//! | [`model`] | the parts of a problem, which a program can state, too |
//! | [`motion`] | the motion about a body that a problem states, for ephemerides |
//! | [`statement`] | [`Statement`]: the checked problem, posed for values of its constants |
//! | [`error`], [`missing`], [`place`] | mistakes, what is missing, and their places |
//! | [`schema`] | the tables and keys of a file as JSON Schema |
//! | [`program`] | formulas as programs of `apsides-ad` |
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

mod amounts;
mod ends;
pub mod error;
pub mod export;
pub mod file;
mod guess;
pub mod missing;
pub mod model;
pub mod motion;
mod motion_table;
mod names;
pub mod place;
mod pose;
pub mod program;
mod rates;
mod read;
mod reader;
pub mod schema;
pub mod statement;
mod tables;
pub mod write;

pub use error::ProblemError;
pub use file::ProblemFile;
pub use missing::Missing;
pub use model::{Constant, Model};
pub use motion::{PosedMotion, VehicleMotion};
pub use place::Place;
pub use program::Program;
pub use statement::{DeclaredUnit, PosedProblem, Statement};
pub use write::Written;
