//! Scalar linear-quadratic regulator.
//!
//! ```text
//! minimise int (5/8) x^2 + x u / 2 + u^2 / 2 dt,   x' = x/2 + u,   x(0) = 1,   t in [0, 1]
//! ```
//!
//! Optimum `tanh(1) / 2` (W. Hager, H. Hou, A. Rao, J. Optim. Theory Appl. 169 (2016) 801, doi
//! 10.1007/s10957-016-0929-7). Guess: `x = 1`, `u = 0`.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "lqr_scalar",
    title: "linear-quadratic regulator",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 0.380_797_077_977_882_4,
        unit: "-",
        relative_tolerance: 1e-11,
        evidence: Evidence::ClosedForm,
        source: "tanh(1)/2; statement: MAPTOR, examples/lqr/lqr.py",
    },
    pose,
};

struct Unstable;

impl Dynamics<1, 1> for Unstable {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * 0.5 + u[0]]
    }
}

struct LqrCost;

impl PathFunction<1, 1, 1> for LqrCost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0].square() * 0.625 + x[0] * u[0] * 0.5 + u[0].square() * 0.5]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("regulate", Unstable)
        .states([State::new("x", "-").starts_at(1.0)])
        .controls([Variable::new("u", "-")])
        .final_time(Bounds::fixed(1.0))
        .time_unit("-")
        .integral(Variable::new("cost", "-"), LqrCost);
    let ocp = Ocp::builder(PROBLEM.name).phase(phase).minimize_integral("regulate", "cost").build()?;
    Ok(Case::from_bounds(ocp))
}
