//! End-to-end benchmarks, and the nonlinear programs that `peers/` hands to other solvers.
//!
//! | where | what is measured |
//! | --- | --- |
//! | `benches/missions.rs` | mission file to certificate, every mission |
//! | `benches/nodes.rs` | one solve of the landing over the number of nodes |
//! | `src/bin/landing.rs` | the same in detail, as text or JSON; writes the problem for a peer |
//! | `src/bin/program.rs` | programs of the gallery and of Hock and Schittkowski: solved, or written for a peer |
//! | `src/bin/flatness.rs` | landings with constant thrust on B-splines and on Radau points: solved, or written for a peer |
//! | `src/bin/convex.rs` | powered descents by lossless convexification: one solve, a divert decision over 50 sites |
//! | `src/bin/latency.rs` | one conic program of a powered descent from dispersed starts: mean, 99.9 % and largest time; written for a peer |
//! | `src/bin/geo.rs` | injections into geostationary orbit by any method of the missions |
//! | `src/bin/hazard.rs` | hazard maps of raw heights on some threads |
//! | `src/bin/moving_mass.rs` | closed-loop descents of the capsule with moving masses |
//! | `src/bin/propagation.rs` | ten lunar orbits and an entry by both schemes of `apsides-ode` and by `ode_solvers` |
//! | `src/bin/resolve.rs` | solves of a mission after changes of its values, a step along the derivative, dispersed values |
//! | `peers/landing.py` | the landing by CasADi and Ipopt, in turns with `landing` |
//! | `peers/convex.py` | the conic programs of `convex` by CVXPY and Clarabel, in turns with `convex` |
//! | `peers/latency.py` | those of `latency` by QOCO, ECOS and Clarabel |
//! | `peers/resolve.py` | what `resolve` finds, without a peer |
//! | `peers/flatness.py` | those of `flatness` by CasADi and Ipopt |
//! | `peers/geo.py` | those of `geo` by SciPy, CasADi and Ipopt |
//! | `peers/hazard.py` | those of `hazard` by OpenCV and NumPy |
//! | `peers/moving_mass.py` | those of `moving_mass` by numba and plain Python |
//! | `peers/propagation.py` | those of `propagation` by heyoka and numba |
//! | `peers/gallery.py`, `peers/hock_schittkowski.py` | those of `program` by CasADi and Ipopt |

pub mod cpu_time;
pub mod flat;
pub mod formulas;
pub mod landing;
pub mod numbers;
pub mod peak_memory;
pub mod timed;

use mimalloc::MiMalloc;

pub use cpu_time::CpuTime;
pub use flat::FlatLanding;
pub use formulas::Formulas;
pub use landing::{Landing, Start};
pub use numbers::Numbers;
pub use peak_memory::peak_memory;
pub use timed::Timed;

/// That of the program `apsides`: what a stranger gets.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;
