//! Problems of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (1981, doi
//! 10.1007/978-3-642-48320-2), by their number, with the optimal values of the collection.

use apsides_nlp::{BarrierOracle, BarrierStrategy, NlpSettings, Status};

use crate::support::{Dense, INF, solve_with};

fn strategies() -> [NlpSettings; 4] {
    let adaptive = |barrier_oracle| NlpSettings {
        barrier: BarrierStrategy::Adaptive,
        barrier_oracle,
        ..NlpSettings::default()
    };
    [
        NlpSettings::default(),
        adaptive(BarrierOracle::QualityFunction),
        adaptive(BarrierOracle::Probing),
        adaptive(BarrierOracle::Loqo),
    ]
}

/// Solves by every barrier strategy; the monotone one within `iterations`.
fn assert_optimum<const N: usize, const M: usize>(
    problem: &Dense<N, M>,
    optimum: f64,
    tolerance: f64,
    iterations: usize,
) {
    for settings in strategies() {
        let report = solve_with(problem, &settings);
        let strategy = (settings.barrier, settings.barrier_oracle);
        assert_eq!(report.status, Status::Optimal, "{strategy:?}: f = {}", report.objective);
        let error = (report.objective - optimum).abs();
        assert!(error <= tolerance * optimum.abs().max(1.0), "{strategy:?}: f = {}", report.objective);
        if settings.barrier == BarrierStrategy::Monotone {
            assert!(report.counters.iterations <= iterations, "{} iterations", report.counters.iterations);
        }
    }
}

#[test]
fn problem_13() {
    // No constraint qualification holds at the solution (1, 0): multipliers grow without limit, so only the
    // neighbourhood of the optimum can be asked for.
    let problem = Dense {
        start: [-2.0, -2.0],
        lower: [0.0; 2],
        upper: [INF; 2],
        constraint_lower: [0.0],
        constraint_upper: [INF],
        objective: |x| (x[0] - 2.0).powi(2) + x[1].powi(2),
        constraints: |x| [(1.0 - x[0]).powi(3) - x[1]],
    };
    for settings in strategies() {
        let report = solve_with(&problem, &settings);
        assert!(report.status.is_success(), "{:?}: {}", settings.barrier, report.status);
        assert!((report.objective - 1.0).abs() < 2e-2, "f = {}", report.objective);
    }
}

#[test]
fn problem_15() {
    let problem = Dense {
        start: [-2.0, 1.0],
        lower: [-INF; 2],
        upper: [0.5, INF],
        constraint_lower: [1.0, 0.0],
        constraint_upper: [INF; 2],
        objective: |x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2),
        constraints: |x| [x[0] * x[1], x[0] + x[1] * x[1]],
    };
    assert_optimum(&problem, 306.5, 1e-8, 25);
}

#[test]
fn problem_26() {
    let problem = Dense {
        start: [-2.6, 2.0, 2.0],
        lower: [-INF; 3],
        upper: [INF; 3],
        constraint_lower: [3.0],
        constraint_upper: [3.0],
        objective: |x| (x[0] - x[1]).powi(2) + (x[1] - x[2]).powi(4),
        constraints: |x| [(1.0 + x[1] * x[1]) * x[0] + x[2].powi(4)],
    };
    assert_optimum(&problem, 0.0, 1e-8, 30);
}

#[test]
fn problem_46() {
    let problem = Dense {
        start: [0.5 * 2.0_f64.sqrt(), 1.75, 0.5, 2.0, 2.0],
        lower: [-INF; 5],
        upper: [INF; 5],
        constraint_lower: [1.0, 2.0],
        constraint_upper: [1.0, 2.0],
        objective: |x| {
            (x[0] - x[1]).powi(2) + (x[2] - 1.0).powi(2) + (x[3] - 1.0).powi(4) + (x[4] - 1.0).powi(6)
        },
        constraints: |x| [x[0] * x[0] * x[3] + (x[3] - x[4]).sin(), x[1] + x[2].powi(4) * x[3] * x[3]],
    };
    assert_optimum(&problem, 0.0, 1e-8, 30);
}
