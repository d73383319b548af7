//! Brachistochrone to a vertical line: the fastest slide from rest to `x = 1`, at any depth.
//!
//! ```text
//! minimise tf,   x' = v cos u,   y' = v sin u,   v' = g sin u,   g = 32.174,   0 <= u <= pi/2
//! x(0) = y(0) = v(0) = 0,   x(tf) = 1
//! ```
//!
//! Optimum `tf = sqrt(pi / g)`: the cycloid that meets the line at a right angle (A. E. Bryson and Y.-C. Ho, Applied
//! Optimal Control, 1975). Guess: slope of 45 deg down to `(1, 1)` in 0.4 s.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "brachistochrone_free_y",
    title: "fastest slide to a vertical line",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 0.312_480_130_708_664_65,
        unit: "s",
        relative_tolerance: 1e-8,
        evidence: Evidence::ClosedForm,
        source: "sqrt(pi/g); statement: yapss, examples/brachistochrone.py",
    },
    pose,
};

/// Slide without friction: `x`, depth `y`, speed `v`; the control is the slope below the horizontal.
pub(crate) struct Slide;

const GRAVITY: f64 = 32.174;

impl Dynamics<3, 1> for Slide {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let (sin, cos) = u[0].sin_cos();
        [x[2] * cos, x[2] * sin, sin * GRAVITY]
    }
}

/// The phase `slide`, in feet.
pub(crate) fn slide() -> Phase {
    Phase::new("slide", Slide)
        .states([
            State::new("x", "ft").within(0.0, 1.0).starts_at(0.0).ends_at(1.0),
            State::new("y", "ft").within(0.0, 2.0).starts_at(0.0),
            State::new("v", "ft/s").within(0.0, 20.0).starts_at(0.0),
        ])
        .controls([Variable::new("slope", "rad").within(0.0, FRAC_PI_2)])
        .final_time(Bounds::new(0.05, 2.0))
}

/// Least time of `slide`, from the guess of the module head.
pub(crate) fn fastest(name: &str, slide: Phase) -> Result<Case, OcpError> {
    let ocp = Ocp::builder(name).phase(slide).minimize("time", "s", At::FinalTime("slide")).build()?;
    Case::from_ends(ocp, (0.0, &[0.0; 3], &[FRAC_PI_4]), (0.4, &[1.0, 1.0, 8.0], &[FRAC_PI_4]))
}

fn pose() -> Result<Case, OcpError> {
    fastest(PROBLEM.name, slide())
}
