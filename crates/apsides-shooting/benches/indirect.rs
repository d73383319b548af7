//! Indirect shooting from the costates of a collocation.
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use apsides_problems::find;
use apsides_radau::Radau;
use apsides_shooting::indirect::IndirectShooting;
use criterion::{Criterion, criterion_group, criterion_main};

/// Problems and segments per phase: smooth; a direction by a path constraint; strongly nonlinear; four phases.
const PROBLEMS: [(&str, usize); 4] =
    [("linear_tangent", 1), ("orbit_raising", 1), ("shuttle_reentry", 4), ("delta_iii", 4)];

fn solves(c: &mut Criterion) {
    let mut group = c.benchmark_group("indirect");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for (name, segments) in PROBLEMS {
        let Some(case) = find(name).and_then(|p| p.pose().ok()) else { continue };
        let Ok(start) = Radau::default().solve(&case.ocp, &case.guess) else { continue };
        group.bench_function(name, |b| {
            b.iter(|| {
                let solution = IndirectShooting::default().solve_from(&case.ocp, &start.trajectory, segments);
                black_box(solution.map(|s| s.status))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, solves);
criterion_main!(benches);
