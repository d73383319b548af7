//! Properties that hold for any seed, box and objective.

use crate::{methods, timeless};
use apsides_metaheuristics::{Algorithm, Evaluation, Points, Population, Run, Search, SearchSpace, Task};
use proptest::prelude::*;
use std::cmp::Ordering;

/// A rugged objective of any box, with failures and violations.
fn objective(x: &[f64]) -> Evaluation {
    let wave: f64 = x.iter().enumerate().map(|(k, x)| (x * (k + 1) as f64).sin() + 1e-3 * x.abs()).sum();
    match wave {
        w if w > 1.2 => Evaluation::FAILED,
        w if w > 0.5 => Evaluation { objective: w, violation: w - 0.5 },
        w => Evaluation::new(w),
    }
}

/// Boxes of one to six coordinates, some of them fixed, some wide, some thin and far from zero.
fn boxes() -> impl Strategy<Value = SearchSpace> {
    let center = prop_oneof![Just(0.0), -10.0..10.0, -1e9..1e9];
    let width = prop_oneof![1 => Just(0.0), 4 => 1e-6..10.0, 1 => 10.0..1e9];
    proptest::collection::vec((center, width), 1..7).prop_map(|bounds| {
        let (lower, upper) = bounds.into_iter().map(|(c, w): (f64, f64)| (c, c + w)).unzip();
        SearchSpace::new(lower, upper).expect("bounds in order")
    })
}

fn evaluations() -> impl Strategy<Value = Evaluation> {
    let number = || {
        prop_oneof![
            -2.0..2.0,
            (-1..2).prop_map(f64::from),
            Just(-0.0),
            Just(f64::NAN),
            Just(f64::INFINITY),
            Just(f64::NEG_INFINITY)
        ]
    };
    (number(), number()).prop_map(|(objective, violation)| Evaluation { objective, violation })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    #[test]
    fn points_stay_in_the_box(space in boxes(), seed in any::<u64>()) {
        for (name, method) in methods() {
            let n = space.dimension();
            let task = Task { space: &space, start: &Points::new(n), seed, budget: 2000 };
            let mut engine = method.start(&task).expect(name);
            let mut points = Points::new(n);
            for _ in 0..40 {
                engine.ask(&mut points);
                prop_assert!(!points.is_empty());
                for x in points.rows() {
                    prop_assert!(space.contains(x), "{}: {:?} outside of {:?}", name, x, space);
                }
                let results: Vec<_> = points.rows().map(objective).collect();
                engine.tell(&points, &results);
                prop_assert!(engine.spread() >= 0.0 && engine.spread() <= 1.0, "{}", name);
            }
        }
    }

    #[test]
    fn the_best_never_gets_worse_and_is_the_best_of_all(space in boxes(), seed in any::<u64>()) {
        for (name, method) in methods() {
            let n = space.dimension();
            let task = Task { space: &space, start: &Points::new(n), seed, budget: 2000 };
            let mut engine = method.start(&task).expect(name);
            let mut points = Points::new(n);
            let mut best = Evaluation::FAILED;
            for _ in 0..20 {
                engine.ask(&mut points);
                let results: Vec<_> = points.rows().map(objective).collect();
                engine.tell(&points, &results);
                best = results.iter().fold(best, |best, r| if r.is_better_than(&best) { *r } else { best });
                match engine.best() {
                    None => prop_assert!(best.is_failed(), "{}", name),
                    Some(kept) => {
                        prop_assert_eq!(kept.evaluation, best, "{}", name);
                        prop_assert_eq!(objective(&kept.x), best, "{}", name);
                    }
                }
            }
        }
    }

    #[test]
    fn threads_do_not_matter(space in boxes(), seed in any::<u64>()) {
        for (name, method) in methods() {
            let end = |threads| {
                let search = Search { method: method.clone(), seed, budget: 600, threads, ..Search::default() };
                timeless(search.minimize(&space, &objective).expect(name))
            };
            let one = end(1);
            prop_assert_eq!(&one, &end(2), "{}", name);
            prop_assert_eq!(&one, &end(4), "{}", name);
        }
    }

    #[test]
    fn history_falls(space in boxes(), seed in any::<u64>()) {
        for (name, method) in methods() {
            let search = Search { method, seed, budget: 600, threads: 1, ..Search::default() };
            let mut run = Run::new(&search, &space).expect(name);
            while run.step(&objective).expect(name).is_none() {}
            for w in run.report().history.windows(2) {
                let result = |k: usize| Evaluation { objective: w[k].objective, violation: w[k].violation };
                prop_assert!(result(1).order(&result(0)) != Ordering::Greater, "{}", name);
                prop_assert!(w[0].evaluations < w[1].evaluations && w[0].generation < w[1].generation);
            }
        }
    }

    #[test]
    fn emigrants_are_the_best_and_arrive(seed in any::<u64>(), count in 0_usize..12) {
        let space = SearchSpace::cube(3, -5.0, 5.0).expect("a box");
        for (name, method) in methods() {
            let task = Task { space: &space, start: &Points::new(3), seed, budget: 2000 };
            let mut engine = method.start(&task).expect(name);
            let mut points = Points::new(3);
            for _ in 0..4 {
                engine.ask(&mut points);
                let results: Vec<_> = points.rows().map(objective).collect();
                engine.tell(&points, &results);
            }
            let mut sent = Population::new(3);
            engine.emigrants(count, &mut sent);
            prop_assert!(sent.len() <= count, "{}", name);
            prop_assert!(sent.evaluations.iter().all(|e| !e.is_failed()), "{}", name);
            prop_assert!(sent.evaluations.windows(2).all(|w| w[0].order(&w[1]) != Ordering::Greater), "{}", name);
            let mut better = Population::new(3);
            better.push(&[0.25; 3], Evaluation::new(-1e3));
            engine.immigrate(&better);
            prop_assert_eq!(engine.best().map(|b| b.evaluation.objective), Some(-1e3), "{}", name);
            sent.clear();
            engine.emigrants(1, &mut sent);
            prop_assert_eq!(sent.points.row(0), &[0.25; 3][..], "{}", name);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..Default::default() })]

    #[test]
    fn results_have_a_total_order(a in evaluations(), b in evaluations(), c in evaluations()) {
        prop_assert_eq!(a.order(&b), b.order(&a).reverse());
        if a.order(&b) != Ordering::Greater && b.order(&c) != Ordering::Greater {
            prop_assert!(a.order(&c) != Ordering::Greater);
        }
        prop_assert_eq!(a.order(&a), Ordering::Equal);
    }

    #[test]
    fn reflected_values_stand_between_the_bounds(space in boxes(), value in any::<f64>(), part in -3.0..3.0) {
        for i in 0..space.dimension() {
            for value in [value, space.lower()[i] + part * space.width(i)] {
                let reflected = space.reflect(i, value);
                prop_assert!(space.lower()[i] <= reflected && reflected <= space.upper()[i]);
            }
        }
    }
}
