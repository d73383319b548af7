//! Brachistochrone between two points, `(0, 10)` to `(10, 5)`.
//!
//! ```text
//! minimise tf,   x' = v sin theta,   y' = -v cos theta,   v' = g cos theta,   g = 9.80665
//! x(0) = 0, y(0) = 10, v(0) = 0,   x(tf) = 10, y(tf) = 5
//! ```
//!
//! Optimum: the cycloid through both points, `tf = phi sqrt(R / g)` with `R (phi - sin phi) = 10`, `R (1 - cos phi) =
//! 5`. Guess: straight lines, angle from 0 to 100 deg, 2 s.

use std::f64::consts::PI;

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "brachistochrone_dymos",
    title: "fastest slide between two points",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 1.801_603_122_453_081_5,
        unit: "s",
        relative_tolerance: 1e-9,
        evidence: Evidence::ClosedForm,
        source: "cycloid; statement: dymos, examples/brachistochrone",
    },
    pose,
};

struct Bead;

impl Dynamics<3, 1> for Bead {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let (sin, cos) = u[0].sin_cos();
        [x[2] * sin, -x[2] * cos, cos * 9.80665]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("slide", Bead)
        .states([
            State::new("x", "m").within(0.0, 10.0).starts_at(0.0).ends_at(10.0),
            State::new("y", "m").within(0.0, 10.0).starts_at(10.0).ends_at(5.0),
            State::new("v", "m/s").within(0.0, 20.0).starts_at(0.0),
        ])
        .controls([Variable::new("angle", "rad").within(0.0, PI)])
        .final_time(Bounds::new(0.5, 10.0));
    let ocp =
        Ocp::builder(PROBLEM.name).phase(phase).minimize("time", "s", At::FinalTime("slide")).build()?;
    Case::from_ends(ocp, (0.0, &[0.0, 10.0, 0.0], &[0.0]), (2.0, &[10.0, 5.0, 9.9], &[1.75]))
}
