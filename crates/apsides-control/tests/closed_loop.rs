//! Whole loops: a landing under guidance, an attitude loop of quaternion and rates, margins against the runs they speak of, and no
//! allocation while a run goes on.

use apsides_ad::{Dynamics, Scalar, vector};
use apsides_control::actuator::{Actuator, ActuatorSettings};
use apsides_control::controller::{Controller, Ideal};
use apsides_control::linear::{Plant, linearise};
use apsides_control::lqr::lqr_discrete;
use apsides_control::margins::LoopAnalysis;
use apsides_control::pid::{Pid, PidGains, PidSettings};
use apsides_control::record::Recording;
use apsides_control::sensor::{Sensor, SensorSettings};
use apsides_control::simulation::{Breach, Ending, Flight, Simulation, SimulationSettings};
use apsides_control::state_space::StateSpace;
use apsides_ode::Direction;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-10;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// Gravity of the Moon at its surface, m/s^2.
const GRAVITY: f64 = 1.62;
/// Exhaust speed, m/s.
const EXHAUST: f64 = 3000.0;

/// Discretisation: how far from the site the samples of the law end, m.
const LANDED_M: f64 = 0.05;

/// Discretisation: the same for the speed, m/s.
const LANDED_M_S: f64 = 0.2;

/// Discretisation: samples of 0.05 s, and the last half second, where the law holds its gain; relative.
const SAMPLING: f64 = 2e-4;

/// Position and velocity (z up), mass; thrust as control.
struct Lander;

impl Dynamics<7, 3> for Lander {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 7] {
        let thrust = vector::norm(u, 1e-3);
        [x[3], x[4], x[5], u[0] / x[6], u[1] / x[6], u[2] / x[6] - GRAVITY, -thrust / EXHAUST]
    }
}

/// Acceleration `6 (target - r) / T^2 - 4 v / T - g`: linear in time, to rest at the target after the time-to-go `T` (the E guidance
/// of G. W. Cherry, AIAA 64-638, 1964).
struct Landing {
    end: f64,
}

impl Controller<7, 3> for Landing {
    fn command(&mut self, t: f64, y: &[f64; 7]) -> [f64; 3] {
        let go = (self.end - t).max(0.5);
        std::array::from_fn(|k| {
            let gravity = if k == 2 { GRAVITY } else { 0.0 };
            y[6] * (-6.0 * y[k] / (go * go) - 4.0 * y[3 + k] / go + gravity)
        })
    }
}

fn land(step: f64) -> Flight<7> {
    let settings = SimulationSettings { control_step: step, time_limit: 60.0, ..Default::default() };
    let simulation = Simulation::new(&Lander, settings)
        .expect("settings in range")
        .stop("contact", Direction::Falling, |_, x| x[2])
        .monitor(Breach::Limit("propellant"), |_, x, _| x[6] - 500.0);
    let start = [400.0, -100.0, 800.0, -15.0, 4.0, -30.0, 1000.0];
    let mut record = Recording::every(1);
    simulation.fly(&start, &mut Landing { end: 40.0 }, &mut Ideal, None, &mut record).expect("finite start")
}

#[test]
fn landing_of_a_point_mass() {
    let flight = land(0.05);
    // The law aims at the ground after 40 s; contact is there or just before.
    assert!(
        flight.ending == Ending::Stop("contact") || flight.ending == Ending::TimeLimit,
        "{:?}",
        flight.ending
    );
    assert!((flight.time - 40.0).abs() < 1.0, "{}", flight.time);
    for k in 0..2 {
        assert!(
            flight.state[k].abs() < LANDED_M && flight.state[3 + k].abs() < LANDED_M_S,
            "{:?}",
            flight.state
        );
    }
    assert!(flight.state[5].abs() < LANDED_M_S, "{:?}", flight.state);
    // The command is a = c0 + c1 t along each axis until the end; its integral over the mass gives what was burnt.
    let (r0, v0) = ([400.0, -100.0, 800.0], [-15.0, 4.0, -30.0]);
    let go: f64 = 40.0;
    let n = 40_000;
    let mut integral = 0.0;
    for i in 0..n {
        let t = go * (f64::from(i) + 0.5) / f64::from(n);
        let mut squares = 0.0;
        for k in 0..3 {
            let start = -6.0 * r0[k] / (go * go) - 4.0 * v0[k] / go;
            // The double integral brings position and velocity to zero: a(t) falls to a(T) = 6 r / T^2 + 2 v / T.
            let end = 6.0 * r0[k] / (go * go) + 2.0 * v0[k] / go;
            let a = start + (end - start) * t / go + if k == 2 { GRAVITY } else { 0.0 };
            squares += a * a;
        }
        integral += squares.sqrt() * go / f64::from(n);
    }
    let mass = 1000.0 * (-integral / EXHAUST).exp();
    assert!((flight.state[6] / mass - 1.0).abs() < SAMPLING, "{} {mass}", flight.state[6]);
}

/// Quaternion, body rates and six more states of free motion: thirteen, as of a vehicle; torque as control.
struct Body;

const INERTIA: [f64; 3] = [100.0, 85.0, 80.0];

impl Dynamics<13, 3> for Body {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 13], u: &[S; 3], _p: &[S; 0]) -> [S; 13] {
        let [q0, q1, q2, q3] = [x[0], x[1], x[2], x[3]];
        let [a, b, c] = [x[4], x[5], x[6]];
        let [ia, ib, ic] = INERTIA;
        [
            (q1 * a + q2 * b + q3 * c) * -0.5,
            (q0 * a + q2 * c - q3 * b) * 0.5,
            (q0 * b - q1 * c + q3 * a) * 0.5,
            (q0 * c + q1 * b - q2 * a) * 0.5,
            (u[0] + b * c * (ib - ic)) / ia,
            (u[1] + c * a * (ic - ia)) / ib,
            (u[2] + a * b * (ia - ib)) / ic,
            x[10],
            x[11],
            x[12],
            S::from(0.0),
            S::from(0.0),
            S::from(-GRAVITY),
        ]
    }
}

fn normalise(x: &mut [f64; 13]) {
    let length = x[..4].iter().map(|q| q * q).sum::<f64>().sqrt();
    x[..4].iter_mut().for_each(|q| *q /= length);
}

/// Torque-free spin with all rates.
const SPIN: [f64; 13] = [1.0, 0.0, 0.0, 0.0, 0.3, -0.2, 0.5, 0.0, 0.0, 1e5, 10.0, 0.0, 0.0];

#[test]
fn torque_free_spin_keeps_momentum_energy_and_norm() {
    let settings = SimulationSettings { time_limit: 60.0, ..Default::default() };
    let simulation = Simulation::new(&Body, settings).unwrap().projection(normalise);
    let mut free = |_t: f64, _x: &[f64; 13]| [0.0; 3];
    let flight = simulation.fly(&SPIN, &mut free, &mut Ideal, None, &mut Recording::every(0)).unwrap();
    let momentum = |x: &[f64; 13]| (0..3).map(|k| (INERTIA[k] * x[4 + k]).powi(2)).sum::<f64>().sqrt();
    let energy = |x: &[f64; 13]| (0..3).map(|k| 0.5 * INERTIA[k] * x[4 + k].powi(2)).sum::<f64>();
    // Order four at 10 ms over 60 s.
    assert!((momentum(&flight.state) / momentum(&SPIN) - 1.0).abs() < INTEGRATION);
    assert!((energy(&flight.state) / energy(&SPIN) - 1.0).abs() < INTEGRATION);
    assert!((flight.state[..4].iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < ROUNDING);
    assert!(flight.step_error < INTEGRATION, "{}", flight.step_error);
}

#[test]
fn regulator_of_a_reduced_plant_brings_the_body_to_rest() {
    // Vector part of the quaternion and rates; regulator of the sampled linear plant on the nonlinear body.
    let upright = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let plant = linearise(&Body, 0.0, &upright, &[0.0; 3]).reduced([1, 2, 3, 4, 5, 6]).unwrap();
    let sampled = plant.sampled(0.05).unwrap();
    let mut q = [[0.0; 6]; 6];
    (0..6).for_each(|k| q[k][k] = 1e4);
    let mut r = [[0.0; 3]; 3];
    (0..3).for_each(|k| r[k][k] = 1.0);
    let regulator = lqr_discrete(&sampled, &q, &r).unwrap();
    let mut law = |_t: f64, x: &[f64; 13]| {
        let reduced = [x[1], x[2], x[3], x[4], x[5], x[6]];
        regulator.control(&reduced, &[0.0; 6])
    };
    let settings = SimulationSettings { control_step: 0.05, time_limit: 60.0, ..Default::default() };
    let simulation = Simulation::new(&Body, settings).unwrap().projection(normalise);
    let flight = simulation.fly(&SPIN, &mut law, &mut Ideal, None, &mut Recording::every(0)).unwrap();
    assert!(flight.state[1..7].iter().all(|v| v.abs() < 100.0 * INTEGRATION), "{:?}", flight.state);
}

/// `x'' = u`.
struct Axis;

impl Dynamics<2, 1> for Axis {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

#[test]
fn margins_say_when_a_run_diverges() {
    // PID with differences on a double integrator, sampled at 0.1 s with one sample of delay: the loop diverges just beyond its gain margin
    // and its gain reduction, and beyond its delay margin.
    let settings = PidSettings { filter_time: 0.05, ..PidSettings::new(PidGains::new(1.0, 0.2, 2.0), 0.1) };
    let plant: Plant<2, 1> = linearise(&Axis, 0.0, &[0.0; 2], &[0.0]);
    let plant = StateSpace::of_plant(&plant, &[[1.0, 0.0]]).unwrap().sampled(0.1, 0.1).unwrap();
    let open = plant.series(&StateSpace::of_pid(&settings).unwrap()).unwrap();
    let margins = LoopAnalysis::new(&open, 0.0, [1e-2, 1e2], 400).unwrap().margins().unwrap();
    assert!(margins.stable);
    // Magnitude of the swing late in the run over that early.
    let growth = |gain: f64| {
        let delay = ActuatorSettings { delay: 0.1, ..ActuatorSettings::default() };
        let mut actuators = [Actuator::new(delay, 0.1).unwrap()];
        let mut pid = Pid::new(settings).unwrap();
        let mut law = |_t: f64, x: &[f64; 2]| [gain * pid.update(-x[0])];
        let run = SimulationSettings { control_step: 0.1, time_limit: 600.0, ..Default::default() };
        let mut record = Recording::every(1);
        Simulation::new(&Axis, run)
            .unwrap()
            .fly(&[1e-3, 0.0], &mut law, &mut actuators, None, &mut record)
            .unwrap();
        let rms = |range| record.statistics(|s| s.state[0], |s| s.time, range).unwrap().rms;
        rms([500.0, 600.0]) / rms([100.0, 200.0])
    };
    let (most, least) = (margins.gain.unwrap().margin, margins.gain_reduction.unwrap().margin);
    assert!(growth(0.98 * most) < 1.0 && growth(1.02 * most) > 1.0, "{most}");
    assert!(growth(1.05 * least) < 1.0 && growth(0.95 * least) > 1.0, "{least}");
    // The same on the poles, with the delay beyond its margin.
    let delay = margins.delay.unwrap().margin;
    let late = |extra: f64| {
        let plant: Plant<2, 1> = linearise(&Axis, 0.0, &[0.0; 2], &[0.0]);
        let plant = StateSpace::of_plant(&plant, &[[1.0, 0.0]]).unwrap().sampled(0.1, 0.1 + extra).unwrap();
        let open = plant.series(&StateSpace::of_pid(&settings).unwrap()).unwrap();
        open.closed(1.0).unwrap().is_stable().unwrap()
    };
    assert!(late(0.98 * delay) && !late(1.02 * delay), "{delay}");
}

#[test]
fn a_run_allocates_nothing_in_its_loop() {
    let noise = SensorSettings { noise: [1e-3; 13], delay: 2, ..Default::default() };
    let mut sensor = Sensor::new(noise).unwrap();
    let limits = ActuatorSettings { rate: 10.0, acceleration: 50.0, delay: 0.02, ..Default::default() };
    let mut actuators: [Actuator; 3] = std::array::from_fn(|_| Actuator::new(limits, 0.01).unwrap());
    let mut law = |_t: f64, x: &[f64; 13]| std::array::from_fn(|k| -100.0 * x[4 + k]);
    let mut record = Recording::every(1);
    let mut allocations = |time_limit| {
        let settings = SimulationSettings { time_limit, ..Default::default() };
        let simulation = Simulation::new(&Body, settings)
            .unwrap()
            .projection(normalise)
            .stop("ground", Direction::Falling, |_, x| x[9])
            .monitor(Breach::Tumbling, |_, x, _| 10.0 - x[5]);
        allocation_counter::measure(|| {
            simulation.fly(&SPIN, &mut law, &mut actuators, Some(&mut sensor), &mut record).unwrap();
        })
        .count_total
    };
    // Room for the record and values of the stops, whatever the length of the run.
    let (short, long) = (allocations(1.0), allocations(100.0));
    assert!(short <= 2 && long <= 2, "{short} {long}");
}
