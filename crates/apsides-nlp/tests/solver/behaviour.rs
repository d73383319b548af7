//! Hard, degenerate, infeasible and unbounded problems.

use apsides_nlp::*;

use crate::support::{Dense, INF, solve, solve_with};

#[test]
fn waechter_biegler_counterexample() {
    for start in [
        [-2.0, 1.0, 1.0],
        [-2.0, 3.0, 1.0],
        [-4.0, 1.0, 1.0],
        [-3.0, 1.0, 1.0],
        [-1.5, 1.0, 1.0],
        [-2.0, 0.1, 0.1],
        [0.0, 0.0, 0.0],
        [-10.0, 1.0, 1.0],
    ] {
        let problem = Dense {
            start,
            lower: [-INF, 0.0, 0.0],
            upper: [INF; 3],
            constraint_lower: [1.0, 0.5],
            constraint_upper: [1.0, 0.5],
            objective: |x| x[0],
            constraints: |x| [x[0] * x[0] - x[1], x[0] - x[2]],
        };
        for b in [BarrierStrategy::Monotone, BarrierStrategy::Adaptive] {
            let report = solve_with(&problem, &NlpSettings { barrier: b, ..Default::default() });
            println!(
                "{start:?} {b:?} {} {:?} {} {}",
                report.status, report.x, report.counters.iterations, report.counters.restorations
            );
        }
    }
}
