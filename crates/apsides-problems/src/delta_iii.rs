//! Ascent of a Delta III to a transfer orbit: four phases with dropped masses, greatest payload and fuel at the end.
//!
//! ```text
//! maximise m(tf),   r' = v,   v' = -mu r/|r|^3 + (T u + D) / m,   m' = -flow,   |u| = 1
//! D = -rho S CD |w| w / 2,   w = v - omega x r,   rho = 1.225 exp(-(|r| - Re) / 7200)
//! end: a = 24361.14 km, e = 0.7308, i = 28.5 deg, node 269.8 deg, argument of perigee 130.5 deg
//! ```
//!
//! D. Benson, thesis MIT 2005; J. T. Betts, Practical Methods for Optimal Control, 2010. The orbit is
//! stated by its angular momentum and the two components of its eccentricity vector in the orbital plane, which are
//! smooth. The constraint `|r| >= Re` is never active and is left out. Guess: arc from the launch site to the perigee
//! of the orbit, velocity in a straight line, thrust along the inertial `y`.

use std::f64::consts::PI;

use apsides_ad::vector::{cross, dot, norm};
use apsides_ad::{Dynamics, PathFunction, Scalar, VectorFunction};
use apsides_ocp::{At, Bounds, Guess, Ocp, OcpBuilder, OcpError, Phase, PhaseGuess, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "delta_iii",
    title: "ascent of a launcher in four phases",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 7_529.712_287,
        unit: "kg",
        relative_tolerance: 1e-6,
        evidence: Evidence::SeveralPrograms,
        source: "yapss, tests/examples/test_delta_iii_ascent.py; Betts 7529.712",
    },
    pose,
};

const MU: f64 = 3.986_012e14;
/// Radius of the Earth, m.
pub const EARTH_RADIUS: f64 = 6_378_145.0;
const EARTH_RATE: f64 = 7.292_115_85e-5;
const LAUNCH_LATITUDE_DEG: f64 = 28.5;
/// `S CD / 2`, m2.
const HALF_DRAG_AREA: f64 = 0.5 * 0.5 * 4.0 * PI;

/// One kind of motor: masses in kg, thrust in N, burn time in s.
struct Motor {
    total: f64,
    propellant: f64,
    thrust: f64,
    burn: f64,
}

const BOOSTER: Motor = Motor { total: 19_290.0, propellant: 17_010.0, thrust: 628_500.0, burn: 75.2 };
const FIRST: Motor = Motor { total: 104_380.0, propellant: 95_550.0, thrust: 1_083_100.0, burn: 261.0 };
const SECOND: Motor = Motor { total: 19_300.0, propellant: 16_820.0, thrust: 110_094.0, burn: 700.0 };
const PAYLOAD: f64 = 4164.0;
const LIFT_OFF_MASS: f64 = 9.0 * BOOSTER.total + FIRST.total + SECOND.total + PAYLOAD;

impl Motor {
    const fn dry(&self) -> f64 {
        self.total - self.propellant
    }

    const fn flow(&self) -> f64 {
        self.propellant / self.burn
    }
}

/// A stage of the launcher: the motors that burn in a phase, until when, and the mass that is dropped at its end.
struct Stage {
    name: &'static str,
    thrust: f64,
    flow: f64,
    end: f64,
    dropped: f64,
}

fn stages() -> [Stage; 4] {
    let with_boosters = |name, boosters: f64, dropped: f64, end| Stage {
        name,
        thrust: boosters * BOOSTER.thrust + FIRST.thrust,
        flow: boosters * BOOSTER.flow() + FIRST.flow(),
        end,
        dropped,
    };
    [
        with_boosters("six boosters", 6.0, 6.0 * BOOSTER.dry(), BOOSTER.burn),
        with_boosters("three boosters", 3.0, 3.0 * BOOSTER.dry(), 2.0 * BOOSTER.burn),
        with_boosters("first stage", 0.0, FIRST.dry(), FIRST.burn),
        Stage {
            name: "second stage",
            thrust: SECOND.thrust,
            flow: SECOND.flow(),
            end: FIRST.burn + SECOND.burn,
            dropped: 0.0,
        },
    ]
}

/// Powered flight above a rotating Earth.
struct Ascent {
    thrust: f64,
    flow: f64,
}

impl Dynamics<7, 3> for Ascent {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 7] {
        let [rx, ry, rz, vx, vy, vz, m] = *x;
        let radius = norm(&[rx, ry, rz], 0.0);
        let gravity = radius.powi(-3) * -MU;
        let wind = [vx + ry * EARTH_RATE, vy - rx * EARTH_RATE, vz];
        let density = ((radius - EARTH_RADIUS) / -7200.0).exp() * 1.225;
        let drag = density * norm(&wind, 1e-6) * -HALF_DRAG_AREA;
        let acceleration = |r: S, u: S, w: S| gravity * r + (u * self.thrust + drag * w) / m;
        let flow = S::from(-self.flow);
        [
            vx,
            vy,
            vz,
            acceleration(rx, u[0], wind[0]),
            acceleration(ry, u[1], wind[1]),
            acceleration(rz, u[2], wind[2]),
            flow,
        ]
    }
}

struct DirectionInSpace;

impl PathFunction<7, 3, 1> for DirectionInSpace {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 7], u: &[S; 3], _p: &[S; 0]) -> [S; 1] {
        [dot(u, u)]
    }
}

/// End of one phase less start of the next.
struct Separation;

impl VectorFunction<14, 7> for Separation {
    fn evaluate<S: Scalar>(&self, z: &[S; 14]) -> [S; 7] {
        std::array::from_fn(|k| z[k] - z[k + 7])
    }
}

/// Perifocal axes `P` (to the perigee), `Q` and `W` (normal) of the target.
struct Perifocal {
    p: [f64; 3],
    q: [f64; 3],
    w: [f64; 3],
}

const SEMI_MAJOR_AXIS: f64 = 24_361_140.0;
const ECCENTRICITY: f64 = 0.7308;

impl Perifocal {
    fn target() -> Self {
        let (si, ci) = 28.5_f64.to_radians().sin_cos();
        let (sn, cn) = 269.8_f64.to_radians().sin_cos();
        let (sw, cw) = 130.5_f64.to_radians().sin_cos();
        Self {
            p: [cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si],
            q: [-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si],
            w: [sn * si, -cn * si, ci],
        }
    }
}

/// Angular momentum per `sqrt(mu p)`, and eccentricity vector along `P` and `Q`.
struct OrbitShape(Perifocal);

impl VectorFunction<6, 5> for OrbitShape {
    fn evaluate<S: Scalar>(&self, z: &[S; 6]) -> [S; 5] {
        let (r, v) = ([z[0], z[1], z[2]], [z[3], z[4], z[5]]);
        let h = cross(&r, &v);
        let v_cross_h = cross(&v, &h);
        let radius = norm(&r, 0.0);
        let eccentricity: [S; 3] = std::array::from_fn(|k| v_cross_h[k] / MU - r[k] / radius);
        let along = |axis: &[f64; 3]| dot(&eccentricity, &axis.map(S::from));
        let momentum = angular_momentum();
        [h[0] / momentum, h[1] / momentum, h[2] / momentum, along(&self.0.p), along(&self.0.q)]
    }
}

fn angular_momentum() -> f64 {
    (MU * SEMI_MAJOR_AXIS * (1.0 - ECCENTRICITY * ECCENTRICITY)).sqrt()
}

const STATES: [&str; 7] = ["rx", "ry", "rz", "vx", "vy", "vz", "mass"];

/// Position and velocity at lift-off.
fn launch() -> [f64; 6] {
    let (sin, cos) = LAUNCH_LATITUDE_DEG.to_radians().sin_cos();
    [EARTH_RADIUS * cos, 0.0, EARTH_RADIUS * sin, 0.0, EARTH_RATE * EARTH_RADIUS * cos, 0.0]
}

fn phase(stage: &Stage, begin: f64) -> Phase {
    let launch = (begin == 0.0).then(launch);
    let states = STATES.iter().enumerate().map(|(k, name)| {
        let state = match k {
            0..3 => {
                State::new(*name, "m").within(-2.0 * EARTH_RADIUS, 2.0 * EARTH_RADIUS).scaled_by(EARTH_RADIUS)
            }
            3..6 => State::new(*name, "m/s").within(-1e4, 1e4).scaled_by(1e4),
            _ => State::new(*name, "kg").within(PAYLOAD, LIFT_OFF_MASS).scaled_by(1e5),
        };
        match launch {
            Some(_) if k == 6 => state.starts_at(LIFT_OFF_MASS),
            Some(start) => state.starts_at(start[k]),
            None => state,
        }
    });
    let last = stage.dropped == 0.0;
    Phase::new(stage.name, Ascent { thrust: stage.thrust, flow: stage.flow })
        .states(states)
        .controls(["ux", "uy", "uz"].map(|name| Variable::new(name, "-").within(-1.1, 1.1)))
        .initial_time(Bounds::fixed(begin))
        .final_time(if last { Bounds::new(begin + 100.0, stage.end) } else { Bounds::fixed(stage.end) })
        .path([Variable::new("length of the direction", "-").equal_to(1.0)], DirectionInSpace)
}

/// Position and velocity continuous, mass dropped.
fn separate(builder: OcpBuilder, from: &Stage, to: &Stage) -> OcpBuilder {
    let row = |k: usize| match k {
        0..3 => Variable::new(STATES[k], "m").equal_to(0.0).scaled_by(EARTH_RADIUS),
        3..6 => Variable::new(STATES[k], "m/s").equal_to(0.0).scaled_by(1e4),
        _ => Variable::new(STATES[k], "kg").equal_to(from.dropped).scaled_by(1e5),
    };
    let end = |k: usize| {
        if k < 7 { At::FinalState(from.name, STATES[k]) } else { At::InitialState(to.name, STATES[k - 7]) }
    };
    let name = format!("separation after {}", from.name);
    builder.constrain(
        name,
        std::array::from_fn::<_, 7, _>(row),
        std::array::from_fn::<_, 14, _>(end),
        Separation,
    )
}

fn pose() -> Result<Case, OcpError> {
    let stages = stages();
    let mut begin = 0.0;
    let mut builder = Ocp::builder(PROBLEM.name);
    for stage in &stages {
        builder = builder.phase(phase(stage, begin));
        begin = stage.end;
    }
    for pair in stages.windows(2) {
        builder = separate(builder, &pair[0], &pair[1]);
    }
    let target = Perifocal::target();
    let momentum =
        |axis: &str, value: f64| Variable::new(format!("angular momentum {axis}"), "-").equal_to(value);
    let rows = [
        momentum("x", target.w[0]),
        momentum("y", target.w[1]),
        momentum("z", target.w[2]),
        Variable::new("eccentricity to the perigee", "-").equal_to(ECCENTRICITY),
        Variable::new("eccentricity across", "-").equal_to(0.0),
    ];
    let ends = std::array::from_fn::<_, 6, _>(|k| At::FinalState("second stage", STATES[k]));
    let ocp = builder
        .constrain("transfer orbit", rows, ends, OrbitShape(target))
        .maximize("final mass", "kg", At::FinalState("second stage", "mass"))
        .objective_scale(1e4)
        .build()?;
    let guess = guess(&ocp, &stages)?;
    Ok(Case { ocp, guess })
}

/// Samples per phase, so that the arc keeps above the ground.
const GUESS_SAMPLES: usize = 9;

fn guess(ocp: &Ocp, stages: &[Stage; 4]) -> Result<Guess, OcpError> {
    let Perifocal { p, q, .. } = Perifocal::target();
    let start = launch();
    let perigee = SEMI_MAJOR_AXIS * (1.0 - ECCENTRICITY);
    let speed = angular_momentum() / perigee;
    let final_time = stages[3].end;
    let (mut begin, mut mass) = (0.0, LIFT_OFF_MASS);
    let mut phases = Vec::new();
    for stage in stages {
        let times: Vec<f64> = (0..GUESS_SAMPLES)
            .map(|k| begin + (stage.end - begin) * k as f64 / (GUESS_SAMPLES - 1) as f64)
            .collect();
        let row = |t: &f64| {
            let s = t / final_time;
            let chord: [f64; 3] = std::array::from_fn(|k| (1.0 - s) * start[k] + s * perigee * p[k]);
            let lift = ((1.0 - s) * EARTH_RADIUS + s * perigee) / norm(&chord, 0.0);
            let mut x: Vec<f64> = chord.iter().map(|c| c * lift).collect();
            x.extend((0..3).map(|k| (1.0 - s) * start[3 + k] + s * speed * q[k]));
            x.push(mass - stage.flow * (t - begin));
            x
        };
        let states = times.iter().map(row).collect();
        phases.push(PhaseGuess::samples(&times, states, vec![vec![0.0, 1.0, 0.0]; GUESS_SAMPLES])?);
        mass -= stage.flow * (stage.end - begin) + stage.dropped;
        begin = stage.end;
    }
    Ok(Guess::from_phases(ocp, phases))
}
