//! The brachistochrone of [`brachistochrone_free_y`](crate::brachistochrone_free_y) above a sloping wall.
//!
//! ```text
//! y <= x / 2 + 0.1
//! ```
//!
//! The path touches the wall along an arc (A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975). The
//! value is asserted by the tests of yapss. Guess: as without the wall.

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{OcpError, Variable};

use crate::brachistochrone_free_y::{fastest, slide};
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "brachistochrone_wall",
    title: "fastest slide to a vertical line above a wall",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 0.323_331_164_025_862,
        unit: "s",
        relative_tolerance: 1e-6,
        evidence: Evidence::Published,
        source: "yapss, tests/examples/test_brachistochrone.py",
    },
    pose,
};

struct BelowWall;

impl PathFunction<3, 1, 1> for BelowWall {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 3], _u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[1] - x[0] * 0.5 - 0.1]
    }
}

fn pose() -> Result<Case, OcpError> {
    let wall = Variable::new("depth below the wall", "ft").at_most(0.0).scaled_by(1.0);
    fastest(PROBLEM.name, slide().path([wall], BelowWall))
}
