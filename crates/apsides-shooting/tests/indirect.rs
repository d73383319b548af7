//! Indirect shooting on problems with a known optimum.
#![allow(clippy::unwrap_used)]

use apsides_nlp::Status;
use apsides_ocp::{Bounds, Direction, Guess, Ocp};
use apsides_problems::find;
use apsides_radau::{Radau, RadauSolution};
use apsides_shooting::ShootingError;
use apsides_shooting::indirect::{
    ContinuationSettings, IndirectSettings, IndirectShooting, IndirectSolution, IndirectStart,
};
use apsides_verify::{Verdict, VerifySettings, verify};

/// Published: half a unit of the last digit that the source prints, or a few of them where it was computed with less.
const PUBLISHED: f64 = 1e-6;

/// Solver: the tolerance of both iterations on the costates, in the objective to second order.
const SOLVER: f64 = 1e-12;

/// The same costates at both ends of the only phase.
fn both(costates: Vec<f64>) -> [[Vec<f64>; 2]; 1] {
    [[costates.clone(), costates]]
}

fn collocation(name: &str) -> (Ocp, RadauSolution) {
    let case = find(name).unwrap().pose().unwrap();
    let solution = Radau::default().solve(&case.ocp, &case.guess).unwrap();
    (case.ocp, solution)
}

/// The optimum is reached to its declared tolerance and passes every check, those of the conditions included.
fn assert_verified(name: &str, ocp: &Ocp, solution: &IndirectSolution) {
    assert_eq!(solution.status, Status::Optimal, "{name}: correction {:.1e}", solution.correction);
    let trajectory = solution.trajectory.as_ref().unwrap();
    let optimum = find(name).unwrap().optimum;
    assert!(optimum.agrees_with(trajectory.objective), "{name}: {}", trajectory.objective);
    let certificate = verify(ocp, trajectory, &VerifySettings::default()).unwrap().certificate;
    let failed: Vec<_> = certificate.checks.iter().filter(|c| !c.passed).collect();
    assert!(certificate.verdict >= Verdict::Extremal, "{name}: {failed:?}");
    assert!(solution.exceeded.is_empty());
}

/// From the costates of a collocation in at most three iterations: smooth problems, controls at bounds, directions by a path
/// constraint, several phases, one switch.
#[test]
fn collocation_starts_shooting() {
    for (name, segments) in [
        ("lqr_scalar", 1),
        ("di_min_energy", 1),
        ("brachistochrone_dymos", 1),
        ("linear_tangent", 1),
        ("orbit_raising", 1),
        ("hypersensitive", 16),
        ("pvtol", 1),
        ("shuttle_reentry", 4),
        ("delta_iii", 4),
        ("van_der_pol", 4),
        ("rayleigh_path", 4),
        ("di_bang_bang", 1),
        ("moon_lander_soft", 1),
        ("catmix_arcs", 1),
    ] {
        let (ocp, start) = collocation(name);
        let solution = IndirectShooting::default().solve_from(&ocp, &start.trajectory, segments).unwrap();
        assert!(solution.iterations <= 3, "{name}: {} iterations", solution.iterations);
        assert_verified(name, &ocp, &solution);
    }
}

/// Minimum energy between rests: `u = 6 - 12 t`, `lambda = (12, 6 - 12 t)` with the sign of `dJ/dx` reversed; one iteration from any
/// costates, since the conditions are linear.
#[test]
fn linear_conditions_take_one_step() {
    let case = find("di_min_energy").unwrap().pose().unwrap();
    let start = IndirectStart::from_guess(&case.ocp, &case.guess, &both(vec![3.0, -7.0]), 2).unwrap();
    let solution = IndirectShooting::default().solve(&case.ocp, &start, &mut ()).unwrap();
    assert_eq!(solution.iterations, 1);
    assert_verified("di_min_energy", &case.ocp, &solution);
}

/// A free final time and a bang-bang control from costates of the right sign only.
#[test]
fn bang_bang_from_a_rough_start() {
    let case = find("di_bang_bang").unwrap().pose().unwrap();
    let start = IndirectStart::from_guess(&case.ocp, &case.guess, &both(vec![-0.5, -0.2]), 1).unwrap();
    let solution = IndirectShooting::default().solve(&case.ocp, &start, &mut ()).unwrap();
    assert_verified("di_bang_bang", &case.ocp, &solution);
    assert_eq!(solution.switches[0].len(), 1);
}

/// The landing with a smoothed thrust from a rough start, then sharp: the switch at 0.239259 (see the problem).
#[test]
fn smoothing_leads_to_the_switch() {
    let case = find("moon_lander_soft").unwrap().pose().unwrap();
    let start = IndirectStart::from_guess(&case.ocp, &case.guess, &both(vec![0.5, -1.0, 0.5]), 1).unwrap();
    let method = IndirectShooting::default();
    let continued =
        method.solve_smoothed(&case.ocp, &start, 1.0, &ContinuationSettings::default(), &mut ()).unwrap();
    for r in &continued.records {
        println!("{r:?}");
    }
    assert_verified("moon_lander_soft", &case.ocp, &continued.solution);
    let [switch] = continued.solution.switches[0][..] else { panic!("one switch") };
    assert!((switch.time - 0.239_259).abs() < PUBLISHED && switch.rises);
}

/// Linear tangent steering to heights from 5 to 15 from the solution at 5; the last one again from its own costates.
#[test]
fn a_family_is_followed() {
    let (ocp, start) = collocation("linear_tangent");
    let family = |s: f64| {
        let mut ocp = ocp.clone();
        ocp.phases[0].states[2].variable.bounds = Bounds::new(0.0, 20.0);
        ocp.phases[0].states[2].terminal = Bounds::fixed(5.0 + 10.0 * s);
        Ok::<_, ShootingError>(ocp)
    };
    let start = IndirectStart::from_trajectory(&start.trajectory, 1).unwrap();
    let method = IndirectShooting::default();
    let continued = method.follow(family, &start, &ContinuationSettings::default(), &mut ()).unwrap();
    assert!(continued.reached(), "{:?}", continued.records);
    let last = family(1.0).unwrap();
    let radau = Radau::default().solve(&last, &Guess::linear(&last)).unwrap();
    let time = continued.solution.trajectory.unwrap().objective;
    assert!(
        (time - radau.trajectory.objective).abs() < 1e3 * SOLVER,
        "{time} {}",
        radau.trajectory.objective
    );
}

/// An angle that is known to be that of a direction has the same solution as by Newton's method.
#[test]
fn directions_agree_with_newton() {
    let (mut ocp, start) = collocation("linear_tangent");
    let solve = |ocp: &Ocp| {
        IndirectShooting::default().solve_from(ocp, &start.trajectory, 1).unwrap().trajectory.unwrap()
    };
    let newton = solve(&ocp);
    ocp.phases[0].directions.push(Direction::InPlane { angle: 0 });
    let closed = solve(&ocp);
    assert!((closed.objective - newton.objective).abs() < SOLVER);
    for t in [0.0, 0.2, 0.5] {
        assert!((closed.phases[0].control_at(t)[0] - newton.phases[0].control_at(t)[0]).abs() < 1e3 * SOLVER);
    }
}

/// A wall that the method cannot see is named.
#[test]
fn state_constraints_are_reported() {
    let (ocp, start) = collocation("brachistochrone_wall");
    let solution = IndirectShooting::default().solve_from(&ocp, &start.trajectory, 1).unwrap();
    assert_eq!(solution.status, Status::Optimal);
    assert_eq!(solution.exceeded.len(), 1);
    assert_eq!(solution.exceeded[0].name, "depth below the wall");
    assert!(solution.exceeded[0].amount > 0.1);
}

/// A singular arc has no switching structure: no convergence, and no hang.
#[test]
fn singular_arcs_do_not_converge() {
    let (ocp, start) = collocation("di_singular_arc");
    let solution = IndirectShooting::default().solve_from(&ocp, &start.trajectory, 4).unwrap();
    assert!(!solution.status.is_success());
}

#[test]
fn ill_posed_requests_are_refused() {
    let case = find("di_min_energy").unwrap().pose().unwrap();
    let method = IndirectShooting::default();
    let good = IndirectStart::from_guess(&case.ocp, &case.guess, &both(vec![1.0, 1.0]), 1).unwrap();
    let refused = |start: &IndirectStart| method.solve(&case.ocp, start, &mut ()).unwrap_err().to_string();
    let mut bad = good.clone();
    bad.phases[0].costates[0][1] = f64::NAN;
    assert_eq!(refused(&bad), "start, phase `move`: every state, costate and control must be finite");
    let mut bad = good.clone();
    bad.phases[0].final_time = bad.phases[0].initial_time;
    assert_eq!(refused(&bad), "start, phase `move`: the end time must be after the start time");
    let mut bad = good.clone();
    bad.phases[0].states[1].pop();
    assert_eq!(refused(&bad), "phase `move`: expected 2 states, found 1");
    let none = IndirectStart::from_guess(&case.ocp, &case.guess, &both(vec![1.0, 1.0]), 0).unwrap_err();
    assert_eq!(none.to_string(), "setting `segments` is 0, allowed is at least 1");
    let settings = IndirectSettings { tolerance: f64::NAN, ..IndirectSettings::default() };
    let wrong = IndirectShooting { settings }.solve(&case.ocp, &good, &mut ()).unwrap_err();
    assert_eq!(wrong.to_string(), "setting `tolerance` is NaN, allowed is a positive number");
    let chain = find("hanging_chain").unwrap().pose().unwrap();
    let costates = both(vec![0.0; chain.ocp.phases[0].states.len()]);
    let start = IndirectStart::from_guess(&chain.ocp, &chain.guess, &costates, 1).unwrap();
    let bound = method.solve(&chain.ocp, &start, &mut ()).unwrap_err().to_string();
    assert!(bound.contains("a bound on the integral `length`"), "{bound}");
    // Without costates there is nothing to start from.
    let (_, solution) = collocation("di_min_energy");
    let mut trajectory = solution.trajectory;
    trajectory.phases[0].costate = None;
    let none = IndirectStart::from_trajectory(&trajectory, 1).unwrap_err().to_string();
    assert!(none.contains("no costates"), "{none}");
}

/// The singular arc of catmix starts with a switching function that is zero; the point that Newton's method finds with the control at a
/// bound throughout has switching functions of the wrong sign.
#[test]
fn wrong_levels_are_no_solution() {
    let (ocp, start) = collocation("catmix");
    let solution = IndirectShooting::default().solve_from(&ocp, &start.trajectory, 1).unwrap();
    assert!(!solution.status.is_success(), "{}", solution.status);
}
