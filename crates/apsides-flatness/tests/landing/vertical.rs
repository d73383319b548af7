//! Vertical flight: one output, thrust with its sign; what squaring loses; two phases.

use apsides_ad::{FlatMap, Scalar};
use apsides_dynamics::planar::flat::{FlatConstantThrust, FlatVerticalThrust};
use apsides_dynamics::planar::{ConstantThrust, VerticalThrust};
use apsides_flatness::{FlatSystem, Flatness, Placement};
use apsides_ocp::{At, Bounds, Guess, Ocp, Phase, PhaseGuess, State, Variable};
use apsides_verify::Verdict;

use crate::lander::{Landing, TOUCHDOWN_SPEED};
use crate::{MESH_MISS_M, MESH_TIME_S, certificate, miss};

/// Solver: the speed at a gate, which the altitude gives, m/s.
const GATE_M_S: f64 = 1e-6;

/// Published: half a unit of the last digit of the polar angle, deg.
const PUBLISHED_DEG: f64 = 5e-6;

/// Discretisation: the flight time where the flat map loses rank, s.
const RANK_LOSS_S: f64 = 1e-3;

/// The residual of the vertical flight squared, which does not tell up from down.
#[derive(Clone, Copy)]
struct Squared(FlatVerticalThrust);

impl FlatMap<1, 3, 3, 0, 1> for Squared {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 3]; 1], p: &[S; 0]) -> ([S; 3], [S; 0], [S; 1]) {
        let thrust = self.0.0.flight.engine.thrust;
        let (x, u, [residual]) = self.0.evaluate(t, y, p);
        (x, u, [(residual + thrust).square() - thrust * thrust])
    }

    fn outputs(&self, t: f64, x: &[f64; 3], u: &[f64; 0], p: &[f64; 0]) -> [f64; 1] {
        self.0.outputs(t, x, u, p)
    }
}

/// Vertical flight in the states of the planar one, at the polar angle of a static parameter.
#[derive(Clone, Copy)]
struct AtAngle(FlatVerticalThrust);

impl FlatMap<1, 3, 5, 1, 1, 1> for AtAngle {
    fn evaluate<S: Scalar>(&self, t: S, y: &[[S; 3]; 1], p: &[S; 1]) -> ([S; 5], [S; 1], [S; 1]) {
        let ([r, v, m], [], residual) = self.0.evaluate(t, y, &[]);
        ([r, p[0], S::from(0.0), v, m], [S::from(std::f64::consts::FRAC_PI_2)], residual)
    }

    fn outputs(&self, _t: f64, x: &[f64; 5], _u: &[f64; 1], _p: &[f64; 1]) -> [f64; 1] {
        [x[0]]
    }
}

fn states(landing: &Landing) -> [State; 3] {
    let [r, _, _, v, m] = landing.states();
    let free = |s: State| State { initial: Bounds::FREE, terminal: Bounds::FREE, ..s };
    [free(r), free(v), free(m)]
}

/// Braking to a gate, then vertical descent, as in table 3 with both phases optimal.
fn two_phases(landing: &Landing, gate: f64) -> (Ocp, Guess) {
    let surface = landing.flight.body.radius;
    let [r, phi, u, v, m] = landing.states();
    let braking = Phase::new("braking", ConstantThrust(landing.flight))
        .states([r.ends_at(surface + gate), phi, u, State { terminal: Bounds::FREE, ..v }, m])
        .controls([Variable::new("thrust angle", "rad").scaled_by(1.0)])
        .final_time(Bounds::new(300.0, 2000.0));
    let [r, v, m] = states(landing);
    let descent = Phase::new("descent", VerticalThrust(landing.flight))
        .states([r.ends_at(surface), v.ends_at(TOUCHDOWN_SPEED), m])
        .initial_time(Bounds::new(300.0, 2000.0))
        .final_time(Bounds::new(300.0, 2000.0));
    let ocp = Ocp::builder("lunar landing in two phases")
        .phase(braking)
        .phase(descent)
        .link("braking", "descent")
        .minimize("flight time", "s", At::FinalTime("descent"))
        .objective_scale(1000.0)
        .build()
        .unwrap();
    let speed = -(gate * landing.flight.body.surface_gravity()).sqrt();
    let braking = landing.guess_to(surface + gate, speed);
    let begin = braking.final_time;
    let end = begin + 2.0 * gate / speed.abs();
    let mass = |t: f64| landing.mass - t * landing.flight.engine.mass_flow();
    let rows = vec![vec![surface + gate, speed, mass(begin)], vec![surface, TOUCHDOWN_SPEED, mass(end)]];
    let descent = PhaseGuess::samples(&[begin, end], rows, vec![vec![]; 2]).unwrap();
    (ocp.clone(), Guess::from_phases(&ocp, vec![braking, descent]))
}

#[test]
fn two_phases_meet_the_optimum() {
    let landing = Landing::from_perilune(15e3);
    let maps = [landing.system(), FlatSystem::new(FlatVerticalThrust(landing.flat()))];
    // Gate, total time, radial speed at the gate.
    for (gate, total, speed) in [
        (5e3, 1036.346337936439, -109.64263848880935),
        (4e3, 1031.730449948327, -98.20080827163227),
        (3e3, 1026.5994207858944, -85.20648581660842),
        (2e3, 1020.6553452674615, -69.77251745004816),
        (1e3, 1013.1302850041927, -49.61513567030749),
    ] {
        let (ocp, guess) = two_phases(&landing, gate);
        let solution = Flatness::default().solve(&ocp, &maps, &guess).unwrap();
        assert!(solution.accurate, "{gate}: {:?}", solution.solves);
        assert!((solution.trajectory.objective - total).abs() < MESH_TIME_S, "{gate}");
        let gate_speed =
            solution.trajectory.phases[1].state_at(solution.trajectory.phases[1].initial_time)[1];
        assert!((gate_speed - speed).abs() < GATE_M_S, "{gate}: {gate_speed}");
        let certificate = certificate(&ocp, &solution);
        assert!(certificate.is_verified(), "{certificate:#?}");
        assert!(miss(&certificate, "radius") < MESH_MISS_M);
    }
}

/// The linkage of the mass follows from that of the times, and the start mass is met by construction: no rows.
#[test]
fn what_the_map_makes_a_function_of_time_has_no_row() {
    let landing = Landing::from_perilune(15e3);
    let (ocp, guess) = two_phases(&landing, 2e3);
    let maps = [landing.system(), FlatSystem::new(FlatVerticalThrust(landing.flat()))];
    let mut method = Flatness::default();
    method.settings.spline.refine = false;
    let solution = method.solve(&ocp, &maps, &guess).unwrap();
    // Order 6, 4 segments of 4 points: 18 coefficients an output; two times, since the linked ones are one. 16 + 16 residuals;
    // 4 + 2 states at the ends of braking, 2 at touchdown; duration of the descent; linkage of radius and radial speed.
    assert_eq!(solution.solves[0].counters.variables, 3 * 18 + 2);
    assert_eq!(solution.solves[0].counters.constraints, 32 + 6 + 2 + 1 + 2);
    // A map with another mass cannot meet the start.
    let heavier = FlatConstantThrust { mass: landing.mass + 1.0, ..landing.flat() };
    let wrong = [FlatSystem::new(heavier), maps[1].clone()];
    let message = method.solve(&ocp, &wrong, &guess).unwrap_err().to_string();
    assert!(message.contains("mass at the start") && message.contains("no variable"), "{message}");
    // Nor its linkage.
    let wrong = [maps[0].clone(), FlatSystem::new(FlatVerticalThrust(heavier))];
    let message = method.solve(&ocp, &wrong, &guess).unwrap_err().to_string();
    assert!(message.contains("link braking-descent: mass"), "{message}");
}

/// The descent in planar states, its polar angle a static parameter that the linkage determines.
#[test]
fn polar_angle_as_a_parameter() {
    let landing = Landing::from_perilune(15e3);
    let (template, guess) = two_phases(&landing, 2e3);
    let surface = landing.flight.body.radius;
    let [r, phi, u, v, m] = landing.states();
    let free = |s: State| State { initial: Bounds::FREE, terminal: Bounds::FREE, ..s };
    let mut braking = template.phases[0].clone();
    // The descent has no horizontal speed, and the linkage says the same of the end of braking.
    braking.states[2].terminal = Bounds::FREE;
    let descent = Phase::new("descent", ConstantThrust(landing.flight))
        .states([free(r).ends_at(surface), free(phi), free(u), free(v).ends_at(TOUCHDOWN_SPEED), free(m)])
        .controls([Variable::new("thrust angle", "rad").scaled_by(1.0)])
        .initial_time(Bounds::new(300.0, 2000.0))
        .final_time(Bounds::new(300.0, 2000.0));
    let ocp = Ocp::builder("two phases in planar states")
        .parameter(Variable::new("site", "rad").within(0.0, 3.0))
        .phase(braking)
        .phase(descent)
        .link("braking", "descent")
        .minimize("flight time", "s", At::FinalTime("descent"))
        .objective_scale(1000.0)
        .build()
        .unwrap();
    let planar = |x: &[f64; 3], t: f64| vec![x[0], 0.5, 0.0, x[1], landing.mass - t * 0.14];
    let g = &guess.phases[1];
    let (mut a, mut b) = ([0.0; 3], [0.0; 3]);
    g.state(0.0, &mut a);
    g.state(1.0, &mut b);
    let times = [g.initial_time, g.final_time];
    let rows = vec![planar(&a, times[0]), planar(&b, times[1])];
    let descent = PhaseGuess::samples(&times, rows, vec![vec![1.5]; 2]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![guess.phases[0].clone(), descent]);
    let vertical = FlatVerticalThrust(landing.flat());
    let maps = [landing.system(), FlatSystem::new(AtAngle(vertical))];
    let solution = Flatness::default().solve(&ocp, &maps, &guess).unwrap();
    assert!(solution.accurate, "{:?}", solution.solves);
    assert!((solution.trajectory.objective - 1020.6553452674615).abs() < MESH_TIME_S);
    // 28.18182 deg.
    assert!((solution.trajectory.parameters[0].to_degrees() - 28.18182).abs() < PUBLISHED_DEG);
}

/// Down from 10 km with 80 m/s in least time: a squared residual lets the engine push down.
#[test]
fn reversed_thrust_is_seen() {
    let landing = Landing::from_perilune(15e3);
    let surface = landing.flight.body.radius;
    let [r, v, m] = states(&landing);
    let phase = Phase::new("fall", VerticalThrust(landing.flight))
        .states([r.starts_at(surface + 10e3).ends_at(surface), v.starts_at(-80.0), m.starts_at(landing.mass)])
        .final_time(Bounds::new(10.0, 2000.0));
    let ocp = Ocp::builder("fall")
        .phase(phase)
        .minimize("time", "s", At::FinalTime("fall"))
        .objective_scale(100.0)
        .build()
        .unwrap();
    let guess = |time: f64, speed: f64| {
        let rows = vec![
            vec![surface + 10e3, -80.0, landing.mass],
            vec![surface, speed, landing.mass - 0.1447 * time],
        ];
        let phase = PhaseGuess::samples(&[0.0, time], rows, vec![vec![]; 2]).unwrap();
        Guess::from_phases(&ocp, vec![phase])
    };
    let vertical = FlatVerticalThrust(landing.flat());
    let with_sign = FlatSystem::new(vertical);
    let right = Flatness::default().solve(&ocp, &[with_sign], &guess(120.0, -90.0)).unwrap();
    assert!(right.accurate, "{:?}", right.solves);
    assert!(certificate(&ocp, &right).is_verified());

    let squared = FlatSystem::new(Squared(vertical));
    let wrong = Flatness::default().solve(&ocp, &[squared], &guess(60.0, -250.0)).unwrap();
    assert!(wrong.status.is_success());
    assert!(wrong.trajectory.objective < 0.7 * right.trajectory.objective);
    assert!(!wrong.accurate && wrong.error > 1e-3, "{}", wrong.error);
    assert_eq!(certificate(&ocp, &wrong).verdict, Verdict::Rejected);
    // It is given up before the splines are refined without end.
    assert!(wrong.solves.len() <= 6, "{:?}", wrong.solves);
}

/// Two outputs on a vertical flight: where the polar angle stands still the squared residual does not depend on it. The solve may
/// fail; it must not claim what is not so.
#[test]
fn rank_loss_at_zero_angular_rate() {
    let landing = Landing::from_perilune(15e3);
    let surface = landing.flight.body.radius;
    let (time, speed) = (36.237798, -49.61513567030749);
    let mass = landing.mass - 976.892487 * landing.flight.engine.mass_flow();
    let [r, phi, u, v, m] = landing.states();
    let phase = Phase::new("descent", ConstantThrust(landing.flight))
        .states([r.starts_at(surface + 1e3), phi, u.starts_at(0.0), v.starts_at(speed), m.starts_at(mass)])
        .controls([Variable::new("thrust angle", "rad").scaled_by(1.0)])
        .final_time(Bounds::new(10.0, 100.0));
    let ocp = Ocp::builder("descent")
        .phase(phase)
        .minimize("time", "s", At::FinalTime("descent"))
        .objective_scale(100.0)
        .build()
        .unwrap();
    let rows = vec![
        vec![surface + 1e3, 0.0, 0.0, speed, mass],
        vec![surface, 0.0, 0.0, TOUCHDOWN_SPEED, mass - 5.0],
    ];
    let phase = PhaseGuess::samples(&[0.0, 40.0], rows, vec![vec![1.5]; 2]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![phase]);
    for presolve in [true, false] {
        let mut method = crate::method(6, 15, Placement::Uniform, true);
        method.settings.presolve = presolve;
        method.settings.nlp.max_iterations = 300;
        let system = FlatSystem::new(FlatConstantThrust { mass, ..landing.flat() });
        let solution = method.solve(&ocp, &[system], &guess).unwrap();
        let certified = certificate(&ocp, &solution).verdict != Verdict::Rejected;
        let claimed = solution.status.is_success() && solution.accurate;
        assert!(certified || !claimed, "{} {:?}", solution.status, solution.solves);
        if claimed {
            assert!(
                (solution.trajectory.objective - time).abs() < RANK_LOSS_S,
                "{}",
                solution.trajectory.objective
            );
        }
    }
}

/// The two phases in 15 uniform points each, both with the planar map, as the paper has them: 62 variables, 44 constraints; CasADi and
/// Ipopt find 1036.222 s, and with Gauss points the optimum within 1 ms.
#[test]
fn two_phases_of_the_paper() {
    let landing = Landing::from_perilune(15e3);
    let (template, guess) = two_phases(&landing, 5e3);
    let surface = landing.flight.body.radius;
    let [r, phi, u, v, m] = landing.states();
    let free = |s: State| State { initial: Bounds::FREE, terminal: Bounds::FREE, ..s };
    let descent = Phase::new("descent", ConstantThrust(landing.flight))
        .states([
            free(r).ends_at(surface),
            free(phi),
            free(u).ends_at(0.0),
            free(v).ends_at(TOUCHDOWN_SPEED),
            free(m),
        ])
        .controls([Variable::new("thrust angle", "rad").scaled_by(1.0)])
        .initial_time(Bounds::new(300.0, 2000.0))
        .final_time(Bounds::new(300.0, 2000.0));
    let ocp = Ocp::builder("two planar phases")
        .phase(template.phases[0].clone())
        .phase(descent)
        .link("braking", "descent")
        .minimize("flight time", "s", At::FinalTime("descent"))
        .objective_scale(1000.0)
        .build()
        .unwrap();
    let g = &guess.phases[1];
    let times = [g.initial_time, g.final_time];
    let rows = [0.0, 1.0].map(|s| {
        let mut x = [0.0; 3];
        g.state(s, &mut x);
        vec![x[0], 0.49, 0.0, x[1], x[2]]
    });
    let descent = PhaseGuess::samples(&times, rows.into(), vec![vec![1.5]; 2]).unwrap();
    let guess = Guess::from_phases(&ocp, vec![guess.phases[0].clone(), descent]);
    for (placement, total, tolerance) in
        [(Placement::Uniform, 1036.222, 5e-4), (Placement::Gauss, 1036.346338, 1e-3)]
    {
        let method = crate::method(6, 15, placement, false);
        let solution = method.solve(&ocp, &[landing.system(), landing.system()], &guess).unwrap();
        assert!(solution.status.is_success(), "{placement:?}: {}", solution.status);
        assert_eq!(
            (solution.solves[0].counters.variables, solution.solves[0].counters.constraints),
            (62, 44)
        );
        assert!((solution.trajectory.objective - total).abs() < tolerance, "{placement:?}");
        assert!(!solution.accurate);
        assert_eq!(certificate(&ocp, &solution).verdict, Verdict::Rejected);
    }
}
