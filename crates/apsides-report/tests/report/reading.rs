//! `trajectory.csv` and `multipliers.json`: what is written reads back, what is damaged is refused with its line.

use apsides_ocp::{Contact, PiecewisePolynomial, Segment, Trajectory};
use apsides_report::{Multipliers, ReportError, read_trajectory, write_trajectory};
use proptest::prelude::*;

use crate::lander;

/// Round-off of polynomials through values that are read again.
const ROUNDING: f64 = 1e-12;

fn csv(trajectory: &Trajectory) -> String {
    let mut out = Vec::new();
    write_trajectory(&mut out, &lander::ocp(), trajectory).expect("fits");
    String::from_utf8(out).expect("text")
}

fn read(text: &str) -> Result<Trajectory, ReportError> {
    read_trajectory(text.as_bytes(), &lander::ocp(), None)
}

/// Largest difference at `t`, relative to the largest value of the polynomial.
fn difference(a: &PiecewisePolynomial, b: &PiecewisePolynomial, t: f64) -> f64 {
    let value = |p: &PiecewisePolynomial| {
        let mut x = vec![0.0; p.dimension()];
        p.evaluate(t, &mut x);
        x
    };
    let sizes = |c: usize| {
        let all = a.segments().iter().flat_map(move |s| s.values.iter().skip(c).step_by(a.dimension()));
        all.fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
    };
    let pairs = value(a).into_iter().zip(value(b)).enumerate();
    pairs.map(|(c, (x, y))| (x - y).abs() / sizes(c)).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn the_same_polynomials_are_read_back(
        start in -1e5..1e5f64,
        steps in prop::collection::vec((0.5..500.0f64, 1usize..12), 1..8),
        frequency in 1e-3..0.1f64,
        places in prop::collection::vec(0.0..1.0f64, 20),
    ) {
        let mut breaks = vec![start];
        for (width, _) in &steps {
            breaks.push(breaks[breaks.len() - 1] + width);
        }
        let points: Vec<usize> = steps.iter().map(|s| s.1).collect();
        let curve = |t: f64, c: usize| ((t - start) * frequency + c as f64).sin() * 10f64.powi(3 * c as i32 - 3);
        let mut trajectory = lander::trajectory();
        trajectory.phases[0] = lander::phase("braking", &breaks, &points, (5, &curve), (1, &curve));
        let again = read(&csv(&trajectory)).unwrap();
        prop_assert_eq!(&again.parameters, &trajectory.parameters);
        prop_assert_eq!(again.objective, trajectory.objective);
        for (a, b) in trajectory.phases.iter().zip(&again.phases) {
            prop_assert_eq!((&a.name, a.initial_time, a.final_time), (&b.name, b.initial_time, b.final_time));
            prop_assert_eq!(a.mesh.points(), b.mesh.points());
            prop_assert_eq!(&a.interval_errors, &b.interval_errors);
            for s in &places {
                let t = a.time_at(*s);
                prop_assert!(difference(&a.state, &b.state, t) <= ROUNDING);
                prop_assert!(difference(&a.control, &b.control, t) <= ROUNDING);
                let (c, d) = (a.costate.as_ref().unwrap(), b.costate.as_ref().unwrap());
                prop_assert!(difference(c, d, t) <= ROUNDING);
            }
        }
    }

    #[test]
    fn damaged_files_never_panic(cut in 0usize..6000, at in 0usize..6000, byte in any::<u8>()) {
        let mut text = csv(&lander::trajectory()).into_bytes();
        text.truncate(cut);
        if let Some(b) = text.get_mut(at) {
            *b = byte;
        }
        let _ = read_trajectory(text.as_slice(), &lander::ocp(), None);
    }
}

#[test]
fn costates_may_be_absent() {
    let mut trajectory = lander::trajectory();
    trajectory.phases.iter_mut().for_each(|p| p.costate = None);
    let text = csv(&trajectory);
    assert!(!text.contains("costate"));
    assert!(read(&text).unwrap().phases.iter().all(|p| p.costate.is_none()));
    // In one phase only.
    let mut trajectory = lander::trajectory();
    trajectory.phases[0].costate = None;
    let again = read(&csv(&trajectory)).unwrap();
    assert!(again.phases[0].costate.is_none() && again.phases[1].costate.is_some());
}

#[test]
fn writing_what_was_read_gives_the_same_file() {
    let text = csv(&lander::trajectory());
    let again = csv(&read(&text).unwrap());
    // The control at the end of a phase is extrapolated, and may round differently with the times.
    for (a, b) in text.lines().zip(again.lines()).filter(|(a, _)| a.ends_with('1')) {
        assert_eq!(a, b);
    }
    assert_eq!(text.lines().count(), again.lines().count());
}

#[test]
fn damage_is_reported_with_its_line() {
    let text = csv(&lander::trajectory());
    let lines: Vec<&str> = text.lines().collect();
    let with_line = |number: usize, line: &str| {
        let mut changed = lines.clone();
        changed[number - 1] = line;
        changed.join("\n")
    };
    let message = |text: &str| read(text).map(|_| "read".to_owned()).unwrap_or_else(|e| e.to_string());
    let expect = |text: &str, line: u64, reason: &str| {
        let found = message(text);
        assert!(found.starts_with(&format!("trajectory, line {line}: ")), "{found}");
        assert!(found.contains(reason), "{found}");
    };
    let row = lines[4];
    let cells: Vec<&str> = row.split(',').collect();
    let with_cell = |k: usize, value: &str| {
        let mut cells = cells.clone();
        cells[k] = value;
        with_line(5, &cells.join(","))
    };
    expect(&with_cell(3, "NaN"), 5, "`NaN` in `radius_m` is not a finite number");
    expect(&with_cell(3, "1e999"), 5, "not a finite number");
    expect(&with_cell(3, "12,5"), 5, "20 cells, expected 19");
    expect(&with_cell(3, "x"), 5, "`x` in `radius_m` is no number");
    expect(&with_cell(4, ""), 5, "`downrange_angle_rad` is empty");
    expect(&with_cell(0, "ascent"), 5, "no phase is named `ascent`; known: `braking`, `descent <final>`");
    expect(&with_cell(1, "7"), 5, "interval 7 follows interval 0");
    expect(&with_cell(1, "-1"), 5, "no index");
    expect(&with_cell(2, "0.0"), 5, "does not exceed");
}

#[test]
fn truncation_is_noticed_everywhere() {
    let text = csv(&lander::trajectory());
    let ends: Vec<usize> = text.match_indices('\n').map(|(k, _)| k + 1).collect();
    let mut previous = 0;
    for end in &ends[..ends.len() - 1] {
        // Between two rows, and in the middle of a row.
        for cut in [*end, previous + (end - previous) / 2] {
            let error = read(&text[..cut]).expect_err("a truncated file");
            assert!(matches!(error, ReportError::Trajectory { line, .. } if line >= 1), "{error}");
        }
        previous = *end;
    }
    assert!(read("").unwrap_err().to_string().contains("column `phase` is missing"));
    let second_phase = text.find("descent <final>").unwrap();
    let error = read(&text[..second_phase]).unwrap_err();
    assert_eq!(error.to_string(), "trajectory, line 20: the file ends without phase `descent <final>`");
}

#[test]
fn a_file_of_another_problem_is_refused() {
    let text = csv(&lander::trajectory()).replacen("radius_m,", "radius_km,", 1);
    assert_eq!(read(&text).unwrap_err().to_string(), "trajectory, line 1: column `radius_m` is missing");
}

fn with_multipliers() -> Trajectory {
    let mut trajectory = lander::trajectory();
    let rows: Vec<usize> = lander::ocp().constraints.iter().map(|c| c.rows.len()).collect();
    trajectory.constraint_multipliers =
        Some(rows.iter().enumerate().map(|(k, n)| vec![0.1 + k as f64; *n]).collect());
    let phase = &mut trajectory.phases[0];
    let (breaks, points) = (phase.control.breaks().to_vec(), phase.mesh.points().to_vec());
    phase.path_multipliers =
        Some(lander::polynomial(&breaks, &points, 2, false, &|t, c| (0.01 * t + c as f64).sin()));
    phase.contacts = vec![Contact { end: 1, row: 1, multiplier: 0.1 + 0.2 }];
    trajectory
}

#[test]
fn multipliers_read_back() {
    let ocp = lander::ocp();
    let trajectory = with_multipliers();
    let multipliers = Multipliers::of(&ocp, &trajectory).unwrap();
    let text = serde_json::to_string(&multipliers).unwrap();
    let multipliers: Multipliers = serde_json::from_str(&text).unwrap();
    let again = read_trajectory(csv(&trajectory).as_bytes(), &ocp, Some(&multipliers)).unwrap();
    assert_eq!(again.constraint_multipliers, trajectory.constraint_multipliers);
    let path = |t: &Trajectory, phase: usize| t.phases[phase].path_multipliers.clone();
    assert!(path(&again, 1).is_none());
    let (a, b) = (path(&trajectory, 0).unwrap(), path(&again, 0).unwrap());
    for t in [0.0, 3.0, 149.9, 150.0, 555.5, 800.0] {
        assert!(difference(&a, &b, t) < ROUNDING);
    }
    assert_eq!(again.phases[0].contacts, trajectory.phases[0].contacts);
    assert!(Multipliers::of(&ocp, &lander::trajectory()).is_none());
    // Files from before there were contacts.
    let older: Multipliers = serde_json::from_str(r#"{"constraints": null, "path": []}"#).unwrap();
    assert!(older.contacts.is_empty());
}

#[test]
fn multipliers_that_do_not_fit_are_refused() {
    let ocp = lander::ocp();
    let trajectory = with_multipliers();
    let good = Multipliers::of(&ocp, &trajectory).unwrap();
    let message = |m: &Multipliers| {
        read_trajectory(csv(&trajectory).as_bytes(), &ocp, Some(m)).unwrap_err().to_string()
    };
    let mut fewer = good.clone();
    fewer.constraints.as_mut().unwrap().pop();
    assert!(message(&fewer).starts_with("multipliers of `lander`: expected 5 endpoint constraints, found 4"));
    let mut short = good.clone();
    short.constraints.as_mut().unwrap()[1].values.clear();
    assert!(message(&short).contains("expected 1 values, found 0"));
    let mut points = good.clone();
    points.path[0].values.pop();
    assert_eq!(message(&points), "multipliers of `braking`: expected 18 collocation points, found 17");
    let mut rows = good.clone();
    rows.path[0].values[3].pop();
    assert_eq!(message(&rows), "multipliers of `braking`: expected 2 values at point 3, found 1");
    let mut contacts = good.clone();
    contacts.contacts[0].interval_end = 99;
    assert_eq!(message(&contacts), "multipliers of `dynamic pressure`: 99 is no interval end");
    contacts.contacts[0].row = "lift".into();
    assert_eq!(message(&contacts), "multipliers of `lift`: no path constraint of phase `braking`");
    let mut renamed = good;
    renamed.constraints.as_mut().unwrap()[0].constraint = "other".into();
    assert!(message(&renamed).contains("`other`"));
}

#[test]
fn trajectories_that_nodes_do_not_determine_are_refused() {
    let mut trajectory = lander::trajectory();
    let phase = &mut trajectory.phases[0];
    let mut segments = phase.control.segments().to_vec();
    let basis = apsides_basis::Gauss::new(4).unwrap();
    segments[0] = Segment {
        basis: std::sync::Arc::new(apsides_basis::Barycentric::new(basis.nodes()).unwrap()),
        values: vec![0.0; 4],
    };
    phase.control = PiecewisePolynomial::new(1, phase.control.breaks().to_vec(), segments).unwrap();
    let error = write_trajectory(Vec::new(), &lander::ocp(), &trajectory).unwrap_err();
    assert_eq!(error.to_string(), "trajectory of phase `braking`: interval 0 has no node at its start");
}

/// A control may have a node at the end of its interval, where the next one starts.
#[test]
fn no_two_nodes_have_the_same_time() {
    let mut trajectory = lander::trajectory();
    let phase = &mut trajectory.phases[0];
    let nodes = apsides_basis::chebyshev_lobatto(6).unwrap();
    let closed = std::sync::Arc::new(apsides_basis::Barycentric::new(&nodes).unwrap());
    phase.control = phase.control.on(vec![closed; 4]).unwrap();
    phase.mesh = phase.mesh.clone().with_points(vec![6; 4]).unwrap();
    let times = |trajectory: &Trajectory| trajectory.phases[0].nodes().map(|n| n.0).collect::<Vec<_>>();
    assert!(times(&trajectory).windows(2).any(|w| w[0] == w[1]));
    trajectory.phases[0] = trajectory.phases[0].with_controls_at_state_nodes().unwrap();
    assert!(times(&trajectory).windows(2).all(|w| w[0] < w[1]));
    let (a, again) = (&trajectory.phases[0], read(&csv(&trajectory)).unwrap());
    for s in 0..50 {
        let t = a.time_at(f64::from(s) / 50.0);
        assert!(difference(&a.state, &again.phases[0].state, t) <= ROUNDING);
        assert!(difference(&a.control, &again.phases[0].control, t) <= ROUNDING);
    }
}
