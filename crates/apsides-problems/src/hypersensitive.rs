//! Hypersensitive problem: boundary layers of width 1 at both ends of a phase of length 50, or of length 10000.
//!
//! ```text
//! minimise int (x^2 + u^2)/2 dt,   x' = -x^3 + u,   x(0) = 1.5,   x(T) = 1,   T = 50 or 10000
//! ```
//!
//! Optimum: the sum of the costs along the stable and the unstable manifold of the origin, by quadrature; the error is
//! of the order of `exp(-50)`, so that the value holds for every longer phase (A. Rao and K. Mease, Automatica 35 (1999)
//! 633). With the length 10000 the layers are a ten-thousandth of the phase: the mesh has to find them.
//! Guess: straight line.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem with length 50.
pub const PROBLEM: Problem = Problem {
    name: "hypersensitive",
    title: "boundary layers at both ends of a long phase",
    structure: Structure::Smooth,
    optimum: OPTIMUM,
    pose: || pose(PROBLEM.name, 50.0),
};

/// The problem with length 10000.
pub const LONG: Problem = Problem {
    name: "hypersensitive_long",
    title: "boundary layers of a ten-thousandth of the phase",
    structure: Structure::Smooth,
    optimum: OPTIMUM,
    pose: || pose(LONG.name, 10_000.0),
};

const OPTIMUM: Optimum = Optimum {
    value: 1.330_806_904_943_001,
    unit: "-",
    relative_tolerance: 1e-6,
    evidence: Evidence::ClosedForm,
    source: "manifold quadrature; statement: PSOPT, hypersensitive.cxx",
};

struct Cubic;

impl Dynamics<1, 1> for Cubic {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0] - x[0].powi(3)]
    }
}

struct HypersensitiveCost;

impl PathFunction<1, 1, 1> for HypersensitiveCost {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(x[0].square() + u[0].square()) * 0.5]
    }
}

fn pose(name: &str, length: f64) -> Result<Case, OcpError> {
    let phase = Phase::new("whole", Cubic)
        .states([State::new("x", "-").starts_at(1.5).ends_at(1.0)])
        .controls([Variable::new("u", "-")])
        .final_time(Bounds::fixed(length))
        .time_unit("-")
        .integral(Variable::new("cost", "-"), HypersensitiveCost);
    let ocp = Ocp::builder(name).phase(phase).minimize_integral("whole", "cost").build()?;
    Ok(Case::from_bounds(ocp))
}
