//! Double integrator: the farthest way from rest to rest in one second.
//!
//! ```text
//! maximise x(1),   x' = v,   v' = u,   |u| <= 1,   x(0) = v(0) = v(1) = 0
//! ```
//!
//! Optimum 1/4: `u = 1` until 1/2, then `u = -1`. Guess: straight lines to `x = 0.2`.

use apsides_ocp::{At, Bounds, Ocp, OcpError, State};

use crate::double_integrator::phase;
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "di_bang_bang",
    title: "farthest way from rest to rest",
    structure: Structure::BangBang,
    optimum: Optimum {
        value: 0.25,
        unit: "-",
        relative_tolerance: 1e-8,
        evidence: Evidence::ClosedForm,
        source: "one switch in the middle; statement: dymos, examples/double_integrator",
    },
    pose,
};

fn pose() -> Result<Case, OcpError> {
    let x = State::new("x", "-").within(-1.0, 1.0).starts_at(0.0);
    let v = State::new("v", "-").within(-1.0, 1.0).starts_at(0.0).ends_at(0.0);
    let dash = phase(x, v, 1.0).final_time(Bounds::fixed(1.0));
    let farthest = At::FinalState("move", "x");
    let ocp = Ocp::builder(PROBLEM.name).phase(dash).maximize("distance", "-", farthest).build()?;
    Case::from_ends(ocp, (0.0, &[0.0, 0.0], &[0.0]), (1.0, &[0.2, 0.0], &[0.0]))
}
