//! Bad settings are refused by name with the allowed range.

use apsides_flatness::{Breaks, FlatSystem, Flatness, FlatnessError, Placement};

use crate::lander::{Landing, WithMass};
use crate::method;

fn refusal(method: &Flatness) -> FlatnessError {
    let landing = Landing::from_perilune(15e3);
    let (ocp, guess) = landing.pose();
    method.solve(&ocp, &[landing.system()], &guess).unwrap_err()
}

fn message(method: &Flatness) -> String {
    refusal(method).to_string()
}

#[test]
fn order() {
    for order in [0, 1, 2, 33] {
        let message = message(&method(order, 15, Placement::Gauss, false));
        let expected = format!("phase `braking`: flatness setting `order` is {order}, allowed is 3 to 32");
        assert!(message.starts_with(&expected), "{message}");
    }
}

#[test]
fn multiplicity_and_breaks() {
    let with = |fractions: Vec<f64>, multiplicities: Vec<usize>| {
        let mut m = method(6, 15, Placement::Gauss, false);
        m.settings.spline.breaks = Breaks::At { fractions, multiplicities };
        message(&m)
    };
    for m in [0, 5, 7] {
        let message = with(vec![0.0, 0.5, 1.0], vec![m]);
        let expected =
            format!("phase `braking`: flatness setting `multiplicity` is {m}, allowed is 1 to 4 (order 6");
        assert!(message.starts_with(&expected), "{message}");
    }
    assert!(with(vec![0.0, 0.7, 0.5, 1.0], vec![1, 1]).contains("knot 7 is 0.5"));
    assert!(with(vec![0.0, f64::NAN, 1.0], vec![1]).contains("NaN"));
    assert!(with(vec![0.0, 0.5, 2.0], vec![1]).contains("`breaks` is 2"));
    assert!(with(vec![0.0, 0.5, 1.0], vec![]).contains("knots"));
    assert!(with(vec![], vec![]).contains("knots"));
    for segments in [0, 1_000_000] {
        let mut m = method(6, 15, Placement::Gauss, false);
        m.settings.spline.breaks = Breaks::Uniform(segments);
        assert!(message(&m).contains("`segments`"));
    }
}

/// 15 coefficients and derivative 2: at least 13 points. 31 variables and 7 boundary values: at most 24.
#[test]
fn points() {
    for points in [0, 1, 12] {
        let message = message(&method(6, points, Placement::Uniform, false));
        let expected = format!("phase `braking`: flatness setting `points` is {points}, allowed is 13 to");
        assert!(message.starts_with(&expected), "{message}");
    }
    for points in [25, 40] {
        match refusal(&method(6, points, Placement::Uniform, false)) {
            FlatnessError::TooManyConstraints { points: p, equalities, variables, least, most, .. } => {
                assert_eq!((p, equalities, variables, least, most), (points, points + 7, 31, 13, 24));
            }
            other => panic!("{other}"),
        }
    }
    assert!(message(&method(6, 61, Placement::Gauss, false)).contains("allowed is 13 to 60"));
}

#[test]
fn systems_and_tolerances() {
    let landing = Landing::from_perilune(15e3);
    let (ocp, guess) = landing.pose();
    let solve =
        |systems: &[FlatSystem]| Flatness::default().solve(&ocp, systems, &guess).unwrap_err().to_string();
    assert_eq!(solve(&[]), "problem `lunar landing`: expected 1 flat systems (one per phase), found 0");
    let two = [landing.system(), FlatSystem::new(WithMass(landing.flight))];
    assert!(solve(&two).contains("found 2"));
    let mut ocp = ocp.clone();
    ocp.phases[0].states.pop();
    // Built problems have one equation per state; a system for another number is refused first.
    let refused = Flatness::default().solve(&ocp, &two[..1], &guess).unwrap_err().to_string();
    assert_eq!(refused, "phase `braking`: expected 4 states of the flat system, found 5");
    for (name, set) in [
        ("tolerance", (|m: &mut Flatness| m.settings.tolerance = 0.0) as fn(&mut Flatness)),
        ("objective_tolerance", |m| m.settings.objective_tolerance = f64::NAN),
        ("path_tolerance", |m| m.settings.path_tolerance = f64::INFINITY),
        ("max_order", |m| m.settings.max_order = 33),
        ("max_refinements", |m| m.settings.max_refinements = 1000),
        ("max_intervals", |m| m.settings.max_intervals = 0),
    ] {
        let mut m = Flatness::default();
        set(&mut m);
        assert!(message(&m).contains(name), "{name}");
    }
}
