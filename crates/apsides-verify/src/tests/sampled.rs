//! Trajectories from samples.

use super::certify;
use super::parts::{DoubleIntegrator, Energy, energy};
use crate::{Interpolation, PhaseSamples, Verdict, VerifySettings, sampled};
use apsides_ad::{Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, State, Variable};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Discretisation: the objective of samples of a straight line.
const INTEGRATION: f64 = 1e-10;

/// Discretisation: samples of another flight between cubic polynomials.
const CUBIC: f64 = 1e-6;

fn settings() -> VerifySettings {
    VerifySettings::default()
}

/// Rest to rest with the least energy: `u = 6 - 12 t`, `J = 6`.
fn energy_problem() -> Ocp {
    let phase = Phase::new("push", DoubleIntegrator)
        .states([
            State::new("position", "m").starts_at(0.0).ends_at(1.0).scaled_by(1.0),
            State::new("speed", "m/s").starts_at(0.0).ends_at(0.0).scaled_by(1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-10.0, 10.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0));
    Ocp::builder("energy").phase(phase).minimize_integral("push", "energy").build().expect("well-posed")
}

fn samples(count: usize, u: impl Fn(f64) -> f64) -> PhaseSamples {
    let times: Vec<f64> = (0..count).map(|k| k as f64 / (count - 1) as f64).collect();
    let state = |t: &f64| vec![3.0 * t * t - 2.0 * t.powi(3), 6.0 * t - 6.0 * t * t];
    PhaseSamples {
        states: times.iter().map(state).collect(),
        controls: times.iter().map(|t| vec![u(*t)]).collect(),
        times,
        nodes: None,
    }
}

/// A control that jumps from a parabola to a line, at nodes that are not at the jump: their intervals say where it is.
#[test]
fn nodes_of_intervals_are_joined_by_their_polynomials() {
    let ocp = energy_problem();
    let times = vec![0.0, 0.1, 0.35, 0.5, 0.6, 0.9, 1.0];
    let control = |t: f64, interval: usize| if interval == 0 { 30.0 * t * t } else { 2.0 - 4.0 * t };
    let nodes = vec![(0, true), (0, true), (0, true), (1, false), (1, true), (1, true), (1, false)];
    let controls = times.iter().zip(&nodes).map(|(t, (interval, _))| vec![control(*t, *interval)]);
    let samples = PhaseSamples {
        states: vec![vec![0.0; 2]; times.len()],
        controls: controls.collect(),
        times,
        nodes: Some(nodes),
    };
    let one = std::slice::from_ref(&samples);
    let found = sampled(&ocp, one, &[], Some(Interpolation::Polynomial), &settings()).expect("fits");
    let control = |t: f64| found.trajectory.phases[0].control_at(t)[0];
    assert!((control(0.2) - 1.2).abs() < ROUNDING && (control(0.49) - 30.0 * 0.49 * 0.49).abs() < ROUNDING);
    assert!((control(0.51) + 0.04).abs() < ROUNDING && (control(0.95) + 1.8).abs() < ROUNDING);
    let apart = PhaseSamples { nodes: Some(vec![(0, true); 3]), ..samples };
    assert!(sampled(&ocp, &[apart], &[], None, &settings()).is_err());
}

#[test]
fn samples_of_an_optimum_are_certified_without_costates() {
    let ocp = energy_problem();
    let found = sampled(&ocp, &[samples(21, |t| 6.0 - 12.0 * t)], &[], None, &settings()).expect("fits");
    assert!(found.interpolation != Interpolation::Constant && found.deviation < ROUNDING, "{found:?}");
    assert!((found.trajectory.objective - 6.0).abs() < INTEGRATION);
    let certificate = certify(&ocp, &found.trajectory);
    assert_eq!(certificate.verdict, Verdict::GlobalOptimum, "{certificate:#?}");
}

#[test]
fn samples_of_another_flight_are_not() {
    let ocp = energy_problem();
    // Feasible, with a larger energy: a sine added whose first and second integrals vanish at the end.
    let pi = std::f64::consts::PI;
    let wave = |t: f64| (2.0 * pi * t).sin() - 2.0 * (4.0 * pi * t).sin();
    let mut other = samples(201, |t| 6.0 - 12.0 * t + 0.5 * wave(t));
    let shift = |w: f64, t: f64| (t / w - (w * t).sin() / (w * w), (1.0 - (w * t).cos()) / w);
    for (t, x) in other.times.clone().iter().zip(&mut other.states) {
        let ((a, va), (b, vb)) = (shift(2.0 * pi, *t), shift(4.0 * pi, *t));
        x[0] += 0.5 * (a - 2.0 * b);
        x[1] += 0.5 * (va - 2.0 * vb);
    }
    let found = sampled(&ocp, &[other], &[], None, &settings()).expect("fits");
    assert_eq!(found.interpolation, Interpolation::Cubic);
    assert!(found.deviation < CUBIC, "{}", found.deviation);
    let certificate = certify(&ocp, &found.trajectory);
    assert_eq!(certificate.verdict, Verdict::Feasible, "{certificate:#?}");
}

#[test]
fn samples_that_are_not_those_of_the_flight_fail_a_check() {
    let ocp = energy_problem();
    let checks = |off: f64| {
        let mut stated = samples(21, |t| 6.0 - 12.0 * t);
        stated.states[10][0] += off;
        sampled(&ocp, &[stated], &[], None, &settings()).expect("fits").checks
    };
    let [check] = &checks(0.01)[..] else { panic!("one phase") };
    assert!(!check.passed && (check.value - 0.01).abs() < INTEGRATION, "{check:?}");
    assert!(check.at.contains("t = 0.5"), "{}", check.at);
    assert!(checks(0.0).iter().all(|check| check.passed));
}

#[test]
fn two_samples_at_one_time_are_a_jump() {
    let phase = Phase::new("dash", DoubleIntegrator)
        .states([
            State::new("position", "m").within(-1.0, 2.0).starts_at(0.0).ends_at(1.0),
            State::new("speed", "m/s").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.1, 10.0));
    let ocp = Ocp::builder("dash")
        .phase(phase)
        .minimize("time", "s", At::FinalTime("dash"))
        .build()
        .expect("well-posed");
    let dash = PhaseSamples {
        times: vec![0.0, 0.5, 1.0, 1.0, 1.5, 2.0],
        states: [[0.0, 0.0], [0.125, 0.5], [0.5, 1.0], [0.5, 1.0], [0.875, 0.5], [1.0, 0.0]]
            .map(|x| x.to_vec())
            .into(),
        controls: [1.0, 1.0, 1.0, -1.0, -1.0, -1.0].map(|u| vec![u]).into(),
        nodes: None,
    };
    let found = sampled(&ocp, &[dash], &[], None, &settings()).expect("fits");
    let certificate = certify(&ocp, &found.trajectory);
    assert_eq!(certificate.verdict, Verdict::StrictLocalOptimum, "{certificate:#?}");
}

#[test]
fn unfit_samples_are_refused() {
    let ocp = energy_problem();
    let good = || samples(3, |_| 0.0);
    let refused = |samples: PhaseSamples, part: &str| {
        let message = sampled(&ocp, &[samples], &[], None, &settings()).expect_err(part).to_string();
        assert!(message.contains(part), "{message}");
    };
    refused(PhaseSamples { times: vec![0.0, 1.0, 0.5], ..good() }, "decrease after sample 2");
    refused(PhaseSamples { times: vec![1.0, 0.5, 0.0], ..good() }, "decrease after sample 1");
    refused(PhaseSamples { times: vec![0.0, 1.0], ..good() }, "2 times, 3 states");
    refused(PhaseSamples { times: vec![0.0, f64::NAN, 1.0], ..good() }, "finite");
    refused(PhaseSamples { controls: vec![vec![]; 3], ..good() }, "expected 2 states and 1 controls");
    refused(PhaseSamples { times: vec![0.0; 3], ..good() }, "at least two samples");
    assert!(sampled(&ocp, &[], &[], None, &settings()).is_err());
}

struct Share;
impl VectorFunction<2, 1> for Share {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] / z[1]]
    }
}

/// An integral in a condition of ends is a state, which no other program writes.
#[test]
fn samples_need_no_integrals_that_are_states() {
    let phase = Phase::new("climb", DoubleIntegrator)
        .states([State::new("position", "m").starts_at(0.0), State::new("speed", "m/s").starts_at(0.0)])
        .controls([Variable::new("acceleration", "m/s2").within(-10.0, 10.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0));
    let ocp = Ocp::builder("share")
        .phase(phase)
        .constrain(
            "share",
            [Variable::new("share", "m/s3").at_most(7.0)],
            [At::Integral("climb", "energy"), At::FinalState("climb", "position")],
            Share,
        )
        .minimize_integral("climb", "energy")
        .build()
        .expect("well-posed");
    assert_eq!((ocp.phases[0].model_states(), ocp.phases[0].states.len()), (2, 3));
    let found = sampled(&ocp, &[samples(21, |t| 6.0 - 12.0 * t)], &[], None, &settings()).expect("fits");
    let mut x = [0.0; 3];
    found.trajectory.phases[0].state.evaluate(1.0, &mut x);
    // By the energy of the flight, 6.
    assert!(found.deviation < ROUNDING && (x[2] - 6.0).abs() < INTEGRATION, "{x:?}");
}
