//! A departure from the perilune by an impulse whose size is an unknown of the flight.
//!
//! The parameter `dv` within its bounds, and two conditions at the start of the flight,
//!
//! ```text
//! u(0) + dv = u_p,     m(0) exp(dv / c) = m_p
//! ```
//!
//! with speed `u_p` and mass `m_p` on the transfer and the exhaust velocity `c`: the propellant of the impulse is that of the rocket equation.

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::planar::{HORIZONTAL_SPEED, MASS};
use apsides_ocp::{At, Bounds, OcpBuilder, Phase, Variable};

use super::ignition::Ignition;

/// Name of the parameter.
const IMPULSE: &str = "departure impulse";

/// Size of usual impulses, m/s.
const SCALE_M_S: f64 = 100.0;

/// The bound of an impulse against the motion whose size is optimised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeDeparture {
    /// Largest impulse, m/s.
    pub largest: f64,
}

/// Speed and mass on the transfer, from speed, mass and impulse of the flight.
struct BeforeImpulse {
    exhaust_velocity: f64,
}

impl VectorFunction<3, 2> for BeforeImpulse {
    fn evaluate<S: Scalar>(&self, &[speed, mass, impulse]: &[S; 3]) -> [S; 2] {
        [speed + impulse, mass * (impulse / self.exhaust_velocity).exp()]
    }
}

impl FreeDeparture {
    /// The first phase of a flight without its speed and mass at the start.
    pub(super) fn opened(self, mut phase: Phase) -> Phase {
        let free = [HORIZONTAL_SPEED.name, MASS.name];
        for s in phase.states.iter_mut().filter(|s| free.contains(&s.variable.name.as_str())) {
            s.initial = Bounds::FREE;
        }
        phase
    }

    /// The problem with the impulse as a parameter, from the transfer whose perilune is passed as `perilune` tells.
    pub(super) fn posed(self, ocp: OcpBuilder, first: &str, perilune: &Ignition) -> OcpBuilder {
        let exhaust_velocity = perilune.lander.flight.engine.exhaust_velocity;
        let rows = [
            Variable::new("speed before the impulse", "m/s")
                .within(perilune.horizontal_speed, perilune.horizontal_speed),
            Variable::new("mass before the impulse", "kg").within(perilune.mass, perilune.mass),
        ];
        let at = |name| At::InitialState(first, name);
        ocp.parameter(Variable::new(IMPULSE, "m/s").within(0.0, self.largest).scaled_by(SCALE_M_S)).constrain(
            "departure from the perilune",
            rows,
            [at(HORIZONTAL_SPEED.name), at(MASS.name), At::Parameter(IMPULSE)],
            BeforeImpulse { exhaust_velocity },
        )
    }
}
