//! Integrals in boundary conditions are states: the functions of the phase are those of the model, and guesses have their values.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, EndpointInput, Guess, Ocp, Phase, PhaseGuess, Sense, State, Term, Variable};

/// Simpson's rule on polynomials of degree three is exact.
const ROUNDING: f64 = 1e-14;

struct Cart;
impl Dynamics<2, 1, 1> for Cart {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], p: &[S; 1]) -> [S; 2] {
        [x[1] * t, u[0] * p[0]]
    }
}
struct Power;
impl PathFunction<2, 1, 1> for Power {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[1] * u[0] + t]
    }
}
struct Area;
impl PathFunction<2, 1, 1, 1> for Area {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], _u: &[S; 1], p: &[S; 1]) -> [S; 1] {
        [x[0] * p[0]]
    }
}
struct Ratio;
impl VectorFunction<2, 1> for Ratio {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[0] / z[1]]
    }
}

fn phase() -> Phase {
    Phase::new("go", Cart)
        .states([State::new("x", "m").starts_at(0.0), State::new("work", "m/s").starts_at(1.0)])
        .controls([Variable::new("u", "N")])
        .final_time(Bounds::fixed(2.0))
        .path([Variable::new("limit", "W").at_most(9.0)], Power)
        .integral(Variable::new("work", "J").scaled_by(5.0), Power)
        .integral(Variable::new("unused", "J"), Power)
        .integral(Variable::new("area", "m s"), Area)
}

fn ocp() -> Ocp {
    let ratio = Term::function([At::Integral("go", "area"), At::Integral("go", "work")], Ratio);
    Ocp::builder("p")
        .parameter(Variable::new("gain", "-").within(3.0, 3.0))
        .phase(phase())
        .objective(Sense::Minimize, "ratio", "-", [ratio, Term::End(At::Integral("go", "unused"), 2.0)])
        .constrain(
            "mean",
            [Variable::new("mean", "-").at_most(4.0)],
            [At::Integral("go", "area"), At::FinalTime("go")],
            Ratio,
        )
        .build()
        .unwrap()
}

#[test]
fn an_integral_in_a_function_of_ends_is_a_state_and_a_weighted_one_is_not() {
    let ocp = ocp();
    let phase = &ocp.phases[0];
    let names: Vec<&str> = phase.states.iter().map(|s| s.variable.name.as_str()).collect();
    assert_eq!(names, ["x", "work", "area", "integral of work"]);
    assert_eq!((phase.accumulated.as_slice(), phase.model_states()), ([2, 0].as_slice(), 2));
    assert_eq!((phase.states[3].variable.scale, phase.states[3].initial), (Some(5.0), Bounds::fixed(0.0)));
    assert_eq!(ocp.objective.integrals, [(0, 1, 2.0)]);
    let at = |state| EndpointInput::FinalState { phase: 0, state };
    assert_eq!(ocp.objective.functions[0].0, [at(2), at(3)]);
    assert_eq!(ocp.constraints[0].inputs, [at(2), EndpointInput::FinalTime { phase: 0 }]);
}

#[test]
fn functions_of_the_phase_are_those_of_the_model() {
    let ocp = ocp();
    let phase = &ocp.phases[0];
    // x, v, two integrals, u, gain, t.
    let z = [2.0, 3.0, 50.0, 60.0, 5.0, 7.0, 11.0];
    let mut rates = [0.0; 4];
    phase.dynamics.value(&z, &mut rates);
    assert_eq!(rates, [33.0, 35.0, 14.0, 26.0]);
    // The path constraint takes no parameter.
    let mut value = [0.0];
    phase.path[0].function.value(&[2.0, 3.0, 50.0, 60.0, 5.0, 11.0], &mut value);
    assert_eq!(value, [26.0]);
    phase.integrals[2].function.value(&z, &mut value);
    assert_eq!(value, [14.0]);
}

#[test]
fn a_guess_of_the_model_gets_the_values_of_its_integrals() {
    let ocp = ocp();
    let rows = [vec![0.0, 1.0], vec![4.0, 3.0]];
    let guess = PhaseGuess::samples(&[0.0, 2.0], rows.into(), vec![vec![2.0], vec![2.0]]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![guess]);
    guess.check(&ocp).unwrap();
    let mut x = [0.0; 4];
    for t in [0.0, 1.0, 2.0] {
        guess.phases[0].state(t / 2.0, &mut x);
        // The integrals of 3 * 2 t, and of (1 + t) * 2 + t.
        assert!((x[2] - 3.0 * t * t).abs() < ROUNDING * 12.0, "{x:?}");
        assert!((x[3] - (2.0 * t + 1.5 * t * t)).abs() < ROUNDING * 12.0, "{x:?}");
    }
    // A guess of other sizes stays one of other sizes.
    let short = PhaseGuess::samples(&[0.0, 2.0], vec![vec![0.0]; 2], vec![vec![2.0]; 2]).unwrap();
    assert!(Guess::from_phases(&ocp, vec![short]).check(&ocp).is_err());
}

#[test]
fn unknown_integrals_are_refused_with_those_that_are_known() {
    let refused = |at: At<'_>| {
        Ocp::builder("p").phase(phase()).constrain_node("c", vec![], &[at], apsides_ad::vector_node(Ratio))
    };
    let message = refused(At::Integral("go", "aera")).build().err().unwrap().to_string();
    assert_eq!(
        message,
        "constraint `c`, phase `go`: no integral is named `aera`; known: `work`, `unused`, `area`"
    );
    let message = refused(At::Integral("stay", "area")).build().err().unwrap().to_string();
    assert!(message.contains("no phase is named `stay`"), "{message}");
}
