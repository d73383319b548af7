//! Sparse problems with chain structure.

use apsides_nlp::{
    BarrierStrategy, Flow, InteriorPoint, IterationRecord, NlpSettings, Status, check_derivatives,
};

use crate::chain::VanDerPol;

/// Discretisation: two extrapolations of methods of second order.
const EXTRAPOLATED: f64 = 1e-4;

/// Solver: the same program with its unknowns in another order.
const SOLVER: f64 = 1e-9;

#[test]
fn derivatives_are_right() {
    let mut problem = VanDerPol { intervals: 4, with_stages: false };
    let x: Vec<f64> = (0..15).map(|i| 0.3 * f64::from(i * 7 % 11) - 1.0).collect();
    let report = check_derivatives(&mut problem, &x).unwrap();
    assert!(report.is_within(1e-8), "{report:?}");
}

#[test]
fn van_der_pol() {
    for barrier in [BarrierStrategy::Monotone, BarrierStrategy::Adaptive] {
        let settings = NlpSettings { barrier, ..NlpSettings::default() };
        let solve = |intervals, with_stages| {
            let mut problem = VanDerPol { intervals, with_stages };
            InteriorPoint::new(settings.clone())
                .solve_observed(&mut problem, &mut crate::support::log)
                .unwrap()
        };
        let [coarse, fine] = [solve(200, true), solve(400, true)];
        assert_eq!((coarse.status, fine.status), (Status::Optimal, Status::Optimal));
        // Richardson extrapolation of the second-order rule to the continuous optimum. Reference: single shooting with
        // piecewise constant control, Runge-Kutta 4 and SciPy's SLSQP, extrapolated from 80 and 160 intervals.
        let limit = (4.0 * fine.objective - coarse.objective) / 3.0;
        assert!((limit - 3.61517).abs() < EXTRAPOLATED, "{limit}");
        assert!(fine.counters.iterations <= 20, "{}", fine.counters.iterations);
        let other_order = solve(200, false);
        assert!((other_order.objective - coarse.objective).abs() < SOLVER);
        assert_eq!(other_order.counters.iterations, coarse.counters.iterations);
    }
}

#[test]
fn iterations_do_not_allocate() {
    // The same solve stopped after 3 and after 9 iterations allocates the same: six iterations allocate nothing.
    let count = |last: usize| {
        let mut problem = VanDerPol { intervals: 50, with_stages: true };
        let mut observer = |record: &IterationRecord| {
            if record.iteration >= last { Flow::Stop } else { Flow::Continue }
        };
        let solver = InteriorPoint::default();
        let info = allocation_counter::measure(|| {
            let report = solver.solve_observed(&mut problem, &mut observer).unwrap();
            assert_eq!((report.status, report.counters.iterations), (Status::Interrupted, last));
        });
        info.count_total
    };
    assert_eq!(count(3), count(9));
}
