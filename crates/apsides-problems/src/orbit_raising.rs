//! Orbit raising: largest circular orbit that a small constant thrust reaches in a given time.
//!
//! ```text
//! maximise r(tf),   r' = vr,   theta' = vt/r,   vr' = vt^2/r - 1/r^2 + a u1,   vt' = -vr vt/r + a u2
//! a = 0.1405 / (1 - 0.0749 t),   u1^2 + u2^2 = 1,   t in [0, 3.32]
//! (r, theta, vr, vt)(0) = (1, 0, 0, 1),   vr(tf) = 0,   vt(tf) = 1 / sqrt(r(tf))
//! ```
//!
//! A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975; the value is asserted by the tests of yapss.
//! Guess: straight lines to the circular orbit of radius 1.5, thrust along the track.

use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "orbit_raising",
    title: "largest circular orbit with a small thrust",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 1.525_277_7,
        unit: "r0",
        relative_tolerance: 1e-7,
        evidence: Evidence::Published,
        source: "yapss, tests/examples/test_orbit_raising.py",
    },
    pose,
};

struct Orbit;

impl Dynamics<4, 2> for Orbit {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 4], u: &[S; 2], _p: &[S; 0]) -> [S; 4] {
        let [r, _, vr, vt] = *x;
        let a = (-t * 0.0749 + 1.0).recip() * 0.1405;
        [vr, vt / r, vt.square() / r - r.powi(-2) + a * u[0], a * u[1] - vr * vt / r]
    }
}

struct DirectionInPlane;

impl PathFunction<4, 2, 1> for DirectionInPlane {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 4], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square()]
    }
}

struct CircularSpeed;

impl VectorFunction<2, 1> for CircularSpeed {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[1] - z[0].powf(-0.5)]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("raise", Orbit)
        .states([
            State::new("r", "r0").within(0.5, 5.0).starts_at(1.0),
            State::new("theta", "rad").within(0.0, 6.0).starts_at(0.0),
            State::new("vr", "-").within(-1.0, 1.0).starts_at(0.0).ends_at(0.0),
            State::new("vt", "-").within(0.1, 2.0).starts_at(1.0),
        ])
        .controls([Variable::new("u1", "-").within(-1.1, 1.1), Variable::new("u2", "-").within(-1.1, 1.1)])
        .final_time(Bounds::fixed(3.32))
        .time_unit("-")
        .path([Variable::new("length of the direction", "-").equal_to(1.0)], DirectionInPlane);
    let ocp = Ocp::builder(PROBLEM.name)
        .phase(phase)
        .constrain(
            "circular orbit",
            [Variable::new("excess speed", "-").equal_to(0.0)],
            [At::FinalState("raise", "r"), At::FinalState("raise", "vt")],
            CircularSpeed,
        )
        .maximize("radius", "r0", At::FinalState("raise", "r"))
        .build()?;
    Case::from_ends(
        ocp,
        (0.0, &[1.0, 0.0, 0.0, 1.0], &[0.0, 1.0]),
        (3.32, &[1.5, 2.5, 0.0, 0.8165], &[0.0, 1.0]),
    )
}
