//! Switches of controls and path constraints: where they are found, and the discretised problem with breaks.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_nlp::{Flow, IterationRecord, Nlp, Status, check_derivatives};
use apsides_ocp::{
    ArcKind, At, Bounds, Break, Guess, Mesh, Ocp, Phase, PhaseArc, PhaseMesh, State, Variable,
};
use apsides_problems::{Case, find};
use apsides_radau::{Level, Radau, RadauSettings, RadauSolution, Transcription};

/// Discretisation: times of switches that are breaks of the mesh.
const MESH: f64 = 1e-9;

/// Discretisation: ends of a singular arc, on which the objective depends to third order alone.
const SINGULAR: f64 = 1e-4;

/// Discretisation: the same for an arc that oscillates.
const OSCILLATING: f64 = 1e-5;

/// Discretisation: the objective of such an arc, relative.
const OBJECTIVE: f64 = 1e-10;

/// Discretisation: the error of a mesh with breaks in wrong places is above.
const NOWHERE: f64 = 1e-6;

fn case(name: &str) -> Case {
    find(name).unwrap().pose().unwrap()
}

fn solve(name: &str, settings: RadauSettings) -> RadauSolution {
    let case = case(name);
    let solution = Radau { settings }.solve(&case.ocp, &case.guess).unwrap();
    assert_eq!(solution.status, Status::Optimal, "{name}");
    assert!(solution.accurate, "{name}");
    solution
}

fn times(s: &RadauSolution) -> Vec<f64> {
    assert!(s.switches.iter().all(|w| w.located), "{:#?}", s.switches);
    s.switches.iter().map(|w| w.time).collect()
}

fn levels(s: &RadauSolution) -> Vec<Level> {
    s.switches.iter().map(|w| w.from).chain(s.switches.last().map(|w| w.to)).collect()
}

/// Half of the time each, by symmetry.
#[test]
fn double_integrator() {
    let s = solve("di_bang_bang", RadauSettings::default());
    assert!((times(&s)[0] - 0.5).abs() < MESH, "{}", s.switches[0]);
    assert_eq!(levels(&s), [Level::Upper(1.0), Level::Lower(-1.0)]);
    assert_eq!(s.switches[0].to_string(), "phase `move`, u: 1 -> -1 - at t = 0.500000 -");
}

/// `v' = u - BEND u^2`: six millionths of the largest slope of the Hamiltonian are its curvature.
struct Bent;

const BEND: f64 = 1.5e-6;

impl Dynamics<2, 1> for Bent {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - u[0].square() * BEND]
    }
}

/// A control that is all but linear jumps. From rest to rest in one second, `1 - BEND` forwards and `1 + BEND` back: the switch is at
/// `(1 + BEND) / 2`.
#[test]
fn slightly_bent_control() {
    let state = |name: &str| State::new(name, "-").within(-1.0, 1.0).starts_at(0.0);
    let phase = Phase::new("move", Bent)
        .states([state("x"), state("v").ends_at(0.0)])
        .controls([Variable::new("u", "-").within(-1.0, 1.0)])
        .final_time(Bounds::fixed(1.0));
    let ocp = Ocp::builder("bent").phase(phase).maximize("distance", "-", At::FinalState("move", "x"));
    let ocp = ocp.build().unwrap();
    let s = Radau { settings: RadauSettings::default() }.solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(s.status == Status::Optimal && s.accurate && s.meshes.len() <= 3, "{} meshes", s.meshes.len());
    assert_eq!(levels(&s), [Level::Upper(1.0), Level::Lower(-1.0)]);
    assert!((times(&s)[0] - 0.5 * (1.0 + BEND)).abs() < MESH, "{}", times(&s)[0]);
}

/// The burn lasts the optimal impulse over the thrust (closed form of the gallery).
/// Thrust `w` and a quantity `u` whose best value is `0.815 + 0.01 w`.
struct Thrust;

impl Dynamics<2, 2> for Thrust {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

struct Cost;

impl PathFunction<2, 2, 1> for Cost {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [(u[1] - 0.815).square() - u[0] * u[1] * 0.02 + 1.0]
    }
}

/// The limit of a path constraint.
struct Limit;

impl PathFunction<2, 2, 1> for Limit {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[1]]
    }
}

/// A path constraint that leaves its limit of 0.82 by a step of 0.015, where the thrust turns round: half-way in two seconds. A step is told by what
/// pushes against the limit up to there, however small it is beside the size of the quantity.
#[test]
fn small_step_beside_a_switch() {
    let state = |name: &str| State::new(name, "-").starts_at(0.0);
    let phase = Phase::new("move", Thrust)
        .states([state("x").ends_at(1.0), state("v").ends_at(0.0)])
        .controls([Variable::new("w", "-").within(-1.0, 1.0), Variable::new("u", "-")])
        .path([Variable::new("limit", "-").at_most(0.82)], Limit)
        .final_time(Bounds::new(0.5, 10.0))
        .integral(Variable::new("cost", "-"), Cost);
    let ocp = Ocp::builder("small step").phase(phase).minimize_integral("move", "cost").build().unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert_eq!(s.status, Status::Optimal);
    assert!(s.meshes.iter().all(|m| m.error < NOWHERE), "a mesh led nowhere: {:?}", s.meshes);
    assert_eq!(times(&s).len(), 2);
    assert!(times(&s).iter().all(|t| (t - 1.0).abs() < MESH), "{:?}", s.switches);
    assert!((s.trajectory.objective - 1.999825).abs() < MESH, "{}", s.trajectory.objective);
}

/// The height, its rate and the effort of a climb.
struct Climb;

impl PathFunction<2, 1, 1> for Climb {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [x[0] + u[0].square() * 0.05]
    }
}

struct Effort;

impl Dynamics<2, 1> for Effort {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

/// Along the ground for as long as possible: the rate leaves its bound smoothly. A coarse mesh, which leaves the bound out beside the end of the arc,
/// has its optimum below the ground, with the arc gone: that is no place to go on from.
#[test]
fn arcs_that_go_astray_lead_back() {
    let state = |name: &str| State::new(name, "-").starts_at(0.0).at_least(0.0);
    let phase = Phase::new("climb", Effort)
        .states([state("h").ends_at(1.0), state("rate")])
        .controls([Variable::new("u", "-").within(-1.0, 1.0)])
        .final_time(Bounds::fixed(4.0))
        .integral(Variable::new("cost", "-"), Climb);
    let ocp = Ocp::builder("ground").phase(phase).minimize_integral("climb", "cost").build().unwrap();
    let s = Radau::default().solve(&ocp, &Guess::linear(&ocp)).unwrap();
    assert!(s.status == Status::Optimal && s.accurate);
    // tests/references/held_out_closed_forms.py
    assert!((s.trajectory.objective - 0.5391375208444331).abs() < MESH, "{}", s.trajectory.objective);
    assert!(s.meshes.len() <= 8, "{:?}", s.meshes);
}

#[test]
fn moon_lander() {
    let s = solve("moon_lander_soft", RadauSettings::default());
    let burn = find("moon_lander_soft").unwrap().optimum.value / 1.227;
    let found = s.trajectory.phases[0].final_time - times(&s)[0];
    assert!((found - burn).abs() < MESH, "{found} {burn}");
    assert!(s.meshes.len() <= 3);
}

/// Full thrust to the start of the arc at 1 and from its end at 3 (closed form of the gallery).
#[test]
fn singular_arc() {
    let s = solve("di_singular_arc", RadauSettings::default());
    assert_eq!(levels(&s), [Level::Upper(1.0), Level::Between, Level::Lower(-1.0)]);
    for (found, expected) in times(&s).into_iter().zip([1.0, 3.0]) {
        assert!((found - expected).abs() < SINGULAR, "{found} {expected}");
    }
}

/// Along the flow, where a control of full degree oscillates and gains from the error of the rule.
#[test]
fn singular_arc_that_oscillates() {
    let s = solve("catmix", RadauSettings::default());
    let r = (10.0 - 10f64.sqrt()) / 90.0;
    let expected = [((1.0 + r) / (1.0 - 10.0 * r)).ln() / 11.0, 1.0 + (10.0 * r).ln()];
    assert_eq!(levels(&s), [Level::Upper(1.0), Level::Between, Level::Lower(0.0)]);
    for (found, expected) in times(&s).into_iter().zip(expected) {
        assert!((found - expected).abs() < OSCILLATING, "{found} {expected}");
    }
    assert!(find("catmix").unwrap().optimum.relative_difference(s.trajectory.objective).abs() < OBJECTIVE);
}

/// The magnitude of two thrust components jumps as a path constraint; control bounds are never active.
#[test]
fn path_constraint() {
    let s = solve("powered_descent", RadauSettings::default());
    assert!(s.switches.iter().all(|w| w.name == "thrust"));
    assert!(matches!(levels(&s)[..], [Level::Upper(_), Level::Lower(_), Level::Upper(_)]));
}

/// Controls that meet their bounds continuously have no switch, but breaks where they do.
#[test]
fn kinks() {
    let s = solve("van_der_pol", RadauSettings::default());
    assert!(s.switches.is_empty(), "{:#?}", s.switches);
    let mesh = &s.trajectory.phases[0].mesh;
    assert!(mesh.breaks().iter().all(|b| !b.free));
    let course = |course| PhaseArc { controls: vec![Some(course)], rows: vec![] };
    let expected = [ArcKind::Lower, ArcKind::Free, ArcKind::Upper, ArcKind::Free].map(course);
    assert_eq!(mesh.arcs(), expected);
}

#[test]
fn without_switches_nothing_is_looked_for() {
    for name in ["di_min_energy", "linear_tangent", "hypersensitive"] {
        let on = solve(name, RadauSettings::default());
        let off = solve(name, RadauSettings { switches: false, ..RadauSettings::default() });
        assert!(on.switches.is_empty());
        assert_eq!(on.report.x, off.report.x, "{name}");
    }
    let settings = RadauSettings { switches: false, tolerance: 1e-6, ..RadauSettings::default() };
    let off = solve("moon_lander_soft", settings);
    assert!(off.trajectory.phases[0].mesh.breaks().is_empty());
}

/// A mesh of three arcs: a free break, one that is not, every course.
fn arcs(name: &str) -> (Case, Mesh) {
    let case = case(name);
    let arc = |courses: &[Option<ArcKind>], rows: &[Option<ArcKind>]| PhaseArc {
        controls: courses.into(),
        rows: rows.into(),
    };
    let rows = case.ocp.phases[0].path_rows();
    let phase = PhaseMesh::new(vec![0.0, 0.2, 0.35, 0.6, 1.0], vec![3, 4, 2, 5])
        .unwrap()
        .with_arcs(
            vec![
                Break { end: 1, free: true, is_tangent: false },
                Break { end: 3, free: false, is_tangent: false },
            ],
            vec![
                arc(&[Some(ArcKind::Singular)], &vec![Some(ArcKind::Free); rows]),
                arc(&[], &vec![Some(ArcKind::Upper); rows]),
                arc(&[Some(ArcKind::Free)], &[]),
            ],
        )
        .unwrap();
    (case, Mesh { phases: vec![phase] })
}

#[test]
fn derivatives_with_breaks() {
    for name in [
        "rayleigh_path",
        "di_singular_arc",
        "goddard_cops",
        "orbit_raising",
        "bryson_denham_contact",
        "brachistochrone_wall",
    ] {
        let (mut case, mesh) = arcs(name);
        // Fixed times have no derivatives.
        let phase = &mut case.ocp.phases[0];
        (phase.initial_time, phase.final_time) = (Bounds::new(-1.0, 1.0), Bounds::new(0.1, 20.0));
        let mut nlp = Transcription::new(&case.ocp, &mesh, &case.guess).unwrap();
        let mut x = vec![0.0; nlp.variables()];
        nlp.initial_point(&mut x);
        x.iter_mut().zip(0..).for_each(|(v, k)| *v += 1e-2 * f64::sin(f64::from(k)));
        let report = check_derivatives(&mut nlp, &x).unwrap();
        assert!(report.is_within(1e-5), "{name}: {report:?}");
    }
}

/// Start, break, break that is not free, end: a break that is not free stays at its fraction of the phase.
#[test]
fn times_of_breaks() {
    let (case, mesh) = arcs("di_singular_arc");
    let settings = RadauSettings { max_refinements: 0, ..RadauSettings::default() };
    let s = Radau { settings }.solve_on(&case.ocp, &case.guess, mesh, &mut ()).unwrap();
    assert_eq!(s.status, Status::Optimal);
    let mesh = &s.trajectory.phases[0].mesh;
    assert!((mesh.fractions()[3] - 0.6).abs() < MESH, "{:?}", mesh.fractions());
    let share = mesh.fractions()[2];
    let expected = mesh.fractions()[1] + (0.35 - 0.2) / 0.4 * (0.6 - mesh.fractions()[1]);
    assert!((share - expected).abs() < MESH, "{:?}", mesh.fractions());
}

#[test]
fn breaks_that_make_no_mesh_are_refused() {
    let mesh = PhaseMesh::uniform(3, 2).unwrap();
    let at = |end| Break { end, free: true, is_tangent: false };
    for (breaks, arcs) in [(vec![at(0)], 2), (vec![at(3)], 2), (vec![at(2), at(1)], 3), (vec![at(1)], 1)] {
        assert!(mesh.clone().with_arcs(breaks, vec![PhaseArc::default(); arcs]).is_err());
    }
    let arcs = vec![PhaseArc::default(); 3];
    let mesh = mesh.with_arcs(vec![at(1), at(2)], arcs).unwrap();
    assert_eq!(mesh.arc_intervals(1), 1..2);
    assert!(mesh.has_arcs() && !mesh.without_arcs().has_arcs());
}

/// An interrupted solve gives the trajectory of the last mesh that was solved.
#[test]
fn an_interrupted_mesh_leaves_the_one_before() {
    let case = case("goddard_cops");
    let whole = Radau::default().solve(&case.ocp, &case.guess).unwrap();
    let first = whole.meshes[0].counters.iterations;
    let mut seen = 0;
    let mut observer = |_: &IterationRecord| {
        seen += 1;
        if seen > first + 5 { Flow::Stop } else { Flow::Continue }
    };
    let mesh = Mesh::uniform(&case.ocp, 10, 4).unwrap();
    let s = Radau::default().solve_on(&case.ocp, &case.guess, mesh, &mut observer).unwrap();
    assert_eq!(s.status, Status::Interrupted);
    assert_eq!(s.report.status, Status::Optimal);
    assert_eq!((s.meshes.len(), s.accurate), (2, false));
    assert_eq!(s.trajectory.phases[0].mesh.total_points(), s.meshes[0].points);
}

/// The next solve takes breaks and arcs over from the mesh.
#[test]
fn a_solution_starts_the_next_with_its_arcs() {
    for name in ["moon_lander_soft", "free_flying_robot", "shuttle_heat_limit"] {
        let case = case(name);
        let first = solve(name, RadauSettings::default());
        let mesh = Mesh { phases: first.trajectory.phases.iter().map(|p| p.mesh.clone()).collect() };
        let guess = Guess::earlier(&first.trajectory);
        let again = Radau::default().solve_on(&case.ocp, &guess, mesh, &mut ()).unwrap();
        assert_eq!(again.meshes.len(), 1, "{name}");
        assert!(again.report.counters.iterations <= 3, "{name}: {:?}", again.report.counters);
        assert_eq!(again.switches.len(), first.switches.len(), "{name}");
    }
}
