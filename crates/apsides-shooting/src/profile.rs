//! Control profiles: piecewise polynomials of time or energy, flown through the equations of motion.
//!
//! ```text
//! u(s) = P_k(s) on sub-interval k of [0, 1],   s = (t - t_0) / (t_f - t_0)  or  (E_0 - E(x)) / (E_0 - E_f)
//! decision vector -> profile -> flight -> objective, misses at the end, excesses along the way
//! ```
//!
//! A few numbers stand for a control, and each of them makes a trajectory: the form of an optimal control problem for searches
//! without derivatives, whose best flight is a start for any other method. Number and lengths of the sub-intervals can be decision
//! variables.
//!
//! The limits of the method: it has no search and no derivatives, takes one phase, and meets end conditions and path constraints only as
//! far as the search makes it ([`ProfileScore`]).
//!
//! ```
//! use apsides_ad::{Dynamics, Scalar};
//! use apsides_ocp::{At, Bounds, Ocp, Phase, State, Variable};
//! use apsides_shooting::profile::{FlightEnd, FlightRules, MeshWish, ProfileScore, ProfileShape, ProfileShooting, Stop};
//!
//! struct Fall;
//! impl Dynamics<2, 1> for Fall {
//!     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
//!         [x[1], u[0] - 9.81] // height, speed
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
//! let shape = ProfileShape::of_controls(0, 2, &ocp.phases[0]);
//! let rules = FlightRules::new(shape).until(Stop::at_end(&ocp.phases[0], "height")?);
//! let shooting = ProfileShooting::new(&ocp, rules)?;
//! // Free fall for 2 s, thrust for the next 2 s and beyond; the last number is the end of the profile.
//! let decision = [0.0, 10.0, 4.0];
//! let score = ProfileScore::new(&shooting, 10.0);
//! let (end, time, cost) = shooting.flown(&decision, |f| (f.end, f.final_time, score.penalised(f)))?;
//! assert_eq!(end, FlightEnd::Stopped);
//! assert!(cost > time); // It comes down too fast.
//! let start = shooting.start(&decision, MeshWish { intervals: 8, points: 4, joints: true })?;
//! assert_eq!(start.trajectory.phases[0].final_time, time);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`shape`], [`curve`] | the box of the decision vectors; a decoded profile |
//! | [`rules`], `unknowns` | what is flown, and how; what the problem leaves open |
//! | [`shooting`], `motion`, `watch` | the flight |
//! | [`flight`], [`limits`], [`score`] | what it gives, bounded quantities, what they cost |
//! | [`start`] | guess and mesh for another method |
//!
//! Reference: S. Alami Naeini, J. Roshanian, Modares Mechanical Engineering 14(13), 2014 (polynomials of normalised energy, number and
//! length of the sub-intervals as decision variables).

pub mod curve;
pub mod flight;
pub mod limits;
mod motion;
pub mod rules;
pub mod score;
pub mod shape;
pub mod shooting;
pub mod start;
mod unknowns;
mod watch;

pub use curve::Profile;
pub use flight::{Excess, Flight, FlightEnd};
pub use limits::{Limit, Quantity};
pub use rules::{ControlFunction, FlightRules, FlightSettings, Independent, StateFunction, Steering, Stop};
pub use score::ProfileScore;
pub use shape::{MAX_DEGREE, MAX_INTERVALS, ProfileShape};
pub use shooting::{FlightWorkspace, ProfileShooting};
pub use start::{MeshWish, ProfileStart};
