//! The largest box with a given surface: `max x y z` subject to `2 (x y + y z + z x) = 6`. It is the unit cube, and one more square metre
//! of surface is worth a quarter of a cubic metre.
#![allow(clippy::print_stdout)]

use apsides_nlp::{InteriorPoint, Nlp, NlpError, Pattern, Status, check_derivatives};

struct LargestBox;

impl Nlp for LargestBox {
    fn variables(&self) -> usize {
        3
    }
    fn constraints(&self) -> usize {
        1
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(0.0);
        upper.fill(f64::INFINITY);
    }
    fn constraint_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(6.0);
        upper.fill(6.0);
    }
    fn initial_point(&self, x: &mut [f64]) {
        x.copy_from_slice(&[0.5, 1.0, 2.0]);
    }
    fn jacobian_pattern(&self) -> Pattern {
        Pattern::dense(1, 3)
    }
    fn hessian_pattern(&self) -> Pattern {
        Pattern::lower_triangle(3)
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        -x[0] * x[1] * x[2]
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        gradient.copy_from_slice(&[-x[1] * x[2], -x[0] * x[2], -x[0] * x[1]]);
    }
    fn constraint_values(&mut self, x: &[f64], values: &mut [f64]) {
        values[0] = 2.0 * (x[0] * x[1] + x[1] * x[2] + x[2] * x[0]);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        values.copy_from_slice(&[2.0 * (x[1] + x[2]), 2.0 * (x[0] + x[2]), 2.0 * (x[0] + x[1])]);
    }
    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let pair = |other: f64| 2.0 * multipliers[0] - factor * other;
        values.copy_from_slice(&[0.0, pair(x[2]), 0.0, pair(x[1]), pair(x[0]), 0.0]);
    }
}

fn main() -> Result<(), NlpError> {
    assert!(check_derivatives(&mut LargestBox, &[0.7, 1.1, 1.3])?.is_within(1e-6));
    let report = InteriorPoint::default().solve(&mut LargestBox)?;
    let price = report.constraint_multipliers[0];
    println!("{} after {} iterations", report.status, report.counters.iterations);
    println!("sides {:.9?} m, volume {:.9} m3, {price:.6} m3 per m2", report.x, -report.objective);
    assert_eq!(report.status, Status::Optimal);
    assert!(report.x.iter().all(|side| (side - 1.0).abs() < 1e-7));
    assert!((price - 0.25).abs() < 1e-7);
    Ok(())
}
