//! Problems that a program states, by the parts that a file has, too.

use apsides_expressions::Unit;
use apsides_expressions::build::ExpressionBuilder;
use apsides_expressions::function::{Binary, Unary};
use apsides_problem_file::model::{Amount, End, Model, Objective, Phase, Stated, Times, Variable, at_place};
use apsides_problem_file::{Missing, Place, ProblemError, ProblemFile, Statement};

fn number(value: f64) -> Stated {
    Stated { amount: Amount::Number(value), at: at_place(0) }
}

fn variable(name: &str) -> Variable {
    Variable {
        least: Some(number(0.0)),
        most: Some(number(10.0)),
        start: Some(End::Fixed(number(0.0))),
        ..Variable::new(name.into(), at_place(0), Unit::none())
    }
}

/// `x' = sin(u) + sin(u)^2`, in the least time; the sine is one part that is used three times.
fn stated() -> Model {
    let mut b = ExpressionBuilder::new(1);
    let u = b.name("u");
    let sine = b.unary(Unary::Sin, u);
    let square = b.binary(Binary::Multiply, sine, sine);
    let rate = b.binary(Binary::Add, sine, square);
    let mut x = variable("x");
    x.end = Some(End::Fixed(number(1.0)));
    let phase = Phase {
        name: "run".into(),
        at: at_place(0),
        times: Some(Times {
            start: None,
            end: Some(End::Between(number(0.1), number(5.0))),
            duration: None,
            unit: None,
            at: at_place(0),
        }),
        states: vec![x],
        controls: vec![Variable { start: None, ..variable("u") }],
        dynamics: vec![("x".into(), at_place(1), b.expression(rate))],
        path: vec![],
        integrals: vec![],
        kinks: vec![],
        directions: vec![],
    };
    let mut b = ExpressionBuilder::new(1);
    let end = b.name("end.time");
    let formula = b.expression(end);
    let objective = Objective { maximize: false, formula, name: None, unit: None, scale: None };
    Model { phases: vec![phase], objective: Some(objective), ..Model::default() }
}

const TEXT: &str = r#"kind = "problem"
[phase.run]
time.end = [0.1, 5]
states.x = { min = 0, max = 10, start = 0, end = 1 }
controls.u = [0, 10]
dynamics.x = "sin(u) + sin(u)*sin(u)"
[objective]
minimize = "end.time"
"#;

fn places() -> Vec<Place> {
    vec![Place::of_line("run.py".into(), 3, "x = ..."), Place::of_line("run.py".into(), 7, "rate = ...")]
}

#[test]
fn the_same_problem_as_a_file() -> Result<(), ProblemError> {
    let posed = Statement::new(stated(), "run.py", places())?.pose(&[])?;
    let file = ProblemFile::parse(TEXT, "run.toml", &|_| Err(std::io::ErrorKind::NotFound.into()), &[])?;
    let read = file.statement().pose(&[])?;
    let formulas = [&posed, &read].map(|p| p.ocp.phases[0].dynamics.formula().map(|f| f.to_json()).ok());
    assert!(formulas[0].is_some());
    assert_eq!(formulas[0], formulas[1]);
    assert_eq!(posed.ocp.phases[0].states, read.ocp.phases[0].states);
    assert_eq!(posed.guess.parameters, read.guess.parameters);
    Ok(())
}

#[test]
fn a_control_with_a_limited_rate_is_a_state() -> Result<(), ProblemError> {
    let text = r#"kind = "problem"
[phase.run]
time.end = [1, 5]
states.x = { unit = "m", start = 0, end = 1 }
controls.pitch = { unit = "deg", min = -90, max = 90, rate = [-2, 3], end = 90 }
controls.thrust = { unit = "m/s2", min = 0, max = 2 }
dynamics.x = "cos(pitch)*1 [m/s] + thrust*time"
[boundary]
above = "end.pitch >= start.pitch"
[objective]
minimize = "end.time"
[guess]
pitch = ["10 deg", "80 deg"]
"#;
    let file = ProblemFile::parse(text, "run.toml", &|_| Err(std::io::ErrorKind::NotFound.into()), &[])?;
    let posed = file.statement().pose(&[])?;
    let phase = &posed.ocp.phases[0];
    let states: Vec<&str> = phase.states.iter().map(|s| s.variable.name.as_str()).collect();
    let controls: Vec<&str> = phase.controls.iter().map(|c| c.name.as_str()).collect();
    assert_eq!((states, controls), (vec!["x", "pitch"], vec!["pitch_rate", "thrust"]));
    let degree = std::f64::consts::PI / 180.0;
    assert_eq!(phase.controls[0].unit, "rad/s");
    assert_eq!(
        [phase.controls[0].bounds.lower, phase.controls[0].bounds.upper],
        [-2.0 * degree, 3.0 * degree]
    );
    assert_eq!(phase.states[1].terminal.lower, 90.0 * degree);
    let mut rates = [0.0; 2];
    // Inputs are x, pitch, pitch_rate, thrust and time.
    phase.dynamics.value(&[0.0, 0.0, 0.25, 1.0, 3.0], &mut rates);
    assert_eq!(rates, [4.0, 0.25]);
    let mut x = [0.0; 2];
    posed.guess.phases[0].state(1.0, &mut x);
    assert_eq!(x[1], 80.0 * degree);
    assert_eq!(file.statement().unit_of("run", "pitch_rate").map(|u| u.name), Some("deg/s".into()));
    Ok(())
}

#[test]
fn mistakes_have_their_place_in_the_program() {
    let mut model = stated();
    let mut b = ExpressionBuilder::new(1);
    let unknown = b.name("w");
    model.phases[0].dynamics[0].2 = b.expression(unknown);
    let refused = Statement::new(model, "run.py", places()).and_then(|s| s.pose(&[]).map(|_| ()));
    let message = refused.unwrap_err().to_string();
    assert!(message.starts_with("run.py, line 7: no quantity is named `w`"), "{message}");
    assert!(message.ends_with("\n  7 | rate = ..."), "{message}");
}

#[test]
fn numbers_that_are_not_finite_have_their_place() {
    let refused = |change: &dyn Fn(&mut Phase, Stated), value: f64| {
        let mut model = stated();
        change(&mut model.phases[0], Stated { amount: Amount::Number(value), at: at_place(1) });
        let refused = Statement::new(model, "run.py", places()).and_then(|s| s.pose(&[]).map(|_| ()));
        refused.unwrap_err().to_string()
    };
    let kink = |phase: &mut Phase, value| phase.kinks = vec![("x".into(), at_place(1), vec![value])];
    let most = |phase: &mut Phase, value| phase.states[0].most = Some(value);
    for (message, what) in [
        (refused(&kink, f64::NAN), "the kink of `x` is NaN, allowed is a number"),
        (refused(&kink, f64::INFINITY), "the kink of `x` is inf, allowed is a finite number"),
        (refused(&most, f64::NAN), "is NaN, allowed is a number"),
    ] {
        assert!(message.starts_with("run.py, line 7: ") && message.contains(what), "{message}");
    }
}

#[test]
fn what_is_missing_is_data() {
    let mut model = stated();
    model.phases[0].times = None;
    model.phases[0].dynamics.clear();
    let Err(ProblemError::Missing { missing, .. }) = Statement::new(model, "run.py", places()) else {
        panic!("it is not complete");
    };
    assert_eq!(missing, [Missing::EndTime("run".into()), Missing::Rate("run".into(), "x".into())]);
}

#[test]
fn terms_of_sums_that_are_used_twice_do_not_multiply() {
    let mut b = ExpressionBuilder::new(0);
    let mut sum = b.name("end.time");
    for _ in 0..60 {
        sum = b.binary(Binary::Add, sum, sum);
    }
    assert_eq!(b.expression(sum).terms().len(), 2);
}

#[test]
fn the_file_of_a_stated_problem() -> Result<(), ProblemError> {
    let mut model = stated();
    model.phases[0].controls[0].unit = Unit::parse("deg").unwrap_or_else(|_| Unit::none());
    model.has_units = true;
    let statement = Statement::new(model, "run.py", places())?;
    let text = statement.exported();
    assert!(text.contains("[definitions]\npart_1 = \"sin(u)\""), "{text}");
    let file = ProblemFile::parse(&text, "run.toml", &|_| Err(std::io::ErrorKind::NotFound.into()), &[])?;
    let (here, there) = (statement.pose(&[])?, file.statement().pose(&[])?);
    let formulas = [&here, &there].map(|p| p.ocp.phases[0].dynamics.formula().map(|f| f.to_json()).ok());
    assert_eq!(formulas[0], formulas[1]);
    assert_eq!(here.ocp.phases[0].states, there.ocp.phases[0].states);
    assert_eq!(here.ocp.phases[0].final_time, there.ocp.phases[0].final_time);
    assert_eq!(here.ocp.phases[0].controls, there.ocp.phases[0].controls);
    assert_eq!(there.ocp.phases[0].controls[0].bounds.upper, 10_f64.to_radians());
    Ok(())
}
