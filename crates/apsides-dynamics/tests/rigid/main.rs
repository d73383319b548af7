//! Rigid bodies and moving masses: the published descent of a capsule, conservation laws, derivatives.

#![allow(clippy::unwrap_used)]

use apsides_ad::Dynamics;
use apsides_dynamics::aerodynamics::{AxisymmetricAerodynamics, Damping, Interpolation};
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia, RigidBody, Start};
use apsides_dynamics::{Atmosphere, DynamicsError};

mod conservation;
mod derivatives;
mod descent;
mod limits;

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Inertia of the capsule: that of the command module of Apollo scaled to 500 kg and 1.5 m.
const INERTIA: [f64; 3] = [100.71072, 85.20192, 85.20192];

/// The capsule of the moving-mass problem with its centre of mass off the axis by `y` and `z` (m).
fn capsule(
    ground: Ground,
    atmosphere: Atmosphere,
    interpolation: Interpolation,
    damping: Damping,
    [y, z]: [f64; 2],
) -> Result<RigidBody, DynamicsError> {
    let aerodynamics = AxisymmetricAerodynamics::capsule(interpolation, damping)?;
    RigidBody::new(ground, atmosphere, aerodynamics, 500.0, Inertia::principal(INERTIA)?, [0.0, y, z])
}

/// Flat Earth with the gravity of WGS 84 at 35 deg.
fn flat() -> Ground {
    Ground::Flat(FlatEarth::wgs84(35.0 * DEG).unwrap())
}

/// Entry of the capsule: 100 km, 700 m/s, 85 deg downwards, angle of attack and sideslip 2 deg.
const ENTRY: Start = Start {
    longitude: 0.0,
    latitude: 35.0 * DEG,
    altitude: 100e3,
    speed: 700.0,
    path: -85.0 * DEG,
    azimuth: 0.0,
    bank: 0.0,
    attack: 2.0 * DEG,
    sideslip: 2.0 * DEG,
    spin: [0.0; 3],
};

/// One step of the classical Runge-Kutta method.
fn step<M: Dynamics<NX, NU>, const NX: usize, const NU: usize>(
    model: &M,
    [t, h]: [f64; 2],
    x: &[f64; NX],
    control: impl Fn(f64) -> [f64; NU],
) -> [f64; NX] {
    let rate = |t: f64, x: &[f64; NX]| model.rate(t, x, &control(t), &[]);
    let moved = |k: &[f64; NX], h: f64| -> [f64; NX] { std::array::from_fn(|i| x[i] + h * k[i]) };
    let k1 = rate(t, x);
    let k2 = rate(t + 0.5 * h, &moved(&k1, 0.5 * h));
    let k3 = rate(t + 0.5 * h, &moved(&k2, 0.5 * h));
    let k4 = rate(t + h, &moved(&k3, h));
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}
