//! Rayleigh oscillator with a constraint on state and control together.
//!
//! ```text
//! minimise int u^2 + x1^2 dt,   x1' = x2,   x2' = -x1 + x2 (1.4 - 0.14 x2^2) + 4 u,   u + x1/6 <= 0
//! x(0) = (-5, -5),   t in [0, 4.5]
//! ```
//!
//! Value of J. T. Betts, Practical Methods for Optimal Control Using Nonlinear Programming, 3rd edition, example
//! 10.113. The example of PSOPT ends with 44.77625, 6.3e-4 lower:
//! the value of its coarse mesh. Refined meshes give 44.804445 here, in agreement with Betts.
//! Guess: straight lines from the start
//! to the origin, `u = 0`.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "rayleigh_path",
    title: "oscillator with a constraint on state and control",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 44.804_443_3,
        unit: "-",
        relative_tolerance: 1e-6,
        evidence: Evidence::Published,
        source: "Betts, 3rd edition, example 10.113; statement: PSOPT, rayleigh.cxx",
    },
    pose,
};

struct RayleighOscillator;

impl Dynamics<2, 1> for RayleighOscillator {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], x[1] * (-x[1].square() * 0.14 + 1.4) - x[0] + u[0] * 4.0]
    }
}

struct RayleighCost;

impl PathFunction<2, 1, 1> for RayleighCost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + x[0].square()]
    }
}

struct Mixed;

impl PathFunction<2, 1, 1> for Mixed {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] + x[0] / 6.0]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("damp", RayleighOscillator)
        .states([State::new("x1", "-").starts_at(-5.0), State::new("x2", "-").starts_at(-5.0)])
        .controls([Variable::new("u", "-")])
        .final_time(Bounds::fixed(4.5))
        .time_unit("-")
        .path([Variable::new("mixed", "-").at_most(0.0).scaled_by(1.0)], Mixed)
        .integral(Variable::new("cost", "-"), RayleighCost);
    let ocp = Ocp::builder(PROBLEM.name).phase(phase).minimize_integral("damp", "cost").build()?;
    Case::from_ends(ocp, (0.0, &[-5.0, -5.0], &[0.0]), (4.5, &[0.0, 0.0], &[0.0]))
}
