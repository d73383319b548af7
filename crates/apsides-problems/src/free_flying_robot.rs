//! Free-flying robot with two pairs of opposed thrusters: least propellant in a given time, bang, off, bang.
//!
//! ```text
//! minimise int u1 + u2 + u3 + u4 dt,   0 <= u <= 1,   F1 = u1 - u2,   F2 = u3 - u4,   t in [0, 12]
//! x'' = (F1 + F2) cos th,   y'' = (F1 + F2) sin th,   th'' = 0.2 (F1 - F2)
//! (x, y, th) : (-10, -10, pi/2) -> (0, 0, 0), at rest at both ends
//! ```
//!
//! Y. Sakawa, Optim. Control Appl. Methods 20 (1999) 235. The value is asserted to 0.01 by the tests
//! of ASSET, which is the tolerance; the value here is 7.910147 with the jumps of the control at free times. Guess: straight lines, no thrust.

use std::f64::consts::FRAC_PI_2;

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "free_flying_robot",
    title: "robot in the plane with least propellant",
    structure: Structure::BangBang,
    optimum: Optimum {
        value: 7.9115,
        unit: "-",
        relative_tolerance: 1.3e-3,
        evidence: Evidence::Published,
        source: "ASSET, test_FreeFlyingRobot.py",
    },
    pose,
};

struct Robot;

impl Dynamics<6, 4> for Robot {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 4], _p: &[S; 0]) -> [S; 6] {
        let (first, second) = (u[0] - u[1], u[2] - u[3]);
        let (sin, cos) = x[4].sin_cos();
        [x[2], x[3], (first + second) * cos, (first + second) * sin, x[5], (first - second) * 0.2]
    }
}

struct Propellant;

impl PathFunction<6, 4, 1> for Propellant {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 6], u: &[S; 4], _p: &[S; 0]) -> [S; 1] {
        [u[0] + u[1] + u[2] + u[3]]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("flight", Robot)
        .states([
            State::new("x", "-").within(-12.0, 2.0).starts_at(-10.0).ends_at(0.0),
            State::new("y", "-").within(-12.0, 2.0).starts_at(-10.0).ends_at(0.0),
            State::new("vx", "-").within(-5.0, 5.0).starts_at(0.0).ends_at(0.0),
            State::new("vy", "-").within(-5.0, 5.0).starts_at(0.0).ends_at(0.0),
            State::new("theta", "rad").within(-3.2, 3.2).starts_at(FRAC_PI_2).ends_at(0.0),
            State::new("omega", "-").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls(["u1", "u2", "u3", "u4"].map(|name| Variable::new(name, "-").within(0.0, 1.0)))
        .final_time(Bounds::fixed(12.0))
        .time_unit("-")
        .integral(Variable::new("propellant", "-"), Propellant);
    let ocp = Ocp::builder(PROBLEM.name).phase(phase).minimize_integral("flight", "propellant").build()?;
    let (start, end) = ([-10.0, -10.0, 0.0, 0.0, FRAC_PI_2, 0.0], [0.0; 6]);
    Case::from_ends(ocp, (0.0, &start, &[0.0; 4]), (12.0, &end, &[0.0; 4]))
}
