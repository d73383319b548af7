//! Landings on the Moon with throttled thrust and least propellant, structure-free from crude guesses: coast, then full thrust.
//!
//! Vehicle and constants of A. Jamilnia, Modares Mechanical Engineering 17(10), 2017. The optima are those of an indirect method
//! (from the perilune, with the sign of the switching function checked) and of a structure of burn, coast, burn on refined
//! meshes (from the circular orbit).
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use apsides_dynamics::planar::{PlanarFlight, ThrottledThrust};
use apsides_dynamics::{Body, Engine};
use apsides_nlp::Status;
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Variable};
use apsides_radau::{Level, Radau, RadauSolution};

const RADIUS_M: f64 = 1.7371e6;
const ORBIT_ALTITUDE_M: f64 = 100e3;
const MASS_KG: f64 = 300.0;
const DRY_MASS_KG: f64 = 60.0;

/// Discretisation: the final mass against shooting, whose last digit this is, kg.
const MESH_KG: f64 = 1e-4;

fn body() -> Body {
    Body::new(4.904_869_5e12, RADIUS_M).unwrap()
}

fn engine() -> Engine {
    Engine::with_exhaust_velocity(440.0, 310.0 * 9.807).unwrap()
}

/// Speed at `r` on an orbit through the radii `a` and `b`.
fn speed(r: f64, a: f64, b: f64) -> f64 {
    (body().gravitational_parameter * (2.0 / r - 2.0 / (a + b))).sqrt()
}

fn phase(name: &str, states: [State; 5]) -> Phase {
    Phase::new(name, ThrottledThrust(PlanarFlight::new(body(), engine()))).states(states).controls([
        Variable::new("beta", "rad").within(-0.5 * PI, 1.5 * PI),
        Variable::new("throttle", "-").within(0.0, 1.0),
    ])
}

fn states() -> [State; 5] {
    [
        State::new("r", "m").within(RADIUS_M, RADIUS_M + 110e3),
        State::new("phi", "rad").within(0.0, 2.0 * PI),
        State::new("u", "m/s").within(-200.0, 2500.0),
        State::new("v", "m/s").within(-500.0, 500.0),
        State::new("m", "kg").within(DRY_MASS_KG, MASS_KG),
    ]
}

fn landed([r, phi, u, v, m]: [State; 5]) -> [State; 5] {
    [r.ends_at(RADIUS_M), phi, u.ends_at(0.0), v.ends_at(-5.0), m]
}

fn describe(s: &RadauSolution) -> String {
    let meshes: Vec<_> = s.meshes.iter().map(|m| (m.points, m.counters.iterations)).collect();
    let switches: Vec<_> = s.switches.iter().map(ToString::to_string).collect();
    format!("{:.7} {:?} {:?} {switches:#?}", s.trajectory.objective, s.status, meshes)
}

/// From the perilune of a Hohmann transfer out of the circular orbit, at altitude `h`.
fn from_perilune(h: f64) -> RadauSolution {
    let (low, high) = (RADIUS_M + h, RADIUS_M + ORBIT_ALTITUDE_M);
    let burn = speed(high, high, high) - speed(high, low, high);
    let mass = engine().mass_after(MASS_KG, burn);
    let fast = speed(low, low, high);
    let [r, phi, u, v, m] = landed(states());
    let states =
        [r.starts_at(low), phi.starts_at(0.0), u.starts_at(fast), v.starts_at(0.0), m.starts_at(mass)];
    let ocp = Ocp::builder("landing from perilune")
        .phase(phase("landing", states).final_time(Bounds::new(500.0, 1300.0)))
        .maximize("final mass", "kg", At::FinalState("landing", "m"))
        .objective_scale(100.0)
        .build()
        .unwrap();
    let ends = vec![vec![low, 0.0, fast, 0.0, mass], vec![RADIUS_M, 0.5, 0.0, -5.0, 150.0]];
    let controls = vec![vec![150.0_f64.to_radians(), 0.8]; 2];
    let guess = PhaseGuess::samples(&[0.0, 1200.0], ends, controls).unwrap();
    Radau::default().solve(&ocp, &Guess::from_phases(&ocp, vec![guess])).unwrap()
}

#[test]
fn from_the_perilune() {
    for (h, coast, mass) in [(5e3, 194.6, 154.0857), (10e3, 167.2, 153.9216), (15e3, 140.8, 153.7513)] {
        let s = from_perilune(h);
        assert_eq!(s.status, Status::Optimal);
        assert!(s.accurate);
        assert!((s.trajectory.objective - mass).abs() < MESH_KG, "{h}: {}", describe(&s));
        let [switch] = &s.switches[..] else { panic!("{}", describe(&s)) };
        assert_eq!(
            (switch.name.as_str(), switch.from, switch.to),
            ("throttle", Level::Lower(0.0), Level::Upper(1.0))
        );
        assert!(switch.located && (switch.time - coast).abs() < 0.1, "{switch}");
    }
}

#[test]
fn from_the_circular_orbit() {
    let (low, high) = (RADIUS_M + 15e3, RADIUS_M + ORBIT_ALTITUDE_M);
    let [r, phi, u, v, m] = states();
    let slow = speed(high, high, high);
    let transfer = [
        State { terminal: Bounds::at_least(low), ..r.starts_at(high) },
        phi.starts_at(0.0),
        u.starts_at(slow),
        v.starts_at(0.0).ends_at(0.0),
        m.starts_at(MASS_KG),
    ];
    let ocp = Ocp::builder("landing from orbit")
        .phase(phase("transfer", transfer).final_time(Bounds::new(2000.0, 5000.0)))
        .phase(
            phase("landing", landed(states()))
                .initial_time(Bounds::new(2000.0, 5000.0))
                .final_time(Bounds::new(2500.0, 7000.0)),
        )
        .link("transfer", "landing")
        .maximize("final mass", "kg", At::FinalState("landing", "m"))
        .objective_scale(100.0)
        .build()
        .unwrap();
    let perilune = vec![low, PI, 1690.0, 0.0, 295.0];
    let first = PhaseGuess::samples(
        &[0.0, 3500.0],
        vec![vec![high, 0.0, slow, 0.0, MASS_KG], perilune.clone()],
        vec![vec![PI, 0.1]; 2],
    );
    let second = PhaseGuess::samples(
        &[3500.0, 4700.0],
        vec![perilune, vec![RADIUS_M, PI + 0.5, 0.0, -5.0, 150.0]],
        vec![vec![150.0_f64.to_radians(), 0.8]; 2],
    );
    let guess = Guess::from_phases(&ocp, vec![first.unwrap(), second.unwrap()]);
    let s = Radau::default().solve(&ocp, &guess).unwrap();
    assert_eq!(s.status, Status::Optimal);
    assert!(s.accurate);
    assert!((s.trajectory.objective - 153.7513).abs() < MESH_KG, "{}", describe(&s));
    let [cutoff, ignition] = &s.switches[..] else { panic!("{}", describe(&s)) };
    assert_eq!((cutoff.from, cutoff.to), (Level::Upper(1.0), Level::Lower(0.0)));
    assert_eq!((ignition.from, ignition.to), (Level::Lower(0.0), Level::Upper(1.0)));
    let burn = s.trajectory.phases[1].final_time - ignition.time;
    assert!((cutoff.time - 13.2).abs() < 0.1, "{cutoff}");
    assert!((ignition.time - cutoff.time - 3544.0).abs() < 1.0, "{ignition}");
    assert!((burn - 997.3).abs() < 0.1, "{burn}");
}
