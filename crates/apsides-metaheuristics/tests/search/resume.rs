//! Searches that are dropped half-way and go on from what was saved.

use crate::{methods, rastrigin, search, timeless};
use apsides_metaheuristics::{Evaluation, Noise, Objective, Run, Search, SearchReport, SearchSpace};

/// Many minima, with constraints, failures and infinite violations, all of which a format of text has to carry.
fn rugged(x: &[f64]) -> Evaluation {
    match x[0] {
        a if a > 4.5 => Evaluation::FAILED,
        a if a > 4.0 => Evaluation { objective: 1.0, violation: f64::INFINITY },
        a if a > 3.5 => Evaluation::new(f64::INFINITY),
        _ => Evaluation::constrained(rastrigin(x), &[0.1 - x[1]]),
    }
}

fn space() -> SearchSpace {
    SearchSpace::cube(3, -5.12, 5.12).expect("a box")
}

/// The state as text after each `stride` generations, and the report.
fn saved(search: &Search, stride: usize) -> (Vec<String>, SearchReport) {
    let mut run = Run::new(search, &space()).expect("a search");
    let mut texts = Vec::new();
    for generation in 1.. {
        let stop = run.step(&rugged).expect("threads");
        if generation % stride == 0 {
            texts.push(serde_json::to_string(&run).expect("numbers"));
        }
        if stop.is_some() {
            break;
        }
    }
    (texts, timeless(run.report()))
}

/// The end of a search that goes on from a text.
fn resumed<O: Objective + ?Sized>(text: &str, objective: &O, threads: usize) -> SearchReport {
    let mut run: Run = serde_json::from_str(text).expect("a saved search");
    run.set_threads(threads);
    while run.step(objective).expect("threads").is_none() {}
    timeless(run.report())
}

#[test]
fn every_method_goes_on_to_the_same_result() {
    for (name, method) in methods() {
        let (texts, whole) = saved(&search(&method, 3000), 3);
        assert!(texts.len() > 3, "{name}");
        for text in texts.iter().step_by(texts.len() / 4) {
            assert_eq!(resumed(text, &rugged, 1), whole, "{name}");
        }
        assert_eq!(resumed(&texts[1], &rugged, 3), whole, "{name} on other threads");
    }
}

/// The state itself, and not the report alone, is the same to the last bit.
#[test]
fn a_text_that_is_read_and_written_is_the_same() {
    for (name, method) in methods() {
        for text in saved(&search(&method, 2000), 4).0 {
            let run: Run = serde_json::from_str(&text).expect(name);
            assert_eq!(serde_json::to_string(&run).expect(name), text, "{name}");
        }
    }
}

#[test]
fn a_search_before_its_first_generation() {
    for (name, method) in methods() {
        let search = search(&method, 1500);
        let text = serde_json::to_string(&Run::new(&search, &space()).expect(name)).expect(name);
        let whole = timeless(search.minimize(&space(), &rugged).expect(name));
        assert_eq!(resumed(&text, &rugged, 1), whole, "{name}");
    }
}

#[test]
fn noisy_searches_go_on_with_the_next_sample() {
    struct Noisy;
    impl Objective for Noisy {
        fn evaluate(&self, x: &[f64]) -> Evaluation {
            rugged(x)
        }
        fn evaluate_sample(&self, x: &[f64], sample: u64) -> Evaluation {
            let mut result = rugged(x);
            result.objective += (sample % 97) as f64 / 97.0;
            result
        }
    }
    let (_, method) = methods().swap_remove(2);
    let noise = Noise::ConfirmBest { repeats: 5 };
    let search = Search { noise, ..search(&method, 3000) };
    let mut run = Run::new(&search, &space()).expect("a search");
    for _ in 0..20 {
        run.step(&Noisy).expect("threads");
    }
    let text = serde_json::to_string(&run).expect("numbers");
    drop(run);
    let whole = timeless(search.minimize(&space(), &Noisy).expect("a report"));
    assert_eq!(resumed(&text, &Noisy, 2), whole);
}

#[test]
fn text_that_is_no_search_is_refused() {
    let (texts, _) = saved(&search(&methods().swap_remove(0).1, 500), 2);
    let half = &texts[0][..texts[0].len() / 2];
    assert!(serde_json::from_str::<Run>(half).is_err());
    assert!(serde_json::from_str::<Run>("{}").is_err());
    let changed = |from: &str, to: &str| {
        assert!(texts[0].contains(from));
        serde_json::from_str::<Run>(&texts[0].replacen(from, to, 1)).expect_err("a changed text").to_string()
    };
    let message = changed("\"upper\":[5.12,", "\"upper\":[-7.0,");
    assert!(message.starts_with("bounds of coordinate 0: [-5.12, -7]"), "{message}");
    let message = changed("\"values\":[", "\"values\":[0.0,");
    assert!(message.starts_with("the last point: 1 numbers instead of 3"), "{message}");
}
