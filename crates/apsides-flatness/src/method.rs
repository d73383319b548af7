//! Flat outputs on B-splines as a [`Method`].

use apsides_nlp::Observer;
use apsides_ocp::method::{Accuracy, Counters, Deficiency, Remedy};
use apsides_ocp::{Method, MethodError, Ocp, Solution, Start};

use crate::{FlatSystem, Flatness, FlatnessSettings, FlatnessSolution};

/// The name of the method.
const NAME: &str = "flatness";

/// The method for a problem whose phases have flat descriptions.
#[derive(Clone, Debug)]
pub struct FlatMethod {
    /// Settings.
    pub flatness: Flatness,
    /// The flat description of each phase of the problem.
    pub systems: Vec<FlatSystem>,
}

impl Method for FlatMethod {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The splines of every phase are those of the settings, whatever the mesh of the start.
    fn solve(
        &self,
        problem: &Ocp,
        start: &Start,
        observer: &mut dyn Observer,
    ) -> Result<Solution, MethodError> {
        let settings = &self.flatness.settings;
        let splines = vec![settings.spline.clone(); problem.phases.len()];
        let solved = self.flatness.solve_on(problem, &self.systems, &start.guess, &splines, observer);
        Ok(common(solved.map_err(MethodError::by(NAME))?, settings))
    }
}

/// The solution in the form that all methods share.
fn common(solution: FlatnessSolution, settings: &FlatnessSettings) -> Solution {
    let error = Accuracy::new("error between the points", solution.error, settings.tolerance, "tolerance");
    let mut accuracy = vec![error];
    if solution.solves.len() > 1 {
        accuracy.push(Accuracy::new(
            "expected change of the objective",
            solution.objective_change,
            settings.objective_tolerance,
            "objective_tolerance",
        ));
    }
    let refinements = solution.solves.len().saturating_sub(1);
    let remedy =
        if settings.spline.refine { Remedy::Raise(&["max_refinements"]) } else { Remedy::Enable("refine") };
    let first = solution.presolve.iter().map(|s| Counters { discretisations: 0, ..s.counters });
    let rest = solution.solves.iter().map(|s| s.counters);
    Solution {
        deficiency: (!solution.accurate).then(|| Deficiency::inaccurate(&accuracy, refinements, remedy)),
        accuracy,
        counters: Counters::total(first.chain(rest)),
        unmet: solution.unmet,
        report: Some(solution.report),
        ..Solution::new(solution.trajectory, solution.status)
    }
}
