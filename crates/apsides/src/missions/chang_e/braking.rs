//! The main braking as an optimal control problem.

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::Quantity;
use apsides_dynamics::planar::{self, ThrottledThrust};
use apsides_dynamics::powered_descent::{self, AngledThrust, EASTWARD_SPEED, LATITUDE};
use apsides_ocp::{At, Bounds, Direction, Guess, Ocp, OcpBuilder, Phase, PhaseGuess, State, Variable};

use super::lander::{GateDirection, Lander};
use crate::Error;
use crate::missions::Posed;

pub(super) const BRAKING: &str = "braking";

/// Largest misses of a re-simulation.
const POSITION_MISS_M: f64 = 1e-2;
const SPEED_MISS_M_S: f64 = 1e-5;
const MASS_MISS_KG: f64 = 1e-5;

/// Pitch of the thrust at the end of the guess, above the direction against the flight.
const LAST_PITCH: f64 = 0.4;
/// Guard below the gate, m.
const BELOW_GATE_M: f64 = 1e3;
/// Guard above the perilune, m.
const ABOVE_PERILUNE_M: f64 = 50e3;
/// Guard of a flight in space around the poles, rad.
const MOST_LATITUDE: f64 = 1.55;

/// Sum of the squares of the components of a velocity.
struct SquaredSpeed;

impl<const N: usize> VectorFunction<N, 1> for SquaredSpeed {
    fn evaluate<S: Scalar>(&self, v: &[S; N]) -> [S; 1] {
        [v.iter().fold(S::from(0.0), |sum, v| sum + v.square())]
    }
}

/// The eastward speed in inertial space from latitude and eastward speed over the ground, at the radius of the start.
struct InertialEast {
    ground_speed: f64,
}

impl VectorFunction<2, 1> for InertialEast {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[1] + z[0].cos() * self.ground_speed]
    }
}

impl Lander {
    fn throttle(&self) -> Variable {
        let q = planar::THROTTLE;
        Variable::new(q.name, q.unit).within(self.least_throttle, 1.0)
    }

    fn mass(&self) -> State {
        let mass = state(planar::MASS, MASS_MISS_KG).within(self.dry_mass, 1.05 * self.initial_mass);
        mass.starts_at(self.initial_mass)
    }

    fn radius(&self) -> State {
        let (low, high) = (self.gate_radius - BELOW_GATE_M, self.perilune_radius + ABOVE_PERILUNE_M);
        state(planar::RADIUS, POSITION_MISS_M)
            .within(low, high)
            .starts_at(self.perilune_radius)
            .ends_at(self.gate_radius)
    }

    fn speed(&self, q: Quantity) -> State {
        state(q, SPEED_MISS_M_S).within(-1.5 * self.start_speed, 1.5 * self.start_speed)
    }

    fn times(&self) -> Bounds {
        Bounds::new(0.1 * self.expected_braking(), self.longest_burn())
    }

    /// The speed at the gate, and its direction: upward speed first.
    fn at_gate(&self, ocp: OcpBuilder, upward: Quantity, horizontal: &[Quantity]) -> OcpBuilder {
        let speed = |q: &Quantity| At::FinalState(BRAKING, q.name);
        let row = |value: f64| Variable::new("speed squared", "m2/s2").equal_to(value * value).scaled_by(1e3);
        if self.gate_direction != GateDirection::Free || self.gate_speed == 0.0 {
            // Components are fixed; in space the horizontal direction stays free.
            return match (self.gate_direction, horizontal) {
                (GateDirection::Horizontal, [east, north]) if self.gate_speed > 0.0 => {
                    ocp.constrain("gate", [row(self.gate_speed)], [speed(east), speed(north)], SquaredSpeed)
                }
                _ => ocp,
            };
        }
        match horizontal {
            [along] => {
                ocp.constrain("gate", [row(self.gate_speed)], [speed(&upward), speed(along)], SquaredSpeed)
            }
            [east, north] => {
                let speeds = [speed(&upward), speed(east), speed(north)];
                ocp.constrain("gate", [row(self.gate_speed)], speeds, SquaredSpeed)
            }
            _ => ocp,
        }
    }

    /// Fixes the components of the velocity at the gate that its direction fixes: the upward one, then the horizontal ones.
    fn fix_gate(&self, upward: &mut State, horizontal: &mut [State]) {
        let (up, across) = match self.gate_direction {
            _ if self.gate_speed == 0.0 => (Some(0.0), Some(0.0)),
            GateDirection::Free => (None, None),
            GateDirection::Down => (Some(-self.gate_speed), Some(0.0)),
            GateDirection::Horizontal => (Some(0.0), (horizontal.len() == 1).then_some(self.gate_speed)),
        };
        if let Some(value) = up {
            upward.terminal = Bounds::fixed(value);
        }
        if let Some(value) = across {
            horizontal.iter_mut().for_each(|s| s.terminal = Bounds::fixed(value));
        }
    }

    fn finished(&self, ocp: OcpBuilder) -> Result<Ocp, Error> {
        let ocp = ocp.maximize("final_mass", "kg", At::FinalState(BRAKING, planar::MASS.name));
        Ok(ocp.objective_scale(self.initial_mass).build()?)
    }

    /// In the plane of the orbit, from the perilune at polar angle 0.
    pub(super) fn planar_braking(&self) -> Result<Posed, Error> {
        let [r, angle, along, upward, _] = planar::STATES;
        let mut horizontal = [self.speed(along).starts_at(self.start_speed)];
        let mut up = self.speed(upward).starts_at(0.0);
        self.fix_gate(&mut up, &mut horizontal);
        let [horizontal] = horizontal;
        let angle = state(angle, POSITION_MISS_M / self.body.radius).within(-0.1, PI).starts_at(0.0);
        let q = planar::THRUST_ANGLE;
        let phase = Phase::new(BRAKING, ThrottledThrust(self.planar()))
            .states([self.radius(), angle, horizontal, up, self.mass()])
            .controls([Variable::new(q.name, q.unit).within(-0.5 * PI, 1.5 * PI), self.throttle()])
            .direction(Direction::InPlane { angle: 0 })
            .final_time(self.times());
        debug_assert_eq!(r, planar::RADIUS);
        let ocp = self.finished(self.at_gate(Ocp::builder("main braking").phase(phase), upward, &[along]))?;
        let time = self.expected_braking();
        let last = self.last_mass();
        let guess = PhaseGuess::samples(
            &[0.0, time],
            vec![
                vec![self.perilune_radius, 0.0, self.start_speed, 0.0, self.initial_mass],
                vec![
                    self.gate_radius,
                    self.guessed_angle(),
                    0.9 * self.gate_speed,
                    -0.4 * self.gate_speed,
                    last,
                ],
            ],
            vec![vec![PI, 1.0], vec![PI - LAST_PITCH, 1.0]],
        )?;
        let guess = Guess::from_phases(&ocp, vec![guess]);
        Ok(Posed::new(ocp, guess))
    }

    /// Over the rotating Moon, from a free perilune on a plane of given azimuth to the site.
    pub(super) fn spatial_braking(&self) -> Result<Posed, Error> {
        let [_, longitude, latitude, upward, east, north, _] = powered_descent::STATES;
        let place = |q: Quantity, bounds: Bounds, site: f64| {
            let mut place = state(q, POSITION_MISS_M / self.body.radius).ends_at(site);
            place.variable.bounds = bounds;
            place
        };
        let [site_longitude, site_latitude] = self.site;
        let (azimuth_sin, azimuth_cos) = self.azimuth.sin_cos();
        let mut across = [self.speed(east), self.speed(north).starts_at(self.start_speed * azimuth_cos)];
        let mut up = self.speed(upward).starts_at(0.0);
        self.fix_gate(&mut up, &mut across);
        let [to_east, to_north] = across;
        let angle = |q: Quantity, least, most| Variable::new(q.name, q.unit).within(least, most);
        let phase = Phase::new(BRAKING, AngledThrust(self.descent.clone()))
            .states([
                self.radius(),
                place(longitude, Bounds::new(site_longitude - PI, site_longitude + PI), site_longitude),
                place(latitude, Bounds::new(-MOST_LATITUDE, MOST_LATITUDE), site_latitude),
                up,
                to_east,
                to_north,
                self.mass(),
            ])
            .controls([
                angle(powered_descent::THRUST_COURSE, self.azimuth, self.azimuth + 2.0 * PI),
                angle(powered_descent::THRUST_PITCH, -FRAC_PI_2, FRAC_PI_2),
                self.throttle(),
            ])
            .direction(Direction::InSpace { in_plane: 0, out_of_plane: 1 })
            .final_time(self.times());
        let turn = self.descent.rotation_rate * self.perilune_radius;
        let wanted = Variable::new("eastward speed in inertial space", "m/s")
            .equal_to(self.start_speed * azimuth_sin)
            .scaled_by(1e2);
        let ocp = Ocp::builder("main braking").phase(phase).constrain(
            "plane of the orbit",
            [wanted],
            [At::InitialState(BRAKING, LATITUDE.name), At::InitialState(BRAKING, EASTWARD_SPEED.name)],
            InertialEast { ground_speed: turn },
        );
        let ocp = self.finished(self.at_gate(ocp, upward, &[east, north]))?;
        let back = self.guessed_angle();
        let start =
            [site_longitude - back * azimuth_sin / site_latitude.cos(), site_latitude - back * azimuth_cos];
        let over_ground = self.start_speed * azimuth_sin - turn * start[1].cos();
        let (time, speed) = (self.expected_braking(), 0.9 * self.gate_speed);
        let course = self.azimuth + PI;
        let guess = PhaseGuess::samples(
            &[0.0, time],
            vec![
                vec![
                    self.perilune_radius,
                    start[0],
                    start[1],
                    0.0,
                    over_ground,
                    self.start_speed * azimuth_cos,
                    self.initial_mass,
                ],
                vec![
                    self.gate_radius,
                    site_longitude,
                    site_latitude,
                    -0.4 * self.gate_speed,
                    speed * azimuth_sin,
                    speed * azimuth_cos,
                    self.last_mass(),
                ],
            ],
            vec![vec![course, 0.0, 1.0], vec![course, LAST_PITCH, 1.0]],
        )?;
        let guess = Guess::from_phases(&ocp, vec![guess]);
        Ok(Posed::new(ocp, guess))
    }

    /// Central angle of the braking at constant deceleration.
    fn guessed_angle(&self) -> f64 {
        0.55 * self.start_speed * self.expected_braking() / self.perilune_radius
    }

    fn last_mass(&self) -> f64 {
        let burnt = self.expected_braking() * self.descent.engine.mass_flow();
        (self.initial_mass - burnt).max(self.dry_mass)
    }
}

fn state(q: Quantity, miss: f64) -> State {
    State::new(q.name, q.unit).miss_below(miss)
}
