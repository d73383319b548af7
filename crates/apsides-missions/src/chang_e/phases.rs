//! The phases of a landing: bounds, scales by bounds, largest misses, ends.

use std::f64::consts::{FRAC_PI_2, PI};

use apsides_ad::{Scalar, VectorFunction};
use apsides_dynamics::Quantity;
use apsides_dynamics::planar::{self, ThrottledThrust};
use apsides_dynamics::powered_descent::{self, AngledThrust, Hovering, PlumbThrust, VerticalPlaneThrust};
use apsides_ocp::{At, Bounds, Direction, OcpBuilder, Phase, State, Variable};

use super::divert::Divert;
use super::lander::{GateDirection, Lander, Motion};

pub(super) const BRAKING: &str = "braking";
pub(super) const ADJUSTMENT: &str = "adjustment";
pub(super) const AVOIDANCE: &str = "avoidance";
pub(super) const HOVER: &str = "hover";
pub(super) const FINE_AVOIDANCE: &str = "fine-avoidance";
pub(super) const DESCENT: &str = "descent";

/// Largest misses of a re-simulation.
const POSITION_MISS_M: f64 = 1e-2;
const SPEED_MISS_M_S: f64 = 1e-5;
const MASS_MISS_KG: f64 = 1e-5;

/// Guards: below the lowest place of a phase and above its highest, m.
pub(super) const BELOW_M: f64 = 1e3;
pub(super) const ABOVE_M: f64 = 50e3;
/// Guard of a flight in space around the poles, rad.
const MOST_LATITUDE: f64 = 1.55;
/// Controls of a flight in the plane.
const PLANE_CONTROLS: [Quantity; 2] = [planar::THRUST_ANGLE, planar::THROTTLE];
/// Shortest phase, s.
const SHORTEST_S: f64 = 0.5;

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
        let [latitude, eastward] = *z;
        [eastward + latitude.cos() * self.ground_speed]
    }
}

impl Lander {
    /// Names of the upward speed and of the horizontal ones.
    pub(super) fn speeds(&self) -> (Quantity, &'static [Quantity]) {
        match self.motion {
            Motion::Plane => (planar::RADIAL_SPEED, &[planar::HORIZONTAL_SPEED]),
            Motion::Space => (
                powered_descent::UPWARD_SPEED,
                &[powered_descent::EASTWARD_SPEED, powered_descent::NORTHWARD_SPEED],
            ),
        }
    }

    fn throttle(&self) -> Variable {
        let q = planar::THROTTLE;
        Variable::new(q.name, q.unit).within(self.least_throttle, 1.0)
    }

    fn mass(&self) -> State {
        state(planar::MASS, MASS_MISS_KG).within(self.dry_mass, 1.05 * self.initial_mass).guarded_above()
    }

    fn speed(&self, q: Quantity) -> State {
        state(q, SPEED_MISS_M_S).within(-1.5 * self.start_speed, 1.5 * self.start_speed).guarded()
    }

    fn angle(&self, q: Quantity) -> State {
        state(q, POSITION_MISS_M / self.body.radius)
    }

    /// Times of a phase of a flight of several.
    pub(super) fn times(&self) -> Bounds {
        Bounds::new(0.0, 2.0 * self.longest_burn())
    }

    /// Flight with the thrust in any direction within a tilt (rad) from the vertical, between two distances from the centre.
    pub(super) fn steered(&self, name: &str, tilt: f64, [low, high]: [f64; 2]) -> Phase {
        let radius = state(planar::RADIUS, POSITION_MISS_M).within(low - BELOW_M, high + ABOVE_M).guarded();
        let control = |q: Quantity, least, most| Variable::new(q.name, q.unit).within(least, most);
        let phase = match self.motion {
            Motion::Plane => {
                let [_, angle, along, upward, _] = planar::STATES;
                let (least, most) = (FRAC_PI_2 - tilt, FRAC_PI_2 + tilt);
                Phase::new(name, ThrottledThrust(self.planar()))
                    .states([
                        radius,
                        self.angle(angle).within(-0.1, PI).guarded(),
                        self.speed(along),
                        self.speed(upward),
                        self.mass(),
                    ])
                    .controls([control(planar::THRUST_ANGLE, least, most), self.throttle()])
                    .direction(Direction::InPlane {
                        angle: const { planar::THRUST_ANGLE.index_in(&PLANE_CONTROLS) },
                    })
            }
            Motion::Space => {
                let [_, longitude, latitude, upward, east, north, _] = powered_descent::STATES;
                let [site_longitude, _] = self.site;
                let pitch =
                    control(powered_descent::THRUST_PITCH, (FRAC_PI_2 - tilt).max(-FRAC_PI_2), FRAC_PI_2);
                Phase::new(name, AngledThrust(self.descent.clone()))
                    .states([
                        radius,
                        self.angle(longitude).within(site_longitude - PI, site_longitude + PI).guarded(),
                        self.angle(latitude).within(-MOST_LATITUDE, MOST_LATITUDE).guarded(),
                        self.speed(upward),
                        self.speed(east),
                        self.speed(north),
                        self.mass(),
                    ])
                    .controls([
                        control(powered_descent::THRUST_COURSE, self.azimuth, self.azimuth + 2.0 * PI).guarded(),
                        pitch,
                        self.throttle(),
                    ])
                    .direction(Direction::InSpace {
                        in_plane: const { powered_descent::THRUST_COURSE.index_in(&AngledThrust::CONTROLS) },
                        out_of_plane: const { powered_descent::THRUST_PITCH.index_in(&AngledThrust::CONTROLS) },
                    })
            }
        };
        phase.initial_time(self.times()).final_time(self.times()).duration(Bounds::at_least(SHORTEST_S))
    }

    /// States of vertical flight above a place.
    fn vertical_states(&self, [low, high]: [f64; 2]) -> [State; 3] {
        let (upward, _) = self.speeds();
        let radius = state(planar::RADIUS, POSITION_MISS_M).within(low - BELOW_M, high + BELOW_M).guarded();
        [radius, self.speed(upward), self.mass()]
    }

    fn plumb(&self, place: [f64; 2]) -> PlumbThrust {
        PlumbThrust { flight: self.descent.clone(), place }
    }

    pub(super) fn in_plane_of(&self, divert: &Divert) -> VerticalPlaneThrust {
        VerticalPlaneThrust {
            flight: self.descent.clone(),
            place: divert.from,
            course: divert.course,
            least_throttle: self.least_throttle,
        }
    }

    /// Flight from above one place to above another, from one distance from the centre down to another; vertical where they are the same.
    pub(super) fn avoidance(&self, name: &str, divert: &Divert, [low, high]: [f64; 2]) -> Phase {
        if !divert.is_needed() {
            return self.vertical(name, divert.to, [low, high]);
        }
        let [_, angle, _, forward, _] = VerticalPlaneThrust::STATES;
        let model = self.in_plane_of(divert);
        let [radius, upward, mass] = self.vertical_states([low, high]);
        let [tilt, part] = VerticalPlaneThrust::CONTROLS;
        // Neither is shared with a divert that follows: it counts from its own start, on its own course.
        let own = |mut s: State| {
            s.variable.name = format!("{} of {name}", s.variable.name);
            s
        };
        Phase::new(name, model)
            .states([
                radius.ends_at(low),
                own(self.angle(angle).within(-divert.angle, 2.0 * divert.angle).guarded())
                    .starts_at(0.0)
                    .ends_at(divert.angle),
                upward,
                own(self.speed(forward)).starts_at(0.0).ends_at(0.0),
                mass,
            ])
            .controls([
                Variable::new(tilt.name, tilt.unit).within(-divert.tilt, divert.tilt),
                Variable::new(part.name, part.unit).within(0.0, 1.0),
            ])
            .initial_time(self.times())
            .final_time(self.times())
            .duration(Bounds::at_least(SHORTEST_S))
    }

    /// Vertical flight above a place, from one distance from the centre down to another.
    pub(super) fn vertical(&self, name: &str, place: [f64; 2], [low, high]: [f64; 2]) -> Phase {
        let [radius, upward, mass] = self.vertical_states([low, high]);
        Phase::new(name, self.plumb(place))
            .states([radius.ends_at(low), upward, mass])
            .controls([self.throttle()])
            .initial_time(self.times())
            .final_time(self.times())
            .duration(Bounds::at_least(SHORTEST_S))
    }

    /// Rest above a place for a time, s.
    pub(super) fn hovering(&self, place: [f64; 2], radius: f64, time: f64) -> Phase {
        Phase::new(HOVER, Hovering(self.plumb(place)))
            .states(self.vertical_states([radius; 2]))
            .initial_time(self.times())
            .final_time(self.times())
            .duration(Bounds::fixed(time))
    }

    /// The phase from the perilune on.
    pub(super) fn starting_at_perilune(&self, mut phase: Phase) -> Phase {
        let (upward, _) = self.speeds();
        let start =
            [(planar::RADIUS, self.perilune_radius), (upward, 0.0), (planar::MASS, self.initial_mass)];
        let across: &[(Quantity, f64)] = match self.motion {
            Motion::Plane => &[(planar::POLAR_ANGLE, 0.0), (planar::HORIZONTAL_SPEED, self.start_speed)],
            Motion::Space => &[(powered_descent::NORTHWARD_SPEED, self.start_speed * self.azimuth.cos())],
        };
        for (q, value) in start.iter().chain(across) {
            if let Some(s) = state_of(&mut phase, *q) {
                s.initial = Bounds::fixed(*value);
            }
        }
        phase.initial_time(Bounds::fixed(0.0))
    }

    /// The perilune is on a plane of given azimuth; in space only.
    pub(super) fn on_orbital_plane(&self, ocp: OcpBuilder) -> OcpBuilder {
        if self.motion == Motion::Plane {
            return ocp;
        }
        let wanted = Variable::new("eastward speed in inertial space", "m/s")
            .equal_to(self.start_speed * self.azimuth.sin())
            .scaled_by(1e2);
        let inputs = [
            At::InitialState(BRAKING, powered_descent::LATITUDE.name),
            At::InitialState(BRAKING, powered_descent::EASTWARD_SPEED.name),
        ];
        let ground_speed = self.descent.rotation_rate * self.perilune_radius;
        ocp.constrain("plane of the orbit", [wanted], inputs, InertialEast { ground_speed })
    }

    /// The phase ends above the site; in space only.
    pub(super) fn ending_at_site(&self, mut phase: Phase) -> Phase {
        if self.motion == Motion::Space {
            let [longitude, latitude] = self.site.map(Bounds::fixed);
            let site = [(powered_descent::LONGITUDE, longitude), (powered_descent::LATITUDE, latitude)];
            ends_at(&mut phase, &site);
        }
        phase
    }

    /// Fixes components of the final velocity: upward, and all horizontal ones.
    pub(super) fn ends_with(&self, mut phase: Phase, upward: Option<f64>, horizontal: Option<f64>) -> Phase {
        let (up, across) = self.speeds();
        let ends = [(up, upward)].into_iter().chain(across.iter().map(|q| (*q, horizontal)));
        for (q, value) in ends {
            if let Some(value) = value {
                ends_at(&mut phase, &[(q, Bounds::fixed(value))]);
            }
        }
        phase
    }

    /// Fixes the final velocity: upwards, to the east (in the plane not used) and to the north (in the plane forward).
    fn ends_with_velocity(&self, mut phase: Phase, [up, east, north]: [f64; 3]) -> Phase {
        let (upward, across) = self.speeds();
        ends_at(&mut phase, &[(upward, Bounds::fixed(up))]);
        for (q, value) in across.iter().zip(if across.len() > 1 { [east, north] } else { [north, east] }) {
            ends_at(&mut phase, &[(*q, Bounds::fixed(value))]);
        }
        phase
    }

    /// The main braking ends at its gate: the altitude, and what the direction fixes of the velocity.
    pub(super) fn ending_at_gate(&self, mut phase: Phase) -> Phase {
        ends_at(&mut phase, &[(planar::RADIUS, Bounds::fixed(self.gate_radius))]);
        if let Some(velocity) = self.gate_velocity {
            return self.ends_with_velocity(phase, velocity);
        }
        let (up, across) = match self.gate_direction {
            _ if self.gate_speed == 0.0 => (Some(0.0), Some(0.0)),
            GateDirection::Free => (None, None),
            GateDirection::Down => (Some(-self.gate_speed), Some(0.0)),
            GateDirection::Horizontal => {
                (Some(0.0), (self.motion == Motion::Plane).then_some(self.gate_speed))
            }
        };
        self.ends_with(phase, up, across)
    }

    /// The speed at the gate, where its components leave it open.
    pub(super) fn with_gate_speed(&self, ocp: OcpBuilder) -> OcpBuilder {
        let (upward, across) = self.speeds();
        let row = Variable::new("speed squared", "m2/s2")
            .equal_to(self.gate_speed * self.gate_speed)
            .scaled_by(1e3);
        let speed = |q: &Quantity| At::FinalState(BRAKING, q.name);
        match (self.gate_direction, across) {
            // All components are fixed.
            _ if self.gate_speed == 0.0 || self.gate_velocity.is_some() => ocp,
            (GateDirection::Free, [along]) => {
                ocp.constrain("gate", [row], [speed(&upward), speed(along)], SquaredSpeed)
            }
            (GateDirection::Free, [east, north]) => {
                ocp.constrain("gate", [row], [speed(&upward), speed(east), speed(north)], SquaredSpeed)
            }
            (GateDirection::Horizontal, [east, north]) => {
                ocp.constrain("gate", [row], [speed(east), speed(north)], SquaredSpeed)
            }
            _ => ocp,
        }
    }
}

fn state(q: Quantity, miss: f64) -> State {
    State::new(q.name, q.unit).miss_below(miss)
}

/// The state of a phase that is a quantity; none where the phase has no such state.
pub(super) fn state_of(phase: &mut Phase, q: Quantity) -> Option<&mut State> {
    phase.states.iter_mut().find(|s| s.variable.name == q.name)
}

/// Bounds the final values of those quantities that are states of the phase.
pub(super) fn ends_at(phase: &mut Phase, ends: &[(Quantity, Bounds)]) {
    for (q, bounds) in ends {
        if let Some(s) = state_of(phase, *q) {
            s.terminal = *bounds;
        }
    }
}
