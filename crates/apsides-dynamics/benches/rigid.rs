//! Rates of a rigid body with moving masses, with their derivatives.

use std::hint::black_box;

use apsides_ad::{Dynamics, Scalar, dynamics_node};
use apsides_dynamics::aerodynamics::{AxisymmetricAerodynamics, Damping, Interpolation};
use apsides_dynamics::moving_mass::Layout;
use apsides_dynamics::rigid_body::{FlatEarth, Ground, Inertia, RigidBody, Start};
use apsides_dynamics::{Atmosphere, DynamicsError, Ellipsoid, MovingMassVehicle};
use criterion::{Criterion, criterion_group, criterion_main};

struct Full(MovingMassVehicle);

impl Dynamics<13, 6> for Full {
    fn rate<S: Scalar>(&self, t: S, x: &[S; 13], u: &[S; 6], p: &[S; 0]) -> [S; 13] {
        self.0.rate(t, x, u, p)
    }
}

fn flight(
    ground: Ground,
    interpolation: Interpolation,
) -> Result<(MovingMassVehicle, [f64; 13]), DynamicsError> {
    let aerodynamics = AxisymmetricAerodynamics::capsule(interpolation, Damping::constant())?;
    let inertia = Inertia::principal([100.71, 85.2, 85.2])?;
    let body =
        RigidBody::new(ground, Atmosphere::UsStandard1976, aerodynamics, 500.0, inertia, [0.0, 0.01, 0.01])?;
    let start = Start {
        altitude: 25e3,
        speed: 800.0,
        path: -1.5,
        attack: 0.1,
        sideslip: 0.05,
        spin: [0.1, 0.2, -0.1],
        ..Start::default()
    };
    Ok((MovingMassVehicle::new(body, Layout::CROSS, [10.0; 2], 0.2)?, ground.state(&start)?))
}

fn rates(c: &mut Criterion) {
    let Ok(flat) = FlatEarth::wgs84(0.6) else { return };
    for (name, ground, interpolation) in [
        ("flat, linear", Ground::Flat(flat), Interpolation::Linear),
        ("flat, smooth", Ground::Flat(flat), Interpolation::Smooth),
        ("ellipsoid, smooth", Ground::Ellipsoid(Ellipsoid::WGS84), Interpolation::Smooth),
    ] {
        let Ok((vehicle, x)) = flight(ground, interpolation) else { continue };
        c.bench_function(&format!("{name}/quasi-static"), |b| {
            b.iter(|| vehicle.rate(0.0, black_box(&x), black_box(&[0.1, 0.2]), &[]));
        });
        c.bench_function(&format!("{name}/full"), |b| {
            b.iter(|| vehicle.rate(0.0, black_box(&x), black_box(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]), &[]));
        });
        let node = dynamics_node(Full(vehicle));
        let z: Vec<f64> = x.into_iter().chain([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.0]).collect();
        let (mut out, mut jacobian) = ([0.0; 13], vec![0.0; node.pattern().jacobian_len()]);
        c.bench_function(&format!("{name}/full/jacobian"), |b| {
            b.iter(|| node.jacobian(black_box(&z), &mut out, &mut jacobian));
        });
    }
}

criterion_group!(benches, rates);
criterion_main!(benches);
