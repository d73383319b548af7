//! Re-entry of the Space Shuttle with the largest cross-range.
//!
//! ```text
//! maximise latitude(tf);   altitude h, longitude, latitude th, speed v, flight path angle g, azimuth psi
//! h'  = v sin g                               v'   = -D/m - mu/r^2 sin g
//! lon' = v cos g sin psi / (r cos th)         g'   = L cos b / (m v) + cos g (v/r - mu/(v r^2))
//! th' = v cos g cos psi / r                   psi' = L sin b / (m v cos g) + v cos g sin psi tan th / r
//! -90 <= alpha <= 90 deg,   -90 <= b <= 1 deg,   h, v, g: (260000 ft, 25600 ft/s, -1 deg) -> (80000, 2500, -5)
//! ```
//!
//! J. T. Betts, Practical Methods for Optimal Control, 2010; feet, slugs, seconds. Several programs agree
//! on 34.141 deg. Guess: straight lines, 2000 s, angle of attack 17 deg, bank from -75 to 0 deg.

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{At, Bounds, Ocp, OcpError, Phase, Sense, State, Term, Variable};

use crate::{Case, Evidence, Optimum, Problem, Structure};

/// The problem.
pub const PROBLEM: Problem = Problem {
    name: "shuttle_reentry",
    title: "re-entry with the largest cross-range",
    structure: Structure::Smooth,
    optimum: Optimum {
        value: 34.1412,
        unit: "deg",
        relative_tolerance: 2e-5,
        evidence: Evidence::SeveralPrograms,
        source: "PSOPT, shuttle_reentry.cxx (IPOPT and SQP runs); ASSET, test_Reentry.py",
    },
    pose,
};

const MASS_SLUG: f64 = 203_000.0 / 32.174;
const EARTH_RADIUS_FT: f64 = 20_902_900.0;
const MU_FT3_S2: f64 = 1.407_653_9e16;
const SEA_LEVEL_DENSITY: f64 = 0.002_378;
const SCALE_HEIGHT_FT: f64 = 23_800.0;
const WING_AREA_FT2: f64 = 2690.0;

/// Density at an altitude in ft, slug/ft3.
pub(crate) fn density<S: Scalar>(altitude: S) -> S {
    (altitude / -SCALE_HEIGHT_FT).exp() * SEA_LEVEL_DENSITY
}

struct Glider;

impl Dynamics<6, 2> for Glider {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 6] {
        let [h, _, latitude, v, gamma, psi] = *x;
        let attack = u[0] * 1.0_f64.to_degrees();
        let lift_coefficient = attack * 0.029_244 - 0.207_04;
        let drag_coefficient = attack.square() * 6.214_08e-4 - attack * 6.1592e-3 + 0.078_54;
        let pressure_area = density(h) * v.square() * (0.5 * WING_AREA_FT2 / MASS_SLUG);
        let (lift, drag) = (pressure_area * lift_coefficient, pressure_area * drag_coefficient);
        let r = h + EARTH_RADIUS_FT;
        let gravity = r.powi(-2) * MU_FT3_S2;
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();
        let (sin_bank, cos_bank) = u[1].sin_cos();
        [
            v * sin_gamma,
            v * cos_gamma * sin_psi / (r * latitude.cos()),
            v * cos_gamma * cos_psi / r,
            -drag - gravity * sin_gamma,
            lift * cos_bank / v + cos_gamma * (v / r - gravity / v),
            lift * sin_bank / (v * cos_gamma) + v * cos_gamma * sin_psi * latitude.tan() / r,
        ]
    }
}

/// Name of the phase.
pub(crate) const PHASE: &str = "entry";

/// The entry without limits on its heating.
pub(crate) fn phase() -> Phase {
    let rad = f64::to_radians;
    let steep = rad(89.0);
    Phase::new(PHASE, Glider)
        .states([
            State::new("altitude", "ft").within(0.0, 300_000.0).starts_at(260_000.0).ends_at(80_000.0),
            State::new("longitude", "rad")
                .within(rad(-180.0), rad(180.0))
                .scaled_by(rad(180.0))
                .starts_at(0.0),
            State::new("latitude", "rad").within(-steep, steep).starts_at(0.0),
            State::new("speed", "ft/s").within(100.0, 30_000.0).starts_at(25_600.0).ends_at(2500.0),
            State::new("path angle", "rad").within(-steep, steep).starts_at(rad(-1.0)).ends_at(rad(-5.0)),
            State::new("azimuth", "rad").within(rad(-180.0), rad(180.0)).starts_at(rad(90.0)),
        ])
        .controls([
            Variable::new("angle of attack", "rad").within(rad(-90.0), rad(90.0)),
            Variable::new("bank", "rad").within(rad(-90.0), rad(1.0)),
        ])
        .final_time(Bounds::new(500.0, 4000.0))
}

/// The problem of one entry phase: largest cross-range.
pub(crate) fn largest_cross_range(name: &str, phase: Phase) -> Result<Case, OcpError> {
    let latitude = Term::End(At::FinalState(PHASE, "latitude"), 1.0_f64.to_degrees());
    let ocp = Ocp::builder(name)
        .phase(phase)
        .objective(Sense::Maximize, "cross-range", "deg", [latitude])
        .objective_scale(10.0)
        .build()?;
    from_straight_lines(ocp)
}

/// The guess of this module for a problem with one entry phase.
pub(crate) fn from_straight_lines(ocp: Ocp) -> Result<Case, OcpError> {
    let rad = f64::to_radians;
    let start = [260_000.0, 0.0, 0.0, 25_600.0, rad(-1.0), rad(90.0)];
    let end = [80_000.0, rad(60.0), rad(30.0), 2500.0, rad(-5.0), rad(10.0)];
    Case::from_ends(ocp, (0.0, &start, &[rad(17.0), rad(-75.0)]), (2000.0, &end, &[rad(17.0), 0.0]))
}

fn pose() -> Result<Case, OcpError> {
    largest_cross_range(PROBLEM.name, phase())
}
