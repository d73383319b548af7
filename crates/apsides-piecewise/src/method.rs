//! Piecewise-constant controls as a [`Method`].

use apsides_nlp::Observer;
use apsides_ocp::method::{Accuracy, Counters, Deficiency, Remedy};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use crate::{PiecewiseConstant, PiecewiseSettings, PiecewiseSolution};

/// The name of the method.
const NAME: &str = "piecewise";

impl Method for PiecewiseConstant {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The first segments are those of the settings, whatever the mesh of the start.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        let solution = self.solve_observed(problem, &start.guess, observer).map_err(MethodError::by(NAME))?;
        Ok(common(solution, &self.settings))
    }
}

/// The solution in the form that all methods share.
fn common(solution: PiecewiseSolution, settings: &PiecewiseSettings) -> Solution {
    let (excess, shooting) = (solution.excess, &settings.shooting);
    let place = format!("{}, t = {:.3}", excess.place, excess.time);
    let mut accuracy = vec![
        Accuracy::new(
            "integration error",
            solution.integration_error,
            shooting.integration_tolerance,
            "integration_tolerance",
        ),
        Accuracy::new("excess along the phases", excess.amount, shooting.path_tolerance, "path_tolerance")
            .at(place),
    ];
    if settings.max_refinements > 0 {
        accuracy.insert(
            0,
            Accuracy::new("expected gain of more segments", solution.gain, settings.tolerance, "tolerance"),
        );
    }
    let refinements = solution.meshes.len().saturating_sub(1);
    let remedy = Remedy::Raise(&["intervals", "max_intervals", "points"]);
    Solution {
        deficiency: (!solution.accurate).then(|| Deficiency::inaccurate(&accuracy, refinements, remedy)),
        accuracy,
        counters: Counters::total(solution.meshes.iter().map(|m| m.counters)),
        unmet: solution.unmet,
        report: Some(solution.report),
        ..Solution::new(solution.trajectory, solution.status)
    }
}
