//! Bryson-Denham: least effort to turn around below a ceiling, a state constraint of second order.
//!
//! ```text
//! minimise int u^2/2 dt,   x' = v,   v' = u,   x <= 1/9,   t in [0, 1]
//! x(0) = x(1) = 0,   v(0) = 1,   v(1) = -1
//! ```
//!
//! Optimum `4 / (9 l)` with the ceiling `l = 1/9 <= 1/6`: 4 (A. E. Bryson, W. Denham, S. Dreyfus, AIAA Journal 1 (1963)
//! 2544, doi 10.2514/3.2107). The ceiling is touched along `[3l, 1 - 3l]`, where `u = 0`. Guess: straight lines.

use apsides_ocp::{Bounds, Ocp, OcpError, State, Variable};

use crate::double_integrator::{Effort, phase};
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "bryson_denham",
    title: "least effort turn below a ceiling",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 4.0,
        unit: "-",
        relative_tolerance: 1e-6,
        evidence: Evidence::ClosedForm,
        source: "4/(9l), l = 1/9; statement: PSOPT, bryson_denham.cxx",
    },
    pose,
};

fn pose() -> Result<Case, OcpError> {
    let x = State::new("x", "-").within(-1.0, 1.0 / 9.0).starts_at(0.0).ends_at(0.0);
    let v = State::new("v", "-").within(-2.0, 2.0).starts_at(1.0).ends_at(-1.0);
    let turn =
        phase(x, v, 20.0).final_time(Bounds::fixed(1.0)).integral(Variable::new("effort", "-"), Effort);
    let ocp = Ocp::builder(PROBLEM.name).phase(turn).minimize_integral("move", "effort").build()?;
    Ok(Case::from_bounds(ocp))
}
