//! Times closed-loop descents of the capsule with moving masses across its axis, and writes the model for a peer.

use std::io::{Write, stdout};

use apsides_benches::CpuTime;
use apsides_benches::landing::Failure;
use apsides_control::actuator::{Actuator, ActuatorSettings};
use apsides_control::pid::{Pid, PidGains, PidSettings};
use apsides_control::record::Recording;
use apsides_control::simulation::{Breach, Ending, Simulation, SimulationSettings};
use apsides_dynamics::aerodynamics::{AxisymmetricAerodynamics, Damping, Interpolation};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia, RigidBody, Start};
use apsides_dynamics::{Atmosphere, DynamicsError, MovingMassVehicle};
use apsides_ode::Direction;
use clap::Parser;
use serde::Serialize;

/// Flies the same descent again and again: over a plane, two masses of 10 kg across the axis, PID, steps and samples of 10 ms. One JSON object.
#[derive(Debug, Parser)]
#[command(name = "moving_mass")]
struct Arguments {
    /// Timed flights.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    repeat: u32,
    /// Print the model and the start instead, for a peer.
    #[arg(long)]
    model: bool,
}

const STEP: f64 = 0.01;
/// Vehicle and each moving mass, kg.
const MASSES: [f64; 2] = [500.0, 10.0];
const TRAVEL: f64 = 0.7;
/// Off the axis, m.
const OFFSET: f64 = 0.01;
const GAINS: [f64; 3] = [10.0, 5.0, 5.0];
/// Height of the end, m.
const LOWEST: f64 = 3e3;
/// Heights of the window, m.
const WINDOW: [f64; 2] = [3e3, 20e3];
const LATITUDE_DEG: f64 = 35.0;
const INERTIA: [f64; 3] = [100.71072, 85.20192, 85.20192];
/// Heights of the atmosphere that a peer interpolates, m: the standard's law of layers ends below.
const HIGH: [f64; 3] = [86e3, 101e3, 50.0];

/// The data that a peer needs.
#[derive(Serialize)]
struct Model {
    step: f64,
    masses: [f64; 2],
    travel: f64,
    offset: f64,
    gains: [f64; 3],
    lowest: f64,
    window: [f64; 2],
    inertia: [f64; 3],
    diameter: f64,
    damping: [f64; 2],
    /// Gravity at the height 0 and its terms, m/s2, m/s3, m/s4.
    gravity: [f64; 3],
    start: [f64; 13],
    mach: Vec<f64>,
    attack: Vec<f64>,
    /// Row by row of the Mach number: axial force, normal force, moment about the origin.
    coefficients: [Vec<f64>; 3],
    high: [f64; 3],
    /// Natural logarithm of the density in kg/m3, and speed of sound in m/s.
    high_density: Vec<f64>,
    high_sound: Vec<f64>,
}

/// The numbers of all flights.
#[derive(Serialize)]
struct Report {
    flight_s: f64,
    steps: usize,
    state: [f64; 13],
    rms_deg: [f64; 2],
    peak_deg: [f64; 2],
    /// CPU time per flight, ms.
    milliseconds: Vec<f64>,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let vehicle = vehicle()?;
    let angle = 2_f64.to_radians();
    let start = vehicle.body().ground.state(&Start {
        altitude: 100e3,
        speed: 700.0,
        path: -85_f64.to_radians(),
        attack: angle,
        sideslip: angle,
        ..Start::default()
    })?;
    if arguments.model {
        writeln!(stdout(), "{}", serde_json::to_string(&model(&vehicle, start)?)?)?;
        return Ok(());
    }
    let mut report = fly(&vehicle, &start)?;
    for _ in 1..arguments.repeat {
        report.milliseconds.append(&mut fly(&vehicle, &start)?.milliseconds);
    }
    writeln!(stdout(), "{}", serde_json::to_string(&report)?)?;
    Ok(())
}

fn vehicle() -> Result<MovingMassVehicle, DynamicsError> {
    let aerodynamics = AxisymmetricAerodynamics::capsule(Interpolation::Linear, Damping::constant())?;
    let ground = Ground::Flat(FlatEarth::wgs84(LATITUDE_DEG.to_radians())?);
    let centre = [0.0, OFFSET, OFFSET];
    let inertia = Inertia::principal(INERTIA)?;
    let body = RigidBody::new(ground, Atmosphere::UsStandard1976, aerodynamics, MASSES[0], inertia, centre)?;
    MovingMassVehicle::new(body, Layout::Cross { travel: TRAVEL }, [MASSES[1]; 2], 0.0)
}

fn fly(vehicle: &MovingMassVehicle, start: &[f64; 13]) -> Result<Report, Failure> {
    let body = vehicle.body();
    let settings =
        SimulationSettings { control_step: STEP, time_limit: 600.0, check_interval: 0, ..Default::default() };
    let simulation = Simulation::new(vehicle, settings)?
        .projection(|x| {
            let length = x[6..10].iter().map(|q| q * q).sum::<f64>().sqrt();
            x[6..10].iter_mut().for_each(|q| *q /= length);
        })
        .stop("lowest", Direction::Falling, |_, x| -x[2] - LOWEST)
        .monitor(Breach::Tumbling, |_, x, _| body.air(x).1[0]);
    let [p, i, d] = GAINS;
    let pid = Pid::new(PidSettings {
        limits: [-TRAVEL, TRAVEL],
        ..PidSettings::new(PidGains::new(p, i, d), STEP)
    })?;
    let travel = ActuatorSettings { travel: [-TRAVEL, TRAVEL], ..ActuatorSettings::default() };
    let clock = CpuTime::start();
    let mut pids = [pid; 2];
    let mut actuators = [Actuator::new(travel, STEP)?, Actuator::new(travel, STEP)?];
    let (mut squares, mut peak, mut count) = ([0.0; 2], [0.0_f64; 2], 0_usize);
    let mut law = |_t: f64, x: &[f64; 13]| {
        let (altitude, [u, v, w]) = body.air(x);
        let angles = [w.atan2(u), v.atan2(u.hypot(w))];
        if (WINDOW[0]..=WINDOW[1]).contains(&altitude) {
            for k in 0..2 {
                squares[k] += angles[k] * angles[k];
                peak[k] = peak[k].max(angles[k].abs());
            }
            count += 1;
        }
        // The mass along z acts on the angle of attack, that along y on the sideslip.
        [pids[1].update(-angles[1]), pids[0].update(-angles[0])]
    };
    let flight = simulation.fly(start, &mut law, &mut actuators, None, &mut Recording::every(0))?;
    let milliseconds = vec![clock.milliseconds()];
    if flight.ending != Ending::Stop("lowest") {
        return Err(format!("the descent ended by {:?} after {} s", flight.ending, flight.time).into());
    }
    Ok(Report {
        flight_s: flight.time,
        steps: flight.steps,
        state: flight.state,
        rms_deg: squares.map(|s| (s / count as f64).sqrt().to_degrees()),
        peak_deg: peak.map(f64::to_degrees),
        milliseconds,
    })
}

fn model(vehicle: &MovingMassVehicle, start: [f64; 13]) -> Result<Model, Failure> {
    let body = vehicle.body();
    let aerodynamics = body.aerodynamics();
    let (mach, attack) = (aerodynamics.table().mach_knots(), aerodynamics.table().attack_knots());
    let mut coefficients = [Vec::new(), Vec::new(), Vec::new()];
    for m in mach {
        for a in attack {
            let at = aerodynamics.coefficients(*m, a * a);
            let values = [at.axial, at.normal_by_angle * a, at.moment_by_angle * a];
            (0..3).for_each(|k| coefficients[k].push(values[k]));
        }
    }
    let Ground::Flat(flat) = body.ground else { return Err("the ground is not flat".into()) };
    let g = |height: f64| flat.gravity(height);
    // Of second degree in the height.
    let far = 1e5;
    let square = (g(far) - 2.0 * g(0.0) + g(-far)) / (2.0 * far * far);
    let gravity = [g(0.0), (g(far) - g(-far)) / (2.0 * far), square];
    let [from, to, by] = HIGH;
    let heights = (0..=((to - from) / by).round() as usize).map(|k| from + by * k as f64);
    let air = &body.atmosphere;
    Ok(Model {
        step: STEP,
        masses: MASSES,
        travel: TRAVEL,
        offset: OFFSET,
        gains: GAINS,
        lowest: LOWEST,
        window: WINDOW,
        inertia: INERTIA,
        diameter: aerodynamics.diameter(),
        damping: [-0.25, -0.02],
        gravity,
        start,
        mach: mach.to_vec(),
        attack: attack.to_vec(),
        coefficients,
        high: HIGH,
        high_density: heights.clone().map(|h| air.density(h).ln()).collect(),
        high_sound: heights.map(|h| air.speed_of_sound(h)).collect(),
    })
}
