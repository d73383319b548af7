//! [`di_min_energy`](crate::di_min_energy) with any speed at the end: a test of transversality.
//!
//! Optimum 1.5 with `u = 3 - 3 t`, so that the costate of the speed ends at zero. Guess: straight lines.

use apsides_ocp::{OcpError, State};

use crate::di_min_energy::least_effort;
use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "di_min_energy_free_speed",
    title: "least effort from rest to a point, at any speed",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 1.5,
        unit: "-",
        relative_tolerance: 1e-10,
        evidence: Evidence::ClosedForm,
        source: "u = 3 - 3 t; statement: PSOPT, mineng_free_vf.cxx",
    },
    pose,
};

fn pose() -> Result<Case, OcpError> {
    least_effort(PROBLEM.name, State::new("v", "-").starts_at(0.0))
}
