//! Re-entry of the Space Shuttle with the largest cross-range and a limit on the heating of the leading edge.
//!
//! ```text
//! shuttle_reentry with q = q_a q_r <= 70 BTU/ft2/s,   a: angle of attack in deg
//! q_r = 17700 sqrt(rho) (0.0001 v)^3.07,   q_a = 1.0672181 - 0.019213774 a + 2.1286289e-4 a^2 - 1.0117249e-6 a^3
//! ```
//!
//! J. T. Betts, Practical Methods for Optimal Control, 2010, second case: 30.6255 deg after 2198.67 s, as dymos quotes
//! it. The optimum passes a longitude of 90.15 deg: a bound of 89 deg, which some statements put on it, costs 0.002 deg.
//! Radau points at the ends of the intervals and Ipopt (CasADi, 200 intervals of 3 points) give 30.62547 deg, uniform
//! meshes of 480 and 720 points here the same. ASSET has a mass of 203000/32.2 slug, `mu` = 1.40765e16 and a last
//! coefficient of -1.0117e-6, with which CasADi gives 30.63106 deg; its test asserts 0.5346200876 rad = 30.63147 deg to
//! 0.01 rad. The tolerance is the rounding of the printed digits. Guess: as without the limit.
//!
//! The least limit that any entry keeps, 22.43012 BTU/ft2/s, is that of the first peak after 16.6 s at an angle of attack
//! of 90 deg without bank.

use apsides_ad::{PathFunction, Scalar};
use apsides_ocp::{At, Ocp, OcpError, Sense, Term, Variable};

use crate::shuttle_reentry::{density, from_straight_lines, largest_cross_range, phase};
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "shuttle_heat_limit",
    title: "re-entry with the largest cross-range and limited heating",
    structure: Structure::Constrained,
    optimum: Optimum {
        value: 30.6255,
        unit: "deg",
        relative_tolerance: 2e-6,
        evidence: Evidence::SeveralPrograms,
        source: "Betts 2010, quoted by dymos, shuttle_reentry; CasADi and Ipopt",
    },
    pose: || pose_with_limit(PROBLEM.name, LIMIT),
};

/// Largest heating rate of the problem, BTU/ft2/s.
pub const LIMIT: f64 = 70.0;

/// Unit of the heating rate.
const UNIT: &str = "BTU/ft2/s";

/// The heating rate, BTU/ft2/s.
fn heating_rate<S: Scalar>(x: &[S; 6], u: &[S; 2]) -> S {
    let a = u[0] * 1.0_f64.to_degrees();
    let of_attack = a * (a * (a * -0.101_172_49e-5 + 0.212_862_89e-3) - 0.192_137_74e-1) + 1.067_218_1;
    of_attack * density(x[0]).sqrt() * (x[3] * 1e-4).powf(3.07) * 17_700.0
}

struct HeatingRate;

impl PathFunction<6, 2, 1> for HeatingRate {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [heating_rate(x, u)]
    }
}

/// The heating rate above the first static parameter.
struct AbovePeak;

impl PathFunction<6, 2, 1, 1> for AbovePeak {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], p: &[S; 1]) -> [S; 1] {
        [heating_rate(x, u) - p[0]]
    }
}

/// The largest cross-range with another limit on the heating rate, BTU/ft2/s.
///
/// # Errors
/// None for a positive limit.
pub fn pose_with_limit(name: &str, limit: f64) -> Result<Case, OcpError> {
    let rate = Variable::new("heating rate", UNIT).at_most(limit).scaled_by(10.0);
    largest_cross_range(name, phase().path([rate], HeatingRate))
}

/// The same entry with the least peak heating rate instead: the least limit that can be kept.
///
/// # Errors
/// None.
///
/// # Examples
/// ```
/// // Like the others of the gallery it has a guess that fits.
/// let case = apsides_problems::shuttle_heat_limit::pose_least_peak()?;
/// case.guess.check(&case.ocp)?;
/// assert_eq!(case.ocp.parameters[0].name, "peak");
/// # Ok::<(), apsides_ocp::OcpError>(())
/// ```
pub fn pose_least_peak() -> Result<Case, OcpError> {
    let above = Variable::new("heating rate above peak", UNIT).at_most(0.0).scaled_by(10.0);
    let ocp = Ocp::builder("shuttle_least_peak")
        .phase(phase().path([above], AbovePeak))
        .parameter(Variable::new("peak", UNIT).within(0.0, 1000.0).scaled_by(10.0))
        .objective(Sense::Minimize, "peak heating rate", UNIT, [Term::End(At::Parameter("peak"), 1.0)])
        .objective_scale(10.0)
        .build()?;
    from_straight_lines(ocp)
}
