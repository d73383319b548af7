//! Direct multiple shooting by `apsides-shooting`.

use apsides_nlp::Observer;
use apsides_ocp::{Guess, Ocp};
use apsides_shooting::direct::{MultipleShooting, MultipleShootingSettings, ShootingSolution};

use super::{Shortfall, Solution};
use crate::key::{Key, Range};
use crate::{Counters, Error, Mission};

pub(super) const KEYS: &[Key] = &[
    Key::count("shooting.segments", 4, 1, 100_000, "segments per phase at the start; 1 is single shooting"),
    Key::count(
        "shooting.control_points",
        6,
        1,
        60,
        "points of the control polynomial of each segment at the start; 1 is constant",
    ),
    Key::number(
        "shooting.integration_tolerance",
        1e-10,
        Range::open(0.0, 1.0),
        "largest relative error of the integration of a segment",
    ),
    Key::number(
        "shooting.nlp_tolerance",
        1e-10,
        Range::open(0.0, 1.0),
        "scaled optimality error of each solve",
    ),
    Key::count("shooting.max_meshes", 15, 1, 1000, "most divisions solved; 1 switches refinement off"),
];

impl Mission {
    /// Solves by multiple shooting.
    pub(super) fn solve_by_multiple_shooting(
        &self,
        ocp: &Ocp,
        guess: &Guess,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let mut settings = MultipleShootingSettings {
            intervals: self.values.count("shooting.segments"),
            points: self.values.count("shooting.control_points"),
            integration_tolerance: self.values.number("shooting.integration_tolerance"),
            max_refinements: self.values.count("shooting.max_meshes") - 1,
            threads: self.threads.clamp(1, 1024),
            ..MultipleShootingSettings::default()
        };
        settings.nlp.tolerance = self.values.number("shooting.nlp_tolerance");
        let method = MultipleShooting { settings };
        let mesh = method.uniform_mesh(ocp)?;
        Ok(of_shooting(method.solve_on(ocp, guess, mesh, observer)?))
    }
}

fn of_shooting(solution: ShootingSolution) -> Solution {
    let last = solution.meshes.last();
    let shortfall = (!solution.accurate).then(|| {
        let (error, gain, excess) =
            last.map_or((f64::NAN, f64::NAN, f64::NAN), |m| (m.integration_error, m.control_gain, m.path_excess));
        Shortfall::mesh(format!(
            "after {} divisions the integration error is {error:.1e}, the expected gain of richer controls {gain:.1e} and the excess \
             between points {excess:.1e}; raise `shooting.max_meshes`",
            solution.meshes.len()
        ))
    });
    Solution {
        status: solution.status,
        shortfall,
        counters: Counters {
            iterations: solution.meshes.iter().map(|m| m.iterations).sum(),
            factorisations: solution.meshes.iter().map(|m| m.factorisations).sum(),
            variables: last.map_or(0, |m| m.variables),
            constraints: last.map_or(0, |m| m.constraints),
            mesh_iterations: solution.meshes.len(),
        },
        unmet: solution.unmet.as_ref().map(ToString::to_string),
        warnings: Vec::new(),
        switches: Vec::new(),
        search: None,
        report: Some(solution.report),
        trajectory: solution.trajectory,
    }
}
