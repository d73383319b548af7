//! Flights with closed forms.

use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Ocp, Phase, Sense, State, Term, Variable};
use apsides_ode::{Direction, Method};
use apsides_shooting::profile::{
    Flight, FlightEnd, FlightRules, FlightSettings, Independent, MAX_DEGREE, MeshWish, ProfileScore,
    ProfileShape, ProfileShooting, Quantity, Steering, Stop,
};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-13;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-11;

/// Discretisation: the peak of a flight that was stopped early.
const STOPPED: f64 = 1e-3;

/// `x' = v`, `v' = u - g`.
struct Cart {
    gravity: f64,
}

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - self.gravity]
    }
}

/// The control to a power.
struct Power(i32);

impl PathFunction<2, 1, 1> for Power {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].powi(self.0)]
    }
}

fn cart(start: [f64; 2], control: Bounds, final_time: Bounds) -> Ocp {
    let phase = Phase::new("push", Cart { gravity: 0.0 })
        .states([
            State::new("x", "m").starts_at(start[0]).ends_at(1.0),
            State::new("v", "m/s").starts_at(start[1]),
        ])
        .controls([Variable::new("u", "m/s2").within(control.lower, control.upper)])
        .final_time(final_time)
        .integral(Variable::new("effort", "-").scaled_by(1.0), Power(2));
    Ocp::builder("cart").phase(phase).minimize_integral("push", "effort").build().unwrap()
}

/// Settings that make the error of the steps negligible.
fn accurate(rules: FlightRules) -> FlightRules {
    let settings = FlightSettings { method: Method::Dop853, tolerance: 1e-12, ..FlightSettings::default() };
    FlightRules { settings, ..rules }
}

fn fly(ocp: &Ocp, rules: FlightRules, decision: &[f64]) -> Flight {
    ProfileShooting::new(ocp, accurate(rules)).unwrap().flown(decision, Flight::clone).unwrap()
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

/// `u = s^d` from rest for two seconds: `v = 2 s^(d+1) / (d+1)`, `x = 4 s^(d+2) / ((d+1) (d+2))`, effort `2 / (2 d + 1)`.
#[test]
fn powers_of_time_of_every_degree() {
    let ocp = cart([0.0; 2], Bounds::new(0.0, 1.0), Bounds::fixed(2.0));
    for degree in 0..=MAX_DEGREE {
        let shape = ProfileShape::of_controls(degree, 2, &ocp.phases[0]);
        let nodes = shape.decode(&vec![0.0; shape.variables()]).unwrap().nodes().to_vec();
        let s = (0..2).flat_map(|k| nodes.iter().map(move |x| 0.5 * (f64::from(k) + 0.5 * (x + 1.0))));
        let decision: Vec<f64> = s.map(|s| s.powi(degree as i32)).collect();
        let flight = fly(&ocp, FlightRules::new(shape), &decision);
        let d = degree as f64;
        assert_eq!((flight.end, flight.final_time), (FlightEnd::EndTime, 2.0));
        close(flight.final_state[1], 2.0 / (d + 1.0), INTEGRATION);
        close(flight.final_state[0], 4.0 / ((d + 1.0) * (d + 2.0)), INTEGRATION);
        close(flight.objective, 2.0 / (2.0 * d + 1.0), INTEGRATION);
        close(flight.state_misses[0], 4.0 / ((d + 1.0) * (d + 2.0)) - 1.0, INTEGRATION);
        assert_eq!(flight.state_misses[1], 0.0);
    }
}

/// Bang-bang in time, jumps at the joints: `x = 1`, `v = 0` after two seconds.
#[test]
fn jumps_in_time_are_ends_of_steps() {
    let ocp = cart([0.0; 2], Bounds::new(-1.0, 1.0), Bounds::fixed(2.0));
    let rules = FlightRules::new(ProfileShape::of_controls(0, 2, &ocp.phases[0]));
    let rough = ProfileShooting::new(&ocp, rules).unwrap();
    let flight = rough.flown(&[1.0, -1.0], Flight::clone).unwrap();
    close(flight.final_state[0], 1.0, 0.1 * ROUNDING);
    close(flight.final_state[1], 0.0, 0.1 * ROUNDING);
    close(flight.objective, 2.0, 0.1 * ROUNDING);
}

const START: [f64; 2] = [10.0, -2.0];
/// Closed form of the lander with `g = 1.5`, `0 <= u <= 3` from these: switch, landing, `int u = g tf - v0` (switch where free fall and
/// full thrust to rest at the ground meet).
const SWITCH: f64 = 1.415_403_750_4;
const LANDING: f64 = 4.164_140_834_2;

fn lander() -> Ocp {
    let phase = Phase::new("descent", Cart { gravity: 1.5 })
        .states([
            State::new("height", "m").within(-1.0, 20.0).starts_at(START[0]).ends_at(0.0),
            State::new("speed", "m/s").within(-10.0, 10.0).starts_at(START[1]).ends_at(0.0),
        ])
        .controls([Variable::new("thrust", "m/s2").within(0.0, 3.0)])
        .final_time(Bounds::new(1.0, 8.0))
        .integral(Variable::new("impulse", "m/s").scaled_by(10.0), Power(1));
    Ocp::builder("lander").phase(phase).minimize_integral("descent", "impulse").build().unwrap()
}

fn free_lengths(ocp: &Ocp, intervals: usize) -> ProfileShape {
    ProfileShape { free_lengths: true, ..ProfileShape::of_controls(0, intervals, &ocp.phases[0]) }
}

#[test]
fn moon_lander_to_its_closed_form() {
    let ocp = lander();
    let rules = FlightRules::new(free_lengths(&ocp, 2));
    let decision = [0.0, 3.0, SWITCH / (LANDING - SWITCH), 1.0, LANDING];
    let flight = fly(&ocp, rules.clone(), &decision);
    assert_eq!(flight.end, FlightEnd::EndTime);
    // The times are given to 1e-10.
    close(flight.final_state[0], 0.0, 100.0 * INTEGRATION);
    close(flight.final_state[1], 0.0, 100.0 * INTEGRATION);
    close(flight.objective, 8.246_211_251_3, 100.0 * INTEGRATION);
    close(flight.initial_state[0], START[0], 0.0);
    // As a start for another method: the switch is an end of an interval, and the thrust is sharp there.
    let shooting = ProfileShooting::new(&ocp, accurate(rules)).unwrap();
    let start = shooting.start(&decision, MeshWish { intervals: 4, points: 3, joints: true }).unwrap();
    let phase = &start.trajectory.phases[0];
    assert_eq!(start.mesh.phases[0].intervals(), 5);
    close(start.mesh.phases[0].fractions()[2], SWITCH / LANDING, 100.0 * INTEGRATION);
    assert_eq!((phase.control_at(SWITCH - 1e-6), phase.control_at(SWITCH + 1e-6)), (vec![0.0], vec![3.0]));
    close(phase.state_at(SWITCH)[0], 17.0 / 3.0, 100.0 * INTEGRATION);
    close(phase.state_at(SWITCH)[1], -4.123_105_625_6, 100.0 * INTEGRATION);
    close(start.trajectory.objective, 8.246_211_251_3, 100.0 * INTEGRATION);
    start.guess.check(&ocp).unwrap();
    let uniform = shooting.start(&decision, MeshWish { intervals: 7, points: 2, joints: false }).unwrap();
    assert_eq!(uniform.mesh.phases[0].intervals(), 7);
}

/// Thrust too late: it reaches the ground at a speed that energy gives, `v^2 = v1^2 - 3 h1` from where the thrust began. Too early: it
/// turns above the ground and never comes down.
#[test]
fn moon_lander_stops_at_the_ground() {
    let ocp = lander();
    let stop = Stop::at_end(&ocp.phases[0], "height").unwrap();
    assert_eq!((stop.state, stop.value, stop.direction), (0, 0.0, Direction::Falling));
    let rules = FlightRules::new(free_lengths(&ocp, 2)).until(stop);
    let begin = 1.6;
    let flight = fly(&ocp, rules.clone(), &[0.0, 3.0, begin / (LANDING - begin), 1.0, LANDING]);
    let (h, v) = (10.0 - 2.0 * begin - 0.75 * begin * begin, -2.0 - 1.5 * begin);
    let speed = -(v * v - 3.0 * h).sqrt();
    assert_eq!(flight.end, FlightEnd::Stopped);
    close(flight.final_time, begin + (speed - v) / 1.5, 100.0 * INTEGRATION);
    close(flight.final_state[0], 0.0, 10.0 * ROUNDING);
    close(flight.state_misses[1], speed, 100.0 * INTEGRATION);
    close(flight.objective, 3.0 * (flight.final_time - begin), 100.0 * INTEGRATION);
    let shooting = ProfileShooting::new(&ocp, rules.clone()).unwrap();
    let score = ProfileScore {
        miss_weights: vec![7.0, 2.0],
        miss_tolerances: vec![1e-3, 0.25],
        excess_weight: 100.0,
        excess_tolerance: 1e-6,
    };
    close(score.violation(&flight), 2.0 * (speed.abs() - 0.25), 100.0 * INTEGRATION);
    assert_eq!(score.penalised(&flight), flight.objective + score.violation(&flight));
    assert_eq!(score.separate(&flight), (flight.objective, score.violation(&flight)));
    let default = ProfileScore::new(&shooting, 40.0);
    // Scales are the widths of the bounds, 21 m and 20 m/s.
    assert_eq!(default.miss_weights, [40.0 / 21.0, 2.0]);

    let early = fly(&ocp, rules, &[0.0, 3.0, 1.0 / (LANDING - 1.0), 1.0, LANDING]);
    assert_eq!((early.end, early.final_time), (FlightEnd::TimeLimit, 8.0));
    // Thrust is kept beyond the end of the profile; the height bound of 20 m is respected, that of the end is not.
    let t = 8.0 - 1.0;
    close(early.state_misses[0], 10.0 - 2.0 - 0.75 - 3.5 * t + 0.75 * t * t, 100.0 * INTEGRATION);
    let height = shooting.watched().iter().position(|l| l.quantity == Quantity::State(0)).unwrap();
    close(early.peaks[height].amount, (early.final_state[0] - 20.0).max(-1.0 - 3.166_666_666_7), STOPPED);
}

/// `E = -x`: the control is a function of the way. From `v = 1`, `u = 1` to half way and `-1` beyond: `v^2 = 1 + 2 x`, then falling
/// back to 1 at `x = 2`; each half takes `sqrt(3) - 1`.
#[test]
fn jumps_in_energy_are_ends_of_steps() {
    let ocp = cart([0.0, 1.0], Bounds::new(-1.0, 1.0), Bounds::new(0.1, 10.0));
    let rules = FlightRules::new(ProfileShape::of_controls(0, 2, &ocp.phases[0]))
        .of(Independent::energy(-2.0, |x| -x[0]))
        .until(Stop { state: 0, value: 2.0, direction: Direction::Rising });
    // No end time in the decision vector.
    assert_eq!(ProfileShooting::new(&ocp, rules.clone()).unwrap().space().0.len(), 2);
    let flight = fly(&ocp, rules.clone(), &[1.0, -1.0]);
    assert_eq!(flight.end, FlightEnd::Stopped);
    close(flight.final_time, 2.0 * (3.0_f64.sqrt() - 1.0), INTEGRATION);
    close(flight.final_state[1], 1.0, INTEGRATION);
    close(flight.objective, flight.final_time, INTEGRATION);
    // Steps of order 8 are exact on each side of the jump: few of them.
    assert!(flight.steps < 30, "{}", flight.steps);
    let shooting = ProfileShooting::new(&ocp, accurate(rules)).unwrap();
    let start = shooting.start(&[1.0, -1.0], MeshWish { intervals: 2, points: 3, joints: true }).unwrap();
    let switch = start.trajectory.phases[0].time_at(start.mesh.phases[0].fractions()[1]);
    close(switch, 3.0_f64.sqrt() - 1.0, INTEGRATION);
    assert_eq!(start.trajectory.phases[0].control_at(switch + 1e-9), [-1.0]);
}

/// `u = x / 2`: `v^2 = 1 + x^2 / 2`, `t = sqrt(2) asinh(x / sqrt(2))`. Degrees above one give the same.
#[test]
fn linear_in_energy() {
    let ocp = cart([0.0, 1.0], Bounds::new(-1.0, 1.0), Bounds::new(0.1, 10.0));
    for degree in 1..=MAX_DEGREE {
        let shape = ProfileShape { continuous: true, ..ProfileShape::of_controls(degree, 2, &ocp.phases[0]) };
        let nodes = shape.decode(&vec![0.0; shape.variables()]).unwrap().nodes().to_vec();
        let inner =
            (0..2).flat_map(|k| nodes[..degree].iter().map(move |x| 0.5 * (f64::from(k) + 0.5 * (x + 1.0))));
        let decision: Vec<f64> = inner.chain([1.0]).collect();
        let rules = FlightRules::new(shape).of(Independent::energy(-2.0, |x| -x[0])).until(Stop {
            state: 0,
            value: 2.0,
            direction: Direction::Any,
        });
        let flight = fly(&ocp, rules, &decision);
        close(flight.final_state[1], 3.0_f64.sqrt(), INTEGRATION);
        close(flight.final_time, 2.0_f64.sqrt() * 2.0_f64.sqrt().asinh(), INTEGRATION);
    }
}

/// The way turns beyond the joint, and the control of before the joint comes back: `u = -0.4` up to `x = 1`, `-2` beyond.
#[test]
fn energy_may_come_back_through_a_joint() {
    let ocp = cart([0.0, 1.0], Bounds::new(-2.0, 1.0), Bounds::new(0.1, 10.0));
    let rules = FlightRules::new(ProfileShape::of_controls(0, 2, &ocp.phases[0]))
        .of(Independent::energy(-2.0, |x| -x[0]))
        .until(Stop { state: 0, value: 0.0, direction: Direction::Falling });
    let flight = fly(&ocp, rules, &[-0.4, -2.0]);
    let joint = 0.2_f64.sqrt();
    assert_eq!(flight.end, FlightEnd::Stopped);
    close(flight.final_state[1], -1.0, INTEGRATION);
    close(flight.final_time, 2.0 * ((1.0 - joint) / 0.4 + joint / 2.0), INTEGRATION);
}

/// `x' = p cos(a)`, `y' = p sin(a)`, in which start and speed are open.
struct Walk;

impl Dynamics<2, 2, 1> for Walk {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], p: &[S; 1]) -> [S; 2] {
        [p[0] * u[0], p[0] * u[1]]
    }
}

struct Norm;

impl PathFunction<2, 2, 1> for Norm {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square()]
    }
}

struct Way;

impl VectorFunction<2, 1> for Way {
    fn evaluate<S: Scalar>(&self, z: &[S; 2]) -> [S; 1] {
        [z[1] - z[0]]
    }
}

/// Everything that a problem can leave open, in the documented order; the objective in its parts; rows of endpoint constraints.
#[test]
fn open_times_starts_and_parameters() {
    let phase = Phase::new("walk", Walk)
        .states([
            State::new("x", "m").within(-10.0, 10.0).starts_within(-1.0, 1.0).ends_within(4.0, 5.0),
            State::new("y", "m").starts_at(0.0),
        ])
        .controls([Variable::new("c", "-").within(-0.5, 1.0), Variable::new("s", "-").within(-1.0, 1.0)])
        .initial_time(Bounds::new(0.0, 1.0))
        .final_time(Bounds::new(1.0, 9.0))
        .duration(Bounds::new(0.0, 2.0))
        .path([Variable::new("norm", "-").equal_to(1.0)], Norm);
    let ocp = Ocp::builder("walk")
        .phase(phase)
        .parameter(Variable::new("speed", "m/s").within(0.0, 4.0))
        .constrain(
            "way",
            [Variable::new("length", "m").within(0.0, 5.0)],
            [At::InitialState("walk", "x"), At::FinalState("walk", "x")],
            Way,
        )
        .objective(
            Sense::Maximize,
            "gain",
            "-",
            [
                Term::End(At::FinalState("walk", "x"), 2.0),
                Term::End(At::FinalTime("walk"), -1.0),
                Term::function([At::InitialState("walk", "y"), At::FinalState("walk", "y")], Way),
            ],
        )
        .build()
        .unwrap();
    let shape = ProfileShape::new(0, 1, vec![Bounds::new(-3.0, 3.0)]);
    let rules = FlightRules::new(shape).steered(Steering::CosSin);
    let shooting = ProfileShooting::new(&ocp, rules.clone()).unwrap();
    assert_eq!(shooting.space().0, [-3.0, 1.0, 0.0, -1.0, 0.0]);
    assert_eq!(shooting.space().1, [3.0, 9.0, 1.0, 1.0, 4.0]);
    let angle = 0.25_f64;
    let flight = shooting.flown(&[angle, 4.0, 1.0, 0.5, 2.0], Flight::clone).unwrap();
    let (x, y) = (0.5 + 6.0 * angle.cos(), 6.0 * angle.sin());
    assert_eq!((flight.initial_time, flight.final_time, &flight.parameters[..]), (1.0, 4.0, &[2.0][..]));
    close(flight.final_state[0], x, ROUNDING);
    close(flight.final_state[1], y, ROUNDING);
    close(flight.objective, -(2.0 * x - 4.0 + y), 10.0 * ROUNDING);
    close(flight.state_misses[0], x - 5.0, ROUNDING);
    let names: Vec<&str> = shooting.end_conditions().iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["way: length", "final time"]);
    // 5.81 m of 5 m; at most 2 s, which it takes 3 for.
    close(flight.end_conditions[0].amount, x - 0.5 - 5.0, ROUNDING);
    close(flight.end_conditions[0].relative, (x - 0.5 - 5.0) / 5.0, ROUNDING);
    close(flight.end_conditions[1].amount, 1.0, ROUNDING);
    let norm = shooting.watched().iter().position(|l| l.quantity == Quantity::Path(0)).unwrap();
    close(flight.peaks[norm].amount, 0.0, 1e-2 * ROUNDING);
    let cosine = shooting.watched().iter().position(|l| l.quantity == Quantity::Control(0)).unwrap();
    close(flight.peaks[cosine].amount, angle.cos() - 1.0, 1e-2 * ROUNDING);
    // The same by a map of the caller, and an angle outside of the bound of its cosine.
    let rules = rules.steered(Steering::map(|a, u| (u[0], u[1]) = (a[0].cos(), a[0].sin())));
    let shooting = ProfileShooting::new(&ocp, rules).unwrap();
    assert_eq!(shooting.flown(&[angle, 4.0, 1.0, 0.5, 2.0], |f| f.objective).unwrap(), flight.objective);
    let back = shooting.flown(&[3.0, 4.0, 1.0, 0.5, 2.0], |f| f.peaks[cosine]).unwrap();
    close(back.amount, -0.5 - 3.0_f64.cos(), 1e-2 * ROUNDING);
    close(back.relative, (-0.5 - 3.0_f64.cos()) / 0.5, 1e-2 * ROUNDING);
}
