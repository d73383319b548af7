//! The limits of the reach of a capsule: the least lift that reaches the target, and the nearest end to it.

use apsides_dynamics::entry::EntryState;
use apsides_pipeline::method::Methods;
use apsides_pipeline::{Error, Scalars};
use apsides_radau::RadauSolution;

use super::capsule::{CapsuleEntry, Goal};
use super::problem::LARGEST_FACTOR;
use super::steering::Steering;

/// Accuracy of these solves between the points of the mesh: enough for the digits that are shown.
const MESH_TOLERANCE: f64 = 1e-6;

/// A target nearer than this is within reach: something else conflicts.
const NO_MISS_KM: f64 = 0.01;

impl CapsuleEntry {
    /// Least factor on the lift that still reaches the target.
    pub(super) fn lift_margins(&self, methods: &Methods) -> Result<Scalars, Error> {
        let mut margins = Scalars::new();
        if self.goal == Goal::HeatLoad
            && self.margins
            && let Some(factor) = self.least_lift_factor(methods)?
        {
            margins.insert("least_lift_factor".into(), factor);
            margins.insert("least_lift_to_drag".into(), factor * self.lift_to_drag());
        }
        Ok(margins)
    }

    /// Says in words by how much the capsule falls short of the target, and the lift that would reach it; none where it is within reach.
    pub(super) fn shortfall(&self, methods: &Methods) -> Option<String> {
        if !self.must_reach_target() {
            return None;
        }
        let nearest = self.nearest_end(methods).ok().flatten()?;
        let [longitude, latitude] = nearest.map(f64::to_degrees);
        let km = self.distance_to_target(nearest) / 1e3;
        if km < NO_MISS_KM {
            return None;
        }
        let short = format!(
            "the target is {km:.1} km out of reach (the nearest end is at longitude {longitude:.3} deg, latitude {latitude:.3} deg)"
        );
        let ratio = self.lift_to_drag();
        Some(match self.least_lift_factor(methods).ok().flatten() {
            Some(factor) => {
                format!("{short}; the least L/D that reaches it is {:.4}, now {ratio:.4}", factor * ratio)
            }
            None => format!("{short}; no L/D up to {:.4} reaches it", ratio * LARGEST_FACTOR),
        })
    }

    fn least_lift_factor(&self, methods: &Methods) -> Result<Option<f64>, Error> {
        let solved = self.with_goal(Goal::LeastLift).solved(methods)?;
        Ok(solved.and_then(|s| s.trajectory.parameters.first().copied()))
    }

    /// Longitude and latitude (rad) at the end that is nearest to the target.
    fn nearest_end(&self, methods: &Methods) -> Result<Option<[f64; 2]>, Error> {
        let solved = self.with_goal(Goal::Miss).solved(methods)?;
        let end = solved.and_then(|s| s.trajectory.phases.first().map(|p| p.final_state()));
        let end = end.and_then(|x| <[f64; 6]>::try_from(x).ok());
        Ok(end.map(|x| EntryState::from(x).place()))
    }

    /// The solution by collocation, if one is found.
    fn solved(&self, methods: &Methods) -> Result<Option<RadauSolution>, Error> {
        let ocp = self.problem(Steering::Vector)?;
        let guess = self.straight_lines(&ocp, Steering::Vector)?;
        let mesh = methods.first_mesh(&ocp)?;
        let mut method = methods.radau.method();
        method.settings.tolerance = method.settings.tolerance.max(MESH_TOLERANCE);
        let solution = method.solve_on(&ocp, &guess, mesh, &mut ())?;
        Ok(solution.status.is_success().then_some(solution))
    }
}
