//! Successive convexification as a [`Method`].

use apsides_iteration::Observer;
use apsides_ocp::method::{Accuracy, Counters};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use super::solver::SuccessiveConvexification;

/// The name of the method.
const NAME: &str = "successive-convexification";

impl Method for SuccessiveConvexification {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The intervals are those of the settings, whatever the mesh of the start. They are not refined, so that the accuracy between the
    /// nodes is not part of the solution: a certificate looks at it.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        let solution = self.solve_observed(problem, &start.guess, observer).map_err(MethodError::by(NAME))?;
        let tolerance = self.settings.feasibility_tolerance;
        let violation =
            Accuracy::new("largest violation", solution.violation, tolerance, "feasibility_tolerance");
        Ok(Solution {
            accuracy: vec![violation],
            counters: Counters {
                iterations: solution.records.len(),
                factorisations: 0,
                variables: solution.variables,
                constraints: solution.constraints,
                discretisations: 1,
            },
            unmet: solution.unmet,
            ..Solution::new(solution.trajectory, solution.status)
        })
    }
}
