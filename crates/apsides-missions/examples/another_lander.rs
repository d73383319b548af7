//! A landing with another engine around the Moon of GRAIL: values are set by their type, and the mission is a struct in SI units.
#![allow(clippy::print_stdout)]

use apsides_missions::lunar::PeriluneLanding;
use apsides_missions::registry;
use apsides_pipeline::Error;

fn main() -> Result<(), Error> {
    let mut mission = registry().load("lunar-perilune", &[])?;
    let printed = mission.solve(None, &mut ())?.summary.results["flight_time_s"];
    mission.set("body", "moon")?;
    mission.set("thrust_n", 500.0)?;
    let lander = mission.mission_as::<PeriluneLanding>().map(|m| m.lander);
    if let Some(lander) = lander {
        let weight = lander.initial_mass * lander.flight.body.surface_gravity();
        println!("thrust by weight: {:.3}", lander.flight.engine.thrust / weight);
    }
    let outcome = mission.solve(None, &mut ())?;
    let time = outcome.summary.results["flight_time_s"];
    println!("{printed:.3} s with 440 N, {time:.3} s with 500 N: {}", outcome.summary.certificate.verdict);
    assert!(outcome.summary.certificate.is_verified());
    // More thrust brakes sooner, by the ratio of the thrusts and a little more.
    assert!((0.8..0.9).contains(&(time / printed)));
    Ok(())
}
