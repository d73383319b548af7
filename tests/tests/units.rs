//! The landing from a perilune of 15 km, stated in SI, in km and in canonical units: the method sees the same problem.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use apsides::dynamics::planar::{ConstantThrust, PlanarFlight};
use apsides::dynamics::{Body, Engine};
use apsides::ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Variable};
use apsides::radau::{Radau, RadauSolution};
use apsides_tests::tolerance::FLIGHT_TIME_S;

/// One unit of the statement in SI.
#[derive(Clone, Copy)]
struct Units {
    length: f64,
    time: f64,
    mass: f64,
}

const MOON_MU: f64 = 4.904_869_5e12;
const MOON_RADIUS: f64 = 1.7371e6;
/// Ignition at the perilune: radius m, speed m/s, mass kg.
const IGNITION: [f64; 3] = [1_752_100.0, 1692.4, 298.1];
const DRY_MASS: f64 = 60.0;
const TOUCHDOWN_SPEED: f64 = -5.0;
const THRUST: f64 = 440.0;
const EXHAUST_VELOCITY: f64 = 310.0 * 9.807;

fn landing(units: Units) -> (Ocp, Guess) {
    let Units { length, time: second, mass: kilogram } = units;
    let speed_unit = length / second;
    let body = Body::new(MOON_MU / (length * speed_unit.powi(2)), MOON_RADIUS / length).unwrap();
    let force = kilogram * length / second.powi(2);
    let engine = Engine::with_exhaust_velocity(THRUST / force, EXHAUST_VELOCITY / speed_unit).unwrap();
    let [radius, speed, mass] = [IGNITION[0] / length, IGNITION[1] / speed_unit, IGNITION[2] / kilogram];
    let (dry, fast) = (DRY_MASS / kilogram, 1.5 * speed);
    let touchdown = TOUCHDOWN_SPEED / speed_unit;
    let phase = Phase::new("braking", ConstantThrust(PlanarFlight::new(body, engine)))
        .states([
            State::new("r", "").within(body.radius, 1.06 * radius).starts_at(radius).ends_at(body.radius),
            State::new("phi", "rad").within(0.0, PI).starts_at(0.0),
            State::new("u", "").within(-0.1 * fast, fast).starts_at(speed).ends_at(0.0),
            State::new("v", "").within(-fast, fast).starts_at(0.0).ends_at(touchdown),
            State::new("m", "").within(dry, mass).starts_at(mass),
        ])
        .controls([Variable::new("beta", "rad").within(-0.5 * PI, 1.5 * PI)])
        .final_time(Bounds::new(1.0 / second, (mass - dry) / engine.mass_flow()));
    let time = (mass - engine.mass_after(mass, 1.1 * speed)) / engine.mass_flow();
    let ocp = Ocp::builder("landing")
        .phase(phase)
        .minimize("flight time", "", At::FinalTime("braking"))
        .build()
        .unwrap();
    let angle = 0.5 * time * speed / radius;
    let ends = vec![
        vec![radius, 0.0, speed, 0.0, mass],
        vec![body.radius, angle, 0.0, touchdown, mass - time * engine.mass_flow()],
    ];
    let line = PhaseGuess::samples(&[0.0, time], ends, vec![vec![150.0_f64.to_radians()]; 2]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![line]);
    (ocp, guess)
}

#[test]
fn si_kilometres_and_canonical_units_take_the_same_iterations() {
    let si = Units { length: 1.0, time: 1.0, mass: 1.0 };
    let kilometres = Units { length: 1e3, ..si };
    let canonical =
        Units { length: MOON_RADIUS, time: (MOON_RADIUS.powi(3) / MOON_MU).sqrt(), mass: IGNITION[2] };
    let solve = |units: Units| -> RadauSolution {
        let (ocp, guess) = landing(units);
        let solution = Radau::default().solve(&ocp, &guess).unwrap();
        assert!(solution.status.is_success() && solution.accurate);
        assert!(solution.warnings.is_empty(), "{:?}", solution.warnings);
        solution
    };
    let work = |s: &RadauSolution| -> Vec<[usize; 3]> {
        s.meshes.iter().map(|m| [m.points, m.counters.iterations, m.counters.factorisations]).collect()
    };
    let reference = solve(si);
    for units in [kilometres, canonical] {
        let other = solve(units);
        assert_eq!(work(&other), work(&reference), "meshes: points, iterations, factorisations");
        let difference = other.trajectory.objective * units.time - reference.trajectory.objective;
        assert!(difference.abs() < FLIGHT_TIME_S, "{difference} s");
    }
}
