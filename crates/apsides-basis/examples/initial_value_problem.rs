//! `x' = -x^2`, `x(0) = 1` on a whole interval at once: fixed-point iteration with the integration matrix of Radau points.
#![allow(clippy::print_stdout)]

use apsides_basis::{BasisError, Lgr};

fn main() -> Result<(), BasisError> {
    const END: f64 = 0.8;
    for points in [2, 4, 8, 12] {
        let lgr = Lgr::new(points)?;
        // States at the support points: the collocation points and the end.
        let mut x = vec![1.0; points + 1];
        for _ in 0..200 {
            let rates: Vec<f64> = x[..points].iter().map(|x| -x * x * 0.5 * END).collect();
            for (i, row) in lgr.integration().chunks(points).enumerate() {
                x[i + 1] = 1.0 + row.iter().zip(&rates).map(|(a, f)| a * f).sum::<f64>();
            }
        }
        let error = x[points] - 1.0 / (1.0 + END);
        println!("{points:2} points: x({END}) = {:.15}, error {error:+.1e}", x[points]);
        assert!(points < 12 || error.abs() < 1e-14);
    }
    Ok(())
}
