//! The planar landing from a perilune of 15 km in flat outputs.
//!
//! `paper`: 31 variables and 22 constraints, uniform points, from the coarse collocation that precedes it. `refined`: until the
//! curves meet the equations of motion. The times of the interior-point method alone are printed.
#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::time::Duration;

use apsides_dynamics::planar::flat::FlatConstantThrust;
use apsides_dynamics::planar::{ConstantThrust, PlanarFlight};
use apsides_dynamics::{Body, Engine};
use apsides_flatness::{Breaks, FlatSystem, Flatness, Placement, SplineSettings};
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Variable};
use criterion::{Criterion, criterion_group, criterion_main};

/// Ignition at the perilune: radius m, speed m/s, mass kg.
const IGNITION: [f64; 3] = [1_752_100.0, 1692.84366, 298.08545];
const TOUCHDOWN_SPEED: f64 = -5.0;

fn landing() -> (Ocp, FlatSystem, Guess) {
    let body = Body::new(4.904_869_5e12, 1.7371e6).expect("a body");
    let engine = Engine::with_exhaust_velocity(440.0, 310.0 * 9.807).expect("an engine");
    let flight = PlanarFlight::new(body, engine);
    let [radius, speed, mass] = IGNITION;
    let phase = Phase::new("braking", ConstantThrust(flight))
        .states([
            State::new("r", "m").starts_at(radius).ends_at(body.radius).scaled_by(1e5),
            State::new("phi", "rad").starts_at(0.0).scaled_by(1.0),
            State::new("u", "m/s").starts_at(speed).ends_at(0.0).scaled_by(2e3),
            State::new("v", "m/s").starts_at(0.0).ends_at(TOUCHDOWN_SPEED).scaled_by(2e3),
            State::new("m", "kg").starts_at(mass).scaled_by(200.0),
        ])
        .controls([Variable::new("beta", "rad").scaled_by(1.0)])
        .final_time(Bounds::new(300.0, 2000.0));
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
    (ocp, FlatSystem::new(FlatConstantThrust { flight, ignition: 0.0, mass }), guess)
}

fn landings(c: &mut Criterion) {
    let (ocp, system, guess) = landing();
    let systems = [system];
    let mut group = c.benchmark_group("landing");
    group.measurement_time(Duration::from_secs(5));
    let paper = |placement| {
        let mut method = Flatness::default();
        method.settings.spline = SplineSettings {
            order: Some(6),
            breaks: Breaks::Uniform(10),
            points: 15,
            placement,
            refine: false,
        };
        method
    };
    let cases = [
        ("paper", paper(Placement::Uniform)),
        ("gauss", paper(Placement::Gauss)),
        ("refined", Flatness::default()),
    ];
    for (name, method) in cases {
        let solve = || method.solve(&ocp, &systems, &guess).expect("a well-posed problem");
        // The least of a few: other programs run on the machine.
        let runs: Vec<_> = (0..50).map(|_| solve()).collect();
        for (k, s) in runs[0].presolve.iter().chain(&runs[0].solves).enumerate() {
            let least = runs
                .iter()
                .filter_map(|r| r.presolve.iter().chain(&r.solves).nth(k))
                .map(|s| s.solve_time)
                .min();
            println!(
                "{name}: {} variables, {} constraints, {} iterations, {:.3} ms in the interior-point method",
                s.counters.variables,
                s.counters.constraints,
                s.counters.iterations,
                least.map_or(0.0, |t| t.as_secs_f64() * 1e3)
            );
        }
        group.bench_function(name, |b| b.iter(|| black_box(solve())));
    }
    group.finish();
}

criterion_group!(benches, landings);
criterion_main!(benches);
