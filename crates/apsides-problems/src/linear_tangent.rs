//! Linear tangent steering: constant thrust to a height and a horizontal speed in least time.
//!
//! ```text
//! minimise tf,   x1' = x2,   x2' = a cos u,   x3' = x4,   x4' = a sin u,   a = 100,   |u| <= pi/2
//! x(0) = 0,   x2(tf) = 45,   x3(tf) = 5,   x4(tf) = 0
//! ```
//!
//! Optimum: `tan u` is linear in time (A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975), the end
//! conditions solved to double precision. The COPS value 0.554577 is that of a discretisation. Guess: straight lines,
//! 0.6 s, `u = 0`.

use std::f64::consts::FRAC_PI_2;

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "linear_tangent",
    title: "constant thrust to height and speed in least time",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 0.554_570_878_334_603_1,
        unit: "-",
        relative_tolerance: 1e-8,
        evidence: Evidence::ClosedForm,
        source: "tan u linear in t; statement: PSOPT, lts.cxx",
    },
    pose,
};

struct Steering;

impl Dynamics<4, 1> for Steering {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 4], u: &[S; 1], _p: &[S; 0]) -> [S; 4] {
        let (sin, cos) = u[0].sin_cos();
        [x[1], cos * 100.0, x[3], sin * 100.0]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("ascent", Steering)
        .states([
            State::new("x1", "-").within(0.0, 30.0).starts_at(0.0),
            State::new("x2", "-").within(0.0, 100.0).starts_at(0.0).ends_at(45.0),
            State::new("x3", "-").within(0.0, 10.0).starts_at(0.0).ends_at(5.0),
            State::new("x4", "-").within(-50.0, 50.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("u", "rad").within(-FRAC_PI_2, FRAC_PI_2)])
        .final_time(Bounds::new(0.1, 2.0))
        .time_unit("-");
    let ocp =
        Ocp::builder(PROBLEM.name).phase(phase).minimize("time", "-", At::FinalTime("ascent")).build()?;
    Case::from_ends(ocp, (0.0, &[0.0; 4], &[0.0]), (0.6, &[12.0, 45.0, 5.0, 0.0], &[0.0]))
}
