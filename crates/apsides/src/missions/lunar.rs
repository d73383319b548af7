//! Planar lunar soft landings with constant thrust in minimum time (Naghash and Jamilnia 2017).
//!
//! Three strategies: from a circular orbit; from the perilune of a Hohmann transfer; from that perilune with horizontal
//! braking to a gate above the site, then a vertical descent. All end with zero horizontal speed and a given radial speed.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use apsides_dynamics::planar::{
    ConstantThrust, HORIZONTAL_SPEED, MASS, POLAR_ANGLE, PlanarFlight, RADIAL_SPEED, RADIUS, THRUST_ANGLE,
    VerticalThrust,
};
use apsides_dynamics::{Body, Engine, Hohmann, Quantity};
use apsides_ocp::{
    At, Bounds, Guess, Ocp, OcpError, Phase, PhaseGuess, PhaseTrajectory, Sense, State, Term, Trajectory,
    Variable,
};

use super::{Kind, Posed};
use crate::key::{Key, Range, Values};
use crate::{Curve, Error};

pub(super) const DIRECT: Kind = Kind {
    name: "lunar-direct",
    title: "Soft landing from a circular lunar orbit, constant thrust, minimum time",
    flight_keys: &[COMMON],
    check: |v| Start::direct(v).map(|_| ()),
    pose: |v| single_phase(v, Start::direct(v)),
    results: common_results,
    headline: HEADLINE,
    curves,
};

pub(super) const PERILUNE: Kind = Kind {
    name: "lunar-perilune",
    title: "Soft landing from the perilune of a Hohmann transfer, constant thrust, minimum time",
    flight_keys: &[COMMON, PERILUNE_KEYS],
    check: |v| Start::perilune(v).map(|_| ()),
    pose: |v| single_phase(v, Start::perilune(v)),
    results: common_results,
    headline: HEADLINE,
    curves,
};

pub(super) const TWO_PHASE: Kind = Kind {
    name: "lunar-two-phase",
    title: "Horizontal braking from perilune to a gate, then vertical descent, constant thrust, minimum time",
    flight_keys: &[COMMON, PERILUNE_KEYS, GATE_KEYS],
    check: |v| gate(v).map(|_| ()),
    pose: two_phase,
    results: two_phase_results,
    headline: &[
        "flight_time_s",
        "braking_time_s",
        "descent_time_s",
        "gate_radial_velocity_m_s",
        "final_mass_kg",
    ],
    curves,
};

const HEADLINE: &[&str] = &["flight_time_s", "final_mass_kg", "final_thrust_angle_deg"];

const COMMON: &[Key] = &[
    Key::number("initial_mass_kg", 300.0, Range::POSITIVE, "mass in the parking orbit"),
    Key::number("dry_mass_kg", 60.0, Range::POSITIVE, "mass without propellant"),
    Key::number("thrust_n", 440.0, Range::POSITIVE, "thrust, constant"),
    Key::number("isp_s", 310.0, Range::POSITIVE, "specific impulse"),
    Key::number(
        "orbit_altitude_km",
        100.0,
        Range::closed(0.1, 10_000.0),
        "altitude of the circular parking orbit",
    ),
    Key::number(
        "touchdown_radial_velocity_m_s",
        -5.0,
        Range::closed(-100.0, 0.0),
        "radial speed at touchdown",
    ),
    Key::number(
        "gravitational_parameter_km3_s2",
        4904.8695,
        Range::POSITIVE,
        "of the Moon, as printed in the paper (GRAIL: 4902.8001)",
    ),
    Key::number("moon_radius_km", 1737.1, Range::POSITIVE, "radius of the Moon"),
    Key::number(
        "standard_gravity_m_s2",
        9.807,
        Range::closed(9.8, 9.81),
        "unit of the specific impulse, as in the paper",
    ),
];

const PERILUNE_KEYS: &[Key] = &[Key::number(
    "perilune_altitude_km",
    15.0,
    Range::from(0.0),
    "altitude of the perilune of the transfer",
)];

const GATE_KEYS: &[Key] = &[Key::number(
    "gate_altitude_km",
    2.0,
    Range::POSITIVE,
    "altitude where the horizontal speed is zero and the vertical descent begins",
)];

/// Largest miss of a re-simulation, from the precision wanted of a landing.
const POSITION_MISS_M: f64 = 1e-3;
const SPEED_MISS_M_S: f64 = 1e-6;
const MASS_MISS_KG: f64 = 1e-6;

/// Vehicle and state at ignition.
struct Start {
    flight: PlanarFlight,
    radius: f64,
    horizontal_speed: f64,
    mass: f64,
    dry_mass: f64,
    touchdown_speed: f64,
}

impl Start {
    /// Ignition on the parking orbit.
    fn direct(v: &Values) -> Result<Self, String> {
        let text = |e: apsides_dynamics::DynamicsError| e.to_string();
        let body =
            Body::new(v.number("gravitational_parameter_km3_s2") * 1e9, v.number("moon_radius_km") * 1e3)
                .map_err(text)?;
        let exhaust_velocity = v.number("isp_s") * v.number("standard_gravity_m_s2");
        let engine = Engine::with_exhaust_velocity(v.number("thrust_n"), exhaust_velocity).map_err(text)?;
        let altitude = v.number("orbit_altitude_km") * 1e3;
        let start = Self {
            flight: PlanarFlight::new(body, engine),
            radius: body.radius + altitude,
            horizontal_speed: body.circular_speed(altitude).map_err(text)?,
            mass: v.number("initial_mass_kg"),
            dry_mass: v.number("dry_mass_kg"),
            touchdown_speed: v.number("touchdown_radial_velocity_m_s"),
        };
        start.check()?;
        Ok(start)
    }

    /// Ignition at the perilune of a Hohmann transfer from the parking orbit.
    fn perilune(v: &Values) -> Result<Self, String> {
        let parking = Self::direct(v)?;
        let perilune = v.number("perilune_altitude_km") * 1e3;
        let body = parking.flight.body;
        let orbit = v.number("orbit_altitude_km") * 1e3;
        if perilune >= orbit {
            return Err(format!(
                "`perilune_altitude_km` is {}, it must be below the parking orbit (`orbit_altitude_km` = {})",
                perilune / 1e3,
                orbit / 1e3
            ));
        }
        let transfer =
            Hohmann::new(&body, parking.radius, body.radius + perilune).map_err(|e| e.to_string())?;
        let start = Self {
            radius: body.radius + perilune,
            horizontal_speed: transfer.arrival_speed,
            mass: parking.flight.engine.mass_after(parking.mass, transfer.departure_impulse),
            ..parking
        };
        start.check()?;
        Ok(start)
    }

    /// What no flight can mend: too little thrust even when empty, too little propellant even without losses.
    fn check(&self) -> Result<(), String> {
        if self.dry_mass >= self.mass {
            return Err(format!(
                "`dry_mass_kg` is {}, it must be below the mass at ignition, {:.3} kg",
                self.dry_mass, self.mass
            ));
        }
        let engine = self.flight.engine;
        let weight = self.dry_mass * self.flight.body.surface_gravity();
        if engine.thrust <= weight {
            return Err(format!(
                "`thrust_n` is {}, it cannot stop the vehicle: even empty (`dry_mass_kg` = {}) it weighs {weight:.1} N \
                 on the surface; raise the thrust or reduce the dry mass",
                engine.thrust, self.dry_mass
            ));
        }
        let available = engine.velocity_change(self.mass, self.dry_mass);
        if available <= self.horizontal_speed {
            return Err(format!(
                "the propellant gives {available:.1} m/s down to `dry_mass_kg` = {}, but {:.1} m/s must be braked; \
                 raise `isp_s` or `initial_mass_kg` or reduce `dry_mass_kg`",
                self.dry_mass, self.horizontal_speed
            ));
        }
        Ok(())
    }

    /// Time to burn all propellant, s.
    fn burn_time(&self) -> f64 {
        (self.mass - self.dry_mass) / self.flight.engine.mass_flow()
    }

    /// Time to burn the whole mass, s: above any flight, so that the dry mass alone limits the propellant.
    fn longest_time(&self) -> f64 {
        self.mass / self.flight.engine.mass_flow()
    }

    /// Expected time of flight: the rocket equation with a tenth of losses, at most nine tenths of the burn time.
    fn expected_time(&self) -> f64 {
        let engine = self.flight.engine;
        let burnt = self.mass - engine.mass_after(self.mass, 1.1 * self.horizontal_speed);
        (burnt / engine.mass_flow()).min(0.9 * self.burn_time())
    }

    fn body_radius(&self) -> f64 {
        self.flight.body.radius
    }

    /// The braking phase down to a radius, with or without a given radial speed there.
    fn braking(&self, name: &str, final_radius: f64, final_speed: Option<f64>) -> Phase {
        let ceiling = self.radius + 100e3;
        let fast = 1.5 * self.horizontal_speed;
        let radial = state(RADIAL_SPEED, SPEED_MISS_M_S).within(-fast, fast).starts_at(0.0);
        Phase::new(name, ConstantThrust(self.flight))
            .states([
                state(RADIUS, POSITION_MISS_M)
                    .within(self.body_radius(), ceiling)
                    .starts_at(self.radius)
                    .ends_at(final_radius),
                state(POLAR_ANGLE, POSITION_MISS_M / self.body_radius()).within(0.0, PI).starts_at(0.0),
                state(HORIZONTAL_SPEED, SPEED_MISS_M_S)
                    .within(-0.1 * fast, fast)
                    .starts_at(self.horizontal_speed)
                    .ends_at(0.0),
                match final_speed {
                    Some(v) => radial.ends_at(v),
                    None => radial,
                },
                state(MASS, MASS_MISS_KG).within(self.dry_mass, self.mass).starts_at(self.mass),
            ])
            .controls([control(THRUST_ANGLE).within(-0.5 * PI, 1.5 * PI)])
            .final_time(Bounds::new(1.0, self.longest_time()))
    }

    fn braking_guess(&self, final_radius: f64, final_speed: f64) -> Result<PhaseGuess, OcpError> {
        let time = self.expected_time();
        let mass = self.mass - time * self.flight.engine.mass_flow();
        let angle = 0.5 * time * self.horizontal_speed / self.radius;
        PhaseGuess::samples(
            &[0.0, time],
            vec![
                vec![self.radius, 0.0, self.horizontal_speed, 0.0, self.mass],
                vec![final_radius, angle, 0.0, final_speed, mass],
            ],
            vec![vec![GUESSED_THRUST_ANGLE]; 2],
        )
    }
}

/// Backwards and up: between braking (180 deg) and holding the height (90 deg).
const GUESSED_THRUST_ANGLE: f64 = 150.0 / 180.0 * PI;

fn state(q: Quantity, miss: f64) -> State {
    State::new(q.name, q.unit).miss_below(miss)
}

fn control(q: Quantity) -> Variable {
    Variable::new(q.name, q.unit)
}

fn conflict(reason: String) -> Error {
    Error::Conflict { place: "mission".into(), reason }
}

fn single_phase(_: &Values, start: Result<Start, String>) -> Result<Posed, Error> {
    let start = start.map_err(conflict)?;
    let surface = start.body_radius();
    let ocp = Ocp::builder("lunar landing")
        .phase(start.braking("braking", surface, Some(start.touchdown_speed)))
        .minimize("flight_time", "s", At::FinalTime("braking"))
        .objective_scale(start.expected_time())
        .build()?;
    let guess = start.braking_guess(surface, start.touchdown_speed)?;
    Ok(Posed { guess: Guess::from_phases(&ocp, vec![guess]), ocp })
}

/// Ignition and gate altitude (m).
fn gate(v: &Values) -> Result<(Start, f64), String> {
    let start = Start::perilune(v)?;
    let gate = v.number("gate_altitude_km") * 1e3;
    let perilune = start.radius - start.body_radius();
    if gate >= perilune {
        return Err(format!(
            "`gate_altitude_km` is {}, it must be below the perilune (`perilune_altitude_km` = {})",
            gate / 1e3,
            perilune / 1e3
        ));
    }
    Ok((start, gate))
}

fn two_phase(v: &Values) -> Result<Posed, Error> {
    let (start, gate) = gate(v).map_err(conflict)?;
    let surface = start.body_radius();
    let longest = start.longest_time();
    let descent = Phase::new("descent", VerticalThrust(start.flight))
        .states([
            state(RADIUS, POSITION_MISS_M).within(surface, start.radius).ends_at(surface),
            state(RADIAL_SPEED, SPEED_MISS_M_S)
                .within(-0.5 * start.horizontal_speed, 0.0)
                .ends_at(start.touchdown_speed),
            state(MASS, MASS_MISS_KG).within(start.dry_mass, start.mass),
        ])
        .initial_time(Bounds::new(1.0, longest))
        .final_time(Bounds::new(1.0, longest));
    let ocp = Ocp::builder("lunar landing in two phases")
        .phase(start.braking("braking", surface + gate, None))
        .phase(descent)
        .link("braking", "descent")
        .objective(Sense::Minimize, "flight_time", "s", [Term::End(At::FinalTime("descent"), 1.0)])
        .objective_scale(start.expected_time())
        .build()?;
    // At constant deceleration from twice the mean speed; half of lunar gravity is a usual net deceleration.
    let speed = -(gate * start.flight.body.surface_gravity()).sqrt();
    let braking = start.braking_guess(surface + gate, speed)?;
    let begin = braking.final_time;
    let flow = start.flight.engine.mass_flow();
    let mass = start.mass - begin * flow;
    let time = 2.0 * gate / speed.abs();
    let descent = PhaseGuess::samples(
        &[begin, begin + time],
        vec![
            vec![surface + gate, speed, mass],
            vec![surface, start.touchdown_speed, (mass - time * flow).max(start.dry_mass)],
        ],
        vec![vec![]; 2],
    )?;
    Ok(Posed { guess: Guess::from_phases(&ocp, vec![braking, descent]), ocp })
}

fn common_results(v: &Values, t: &Trajectory) -> BTreeMap<String, f64> {
    let braking = &t.phases[0];
    let end = braking.final_state();
    let moon_radius_km = v.number("moon_radius_km");
    let angle = |time: f64| braking.control_at(time)[0].to_degrees();
    let mass = t.phases.last().and_then(|p| p.final_state().last().copied()).unwrap_or(f64::NAN);
    let ignition = braking.state_at(braking.initial_time)[4];
    let highest = highest_altitude(braking, moon_radius_km * 1e3);
    [
        ("flight_time_s", t.phases.last().map_or(f64::NAN, |p| p.final_time)),
        ("final_mass_kg", mass),
        ("ignition_mass_kg", ignition),
        ("propellant_kg", v.number("initial_mass_kg") - mass),
        ("initial_thrust_angle_deg", angle(braking.initial_time)),
        ("final_thrust_angle_deg", angle(braking.final_time)),
        ("downrange_angle_deg", end[1].to_degrees()),
        ("downrange_km", end[1] * moon_radius_km),
        ("max_altitude_km", highest / 1e3),
    ]
    .into_iter()
    .map(|(k, v)| (k.to_owned(), v))
    .collect()
}

/// Samples per interval for figures and the highest point.
const SAMPLES: usize = 50;

fn sample_times(p: &PhaseTrajectory) -> impl Iterator<Item = f64> + '_ {
    let instants = |w: &[f64]| {
        let (a, b) = (w[0], w[1]);
        (0..=SAMPLES).map(move |k| a + (b - a) * k as f64 / SAMPLES as f64)
    };
    p.state.breaks().windows(2).flat_map(instants)
}

fn highest_altitude(p: &PhaseTrajectory, body_radius: f64) -> f64 {
    sample_times(p).map(|t| p.state.component(t, 0) - body_radius).fold(f64::NEG_INFINITY, f64::max)
}

/// Altitude and speed over the downrange distance; the vertical descent stays at its place.
fn curves(v: &Values, t: &Trajectory) -> Vec<Curve> {
    let body_radius = v.number("moon_radius_km") * 1e3;
    let place = |p: &PhaseTrajectory, time: f64| match p.state.dimension() {
        5 => p.state.component(time, 1) * body_radius,
        _ => t.phases[0].final_state()[1] * body_radius,
    };
    let line = |p: &PhaseTrajectory| {
        let points = sample_times(p).map(|s| [place(p, s), p.state.component(s, 0) - body_radius]);
        (p.name.clone(), points.collect())
    };
    vec![Curve {
        title: "Altitude over downrange distance".into(),
        x: ("downrange distance".into(), "m".into()),
        y: ("altitude".into(), "m".into()),
        series: t.phases.iter().map(line).collect(),
    }]
}

fn two_phase_results(v: &Values, t: &Trajectory) -> BTreeMap<String, f64> {
    let mut results = common_results(v, t);
    let (braking, descent) = (&t.phases[0], &t.phases[1]);
    results.insert("braking_time_s".into(), braking.final_time - braking.initial_time);
    results.insert("descent_time_s".into(), descent.final_time - descent.initial_time);
    results.insert("gate_radial_velocity_m_s".into(), braking.final_state()[3]);
    results
}
