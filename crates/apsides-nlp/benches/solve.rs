//! Time of whole solves: a small dense problem, and a chain whose cost per iteration grows linearly.
#![allow(missing_docs, clippy::print_stderr, clippy::duplicated_attributes)]

#[allow(dead_code)]
#[path = "../tests/solver/chain.rs"]
mod chain;
#[allow(dead_code)]
#[path = "../tests/solver/support.rs"]
mod support;

use apsides_nlp::{InteriorPoint, SolveReport};
use chain::VanDerPol;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

fn hs71(c: &mut Criterion) {
    let solver = InteriorPoint::default();
    let mut problem = support::hs71();
    c.bench_function("hs71", |b| b.iter(|| solver.solve(&mut problem).map(|report| report.objective)));
}

fn van_der_pol(c: &mut Criterion) {
    let solver = InteriorPoint::default();
    let mut group = c.benchmark_group("van_der_pol");
    group.sample_size(10);
    for intervals in [100, 500, 1000, 5000] {
        let mut problem = VanDerPol { intervals, with_stages: true };
        if let Ok(SolveReport { counters, timing, status, .. }) = solver.solve(&mut problem) {
            let linear = timing.linear_systems.as_secs_f64() / timing.total.as_secs_f64();
            let evaluation = timing.evaluation.as_secs_f64() / timing.total.as_secs_f64();
            eprintln!(
                "{intervals} intervals: {status}, {counters:?}, linear {linear:.2}, evaluation {evaluation:.2}"
            );
        }
        group.bench_with_input(BenchmarkId::from_parameter(intervals), &intervals, |b, _| {
            b.iter(|| solver.solve(&mut problem).map(|report| report.objective));
        });
    }
    group.finish();
}

criterion_group!(benches, hs71, van_der_pol);
criterion_main!(benches);
