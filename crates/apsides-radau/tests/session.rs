//! Re-solves with other data from the last solution: the same optima as fresh solves, on the way that the change asks for.
#![allow(clippy::unwrap_used)]

use apsides_nlp::Status;
use apsides_ocp::{Bounds, Guess, Ocp};
use apsides_problems::{Case, find};
use apsides_radau::{Radau, RadauError, RadauSettings, Session};

/// Two meshes within the tolerance of the method: objectives relative.
const OBJECTIVE: f64 = 1e-7;
/// Closed forms.
const CLOSED_FORM: f64 = 1e-9;

fn pose(name: &str) -> Case {
    find(name).unwrap().pose().unwrap()
}

fn session_of(case: &Case) -> Session {
    let first = Radau::default().solve(&case.ocp, &case.guess).unwrap();
    assert!(first.status.is_success());
    Session::new(Radau::default(), first.trajectory)
}

type Change = fn(&mut Ocp, f64);

/// Problems with what changes in them: ends, bounds of controls and states, limits along the way.
const CHANGES: [(&str, Change); 6] = [
    ("moon_lander_soft", |o, by| o.phases[0].controls[0].bounds.upper *= by),
    ("di_bang_bang", |o, by| o.phases[0].controls[0].bounds = Bounds::new(-by, by)),
    ("bryson_denham", |o, by| o.phases[0].states[0].variable.bounds.upper *= by),
    ("orbit_raising", |o, by| o.phases[0].final_time = Bounds::fixed(3.32 * by)),
    ("shuttle_reentry", |o, by| o.phases[0].states[3].terminal = Bounds::fixed(2500.0 * by)),
    ("linear_tangent", |o, by| {
        let height = &mut o.phases[0].states[1].terminal;
        *height = Bounds::fixed(by * height.lower);
    }),
];

/// A session follows a path of changes there and back and finds what fresh solves find, in three Newton steps at most where the change is
/// one of a percent.
#[test]
fn small_changes_take_three_steps_and_end_where_fresh_solves_do() {
    for (name, change) in CHANGES {
        let case = pose(name);
        let mut session = session_of(&case);
        for (n, by) in [1.0, 1.01, 0.99, 1.0].into_iter().enumerate() {
            let mut ocp = case.ocp.clone();
            change(&mut ocp, by);
            let next = session.resolve(&ocp, &mut ()).unwrap();
            assert!(next.solution.status.is_success(), "{name} {by}");
            assert!(next.solution.accurate, "{name} {by}");
            let fresh = Radau::default().solve(&ocp, &case.guess).unwrap();
            let (a, b) = (next.solution.trajectory.objective, fresh.trajectory.objective);
            assert!(
                (a - b).abs() <= OBJECTIVE * b.abs(),
                "{name} {by}: {a} from the last solution, {b} afresh"
            );
            if n > 0 && next.followed {
                assert!(
                    next.solution.report.counters.iterations <= 4,
                    "{name} {by}: {:?}",
                    next.solution.report.counters
                );
            }
        }
    }
}

#[test]
fn every_small_change_of_a_bang_bang_is_one_of_its_active_set() {
    let case = pose("di_bang_bang");
    let mut session = session_of(&case);
    session.resolve(&case.ocp, &mut ()).unwrap();
    for by in [1.02, 1.05, 1.04] {
        let mut ocp = case.ocp.clone();
        ocp.phases[0].controls[0].bounds = Bounds::new(-by, by);
        let next = session.resolve(&ocp, &mut ()).unwrap();
        assert!(next.followed, "{by}");
        let fresh = Radau::default().solve(&ocp, &case.guess).unwrap().trajectory.objective;
        assert!((next.solution.trajectory.objective - fresh).abs() <= CLOSED_FORM, "{by}");
    }
}

/// A limit that appears where there was none has another structure: the mesh is refined for it.
#[test]
fn a_change_beyond_the_mesh_is_refined() {
    let Case { ocp, guess } = pose("bryson_denham");
    let mut free = ocp.clone();
    free.phases[0].states[0].variable.bounds.upper = 0.3;
    let mut session = session_of(&Case { ocp: free, guess });
    let next = session.resolve(&ocp, &mut ()).unwrap();
    assert!(next.solution.accurate);
    // 4 / (9 l) at l = 1 / 9: A. Bryson, Y.-C. Ho, Applied Optimal Control, Taylor and Francis 1975, section 3.11.
    assert!((next.solution.trajectory.objective - 4.0).abs() <= CLOSED_FORM);
}

/// Less thrust than weight lands nothing, and leaves the last solution as it was, from which the next solve goes on.
#[test]
fn an_infeasible_change_is_survived() {
    let case = pose("moon_lander_soft");
    let mut session = session_of(&case);
    let before = session.resolve(&case.ocp, &mut ()).unwrap().solution.trajectory.objective;
    let mut ocp = case.ocp.clone();
    ocp.phases[0].controls[0].bounds.upper = 0.3;
    let next = session.resolve(&ocp, &mut ()).unwrap();
    assert_eq!(next.solution.status, Status::Infeasible);
    let back = session.resolve(&case.ocp, &mut ()).unwrap();
    assert!(back.followed);
    assert!((back.solution.trajectory.objective - before).abs() <= CLOSED_FORM);
}

#[test]
fn another_problem_and_bad_settings_are_refused() {
    let case = pose("di_bang_bang");
    let first = Radau::default().solve(&case.ocp, &case.guess).unwrap();
    let mut session = Session::new(Radau::default(), first.trajectory.clone());
    let other = pose("shuttle_reentry").ocp;
    assert!(matches!(session.resolve(&other, &mut ()), Err(RadauError::Problem(_))));
    let settings = RadauSettings { tolerance: f64::NAN, ..RadauSettings::default() };
    let mut session = Session::new(Radau { settings }, first.trajectory);
    assert!(session.resolve(&case.ocp, &mut ()).is_err());
}

/// Problems that are solved in another form go through a solve from the last solution.
#[test]
fn a_magnitude_in_the_cost_is_solved_in_its_own_form() {
    let case = pose("free_flying_robot");
    let guess = Guess::linear(&case.ocp);
    assert!(guess.check(&case.ocp).is_ok());
    let settings = RadauSettings { max_refinements: 1, ..RadauSettings::default() };
    let radau = Radau { settings };
    let first = radau.solve(&case.ocp, &case.guess).unwrap();
    let mut session = Session::new(radau, first.trajectory);
    let next = session.resolve(&case.ocp, &mut ()).unwrap();
    assert!(next.solution.status.is_success());
}
