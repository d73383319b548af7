//! Multiple shooting as a [`Method`].

use apsides_nlp::Observer;
use apsides_ocp::method::{Accuracy, Counters, Deficiency, Remedy};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use super::settings::MultipleShootingSettings;
use super::solver::{MultipleShooting, ShootingRecord, ShootingSolution};

/// The name of the method.
const NAME: &str = "multiple-shooting";

impl Method for MultipleShooting {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The first segments are those of the mesh of the start, else equal ones by the settings. A mesh that was made for collocation, as that
    /// of an earlier trajectory, is not taken.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        let mesh = match &start.mesh {
            Some(mesh) => mesh.clone(),
            None => self.uniform_mesh(problem).map_err(MethodError::by(NAME))?,
        };
        let solution = self.solve_on(problem, &start.guess, mesh, observer).map_err(MethodError::by(NAME))?;
        Ok(common(solution, &self.settings))
    }
}

/// The solution in the form that all methods share.
fn common(solution: ShootingSolution, settings: &MultipleShootingSettings) -> Solution {
    let accuracy = solution.meshes.last().map_or_else(Vec::new, |m| m.accuracy(settings));
    let refinements = solution.meshes.len().saturating_sub(1);
    let remedy = Remedy::Raise(&["max_refinements"]);
    Solution {
        deficiency: (!solution.accurate).then(|| Deficiency::inaccurate(&accuracy, refinements, remedy)),
        accuracy,
        counters: Counters::total(solution.meshes.iter().map(|m| m.counters)),
        unmet: solution.unmet,
        report: Some(solution.report),
        ..Solution::new(solution.trajectory, solution.status)
    }
}

impl ShootingRecord {
    /// The measures of accuracy, with the tolerances of the settings.
    fn accuracy(&self, settings: &MultipleShootingSettings) -> Vec<Accuracy> {
        let of = Accuracy::new;
        vec![
            of(
                "integration error",
                self.integration_error,
                settings.integration_tolerance,
                "integration_tolerance",
            ),
            of("expected gain of richer controls", self.control_gain, settings.tolerance, "tolerance"),
            of("excess between the points", self.path_excess, settings.path_tolerance, "path_tolerance"),
        ]
    }
}
