//! Equations of motion with a kink where a state passes a value.
//!
//! Least effort from -1 to 1 under `x' = u - k max(x, 0)`. Up to the kink the costate is constant, `u = a` and `x = a t - 1`; beyond it
//! `u = a e^(k s)` and `x = a sinh(k s) / k` after `s = t - 1/a`, so that `a sinh(k (T - 1/a)) = k`.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Crossing, Guess, Kink, Ocp, OcpError, Phase, State, Variable};
use apsides_radau::{Radau, RadauSettings, RadauSolution};

const K: f64 = 2.0;
const DURATION: f64 = 1.5;

/// Discretisation: an objective with a break at the kink, relative.
const MESH: f64 = 1e-10;

/// Discretisation: the time of the kink, s.
const MESH_TIME: f64 = 1e-9;

/// Discretisation: costates beside the kink.
const MESH_COSTATE: f64 = 1e-6;

struct Drag;
impl Dynamics<1, 1> for Drag {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let drag = |x: f64| if x > 0.0 { [K * x, K, 0.0] } else { [0.0; 3] };
        [u[0] - x[0].map(drag)]
    }
}

struct Effort;
impl PathFunction<1, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square()]
    }
}

fn phase() -> Phase {
    Phase::new("climb", Drag)
        .states([State::new("x", "-").within(-5.0, 5.0).starts_at(-1.0).ends_at(1.0)])
        .controls([Variable::new("u", "-").within(-50.0, 50.0)])
        .integral(Variable::new("effort", "-"), Effort)
        .final_time(Bounds::fixed(DURATION))
}

fn problem(phase: Phase) -> Result<Ocp, OcpError> {
    Ocp::builder("kink").phase(phase).minimize_integral("climb", "effort").build()
}

fn solve(phase: Phase, settings: RadauSettings) -> RadauSolution {
    let ocp = problem(phase).unwrap();
    Radau { settings }.solve(&ocp, &Guess::linear(&ocp)).unwrap()
}

/// `a` by halving: the left side of its equation grows with it.
fn first_control() -> f64 {
    let (mut low, mut high) = (1.0 / DURATION, 50.0);
    for _ in 0..200 {
        let a: f64 = 0.5 * (low + high);
        if a * (K * (DURATION - 1.0 / a)).sinh() < K {
            low = a;
        } else {
            high = a;
        }
    }
    0.5 * (low + high)
}

#[test]
fn an_interval_ends_at_the_kink() {
    let a = first_control();
    let (time, beyond) = (1.0 / a, DURATION - 1.0 / a);
    let effort = a + a * a * ((2.0 * K * beyond).exp() - 1.0) / (2.0 * K);
    let mut settings = RadauSettings { tolerance: 1e-11, ..RadauSettings::default() };
    settings.nlp.tolerance = 1e-12;
    let at_kink = solve(phase().kinks([Kink::State { state: 0, value: 0.0 }]), settings.clone());
    assert!(at_kink.accurate && at_kink.meshes.len() <= 3, "{:?}", at_kink.meshes);
    let t = &at_kink.trajectory.phases[0];
    assert!((at_kink.trajectory.objective - effort).abs() < MESH * effort);
    let [Crossing { end, kink: 0, .. }] = *t.mesh.crossings() else { panic!("{:?}", t.mesh.crossings()) };
    let found = t.time_at(t.mesh.fractions()[end]);
    assert!((found - time).abs() < MESH_TIME, "{found}, expected {time}");
    // The costate, minus twice the control, is continuous there.
    let costate = |t0: f64| {
        let mut value = [0.0];
        t.costate.as_ref().unwrap().evaluate(t0, &mut value);
        value[0]
    };
    for t0 in [0.0, found - 1e-9, found + 1e-9] {
        assert!((costate(t0) + 2.0 * a).abs() < MESH_COSTATE, "{}", costate(t0) + 2.0 * a);
    }
    assert!((costate(DURATION) + 2.0 * a * (K * beyond).exp()).abs() < MESH_COSTATE);

    // A kink that the state does not pass changes nothing.
    let kinks = [Kink::State { state: 0, value: 3.0 }, Kink::State { state: 0, value: 0.0 }];
    let with_other = solve(phase().kinks(kinks), settings);
    assert_eq!(with_other.trajectory.phases[0].mesh.crossings(), [Crossing { end, kink: 1, rising: true }]);
    assert_eq!(with_other.trajectory.objective, at_kink.trajectory.objective);
}

#[test]
fn kinks_that_cannot_be_are_refused() {
    for (kink, name) in [
        (Kink::State { state: 1, value: 0.0 }, "kink"),
        (Kink::State { state: 0, value: f64::NAN }, "kink"),
        (Kink::State { state: 0, value: f64::INFINITY }, "kink"),
    ] {
        let error = problem(phase().kinks([kink])).err().unwrap().to_string();
        assert!(error.contains("climb") && error.contains(name), "{error}");
    }
}
