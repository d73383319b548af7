//! Equations of motion at one node: values, Jacobian, weighted Hessian, one call each.
//!
//! The gallery's re-entry (6 states, 2 controls, nine transcendental functions), ascent (7 states, 3 controls, norms and an
//! exponential) and free-flying robot (6 states, 4 controls).

use std::hint::black_box;
use std::time::Duration;

use apsides_nlp::Nlp;
use apsides_ocp::Mesh;
use apsides_problems::find;
use apsides_radau::Transcription;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

const PROBLEMS: [&str; 4] = ["shuttle_reentry", "delta_iii", "free_flying_robot", "goddard_cops"];

fn nodes(c: &mut Criterion) {
    let mut group = c.benchmark_group("node");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500));
    for name in PROBLEMS {
        let case = find(name).expect("a problem of the gallery").pose().expect("a problem");
        let (phase, guess) = (&case.ocp.phases[0], &case.guess.phases[0]);
        let f = &phase.dynamics;
        let (nx, nu) = (phase.states.len(), phase.controls.len());
        let mut z = vec![0.5; f.inputs()];
        guess.state(0.3, &mut z[..nx]);
        guess.control(0.3, &mut z[nx..nx + nu]);
        let weights = vec![0.7; f.outputs()];
        let mut values = vec![0.0; f.outputs()];
        let mut jacobian = vec![0.0; f.pattern().jacobian_len()];
        let mut hessian = vec![0.0; f.pattern().hessian_len()];
        group.bench_function(BenchmarkId::new("value", name), |b| {
            b.iter(|| f.value(black_box(&z), &mut values))
        });
        group.bench_function(BenchmarkId::new("jacobian", name), |b| {
            b.iter(|| f.jacobian(black_box(&z), &mut values, &mut jacobian));
        });
        group.bench_function(BenchmarkId::new("hessian", name), |b| {
            b.iter(|| f.hessian(black_box(&z), black_box(&weights), &mut hessian));
        });
    }
    group.finish();
}

/// The re-entry on 40 intervals of 4 points, the mesh of a quick solve: whole evaluations of the discretised problem.
fn problem(c: &mut Criterion) {
    let case = find("shuttle_reentry").expect("a problem of the gallery").pose().expect("a problem");
    let mesh = Mesh::uniform(&case.ocp, 40, 4).expect("a mesh");
    let mut nlp = Transcription::new(&case.ocp, &mesh, &case.guess).expect("a transcription");
    let mut x = vec![0.0; nlp.variables()];
    nlp.initial_point(&mut x);
    let mut rows = vec![0.0; nlp.constraints()];
    let multipliers = vec![1.0; nlp.constraints()];
    let mut jacobian = vec![0.0; nlp.jacobian_pattern().len()];
    let mut hessian = vec![0.0; nlp.hessian_pattern().len()];
    let mut group = c.benchmark_group("shuttle 40x4");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500));
    group.bench_function("constraints", |b| b.iter(|| nlp.constraint_values(black_box(&x), &mut rows)));
    let end = x.len() - 1;
    group.bench_function("jacobian", |b| {
        b.iter(|| {
            x[end] += 1e-6;
            nlp.jacobian(black_box(&x), &mut jacobian);
        });
    });
    group.bench_function("hessian", |b| {
        b.iter(|| nlp.hessian(black_box(&x), 1.0, black_box(&multipliers), &mut hessian));
    });
    group.finish();
}

criterion_group!(benches, nodes, problem);
criterion_main!(benches);
