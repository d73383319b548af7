//! Van der Pol oscillator with a bounded control.
//!
//! ```text
//! minimise int x1^2 + x2^2 + u^2 dt,   x1' = (1 - x2^2) x1 - x2 + u,   x2' = x1,   -0.3 <= u <= 1
//! x(0) = (0, 1),   t in [0, 5]
//! ```
//!
//! The value is the printed one of PROPT. Guess: the start, `u = 0.35`.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "van_der_pol",
    title: "damping of an oscillator with a bounded control",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 2.867_259_54,
        unit: "-",
        relative_tolerance: 1e-5,
        evidence: Evidence::Published,
        source: "PROPT, tomdyn.com/examples/vanDerPol.html",
    },
    pose,
};

struct VanDerPolOscillator;

impl Dynamics<2, 1> for VanDerPolOscillator {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [(-x[1].square() + 1.0) * x[0] - x[1] + u[0], x[0]]
    }
}

struct VanDerPolCost;

impl PathFunction<2, 1, 1> for VanDerPolCost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0].square() + x[1].square() + u[0].square()]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("damp", VanDerPolOscillator)
        .states([State::new("x1", "-").starts_at(0.0), State::new("x2", "-").starts_at(1.0)])
        .controls([Variable::new("u", "-").within(-0.3, 1.0)])
        .final_time(Bounds::fixed(5.0))
        .time_unit("-")
        .integral(Variable::new("cost", "-"), VanDerPolCost);
    let ocp = Ocp::builder(PROBLEM.name).phase(phase).minimize_integral("damp", "cost").build()?;
    Ok(Case::from_bounds(ocp))
}
