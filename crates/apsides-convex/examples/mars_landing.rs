//! A powered descent to Mars with a throttled engine, and what a glide slope costs (Acikmese and Ploen 2007, doi 10.2514/1.27553).
#![allow(clippy::print_stdout)]

use apsides_convex::{ConvexError, DescentProblem, DescentSettings, DescentSolver, Outcome};

fn main() -> Result<(), ConvexError> {
    // Six engines of 3100 N, canted by 27 deg, between 30 and 80 % of their thrust; 1905 kg at 1500 m, 2000 m aside.
    let mut problem = DescentProblem::mars_lander();
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
        assert!(solution.is_global_optimum() && solution.relaxation_gap < 1e-6);
        propellant[k] = solution.propellant;
    }
    // The optimum with the glide slope is 398.0739 kg.
    assert!((propellant[1] - 398.07).abs() < 0.1 && propellant[0] < propellant[1]);
    Ok(())
}
