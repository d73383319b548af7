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
    let truths = [(100e3, 1037.2005909330594), (50e3, 1012.291947788343), (25e3, 1001.3902427828095), (20e3, 999.3569839960355), (15e3, 997.3758488117479), (10e3, 995.4480792466301), (5e3, 993.5748653764407)];
    let uniform = |segments: usize, m: usize| Breaks::At { fractions: (0..=segments).map(|k| k as f64 / segments as f64).collect(), multiplicities: vec![m; segments - 1] };
        for (order, points, placement, breaks) in [(6, 15, Placement::Uniform, Breaks::Uniform(10)), (6, 15, Placement::Gauss, Breaks::Uniform(10)), (6, 15, Placement::Greville, Breaks::Uniform(10)), (6, 15, Placement::Lobatto, Breaks::Uniform(10)), (6, 15, Placement::Chebyshev, Breaks::Uniform(10)), (8, 17, Placement::Gauss, Breaks::Uniform(10)), (9, 17, Placement::Gauss, Breaks::Uniform(10)),
(6, 4, Placement::GaussPerSegment, Breaks::Collocation(4)) ] {
            for refine in [false, true] {
            print!("{order} {points} {placement:?}:");
            for (altitude, truth) in truths {
                let landing = if altitude == 100e3 { Landing::from_orbit() } else { Landing::from_perilune(altitude) };
                let mut m = method(order, points, placement, refine);
                m.settings.spline.breaks = breaks.clone();
                m.settings.nlp.max_iterations = 400;
                let s = solve(&landing, &m);
                let ok = if s.status.is_success() { "" } else { "!" };
                print!("  {}{:?} {:.4e}{}", ok, s.solves.iter().map(|s| s.iterations).collect::<Vec<_>>(), s.trajectory.objective - truth, if s.accurate {""} else {" inacc"});
            }
            println!();
        }}
}
