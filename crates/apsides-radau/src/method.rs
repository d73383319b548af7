//! Collocation as a [`Method`].

use apsides_nlp::Observer;
use apsides_ocp::method::{Counters, Warning};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use crate::shortfall::shortfall;
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
        let mut solution = self.common(problem, solution);
        solution.warnings.extend(Warning::without_control(problem));
        Ok(solution)
    }
}

impl Radau {
    /// The solution in the form that all methods share.
    fn common(&self, problem: &Ocp, solution: RadauSolution) -> Solution {
        let (accuracy, deficiency) = shortfall(problem, &self.settings, &solution);
        Solution {
            deficiency: (!solution.accurate).then_some(deficiency),
            accuracy: vec![accuracy],
            counters: Counters::total(solution.meshes.iter().map(|m| m.counters)),
            unmet: solution.unmet,
            warnings: solution.warnings.into_iter().map(Warning::Scale).collect(),
            switches: solution.switches,
            report: Some(solution.report),
            ..Solution::new(solution.trajectory, solution.status)
        }
    }
}
