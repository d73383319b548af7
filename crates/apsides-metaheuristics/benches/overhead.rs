//! Time of each method for one evaluation, that of a sphere function included, which is measured alone as well.

use apsides_metaheuristics::{
    AnnealingSettings, AntColonySettings, CooperationSettings, GeneticSettings, IslandsSettings, Method,
    ParticleSwarmSettings, Run, Search, SearchSpace,
};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::{Duration, Instant};

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Time of at least `evaluations`, scaled to that number. Searches go on for the budget of the tables of success.
fn time_of(method: &Method, dimension: usize, evaluations: u64) -> Duration {
    let space = SearchSpace::cube(dimension, -100.0, 90.0).expect("invariant: bounds in order");
    let (mut spent, mut done, mut seed) = (Duration::ZERO, 0, 0);
    while done < evaluations {
        let budget = 10_000 * dimension;
        let search = Search { method: method.clone(), budget, threads: 1, seed, ..Search::default() };
        let mut run = Run::new(&search, &space).expect("invariant: default settings");
        let begin = Instant::now();
        while run.progress().evaluations < (evaluations - done) as usize
            && run.step(&sphere).expect("invariant: no threads").is_none()
        {}
        spent += begin.elapsed();
        done += run.progress().evaluations as u64;
        seed += 1;
    }
    spent.mul_f64(evaluations as f64 / done as f64)
}

fn overhead(criterion: &mut Criterion) {
    let methods = [
        ("genetic", Method::Genetic(GeneticSettings::default())),
        ("swarm", Method::ParticleSwarm(ParticleSwarmSettings::default())),
        ("colony", Method::AntColony(AntColonySettings::default())),
        ("annealing", Method::SimulatedAnnealing(AnnealingSettings::default())),
        ("cooperation", Method::Cooperation(CooperationSettings::default())),
        ("islands", Method::Islands(IslandsSettings::default())),
    ];
    for dimension in [10, 30] {
        let mut group = criterion.benchmark_group(format!("{dimension}_coordinates"));
        let x = vec![0.5; dimension];
        group.bench_function("sphere_alone", |b| b.iter(|| sphere(black_box(&x))));
        for (name, method) in &methods {
            group.bench_function(*name, |b| {
                b.iter_custom(|evaluations| time_of(method, dimension, evaluations));
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1)).sample_size(10);
    targets = overhead
}
criterion_main!(benches);
