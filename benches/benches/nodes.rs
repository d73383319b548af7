//! Scaling in nodes: one solve of the landing on uniform meshes of 3 points per interval, all from the same coarse
//! solution. Throughput counts collocation points. The barrier parameter is adaptive: the monotone one leaves the
//! neighbourhood of the start on the finest mesh and ends at a worse optimum.
#![allow(clippy::print_stdout)]

use apsides::nlp::{BarrierStrategy, InteriorPoint};
use apsides_benches::landing::settings;
use apsides_benches::{Landing, Start};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

const POINTS: usize = 3;

fn nodes(c: &mut Criterion) {
    let landing = Landing::pose().expect("a mission of the program");
    let solver = InteriorPoint::new(settings(BarrierStrategy::Adaptive));
    let mut group = c.benchmark_group("landing over nodes");
    group.sample_size(10);
    for intervals in [20, 50, 100, 200, 500, 1000, 2000, 5000] {
        let guess = landing.start(Start::Coarse, intervals, POINTS).expect("a coarse solution");
        let pose = || landing.transcription(&guess, intervals, POINTS).expect("a well-posed mesh");
        let report = solver.solve(&mut pose()).expect("a well-posed problem");
        println!(
            "{intervals} intervals: {}, {:.9} s, {} iterations",
            report.status, report.objective, report.counters.iterations
        );
        group.throughput(Throughput::Elements((intervals * POINTS) as u64));
        group.bench_function(BenchmarkId::from_parameter(intervals * POINTS), |b| {
            b.iter_batched_ref(pose, |nlp| solver.solve(nlp), BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(benches, nodes);
criterion_main!(benches);
