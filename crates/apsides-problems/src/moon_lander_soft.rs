//! Vertical soft landing with least propellant: coast, then full thrust.
//!
//! ```text
//! minimise int T dt,   h' = v,   v' = T/m - 1,   m' = -T / 2.349,   0 <= T <= 1.227
//! h(0) = 1,   v(0) = -0.783,   m(0) = 1,   h(tf) = v(tf) = 0
//! ```
//!
//! Optimum: switch at 0.239259, landing at 1.396808 (theory: J. Meditch, IEEE Trans. Autom. Control 9 (1964) 477, doi
//! 10.1109/TAC.1964.1105758), the two end conditions solved to double precision. Guess: straight lines, half thrust.

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "moon_lander_soft",
    title: "vertical landing with least propellant",
    structure: Structure::BangBang,
    optimum: Optimum {
        value: 1.420_312_599_049_197_8,
        unit: "-",
        relative_tolerance: 1e-6,
        evidence: Evidence::ClosedForm,
        source: "coast and burn; statement: PSOPT, moon.cxx",
    },
    pose,
};

const MAX_THRUST: f64 = 1.227;
const EXHAUST_VELOCITY: f64 = 2.349;

struct SoftLander;

impl Dynamics<3, 1> for SoftLander {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        [x[1], u[0] / x[2] - 1.0, -u[0] / EXHAUST_VELOCITY]
    }
}

struct Thrust;

impl PathFunction<3, 1, 1> for Thrust {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("descent", SoftLander)
        .states([
            State::new("h", "-").within(0.0, 2.0).starts_at(1.0).ends_at(0.0),
            State::new("v", "-").within(-2.0, 2.0).starts_at(-0.783).ends_at(0.0),
            State::new("m", "-").within(0.01, 1.0).starts_at(1.0),
        ])
        .controls([Variable::new("T", "-").within(0.0, MAX_THRUST)])
        .final_time(Bounds::new(0.1, 10.0))
        .time_unit("-")
        .integral(Variable::new("impulse", "-"), Thrust);
    let ocp = Ocp::builder(PROBLEM.name).phase(phase).minimize_integral("descent", "impulse").build()?;
    let thrust = [0.5 * MAX_THRUST];
    Case::from_ends(ocp, (0.0, &[1.0, -0.783, 1.0], &thrust), (1.5, &[0.0, 0.0, 0.6], &thrust))
}
