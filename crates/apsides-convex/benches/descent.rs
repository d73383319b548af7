//! Powered descents on Mars (Acikmese and Ploen 2007): one conic program by number of intervals and by length of blocks, and a
//! divert to one more site.

use std::hint::black_box;
use std::time::Duration;

use apsides_convex::{
    DescentLimits, DescentProblem, DescentSettings, DescentSolver, DivertPlanner, DivertSettings,
};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

fn mars(glide_slope: bool) -> DescentProblem {
    let limits =
        DescentLimits { glide_slope: glide_slope.then_some(4_f64.to_radians()), ..DescentLimits::default() };
    DescentProblem { limits, ..DescentProblem::mars_lander() }
}

fn one_program(c: &mut Criterion) {
    for (name, glide_slope, flight_time) in [("descent", false, 72.0), ("glide_slope", true, 81.0)] {
        let mut group = c.benchmark_group(name);
        group.sample_size(20).measurement_time(Duration::from_secs(2));
        for (intervals, block) in [(50, 1), (50, 3), (50, 5), (50, 10), (50, 50), (100, 5), (200, 5)] {
            let settings = DescentSettings { intervals, block, ..DescentSettings::default() };
            let mut solver = DescentSolver::new(&mars(glide_slope), settings).expect("well-posed");
            let id = BenchmarkId::new(format!("block {block}"), intervals);
            group.bench_function(id, |b| b.iter(|| black_box(solver.solve_at(flight_time, 1))));
        }
        group.finish();
    }
}

fn divert(c: &mut Criterion) {
    let mut planner = DivertPlanner::new(&mars(false), DivertSettings::default()).expect("well-posed");
    let mut k = 0;
    planner.divert([0.0; 3]).expect("well-posed");
    c.bench_function("divert", |b| {
        b.iter(|| {
            k = (k + 1) % 7;
            black_box(planner.divert([20.0 * f64::from(k), 10.0, 0.0]))
        });
    });
}

criterion_group!(benches, one_program, divert);
criterion_main!(benches);
