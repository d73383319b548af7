//! Flights that fail and requests that are refused.

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpBuilder, Phase, State, Variable};
use apsides_ode::Direction;
use apsides_shooting::ShootingError;
use apsides_shooting::profile::{
    Flight, FlightEnd, FlightRules, FlightSettings, Independent, MeshWish, ProfileScore, ProfileShape,
    ProfileShooting, Steering, Stop,
};

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-12;

/// Discretisation: the last step before a state has no end, s.
const ESCAPE_S: f64 = 1e-3;

/// `x' = u + sqrt(1 - x)`, NaN beyond one; or `x' = u x^2`, infinite at `1 / (u x0)`; or `x' = u`.
enum Rate {
    Root,
    Square,
    Control,
}

impl Dynamics<1, 1> for Rate {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        match self {
            Self::Root => [u[0] + (-x[0] + 1.0).sqrt()],
            Self::Square => [u[0] * x[0].square()],
            Self::Control => [u[0]],
        }
    }
}

fn phase(rate: Rate) -> Phase {
    Phase::new("run", rate)
        .states([State::new("x", "m").starts_at(0.5).ends_at(2.0)])
        .controls([Variable::new("u", "-").within(-1.0, 1.0)])
        .final_time(Bounds::fixed(5.0))
}

fn posed(phase: Phase) -> OcpBuilder {
    Ocp::builder("failing").phase(phase).minimize("x", "m", At::FinalState("run", "x"))
}

fn rules(ocp: &Ocp) -> FlightRules {
    FlightRules::new(ProfileShape::of_controls(0, 2, &ocp.phases[0]))
}

fn flown(ocp: &Ocp, rules: FlightRules, decision: &[f64]) -> Flight {
    ProfileShooting::new(ocp, rules).unwrap().flown(decision, Flight::clone).unwrap()
}

#[test]
fn rates_that_are_no_numbers() {
    let ocp = posed(phase(Rate::Root)).build().unwrap();
    let flight = flown(&ocp, rules(&ocp), &[1.0, 1.0]);
    assert_eq!(flight.end, FlightEnd::NotFinite);
    assert!(flight.objective.is_nan());
    // The last state before it is kept: the border is at one.
    assert!((flight.final_state[0] - 1.0).abs() < 1e6 * INTEGRATION && flight.final_time > 0.0);
    let shooting = ProfileShooting::new(&ocp, rules(&ocp)).unwrap();
    let score = ProfileScore::new(&shooting, 1.0);
    assert!(score.penalised(&flight).is_nan());
    assert_eq!(score.violation(&flight), f64::INFINITY);
    let wish = MeshWish { intervals: 4, points: 3, joints: true };
    let message = shooting.start(&[1.0, 1.0], wish).unwrap_err().to_string();
    assert!(message.starts_with("start, phase `run`: the flight failed at"), "{message}");
    // A later flight in the same storage is not touched by it.
    assert_eq!(shooting.flown(&[-1.0, -1.0], |f| f.end).unwrap(), FlightEnd::EndTime);
}

#[test]
fn states_without_end() {
    let ocp = posed(phase(Rate::Square)).build().unwrap();
    let flight = flown(&ocp, rules(&ocp), &[1.0, 1.0]);
    assert!(matches!(flight.end, FlightEnd::StepTooSmall | FlightEnd::NotFinite), "{:?}", flight.end);
    assert!((flight.final_time - 2.0).abs() < ESCAPE_S, "{}", flight.final_time);
    let settings = FlightSettings { most_steps: 20, ..FlightSettings::default() };
    let short = flown(&ocp, FlightRules { settings, ..rules(&ocp) }, &[1.0, 1.0]);
    assert_eq!(short.end, FlightEnd::TooManySteps);
}

/// Up before the joint, down beyond it: no flight follows the profile.
#[test]
fn energy_held_at_a_joint() {
    let ocp = posed(phase(Rate::Control)).build().unwrap();
    let stop = Stop::at_end(&ocp.phases[0], "x").unwrap();
    let rules = rules(&ocp).of(Independent::energy(2.0, |x| x[0])).until(stop);
    let flight = flown(&ocp, rules.clone(), &[1.0, -0.5]);
    assert!(matches!(flight.end, FlightEnd::Held | FlightEnd::TooManySteps), "{:?}", flight.end);
    assert!(flight.objective.is_nan());
    // Up on both sides: 1.5 m, half of them at half the speed.
    let flight = flown(&ocp, rules, &[1.0, 0.5]);
    assert_eq!(flight.end, FlightEnd::Stopped);
    assert!((flight.final_time - 2.25).abs() < INTEGRATION, "{}", flight.final_time);
}

#[test]
fn never_stopping() {
    let ocp = posed(phase(Rate::Square)).build().unwrap();
    let stop = Stop::at_end(&ocp.phases[0], "x").unwrap();
    let flight = flown(&ocp, rules(&ocp).until(stop), &[-1.0, -1.0]);
    assert_eq!((flight.end, flight.final_time), (FlightEnd::TimeLimit, 5.0));
    // x = 1 / (2 + t).
    assert!((flight.final_state[0] - 1.0 / 7.0).abs() < 1e6 * INTEGRATION);
    assert!((flight.state_misses[0] - (1.0 / 7.0 - 2.0)).abs() < 1e6 * INTEGRATION);
}

#[test]
fn numbers_that_are_none() {
    let ocp = posed(phase(Rate::Square).final_time(Bounds::new(0.0, 1.0))).build().unwrap();
    let end = |decision: &[f64]| flown(&ocp, rules(&ocp), decision).end;
    assert_eq!(end(&[f64::NAN, 0.0, 1.0]), FlightEnd::NotFinite);
    assert_eq!(end(&[0.0, 0.0, f64::NAN]), FlightEnd::NotFinite);
    assert_eq!(end(&[0.0, 0.0, 0.0]), FlightEnd::NoDuration);
    assert_eq!(end(&[0.0, 0.0, -3.0]), FlightEnd::NoDuration);
    // Outside of the box: the nearest inside.
    assert_eq!(flown(&ocp, rules(&ocp), &[0.0, 0.0, 7.0]).final_time, 1.0);
    // An energy that is no number, and one that starts where it ends.
    let stop = Stop { state: 0, value: 2.0, direction: Direction::Rising };
    for energy in [|_: &[f64]| f64::NAN, |x: &[f64]| x[0] * 6.0] {
        let rules = rules(&ocp).of(Independent::energy(3.0, energy)).until(stop);
        assert_eq!(flown(&ocp, rules, &[1.0, 1.0]).end, FlightEnd::NotFinite);
    }
}

#[test]
fn requests_that_are_refused() {
    let good = posed(phase(Rate::Root)).build().unwrap();
    let refused = |ocp: &Ocp, rules: FlightRules| ProfileShooting::new(ocp, rules).unwrap_err().to_string();
    let short = ProfileShooting::new(&good, rules(&good)).unwrap().flown(&[0.0], |f| f.end).unwrap_err();
    assert!(matches!(short, ShootingError::Dimension { expected: 2, found: 1, .. }));

    let second = Phase { name: "more".into(), ..phase(Rate::Root) };
    let two = posed(phase(Rate::Root)).phase(second).build().unwrap();
    assert!(refused(&two, rules(&two)).contains("2 phases"));
    let endless = posed(phase(Rate::Root).final_time(Bounds::at_least(1.0))).build().unwrap();
    assert!(
        refused(&endless, rules(&endless)).contains("phase `run`, final time: needs a finite upper bound")
    );
    let open = phase(Rate::Root).states([State::new("x", "m").at_least(0.0)]);
    let open = posed(open).build().unwrap();
    assert!(refused(&open, rules(&open)).contains("start of state `x`"));
    let free = phase(Rate::Root).controls([Variable::new("u", "-")]);
    let free = posed(free).build().unwrap();
    assert!(refused(&free, rules(&free)).contains("component 0"));
    let parameter =
        posed(phase(Rate::Root)).parameter(Variable::new("p", "-").at_least(0.0)).build().unwrap();
    assert!(refused(&parameter, rules(&parameter)).contains("parameter `p`"));

    let wide = FlightRules::new(ProfileShape::new(0, 2, vec![Bounds::new(-1.0, 2.0)]));
    assert!(refused(&good, wide).contains("control `u`"));
    let two_components = FlightRules::new(ProfileShape::new(0, 2, vec![Bounds::new(-1.0, 1.0); 2]));
    assert!(refused(&good, two_components.clone()).contains("expected 1 components"));
    assert!(refused(&good, two_components.steered(Steering::CosSin)).contains("expected 1 components"));
    assert!(refused(&good, rules(&good).steered(Steering::CosSin)).contains("expected 2 components"));
    let stop = Stop { state: 3, value: 0.0, direction: Direction::Any };
    assert!(refused(&good, rules(&good).until(stop)).contains("state 3"));
    assert!(
        refused(&good, rules(&good).of(Independent::energy(f64::NAN, |x| x[0])))
            .contains("energy at the end")
    );
    for (name, settings) in [
        ("tolerance", FlightSettings { tolerance: 0.0, ..FlightSettings::default() }),
        ("longest_step", FlightSettings { longest_step: f64::NAN, ..FlightSettings::default() }),
        ("samples", FlightSettings { samples: 0, ..FlightSettings::default() }),
        ("most_steps", FlightSettings { most_steps: 0, ..FlightSettings::default() }),
    ] {
        assert!(refused(&good, FlightRules { settings, ..rules(&good) }).contains(name), "{name}");
    }

    let stop_at = |phase: &Phase, name: &str| Stop::at_end(phase, name).unwrap_err().to_string();
    assert!(stop_at(&good.phases[0], "y").contains("no state"));
    let start = phase(Rate::Root).states([State::new("x", "m").starts_within(0.0, 1.0).ends_at(0.5)]);
    assert!(stop_at(&start, "x").contains("may start where it ends"));
    let start = phase(Rate::Root).states([State::new("x", "m").starts_at(0.0)]);
    assert!(stop_at(&start, "x").contains("not one value"));

    let shooting = ProfileShooting::new(&good, rules(&good)).unwrap();
    for wish in [
        MeshWish { intervals: 0, points: 3, joints: true },
        MeshWish { intervals: 3, points: 0, joints: false },
    ] {
        assert!(shooting.start(&[-1.0, -1.0], wish).is_err(), "{wish:?}");
    }
}
