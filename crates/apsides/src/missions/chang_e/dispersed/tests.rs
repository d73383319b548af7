//! Against an independent state-transition matrix and Monte Carlo run (SciPy DOP853 at 1e-12; central differences agree to 2.1e-10) of the
//! same braking.

use super::*;
use crate::montecarlo::MonteCarlo;
use crate::{Mission, Outcome};

fn planned() -> (Mission, Outcome) {
    let mission = Mission::load("chang-e-3-braking", &[]).unwrap();
    let plan = mission.solve(None, &mut ()).unwrap();
    (mission, plan)
}

fn sizes() -> Deviations {
    Deviations { position_m: [1000.0 / 3.0; 3], velocity_m_s: [1.0; 3], ..Deviations::default() }
}

#[test]
fn state_transition_matrix_and_its_blocks() {
    let (mission, plan) = planned();
    let braking = PlannedBraking::new(&mission.values, &plan.trajectory).unwrap();
    let phi = braking.transition().unwrap();
    // The reference's start and its matrix in inertial axes that are those of the Moon at the start, SI.
    for (found, expected) in braking.start.iter().zip([1418854.8176, -501777.6894, 897005.9694]) {
        assert!((found - expected).abs() < 20.0, "{found} {expected}");
    }
    let expected = [
        [
            1.060044692868389,
            -0.05001137702246374,
            0.11242878736877963,
            431.9276095113365,
            -6.5742573198035,
            16.313486291830586,
        ],
        [
            -0.05001029799253294,
            0.9362805217525154,
            -0.039749292393834464,
            -6.574166058168446,
            415.6535616008648,
            -5.766407947529039,
        ],
        [
            0.11346573236280964,
            -0.04011679193768387,
            1.010397858952345,
            16.378438571974254,
            -5.789449212036095,
            427.86565779211145,
        ],
        [
            0.0002574020783106948,
            -0.00022503436404220192,
            0.0005454800632742222,
            1.043472772291393,
            -0.044344200081248814,
            0.1175116364566919,
        ],
    ];
    // The optimum is flat, so that the two plans differ by metres.
    for (i, row) in expected.iter().enumerate() {
        for (j, e) in row.iter().enumerate() {
            let size = [[1.0, 430.0], [8e-4, 1.0]][i / 3][j / 3];
            assert!((phi[i * N + j] - e).abs() < 2e-5 * size, "{i} {j}: {} {e}", phi[i * N + j]);
        }
    }
    // Against central differences of flights, relative to the size of each block.
    let zero = Deviations::default();
    let end = |x: [f64; N]| {
        let system = braking.open_loop(zero.thrust, zero.exhaust_velocity);
        let mut integrator = Integrator::new(N, OdeSettings::with_tolerance(1e-13)).unwrap();
        let mut x = x;
        for (from, to) in braking.legs() {
            let start = x;
            integrator.integrate(&system, from, &start, to, &mut x).unwrap();
        }
        x
    };
    for j in 0..6 {
        let h = if j < 3 { 2000.0 } else { 2.0 };
        let moved = |s: f64| {
            let mut x = braking.start;
            x[j] += s * h;
            end(x)
        };
        let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(moved);
        for i in 0..6 {
            let slope = (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h);
            let size = [[1.1685, 448.687], [8.17e-4, 1.1703]][i / 3][j / 3];
            assert!((phi[i * N + j] - slope).abs() < 1e-8 * size, "{i} {j}: {} {slope}", phi[i * N + j]);
        }
    }
}

#[test]
fn linear_spreads_are_those_of_the_reference() {
    let (mission, plan) = planned();
    let braking = PlannedBraking::new(&mission.values, &plan.trajectory).unwrap();
    let sigmas = braking.linear_sigmas(&sizes());
    let expected = [593.305, 515.666, 514.392, 1.201_086, 0.927_618, 0.926_647];
    for (found, expected) in sigmas.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-4, "{sigmas:?}");
    }
}

#[test]
fn an_undisturbed_flight_ends_as_planned() {
    let (mission, plan) = planned();
    let braking = PlannedBraking::new(&mission.values, &plan.trajectory).unwrap();
    let none = Deviations::default();
    for guidance in [Guidance::OpenLoop, Guidance::Replanned] {
        let results = braking.fly(&none, guidance).unwrap();
        assert!(results[..3].iter().all(|m| m.abs() < 1e-3), "{guidance:?} {results:?}");
        assert!((results[7] - 1_345.830_856).abs() < 1e-5);
    }
}

#[test]
fn samples_are_the_same_for_any_number_of_threads_and_when_continued() {
    let (mission, plan) = planned();
    let run = |samples, threads, done| {
        let dispersions = sizes();
        let run = MonteCarlo { samples, seed: 3, threads, dispersions, guidance: Guidance::OpenLoop };
        run.run(&mission, &plan, done, |_| true).unwrap()
    };
    let (alone, statistics) = run(60, 1, Vec::new());
    let (first, _) = run(25, 2, Vec::new());
    let (continued, same) = run(60, 3, first);
    assert_eq!((alone, statistics), (continued, same));
}

#[test]
fn every_deviating_start_is_replanned_to_the_site() {
    let (mission, plan) = planned();
    let dispersions = sizes();
    let run = MonteCarlo { samples: 12, seed: 1, threads: 2, dispersions, guidance: Guidance::Replanned };
    let (_, statistics) = run.run(&mission, &plan, Vec::new(), |_| true).unwrap();
    assert_eq!((statistics.failed, statistics.within_1_m), (0, Some(1.0)));
    let mass = statistics.spreads.iter().find(|s| s.name == "final_mass_kg").unwrap();
    // The reference has 0.46 kg over 150 flights.
    assert!((0.2..0.8).contains(&mass.sigma), "{mass:?}");
}
