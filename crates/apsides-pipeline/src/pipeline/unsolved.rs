//! The sentences about a mission that was not solved, or not without doubts.

use apsides_nlp::Status;
use apsides_ocp::method::Warning;
use apsides_ocp::not_finite::NotFinite;
use apsides_ocp::{Bounds, Ocp, Sense, Solution, Trajectory, behind_number};
use apsides_radau::Explanation;

use crate::method::Methods;

use super::run_away::RunAway;

/// Knowledge of a solve without an optimum.
#[derive(Clone, Copy)]
pub(super) struct Unsolved<'a> {
    pub(super) conflict: Option<&'a Explanation>,
    pub(super) run_away: Option<&'a RunAway>,
    /// A formula without a value at the last point, and the place where it is stated.
    pub(super) not_finite: Option<&'a (NotFinite, Option<String>)>,
}

/// Says what is missing, in the user's units.
pub(super) fn explain(
    methods: &Methods,
    ocp: &Ocp,
    solution: &Solution,
    unsolved: &Unsolved<'_>,
) -> Option<String> {
    let conflict = unsolved.conflict;
    if let Some(run_away) = unsolved.run_away {
        return Some(run_away.to_string());
    }
    if solution.status.is_success() {
        return solution.deficiency.as_ref().map(|d| d.sentence(&|setting| methods.key_of(setting)));
    }
    if solution.status == Status::Diverging {
        return Some(diverging(ocp, &solution.trajectory));
    }
    if let Some((found, place)) = unsolved.not_finite {
        let place = place.as_ref().map_or_else(String::new, |place| format!(", stated in {place}"));
        return Some(format!(
            "{found}{place}; bound what it takes to where it is finite, or state a guess there"
        ));
    }
    let mut text = format!("{}", solution.status);
    match (conflict.filter(|c| c.status.is_success()), &solution.unmet) {
        (Some(found), _) => text += &format!(": {found}"),
        // What a solve that came to no end misses is no verdict on it.
        (None, Some(unmet)) if solution.status == Status::Infeasible => {
            text += &format!(": {unmet}: cannot be met");
        }
        (None, Some(unmet)) => text += &format!(": {unmet} so far"),
        (None, None) => {}
    }
    Some(text)
}

/// Says whether the discretisation of a solution is not what was asked for.
pub(super) fn is_coarse(solution: &Solution) -> bool {
    let is_of_mesh = |warning: &Warning| matches!(warning, Warning::Coarse(_));
    solution.deficiency.is_some() || solution.warnings.iter().any(is_of_mesh)
}

/// The doubts that remain though a solve succeeded, those about its mesh with their `cause`, if that is known.
pub(super) fn doubts(methods: &Methods, solution: &Solution, cause: Option<&str>) -> Vec<String> {
    let sentence = |warning: &Warning| {
        let text = warning.sentence(&|setting| methods.key_of(setting));
        match (warning, cause) {
            (Warning::Coarse(_), Some(cause)) => format!("{text}; {cause}"),
            _ => text,
        }
    };
    solution.warnings.iter().map(sentence).collect()
}

/// Says of an objective without a bound which quantity has gone farthest where nothing bounds it.
fn diverging(ocp: &Ocp, trajectory: &Trajectory) -> String {
    let verb = match ocp.objective.sense {
        Sense::Minimize => "falls",
        Sense::Maximize => "grows",
    };
    let mut farthest: Option<(f64, String)> = None;
    let mut consider = |bounds: Bounds, value: f64, name: &str, phase: &str, unit: &str| {
        let is_open = if value > 0.0 { bounds.upper } else { bounds.lower }.is_infinite();
        if is_open && farthest.as_ref().is_none_or(|(largest, _)| value.abs() > *largest) {
            let text = format!(
                "nothing bounds `{name}` of phase `{phase}`, which has come to {value:.3e}{}",
                behind_number(unit)
            );
            farthest = Some((value.abs(), text));
        }
    };
    for (phase, found) in ocp.phases.iter().zip(&trajectory.phases) {
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        for (variables, polynomial, n) in [
            (phase.states.iter().map(|s| &s.variable).collect::<Vec<_>>(), &found.state, nx),
            (phase.controls.iter().collect(), &found.control, nu),
        ] {
            for values in polynomial.segments().iter().flat_map(|s| s.values.chunks(n.max(1))) {
                for (v, value) in variables.iter().zip(values) {
                    consider(v.bounds, *value, &v.name, &phase.name, &v.unit);
                }
            }
        }
        consider(phase.final_time, found.final_time, "final time", &phase.name, &phase.time_unit);
    }
    let objective = &ocp.objective;
    let reached = trajectory.objective;
    let unit = behind_number(&objective.unit);
    let text = format!("the objective {verb} without bound, to {reached:.3e}{unit} so far");
    match farthest {
        Some((_, cause)) => format!("{text}: {cause}; state bounds, or what it costs"),
        None => text,
    }
}
