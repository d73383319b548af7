//! Swing-up of a pole on a cart with least effort.
//!
//! ```text
//! minimise int F^2 dt,   t in [0, 2],   |x| <= 2,   |F| <= 20,   (x, th, x', th') : (0, 0, 0, 0) -> (1, pi, 0, 0)
//! (M + m sin^2 th) x''     = F + m sin th (l th'^2 + g cos th)
//! (M + m sin^2 th) l th''  = -F cos th - m l th'^2 sin th cos th - (M + m) g sin th
//! M = 1, m = 0.3, l = 0.5, g = 9.81
//! ```
//!
//! M. Kelly, SIAM Review 59 (2017) 849, doi 10.1137/16M1062569. Programs agree on the value to 1e-3 only
//! (dymos 58.8839, ASSET 58.8322); three meshes with first-order conditions verified on the finest give 58.807667 here.
//! Guess: straight lines, no force.

use std::f64::consts::PI;

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "cart_pole",
    title: "swing-up of a pole on a cart with least effort",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 58.83,
        unit: "N2 s",
        relative_tolerance: 2e-3,
        evidence: Evidence::SeveralPrograms,
        source: "dymos, test_cartpole_opt.py; ASSET, test_CartPole.py",
    },
    pose,
};

const CART: f64 = 1.0;
const POLE: f64 = 0.3;
const LENGTH: f64 = 0.5;
const GRAVITY: f64 = 9.81;

struct CartPole;

impl Dynamics<4, 1> for CartPole {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 4], u: &[S; 1], _p: &[S; 0]) -> [S; 4] {
        let [_, angle, speed, rate] = *x;
        let (sin, cos) = angle.sin_cos();
        let inertia = sin.square() * POLE + CART;
        let swing = rate.square() * LENGTH;
        [
            speed,
            rate,
            (u[0] + sin * (swing + cos * GRAVITY) * POLE) / inertia,
            -(u[0] * cos + swing * sin * cos * POLE + sin * ((CART + POLE) * GRAVITY)) / (inertia * LENGTH),
        ]
    }
}

struct SquaredForce;

impl PathFunction<4, 1, 1> for SquaredForce {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 4], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("swing", CartPole)
        .states([
            State::new("position", "m").within(-2.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("angle", "rad").starts_at(0.0).ends_at(PI),
            State::new("speed", "m/s").starts_at(0.0).ends_at(0.0).scaled_by(5.0),
            State::new("angular rate", "rad/s").starts_at(0.0).ends_at(0.0).scaled_by(10.0),
        ])
        .controls([Variable::new("force", "N").within(-20.0, 20.0)])
        .final_time(Bounds::fixed(2.0))
        .integral(Variable::new("effort", "N2 s"), SquaredForce);
    let ocp = Ocp::builder(PROBLEM.name)
        .phase(phase)
        .minimize_integral("swing", "effort")
        .objective_scale(100.0)
        .build()?;
    Ok(Case::from_bounds(ocp))
}
