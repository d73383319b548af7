//! Bryson-Denham: least effort to turn around below a ceiling, a state constraint of second order.
//!
//! ```text
//! minimise int u^2/2 dt,   x' = v,   v' = u,   x <= 1/9,   t in [0, 1]
//! x(0) = x(1) = 0,   v(0) = 1,   v(1) = -1
//! ```
//!
//! Optimum `4 / (9 l)` with the ceiling `l = 1/9 <= 1/6`: 4 (A. E. Bryson, W. Denham, S. Dreyfus, AIAA Journal 1 (1963)
//! 2544, doi 10.2514/3.2107). The ceiling is touched along `[3l, 1 - 3l]`, where `u = 0`. Guess: straight lines.
//!
//! [`CONTACT`] has the ceiling `l = 1/5` as a path constraint. For `1/6 <= l <= 1/4` it is touched at `t = 1/2` alone: two cubics
//! with `x(1/2) = l` and `v(1/2) = 0` have `u` from `24 l - 8` at the ends to `4 - 24 l` in the middle, so that the optimum is
//! `2 + 6 (1 - 4l)^2`. The costate of `x` is `u'`: it jumps from `24 (1 - 4l)` to its negative, which makes the
//! multiplier of the contact `48 (1 - 4l)`, minus the derivative of the optimum by `l`.

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::double_integrator::{Effort, phase};
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "bryson_denham",
    title: "least effort turn below a ceiling",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 4.0,
        unit: "-",
        relative_tolerance: 1e-6,
        evidence: Evidence::ClosedForm,
        source: "4/(9l), l = 1/9; statement: PSOPT, bryson_denham.cxx",
    },
    pose,
};

/// The problem with a ceiling that is touched in one instant.
pub const CONTACT: Problem = Problem {
    name: "bryson_denham_contact",
    title: "least effort turn that touches a ceiling",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 2.24,
        unit: "-",
        relative_tolerance: 1e-8,
        evidence: Evidence::ClosedForm,
        source: "2 + 6 (1 - 4l)^2, l = 1/5; statement: Bryson, Denham, Dreyfus 1963",
    },
    pose: pose_contact,
};

/// The position.
struct Position;

impl PathFunction<2, 1, 1> for Position {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0]]
    }
}

fn pose_contact() -> Result<Case, OcpError> {
    let ceiling = Variable::new("ceiling", "-").at_most(0.2);
    let ocp = Ocp::builder(CONTACT.name)
        .phase(turn(1.0).path([ceiling], Position))
        .minimize_integral("move", "effort")
        .build()?;
    Ok(Case::from_bounds(ocp))
}

fn pose() -> Result<Case, OcpError> {
    let ocp =
        Ocp::builder(PROBLEM.name).phase(turn(1.0 / 9.0)).minimize_integral("move", "effort").build()?;
    Ok(Case::from_bounds(ocp))
}

/// The phase below a bound on the position.
fn turn(highest: f64) -> Phase {
    let x = State::new("x", "-").within(-1.0, highest).starts_at(0.0).ends_at(0.0);
    let v = State::new("v", "-").within(-2.0, 2.0).starts_at(1.0).ends_at(-1.0);
    phase(x, v, 20.0).final_time(Bounds::fixed(1.0)).integral(Variable::new("effort", "-"), Effort)
}
