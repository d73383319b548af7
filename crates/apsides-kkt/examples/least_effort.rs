//! A quadratic program with equalities is one linear system: least effort that moves a cart by a metre from rest to rest in a second.
//!
//! `min 1/2 h sum u_k^2` with `v_{k+1} = v_k + h u_k`, `x_{k+1} = x_k + h v_k + h^2 / 2 u_k`; with `n` steps the minimum is `6 / (1 - 1/n^2)`.
#![allow(clippy::print_stdout)]

use apsides_kkt::{KktError, KktSettings, KktSystem};

fn main() -> Result<(), KktError> {
    const STEPS: usize = 10;
    let h = 1.0 / STEPS as f64;
    // Only the ends are constrained: the sums of the steps. Rows and columns of the lower triangle, with their values.
    let (mut rows, mut cols, mut values) = (vec![], vec![], vec![]);
    let mut add = |row, col, value| {
        rows.push(row);
        cols.push(col);
        values.push(value);
    };
    for k in 0..STEPS {
        add(k, k, h);
        add(STEPS, k, h);
        add(STEPS + 1, k, h * (1.0 - (k as f64 + 0.5) * h));
    }
    let mut system = KktSystem::analyse(STEPS + 2, STEPS, &rows, &cols, KktSettings::default())?;
    let inertia = system.factor(&values, 0.0, 0.0)?;
    let mut right = [0.0; STEPS + 2];
    right[STEPS + 1] = 1.0; // the distance; the speed in the end is 0
    let mut solution = [0.0; STEPS + 2];
    let quality = system.solve(&right, &mut solution)?;

    let controls = &solution[..STEPS];
    let effort = 0.5 * h * controls.iter().map(|u| u * u).sum::<f64>();
    println!("{inertia:?}, residual {:.1e}", quality.residual);
    println!("controls {controls:.4?}");
    println!("effort {effort:.12} m2/s3");
    assert!((effort - 6.0 / (1.0 - h * h)).abs() < 1e-9);
    Ok(())
}
