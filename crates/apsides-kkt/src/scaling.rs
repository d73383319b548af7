//! Symmetric equilibration: powers of two `s` such that the largest entry of every row of `S A S` is near one.
//!
//! Ruiz, "A scaling algorithm to equilibrate both rows and columns norms in matrices", RAL-TR-2001-034 (2001),
//! in the maximum norm. Powers of two keep the scaling free of rounding.

use crate::pattern::Pattern;

/// Sweeps over the matrix; the spread of the row norms is roughly square-rooted by each.
const SWEEPS: usize = 3;

/// Writes the scale of each row and multiplies `values` by it. `largest` is work space of length `n`.
pub(crate) fn equilibrate(pattern: &Pattern, values: &mut [f64], scale: &mut [f64], largest: &mut [f64]) {
    scale.fill(1.0);
    for sweep in 0..SWEEPS {
        row_maxima(pattern, values, scale, largest);
        let mut done = true;
        for (s, &size) in scale.iter_mut().zip(&*largest) {
            if size > 0.0 && !(0.25..=4.0).contains(&size) {
                *s *= power_of_two(1.0 / size.sqrt());
                done = false;
            }
        }
        if done {
            if sweep == 0 {
                return;
            }
            break;
        }
    }
    for j in 0..pattern.n {
        let sj = scale[j];
        let column = pattern.column(j);
        for (&i, a) in pattern.row_idx[column.clone()].iter().zip(&mut values[column]) {
            *a *= scale[i as usize] * sj;
        }
    }
}

/// Smallest of the largest magnitudes of the rows that are not zero; 1 if all are. `largest` is work space.
pub(crate) fn smallest_row(pattern: &Pattern, values: &[f64], scale: &[f64], largest: &mut [f64]) -> f64 {
    row_maxima(pattern, values, scale, largest);
    let smallest = largest.iter().filter(|&&m| m > 0.0).fold(f64::INFINITY, |a, &b| a.min(b));
    if smallest.is_finite() { smallest } else { 1.0 }
}

/// Largest magnitude in each row of `S A S`.
fn row_maxima(pattern: &Pattern, values: &[f64], scale: &[f64], largest: &mut [f64]) {
    largest.fill(0.0);
    for j in 0..pattern.n {
        let sj = scale[j];
        let mut column_largest = 0.0;
        let column = pattern.column(j);
        for (&i, &a) in pattern.row_idx[column.clone()].iter().zip(&values[column]) {
            let i = i as usize;
            let size = a.abs() * scale[i] * sj;
            largest[i] = larger(size, largest[i]);
            column_largest = larger(size, column_largest);
        }
        largest[j] = larger(column_largest, largest[j]);
    }
}

/// The larger of two numbers that are not NaN: one instruction, where `f64::max` takes several.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Largest power of two not above a positive `x`; at least the smallest normal number.
pub(crate) fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.max(f64::MIN_POSITIVE).to_bits() & 0x7ff0_0000_0000_0000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_near_one() {
        let pattern = Pattern::new(3, &[0, 0, 1, 1, 2], &[0, 1, 1, 2, 2], &[0, 1, 2]).expect("small");
        let original = [1e12, 1e3, 0.0, 1e-9, 1e-30];
        let mut values = original;
        let (mut scale, mut largest) = ([0.0; 3], [0.0; 3]);
        equilibrate(&pattern, &mut values, &mut scale, &mut largest);
        // Rows: {1e12, 1e3}, {1e3, 1e-9}, {1e-9, 1e-30}.
        for (k, (i, j)) in [(0, 0), (0, 1), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            assert_eq!(values[k], original[k] * (scale[i] * scale[j]));
        }
        let norms = [values[0].max(values[1]), values[1].max(values[3]), values[3].max(values[4])];
        assert!(norms.iter().all(|&r| r > 0.05 && r < 20.0), "{norms:?}");
        assert_eq!(power_of_two(3.9), 2.0);
    }
}
