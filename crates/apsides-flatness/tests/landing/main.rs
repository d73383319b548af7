//! Planar lunar landings with constant thrust: the 31-variable problem of Jamilnia 2017, refined splines, and what
//! re-simulation says of both.
//!
//! Reference flight times: indirect shooting (DOP853, 1e-13) of the same equations and constants, which an independent
//! collocation with 10 x 5 Radau points meets to 1e-9 s (one phase) and 2e-8 s (two phases). Differences of the coarse problems:
//! the same problems in CasADi and Ipopt.
#![allow(clippy::unwrap_used)]

mod lander;
mod refusals;
mod vertical;

use std::f64::consts::FRAC_PI_2;

use apsides_ad::FlatMap;
use apsides_flatness::{
    BoundRows, Breaks, FlatSystem, Flatness, FlatnessSettings, FlatnessSolution, Placement, SplineSettings,
};
use apsides_nlp::Status;
use apsides_ocp::{Bounds, Ocp};
use apsides_verify::{Certificate, Verdict, VerifySettings, verify};

use lander::{Landing, WithMass};

/// Flight time of a refined landing, s: objective tolerance of the method times the flight time.
pub(crate) const MESH_TIME_S: f64 = 1e-6;
/// Miss of the re-simulation of a refined landing, m.
pub(crate) const MESH_MISS_M: f64 = 1e-3;
/// Interpolation of states and controls, relative: 1e-12 and rounding.
const INTERPOLATION: f64 = 1e-11;
/// Half a unit of the last digit printed for the coarse problems, s.
const PUBLISHED_S: f64 = 5e-5;

/// Altitude of the start (100 km: the parking orbit itself), optimum, difference of the uniform and of the Gauss problem, s.
const CASES: [(f64, f64, f64, f64); 7] = [
    (100e3, 1037.2005909330594, -0.3277, -0.0004),
    (50e3, 1012.291947788343, -0.2508, -0.0007),
    (25e3, 1001.3902427828095, -0.2125, -0.0008),
    (20e3, 999.3569839960355, -0.2053, -0.0008),
    (15e3, 997.3758488117479, -0.1983, -0.0008),
    (10e3, 995.4480792466301, -0.1917, -0.0008),
    (5e3, 993.5748653764407, -0.1853, -0.0009),
];

/// Half a unit of the last digit printed for a miss of the coarse problem, m.
const PUBLISHED_MISS_M: f64 = 0.05;

/// The same for speeds, m/s.
const PUBLISHED_MISS_M_S: f64 = 0.005;

/// Differences of flight times, s: both figures have an error of half a unit of the last digit, and that of the
/// solver.
const PLACED_S: f64 = 1.1e-4;

/// Final mass of a refined landing, kg: objective tolerance of the method times the mass.
const MESH_MASS_KG: f64 = 1e-6;

fn landing(altitude: f64) -> Landing {
    if altitude == 100e3 { Landing::from_orbit() } else { Landing::from_perilune(altitude) }
}

pub(crate) fn method(order: usize, points: usize, placement: Placement, refine: bool) -> Flatness {
    let order = Some(order);
    let spline = SplineSettings { order, breaks: Breaks::Uniform(10), points, placement, refine };
    Flatness { settings: FlatnessSettings { spline, ..FlatnessSettings::default() } }
}

fn solve(landing: &Landing, method: &Flatness) -> (FlatnessSolution, Certificate) {
    let (ocp, guess) = landing.pose();
    let solution = method.solve(&ocp, &[landing.system()], &guess).unwrap();
    let certificate = certificate(&ocp, &solution);
    (solution, certificate)
}

pub(crate) fn certificate(ocp: &Ocp, solution: &FlatnessSolution) -> Certificate {
    verify(ocp, &solution.trajectory, &VerifySettings::default()).unwrap().certificate
}

/// Miss of a re-simulated state at the end, in its unit.
pub(crate) fn miss(certificate: &Certificate, state: &str) -> f64 {
    let begin = format!("re-simulated {state} at the end");
    certificate.checks.iter().find(|c| c.name.starts_with(&begin)).map(|c| c.value).unwrap()
}

#[test]
fn the_paper_problem_is_solved_and_rejected() {
    let (solution, certificate) = solve(&landing(15e3), &method(6, 15, Placement::Uniform, false));
    let last = &solution.solves[0];
    assert_eq!(
        (last.counters.variables, last.counters.constraints, last.segments, last.points),
        (31, 22, 10, 15)
    );
    assert_eq!(solution.solves.len(), 1);
    assert_eq!(solution.status, Status::Optimal);
    assert!(!solution.accurate && solution.error > 1e-4, "{}", solution.error);
    // Re-simulation with beta by atan2 and 440 N: 15.6 m, 0.75 m/s, -0.90 m/s.
    assert_eq!(certificate.verdict, Verdict::Rejected);
    assert!((miss(&certificate, "radius") - 15.6).abs() < PUBLISHED_MISS_M);
    assert!((miss(&certificate, "horizontal speed") - 0.75).abs() < PUBLISHED_MISS_M_S);
    assert!((miss(&certificate, "radial speed") - 0.90).abs() < PUBLISHED_MISS_M_S);
}

#[test]
fn coarse_problems_of_all_rows() {
    for (altitude, optimum, uniform, gauss) in CASES {
        for (placement, difference) in [(Placement::Uniform, uniform), (Placement::Gauss, gauss)] {
            let (solution, certificate) = solve(&landing(altitude), &method(6, 15, placement, false));
            let found = solution.trajectory.objective - optimum;
            assert!((found - difference).abs() < PUBLISHED_S, "{altitude} {placement:?}: {found}");
            assert!(solution.status.is_success() && !solution.accurate);
            assert_eq!(certificate.verdict, Verdict::Rejected);
        }
    }
}

/// CasADi and Ipopt at 15 km: miss of 0.33 m with Gauss points, 0.54 m with Greville abscissae; 0.27 to 1.3 m with Lobatto and
/// Chebyshev points at the seven altitudes.
#[test]
fn placements() {
    for (placement, time, radius) in [
        (Placement::Gauss, -0.0008, 0.325..0.335),
        (Placement::Greville, -0.0017, 0.535..0.545),
        (Placement::Lobatto, -0.0010, 0.27..1.3),
        (Placement::Chebyshev, -0.0009, 0.26..1.3),
    ] {
        let (solution, certificate) = solve(&landing(15e3), &method(6, 15, placement, false));
        let found = solution.trajectory.objective - 997.3758488117479;
        assert!((found - time).abs() < PLACED_S, "{placement:?}: {found}");
        let miss = miss(&certificate, "radius");
        assert!(radius.contains(&miss), "{placement:?}: {miss}");
    }
}

#[test]
fn refined_splines_meet_the_optimum() {
    for (altitude, optimum, ..) in CASES {
        for method in [Flatness::default(), method(6, 15, Placement::Uniform, true)] {
            let (solution, certificate) = solve(&landing(altitude), &method);
            assert!(solution.status.is_success() && solution.accurate, "{altitude}: {:?}", solution.solves);
            let difference = solution.trajectory.objective - optimum;
            assert!(difference.abs() < MESH_TIME_S, "{altitude}: {difference}");
            // Costates from the adjoint equation along the splines.
            assert!(certificate.is_verified(), "{certificate:#?}");
            assert!(miss(&certificate, "radius") < MESH_MISS_M);
        }
    }
}

/// Not flat in radius and angle alone: the mass as an output of its own, with what remains of its equation as a residual.
#[test]
fn mass_as_an_output_with_a_residual() {
    let landing = landing(15e3);
    let (ocp, guess) = landing.pose();
    let system = FlatSystem::new(WithMass(landing.flight));
    assert_eq!((system.outputs, system.residuals, &system.highest[..]), (3, 2, &[2, 2, 1][..]));
    let solution = Flatness::default().solve(&ocp, &[system], &guess).unwrap();
    assert!(solution.accurate, "{:?}", solution.solves);
    assert!((solution.trajectory.objective - 997.3758488117479).abs() < MESH_TIME_S);
    let certificate = certificate(&ocp, &solution);
    assert!(certificate.is_verified(), "{certificate:#?}");
    assert!(miss(&certificate, "radius") < MESH_MISS_M);
    // 153.736491 kg; the outputs have orders s + 2, s + 2, s + 1.
    assert!((solution.trajectory.phases[0].final_state()[4] - 153.73649062922414).abs() < MESH_MASS_KG);
    let orders: Vec<usize> = solution.splines[0].bases.iter().map(apsides_basis::Bspline::order).collect();
    assert_eq!((orders[0], orders[1]), (orders[2] + 1, orders[2] + 1));
}

/// Bounds that the landing does not touch need no row, and one that it touches gets its rows.
#[test]
fn bounds_where_exceeded() {
    let mut method = method(6, 15, Placement::Uniform, false);
    method.settings.bounds = BoundRows::WhereExceeded;
    let surface = landing(15e3).flight.body.radius;
    let bound = |ocp: &mut Ocp, ceiling: f64| {
        let wide = [(surface, ceiling), (0.0, 3.2), (-300.0, 3e3), (-3e3, 3e3), (60.0, 300.0)];
        for (state, (lower, upper)) in ocp.phases[0].states.iter_mut().zip(wide) {
            state.variable.bounds = Bounds::new(lower, upper);
        }
        ocp.phases[0].controls[0].bounds = Bounds::new(-FRAC_PI_2, 3.0 * FRAC_PI_2);
    };
    for (altitude, ..) in CASES {
        let landing = landing(altitude);
        let (mut ocp, guess) = landing.pose();
        bound(&mut ocp, surface + 150e3);
        let solution = method.solve(&ocp, &[landing.system()], &guess).unwrap();
        assert_eq!(solution.solves.len(), 1, "{altitude}: {:?}", solution.solves);
        assert_eq!(
            (solution.solves[0].counters.variables, solution.solves[0].counters.constraints),
            (31, 22)
        );
    }
    // The unbounded flight rises to 21.0 km.
    let landing = landing(15e3);
    let (mut ocp, guess) = landing.pose();
    bound(&mut ocp, surface + 18e3);
    let solution = method.solve(&ocp, &[landing.system()], &guess).unwrap();
    let rows: Vec<usize> = solution.solves.iter().map(|s| s.counters.constraints).collect();
    // The 13 inner points; the ends are fixed.
    assert_eq!(rows, [22, 35]);
    assert!(solution.status.is_success());
}

/// States and controls of the trajectory are those of the splines.
#[test]
fn the_trajectory_follows_the_splines() {
    let (solution, _) = solve(&landing(15e3), &method(6, 15, Placement::Uniform, false));
    let (phase, splines) = (&solution.trajectory.phases[0], &solution.splines[0]);
    let duration = phase.final_time - phase.initial_time;
    for k in 0..=997 {
        let fraction = f64::from(k) / 997.0;
        let jet = |output: usize| {
            [0, 1, 2].map(|d| {
                let mut y = [0.0];
                splines.bases[output].evaluate(&splines.coefficients[output], d, fraction, &mut y);
                y[0] / duration.powi(d as i32)
            })
        };
        let t = phase.time_at(fraction);
        let (x, u, _) = landing(15e3).flat().evaluate(t, &[jet(0), jet(1)], &[]);
        let sizes = [1.7e6, 0.5, 1.7e3, 100.0, 300.0];
        for ((a, b), size) in phase.state_at(t).iter().zip(x).zip(sizes) {
            assert!((a - b).abs() < INTERPOLATION * size, "{t}: {a} {b}");
        }
        assert!((phase.control_at(t)[0] - u[0]).abs() < INTERPOLATION * 3.0, "{t}");
    }
}
