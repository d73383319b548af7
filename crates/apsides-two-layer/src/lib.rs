//! Optimal control in two layers: a search without derivatives over control profiles finds a start, a method with derivatives finishes.
//!
//! ```text
//! first layer:    z -> control profile -> flight -> J + price of misses + price of excesses,   minimised over a box of z
//! second layer:   the problem itself, from the states and controls of the best flight
//! ```
//!
//! The search needs no guess and passes by local minima; the second layer meets end conditions and limits, which the search meets only as
//! far as their price makes it. The crate joins three that know nothing of each other: [`apsides_shooting::profile`] turns a vector of
//! numbers into a control profile and flies it, [`apsides_metaheuristics`] minimises what the flight costs, and any
//! [`Method`](apsides_ocp::Method) takes the best flight as its guess, with its mesh.
//!
//! It takes problems of one phase, and reads no files: where a search is to survive its program, a [`Checkpoint`] keeps its state.
//!
//! ```
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_metaheuristics::Search;
//! use apsides_ocp::{At, Bounds, Guess, Method, Ocp, Phase, Start, State, Variable};
//! use apsides_radau::Radau;
//! use apsides_shooting::profile::{Independent, Steering};
//! use apsides_two_layer::{ProfileModel, TwoLayer, TwoLayerSettings};
//!
//! struct Fall;
//! impl Dynamics<2, 1> for Fall {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], u[0] - 10.0] // height, speed
//!     }
//! }
//!
//! let phase = Phase::new("fall", Fall)
//!     .states([
//!         State::new("height", "m").within(-1.0, 200.0).starts_at(100.0).ends_at(0.0),
//!         State::new("speed", "m/s").within(-60.0, 60.0).starts_at(0.0).ends_at(0.0),
//!     ])
//!     .controls([Variable::new("thrust", "m/s2").within(0.0, 20.0)])
//!     .final_time(Bounds::new(1.0, 20.0));
//! let ocp = Ocp::builder("fall").phase(phase).minimize("time", "s", At::FinalTime("fall")).build()?;
//! let method = TwoLayer {
//!     settings: TwoLayerSettings { search: Search { budget: 300, ..Search::default() }, ..TwoLayerSettings::default() },
//!     profile: ProfileModel {
//!         independent: Independent::Time,
//!         bounds: vec![Bounds::new(0.0, 20.0)],
//!         steering: Steering::Controls,
//!         stop: "height".into(),
//!         distance_per_unit: vec![1.0, 1.0],
//!     },
//!     second: Box::new(Radau::default()),
//!     checkpoint: None,
//! };
//! let solution = method.solve(&ocp, &Start::new(Guess::linear(&ocp)), &mut ())?;
//! // Free fall for sqrt(10) s, then full thrust for as long.
//! assert!((solution.trajectory.objective - 2.0 * 10_f64.sqrt()).abs() < 1e-6);
//! assert!(solution.search.is_some_and(|s| s.evaluations == 300));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`settings`] | the profiles, the search, the price of misses and excesses |
//! | [`search`] | the first layer, its checkpoints |
//! | [`method`] | both layers as a [`Method`](apsides_ocp::Method) |
//! | [`error`] | what is refused |
//!
//! Reference: M. Alami Naeini, J. Roshanian, Modares Mechanical Engineering 14(13), 2014 (particle swarm, ant colony and genetic algorithm
//! that exchange their best, over polynomials of normalised energy).
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod error;
pub mod method;
pub mod search;
pub mod settings;

pub use error::TwoLayerError;
pub use method::TwoLayer;
pub use search::{Checkpoint, Found};
pub use settings::{ProfileModel, Ranking, TwoLayerSettings};
