//! A fabricated outcome: a two-phase planar lander on hand-made polynomials.

use std::collections::BTreeMap;
use std::sync::Arc;

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_basis::Lgr;
use apsides_ocp::{
    At, Bounds, Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, State, Trajectory,
    Variable,
};
use apsides_pipeline::{Counters, ObjectiveValue, Outcome, Summary, Timing};
use apsides_verify::{Certificate, Check, CheckKind};

/// Stands for the equations of motion, which nothing here evaluates.
struct Still;

impl<const NX: usize, const NU: usize> Dynamics<NX, NU, 1> for Still {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; NX], _u: &[S; NU], _p: &[S; 1]) -> [S; NX] {
        *x
    }
}

/// A path constraint that nothing here evaluates.
impl PathFunction<5, 1, 2, 1> for Still {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 5], _u: &[S; 1], _p: &[S; 1]) -> [S; 2] {
        [x[0], x[1]]
    }
}

fn states() -> Vec<State> {
    vec![
        State::new("radius", "m").within(1_737_400.0, 1_800_000.0),
        State::new("downrange angle", "rad"),
        State::new("horizontal speed", "m/s").within(-10.0, 1_800.0),
        State::new("radial speed", "m/s"),
        State::new("mass", "kg").within(300.0, 600.0),
    ]
}

/// Braking with one control, descent with a thrust magnitude as well and without the downrange angle.
pub(crate) fn ocp() -> Ocp {
    let angle = || Variable::new("thrust angle", "rad").within(-3.2, 3.2);
    let thrust = Variable::new("thrust", "N").within(150.0, 1_500.0);
    let of_descent: Vec<State> =
        states().into_iter().filter(|s| s.variable.name != "downrange angle").collect();
    Ocp::builder("lander")
        .parameter(Variable::new("site longitude", "rad").within(-1.0, 1.0))
        .phase(
            Phase::new::<_, 5, 1, 1>("braking", Still)
                .states(states())
                .controls([angle()])
                .path([Variable::new("glide slope", "-"), Variable::new("dynamic pressure", "Pa")], Still)
                .final_time(Bounds::new(1.0, 2_000.0)),
        )
        .phase(
            Phase::new::<_, 4, 2, 1>("descent <final>", Still)
                .states(of_descent)
                .controls([thrust, angle()])
                .initial_time(Bounds::new(0.0, 2_000.0))
                .final_time(Bounds::new(1.0, 3_000.0)),
        )
        .link("braking", "descent <final>")
        .maximize("final mass", "kg", At::FinalState("descent <final>", "mass"))
        .build()
        .expect("a problem without mistakes")
}

type Curve<'a> = &'a dyn Fn(f64, usize) -> f64;

/// Polynomials through the values of `curve` (time, component) at Radau points.
pub(crate) fn polynomial(
    breaks: &[f64],
    points: &[usize],
    size: usize,
    support: bool,
    curve: Curve<'_>,
) -> PiecewisePolynomial {
    let segments = points
        .iter()
        .enumerate()
        .map(|(k, n)| {
            let rule = Lgr::new(*n).expect("few points");
            let nodes = if support { rule.support() } else { rule.nodes() };
            let time = |x: &f64| breaks[k] + 0.5 * (breaks[k + 1] - breaks[k]) * (x + 1.0);
            let last = nodes.len() - 1;
            // The end of one interval is the start of the next, to the last bit.
            let times = nodes
                .iter()
                .enumerate()
                .map(|(j, x)| if j == last && support { breaks[k + 1] } else { time(x) });
            let values = times.flat_map(|t| (0..size).map(move |c| curve(t, c))).collect();
            let basis = apsides_basis::Barycentric::new(nodes).expect("distinct nodes");
            Segment { basis: Arc::new(basis), values }
        })
        .collect();
    PiecewisePolynomial::new(size, breaks.to_vec(), segments).expect("fits")
}

/// A phase on given breaks and points per interval.
pub(crate) fn phase(
    name: &str,
    breaks: &[f64],
    points: &[usize],
    (states, state): (usize, Curve<'_>),
    (controls, control): (usize, Curve<'_>),
) -> PhaseTrajectory {
    let (start, end) = (breaks[0], breaks[breaks.len() - 1]);
    let fractions = breaks.iter().map(|b| (b - start) / (end - start)).collect();
    PhaseTrajectory {
        name: name.into(),
        initial_time: start,
        final_time: end,
        mesh: PhaseMesh::new(fractions, points.into()).expect("increasing"),
        state: polynomial(breaks, points, states, true, state),
        control: polynomial(breaks, points, controls, false, control),
        costate: Some(polynomial(breaks, points, states, true, &|t, c| (0.001 * t + c as f64).cos() * 1e-4)),
        path_multipliers: None,
        contacts: Vec::new(),
        integral_multipliers: None,
        interval_errors: (0..points.len()).map(|k| 1e-6 * 0.2f64.powi(k as i32)).collect(),
    }
}

fn lander_state(t: f64, c: usize) -> f64 {
    let s = t / 1_000.0;
    match c {
        0 => 1_737_400.0 + 15_000.0 * (1.0 - s) * (1.0 - s) * (1.0 + s),
        1 => 0.24 * (2.0 * s - s * s),
        2 => 1_692.0 * (1.0 - s),
        3 => -60.0 * s * (1.0 - s) * 2.0,
        _ => 600.0 * (-0.62 * s).exp(),
    }
}

pub(crate) fn trajectory() -> Trajectory {
    let braking = phase(
        "braking",
        &[0.0, 150.0, 400.0, 610.0, 800.0],
        &[4, 5, 3, 6],
        (5, &lander_state),
        (1, &|t, _| 3.1 - 0.002 * t),
    );
    let descent = phase(
        "descent <final>",
        &[800.0, 850.0, 1_000.0],
        &[3, 4],
        (4, &|t, c| lander_state(t, if c == 0 { 0 } else { c + 1 })),
        (2, &|t, c| {
            if c == 0 { if t < 850.0 { 1_500.0 } else { 150.0 } } else { 1.5 + 0.0004 * (t - 800.0) }
        }),
    );
    Trajectory {
        phases: vec![braking, descent],
        parameters: vec![0.1],
        objective: lander_state(1_000.0, 4),
        constraint_multipliers: None,
    }
}

pub(crate) fn outcome() -> Outcome {
    let check =
        |name: &str, kind, value, limit, unit: &str, at: &str| Check::new(name, kind, value, limit, unit, at);
    let (feasibility, optimality) = (CheckKind::Feasibility, CheckKind::Optimality);
    let certificate = Certificate::new(vec![
        check("re-simulated radius at the end", feasibility, 0.0123, 1.0, "m", "descent <final>, 1000 s"),
        check(
            "re-simulated radial speed at the end",
            feasibility,
            3.1e-6,
            1e-3,
            "m/s",
            "descent <final>, 1000 s",
        ),
        check("thrust above its upper bound", feasibility, 0.0, 1e-3, "N", "everywhere"),
        check("costate equations", optimality, 8.4e-5, 1e-4, "-", "braking, 150 s"),
        check("stationarity of the Hamiltonian", optimality, 3.2e-4, 1e-4, "-", "descent <final>, 850 s"),
        check("switching function", optimality, f64::NAN, 1e-4, "-", "not evaluated"),
    ]);
    let results = [
        ("flight_time_s", 1_000.0),
        ("final_mass_kg", lander_state(1_000.0, 4)),
        ("touchdown_speed_m_per_s", 2.3e-9),
        ("downrange_km", 417.123_456_789),
        ("peak_thrust_n", 1_500.0),
        ("undefined_deg", f64::NAN),
    ];
    Outcome {
        headline: Vec::new(),
        curves: Vec::new(),
        ocp: ocp(),
        trajectory: trajectory(),
        reduced: None,
        status: apsides_nlp::Status::Optimal,
        report: None,
        summary: Summary {
            mission: "lunar landing <test> & more".into(),
            method: "radau".into(),
            solved_by: "radau".into(),
            message: None,
            explanation: None,
            status: "optimal".into(),
            objective: ObjectiveValue {
                name: "final_mass".into(),
                value: lander_state(1_000.0, 4),
                unit: "kg".into(),
            },
            results: results.into_iter().map(|(k, v)| (k.to_owned(), v)).collect::<BTreeMap<_, _>>(),
            counters: Counters {
                iterations: 63,
                factorisations: 71,
                variables: 412,
                constraints: 377,
                mesh_iterations: 4,
            },
            timing_ms: Timing { build: 1.234, solve: 48.1, verify: 6.02 },
            certificate,
            warnings: Vec::new(),
            search: None,
            switches: Vec::new(),
            sites: Vec::new(),
            sensitivity: None,
        },
        decisions: apsides_pipeline::Decisions::default(),
        mission_file: "# A lander\n[mission]\nname = \"lunar landing <test> & more\"\n\n[vehicle]\ninitial_mass_kg = 600.0\nisp_s = 300.0\n".into(),
        explanation: None,
        kept: None,
    }
}
