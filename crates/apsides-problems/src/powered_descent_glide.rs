//! The landing of [`powered_descent`](crate::powered_descent) inside a cone above the site.
//!
//! ```text
//! |z| <= x tan 86 deg
//! ```
//!
//! Case c of B. Acikmese and S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353, doi 10.2514/1.27553, with 81 s on their grid of whole
//! seconds. Guess: as without the cone.

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{OcpError, Variable};

use crate::powered_descent::{descent, least_propellant};
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "powered_descent_glide",
    title: "Mars landing inside a cone with least propellant",
    structure: Structure::BangBang,
    optimum: Optimum {
        value: 399.5,
        unit: "kg",
        relative_tolerance: 1e-3,
        evidence: Evidence::Published,
        source: "Acikmese and Ploen 2007, case c",
    },
    pose,
};

/// Height above both sides of the cone.
struct AboveCone {
    slope: f64,
}

impl PathFunction<5, 2, 2> for AboveCone {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [x[0] - x[1] * self.slope, x[0] + x[1] * self.slope]
    }
}

fn pose() -> Result<Case, OcpError> {
    let row = |name| Variable::new(name, "m").at_least(0.0).scaled_by(1000.0);
    let rows = [row("height above the cone ahead"), row("height above the cone behind")];
    let cone = AboveCone { slope: 4.0_f64.to_radians().tan() };
    least_propellant(PROBLEM.name, descent().path(rows, cone))
}
