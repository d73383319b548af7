//! The ends of searches, and their reports.

use crate::{methods, search, sphere, timeless};
use apsides_metaheuristics::{
    AntColonySettings, Convergence, Method, Run, Search, SearchSpace, Stagnation, StopReason,
};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Solver: what a search of 5000 evaluations leaves above the minimum.
const SOLVER: f64 = 1e-2;

fn space() -> SearchSpace {
    SearchSpace::cube(4, -5.0, 5.0).expect("a box")
}

#[test]
fn the_budget_is_met_exactly() {
    for (name, method) in methods() {
        for budget in [1, 7, 1000] {
            let calls = AtomicUsize::new(0);
            let counted = |x: &[f64]| {
                calls.fetch_add(1, Ordering::Relaxed);
                sphere(x)
            };
            let report = search(&method, budget).minimize(&space(), &counted).expect(name);
            assert_eq!(report.stop, StopReason::Budget, "{name}");
            assert_eq!((report.evaluations, calls.into_inner()), (budget, budget), "{name}");
            assert!(report.best.is_some(), "{name}");
            assert_eq!(report.history.last().map(|h| h.evaluations), Some(budget), "{name}");
        }
    }
}

#[test]
fn target_and_stagnation() {
    for (name, method) in methods() {
        let target = Search { target: Some(0.5), ..search(&method, 20_000) };
        let report = target.minimize(&space(), &sphere).expect(name);
        assert_eq!(report.stop, StopReason::Target, "{name}");
        assert!(report.evaluations < 20_000 && report.best.is_some_and(|b| b.evaluation.objective <= 0.5));

        let stagnation = Some(Stagnation { generations: 30, improvement: 0.0 });
        let flat = Search { stagnation, ..search(&method, 50_000) };
        let report = flat.minimize(&space(), &|_: &[f64]| 1.0).expect(name);
        assert_eq!((report.stop, report.generations), (StopReason::Stagnation, 31), "{name}");
    }
}

#[test]
fn small_improvements_count_in_sum() {
    // The best value falls by one in each generation of ten ants; less than 25 in any 20 generations.
    let calls = AtomicUsize::new(0);
    let falling = |_: &[f64]| -((calls.fetch_add(1, Ordering::Relaxed) / 10) as f64);
    let method = Method::AntColony(AntColonySettings { archive: 10, ..Default::default() });
    let run = |improvement| {
        calls.store(0, Ordering::Relaxed);
        let stagnation = Some(Stagnation { generations: 20, improvement });
        let search = Search { stagnation, ..search(&method, 1000) };
        search.minimize(&space(), &falling).expect("a report").stop
    };
    assert_eq!(run(15.0), StopReason::Budget);
    assert_eq!(run(25.0), StopReason::Stagnation);
}

#[test]
fn time_limit_and_observer() {
    let (_, method) = methods().swap_remove(0);
    let limited = Search { time_limit: Some(Duration::from_millis(5)), ..search(&method, usize::MAX) };
    let report = limited.minimize(&space(), &sphere).expect("a report");
    assert_eq!(report.stop, StopReason::TimeLimit);
    assert!(report.elapsed >= Duration::from_millis(5));

    let mut seen = Vec::new();
    let stopped = search(&method, 100_000).minimize_observed(&space(), &sphere, &mut |progress| {
        seen.push((progress.generation, progress.evaluations));
        if progress.generation == 5 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let report = stopped.expect("a report");
    assert_eq!((report.stop, report.generations), (StopReason::Stopped, 5));
    assert!(report.best.is_some());
    assert_eq!(seen, [(1, 100), (2, 200), (3, 300), (4, 400), (5, 500)]);
}

#[test]
fn a_stopped_search_goes_on_when_it_is_opened_again() {
    for (name, method) in methods() {
        let search = search(&method, 3000);
        let mut run = Run::new(&search, &space()).expect(name);
        let mut stop = |p: &apsides_metaheuristics::Progress<'_>| match p.generation {
            4 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        };
        assert_eq!(run.finish(&sphere, &mut stop).expect(name), StopReason::Stopped);
        assert_eq!(
            run.step(&sphere).expect(name),
            Some(StopReason::Stopped),
            "nothing happens after the end"
        );
        run.reopen();
        run.finish(&sphere, &mut |_| ControlFlow::Continue(())).expect(name);
        let whole = search.minimize(&space(), &sphere).expect(name);
        assert_eq!(timeless(run.report()), timeless(whole), "{name}");
    }
}

#[test]
fn a_colony_at_one_point_has_converged() {
    let method = Method::AntColony(AntColonySettings { archive: 10, evaporation: 0.3, ..Default::default() });
    let report = search(&method, 100_000).minimize(&space(), &sphere).expect("a report");
    assert_eq!(report.stop, StopReason::Converged(Convergence::Spread));
    assert!(report.evaluations < 100_000);
}

#[test]
fn start_points_are_in_the_first_generation() {
    for (name, method) in methods() {
        let start = vec![vec![1.0; 4], vec![0.3; 4]];
        let mut run = Run::new(&Search { start, ..search(&method, 1000) }, &space()).expect(name);
        run.step(&sphere).expect(name);
        assert_eq!(run.best().map(|b| b.evaluation.objective), Some(0.0), "{name}");
    }
}

#[test]
fn fixed_coordinates_stay() {
    let fixed = SearchSpace::new(vec![-1.0, 0.5, -1.0], vec![1.0, 0.5, 1.0]).expect("a box");
    let point = SearchSpace::cube(2, 0.5, 0.5).expect("a box");
    for (name, method) in methods() {
        let best = search(&method, 5000).minimize(&fixed, &sphere).expect(name).best.expect(name);
        assert!(best.x[1] == 0.5 && best.evaluation.objective < 0.04 + SOLVER, "{name}: {best:?}");
        let best = search(&method, 500).minimize(&point, &sphere).expect(name).best.expect(name);
        assert_eq!(best.x, [0.5, 0.5], "{name}");
    }
}
