//! Planar vertical take-off and landing aircraft from rest to rest with least effort.
//!
//! ```text
//! minimise int (u1 - 1)^2 + u2^2 dt,   t in [0, 5],   0.1 <= u1 <= 3
//! x'' = -u1 sin th + e u2 cos th,   z'' = u1 cos th + e u2 sin th - 1,   th'' = u2,   e = 0.3
//! (x, z, th) : (0, 0, 0) -> (3, 1, 0), at rest at both ends
//! ```
//!
//! In units of gravity; the rolling moment `u2` pushes sideways by the coupling `e`. The system is differentially flat with the centre
//! of oscillation `(x - e sin th, z + e cos th)`: P. Martin, S. Devasia, B. Paden, A different look at output tracking: control of a
//! VTOL aircraft, Automatica 32 (1996) 101. The attitude follows the thrust, so that this must not vanish. Optimum: Radau
//! collocation in CasADi with Ipopt, 60 intervals of 7 points (40 of 5: 7.304372272), and collocation of the flat outputs. Guess:
//! straight lines, thrust against gravity.

use apsides_ad::{Dynamics, FlatMap, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "pvtol",
    title: "vertical take-off aircraft from rest to rest with least effort",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 7.304372273,
        unit: "-",
        relative_tolerance: 1e-9,
        evidence: Evidence::SeveralPrograms,
        source: "CasADi and Ipopt; collocation of flat outputs",
    },
    pose,
};

/// The aircraft of the problem.
pub const AIRCRAFT: Pvtol = Pvtol { coupling: 0.3 };

/// States `x, z, theta` and their rates, controls thrust and rolling moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pvtol {
    /// Sideways push of a unit of rolling moment.
    pub coupling: f64,
}

impl Dynamics<6, 2> for Pvtol {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 6] {
        let (sin, cos) = x[2].sin_cos();
        let side = u[1] * self.coupling;
        [x[3], x[4], x[5], side * cos - u[0] * sin, u[0] * cos + side * sin - 1.0, u[1]]
    }
}

impl FlatMap<2, 5, 6, 2, 0> for Pvtol {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 5]; 2], _p: &[S; 0]) -> ([S; 6], [S; 2], [S; 0]) {
        let e = self.coupling;
        // Attitude along the acceleration that is not gravity, (-sin, cos) = (a, b) / size.
        let (a, b) = (y[0][2], y[1][2] + 1.0);
        let (a1, b1, a2, b2) = (y[0][3], y[1][3], y[0][4], y[1][4]);
        let square = a.square() + b.square();
        let theta = (-a).atan2(b);
        let rate = (a * b1 - a1 * b) / square;
        let moment = (a * b2 - a2 * b) / square - rate * (a * a1 + b * b1) * 2.0 / square;
        let (sin, cos) = theta.sin_cos();
        let x = [
            y[0][0] + sin * e,
            y[1][0] - cos * e,
            theta,
            y[0][1] + cos * rate * e,
            y[1][1] + sin * rate * e,
            rate,
        ];
        (x, [square.sqrt() + rate.square() * e, moment], [])
    }

    fn outputs(&self, _t: f64, x: &[f64; 6], _u: &[f64; 2], _p: &[f64; 0]) -> [f64; 2] {
        let (sin, cos) = x[2].sin_cos();
        [x[0] - self.coupling * sin, x[1] + self.coupling * cos]
    }
}

/// Rate of the effort: the squared distance of the controls from those that hover.
pub struct HoverEffort;

impl PathFunction<6, 2, 1> for HoverEffort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [(u[0] - 1.0).square() + u[1].square()]
    }
}

/// States at rest at the origin at the start, and at `(3, 1)` at the end.
#[must_use]
pub fn rest_to_rest() -> [State; 6] {
    let ends = [("x", 3.0), ("z", 1.0), ("roll", 0.0), ("vx", 0.0), ("vz", 0.0), ("roll rate", 0.0)];
    ends.map(|(name, end)| State::new(name, "-").starts_at(0.0).ends_at(end).scaled_by(1.0))
}

fn pose() -> Result<Case, OcpError> {
    let phase = Phase::new("move", AIRCRAFT)
        .states(rest_to_rest())
        .controls([
            Variable::new("thrust", "-").within(0.1, 3.0),
            Variable::new("moment", "-").scaled_by(1.0),
        ])
        .final_time(Bounds::fixed(5.0))
        .integral(Variable::new("effort", "-"), HoverEffort);
    let ocp = Ocp::builder("pvtol").phase(phase).minimize_integral("move", "effort").build()?;
    Case::from_ends(ocp, (0.0, &[0.0; 6], &[1.0, 0.0]), (5.0, &[3.0, 1.0, 0.0, 0.0, 0.0, 0.0], &[1.0, 0.0]))
}
