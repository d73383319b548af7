//! A powered descent to Mars with a throttled engine, and what a glide slope costs (Acikmese and Ploen 2007, doi 10.2514/1.27553).
#![allow(clippy::print_stdout)]

use apsides_convex::{ConvexError, DescentLimits, DescentProblem, DescentSettings, DescentSolver, Outcome};

fn main() -> Result<(), ConvexError> {
    // Six engines of 3100 N, canted by 27 deg, between 30 and 80 % of their thrust.
    let cant = 27_f64.to_radians().cos();
    let mut problem = DescentProblem {
        gravity: [0.0, 0.0, -3.7114],
        rotation: [0.0; 3],
        mass: 1905.0,
        dry_mass: 1505.0,
        exhaust_velocity: 225.0 * 9.807 * cant,
        thrust: [0.3, 0.8].map(|throttle| throttle * 6.0 * 3100.0 * cant),
        position: [2000.0, 0.0, 1500.0],
        velocity: [100.0, 0.0, -75.0],
        target: [0.0; 3],
        target_velocity: [0.0; 3],
        limits: DescentLimits::default(),
    };
    let mut propellant = [0.0; 2];
    for (k, glide_slope) in [None, Some(4_f64.to_radians())].into_iter().enumerate() {
        problem.limits.glide_slope = glide_slope;
        let solution = DescentSolver::new(&problem, DescentSettings::default())?.solve()?;
        let lowest = solution.positions.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        println!(
            "glide slope {glide_slope:?} rad: {:.3} kg in {:.2} s, lowest node at {lowest:.1} m, gap of the relaxation {:.1e}",
            solution.propellant, solution.flight_time, solution.relaxation_gap
        );
        assert_eq!(solution.outcome, Outcome::Landed);
        assert!(solution.relaxation_gap < 1e-6);
        propellant[k] = solution.propellant;
    }
    // The optimum with the glide slope is 398.0739 kg.
    assert!((propellant[1] - 398.07).abs() < 0.1 && propellant[0] < propellant[1]);
    Ok(())
}
