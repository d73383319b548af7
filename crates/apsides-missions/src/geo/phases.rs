//! The flight as a problem: all burns and coasts as phases, or the burns alone, joined by what a coast leaves as it is.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use apsides_ad::{Scalar, VectorFunction, vector};
use apsides_dynamics::Quantity;
use apsides_dynamics::elements::Equinoctial;
use apsides_dynamics::equinoctial::{
    ECCENTRICITY_F, ECCENTRICITY_G, INCLINATION_H, INCLINATION_K, MASS, OUT_OF_PLANE_ANGLE, PLANAR_STATES,
    PlanarCoast, PlanarInertialThrust, PlanarThrust, PlanarVelocityThrust, SEMI_LATUS_RECTUM, SPATIAL_STATES,
    SpatialCoast, SpatialInertialThrust, SpatialThrust, THRUST_ANGLE, THRUST_LATITUDE, THRUST_LONGITUDE,
    TRUE_LONGITUDE,
};
use apsides_dynamics::impulsive::Apsis;
use apsides_ocp::{At, Bounds, Direction, Ocp, OcpBuilder, OcpError, Phase, State, Variable};

use super::coast::FlightTime;
use super::injection::{BurnSteering, GeoInjection};

/// Largest misses of a re-simulation. An orbit whose size is off by as much is late by 1.3e-7 rad after a revolution.
const LENGTH_MISS_M: f64 = 0.1;
const ECCENTRICITY_MISS: f64 = 1e-8;
const ANGLE_MISS_RAD: f64 = 1e-7;
const MASS_MISS_KG: f64 = 1e-5;

/// Least angle of a coast to the same apsis, rad: burns that follow each other at once are one.
const LEAST_ANGLE: f64 = FRAC_PI_2;
/// Least semi-latus rectum of a burn, relative to the parking orbit.
const LEAST_SEMI_LATUS_RECTUM: f64 = 0.125;
/// Shortest burn, s.
const SHORTEST_BURN: f64 = 1.0;
/// Shortest coast, s, where coasts are phases.
const SHORTEST_COAST: f64 = 1.0;

const PLANAR_LONGITUDE: usize = TRUE_LONGITUDE.index_in(&PLANAR_STATES);
const SPATIAL_LONGITUDE: usize = TRUE_LONGITUDE.index_in(&SPATIAL_STATES);

/// Name of the limit on the time of the whole flight.
pub(super) const FLIGHT_TIME: &str = "flight time";

pub(super) fn burn_name(k: usize) -> String {
    format!("burn-{}", k + 1)
}

pub(super) fn coast_name(k: usize) -> String {
    format!("coast-{}", k + 1)
}

/// Returns true if the phase of this name is a burn.
pub(super) fn is_burn(name: &str) -> bool {
    name.starts_with("burn-")
}

/// The equations of motion, which all burns and all coasts share.
pub(super) struct Models {
    burn: Phase,
    coast: Phase,
}

impl GeoInjection {
    /// States of a coast; those of a burn begin with them.
    pub(super) fn coast_states(&self) -> &'static [Quantity] {
        if self.is_spatial() { &SPATIAL_STATES } else { &PLANAR_STATES }
    }

    /// Place of the true longitude among the states.
    pub(super) fn longitude_index(&self) -> usize {
        if self.is_spatial() { SPATIAL_LONGITUDE } else { PLANAR_LONGITUDE }
    }

    /// The orbital elements of a state of a burn or a coast.
    pub(super) fn elements(&self, state: &[f64]) -> Equinoctial {
        // In the equatorial plane there are no components of the inclination.
        let at = |q: Quantity| q.position_in(self.coast_states()).map_or(0.0, |index| state[index]);
        Equinoctial::prograde([
            at(SEMI_LATUS_RECTUM),
            at(ECCENTRICITY_F),
            at(ECCENTRICITY_G),
            at(INCLINATION_H),
            at(INCLINATION_K),
            at(TRUE_LONGITUDE),
        ])
    }

    /// The mass of a state of a burn or a coast, kg.
    pub(super) fn mass_in(&self, state: &[f64]) -> f64 {
        MASS.position_in(self.coast_states()).map_or(self.initial_mass, |index| state[index])
    }

    /// The problem that is solved.
    pub(super) fn reduced(&self, models: &Models) -> Result<Ocp, OcpError> {
        let n = self.burns();
        let mut ocp = Ocp::builder("injection, burns only");
        for k in 0..n {
            // Each burn has a clock of its own.
            ocp = ocp.phase(self.burn(k, models).final_time(self.times()));
        }
        for k in 1..n {
            ocp = self.joined(ocp, k - 1);
        }
        if let Some(limit) = self.flight_time_limit {
            ocp = match n {
                2 => self.limited::<7>(ocp, limit),
                3 => self.limited::<13>(ocp, limit),
                4 => self.limited::<19>(ocp, limit),
                5 => self.limited::<25>(ocp, limit),
                6 => self.limited::<31>(ocp, limit),
                7 => self.limited::<37>(ocp, limit),
                8 => self.limited::<43>(ocp, limit),
                // One burn is a phase with a final time.
                _ => ocp,
            };
        }
        self.finished(ocp)
    }

    /// The problem with all burns and coasts.
    pub(super) fn whole(&self, models: &Models) -> Result<Ocp, OcpError> {
        let n = self.burns();
        let mut ocp = Ocp::builder("injection");
        for k in 0..n {
            let begin = if k > 0 { self.times() } else { Bounds::fixed(0.0) };
            ocp = ocp.phase(self.burn(k, models).initial_time(begin).final_time(self.times()));
            if k + 1 < n {
                ocp = ocp.phase(self.coast(k, models).initial_time(self.times()).final_time(self.times()));
            }
        }
        for k in 1..n {
            let coast = coast_name(k - 1);
            ocp = ocp.link(&burn_name(k - 1), &coast).link(&coast, &burn_name(k));
        }
        self.finished(ocp)
    }

    fn times(&self) -> Bounds {
        Bounds::new(0.0, self.flight_time_limit.unwrap_or(f64::INFINITY))
    }

    /// Limits on coasts and on the orbits between the burns, the form of the target, and the objective.
    fn finished(&self, mut ocp: OcpBuilder) -> Result<Ocp, OcpError> {
        let n = self.burns();
        for k in 1..n {
            let (from, to) = (burn_name(k - 1), burn_name(k));
            let longitudes =
                [At::FinalState(&from, TRUE_LONGITUDE.name), At::InitialState(&to, TRUE_LONGITUDE.name)];
            let least = if self.pattern[k - 1] == self.pattern[k] { LEAST_ANGLE } else { 0.0 };
            let angle = Variable::new("true longitude travelled", "rad").at_least(least).scaled_by(TAU);
            ocp = ocp.constrain(coast_name(k - 1), [angle], longitudes, Gain);
        }
        if let Some(limit) = self.apogee_limit {
            for k in 0..n - 1 {
                let name = burn_name(k);
                let row =
                    Variable::new("apogee radius", "m").at_most(limit).scaled_by(self.target_semi_major_axis);
                ocp = ocp.constrain(format!("orbit after {name}"), [row], shape(&name), ApogeeRadius);
            }
        }
        let last = burn_name(n - 1);
        if self.target_eccentricity > 0.0 {
            let e = self.target_eccentricity;
            let row = Variable::new("eccentricity squared", "-").equal_to(e * e).scaled_by(1.0);
            let [_, f, g] = shape(&last);
            ocp = ocp.constrain("target orbit", [row], [f, g], SquaredSum);
        }
        ocp.maximize("final_mass", "kg", At::FinalState(&last, MASS.name))
            .objective_scale(self.initial_mass)
            .build()
    }

    /// The quantities that a coast of free length between burn `k` and the next leaves as they are.
    fn joined(&self, mut ocp: OcpBuilder, k: usize) -> OcpBuilder {
        let (from, to) = (burn_name(k), burn_name(k + 1));
        for q in self.coast_states().iter().filter(|q| **q != TRUE_LONGITUDE) {
            let row = Variable::new(q.name, q.unit).equal_to(0.0).scaled_by(self.scale(*q));
            let ends = [At::FinalState(&from, q.name), At::InitialState(&to, q.name)];
            ocp = ocp.constrain(format!("link {from}-{to}"), [row], ends, Loss);
        }
        ocp
    }

    /// A limit (s) on the sum of all burns and coasts, as a function of so many end quantities.
    fn limited<const N: usize>(&self, ocp: OcpBuilder, limit: f64) -> OcpBuilder {
        let names: Vec<String> = (0..self.burns()).map(burn_name).collect();
        let mut inputs: Vec<At<'_>> = names.iter().map(|name| At::FinalTime(name)).collect();
        for pair in names.windows(2) {
            inputs.extend(shape(&pair[0]));
            inputs.push(At::FinalState(&pair[0], TRUE_LONGITUDE.name));
            inputs.push(At::InitialState(&pair[1], TRUE_LONGITUDE.name));
        }
        let row = Variable::new(FLIGHT_TIME, "s").at_most(limit).scaled_by(3600.0);
        match <[At<'_>; N]>::try_from(inputs) {
            Ok(inputs) => ocp.constrain(FLIGHT_TIME, [row], inputs, FlightTime { mu: self.mu() }),
            Err(_) => ocp,
        }
    }

    fn scale(&self, q: Quantity) -> f64 {
        match q {
            SEMI_LATUS_RECTUM => self.target_semi_major_axis,
            MASS => self.initial_mass,
            TRUE_LONGITUDE => TAU,
            _ => 1.0,
        }
    }

    fn state(&self, q: Quantity) -> State {
        let miss = match q {
            SEMI_LATUS_RECTUM => LENGTH_MISS_M,
            MASS => MASS_MISS_KG,
            TRUE_LONGITUDE | THRUST_LONGITUDE | THRUST_LATITUDE => ANGLE_MISS_RAD,
            _ => ECCENTRICITY_MISS,
        };
        State::new(q.name, q.unit).miss_below(miss).scaled_by(self.scale(q))
    }

    /// Burn and coast without their own names, states and times.
    pub(super) fn models(&self) -> Models {
        let in_plane = control(THRUST_ANGLE);
        let burn = match (self.steering, self.is_spatial()) {
            (BurnSteering::Optimal, false) => Phase::new("burn", PlanarThrust(self.flight))
                .controls([in_plane])
                .direction(Direction::InPlane { angle: 0 }),
            (BurnSteering::Optimal, true) => {
                let out_of_plane = control(OUT_OF_PLANE_ANGLE).within(-FRAC_PI_2, FRAC_PI_2).guarded();
                Phase::new("burn", SpatialThrust(self.flight))
                    .controls([in_plane, out_of_plane])
                    .direction(Direction::InSpace { in_plane: 0, out_of_plane: 1 })
            }
            // Thrust along the velocity stays in the plane; a spatial flight with it is refused.
            (BurnSteering::Velocity, _) => Phase::new("burn", PlanarVelocityThrust(self.flight)),
            (BurnSteering::InertialFixed, false) => Phase::new("burn", PlanarInertialThrust(self.flight)),
            (BurnSteering::InertialFixed, true) => Phase::new("burn", SpatialInertialThrust(self.flight)),
        };
        let coast = if self.is_spatial() {
            Phase::new("coast", SpatialCoast(self.flight))
        } else {
            Phase::new("coast", PlanarCoast(self.flight))
        };
        Models { burn, coast }
    }

    fn coast(&self, k: usize, models: &Models) -> Phase {
        let phase = Phase { name: coast_name(k), ..models.coast.clone() };
        phase
            .states(self.coast_states().iter().map(|q| self.state(*q)))
            .duration(Bounds::at_least(SHORTEST_COAST))
    }

    fn burn(&self, k: usize, models: &Models) -> Phase {
        let mut states: Vec<State> = self.coast_states().iter().map(|q| self.state(*q)).collect();
        for (s, q) in states.iter_mut().zip(self.coast_states()) {
            match *q {
                MASS => {
                    s.variable.bounds = Bounds::new(self.dry_mass(), 1.1 * self.initial_mass);
                    s.variable.guards = [false, true];
                }
                // Only a trajectory without sense would reach it: it keeps the iterates on orbits.
                SEMI_LATUS_RECTUM => {
                    s.variable.bounds = Bounds::at_least(LEAST_SEMI_LATUS_RECTUM * self.parking_radius);
                    s.variable.guards = [true; 2];
                }
                _ => {}
            }
        }
        if k == 0 {
            for (s, value) in states.iter_mut().zip(self.parking_orbit()) {
                s.initial = value.map_or(Bounds::FREE, Bounds::fixed);
            }
        }
        if k + 1 == self.burns() {
            for (s, value) in states.iter_mut().zip(self.target_orbit()) {
                s.terminal = value.map_or(Bounds::FREE, Bounds::fixed);
            }
        }
        if self.steering == BurnSteering::InertialFixed {
            states.push(self.state(THRUST_LONGITUDE));
            states.extend(self.is_spatial().then(|| self.state(THRUST_LATITUDE)));
        }
        let mut phase = Phase { name: burn_name(k), ..models.burn.clone() };
        if let Some(in_plane) = phase.controls.first_mut() {
            // Forwards, or backwards where the apogee is lowered.
            let retro =
                self.is_supersynchronous() && self.pattern[k..].iter().all(|a| *a == Apsis::Periapsis);
            let middle = if retro { PI } else { 0.0 };
            in_plane.bounds = Bounds::new(middle - PI, middle + PI);
            in_plane.guards = [true; 2];
        }
        let longest = self.burn_time_limit.unwrap_or(f64::INFINITY);
        phase.states(states).duration(Bounds::new(SHORTEST_BURN.min(longest), longest))
    }

    /// Values of the first state; none where it is free. In the plane the first longitude of a circle only turns the flight.
    fn parking_orbit(&self) -> Vec<Option<f64>> {
        let orbit = [self.parking_latus_rectum(), self.parking_eccentricity, 0.0].map(Some);
        if self.is_spatial() {
            let tilt = [Some((0.5 * self.inclination).tan()), Some(0.0)];
            orbit.into_iter().chain(tilt).chain([None, Some(self.initial_mass)]).collect()
        } else {
            let longitude = (self.parking_eccentricity == 0.0).then_some(0.0);
            orbit.into_iter().chain([longitude, Some(self.initial_mass)]).collect()
        }
    }

    /// Values of the last state; none where it is free.
    fn target_orbit(&self) -> Vec<Option<f64>> {
        let e = self.target_eccentricity;
        let shape = if e > 0.0 { None } else { Some(0.0) };
        let orbit = [Some(self.target_semi_major_axis * (1.0 - e * e)), shape, shape];
        let tilt = if self.is_spatial() { vec![Some(0.0); 2] } else { Vec::new() };
        orbit.into_iter().chain(tilt).chain([None, None]).collect()
    }
}

/// `[p, f, g]` at the end of a phase.
fn shape(phase: &str) -> [At<'_>; 3] {
    [SEMI_LATUS_RECTUM, ECCENTRICITY_F, ECCENTRICITY_G].map(|q| At::FinalState(phase, q.name))
}

fn control(q: Quantity) -> Variable {
    Variable::new(q.name, q.unit)
}

/// The first minus the second.
struct Loss;

impl VectorFunction<2, 1> for Loss {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] - z[1]]
    }
}

/// The second minus the first.
struct Gain;

impl VectorFunction<2, 1> for Gain {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[1] - z[0]]
    }
}

struct SquaredSum;

impl VectorFunction<2, 1> for SquaredSum {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [vector::dot(z, z)]
    }
}

/// The apogee radius (m) of `[p, f, g]`; the eccentricity is smooth at zero, where it is 1e-8 too large.
struct ApogeeRadius;

impl VectorFunction<3, 1> for ApogeeRadius {
    fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 1] {
        let [p, f, g] = *z;
        [p / (-vector::norm(&[f, g], 1e-8) + 1.0)]
    }
}
