//! Two linked phases: the minimum-energy transfer cut at 0.4 s, and a stage that drops mass.

use super::parts::{self, DoubleIntegrator, Energy, breaks, energy};
use super::{assert_exact, assert_failed, certify, certify_stated, find};
use crate::{VerifySettings, verify};
use apsides_ad::{Dynamics, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, PhaseTrajectory, Sense, State, Term, Trajectory, Variable};

const CUT: f64 = 0.4;

/// Round-off of polynomials that the integrator follows exactly.
const ROUNDING: f64 = 1e-12;

/// Discretisation: costates that are integrated, relative.
const INTEGRATION: f64 = 1e-9;

fn problem() -> Ocp {
    let states = || [State::new("position", "m").scaled_by(1.0), State::new("speed", "m/s").scaled_by(1.0)];
    let phase = |name: &str| {
        Phase::new(name, DoubleIntegrator)
            .states(states())
            .controls([Variable::new("acceleration", "m/s2").within(-10.0, 10.0)])
            .integral(energy(), Energy)
    };
    let mut first = phase("first").final_time(Bounds::new(0.1, 0.9));
    let mut second = phase("second").initial_time(Bounds::new(0.1, 0.9)).final_time(Bounds::fixed(1.0));
    for (k, end) in [0.0, 0.0].into_iter().enumerate() {
        first.states[k].initial = Bounds::fixed(end);
    }
    for (k, end) in [1.0, 0.0].into_iter().enumerate() {
        second.states[k].terminal = Bounds::fixed(end);
    }
    let terms = [Term::Integral("first", "energy", 1.0), Term::Integral("second", "energy", 1.0)];
    Ocp::builder("two phases")
        .phase(first)
        .phase(second)
        .link("first", "second")
        .objective(Sense::Minimize, "energy", "m2/s3", terms)
        .build()
        .expect("well-posed")
}

fn part(name: &str, t0: f64, tf: f64, shift: f64) -> PhaseTrajectory {
    let x = move |_: usize, t: f64| vec![3.0 * t * t - 2.0 * t.powi(3) + shift, 6.0 * t - 6.0 * t * t];
    let u = |_: usize, t: f64| vec![6.0 - 12.0 * t];
    parts::phase(name, &breaks(t0, tf, 3), 4, x, u, |_, t| vec![-12.0, 12.0 * t - 6.0])
}

fn solution(shift: f64) -> Trajectory {
    // Lagrangian J + nu (from - to): nu = lambda at the cut, and nu = -H = 18 for the time.
    let multipliers = vec![vec![18.0], vec![-12.0], vec![12.0 * CUT - 6.0]];
    Trajectory {
        phases: vec![part("first", 0.0, CUT, 0.0), part("second", CUT, 1.0, shift)],
        parameters: vec![],
        objective: 6.0,
        constraint_multipliers: Some(multipliers),
    }
}

#[test]
fn both_phases_are_verified() {
    let certificate = certify(&problem(), &solution(0.0));
    assert_exact(&certificate);
    assert_eq!(certificate.checks.iter().filter(|c| c.name == "constraint link first-second").count(), 1);
}

#[test]
fn the_second_phase_starts_where_the_first_ended() {
    // The second phase is consistent with itself but starts 1e-3 m away from the end of the first.
    let t = solution(1e-3);
    let verification = verify(&problem(), &t, &VerifySettings::default()).expect("fits");
    let start = verification.simulation[1].states[0];
    assert!((start - (3.0 * CUT * CUT - 2.0 * CUT.powi(3))).abs() < ROUNDING);
    let certificate = verification.certificate;
    let names = ["re-simulated position at the end of second", "constraint link", "states along second"];
    assert_failed(&certificate, &names);
    let check = find(&certificate, "constraint link");
    assert!(
        (check.value - 1e-3).abs() < ROUNDING && check.limit == 1e-7 && check.at == "position",
        "{check:?}"
    );
}

#[test]
fn multipliers_of_the_linkage_are_needed_and_checked() {
    let mut t = solution(0.0);
    t.constraint_multipliers = Some(vec![vec![18.0], vec![-12.0], vec![0.0]]);
    let certificate = certify_stated(&problem(), &t);
    assert_failed(
        &certificate,
        &["transversality at the ends of first", "transversality at the ends of second"],
    );
    let check = find(&certificate, "transversality at the ends of second");
    assert!(
        (check.value - 1.2 / 12.0).abs() < INTEGRATION && check.at.starts_with("initial speed"),
        "{check:?}"
    );
    // Without multipliers the conditions at the linkage are left out, and said to be.
    t.constraint_multipliers = None;
    let certificate = certify_stated(&problem(), &t);
    assert_failed(&certificate, &[]);
    assert!(find(&certificate, "transversality at the ends of first").at.contains("3 conditions left out"));
}

/// Mass `m' = -u`.
struct Burn;
impl Dynamics<1, 1> for Burn {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [-u[0]]
    }
}

/// `after - before`.
struct Drop;
impl VectorFunction<2, 1> for Drop {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] - z[1]]
    }
}

#[test]
fn a_stage_drops_its_mass() {
    let phase = |name: &str| {
        Phase::new(name, Burn)
            .states([State::new("mass", "kg").within(0.0, 100.0)])
            .controls([Variable::new("flow", "kg/s").within(0.0, 2.0)])
            .final_time(Bounds::fixed(1.0))
    };
    let (mut lower, upper) = (phase("lower"), phase("upper"));
    lower.states[0].initial = Bounds::fixed(100.0);
    let ocp = Ocp::builder("stages")
        .phase(lower)
        .phase(upper)
        .constrain(
            "staging",
            [Variable::new("drop", "kg").equal_to(-10.0)],
            [At::InitialState("upper", "mass"), At::FinalState("lower", "mass")],
            Drop,
        )
        .maximize("mass", "kg", At::FinalState("upper", "mass"))
        .build()
        .expect("well-posed");
    // Maximised: the costate of the minimised objective is -1 throughout; H = -lambda u pushes the flow to zero.
    let stage = |name, mass: f64| {
        parts::phase(name, &[0.0, 1.0], 3, move |_, _| vec![mass], |_, _| vec![0.0], |_, _| vec![-1.0])
    };
    let mut t = Trajectory {
        phases: vec![stage("lower", 100.0), stage("upper", 90.0)],
        parameters: vec![],
        objective: 90.0,
        // nu (after - before) with nu = lambda(t0) negated: -dB/dx_0 = lambda gives nu = 1.
        constraint_multipliers: Some(vec![vec![1.0]]),
    };
    assert_exact(&certify(&ocp, &t));
    // Without the drop.
    t.phases[1] = stage("upper", 100.0);
    t.objective = 100.0;
    let verification = verify(&ocp, &t, &VerifySettings::default()).expect("fits");
    assert_eq!(verification.simulation[1].states[0], 90.0);
    let names = [
        "re-simulated mass at the end of upper",
        "constraint staging",
        "objective mass",
        "states along upper",
    ];
    assert_failed(&verification.certificate, &names);
    assert_eq!(find(&verification.certificate, "constraint staging").value, 10.0);
}
