//! Re-entry of a capsule: a rotating spherical Earth, exponential atmosphere, constant coefficients (after S. Alami Naeini, J.
//! Roshanian, Modares Mechanical Engineering 14(13), 2014, equation 23; the azimuth is from east, positive to north).

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Variable};
use apsides_ode::Direction;
use apsides_shooting::profile::{FlightRules, Independent, ProfileScore, ProfileShape, Steering, Stop};

const MU: f64 = 3.986_004_418e14;
const RADIUS: f64 = 6_378_137.0;
const ROTATION: f64 = 7.292_115e-5;
const MASS: f64 = 2800.0;
const AREA: f64 = 6.157_521_601_035_993;
const LIFT: f64 = 0.40815;
const DRAG: f64 = 1.2569;
/// Stagnation heat rate `k v^3 sqrt(rho)`, W/m2.
const HEATING: f64 = 1.294e-4;

/// Altitude, longitude and latitude where the flight ends.
pub(crate) const TARGET: [f64; 3] = [15_000.0, 59.99, 22.98];

/// States: altitude, longitude, latitude, speed, flight path angle, azimuth. Controls: cosine and sine of the bank angle.
struct Capsule;

fn density<S: Scalar>(altitude: S) -> S {
    (altitude / -7200.0).exp() * 1.225
}

fn pressure<S: Scalar>(x: &[S; 6]) -> S {
    density(x[0]) * x[3].square() * 0.5
}

impl Dynamics<6, 2> for Capsule {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 6] {
        let [h, _, lat, v, path, azimuth] = *x;
        let r = h + RADIUS;
        let (sin_lat, cos_lat) = lat.sin_cos();
        let (sin_path, cos_path) = path.sin_cos();
        let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
        let force = pressure(x) * (AREA / MASS);
        let (lift, drag) = (force * LIFT, force * DRAG);
        let gravity = (r.square() / MU).recip();
        let spin = r * cos_lat * (ROTATION * ROTATION);
        let turn = v / r * cos_path;
        [
            v * sin_path,
            v * cos_path * cos_azimuth / (r * cos_lat),
            turn * sin_azimuth,
            -drag - gravity * sin_path + spin * (sin_path * cos_lat - cos_path * sin_lat * sin_azimuth),
            (lift * u[0] - gravity * cos_path
                + spin * (cos_path * cos_lat + sin_path * sin_lat * sin_azimuth))
                / v
                + turn
                + cos_lat * cos_azimuth * (2.0 * ROTATION),
            (lift * u[1] / cos_path - spin / cos_path * sin_lat * cos_azimuth) / v
                - turn * cos_azimuth * sin_lat / cos_lat
                + (sin_path / cos_path * cos_lat * sin_azimuth - sin_lat) * (2.0 * ROTATION),
        ]
    }
}

/// Dynamic pressure, total aerodynamic acceleration, heat rate.
struct Loads;

impl PathFunction<6, 2, 3> for Loads {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 6], u: &[S; 2], p: &[S; 0]) -> [S; 3] {
        let q = pressure(x);
        let [heat] = HeatRate.evaluate(t, x, u, p);
        [q, q * (AREA / MASS * LIFT.hypot(DRAG)), heat]
    }
}

/// The norm of the bank vector.
struct Norm;

impl PathFunction<6, 2, 1> for Norm {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square()]
    }
}

struct HeatRate;

impl PathFunction<6, 2, 1> for HeatRate {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 6], _u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [x[3].powi(3) * density(x[0]).sqrt() * HEATING]
    }
}

/// Least heat load, in J/m2, with limits of 15 kPa, 40 m/s2, 800 kW/m2.
pub(crate) fn ocp() -> Ocp {
    let angle = |name, start: f64, scale: f64| {
        State::new(name, "rad").within(-3.2, 3.2).starts_at(start.to_radians()).scaled_by(scale)
    };
    let phase = Phase::new("entry", Capsule)
        .states([
            State::new("altitude", "m").within(0.0, 200e3).starts_at(120e3).ends_at(TARGET[0]).scaled_by(1e5),
            angle("longitude", 41.5, 0.3).ends_at(TARGET[1].to_radians()),
            angle("latitude", 40.5, 0.3).ends_at(TARGET[2].to_radians()),
            State::new("speed", "m/s").within(10.0, 9e3).starts_at(7500.0).scaled_by(7500.0),
            angle("path angle", -2.0, 1.0),
            angle("azimuth", -45.0, 1.0),
        ])
        .controls([
            Variable::new("cosine of bank", "-").within(-1.0, 1.0),
            Variable::new("sine of bank", "-").within(-1.0, 1.0),
        ])
        .final_time(Bounds::new(100.0, 2000.0))
        .path(
            [
                Variable::new("dynamic pressure", "Pa").at_most(15e3),
                Variable::new("acceleration", "m/s2").at_most(40.0),
                Variable::new("heat rate", "W/m2").at_most(800e3),
            ],
            Loads,
        )
        .path([Variable::new("squared norm", "-").equal_to(1.0)], Norm)
        .integral(Variable::new("heat load", "J/m2").scaled_by(1e8), HeatRate);
    Ocp::builder("capsule").phase(phase).minimize_integral("entry", "heat load").build().expect("well posed")
}

/// Specific mechanical energy, of the speed relative to the Earth.
pub(crate) fn energy(x: &[f64]) -> f64 {
    0.5 * x[3] * x[3] - MU / (RADIUS + x[0])
}

/// A bank angle of this shape as a function of the energy, to the end altitude; the speed there is 200 to 300 m/s.
pub(crate) fn in_energy(shape: ProfileShape) -> FlightRules {
    let end = energy(&[TARGET[0], 0.0, 0.0, 250.0]);
    in_time(shape).of(Independent::energy(end, energy))
}

/// The same as a function of time.
pub(crate) fn in_time(shape: ProfileShape) -> FlightRules {
    let stop = Stop { state: 0, value: TARGET[0], direction: Direction::Falling };
    FlightRules::new(shape).steered(Steering::CosSin).until(stop)
}

/// Bounds of the bank angle.
pub(crate) fn bank() -> Vec<Bounds> {
    vec![Bounds::new(-std::f64::consts::PI, std::f64::consts::PI)]
}

/// 0.2 MJ/m2 per km missed, 100 MJ/m2 per excess as large as the limit.
pub(crate) fn score() -> ProfileScore {
    let per_radian = 0.2e6 * RADIUS / 1e3;
    let cosine = TARGET[2].to_radians().cos();
    ProfileScore {
        miss_weights: vec![0.0, per_radian * cosine, per_radian, 0.0, 0.0, 0.0],
        miss_tolerances: vec![0.0; 6],
        excess_weight: 100e6,
        excess_tolerance: 1e-9,
    }
}
