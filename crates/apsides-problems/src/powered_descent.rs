//! Mars powered descent with least propellant: thrust between two limits, which is full, least, full.
//!
//! ```text
//! minimise m(0) - m(tf),   x'' = Tx/m - g,   z'' = Tz/m,   m' = -alpha |T|,   T1 <= |T| <= T2
//! (x, z) = (1500, 2000) m,   (x', z') = (-75, 100) m/s,   m = 1905 kg   ->   rest at the origin, m >= 1505 kg
//! g = 3.7114,   T1, T2 = 0.3, 0.8 of 6 x 3100 N cos 27 deg,   alpha = 1 / (225 s g0 cos 27 deg)
//! ```
//!
//! Case a of B. Acikmese and S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353, doi 10.2514/1.27553: altitude `x` may
//! become negative. The motion stays in a plane. Their flight time of 72 s is the best on a grid of whole seconds. That
//! the last thrust be vertical binds one instant only and is left out. Guess: straight lines, 75 s, half of `T2`
//! upwards.

use apsides_ad::vector::norm;
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, Sense, State, Term, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "powered_descent",
    title: "Mars landing with least propellant",
    structure: Structure::BangBang,
    optimum: Optimum {
        value: 387.9,
        unit: "kg",
        relative_tolerance: 1e-3,
        evidence: Evidence::Published,
        source: "Acikmese and Ploen 2007, case a",
    },
    pose,
};

const WET_MASS_KG: f64 = 1905.0;
const DRY_MASS_KG: f64 = 1505.0;
const GRAVITY_M_S2: f64 = 3.7114;
/// Six engines of 3100 N.
const ENGINES_N: f64 = 6.0 * 3100.0;
const ISP_S: f64 = 225.0;
const STANDARD_GRAVITY_M_S2: f64 = 9.807;
const CANT_DEG: f64 = 27.0;

/// `alpha`, s/m.
struct Lander {
    flow_per_thrust: f64,
}

impl Dynamics<5, 2> for Lander {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 5], u: &[S; 2], _p: &[S; 0]) -> [S; 5] {
        let flow = norm(u, 0.0) * self.flow_per_thrust;
        [x[2], x[3], u[0] / x[4] - GRAVITY_M_S2, u[1] / x[4], -flow]
    }
}

struct ThrustMagnitude;

impl PathFunction<5, 2, 1> for ThrustMagnitude {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 5], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [norm(u, 0.0)]
    }
}

fn pose() -> Result<Case, OcpError> {
    let cant = CANT_DEG.to_radians().cos();
    let thrust = |throttle: f64| throttle * ENGINES_N * cant;
    let flow_per_thrust = 1.0 / (ISP_S * STANDARD_GRAVITY_M_S2 * cant);
    let phase = Phase::new("descent", Lander { flow_per_thrust })
        .states([
            State::new("x", "m").within(-2000.0, 4000.0).starts_at(1500.0).ends_at(0.0),
            State::new("z", "m").within(-2000.0, 6000.0).starts_at(2000.0).ends_at(0.0),
            State::new("vx", "m/s").within(-200.0, 200.0).starts_at(-75.0).ends_at(0.0),
            State::new("vz", "m/s").within(-200.0, 200.0).starts_at(100.0).ends_at(0.0),
            State::new("mass", "kg").within(DRY_MASS_KG, WET_MASS_KG).starts_at(WET_MASS_KG),
        ])
        .controls([
            Variable::new("thrust up", "N").within(-thrust(0.8), thrust(0.8)),
            Variable::new("thrust across", "N").within(-thrust(0.8), thrust(0.8)),
        ])
        .path([Variable::new("thrust", "N").within(thrust(0.3), thrust(0.8))], ThrustMagnitude)
        .final_time(Bounds::new(20.0, 150.0));
    let propellant = [
        Term::End(At::InitialState("descent", "mass"), 1.0),
        Term::End(At::FinalState("descent", "mass"), -1.0),
    ];
    let ocp = Ocp::builder(PROBLEM.name)
        .phase(phase)
        .objective(Sense::Minimize, "propellant", "kg", propellant)
        .objective_scale(100.0)
        .build()?;
    let control = [thrust(0.4), 0.0];
    let (start, end) = ([1500.0, 2000.0, -75.0, 100.0, WET_MASS_KG], [0.0, 0.0, 0.0, 0.0, 1520.0]);
    Case::from_ends(ocp, (0.0, &start, &control), (75.0, &end, &control))
}
