//! Minimum time to climb of a supersonic fighter, with thrust, aerodynamics and atmosphere from tables.
//!
//! ```text
//! minimise tf,   h' = v sin g,   v' = (T cos a - D)/m - g0 sin g,   g' = (T sin a + L)/(m v) - g0 cos g / v
//! m' = -T / (g0 Isp),   L = q S CLa a,   D = q S (CD0 + eta CLa a^2),   q = rho v^2 / 2
//! T(M, h), CLa(M), CD0(M), eta(M), M = v / c(h),   S = 530 ft2,   Isp = 1600 s,   g0 = 32.174 ft/s2
//! (h, v, g): (0, 424.26 ft/s, 0) -> (65600 ft, 968.148 ft/s, 0),   m(0) = 42000 lb / g0
//! -40 <= g <= 40 deg,   -45 <= a <= 45 deg,   0 <= h <= 69000 ft
//! ```
//!
//! A. Bryson, M. Desai, W. Hoffman, J. Aircraft 6 (1969) 481, doi 10.2514/3.44093; the tables as in the example `climb` of
//! PSOPT, where the corners that the report leaves open are filled, and the US Standard Atmosphere 1976 at every
//! 5000 ft. Between the entries stand cubic splines with not-a-knot ends ([`apsides_ad::spline`]).
//!
//! The interpolant decides the fourth digit of the optimum: yapss finds 320.45 s with a radial-basis thrust and flattened
//! splines, PSOPT 321.11 s with a lapse rate that goes on above 11 km, dymos 321.0 s; with the
//! splines here it is 320.72134 s from three initial meshes. The tolerance is the spread of these values.
//! Guess: straight lines in 300 s, no angle of attack.

use apsides_ad::{AdError, BicubicSpline, CubicSpline, Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, State, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "min_time_climb",
    title: "fastest climb with tables of thrust, aerodynamics and atmosphere",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 320.45,
        unit: "s",
        relative_tolerance: 1e-3,
        evidence: Evidence::Published,
        source: "yapss, test_minimum_time_to_climb.py",
    },
    pose,
};

const GRAVITY_FT_S2: f64 = 32.174;
const WING_AREA_FT2: f64 = 530.0;
const ISP_S: f64 = 1600.0;
const WET_MASS_SLUG: f64 = 42_000.0 / GRAVITY_FT_S2;

const AERODYNAMICS_MACH: [f64; 9] = [0.0, 0.4, 0.8, 0.9, 1.0, 1.2, 1.4, 1.6, 1.8];
const LIFT_SLOPE: [f64; 9] = [3.44, 3.44, 3.44, 3.58, 4.44, 3.44, 3.01, 2.86, 2.44];
const ZERO_LIFT_DRAG: [f64; 9] = [0.013, 0.013, 0.013, 0.014, 0.031, 0.041, 0.039, 0.036, 0.035];
const ETA: [f64; 9] = [0.54, 0.54, 0.54, 0.75, 0.79, 0.78, 0.89, 0.93, 0.93];

const THRUST_MACH: [f64; 10] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8];
/// Thousands of ft.
const THRUST_ALTITUDE: [f64; 10] = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 70.0];
/// Thousands of lbf, a row per Mach number.
const THRUST: [[f64; 10]; 10] = [
    [24.2, 24.0, 20.3, 17.3, 14.5, 12.2, 10.2, 5.7, 3.4, 0.1],
    [28.0, 24.6, 21.1, 18.1, 15.2, 12.8, 10.7, 6.5, 3.9, 0.2],
    [28.3, 25.2, 21.9, 18.7, 15.9, 13.4, 11.2, 7.3, 4.4, 0.4],
    [30.8, 27.2, 23.8, 20.5, 17.3, 14.7, 12.3, 8.1, 4.9, 0.8],
    [34.5, 30.3, 26.6, 23.2, 19.8, 16.8, 14.1, 9.4, 5.6, 1.1],
    [37.9, 34.3, 30.4, 26.8, 23.3, 19.8, 16.8, 11.2, 6.8, 1.4],
    [36.1, 38.0, 34.9, 31.3, 27.3, 23.6, 20.1, 13.4, 8.3, 1.7],
    [34.3, 36.6, 38.5, 36.1, 31.6, 28.1, 24.2, 16.2, 10.0, 2.2],
    [32.5, 35.2, 42.1, 38.7, 35.7, 32.0, 28.1, 19.3, 11.9, 2.9],
    [30.7, 33.8, 45.7, 41.3, 39.8, 34.6, 31.1, 21.7, 13.3, 3.1],
];

/// Step of the atmosphere table, thousands of ft, from sea level.
const ATMOSPHERE_STEP: f64 = 5.0;
/// Millionths of slug/ft3.
const DENSITY: [f64; 19] = [
    2377.0, 2048.0, 1756.0, 1496.0, 1267.0, 1066.0, 890.7, 738.2, 587.3, 462.3, 363.9, 286.5, 225.6, 177.7,
    139.2, 109.1, 85.71, 67.43, 53.15,
];
/// ft/s.
const SOUND_SPEED: [f64; 19] = [
    1116.5, 1097.1, 1077.4, 1057.4, 1036.9, 1016.1, 994.8, 973.1, 968.1, 968.1, 968.1, 968.1, 968.1, 968.1,
    970.9, 974.3, 977.6, 981.0, 984.3,
];

struct Fighter {
    thrust: BicubicSpline,
    lift_slope: CubicSpline,
    zero_lift_drag: CubicSpline,
    eta: CubicSpline,
    density: CubicSpline,
    sound_speed: CubicSpline,
}

impl Fighter {
    fn new() -> Result<Self, AdError> {
        let of_mach = |values: &[f64]| CubicSpline::new(&AERODYNAMICS_MACH, values);
        let altitudes: [f64; 19] = std::array::from_fn(|k| k as f64 * ATMOSPHERE_STEP);
        let of_altitude = |values: &[f64]| CubicSpline::new(&altitudes, values);
        Ok(Self {
            thrust: BicubicSpline::new(&THRUST_MACH, &THRUST_ALTITUDE, THRUST.as_flattened())?,
            lift_slope: of_mach(&LIFT_SLOPE)?,
            zero_lift_drag: of_mach(&ZERO_LIFT_DRAG)?,
            eta: of_mach(&ETA)?,
            density: of_altitude(&DENSITY)?,
            sound_speed: of_altitude(&SOUND_SPEED)?,
        })
    }
}

impl Dynamics<4, 1> for Fighter {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 4], u: &[S; 1], _p: &[S; 0]) -> [S; 4] {
        let [h, v, gamma, mass] = *x;
        let attack = u[0];
        let altitude = h * 1e-3;
        let mach = v / self.sound_speed.at(altitude);
        let thrust = self.thrust.at(mach, altitude) * 1e3;
        let pressure_area = self.density.at(altitude) * v.square() * (0.5e-6 * WING_AREA_FT2);
        let lift_slope = self.lift_slope.at(mach);
        let lift = pressure_area * lift_slope * attack;
        let drag = pressure_area * self.zero_lift_drag.at(mach) + lift * self.eta.at(mach) * attack;
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let (sin_attack, cos_attack) = attack.sin_cos();
        [
            v * sin_gamma,
            (thrust * cos_attack - drag) / mass - sin_gamma * GRAVITY_FT_S2,
            (thrust * sin_attack + lift) / (mass * v) - cos_gamma / v * GRAVITY_FT_S2,
            thrust / -(GRAVITY_FT_S2 * ISP_S),
        ]
    }
}

#[expect(clippy::expect_used, reason = "invariant: the tables of this module fit")]
fn pose() -> Result<Case, OcpError> {
    let fighter = Fighter::new().expect("invariant: the tables of this module fit");
    let rad = f64::to_radians;
    let phase = Phase::new("climb", fighter)
        .states([
            State::new("altitude", "ft").within(0.0, 69_000.0).starts_at(0.0).ends_at(65_600.0),
            State::new("speed", "ft/s").within(1.0, 2000.0).starts_at(424.26).ends_at(968.148),
            State::new("path angle", "rad").within(rad(-40.0), rad(40.0)).starts_at(0.0).ends_at(0.0),
            State::new("mass", "slug").within(10.0, 45_000.0 / GRAVITY_FT_S2).starts_at(WET_MASS_SLUG),
        ])
        .controls([Variable::new("angle of attack", "rad").within(rad(-45.0), rad(45.0))])
        .final_time(Bounds::new(100.0, 800.0));
    let ocp = Ocp::builder(PROBLEM.name)
        .phase(phase)
        .minimize("climb time", "s", At::FinalTime("climb"))
        .build()?;
    let start = [0.0, 424.26, 0.0, WET_MASS_SLUG];
    let end = [65_600.0, 968.148, 0.0, WET_MASS_SLUG];
    Case::from_ends(ocp, (0.0, &start, &[0.0]), (300.0, &end, &[0.0]))
}
