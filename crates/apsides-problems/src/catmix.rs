//! Catalyst mixing: share of a catalyst along a tubular reactor, bang, singular, bang.
//!
//! ```text
//! minimise x1(1) + x2(1) - 1,   x1' = u (10 x2 - x1),   x2' = u (x1 - 10 x2) - (1 - u) x2
//! 0 <= u <= 1,   x(0) = (1, 0)
//! ```
//!
//! Value of COPS 3.0 (E. Dolan, J. More, T. Munson, ANL/MCS-TM-273, 2004), which another program confirms. Guess: the
//! start, `u = 1/2`.
//!
//! The Radau rule gains from a control that chatters along the singular arc, where the optimum does not fix it: -0.0480936
//! with 40 intervals of 8 points, -0.0480840 with 200 of 3. The gain shrinks only with the first power of the number of
//! points. COPS uses three Gauss points per interval instead.

use apsides_ad::{Dynamics, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, Sense, State, Term, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "catmix",
    title: "mixing of two catalysts along a reactor",
    structure: Structure::Singular,
    optimum: Optimum {
        value: -0.048_055_6,
        unit: "-",
        relative_tolerance: 1e-4,
        evidence: Evidence::SeveralPrograms,
        source: "COPS 3.0; COPSBenchmark.jl, catmix.jl",
    },
    pose,
};

struct Reactor;

impl Dynamics<2, 1> for Reactor {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        let exchange = u[0] * (x[1] * 10.0 - x[0]);
        [exchange, -exchange - (-u[0] + 1.0) * x[1]]
    }
}

struct Remainder;

impl VectorFunction<2, 1> for Remainder {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] + z[1] - 1.0]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("reactor", Reactor)
        .states([
            State::new("x1", "-").within(0.0, 1.0).starts_at(1.0),
            State::new("x2", "-").within(0.0, 1.0).starts_at(0.0),
        ])
        .controls([Variable::new("u", "-").within(0.0, 1.0)])
        .final_time(Bounds::fixed(1.0))
        .time_unit("-");
    let ends = [At::FinalState("reactor", "x1"), At::FinalState("reactor", "x2")];
    let remainder = Term::function(ends, Remainder);
    let ocp = Ocp::builder(PROBLEM.name)
        .phase(phase)
        .objective(Sense::Minimize, "remainder", "-", [remainder])
        .objective_scale(0.05)
        .build()?;
    Ok(Case::from_bounds(ocp))
}
