//! Direct shooting: whole solves with refinement, and one evaluation of all derivatives, shared by threads.
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use apsides_ocp::Mesh;
use apsides_problems::find;
use apsides_shooting::direct::{MultipleShooting, MultipleShootingSettings};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

/// Smooth; an equality along the path; stiff mechanics; four phases.
const PROBLEMS: [&str; 5] = ["linear_tangent", "orbit_raising", "cart_pole", "shuttle_reentry", "delta_iii"];

fn solves(c: &mut Criterion) {
    let mut group = c.benchmark_group("solve");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for name in PROBLEMS {
        let Some(case) = find(name).and_then(|p| p.pose().ok()) else { continue };
        group.bench_function(name, |b| {
            b.iter(|| {
                black_box(MultipleShooting::default().solve(&case.ocp, &case.guess).map(|s| s.accurate))
            });
        });
    }
    group.finish();
}

/// Ten iterations on 200 segments.
fn threads(c: &mut Criterion) {
    let Some(case) = find("shuttle_reentry").and_then(|p| p.pose().ok()) else { return };
    let Ok(mesh) = Mesh::uniform(&case.ocp, 200, 4) else { return };
    let mut group = c.benchmark_group("threads");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for threads in [1, 2] {
        let mut settings = MultipleShootingSettings { threads, max_refinements: 0, ..Default::default() };
        settings.nlp.max_iterations = 10;
        let method = MultipleShooting { settings };
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| {
                black_box(method.solve_on(&case.ocp, &case.guess, mesh.clone(), &mut ()).map(|s| s.status))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, solves, threads);
criterion_main!(benches);
