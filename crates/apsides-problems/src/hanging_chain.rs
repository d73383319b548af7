//! Hanging chain: the shape of least potential energy, with its length as an integral equality.
//!
//! ```text
//! minimise int x sqrt(1 + u^2) dt,   x' = u,   int sqrt(1 + u^2) dt = 4,   x(0) = 1,   x(1) = 3,   t in [0, 1]
//! ```
//!
//! Optimum: the catenary, its constants solved to double precision. The COPS value 5.06891 is that of a discretisation.
//! Guess: straight line between the ends, slope 2.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "hanging_chain",
    title: "chain of given length with least potential energy",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 5.068_480_110_993_422,
        unit: "-",
        relative_tolerance: 1e-6,
        evidence: Evidence::ClosedForm,
        source: "catenary; statement: PSOPT, chain.cxx",
    },
    pose,
};

struct Slope;

impl Dynamics<1, 1> for Slope {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

struct Length;

impl PathFunction<1, 1, 1> for Length {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(u[0].square() + 1.0).sqrt()]
    }
}

struct Energy;

impl PathFunction<1, 1, 1> for Energy {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 1], u: &[S; 1], p: &[S; 0]) -> [S; 1] {
        [x[0] * Length.evaluate(t, x, u, p)[0]]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("chain", Slope)
        .states([State::new("x", "-").within(-10.0, 10.0).starts_at(1.0).ends_at(3.0)])
        .controls([Variable::new("u", "-").within(-20.0, 20.0)])
        .final_time(Bounds::fixed(1.0))
        .time_unit("-")
        .integral(Variable::new("length", "-").equal_to(4.0), Length)
        .integral(Variable::new("energy", "-"), Energy);
    let ocp = Ocp::builder(PROBLEM.name).phase(phase).minimize_integral("chain", "energy").build()?;
    Case::from_ends(ocp, (0.0, &[1.0], &[2.0]), (1.0, &[3.0], &[2.0]))
}
