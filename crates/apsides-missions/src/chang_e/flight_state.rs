//! States of the phases by names.

use apsides_ocp::PhaseTrajectory;

use super::lander::Motion;

/// A state of a phase in SI units and rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlightState {
    /// Distance from the centre.
    pub(super) radius: f64,
    /// Upward speed.
    pub(super) upward: f64,
    pub(super) mass: f64,
    pub(super) across: Across,
}

/// Place and horizontal velocity over the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Across {
    /// Polar angle travelled in the plane of the orbit, and the speed along it.
    Plane { angle: f64, forward: f64 },
    /// Longitude, latitude and the speeds along them.
    Space { longitude: f64, latitude: f64, eastward: f64, northward: f64 },
    /// Angle travelled along a divert, from its start.
    Divert { angle: f64 },
    /// Vertical flight has one place, which is no state.
    Above,
}

impl FlightState {
    /// The state of a phase at a time; none of a phase that is not one of these missions.
    pub(super) fn at(motion: Motion, phase: &PhaseTrajectory, time: f64) -> Option<Self> {
        Self::of(motion, &phase.state_at(time))
    }

    /// The state at the end of a phase.
    pub(super) fn end(motion: Motion, phase: &PhaseTrajectory) -> Option<Self> {
        Self::at(motion, phase, phase.final_time)
    }

    /// A state in the order of `planar::STATES`, `powered_descent::STATES`, `VerticalPlaneThrust::STATES` or `powered_descent::VERTICAL_STATES`.
    pub(super) fn of(motion: Motion, x: &[f64]) -> Option<Self> {
        let (radius, upward, mass, across) = match (motion, x) {
            (_, &[radius, upward, mass]) => (radius, upward, mass, Across::Above),
            (Motion::Plane, &[radius, angle, forward, upward, mass]) => {
                (radius, upward, mass, Across::Plane { angle, forward })
            }
            (Motion::Space, &[radius, angle, upward, _forward, mass]) => {
                (radius, upward, mass, Across::Divert { angle })
            }
            // The thrust of an adjustment by the shortest path has its course as a state.
            (
                Motion::Space,
                &[radius, longitude, latitude, upward, eastward, northward, mass, ref course @ ..],
            ) if course.len() < 2 => {
                (radius, upward, mass, Across::Space { longitude, latitude, eastward, northward })
            }
            _ => return None,
        };
        Some(Self { radius, upward, mass, across })
    }
}

#[cfg(test)]
mod tests {
    use apsides_dynamics::Quantity;
    use apsides_dynamics::planar::{self, MASS, RADIUS};
    use apsides_dynamics::powered_descent::{
        self, DIVERT_ANGLE, EASTWARD_SPEED, LATITUDE, LONGITUDE, NORTHWARD_SPEED, UPWARD_SPEED,
        VerticalPlaneThrust,
    };

    use super::*;

    /// Each quantity of a state is found where its model has it.
    #[test]
    fn names_are_in_the_order_of_the_models() {
        let state = |motion, all: &[Quantity]| {
            let x: Vec<f64> = (0..all.len()).map(|k| k as f64).collect();
            FlightState::of(motion, &x).unwrap()
        };
        let at = |q: Quantity, all: &[Quantity]| q.index_in(all) as f64;
        let all = &planar::STATES;
        let across =
            Across::Plane { angle: at(planar::POLAR_ANGLE, all), forward: at(planar::HORIZONTAL_SPEED, all) };
        let [radius, upward, mass] = [RADIUS, planar::RADIAL_SPEED, MASS].map(|q| at(q, all));
        assert_eq!(state(Motion::Plane, all), FlightState { radius, upward, mass, across });
        let across_in = |all: &[Quantity]| match all.len() {
            3 => Across::Above,
            5 => Across::Divert { angle: at(DIVERT_ANGLE, all) },
            _ => Across::Space {
                longitude: at(LONGITUDE, all),
                latitude: at(LATITUDE, all),
                eastward: at(EASTWARD_SPEED, all),
                northward: at(NORTHWARD_SPEED, all),
            },
        };
        let models: [&[Quantity]; 3] =
            [&powered_descent::STATES, &VerticalPlaneThrust::STATES, &powered_descent::VERTICAL_STATES];
        for all in models {
            let [radius, upward, mass] = [RADIUS, UPWARD_SPEED, MASS].map(|q| at(q, all));
            let expected = FlightState { radius, upward, mass, across: across_in(all) };
            assert_eq!(state(Motion::Space, all), expected);
        }
    }
}
