//! The landings of the paper, and one with the mass as an output.

use apsides_ad::{FlatMap, Scalar};
use apsides_dynamics::planar::flat::{FlatConstantThrust, thrust_acceleration, thrust_angle};
use apsides_dynamics::planar::{ConstantThrust, PlanarFlight};
use apsides_dynamics::{Body, Engine, Hohmann};
use apsides_flatness::FlatSystem;
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Variable};

/// A case of the paper.
pub(crate) struct Landing {
    pub(crate) flight: PlanarFlight,
    pub(crate) radius: f64,
    pub(crate) speed: f64,
    pub(crate) mass: f64,
}

pub(crate) const TOUCHDOWN_SPEED: f64 = -5.0;

impl Landing {
    /// Table 1: from a circular orbit at 100 km with 300 kg.
    pub(crate) fn from_orbit() -> Self {
        let body = Body::new(4904.8695e9, 1737.1e3).unwrap();
        let engine = Engine::with_exhaust_velocity(440.0, 310.0 * 9.807).unwrap();
        let flight = PlanarFlight::new(body, engine);
        Self { flight, radius: body.radius + 100e3, speed: body.circular_speed(100e3).unwrap(), mass: 300.0 }
    }

    /// From the perilune of a Hohmann transfer.
    pub(crate) fn from_perilune(altitude: f64) -> Self {
        let orbit = Self::from_orbit();
        let body = orbit.flight.body;
        let radius = body.radius + altitude;
        let transfer = Hohmann::new(&body, orbit.radius, radius).unwrap();
        let mass = orbit.flight.engine.mass_after(orbit.mass, transfer.departure_impulse);
        Self { radius, speed: transfer.arrival_speed, mass, ..orbit }
    }

    pub(crate) fn flat(&self) -> FlatConstantThrust {
        FlatConstantThrust { flight: self.flight, ignition: 0.0, mass: self.mass }
    }

    pub(crate) fn system(&self) -> FlatSystem {
        FlatSystem::new(self.flat())
    }

    pub(crate) fn states(&self) -> [State; 5] {
        let surface = self.flight.body.radius;
        [
            State::new("radius", "m").starts_at(self.radius).ends_at(surface).scaled_by(1e5).miss_below(1e-3),
            State::new("polar angle", "rad").starts_at(0.0).scaled_by(1.0).miss_below(1e-3 / surface),
            State::new("horizontal speed", "m/s")
                .starts_at(self.speed)
                .ends_at(0.0)
                .scaled_by(2e3)
                .miss_below(1e-6),
            State::new("radial speed", "m/s")
                .starts_at(0.0)
                .ends_at(TOUCHDOWN_SPEED)
                .scaled_by(2e3)
                .miss_below(1e-6),
            State::new("mass", "kg").starts_at(self.mass).scaled_by(200.0).miss_below(1e-6),
        ]
    }

    pub(crate) fn pose(&self) -> (Ocp, Guess) {
        let phase = Phase::new("braking", ConstantThrust(self.flight))
            .states(self.states())
            .controls([Variable::new("thrust angle", "rad").scaled_by(1.0)])
            .final_time(Bounds::new(300.0, 2000.0));
        let ocp = Ocp::builder("lunar landing")
            .phase(phase)
            .minimize("flight time", "s", At::FinalTime("braking"))
            .objective_scale(1000.0)
            .build()
            .unwrap();
        let guess = self.guess();
        (ocp.clone(), Guess::from_phases(&ocp, vec![guess]))
    }

    /// Straight lines to touchdown.
    pub(crate) fn guess(&self) -> PhaseGuess {
        self.guess_to(self.flight.body.radius, TOUCHDOWN_SPEED)
    }

    /// Straight lines to a radius and a radial speed.
    pub(crate) fn guess_to(&self, radius: f64, speed: f64) -> PhaseGuess {
        let engine = self.flight.engine;
        let time = (self.mass - engine.mass_after(self.mass, 1.1 * self.speed)) / engine.mass_flow();
        let mass = self.mass - time * engine.mass_flow();
        let angle = 0.5 * time * self.speed / self.radius;
        PhaseGuess::samples(
            &[0.0, time],
            vec![vec![self.radius, 0.0, self.speed, 0.0, self.mass], vec![radius, angle, 0.0, speed, mass]],
            vec![vec![150.0_f64.to_radians()]; 2],
        )
        .unwrap()
    }
}

/// Outputs radius, polar angle and mass; the equation of the mass remains.
#[derive(Clone, Copy)]
pub(crate) struct WithMass(pub(crate) PlanarFlight);

impl FlatMap<3, 3, 5, 1, 2> for WithMass {
    fn evaluate<S: Scalar>(&self, _t: S, y: &[[S; 3]; 3], _p: &[S; 0]) -> ([S; 5], [S; 1], [S; 2]) {
        let [r, phi, m] = y;
        let a = thrust_acceleration(&self.0, r, phi);
        let thrust = self.0.engine.thrust;
        let residual = m[0].square() * (a[0].square() + a[1].square()) - thrust * thrust;
        let flow = m[1] + self.0.engine.mass_flow();
        ([r[0], phi[0], r[0] * phi[1], r[1], m[0]], [thrust_angle(a)], [residual, flow])
    }

    fn outputs(&self, _t: f64, x: &[f64; 5], _u: &[f64; 1], _p: &[f64; 0]) -> [f64; 3] {
        [x[0], x[1], x[4]]
    }
}
