//! Collocation as a [`Method`].

use apsides_nlp::Observer;
use apsides_ocp::method::{Accuracy, Counters, Deficiency, Remedy, Warning};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use crate::{Radau, RadauSolution};

/// The name of the method.
const NAME: &str = "radau";

impl Method for Radau {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The first mesh is that of the start, else the uniform one of the settings.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        let mesh = match start.first_mesh() {
            Some(mesh) => mesh,
            None => self.uniform_mesh(problem).map_err(MethodError::by(NAME))?,
        };
        let solution = self.solve_on(problem, &start.guess, mesh, observer).map_err(MethodError::by(NAME))?;
        let mut solution = self.common(solution);
        solution.warnings.extend(Warning::without_control(problem));
        Ok(solution)
    }
}

impl Radau {
    /// The solution in the form that all methods share.
    fn common(&self, solution: RadauSolution) -> Solution {
        let last = solution.meshes.last();
        let (error, tolerance) = (last.map_or(f64::NAN, |m| m.error), self.settings.tolerance);
        let accuracy = vec![Accuracy::new("error between the points", error, tolerance, "tolerance")];
        let refinements = solution.meshes.len().saturating_sub(1);
        let deficiency = if solution.stalled {
            Deficiency::stalled(&accuracy, refinements, Remedy::Raise(&["tolerance", "path_tolerance"]))
        } else {
            // The next mesh would have been too large, or one too many.
            let too_large = refinements < self.settings.max_refinements;
            let setting: &[&str] = if too_large { &["max_total_points"] } else { &["max_refinements"] };
            Deficiency::inaccurate(&accuracy, refinements, Remedy::Raise(setting))
        };
        Solution {
            deficiency: (!solution.accurate).then_some(deficiency),
            accuracy,
            counters: Counters::total(solution.meshes.iter().map(|m| m.counters)),
            unmet: solution.unmet,
            warnings: solution.warnings.into_iter().map(Warning::Scale).collect(),
            switches: solution.switches,
            report: Some(solution.report),
            ..Solution::new(solution.trajectory, solution.status)
        }
    }
}
