//! Double integrator whose optimal control is bang, singular, bang.
//!
//! ```text
//! minimise int (1 + v^2)/2 dt,   x' = v,   v' = u,   |u| <= 1,   tf free,   (x, v): (2, 0) -> (5, 0)
//! ```
//!
//! Optimum 10/3: `u = 1` until 1, `u = 0` with `v = 1` until 3, `u = -1` until `tf = 4` (A. Locatelli, Optimal Control
//! of a Double Integrator, Springer 2017, problem 11.2-1a). Guess: straight lines, 5 s.

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, State, Variable};

use crate::double_integrator::phase;
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "di_singular_arc",
    title: "trade of time and speed with a singular arc",
    structure: Structure::Singular,
    optimum: Optimum {
        value: 10.0 / 3.0,
        unit: "-",
        relative_tolerance: 1e-6,
        evidence: Evidence::ClosedForm,
        source: "bang, singular, bang; statement: PSOPT, singular_di.cxx",
    },
    pose,
};

struct TimeAndSpeed;

impl PathFunction<2, 1, 1> for TimeAndSpeed {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(x[1].square() + 1.0) * 0.5]
    }
}

fn pose() -> Result<Case, OcpError> {
    let x = State::new("x", "-").within(0.0, 10.0).starts_at(2.0).ends_at(5.0);
    let v = State::new("v", "-").within(-5.0, 5.0).starts_at(0.0).ends_at(0.0);
    let trip = phase(x, v, 1.0)
        .final_time(Bounds::new(1.0, 20.0))
        .integral(Variable::new("cost", "-"), TimeAndSpeed);
    let ocp = Ocp::builder(PROBLEM.name).phase(trip).minimize_integral("move", "cost").build()?;
    Case::from_ends(ocp, (0.0, &[2.0, 0.0], &[0.0]), (5.0, &[5.0, 0.0], &[0.0]))
}
