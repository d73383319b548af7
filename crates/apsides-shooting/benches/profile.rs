//! Flights of a capsule under profiles of its bank angle.
#![allow(missing_docs)]

use std::hint::black_box;

use apsides_ode::Method;
use apsides_shooting::profile::{FlightRules, FlightSettings, ProfileShape, ProfileShooting};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

#[path = "../tests/profile/capsule.rs"]
#[allow(dead_code)]
mod capsule;

/// Decision vectors flown in turn.
const VECTORS: usize = 256;

/// Fractional parts of multiples of roots, in the box.
fn vectors(shooting: &ProfileShooting<'_>) -> Vec<Vec<f64>> {
    let (lower, upper) = shooting.space();
    let part = |k: usize, j: usize| ((k + 1) as f64 * ((j + 2) as f64).sqrt()).fract();
    let vector =
        |k| lower.iter().zip(upper).enumerate().map(|(j, (a, b))| a + (b - a) * part(k, j)).collect();
    (0..VECTORS).map(vector).collect()
}

fn flights(c: &mut Criterion) {
    let ocp = capsule::ocp();
    let linear =
        |intervals| ProfileShape { continuous: true, ..ProfileShape::new(1, intervals, capsule::bank()) };
    let constants =
        |intervals| ProfileShape { free_lengths: true, ..ProfileShape::new(0, intervals, capsule::bank()) };
    let accurate = |tolerance, rules: FlightRules| {
        let settings = FlightSettings { method: Method::Dop853, tolerance, ..FlightSettings::default() };
        FlightRules { settings, ..rules }
    };
    let rough = |rules: FlightRules| {
        let settings = FlightSettings { tolerance: 1e-5, ..FlightSettings::default() };
        FlightRules { settings, ..rules }
    };
    let cases = [
        ("energy-constant-3", capsule::in_energy(constants(3))),
        ("energy-linear-5", capsule::in_energy(linear(5))),
        ("time-constant-3", capsule::in_time(constants(3))),
        ("energy-constant-3-rough", rough(capsule::in_energy(constants(3)))),
        ("energy-constant-3-order-8", accurate(1e-6, capsule::in_energy(constants(3)))),
        ("energy-constant-3-order-8-fine", accurate(1e-9, capsule::in_energy(constants(3)))),
    ];
    let mut group = c.benchmark_group("flights");
    group.throughput(Throughput::Elements(VECTORS as u64)).sample_size(20);
    for (name, rules) in cases {
        let Ok(shooting) = ProfileShooting::new(&ocp, rules) else { continue };
        let vectors = vectors(&shooting);
        group.bench_function(name, |b| {
            b.iter(|| {
                for vector in &vectors {
                    black_box(shooting.flown(vector, |f| f.objective).ok());
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, flights);
criterion_main!(benches);
