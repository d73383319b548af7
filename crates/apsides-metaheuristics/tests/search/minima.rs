//! Known minima: free, constrained, noisy and failing.

use crate::{methods, rastrigin, search, sphere};
use apsides_metaheuristics::{
    Constraints, Evaluation, Generator, Method, Noise, Objective, Search, SearchSpace, StopReason,
};
use std::f64::consts::PI;

/// Solver: what a search of 10 000 evaluations leaves above the minimum where half of them fail.
const SOLVER: f64 = 1e-3;

#[test]
fn every_method_finds_the_minimum_of_a_sphere() {
    let space = SearchSpace::cube(6, -5.0, 4.0).expect("a box");
    for (name, method) in methods() {
        let report = search(&method, 20_000).minimize(&space, &sphere).expect(name);
        let best = report.best.expect(name);
        assert_eq!(best.evaluation.objective, sphere(&best.x), "{name}");
        // A mean distance of 1e-3 of the width of the box in each coordinate.
        assert!(best.evaluation.objective < 6.0 * (9.0 * 1e-3_f64).powi(2), "{name}: {best:?}");
    }
}

#[test]
fn every_method_finds_the_lowest_of_many_minima() {
    let space = SearchSpace::cube(2, -5.12, 5.12).expect("a box");
    for (name, method) in methods() {
        let found = |seed: &u64| {
            let search = Search { seed: *seed, ..search(&method, 20_000) };
            let report = search.minimize(&space, &rastrigin).expect(name);
            // The next minimum has 0.995.
            report.best.is_some_and(|b| b.evaluation.objective < 0.5)
        };
        let successes = (0..10).filter(found).count();
        assert!(successes >= 8, "{name}: {successes} of 10 seeds");
    }
}

/// Problem g08 of Liang et al., CEC 2006 (technical report): minimum -0.0958250414180359 at (1.22797135, 4.24537337).
fn g08(x: &[f64]) -> Evaluation {
    let objective =
        -(2.0 * PI * x[0]).sin().powi(3) * (2.0 * PI * x[1]).sin() / (x[0].powi(3) * (x[0] + x[1]));
    Evaluation::constrained(objective, &[x[0] * x[0] - x[1] + 1.0, 1.0 - x[0] + (x[1] - 4.0).powi(2)])
}

/// Digits of the published minimum.
const PUBLISHED: f64 = 5e-17;

#[test]
fn constraints_by_feasibility_rules() {
    let space = SearchSpace::cube(2, 0.0, 10.0).expect("a box");
    for (name, method) in methods() {
        let report = search(&method, 20_000).minimize(&space, &g08).expect(name);
        let best = report.feasible().expect(name);
        let excess = best.evaluation.objective + 0.0958250414180359;
        assert!((-PUBLISHED..1e-4).contains(&excess), "{name}: {excess:e}");
    }
}

/// The best point stands on the constraint: x0 + x1 >= 1 gives 1/2 at (1/2, 1/2), with the multiplier 1. A penalty of a larger
/// weight has the same minimum.
#[test]
fn a_minimum_on_the_constraint() {
    let space = SearchSpace::cube(2, -2.0, 2.0).expect("a box");
    let objective = |x: &[f64]| Evaluation::constrained(x[0] * x[0] + x[1] * x[1], &[1.0 - x[0] - x[1]]);
    // The constraint is satisfied to rounding.
    let close = -f64::EPSILON..1e-2;
    for (name, method) in methods() {
        let report = search(&method, 10_000).minimize(&space, &objective).expect(name);
        let best = report.feasible().expect(name);
        assert!(close.contains(&(best.evaluation.objective - 0.5)), "{name}: {best:?}");

        let constraints = Constraints::Penalty { weight: 10.0 };
        let report = Search { constraints, ..search(&method, 10_000) }.minimize(&space, &objective);
        let best = report.expect(name).best.expect(name);
        assert_eq!(best.evaluation, objective(&best.x), "{name}: the result is that of the objective");
        let penalised = best.evaluation.objective + 10.0 * best.evaluation.violation - 0.5;
        assert!(close.contains(&penalised), "{name}: {best:?}");
    }
}

#[test]
fn infeasible_everywhere_gives_the_least_violation() {
    let space = SearchSpace::cube(2, 0.0, 1.0).expect("a box");
    let objective = |x: &[f64]| Evaluation { objective: x[1], violation: 1.0 + x[0] };
    for (name, method) in methods() {
        let report = search(&method, 10_000).minimize(&space, &objective).expect(name);
        assert!(report.feasible().is_none(), "{name}");
        assert!(report.best.expect(name).evaluation.violation < 1.01, "{name}");
    }
}

#[test]
fn failed_evaluations_are_passed_by() {
    let space = SearchSpace::cube(3, -1.0, 1.0).expect("a box");
    // Half of the box fails, in three ways.
    let objective = |x: &[f64]| match x[0] {
        a if a < -0.6 => Evaluation::new(f64::NAN),
        a if a < -0.3 => Evaluation::new(f64::NEG_INFINITY),
        a if a < 0.0 => Evaluation { objective: -9.0, violation: f64::NAN },
        _ => Evaluation::new(sphere(x)),
    };
    for (name, method) in methods() {
        let report = search(&method, 10_000).minimize(&space, &objective).expect(name);
        assert!(report.failures > 0, "{name}");
        assert!(report.best.expect(name).evaluation.objective < SOLVER, "{name}");
    }
}

#[test]
fn a_search_where_all_fails_gives_up_and_says_so() {
    let space = SearchSpace::cube(3, -1.0, 1.0).expect("a box");
    for (name, method) in methods() {
        let report =
            search(&method, 100_000).minimize(&space, &|_: &[f64]| f64::NAN).expect("a report, no error");
        assert_eq!(report.stop, StopReason::AllFailed, "{name}");
        assert_eq!(report.best, None);
        assert_eq!(report.failures, report.evaluations);
        assert!((2000..2300).contains(&report.evaluations), "{name}: {}", report.evaluations);
    }
}

/// A sphere with normal noise that follows the number of the sample alone.
struct Noisy;

impl Objective for Noisy {
    fn evaluate(&self, x: &[f64]) -> Evaluation {
        self.evaluate_sample(x, 0)
    }

    fn evaluate_sample(&self, x: &[f64], sample: u64) -> Evaluation {
        Evaluation::new(sphere(x) + Generator::new(sample).normal())
    }
}

#[test]
fn noise_is_averaged_or_the_best_is_confirmed() {
    let space = SearchSpace::cube(2, -5.0, 5.0).expect("a box");
    let reported = |noise| {
        let search = Search { noise, threads: 1, budget: 20_000, ..Search::default() };
        let report = search.minimize(&space, &Noisy).expect("a report");
        let best = report.best.expect("a best point");
        (best.evaluation.objective, sphere(&best.x), report.evaluations)
    };
    // The least of 20 000 samples of noise is about -4.
    assert!(reported(Noise::None).0 < -3.0);
    // The least of 200 means of 100 is about -0.3.
    let (value, truth, evaluations) = reported(Noise::Mean { samples: 100 });
    assert!(value > -0.5 && truth < 0.5, "{value} {truth}");
    assert_eq!(evaluations, 20_000);
    let (value, truth, evaluations) = reported(Noise::ConfirmBest { repeats: 100 });
    assert!(value > -0.5 && truth < 0.5, "{value} {truth}");
    assert!(evaluations <= 20_000);
}

#[test]
fn noisy_searches_do_not_depend_on_threads() {
    let space = SearchSpace::cube(2, -5.0, 5.0).expect("a box");
    for noise in [Noise::None, Noise::Mean { samples: 3 }, Noise::ConfirmBest { repeats: 7 }] {
        let run = |threads| {
            let search = Search { noise, threads, budget: 1000, ..Search::new(Method::default()) };
            crate::timeless(search.minimize(&space, &Noisy).expect("a report"))
        };
        assert_eq!(run(1), run(3), "{noise:?}");
    }
}
