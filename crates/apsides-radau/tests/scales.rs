//! Scales from the statement, and warnings where they do not fit.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Guess, Mesh, Ocp, Phase, PhaseGuess, State, Variable};
use apsides_radau::{Radau, RadauSettings, RadauSolution, ScaleWarning};

struct Cart;
impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// The square of the acceleration, in the unit `1 / factor`.
struct Load(f64);
impl PathFunction<2, 1, 1> for Load {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [(u[0] + 2.0).square() * self.0]
    }
}

fn solved(longest: f64, load: Variable, factor: f64, objective_scale: Option<f64>) -> RadauSolution {
    let phase = Phase::new("move", Cart)
        .states([
            // Stated: bounds so far apart beside its ends would be no scale.
            State::new("x", "m").within(0.0, longest).scaled_by(longest).starts_at(0.0).ends_at(1.0),
            State::new("v", "m/s").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
        .path([load], Load(factor))
        .final_time(Bounds::new(0.1, 10.0));
    let mut builder = Ocp::builder("fast").phase(phase).minimize("time", "s", At::FinalTime("move"));
    if let Some(scale) = objective_scale {
        builder = builder.objective_scale(scale);
    }
    let ocp = builder.build().unwrap();
    let method = Radau { settings: RadauSettings { max_refinements: 0, ..RadauSettings::default() } };
    let mesh = Mesh::uniform(&ocp, 10, 4).unwrap();
    // Straight lines without acceleration: the sizes that the tests assert are those there.
    let ends = vec![vec![0.0, 0.0], vec![1.0, 0.0]];
    let phase = PhaseGuess::samples(&[0.0, 5.05], ends, vec![vec![0.0]; 2]).unwrap();
    method.solve_on(&ocp, &Guess::from_phases(&ocp, vec![phase]), mesh, &mut ()).unwrap()
}

fn subjects(solution: &RadauSolution) -> Vec<&str> {
    solution.warnings.iter().map(|w: &ScaleWarning| w.subject.as_str()).collect()
}

#[test]
fn fitting_scales_pass_in_silence() {
    let solution = solved(1.0, Variable::new("load", "m2/s4").within(-1.0, 20.0), 1.0, None);
    assert_eq!(subjects(&solution), [""; 0]);
    assert!(solution.status.is_success());
}

#[test]
fn a_constraint_whose_stated_scale_is_far_off_is_named() {
    let load = Variable::new("load", "m2/s4").within(-1.0, 20.0).scaled_by(1e-8);
    let solution = solved(1.0, load, 1.0, None);
    assert_eq!(subjects(&solution), ["constraint `load`"]);
    let warning = &solution.warnings[0];
    assert_eq!((warning.phase.as_deref(), warning.unit.as_str()), (Some("move"), "m2/s4"));
    // d load / d a = 2 (a + 2) = 4 at rest, over the width 2 of the bounds of `a`.
    assert!((warning.factor() - 8e8).abs() < 1.0, "{warning}");
    assert!(warning.to_string().contains("constraint `load`: scale 1.000e-8 m2/s4, but"), "{warning}");
}

/// A duration above zero is what every phase has: nobody stated the bound by which it is kept.
#[test]
fn the_least_duration_of_a_phase_is_no_bound_that_is_stated() {
    let build = |shortest: f64| {
        let phase = Phase::new("move", Cart)
            .states([
                State::new("x", "m").within(0.0, 1.0).starts_at(0.0).ends_at(1.0),
                State::new("v", "m/s").within(-2.0, 2.0).starts_at(0.0).ends_at(0.0),
            ])
            .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
            .initial_time(Bounds::new(0.0, 1.0))
            .final_time(Bounds::new(0.1, 10.0))
            .duration(Bounds::at_least(shortest));
        Ocp::builder("fast").phase(phase).minimize("time", "s", At::FinalTime("move")).build().unwrap()
    };
    let solved_from = |ocp: &Ocp, control: f64| {
        let ends = vec![vec![0.0, 0.0], vec![1.0, 0.0]];
        let phase = PhaseGuess::samples(&[0.0, 5.05], ends, vec![vec![control]; 2]).unwrap();
        let guess = Guess::from_phases(ocp, vec![phase]);
        let method = Radau { settings: RadauSettings { max_refinements: 0, ..RadauSettings::default() } };
        method.solve_on(ocp, &guess, Mesh::uniform(ocp, 10, 4).unwrap(), &mut ()).unwrap()
    };
    let solved = |ocp: &Ocp| solved_from(ocp, 0.0);
    assert_eq!(subjects(&solved(&build(0.0))), [""; 0]);
    // Round-off of zero says nothing of a size, neither as a bound nor as a guess.
    assert_eq!(subjects(&solved(&build(1e-17))), [""; 0]);
    assert_eq!(subjects(&solved_from(&build(0.0), std::f64::consts::FRAC_PI_2.cos())), [""; 0]);
    assert_eq!(subjects(&solved_from(&build(0.0), 1e-12)), ["control `a`"]);
    // One that is stated is named.
    let solution = solved(&build(1e-8));
    assert_eq!(subjects(&solution), ["constraint `duration`"]);
    let text = solution.warnings[0].to_string();
    assert!(
        text.contains("but its bound is 1.000e-8 s") && text.ends_with("state a scale or bounds that fit"),
        "{text}"
    );
}

#[test]
fn a_constraint_far_outside_its_limits_is_named() {
    let load = Variable::new("load", "m2/s4").within(-1.0, 20.0);
    let solution = solved(1.0, load, 1e9, None);
    assert_eq!(subjects(&solution), ["constraint `load`"]);
    let ScaleWarning { scale, size, .. } = &solution.warnings[0];
    assert_eq!(*scale, 20.0, "its largest bound");
    assert!((size - 8e9).abs() < 1.0, "{size}");
}

#[test]
fn objective_and_variables_are_named_too() {
    let load = Variable::new("load", "m2/s4");
    let solution = solved(1.0, load.clone(), 1.0, Some(1e9));
    assert_eq!(subjects(&solution), ["objective `time`"]);
    let solution = solved(1e9, load, 1.0, None);
    assert!(subjects(&solution).contains(&"state `x`"), "{:?}", solution.warnings);
}
