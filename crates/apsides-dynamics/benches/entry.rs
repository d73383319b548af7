//! Rates of entry flight with their derivatives: constant coefficients in an exponential atmosphere, and tables in the standard
//! atmosphere.

use std::hint::black_box;

use apsides_ad::{Dynamics, dynamics_node};
use apsides_dynamics::aerodynamics::MachTable;
use apsides_dynamics::atmosphere::Exponential;
use apsides_dynamics::entry::{Banked, EntryFlight, Heading};
use apsides_dynamics::{Aerodynamics, Atmosphere, DynamicsError, EntryVehicle, HeatingLaw, Planet};
use criterion::{Criterion, criterion_group, criterion_main};

fn flight(atmosphere: Atmosphere, aerodynamics: Aerodynamics) -> Result<EntryFlight, DynamicsError> {
    let vehicle = EntryVehicle::new(2800.0, 6.1575, 3.36, aerodynamics)?;
    Ok(EntryFlight::new(Planet::earth(atmosphere), vehicle, Heading::FromEast, HeatingLaw::CAPSULE))
}

fn rates(c: &mut Criterion) {
    let constant = Aerodynamics::Constant { lift: 0.408_15, drag: 1.2569 };
    let cases = [
        ("exponential", flight(Atmosphere::Exponential(Exponential::EARTH), constant)),
        ("tables", flight(Atmosphere::UsStandard1976, Aerodynamics::Mach(MachTable::apollo_10()))),
    ];
    let x = [60e3, 0.9, 0.5, 6800.0, -0.04, -0.8];
    let z = [x[0], x[1], x[2], x[3], x[4], x[5], 0.8, 0.0];
    for (name, flight) in cases {
        let Ok(flight) = flight else { continue };
        let model = Banked(flight);
        c.bench_function(&format!("{name}/value"), |b| {
            b.iter(|| model.rate(0.0, black_box(&x), black_box(&[0.8]), &[]));
        });
        let node = dynamics_node(model);
        let mut out = [0.0; 6];
        let mut jacobian = vec![0.0; node.pattern().jacobian_len()];
        c.bench_function(&format!("{name}/jacobian"), |b| {
            b.iter(|| node.jacobian(black_box(&z), &mut out, &mut jacobian));
        });
        let mut hessian = vec![0.0; node.pattern().hessian_len()];
        c.bench_function(&format!("{name}/hessian"), |b| {
            b.iter(|| node.hessian(black_box(&z), black_box(&[1.0; 6]), &mut hessian));
        });
    }
}

criterion_group!(benches, rates);
criterion_main!(benches);
