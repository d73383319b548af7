//! End-to-end benchmarks, and the discretised landing that `peers/` hands to other solvers.
//!
//! | where | what is measured |
//! | --- | --- |
//! | `benches/missions.rs` | mission file to certificate, every mission |
//! | `benches/nodes.rs` | one solve of the landing over the number of nodes |
//! | `src/bin/landing.rs` | the same in detail, as text or JSON; writes the problem for a peer |
//! | `peers/landing.py` | the same problem by CasADi and Ipopt, in turns with the program above |

pub mod cpu_time;
pub mod landing;

pub use cpu_time::CpuTime;
pub use landing::{Landing, Start};
