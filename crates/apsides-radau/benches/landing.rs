//! The planar landing from a perilune of 15 km on uniform meshes of 3 points per interval.
//!
//! Groups: `transcribe` (structure), `constraints`, `jacobian`, `hessian` (one call each, with one thread and with more where the
//! meshes are fine enough), `solve` (whole solve from the
//! solution on 20 intervals; iterations and time per iteration are printed).
#![allow(clippy::print_stdout)]

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Duration;

use apsides_dynamics::planar::{ConstantThrust, PlanarFlight};
use apsides_dynamics::{Body, Engine};
use apsides_nlp::{BarrierStrategy, InteriorPoint, Nlp, NlpSettings, ScalingMethod};
use apsides_ocp::{At, Bounds, Guess, Mesh, Ocp, Phase, PhaseGuess, State, Variable};
use apsides_radau::Transcription;
use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};

const INTERVALS: [usize; 4] = [20, 100, 1000, 5000];
const POINTS: usize = 3;
const THREADS: [usize; 2] = [1, 2];
/// Meshes that are evaluated with more than one thread.
const SHARED_INTERVALS: usize = 1000;

/// Ignition at the perilune: radius m, speed m/s, mass kg.
const IGNITION: [f64; 3] = [1_752_100.0, 1692.4, 298.1];
const DRY_MASS: f64 = 60.0;
const TOUCHDOWN_SPEED: f64 = -5.0;

fn landing() -> (Ocp, Guess) {
    let body = Body::new(4.904_869_5e12, 1.7371e6).expect("a body");
    let engine = Engine::with_exhaust_velocity(440.0, 310.0 * 9.807).expect("an engine");
    let [radius, speed, mass] = IGNITION;
    let burn_time = (mass - DRY_MASS) / engine.mass_flow();
    let fast = 1.5 * speed;
    let phase = Phase::new("braking", ConstantThrust(PlanarFlight::new(body, engine)))
        .states([
            State::new("r", "m").within(body.radius, radius + 100e3).starts_at(radius).ends_at(body.radius),
            State::new("phi", "rad").within(0.0, PI).starts_at(0.0),
            State::new("u", "m/s").within(-0.1 * fast, fast).starts_at(speed).ends_at(0.0),
            State::new("v", "m/s").within(-fast, fast).starts_at(0.0).ends_at(TOUCHDOWN_SPEED),
            State::new("m", "kg").within(DRY_MASS, mass).starts_at(mass),
        ])
        .controls([Variable::new("beta", "rad").within(-0.5 * PI, 1.5 * PI)])
        .final_time(Bounds::new(1.0, burn_time));
    let time = (mass - engine.mass_after(mass, 1.1 * speed)) / engine.mass_flow();
    let ocp = Ocp::builder("landing")
        .phase(phase)
        .minimize("flight_time", "s", At::FinalTime("braking"))
        .objective_scale(time)
        .build()
        .expect("a problem");
    let angle = 0.5 * time * speed / radius;
    let ends = vec![
        vec![radius, 0.0, speed, 0.0, mass],
        vec![body.radius, angle, 0.0, TOUCHDOWN_SPEED, mass - time * engine.mass_flow()],
    ];
    let line =
        PhaseGuess::samples(&[0.0, time], ends, vec![vec![150.0_f64.to_radians()]; 2]).expect("a line");
    let guess = Guess::from_phases(&ocp, vec![line]);
    (ocp, guess)
}

fn transcribe(ocp: &Ocp, guess: &Guess, intervals: usize) -> Transcription {
    let mesh = Mesh::uniform(ocp, intervals, POINTS).expect("a mesh");
    Transcription::new(ocp, &mesh, guess).expect("a transcription")
}

/// With the adaptive barrier parameter: the monotone one leaves the neighbourhood of the start on the finest mesh and ends
/// at a worse optimum.
fn solver() -> InteriorPoint {
    InteriorPoint::new(NlpSettings {
        barrier: BarrierStrategy::Adaptive,
        scaling: ScalingMethod::UserThenGradient { max: 100.0 },
        ..NlpSettings::default()
    })
}

fn evaluations(c: &mut Criterion) {
    let (ocp, guess) = landing();
    for intervals in INTERVALS {
        let mut group = c.benchmark_group("evaluate");
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(200))
            .measurement_time(Duration::from_millis(800));
        let id = BenchmarkId::new("transcribe", intervals);
        group.bench_function(id, |b| b.iter(|| transcribe(&ocp, &guess, intervals)));
        group.finish();
        for threads in THREADS.into_iter().filter(|&t| t == 1 || intervals >= SHARED_INTERVALS) {
            evaluation(c, transcribe(&ocp, &guess, intervals).with_threads(threads), threads, intervals);
        }
    }
}

fn evaluation(c: &mut Criterion, mut nlp: Transcription, threads: usize, intervals: usize) {
    let mut x = vec![0.0; nlp.variables()];
    nlp.initial_point(&mut x);
    let mut rows = vec![0.0; nlp.constraints()];
    let multipliers = vec![1.0; nlp.constraints()];
    let mut jacobian = vec![0.0; nlp.jacobian_pattern().len()];
    let mut hessian = vec![0.0; nlp.hessian_pattern().len()];
    let id = |function: &str| BenchmarkId::new(format!("{function}, {threads} threads"), intervals);
    let mut group = c.benchmark_group("evaluate");
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    group.bench_function(id("constraints"), |b| b.iter(|| nlp.constraint_values(black_box(&x), &mut rows)));
    // A moved point each time: derivatives at the same point are kept.
    let end = x.len() - 1;
    group.bench_function(id("jacobian"), |b| {
        b.iter(|| {
            x[end] += 1e-6;
            nlp.jacobian(black_box(&x), &mut jacobian);
        });
    });
    // As in a solve, at a point whose Jacobian is known.
    group.bench_function(id("hessian"), |b| {
        b.iter(|| nlp.hessian(black_box(&x), 1.0, black_box(&multipliers), &mut hessian));
    });
    group.finish();
}

fn solves(c: &mut Criterion) {
    let (ocp, line) = landing();
    let mut coarse = transcribe(&ocp, &line, INTERVALS[0]);
    let report = solver().solve(&mut coarse).expect("a well-posed problem");
    let trajectory = coarse.trajectory(&ocp, &report).expect("a trajectory");
    let guess = Guess::earlier(&trajectory);
    let mut group = c.benchmark_group("solve");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for intervals in INTERVALS {
        let mut nlp = transcribe(&ocp, &guess, intervals);
        let report = solver().solve(&mut nlp).expect("a well-posed problem");
        let iterations = report.counters.iterations;
        println!(
            "{intervals} intervals: {}, {:.9} s, {iterations} iterations, {:.3} ms per iteration",
            report.status,
            report.objective,
            report.timing.total.as_secs_f64() * 1e3 / iterations.max(1) as f64
        );
        group.bench_function(BenchmarkId::from_parameter(intervals), |b| {
            b.iter_batched_ref(
                || transcribe(&ocp, &guess, intervals),
                |nlp| solver().solve(nlp),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, evaluations, solves);
criterion_main!(benches);
