//! Equations of motion, orbits, bodies and impulsive manoeuvres for spaceflight.
//!
//! ```text
//! dx/dt = f(t, x, u)
//! ```
//!
//! for the vehicles and bodies of the missions, each written once, generic in the scalar of `apsides-ad`, in SI units. The crate knows
//! no phases, meshes or solvers: use it for a simulation as well as for an optimisation.
//!
//! ```
//! use apsides_ad::Dynamics;
//! use apsides_dynamics::{Body, Engine, planar::{ConstantThrust, PlanarFlight}};
//!
//! let moon = Body::MOON;
//! let engine = Engine::new(440.0, 310.0)?;
//! let lander = ConstantThrust(PlanarFlight::new(moon, engine));
//! let speed = moon.circular_speed(100e3)?;
//! let state = [moon.radius + 100e3, 0.0, speed, 0.0, 300.0]; // radius, angle, horizontal, radial speed, mass
//! let thrust_angle = [std::f64::consts::PI]; // against the motion
//! let rate = lander.rate(0.0, &state, &thrust_angle, &[]);
//! assert!((rate[2] + 440.0 / 300.0).abs() < 1e-12); // horizontal deceleration, m/s2
//! # Ok::<(), apsides_dynamics::DynamicsError>(())
//! ```
//!
//! | module | subject |
//! | --- | --- |
//! | [`body`] | central bodies, circular and elliptic speeds |
//! | [`engine`] | thrust, exhaust velocity, rocket equation |
//! | [`transfer`] | Hohmann transfers |
//! | [`impulsive`] | transfers by impulses from an inclined circular orbit, the change of plane divided for the least sum |
//! | [`elements`] | classical and modified equinoctial elements, Cartesian and planar polar states, and conversions |
//! | [`kepler`] | motion on a conic: propagation, Kepler's equation, time between true longitudes |
//! | [`planar`] | planar polar flight: coasting, constant or throttled thrust, limited pitch rate, vertical flight |
//! | [`planar::flat`] | flat maps of planar flight |
//! | [`equinoctial`] | orbital flight with finite thrust in modified equinoctial elements, in the plane and in space |
//! | [`cartesian`] | the same flight in Cartesian coordinates |
//! | [`gravity`] | gravity fields in spherical harmonics |
//! | [`powered_descent`] | flight with throttled thrust over a rotating body, in spherical coordinates fixed to it |
//! | [`great_circle`] | distances, courses and destinations on the sphere |
//! | [`frames`] | inertial, body-fixed and local axes |
//! | [`atmosphere`] | exponential and standard atmospheres, tables |
//! | [`aerodynamics`] | coefficients of lift and drag, vehicles of atmospheric entry |
//! | [`aerodynamics::axisymmetric`] | forces and moments of axisymmetric bodies from tables over Mach number and angle of attack |
//! | [`attitude`] | unit quaternions |
//! | [`ellipsoid`] | the reference ellipsoid: geodetic coordinates, normal gravity |
//! | [`rigid_body`] | flight of a rigid body in six degrees of freedom, over a plane or the rotating ellipsoid, in wind |
//! | [`moving_mass`] | the same with two masses that move inside the body |
//! | [`heating`] | laws of convective heating |
//! | [`planet`] | bodies with rotation, oblateness and atmosphere |
//! | [`entry`] | flight without thrust through the atmosphere of a rotating planet, loads |
//! | [`quantity`] | names and units of states and controls |
//!
//! Reference: D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., 2013, ISBN 978-1881883189.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod aerodynamics;
pub mod atmosphere;
pub mod attitude;
pub mod body;
pub mod cartesian;
pub mod elements;
pub mod ellipsoid;
pub mod engine;
pub mod entry;
pub mod equinoctial;
pub mod error;
pub mod frames;
pub mod gravity;
pub mod great_circle;
pub mod heating;
pub mod impulsive;
pub mod kepler;
pub mod moving_mass;
pub mod planar;
pub mod planet;
pub mod powered_descent;
pub mod quantity;
pub mod rigid_body;
pub mod transfer;

pub use aerodynamics::{Aerodynamics, EntryVehicle};
pub use atmosphere::Atmosphere;
pub use body::Body;
pub use ellipsoid::Ellipsoid;
pub use engine::Engine;
pub use error::DynamicsError;
pub use gravity::GravityField;
pub use heating::HeatingLaw;
pub use moving_mass::MovingMassVehicle;
pub use planet::Planet;
pub use quantity::Quantity;
pub use rigid_body::RigidBody;
pub use transfer::{Hohmann, TransferPoint};
