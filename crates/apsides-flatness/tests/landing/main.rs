//! Planar lunar landing with constant thrust: the 31-variable problem of Naghash and Jamilnia 2017, refined splines, and what
//! re-simulation says of both.
//!
//! Reference flight times: indirect shooting (DOP853, 1e-13) of the same equations and constants, which an independent
//! collocation with 10 x 5 Radau points meets to 1e-9 s.
#![allow(clippy::unwrap_used)]

mod lander;

use apsides_flatness::{
    Breaks, Flatness, FlatnessError, FlatnessSettings, FlatnessSolution, Placement, SplineSettings,
};
use apsides_nlp::Status;
use apsides_verify::{Verdict, VerifySettings, verify};

use lander::{Lander, Landing};

fn method(order: usize, points: usize, placement: Placement, refine: bool) -> Flatness {
    let spline = SplineSettings { order, breaks: Breaks::Uniform(10), points, placement, refine };
    Flatness { settings: FlatnessSettings { spline, ..FlatnessSettings::default() } }
}

fn solve(landing: &Landing, method: &Flatness) -> FlatnessSolution {
    let (ocp, guess) = landing.pose();
    method.solve(&ocp, &[landing.system()], &guess).unwrap()
}

#[test]
fn explore() {
    for altitude in [15e3, 100e3, 5e3] {
    let landing = if altitude == 100e3 { Landing::from_orbit() } else { Landing::from_perilune(altitude) };
    let truth = if altitude == 100e3 { 1037.2005909330594 } else if altitude == 5e3 { 993.5748653764407 } else { 997.3758488117479 };
    for (order, points, placement, refine) in [
        (6, 15, Placement::Uniform, false),
        (6, 15, Placement::Gauss, false),
        (6, 15, Placement::Greville, false),
        (6, 15, Placement::Lobatto, false),
        (6, 15, Placement::Chebyshev, false),
        (6, 2, Placement::GaussPerSegment, false),
        (6, 15, Placement::Uniform, true),
        (6, 15, Placement::Gauss, true),
        (8, 17, Placement::Gauss, true),
    ] {
        let s = solve(&landing, &method(order, points, placement, refine));
        println!("--- {altitude} {order} {points} {placement:?} {refine}: {} accurate {} error {:.2e} tf-true {:.3e}", s.status, s.accurate, s.error, s.trajectory.objective - truth);
        for r in &s.solves {
            println!("  order {} seg {} pts {} vars {} cons {} iters {} err {:.2e} obj {:.10} {} solve {:?} all {:?}", r.order, r.segments, r.points, r.variables, r.constraints, r.iterations, r.error, r.objective, r.status, r.solve_time, r.time);
        }
        let (ocp, _) = landing.pose();
        let c = verify(&ocp, &s.trajectory, &VerifySettings::default()).unwrap().certificate;
        println!("  {} pieces {}", c.verdict, s.trajectory.phases[0].mesh.intervals());
        for check in c.checks.iter().filter(|c| c.name.starts_with("re-sim")) {
            print!("    {} {:.3e} {}", check.name.split(" at").next().unwrap(), check.value, check.unit);
        }
        println!();
    }
    }
}
