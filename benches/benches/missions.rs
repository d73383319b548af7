//! Mission file to certificate: parse, pose, solve with refinement, verify.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};

fn missions(c: &mut Criterion) {
    let mut group = c.benchmark_group("mission to certificate");
    group.sample_size(10);
    for (name, _) in apsides::registry().files() {
        group.bench_function(name, |b| {
            b.iter(|| {
                let mission = apsides::load(black_box(name), &[]).expect("a mission of the program");
                let outcome = mission.solve(None, &mut ()).expect("a well-posed mission");
                assert!(outcome.summary.certificate.is_verified(), "{name}: {}", outcome.summary.status);
                outcome
            });
        });
    }
    group.finish();
}

criterion_group!(benches, missions);
criterion_main!(benches);
