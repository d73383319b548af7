//! Landings in flat outputs, for the method that solves in them.

use apsides_dynamics::planar::flat::{
    FlatConstantThrust, FlatVerticalThrust, SplinedConstantThrust, SplinedVerticalThrust,
};
use apsides_flatness::FlatSystem;
use apsides_pipeline::Posed;

use super::ignition::Ignition;
use super::lander::Throttle;

impl Ignition {
    /// A landing with its description in radius and polar angle; without one unless the thrust is full and its direction may jump.
    pub(super) fn with_flat_landing(&self, posed: Posed) -> Posed {
        self.with_systems(
            posed,
            |flat| vec![FlatSystem::new(flat)],
            |flat| vec![FlatSystem::new(SplinedConstantThrust(flat))],
        )
    }

    /// The same for a landing that ends with a vertical descent.
    pub(super) fn with_flat_two_phase_landing(&self, posed: Posed) -> Posed {
        self.with_systems(
            posed,
            |flat| vec![FlatSystem::new(flat), FlatSystem::new(FlatVerticalThrust(flat))],
            |flat| {
                vec![
                    FlatSystem::new(SplinedConstantThrust(flat)),
                    FlatSystem::new(SplinedVerticalThrust(flat)),
                ]
            },
        )
    }

    fn with_systems(
        &self,
        posed: Posed,
        systems: impl Fn(FlatConstantThrust) -> Vec<FlatSystem>,
        splines: impl Fn(FlatConstantThrust) -> Vec<FlatSystem>,
    ) -> Posed {
        let lander = &self.lander;
        let is_flat = lander.throttle == Throttle::Full && lander.max_pitch_rate.is_none();
        let flat = FlatConstantThrust { flight: lander.flight, ignition: 0.0, mass: self.mass };
        Posed {
            flat_systems: is_flat.then(|| systems(flat)),
            spline_systems: is_flat.then(|| splines(flat)),
            ..posed
        }
    }
}
