//! Goddard's rocket in the form of COPS: highest altitude with a singular arc between full thrust and coast.
//!
//! ```text
//! maximise h(tf),   h' = v,   v' = (T - D) / m - 1/h^2,   m' = -2 T,   D = 310 v^2 exp(-500 (h - 1)),   0 <= T <= 3.5
//! h >= 1,   v >= 0,   (h, v, m)(0) = (1, 0, 1),   m(tf) = 0.6
//! ```
//!
//! Printed value of COPS 3.0 (E. Dolan, J. More, T. Munson, ANL/MCS-TM-273, 2004). Texts with `exp(-500 h)` have hardly
//! any drag and the optimum 1.025336: another problem. Four refined meshes agree on
//! 1.0128369 here, less than a unit of the last printed digit away. Guess: straight lines to `h = 1.01`, half thrust,
//! 0.2 s.

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "goddard_cops",
    title: "highest altitude of a rocket in an atmosphere",
    structure: Structure::Singular,
    optimum: Optimum {
        value: 1.012_83,
        unit: "-",
        relative_tolerance: 1e-4,
        evidence: Evidence::Published,
        source: "COPS 3.0; COPSBenchmark.jl, rocket.jl",
    },
    pose,
};

const MAX_THRUST: f64 = 3.5;

struct Rocket;

impl Dynamics<3, 1> for Rocket {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let [h, v, m] = *x;
        let drag = v.square() * ((h - 1.0) * -500.0).exp() * 310.0;
        [v, (u[0] - drag) / m - h.powi(-2), u[0] * -2.0]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("ascent", Rocket)
        .states([
            State::new("h", "-").within(1.0, 1.1).starts_at(1.0).scaled_by(0.01),
            State::new("v", "-").within(0.0, 1.0).starts_at(0.0).scaled_by(0.1),
            State::new("m", "-").within(0.6, 1.0).starts_at(1.0).ends_at(0.6),
        ])
        .controls([Variable::new("T", "-").within(0.0, MAX_THRUST)])
        .final_time(Bounds::new(0.05, 1.0))
        .time_unit("-");
    let ocp = Ocp::builder(PROBLEM.name)
        .phase(phase)
        .maximize("altitude", "-", At::FinalState("ascent", "h"))
        .objective_scale(0.01)
        .build()?;
    let thrust = [0.5 * MAX_THRUST];
    Case::from_ends(ocp, (0.0, &[1.0, 0.0, 1.0], &thrust), (0.2, &[1.01, 0.1, 0.6], &thrust))
}
