//! Runs with closed forms, and runs that go wrong.

use apsides_ad::Scalar;

use super::*;
use crate::actuator::{Actuator, ActuatorSettings, RimPair};
use crate::controller::Ideal;
use crate::pid::{Pid, PidGains, PidSettings};
use crate::sensor::SensorSettings;

/// Sums of some thousand terms.
const ROUNDING: f64 = 1e-11;

/// Discretisation: a sampled controller against a continuous one, of first order in the sample time.
const SAMPLING: f64 = 1e-3;

/// Discretisation: terms of second order in the sample time.
const SECOND_ORDER: f64 = 0.01;

/// x'' = u.
struct Mass;

impl Dynamics<2, 1> for Mass {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// x' = k x with the control as k.
struct Growth;

impl Dynamics<1, 1> for Growth {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] * u[0]]
    }
}

/// Two masses on a rim that move nothing.
struct Nothing;

impl Dynamics<1, 2> for Nothing {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], _u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [S::from(0.0)]
    }
}

fn settings<const NX: usize>(control_step: f64, time_limit: f64) -> SimulationSettings<NX> {
    SimulationSettings { control_step, time_limit, ..SimulationSettings::default() }
}

fn constant<const NX: usize, const NU: usize>(u: [f64; NU]) -> impl FnMut(f64, &[f64; NX]) -> [f64; NU] {
    move |_t: f64, _x: &[f64; NX]| u
}

/// Largest deviation of a PID loop from its closed form of continuous control.
fn pid_deviation(step: f64) -> f64 {
    // Poles -1, -1, -1: kp = kd = 3, ki = 1; from x = 1 at rest x = (1 + t - t^2) exp(-t).
    let mut law = Pid::new(PidSettings::new(PidGains::new(3.0, 1.0, 3.0), step)).unwrap();
    let mut feedback = |_t: f64, x: &[f64; 2]| [law.update_with_rate(-x[0], -x[1])];
    let mut record = Recording::every(1);
    let simulation = Simulation::new(&Mass, settings(step, 12.0)).unwrap();
    simulation.fly(&[1.0, 0.0], &mut feedback, &mut Ideal, None, &mut record).unwrap();
    let deviation = record.samples().iter().map(|s| {
        let t = s.time;
        (s.state[0] - (1.0 + t - t * t) * (-t).exp()).abs()
    });
    deviation.fold(0.0, f64::max)
}

#[test]
fn pid_on_a_double_integrator() {
    // Sampling is of first order in the step.
    let (coarse, fine) = (pid_deviation(2e-3), pid_deviation(1e-3));
    assert!(fine < SAMPLING, "{fine}");
    assert!((coarse / fine - 2.0).abs() < SECOND_ORDER, "{coarse} {fine}");
}

#[test]
fn pid_with_differences_removes_a_constant_disturbance() {
    let mut law = Pid::new(PidSettings {
        filter_time: 0.02,
        limits: [-5.0, 5.0],
        ..PidSettings::new(PidGains::new(3.0, 1.0, 3.0), 0.01)
    })
    .unwrap();
    let mut feedback = |_t: f64, x: &[f64; 2]| [law.update(-x[0]) + 0.7];
    let simulation = Simulation::new(&Mass, settings(0.01, 60.0)).unwrap();
    let flight =
        simulation.fly(&[1.0, 0.0], &mut feedback, &mut Ideal, None, &mut Recording::every(0)).unwrap();
    assert_eq!((flight.ending, flight.steps, flight.time), (Ending::TimeLimit, 6000, 60.0));
    assert!(flight.state[0].abs() < 100.0 * ROUNDING);
    assert!((law.integral() + 0.7).abs() < 100.0 * ROUNDING);
}

#[test]
fn steps_are_of_order_four() {
    // x' = -x: error of the end over the order of the method.
    let error = |substeps| {
        let s = SimulationSettings {
            integration: Integration::Fixed { substeps },
            check_tolerance: 1e-3,
            ..settings(0.5, 2.0)
        };
        let simulation = Simulation::new(&Growth, s).unwrap();
        let flight = simulation
            .fly(&[1.0], &mut constant([-1.0]), &mut Ideal, None, &mut Recording::every(0))
            .unwrap();
        (flight.state[0] - (-2.0_f64).exp(), flight.step_error)
    };
    let ((coarse, _), (fine, _), (_, estimate)) = (error(16), error(32), error(2));
    assert!((coarse / fine - 16.0).abs() < 0.3, "{coarse} {fine}");
    // The estimate is of the first control step: error of exp(-1/2) by two steps, against the scale 1 + exp(-1/2).
    let step = 0.25_f64;
    let polynomial = 1.0 - step + step.powi(2) / 2.0 - step.powi(3) / 6.0 + step.powi(4) / 24.0;
    let exact = (-0.5_f64).exp();
    let true_error = (polynomial * polynomial - exact).abs() / (1.0 + exact);
    assert!((estimate / true_error - 1.0).abs() < 0.1, "{estimate} {true_error}");
}

#[test]
fn adaptive_integration_between_the_samples() {
    let s = SimulationSettings {
        integration: Integration::Adaptive(OdeSettings::with_tolerance(1e-12)),
        ..settings(0.5, 2.0)
    };
    let simulation = Simulation::new(&Growth, s).unwrap().stop("half", Direction::Falling, |_, x| x[0] - 0.5);
    let flight =
        simulation.fly(&[1.0], &mut constant([-1.0]), &mut Ideal, None, &mut Recording::every(1)).unwrap();
    assert_eq!(flight.ending, Ending::Stop("half"));
    assert!((flight.time - 2.0_f64.ln()).abs() < ROUNDING);
    assert!((flight.state[0] - 0.5).abs() < ROUNDING);
}

#[test]
fn a_stone_stops_at_the_ground() {
    // From 100 m with 10 m/s up under 9.81 m/s^2: (10 + sqrt(100 + 2*9.81*100)) / 9.81 s.
    let simulation = Simulation::new(&Mass, settings(0.01, 60.0))
        .unwrap()
        .stop("top", Direction::Rising, |_, x| x[1])
        .stop("ground", Direction::Falling, |_, x| x[0]);
    let mut record = Recording::every(10);
    let flight =
        simulation.fly(&[100.0, 10.0], &mut constant([-9.81]), &mut Ideal, None, &mut record).unwrap();
    let expected = (10.0 + (100.0_f64 + 2.0 * 9.81 * 100.0).sqrt()) / 9.81;
    assert_eq!(flight.ending, Ending::Stop("ground"));
    assert!((flight.time - expected).abs() < ROUNDING);
    assert!(flight.state[0].abs() < 10.0 * ROUNDING);
    let times: Vec<f64> = record.samples().iter().map(|s| s.time).collect();
    assert_eq!(times.len(), flight.steps.div_ceil(10) + 1);
    assert!((times[1] - 0.1).abs() < ROUNDING && times[times.len() - 1] == flight.time);
}

#[test]
fn the_earlier_of_two_stops_in_one_step() {
    let simulation = Simulation::new(&Mass, settings(1.0, 10.0))
        .unwrap()
        .stop("late", Direction::Any, |_, x| x[0] - 0.5)
        .stop("early", Direction::Any, |_, x| x[0] - 0.25);
    let flight = simulation
        .fly(&[0.0, 1.0], &mut constant([0.0]), &mut Ideal, None, &mut Recording::every(0))
        .unwrap();
    assert_eq!(flight.ending, Ending::Stop("early"));
    assert!((flight.time - 0.25).abs() < ROUNDING);
}

#[test]
fn the_last_step_is_cut_at_the_time_limit() {
    let simulation = Simulation::new(&Mass, settings(0.3, 1.0)).unwrap();
    let mut record = Recording::every(1);
    let flight = simulation.fly(&[0.0, 1.0], &mut constant([0.0]), &mut Ideal, None, &mut record).unwrap();
    assert_eq!((flight.steps, flight.time, record.samples().len()), (4, 1.0, 5));
    assert!((flight.state[0] - 1.0).abs() < ROUNDING);
}

#[test]
fn the_state_is_projected_after_each_step() {
    // This projection is no part of the motion: half steps differ from whole ones.
    let unchecked = SimulationSettings { check_interval: 0, ..settings(0.1, 1.0) };
    let simulation = Simulation::new(&Mass, unchecked).unwrap().projection(|x| x[1] = x[1].min(0.5));
    let flight = simulation
        .fly(&[0.0, 0.5], &mut constant([1.0]), &mut Ideal, None, &mut Recording::every(0))
        .unwrap();
    assert!((flight.state[0] - (0.5 + 10.0 * 0.005)).abs() < ROUNDING && flight.state[1] == 0.5);
}

#[test]
fn what_goes_wrong_is_named_with_its_time() {
    let end = |simulation: Simulation<'_, Growth, 1, 1>, law: &mut dyn Controller<1, 1>| {
        let mut record = Recording::every(1);
        let flight = simulation.fly(&[1.0], law, &mut Ideal, None, &mut record).unwrap();
        let finite = |s: &Sample<1, 1>| s.state[0].is_finite() && s.command[0].is_finite();
        assert!(record.samples().iter().all(finite));
        assert!(flight.state[0].is_finite());
        (flight.ending, flight.time)
    };
    let simple = |step| Simulation::new(&Growth, settings(step, 50.0)).unwrap();
    // Growth by e^10 a step overflows after some 70 s; the step is far too long.
    let unchecked = SimulationSettings { check_interval: 0, ..settings(1.0, 100.0) };
    let (ending, time) = end(Simulation::new(&Growth, unchecked).unwrap(), &mut constant([1e5]));
    assert_eq!(ending, Ending::State { index: 0 });
    assert!(time > 0.0);
    let (ending, time) = end(simple(1.0), &mut constant([-5.0]));
    assert!(matches!(ending, Ending::StepTooLong { error } if error > 1e-2), "{ending:?}");
    assert_eq!(time, 0.0);
    let mut broken = |t: f64, _x: &[f64; 1]| [if t > 0.95 { f64::NAN } else { 0.1 }];
    let (ending, time) = end(simple(0.1), &mut broken);
    assert_eq!(ending, Ending::Command { index: 0 });
    assert!((time - 1.0).abs() < ROUNDING);
    let tumbling = simple(0.1).monitor(Breach::Tumbling, |_, x, _| 2.0 - x[0]);
    let (ending, time) = end(tumbling, &mut constant([1.0]));
    assert_eq!(ending, Ending::Breach(Breach::Tumbling));
    // exp(t) > 2 from ln 2 = 0.693 s, seen at the next control step.
    assert!((time - 0.7).abs() < ROUNDING);
    let table = simple(0.1).monitor(Breach::TableLeft, |_, x, _| if x[0] > 1.5 { f64::NAN } else { 1.0 });
    assert_eq!(end(table, &mut constant([1.0])).0, Ending::Breach(Breach::TableLeft));
    let named = simple(0.1).monitor(Breach::Limit("control"), |_, _, u| 0.5 - u[0]);
    assert_eq!(end(named, &mut constant([1.0])), (Ending::Breach(Breach::Limit("control")), 0.0));
}

#[test]
fn masses_that_meet_end_a_run_where_wanted() {
    let on_rim = |start| {
        let s = ActuatorSettings { start, rate: 0.5, ..ActuatorSettings::default() };
        Actuator::new(s, 0.1).unwrap()
    };
    let mut pair = RimPair::new([on_rim(1.0), on_rim(0.0)], 0.2).unwrap();
    let mut law = constant::<1, 2>([0.5, 0.5]);
    let mut record = Recording::every(0);
    let simulation = Simulation::new(&Nothing, settings(0.1, 5.0)).unwrap();
    let flight = simulation.fly(&[0.0], &mut law, &mut pair, None, &mut record).unwrap();
    assert_eq!(flight.ending, Ending::TimeLimit);
    assert!(flight.saturated_time > 0.75);
    pair.reset();
    let simulation = simulation.end_when_masses_meet();
    let flight = simulation.fly(&[0.0], &mut law, &mut pair, None, &mut record).unwrap();
    // They close at 1 rad/s from 1 rad: 0.2 rad apart at the end of the eighth step, and below it in the ninth.
    assert_eq!(flight.ending, Ending::Breach(Breach::MassesMet));
    assert!((flight.time - 0.8).abs() < ROUNDING || (flight.time - 0.7).abs() < ROUNDING);
}

#[test]
fn runs_are_deterministic() {
    let run = |seed| {
        let noise = SensorSettings { noise: [0.01, 0.02], delay: 1, seed, ..SensorSettings::default() };
        let mut sensor = Sensor::new(noise).unwrap();
        let slow = ActuatorSettings { rate: 50.0, backlash: 0.01, ..ActuatorSettings::default() };
        let mut actuators = [Actuator::new(slow, 0.01).unwrap()];
        let mut law = Pid::new(PidSettings::new(PidGains::new(3.0, 1.0, 3.0), 0.01)).unwrap();
        let mut feedback = |_t: f64, x: &[f64; 2]| [law.update_with_rate(-x[0], -x[1])];
        let mut record = Recording::every(3);
        let simulation = Simulation::new(&Mass, settings(0.01, 20.0)).unwrap();
        let flight = simulation
            .fly(&[1.0, 0.0], &mut feedback, &mut actuators, Some(&mut sensor), &mut record)
            .unwrap();
        assert!(flight.state[0].abs() < 0.2 && flight.saturated_time > 0.0);
        record
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn refusals() {
    let refused = |change: &dyn Fn(&mut SimulationSettings<1>)| {
        let mut s = settings(0.1, 1.0);
        change(&mut s);
        assert!(Simulation::new(&Growth, s).is_err());
    };
    refused(&|s| s.control_step = 0.0);
    refused(&|s| s.time_limit = f64::INFINITY);
    refused(&|s| s.time_limit = 1e12);
    refused(&|s| s.start = f64::NAN);
    refused(&|s| s.check_tolerance = 0.0);
    refused(&|s| s.scales = [0.0]);
    refused(&|s| s.integration = Integration::Fixed { substeps: 0 });
    refused(&|s| s.integration = Integration::Adaptive(OdeSettings::with_tolerance(-1.0)));
    let simulation = Simulation::new(&Growth, settings(0.1, 1.0)).unwrap();
    let flown = simulation.fly(&[f64::NAN], &mut constant([1.0]), &mut Ideal, None, &mut Recording::every(1));
    assert!(matches!(flown, Err(ControlError::Parameter { what: "initial state", .. })));
}
