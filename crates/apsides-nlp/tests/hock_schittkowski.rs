//! Problems of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes (1981), with the optimal values
//! of the collection.

mod support;

use apsides_nlp::{Flow, InteriorPoint, IterationRecord, NlpSettings, SolveReport, Status};
use support::{Dense, INF, Jet};

fn log(record: &IterationRecord) -> Flow {
    if std::env::var_os("NLP_LOG").is_some() {
        eprintln!(
            "{:4}{} {:15.8e} {:9.2e} {:9.2e} {:5.1} {:9.2e} {:9.2e} {:8.2e} {:8.2e}{} {}",
            record.iteration,
            if record.restoration { 'r' } else { ' ' },
            record.objective,
            record.primal_infeasibility,
            record.dual_infeasibility,
            record.barrier.log10(),
            record.step_norm,
            record.regularisation,
            record.dual_step,
            record.primal_step,
            record.step_kind,
            record.line_search_trials
        );
    }
    Flow::Continue
}

fn solve<const N: usize, const M: usize>(problem: &Dense<N, M>) -> SolveReport {
    let mut problem = problem.clone();
    InteriorPoint::new(NlpSettings::default()).solve_observed(&mut problem, &mut log).unwrap()
}

fn hs71() -> Dense<4, 2> {
    Dense {
        start: [1.0, 5.0, 5.0, 1.0],
        lower: [1.0; 4],
        upper: [5.0; 4],
        constraint_lower: [25.0, 40.0],
        constraint_upper: [INF, 40.0],
        objective: |x| x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        constraints: |x| [x[0] * x[1] * x[2] * x[3], x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]],
    }
}

#[test]
fn problem_71() {
    let report = solve(&hs71());
    eprintln!("{report:?}");
    assert_eq!(report.status, Status::Optimal);
    assert!((report.objective - 17.0140173).abs() < 1e-7);
}
