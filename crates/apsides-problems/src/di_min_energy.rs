//! Double integrator from rest to rest with least effort.
//!
//! ```text
//! minimise int u^2/2 dt,   x' = v,   v' = u,   t in [0, 1],   x(0) = v(0) = v(1) = 0,   x(1) = 1
//! ```
//!
//! Optimum 6 with `u = 6 - 12 t`. Guess: straight lines.

use apsides_ocp::{Bounds, Ocp, OcpError, State, Variable};

use crate::double_integrator::{Effort, phase};
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "di_min_energy",
    title: "least effort from rest to rest",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 6.0,
        unit: "-",
        relative_tolerance: 1e-10,
        evidence: Evidence::ClosedForm,
        source: "u = 6 - 12 t; statement: PSOPT, mineng_di.cxx",
    },
    pose,
};

/// Least effort to `x = 1` with the given state `v`.
pub(crate) fn least_effort(name: &str, v: State) -> Result<Case, OcpError> {
    let x = State::new("x", "-").starts_at(0.0).ends_at(1.0);
    let push = phase(x, v, f64::INFINITY)
        .final_time(Bounds::fixed(1.0))
        .integral(Variable::new("effort", "-"), Effort);
    let ocp = Ocp::builder(name).phase(push).minimize_integral("move", "effort").build()?;
    Ok(Case::from_bounds(ocp))
}

fn pose() -> Result<Case, OcpError> {
    least_effort(PROBLEM.name, State::new("v", "-").starts_at(0.0).ends_at(0.0))
}
