//! How far a capsule is from its limits of reach: the least lift that reaches the target, and the nearest end to it.

use apsides_ocp::Trajectory;
use apsides_radau::{Explanation, RadauSolution};

use super::capsule::{Capsule, Goal};
use super::keys;
use super::problem::Steering;
use crate::missions::Scalars;
use crate::{Error, Mission};

/// Accuracy of these solves between the points of the mesh: enough for the digits that are shown.
const MESH_TOLERANCE: f64 = 1e-6;

/// Least factor on the lift that still reaches the target, of a mission that is solved.
pub(super) fn margins(mission: &Mission, _: &Trajectory) -> Result<Scalars, Error> {
    let mut margins = Scalars::new();
    let Some(capsule) = capsule(mission).filter(|c| c.goal == Goal::HeatLoad) else { return Ok(margins) };
    if mission.values.flag(keys::MARGINS)
        && let Some(factor) = least_lift_factor(mission, &capsule)?
    {
        margins.insert("least_lift_factor".into(), factor);
        margins.insert("least_lift_to_drag".into(), factor * capsule.lift_to_drag());
    }
    Ok(margins)
}

/// How far short of the target the capsule falls, and what lift would reach it.
pub(super) fn missing(mission: &Mission, _: &Explanation) -> Option<String> {
    let capsule = capsule(mission).filter(|c| !matches!(c.goal, Goal::Miss | Goal::Reach { .. }))?;
    let nearest = nearest_end(mission, &capsule).ok().flatten()?;
    let [longitude, latitude] = nearest.map(f64::to_degrees);
    let km = capsule.distance_to_target(nearest) / 1e3;
    if km < NO_MISS_KM {
        return None;
    }
    let short = format!(
        "the target is {km:.1} km out of reach (the nearest end is at longitude {longitude:.3} deg, latitude {latitude:.3} deg)"
    );
    let ratio = capsule.lift_to_drag();
    Some(match least_lift_factor(mission, &capsule).ok().flatten() {
        Some(factor) => {
            format!("{short}; the least L/D that reaches it is {:.4}, now {ratio:.4}", factor * ratio)
        }
        None => format!("{short}; no L/D up to {:.4} reaches it", ratio * super::problem::LARGEST_FACTOR),
    })
}

/// A target nearer than this is within reach: something else conflicts.
const NO_MISS_KM: f64 = 0.01;

fn capsule(mission: &Mission) -> Option<Capsule> {
    Capsule::of(&mission.values).ok()
}

fn least_lift_factor(mission: &Mission, capsule: &Capsule) -> Result<Option<f64>, Error> {
    let capsule = capsule.with_goal_of(Goal::LeastLift);
    Ok(solved(mission, &capsule)?.and_then(|s| s.trajectory.parameters.first().copied()))
}

/// Longitude and latitude (rad) at the end that is nearest to the target.
fn nearest_end(mission: &Mission, capsule: &Capsule) -> Result<Option<[f64; 2]>, Error> {
    let solved = solved(mission, &capsule.with_goal_of(Goal::Miss))?;
    let end = solved.and_then(|s| s.trajectory.phases.first().map(|p| p.final_state()));
    Ok(end.map(|x| [x[1], x[2]]))
}

fn solved(mission: &Mission, capsule: &Capsule) -> Result<Option<RadauSolution>, Error> {
    let ocp = capsule.problem(Steering::Vector)?;
    let guess = capsule.straight_lines(&ocp, Steering::Vector)?;
    let mesh = mission.first_mesh(&ocp)?;
    let mut method = mission.radau();
    method.settings.tolerance = method.settings.tolerance.max(MESH_TOLERANCE);
    let solution = method.solve_on(&ocp, &guess, mesh, &mut ())?;
    Ok(solution.status.is_success().then_some(solution))
}
