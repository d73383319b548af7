//! An eccentric orbit of the Earth: time and height of the apoapsis by an event, and the error after ten periods.
#![allow(clippy::print_stdout)]

use apsides_ode::{Direction, Event, EventLog, FnSystem, Integrator, OdeError, OdeSettings, Status};

/// Gravitational parameter of the Earth, m3/s2.
const MU: f64 = 3.986_004_418e14;

fn main() -> Result<(), OdeError> {
    let (perigee, apogee) = (6.678e6_f64, 42.164e6_f64);
    let semi_major_axis = 0.5 * (perigee + apogee);
    let speed = (MU * (2.0 / perigee - 1.0 / semi_major_axis)).sqrt();
    let period = std::f64::consts::TAU * (semi_major_axis.powi(3) / MU).sqrt();

    let orbit = FnSystem::new(4, |_t, x, dx| {
        let cubed = (x[0] * x[0] + x[1] * x[1]).powf(1.5);
        dx.copy_from_slice(&[x[2], x[3], -MU * x[0] / cubed, -MU * x[1] / cubed]);
    });
    let start = [perigee, 0.0, 0.0, speed];
    let mut integrator = Integrator::new(4, OdeSettings::default())?;

    // The radial speed falls through zero at the apoapsis.
    let radial = |_t: f64, x: &[f64]| x[0] * x[2] + x[1] * x[3];
    let apoapsis = Event::new(&radial).directed(Direction::Falling).terminal();
    let (mut end, mut log) = ([0.0; 4], EventLog::default());
    let half = integrator.integrate_observed(&orbit, 1.0, &start, period, &mut end, &[apoapsis], &mut log)?;
    println!("apoapsis after {:.6} s at {:.3} m", half.time - 1.0, end[0].hypot(end[1]));
    assert_eq!(half.status, Status::Event(0));
    assert!((end[0].hypot(end[1]) - apogee).abs() < 1e-2);
    assert!((half.time - 1.0 - 0.5 * period).abs() < 1e-4);

    let summary = integrator.integrate(&orbit, 0.0, &start, 10.0 * period, &mut end)?;
    let miss = (end[0] - start[0]).hypot(end[1] - start[1]);
    println!("ten periods of {period:.3} s: {miss:.2e} m off; {:?}", summary.statistics);
    assert!(miss < 10.0);
    Ok(())
}
