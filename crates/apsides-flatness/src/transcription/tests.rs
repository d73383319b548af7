use apsides_ad::{Dynamics, FlatMap, PathFunction, Scalar, VectorFunction};
use apsides_nlp::check_derivatives;
use apsides_ocp::{At, Guess, PhaseGuess, Sense, State, Term, Variable};

use super::*;
use crate::{BoundRows, SplineSettings};

/// Differences of functions with values of order one to a hundred.
const DIFFERENCES: f64 = 1e-6;

/// Everything at once: outputs of different smoothness, a parameter, explicit time.
#[derive(Clone, Copy)]
struct Craft;

impl Dynamics<3, 2, 1> for Craft {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 3], u: &[S; 2], p: &[S; 1]) -> [S; 3] {
        [x[1], u[0] * u[1].cos() / x[2] + p[0] * t.sin(), -u[0].square()]
    }
}

impl FlatMap<2, 3, 3, 2, 1, 1> for Craft {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 3]; 2], p: &[S; 1]) -> ([S; 3], [S; 2], [S; 1]) {
        let [x, m] = y;
        let force = m[0] * (x[2] - p[0] * t.sin());
        let thrust = (-m[1] + 4.0).sqrt();
        ([x[0], x[1], m[0]], [thrust, (x[1] * t).atan()], [force.square() - thrust * (x[0] + t)])
    }

    fn outputs(&self, _t: f64, x: &[f64; 3], _u: &[f64; 2], _p: &[f64; 1]) -> [f64; 2] {
        [x[0], x[2]]
    }
}

struct Energy;

impl PathFunction<3, 2, 2, 1> for Energy {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 3], u: &[S; 2], p: &[S; 1]) -> [S; 2] {
        [x[0] * x[1] * p[0] + u[1].sin() * t, x[2] * u[0]]
    }
}

struct Effort;

impl PathFunction<3, 2, 1, 1> for Effort {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 3], u: &[S; 2], p: &[S; 1]) -> [S; 1] {
        [u[0].square() * x[1] + t * p[0] * u[1]]
    }
}

struct Ends;

impl VectorFunction<5, 2> for Ends {
    fn evaluate<S: Scalar>(&self, z: &[S; 5]) -> [S; 2] {
        [z[0] * z[1] + z[2].square() * z[4], z[3] * z[4] * z[0].sin()]
    }
}

struct Cost;

impl VectorFunction<3, 1> for Cost {
    fn evaluate<S: Scalar>(&self, z: &[S; 3]) -> [S; 1] {
        [z[0] * z[1].exp() + z[0].square() * z[2]]
    }
}

fn phase(name: &str) -> Phase {
    let row = |name: &str| Variable::new(name, "-").within(-50.0, 50.0);
    Phase::new(name, Craft)
        .states([
            State::new("x", "m").within(-10.0, 10.0).starts_at(0.3),
            State::new("v", "m/s").ends_within(-3.0, 4.0),
            State::new("m", "kg").at_least(0.1),
        ])
        .controls([Variable::new("thrust", "N").within(0.0, 9.0), Variable::new("angle", "rad")])
        .initial_time(Bounds::new(-1.0, 3.0))
        .final_time(Bounds::new(1.0, 8.0))
        .duration(Bounds::new(0.5, 6.0))
        .path([row("energy"), row("power")], Energy)
        .integral(Variable::new("effort", "J").at_most(100.0), Effort)
}

fn ocp() -> Ocp {
    let ends = [
        At::InitialState("b", "v"),
        At::FinalState("a", "m"),
        At::FinalState("a", "v"),
        At::InitialTime("b"),
        At::Parameter("bias"),
    ];
    Ocp::builder("everything")
        .parameter(Variable::new("bias", "-").within(-2.0, 2.0))
        .phase(phase("a"))
        .phase(phase("b"))
        .link("a", "b")
        .constrain(
            "ends",
            [Variable::new("one", "-").equal_to(0.4), Variable::new("two", "-").at_most(9.0)],
            ends,
            Ends,
        )
        .objective(
            Sense::Maximize,
            "gain",
            "-",
            [
                Term::End(At::FinalState("b", "v"), 2.0),
                Term::End(At::FinalTime("b"), -1.0),
                Term::Integral("a", "effort", 0.7),
                Term::function(
                    [At::FinalState("b", "m"), At::InitialState("a", "v"), At::Parameter("bias")],
                    Cost,
                ),
            ],
        )
        .build()
        .unwrap()
}

fn guess(ocp: &Ocp) -> Guess {
    let phase = |t: [f64; 3]| {
        let states = [0.4, 1.3, 2.1].map(|v| vec![v, 0.3 * v * v, 2.0 - 0.3 * v]).to_vec();
        PhaseGuess::samples(&t, states, vec![vec![1.0, 0.2]; 3]).unwrap()
    };
    Guess::from_phases(ocp, vec![phase([0.2, 1.0, 2.1]), phase([2.3, 3.0, 4.4])])
}

fn transcription(settings: &SplineSettings) -> Transcription {
    let ocp = ocp();
    let guess = guess(&ocp);
    let systems = [FlatSystem::new(Craft), FlatSystem::new(Craft)];
    let meshes: Vec<SplineMesh> =
        ocp.phases.iter().zip(&systems).map(|(p, s)| SplineMesh::new(p, s, settings).unwrap()).collect();
    let start = Start::from_guess(&ocp, &systems, &meshes, &guess).unwrap();
    let active = Active::first(&ocp, BoundRows::Everywhere);
    Transcription::new(&ocp, &systems, &meshes, &start, &Scaling::new(&ocp, &guess), &active).unwrap()
}

#[test]
fn derivatives_agree_with_differences() {
    let settings = SplineSettings {
        order: Some(4),
        breaks: crate::Breaks::At { fractions: vec![0.0, 0.3, 1.0], multiplicities: vec![2] },
        points: 4,
        ..SplineSettings::default()
    };
    let mut nlp = transcription(&settings);
    let mut x = nlp.start.clone();
    x.iter_mut().enumerate().for_each(|(k, v)| *v += 0.05 * (2.0 * k as f64).sin());
    if let Some(bias) = x.last_mut() {
        *bias = 0.3;
    }
    let report = check_derivatives(&mut nlp, &x).unwrap();
    assert!(report.is_within(DIFFERENCES), "{report:#?}");
}

#[test]
fn evaluations_allocate_nothing() {
    let mut nlp = transcription(&SplineSettings::default());
    let x = nlp.start.clone();
    let moved: Vec<f64> = x.iter().map(|v| v + 1e-3).collect();
    let (n, m) = (nlp.variables(), nlp.constraints());
    let (mut gradient, mut values) = (vec![0.0; n], vec![0.0; m]);
    let mut jacobian = vec![0.0; nlp.jacobian_pattern().len()];
    let mut hessian = vec![0.0; nlp.hessian_pattern().len()];
    let multipliers = vec![0.7; m];
    let mut evaluate = |x: &[f64]| {
        let f = nlp.objective(x);
        nlp.gradient(x, &mut gradient);
        nlp.constraint_values(x, &mut values);
        nlp.jacobian(x, &mut jacobian);
        nlp.hessian(x, 1.0, &multipliers, &mut hessian);
        f
    };
    evaluate(&x);
    let counted = allocation_counter::measure(|| {
        evaluate(&moved);
    });
    assert_eq!(counted.count_total, 0);
}
