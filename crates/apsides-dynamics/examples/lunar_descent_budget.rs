//! Propellant of a Hohmann descent from a 100 km lunar orbit to a 15 km perilune, and the deceleration that the engine gives there.
#![allow(clippy::print_stdout)]

use apsides_ad::Dynamics;
use apsides_dynamics::planar::{ConstantThrust, PlanarFlight};
use apsides_dynamics::transfer::Hohmann;
use apsides_dynamics::{Body, DynamicsError, Engine};

fn main() -> Result<(), DynamicsError> {
    let moon = Body::MOON;
    let engine = Engine::new(440.0, 310.0)?;
    let (orbit, perilune) = (moon.radius + 100e3, moon.radius + 15e3);
    let transfer = Hohmann::new(&moon, orbit, perilune)?;
    let mass = engine.mass_after(300.0, transfer.departure_impulse);
    println!("impulse {:.3} m/s, half an ellipse of {:.1} s", transfer.departure_impulse, transfer.duration);
    println!("propellant {:.3} kg of 300 kg", 300.0 - mass);

    // Equations of motion at the perilune, thrust against the motion.
    let lander = ConstantThrust(PlanarFlight::new(moon, engine));
    let state = [perilune, 0.0, transfer.arrival_speed, 0.0, mass];
    let rate = lander.rate(0.0, &state, &[std::f64::consts::PI], &[]);
    println!("speed {:.3} m/s, changing by {:.4} m/s2", transfer.arrival_speed, rate[2]);
    assert!((rate[2] + 440.0 / mass).abs() < 1e-12);
    // Vis-viva on the ellipse, whose angular momentum is the same at both ends.
    assert!((transfer.arrival_speed * perilune - transfer.departure_speed * orbit).abs() < 1e-3);
    // The rocket equation backwards.
    assert!((engine.velocity_change(300.0, mass) - transfer.departure_impulse).abs() < 1e-9);
    Ok(())
}
