//! Free ends, end costs, static parameters, inequality constraints at the ends.

use super::parts::{self, DoubleIntegrator, Energy, breaks, energy, trajectory};
use super::{assert_exact, assert_failed, certify, certify_stated, find};
use apsides_ad::{Dynamics, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, Sense, State, Term, Trajectory, Variable};

/// Discretisation: costates that are integrated, relative.
const INTEGRATION: f64 = 1e-9;

/// Discretisation: states that are integrated.
const INTEGRATION_OF_STATES: f64 = 1e-10;

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-12;

/// Minimum energy to `x(1) = 1` with the final speed free: `u = 3 (1 - t)`, `lambda = (-3, 3 t - 3)`, `J = 1.5`.
fn free_speed() -> Phase {
    Phase::new("push", DoubleIntegrator)
        .states([
            State::new("position", "m").starts_at(0.0).ends_at(1.0).scaled_by(1.0),
            State::new("speed", "m/s").starts_at(0.0).scaled_by(1.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-10.0, 10.0)])
        .integral(energy(), Energy)
        .final_time(Bounds::fixed(1.0))
}

fn least_energy(name: &str, phase: Phase) -> Ocp {
    Ocp::builder(name).phase(phase).minimize_integral("push", "energy").build().expect("well-posed")
}

fn free_speed_solution() -> Trajectory {
    let x = |_: usize, t: f64| vec![1.5 * t * t - 0.5 * t.powi(3), 3.0 * t - 1.5 * t * t];
    let u = |_: usize, t: f64| vec![3.0 - 3.0 * t];
    let phase = parts::phase("push", &breaks(0.0, 1.0, 3), 4, x, u, |_, t| vec![-3.0, 3.0 * t - 3.0]);
    trajectory(vec![phase], 1.5)
}

fn rest_to_rest() -> Trajectory {
    let x = |_: usize, t: f64| vec![3.0 * t * t - 2.0 * t.powi(3), 6.0 * t - 6.0 * t * t];
    let u = |_: usize, t: f64| vec![6.0 - 12.0 * t];
    let phase = parts::phase("push", &breaks(0.0, 1.0, 3), 4, x, u, |_, t| vec![-12.0, 12.0 * t - 6.0]);
    trajectory(vec![phase], 6.0)
}

#[test]
fn the_costate_of_a_free_final_state_vanishes() {
    let ocp = least_energy("free speed", free_speed());
    assert_exact(&certify(&ocp, &free_speed_solution()));
    // The rest-to-rest arc is feasible here, but its final speed costate 6 is not zero.
    let certificate = certify(&ocp, &rest_to_rest());
    assert_failed(&certificate, &["transversality"]);
    let check = find(&certificate, "transversality");
    assert!(
        (check.value - 6.0 / 12.0).abs() < INTEGRATION && check.at == "final speed, phase `push`",
        "{check:?}"
    );
}

#[test]
fn a_bound_on_the_final_speed_takes_its_side() {
    // At most zero: the arc wants to be faster, so resting is optimal. At least zero: it is not.
    for (bounds, optimal) in [(Bounds::at_most(0.0), true), (Bounds::at_least(0.0), false)] {
        let mut phase = free_speed();
        phase.states[1].terminal = bounds;
        let ocp = least_energy("bounded", phase);
        let failures: &[&str] = if optimal { &[] } else { &["transversality"] };
        assert_failed(&certify(&ocp, &rest_to_rest()), failures);
    }
}

/// `z`.
struct Same;
impl VectorFunction<1, 1> for Same {
    fn evaluate<S: Scalar>(&self, z: &[S; 1]) -> [S; 1] {
        [z[0]]
    }
}

#[test]
fn endpoint_inequalities_and_their_multipliers() {
    let ocp = Ocp::builder("bounded")
        .phase(free_speed())
        .constrain(
            "soft",
            [Variable::new("speed", "m/s").at_most(0.0)],
            [At::FinalState("push", "speed")],
            Same,
        )
        .minimize_integral("push", "energy")
        .build()
        .expect("well-posed");
    let mut t = rest_to_rest();
    // lambda(tf) = nu = 6.
    t.constraint_multipliers = Some(vec![vec![6.0]]);
    assert_exact(&certify_stated(&ocp, &t));
    t.constraint_multipliers = Some(vec![vec![-6.0]]);
    assert_failed(&certify_stated(&ocp, &t), &["transversality", "signs of the endpoint"]);
    // The free arc ends at 1.5 m/s.
    t = free_speed_solution();
    t.constraint_multipliers = Some(vec![vec![0.0]]);
    let certificate = certify_stated(&ocp, &t);
    assert_failed(&certificate, &["constraint soft"]);
    let check = find(&certificate, "constraint soft");
    assert!(
        (check.value - 1.5).abs() < INTEGRATION_OF_STATES && check.limit == 1e-7 && check.unit == "m/s",
        "{check:?}"
    );
}

/// `x' = p`.
struct Rate;
impl Dynamics<1, 0, 1> for Rate {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], _u: &[S; 0], p: &[S; 1]) -> [S; 1] {
        [p[0]]
    }
}

/// `x - p^2 / 2`.
struct Gain;
impl VectorFunction<2, 1> for Gain {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] - z[1] * z[1] * 0.5]
    }
}

fn gain(bounds: Bounds) -> Ocp {
    let phase = Phase::new("run", Rate)
        .states([State::new("x", "m").within(-10.0, 10.0).starts_at(0.0)])
        .final_time(Bounds::fixed(1.0));
    let parameter = Variable { bounds, ..Variable::new("slope", "m/s") };
    let term = Term::function([At::FinalState("run", "x"), At::Parameter("slope")], Gain);
    Ocp::builder("gain")
        .parameter(parameter)
        .phase(phase)
        .objective(Sense::Maximize, "gain", "m", [term])
        .build()
        .expect("well-posed")
}

fn gain_solution(p: f64) -> Trajectory {
    let phase =
        parts::phase("run", &breaks(0.0, 1.0, 2), 3, |_, t| vec![p * t], |_, _| vec![], |_, _| vec![-1.0]);
    Trajectory { parameters: vec![p], ..trajectory(vec![phase], p - 0.5 * p * p) }
}

#[test]
fn a_static_parameter_is_stationary() {
    // Maximised x(1) - p^2/2 = p - p^2/2: p = 1.
    assert_exact(&certify(&gain(Bounds::new(-5.0, 5.0)), &gain_solution(1.0)));
    let certificate = certify(&gain(Bounds::new(-5.0, 5.0)), &gain_solution(1.1));
    assert_failed(&certificate, &["stationarity in the static parameters"]);
    // Slope 0.1 times the scale 10, against the largest costate 1 times the scale of x, 20.
    let check = find(&certificate, "stationarity in the static parameters");
    assert!((check.value - 0.1 * 10.0 / 20.0).abs() < INTEGRATION, "{check:?}");
    // Held back by its bound it is optimal; beyond it is rejected.
    assert_exact(&certify(&gain(Bounds::new(-5.0, 0.5)), &gain_solution(0.5)));
    let certificate = certify(&gain(Bounds::new(-5.0, 0.5)), &gain_solution(1.0));
    assert_failed(&certificate, &["bounds on the static parameters"]);
    assert!((find(&certificate, "bounds on the static parameters").value - 0.5).abs() < ROUNDING);
}

/// The least energy from rest to rest over 1 m is `6/T^3`, less in more time: at the longest duration that is the optimum, at the shortest
/// it is not, be both times free or one.
#[test]
fn a_bound_on_the_duration_takes_its_side() {
    for initial in [Bounds::fixed(0.0), Bounds::new(-5.0, 5.0)] {
        for (duration, optimal) in [(Bounds::new(0.5, 1.0), true), (Bounds::new(1.0, 2.0), false)] {
            let mut phase = free_speed().final_time(Bounds::new(-9.0, 9.0));
            phase.states[1].terminal = Bounds::fixed(0.0);
            (phase.initial_time, phase.duration) = (initial, duration);
            let ocp = least_energy("in time", phase);
            let failures: &[&str] = if optimal { &[] } else { &["transversality"] };
            assert_failed(&certify(&ocp, &rest_to_rest()), failures);
        }
    }
}

/// The least energy, 1.5, with a bound at this value and a multiplier that takes a share of the cost: it may add to the cost, as it does
/// at the upper bound, and not take from it.
#[test]
fn a_bound_on_an_integral_takes_its_side() {
    for (multiplier, optimal) in [(1.0, true), (-0.5, false)] {
        let mut phase = free_speed();
        phase.integrals[0].variable.bounds = Bounds::at_most(1.5);
        let ocp = least_energy("budget", phase);
        let mut found = free_speed_solution();
        let x = |_: usize, t: f64| vec![1.5 * t * t - 0.5 * t.powi(3), 3.0 * t - 1.5 * t * t];
        let u = |_: usize, t: f64| vec![3.0 - 3.0 * t];
        let costate =
            |_: usize, t: f64| vec![-3.0 * (1.0 + multiplier), (3.0 * t - 3.0) * (1.0 + multiplier)];
        found.phases[0] = parts::phase("push", &breaks(0.0, 1.0, 3), 4, x, u, costate);
        found.phases[0].integral_multipliers = Some(vec![multiplier]);
        let failures: &[&str] = if optimal { &[] } else { &["signs of the multipliers of integrals"] };
        assert_failed(&certify_stated(&ocp, &found), failures);
    }
}
