//! Problems of the gallery by successive convexification, several phases, and what has no solution.

use apsides_ad::{Dynamics, Scalar};
use apsides_convex::{ConvexError, SuccessiveConvexification, SuccessiveSettings, SuccessiveSolution};
use apsides_iteration::Status;
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpError, Phase, State, Variable};

/// Solver: the tolerances at which the iterations stop.
const SOLVER: f64 = 1e-6;

/// Discretisation: two polynomials against the cycloid, s.
const CYCLOID_S: f64 = 1e-5;

/// Discretisation: least time of a cart with a switch between nodes, s.
const CART_S: f64 = 2e-3;

fn solve(ocp: &Ocp, guess: &Guess, settings: SuccessiveSettings) -> SuccessiveSolution {
    SuccessiveConvexification { settings }.solve(ocp, guess).expect("well-posed")
}

/// Solves a problem of the gallery and returns the relative difference from its optimum.
fn difference(name: &str, intervals: usize, most_iterations: usize) -> f64 {
    let problem = apsides_problems::find(name).expect("in the gallery");
    let case = problem.pose().expect("well-posed");
    let settings =
        SuccessiveSettings { intervals, max_iterations: most_iterations, ..SuccessiveSettings::default() };
    let s = solve(&case.ocp, &case.guess, settings);
    assert_eq!(s.status, Status::Optimal, "{name}");
    assert!(s.violation < SOLVER, "{name}: {:e}", s.violation);
    problem.optimum.relative_difference(s.trajectory.objective)
}

#[test]
fn smooth_problems_of_the_gallery_reach_their_optimum() {
    for (name, tolerance, iterations) in [
        ("brachistochrone_free_y", 1e-6, 40),
        ("brachistochrone_dymos", 1e-6, 30),
        ("linear_tangent", 1e-6, 30),
        ("di_min_energy", 1e-6, 30),
        ("lqr_scalar", 1e-6, 30),
    ] {
        let d = difference(name, 40, iterations);
        assert!(d.abs() < tolerance, "{name}: {d:e}");
    }
}

#[test]
fn jumps_and_contacts_are_met_to_the_length_of_an_interval() {
    // Linear controls cannot jump: the cost of a ramp over one interval; a state bound holds at the nodes only.
    for (name, intervals, tolerance, iterations) in [
        ("moon_lander_soft", 40, 1e-4, 30),
        ("bryson_denham", 40, 1e-4, 30),
        ("powered_descent", 40, 3e-4, 80),
        ("powered_descent_glide_slope", 40, 3e-4, 80),
    ] {
        let d = difference(name, intervals, iterations);
        assert!(d.abs() < tolerance, "{name}: {d:e}");
    }
    // Strongly nonlinear equations, mixed constraints, singular arcs.
    for (name, tolerance, iterations) in [
        ("cart_pole", 1e-3, 200),
        ("pvtol", 1e-4, 200),
        ("van_der_pol", 2e-4, 40),
        ("rayleigh_path", 1e-3, 80),
        ("brachistochrone_wall", 1e-5, 40),
        ("free_flying_robot", 2e-2, 40),
        ("di_singular_arc", 1e-4, 120),
        ("catmix", 1e-4, 200),
        ("goddard_cops", 1e-4, 80),
    ] {
        let d = difference(name, 40, iterations);
        assert!(d.abs() < tolerance, "{name}: {d:e}");
    }
    let (coarse, fine) = (difference("moon_lander_soft", 20, 40), difference("moon_lander_soft", 80, 40));
    assert!(fine.abs() < 0.3 * coarse.abs(), "{coarse:e} {fine:e}");
}

struct Slide;

impl Dynamics<3, 1> for Slide {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
        let (sin, cos) = u[0].sin_cos();
        [x[2] * sin, x[2] * cos, cos * 9.80665]
    }
}

fn slide(name: &str) -> Phase {
    Phase::new(name, Slide)
        .states([
            State::new("x", "m").within(0.0, 20.0),
            State::new("depth", "m").within(0.0, 20.0),
            State::new("speed", "m/s").within(0.0, 30.0),
        ])
        .controls([Variable::new("angle", "rad").within(0.0, 3.2)])
        .initial_time(Bounds::new(0.0, 10.0))
        .final_time(Bounds::new(0.1, 10.0))
}

#[test]
fn two_linked_phases_are_one_flight() {
    let mut upper = slide("upper").initial_time(Bounds::fixed(0.0));
    let mut lower = slide("lower");
    for (k, start) in [0.0, 0.0, 0.0].into_iter().enumerate() {
        upper.states[k].initial = Bounds::fixed(start);
    }
    // The cycloid passes through any of its own points; the depth of the joint is chosen, its place and time are free.
    upper.states[1].terminal = Bounds::fixed(4.0);
    lower.states[0].terminal = Bounds::fixed(10.0);
    lower.states[1].terminal = Bounds::fixed(5.0);
    let ocp = Ocp::builder("brachistochrone in two phases")
        .phase(upper)
        .phase(lower)
        .link("upper", "lower")
        .minimize("time", "s", At::FinalTime("lower"))
        .build()
        .unwrap();
    let mut guess = Guess::linear(&ocp);
    let samples = |t: [f64; 2], from: [f64; 3], to: [f64; 3]| {
        let controls = vec![vec![1.0], vec![1.0]];
        apsides_ocp::PhaseGuess::samples(&t, vec![from.into(), to.into()], controls).unwrap()
    };
    guess.phases = vec![
        samples([0.0, 1.0], [0.0, 0.0, 0.0], [4.0, 4.0, 8.0]),
        samples([1.0, 2.0], [4.0, 4.0, 8.0], [10.0, 5.0, 9.0]),
    ];
    let s = solve(&ocp, &guess, SuccessiveSettings::default());
    assert_eq!(s.status, Status::Optimal);
    // The cycloid through (10, 5): x = r (a - sin a), depth = r (1 - cos a), time a sqrt(r / g).
    assert!((s.trajectory.objective - 1.801_603_1).abs() < CYCLOID_S, "{}", s.trajectory.objective);
    let [a, b] = [&s.trajectory.phases[0], &s.trajectory.phases[1]];
    assert!((a.final_time - b.initial_time).abs() < SOLVER);
    let (end, start) = (a.final_state(), b.state_at(b.initial_time));
    assert!(end.iter().zip(&start).all(|(e, s)| (e - s).abs() < 100.0 * SOLVER));
}

struct Cart;

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

fn cart(time: f64) -> Ocp {
    let phase = Phase::new("push", Cart)
        .states([
            State::new("position", "m").within(-5.0, 5.0).starts_at(0.0).ends_at(1.0),
            State::new("speed", "m/s").within(-5.0, 5.0).starts_at(0.0).ends_at(0.0),
        ])
        .controls([Variable::new("acceleration", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.1, time));
    Ocp::builder("cart")
        .phase(phase)
        .minimize("time", "s", At::FinalTime("push"))
        .build()
        .expect("well-posed")
}

#[test]
fn what_has_no_solution_is_named_with_its_amount() {
    // From rest to rest over 1 m with 1 m/s2 takes 2 s.
    let ocp = cart(4.0);
    let s = solve(&ocp, &Guess::linear(&ocp), SuccessiveSettings::default());
    assert_eq!(s.status, Status::Optimal);
    assert!((s.trajectory.objective - 2.0).abs() < CART_S);
    let ocp = cart(1.5);
    let s = solve(&ocp, &Guess::linear(&ocp), SuccessiveSettings::default());
    assert_eq!(s.status, Status::Infeasible);
    let unmet = s.unmet.unwrap();
    assert!(unmet.origin.name.starts_with("equation of motion"), "{unmet}");
    assert_eq!(unmet.origin.phase.as_deref(), Some("push"));
    assert!(unmet.amount.abs() > 1e-3, "{unmet}");
}

#[test]
fn the_limit_of_iterations_is_a_status() {
    let ocp = cart(4.0);
    let settings = SuccessiveSettings { max_iterations: 2, ..SuccessiveSettings::default() };
    let s = solve(&ocp, &Guess::linear(&ocp), settings);
    assert_eq!((s.status, s.records.len()), (Status::IterationLimit, 2));
}

#[test]
fn ill_posed_requests_are_refused_by_name() {
    let ocp = cart(4.0);
    let guess = Guess::linear(&ocp);
    let default = SuccessiveSettings::default();
    for (settings, what) in [
        (SuccessiveSettings { intervals: 0, ..default }, "number of intervals"),
        (SuccessiveSettings { max_iterations: 0, ..default }, "limit of iterations"),
        (SuccessiveSettings { penalty: f64::NAN, ..default }, "penalty"),
        (SuccessiveSettings { proximal_weight: 0.0, ..default }, "proximal weight"),
        (SuccessiveSettings { integration_tolerance: -1.0, ..default }, "integration tolerance"),
    ] {
        let e = SuccessiveConvexification { settings }.solve(&ocp, &guess).unwrap_err();
        assert!(matches!(&e, ConvexError::Value { what: w, .. } if *w == what), "{e}");
    }
    let empty = Guess { phases: Vec::new(), ..guess };
    let e = SuccessiveConvexification::default().solve(&ocp, &empty).unwrap_err();
    assert!(matches!(e, ConvexError::Ocp(OcpError::Guess { .. })));
}
