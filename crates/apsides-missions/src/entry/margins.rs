//! The limits of the reach of a capsule: the least lift that reaches the target, and the nearest end to it.

use apsides_dynamics::entry::EntryState;
use apsides_ocp::Trajectory;
use apsides_pipeline::method::Methods;
use apsides_pipeline::{Cancellation, Error, Scalars};

use super::capsule::{CapsuleEntry, Goal};
use super::problem::LARGEST_FACTOR;
use super::steering::Steering;

/// Accuracy of these solves between the points of the mesh: enough for the digits that are shown.
const MESH_TOLERANCE: f64 = 1e-6;

/// A target nearer than this is within reach: something else conflicts.
const NO_MISS_KM: f64 = 0.01;

/// The end of a solve for one value.
enum Found<T> {
    Value(T),
    /// No flight that meets the requirements.
    NoFlight,
    /// Unknown before the end of the work.
    Unknown,
}

impl CapsuleEntry {
    /// Least factor on the lift that still reaches the target.
    pub(super) fn lift_margins(
        &self,
        methods: &Methods,
        cancellation: &Cancellation,
    ) -> Result<Scalars, Error> {
        let mut margins = Scalars::new();
        if self.goal == Goal::HeatLoad
            && self.margins
            && let Found::Value(factor) = self.least_lift_factor(methods, cancellation)?
        {
            margins.insert("least_lift_factor".into(), factor);
            margins.insert("least_lift_to_drag".into(), factor * self.lift_to_drag());
        }
        Ok(margins)
    }

    /// Says in words by how much the capsule falls short of the target, and the lift that would reach it; none where it is within reach.
    pub(super) fn shortfall(&self, methods: &Methods, cancellation: &Cancellation) -> Option<String> {
        if !self.must_reach_target() {
            return None;
        }
        let Ok(Found::Value(nearest)) = self.nearest_end(methods, cancellation) else { return None };
        let [longitude, latitude] = nearest.map(f64::to_degrees);
        let km = self.distance_to_target(nearest) / 1e3;
        if km < NO_MISS_KM {
            return None;
        }
        let short = format!(
            "the target is {km:.1} km out of reach (the nearest end is at longitude {longitude:.3} deg, latitude {latitude:.3} deg)"
        );
        let ratio = self.lift_to_drag();
        Some(match self.least_lift_factor(methods, cancellation) {
            Ok(Found::Value(factor)) => {
                format!("{short}; the least L/D that reaches it is {:.4}, now {ratio:.4}", factor * ratio)
            }
            Ok(Found::NoFlight) => {
                format!("{short}; no L/D up to {:.4} is found that reaches it", ratio * LARGEST_FACTOR)
            }
            Ok(Found::Unknown) | Err(_) => short,
        })
    }

    fn least_lift_factor(&self, methods: &Methods, cancellation: &Cancellation) -> Result<Found<f64>, Error> {
        let factor = |flight: &Trajectory| flight.parameters.first().copied();
        self.with_goal(Goal::LeastLift).solved(methods, cancellation, factor)
    }

    /// Longitude and latitude (rad) at the end that is nearest to the target.
    fn nearest_end(&self, methods: &Methods, cancellation: &Cancellation) -> Result<Found<[f64; 2]>, Error> {
        let place = |flight: &Trajectory| {
            let end = <[f64; 6]>::try_from(flight.phases.first()?.final_state()).ok()?;
            Some(EntryState::from(end).place())
        };
        self.with_goal(Goal::Miss).solved(methods, cancellation, place)
    }

    /// A value of the solution by collocation.
    fn solved<T>(
        &self,
        methods: &Methods,
        cancellation: &Cancellation,
        value: impl Fn(&Trajectory) -> Option<T>,
    ) -> Result<Found<T>, Error> {
        let ocp = self.problem(Steering::Vector)?;
        let guess = self.straight_lines(&ocp, Steering::Vector)?;
        let mesh = methods.first_mesh(&ocp)?;
        let mut method = methods.radau.method();
        method.settings.tolerance = method.settings.tolerance.max(MESH_TOLERANCE);
        let solution = method.solve_on(&ocp, &guess, mesh, &mut cancellation.clone())?;
        if solution.status.is_success() {
            return Ok(value(&solution.trajectory).map_or(Found::Unknown, Found::Value));
        }
        Ok(if cancellation.is_asked() { Found::Unknown } else { Found::NoFlight })
    }
}
