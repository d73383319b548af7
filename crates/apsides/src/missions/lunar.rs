//! Planar lunar soft landings, from those of Naghash and Jamilnia 2017 (constant thrust in minimum time) on.
//!
//! Strategies: from a circular orbit; from the perilune of a Hohmann transfer; from that perilune with horizontal braking to a
//! gate above the site, then a vertical descent; the whole transfer with its deorbit burn and coast. All end with zero
//! horizontal speed and a given radial speed. The throttle may be free, the rate of the thrust angle limited.

use std::f64::consts::TAU;

use apsides_dynamics::Hohmann;
use apsides_dynamics::planar::PlanarFlight;
use apsides_dynamics::planar::flat::FlatVerticalThrust;
use apsides_flatness::FlatSystem;
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpBuilder, Phase, PhaseGuess, Sense, Term, Variable};

use super::{Flown, Kind, Optimised, Posed};
use crate::Error;
use crate::key::Values;
use phases::{COAST, DESCENT, PeriluneAltitude, Steering, Target, Throttle};
use vehicle::Start;

mod guess;
mod keys;
mod phases;
mod results;
mod vehicle;

pub(super) const DIRECT: Kind = Kind {
    name: "lunar-direct",
    title: "Soft landing from a circular lunar orbit: full thrust in minimum time, or throttled with least propellant",
    flight_keys: &[keys::COMMON, keys::THROTTLE_IN_ORBIT, keys::TOUCHDOWN, keys::PITCH_RATE],
    check: |v| Start::direct(v).and(Steering::of(v)).map(|_| ()),
    flown: Flown::Optimised(BY_DIRECT),
};

const BY_DIRECT: Optimised = Optimised {
    nothing_at_zero: &[],
    pose: direct,
    results: results::results,
    headline: HEADLINE,
    curves: results::curves,
    approach: |_| Vec::new(),
    checks: |_, _| Vec::new(),
    missing: |_, _| None,
    margins: super::no_margins,
    reach: None,
    decide: None,
    site_checks: |_, _, _| Vec::new(),
    deviating: None,
    simulate: None,
};

pub(super) const PERILUNE: Kind = Kind {
    name: "lunar-perilune",
    title: "Soft landing from the perilune of a Hohmann transfer: full thrust in minimum time, or throttled with least propellant",
    flight_keys: &[keys::COMMON, keys::PERILUNE, keys::THROTTLE, keys::TOUCHDOWN, keys::PITCH_RATE],
    check: |v| Start::perilune(v).and(Steering::of(v)).map(|_| ()),
    flown: Flown::Optimised(Optimised { pose: perilune, ..BY_DIRECT }),
};

pub(super) const TWO_PHASE: Kind = Kind {
    name: "lunar-two-phase",
    title: "Horizontal braking from perilune to a gate, then vertical descent: full thrust in minimum time, or throttled with least propellant",
    flight_keys: &[keys::COMMON, keys::PERILUNE, keys::GATE, keys::THROTTLE, keys::PITCH_RATE],
    check: |v| gate(v).and(Steering::of(v)).map(|_| ()),
    flown: Flown::Optimised(Optimised {
        pose: two_phase,
        headline: &[
            "flight_time_s",
            "braking_time_s",
            "descent_time_s",
            "gate_radial_velocity_m_s",
            "final_mass_kg",
        ],
        ..BY_DIRECT
    }),
};

pub(super) const TRANSFER: Kind = Kind {
    name: "lunar-transfer",
    title: "The whole way from a circular lunar orbit to the surface: deorbit burn, coast and braking with least propellant",
    flight_keys: &[keys::COMMON, keys::FLOOR, keys::TOUCHDOWN, keys::PITCH_RATE],
    check: |v| transfer_legs(v).and(Steering::of(v)).map(|_| ()),
    flown: Flown::Optimised(Optimised {
        pose: transfer,
        headline: &[
            "final_mass_kg",
            "deorbit_time_s",
            "coast_time_s",
            "braking_time_s",
            "perilune_altitude_km",
        ],
        ..BY_DIRECT
    }),
};

const HEADLINE: &[&str] = &["flight_time_s", "final_mass_kg", "final_thrust_angle_deg"];

/// Time where the thrust is full, for it is the propellant then; else the final mass.
fn objective(ocp: OcpBuilder, last: &str, steering: &Steering, start: &Start) -> OcpBuilder {
    if steering.saves_propellant() {
        ocp.maximize("final_mass", "kg", At::FinalState(last, "mass")).objective_scale(start.mass)
    } else {
        ocp.objective(Sense::Minimize, "flight_time", "s", [Term::End(At::FinalTime(last), 1.0)])
            .objective_scale(start.expected_time())
    }
}

/// Phases in their order, each linked to the next.
fn chain(name: &str, phases: Vec<Phase>) -> OcpBuilder {
    let names: Vec<String> = phases.iter().map(|p| p.name.clone()).collect();
    let ocp = phases.into_iter().fold(Ocp::builder(name), OcpBuilder::phase);
    names.windows(2).fold(ocp, |ocp, pair| ocp.link(&pair[0], &pair[1]))
}

/// Body and engine.
pub(crate) fn flight(v: &Values) -> Result<PlanarFlight, Error> {
    Ok(Start::direct(v).map_err(Error::in_mission)?.flight)
}

fn direct(v: &Values) -> Result<Posed, Error> {
    let start = Start::direct(v).map_err(Error::in_mission)?;
    let steering = Steering::of(v).map_err(Error::in_mission)?;
    single(&start, &steering)
}

fn perilune(v: &Values) -> Result<Posed, Error> {
    let start = Start::perilune(v).map_err(Error::in_mission)?;
    let steering = Steering::of(v).map_err(Error::in_mission)?;
    single(&start, &steering)
}

/// From the start to the surface.
fn single(start: &Start, steering: &Steering) -> Result<Posed, Error> {
    let phases = start.landing(steering, start.touchdown());
    let last = phases[phases.len() - 1].name.clone();
    let ocp = objective(chain("lunar landing", phases), &last, steering, start).build()?;
    let (guesses, _) = landing_guess(start, steering, start.touchdown(), start.touchdown_speed)?;
    let flat_systems = steering.is_flat().then(|| vec![FlatSystem::new(start.flat())]);
    let guess = Guess::from_phases(&ocp, guesses);
    Ok(Posed { flat_systems, ..Posed::new(ocp, guess) })
}

/// Guesses of the phases of a landing with a guessed radial speed at the target, and time and mass there.
fn landing_guess(
    start: &Start,
    steering: &Steering,
    target: Target,
    radial_speed: f64,
) -> Result<(Vec<PhaseGuess>, (f64, f64)), Error> {
    let mut guesses = Vec::new();
    let mut begin = (0.0, 0.0);
    if steering.throttle == Throttle::Coast {
        let coast = start.coast_samples();
        begin = guess::end(&coast);
        guesses.push(guess::coasting(&coast)?);
    }
    let mut end = (begin.0, start.mass);
    for samples in start.braking_samples(steering, target, radial_speed, begin) {
        guesses.push(guess::powered(&samples, steering)?);
        end = samples.last().map_or(end, |s| (s.time, s.state[4]));
    }
    Ok((guesses, end))
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
    let (start, gate) = gate(v).map_err(Error::in_mission)?;
    // With a limited pitch rate the thrust is upright at the gate, where the descent takes over.
    let steering = Steering::of(v).map_err(Error::in_mission)?;
    let steering = Steering { upright: steering.pitches(), ..steering };
    let target = Target { radius: start.body_radius() + gate, radial_speed: None };
    let mut phases = start.landing(&steering, target);
    phases.push(start.descent(&steering));
    let ocp = chain("lunar landing in two phases", phases);
    let ocp = objective(ocp, DESCENT, &steering, &start).build()?;
    // At constant deceleration from twice the mean speed; half of lunar gravity is a usual net deceleration.
    let speed = -(gate * start.flight.body.surface_gravity()).sqrt();
    let (mut guesses, (begin, mass)) = landing_guess(&start, &steering, target, speed)?;
    let time = 2.0 * gate / speed.abs();
    let final_mass = (mass - time * start.flight.engine.mass_flow()).max(start.dry_mass);
    guesses.push(PhaseGuess::samples(
        &[begin, begin + time],
        vec![vec![target.radius, speed, mass], vec![start.body_radius(), start.touchdown_speed, final_mass]],
        vec![vec![1.0; usize::from(steering.throttles())]; 2],
    )?);
    let flat = start.flat();
    let flat_systems =
        steering.is_flat().then(|| vec![FlatSystem::new(flat), FlatSystem::new(FlatVerticalThrust(flat))]);
    let guess = Guess::from_phases(&ocp, guesses);
    Ok(Posed { flat_systems, ..Posed::new(ocp, guess) })
}

/// Parking orbit, Hohmann transfer to the floor, ignition there.
fn transfer_legs(v: &Values) -> Result<(Start, Hohmann, Start), String> {
    let parking = Start::direct(v)?;
    let (transfer, arrival) = parking.after_transfer(v, keys::FLOOR[0].path)?;
    Ok((parking, transfer, arrival))
}

fn transfer(v: &Values) -> Result<Posed, Error> {
    let (parking, hohmann, arrival) = transfer_legs(v).map_err(Error::in_mission)?;
    let steering = Steering::of(v).map_err(Error::in_mission)?;
    let floor = v.number(keys::FLOOR[0].path) * 1e3;
    let times = Bounds::new(0.0, parking.longest_burn() + parking.longest_coast());
    let mut phases = vec![parking.deorbit(times), parking.coast(times)];
    phases.extend(parking.braking(&steering, parking.touchdown(), TAU, times));
    let last = phases[phases.len() - 1].name.clone();
    let ocp = chain("lunar transfer and landing", phases)
        .constrain(
            "clearance of the coast",
            [Variable::new("perilune altitude", "m").at_least(floor).scaled_by(arrival.body_radius())],
            [
                At::InitialState(COAST, "radius"),
                At::InitialState(COAST, "horizontal speed"),
                At::InitialState(COAST, "radial speed"),
            ],
            PeriluneAltitude(parking.flight),
        )
        .maximize("final_mass", "kg", At::FinalState(&last, "mass"))
        .objective_scale(parking.mass)
        .build()?;
    let [deorbit, coast] = parking.transfer_samples(&hohmann, &arrival);
    let begin = guess::end(&coast);
    let target = parking.touchdown();
    let braking = arrival.braking_samples(&steering, target, parking.touchdown_speed, begin);
    let mut guesses = vec![guess::powered(&deorbit, &Steering::FULL)?, guess::coasting(&coast)?];
    for samples in &braking {
        guesses.push(guess::powered(samples, &steering)?);
    }
    let guess = Guess::from_phases(&ocp, guesses);
    Ok(Posed::new(ocp, guess))
}
