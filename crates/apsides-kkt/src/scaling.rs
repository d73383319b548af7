//! Symmetric equilibration: powers of two `s` such that the largest entry of every row of `S A S` is near one.
//!
//! Ruiz, "A scaling algorithm to equilibrate both rows and columns norms in matrices", RAL-TR-2001-034 (2001),
//! in the maximum norm. Powers of two keep the scaling free of rounding.

use pulp::Arch;

use crate::structure::Structure;

/// Sweeps over the matrix; the spread of the row norms is roughly square-rooted by each.
const SWEEPS: usize = 3;

/// Writes the scale of each row and `S A S`. `largest` is work space of length `n`.
pub(crate) fn equilibrate(
    structure: &Structure,
    values: &[f64],
    scaled: &mut [f64],
    scale: &mut [f64],
    largest: &mut [f64],
) {
    structure.measure(values, largest);
    scale.fill(1.0);
    for sweep in 1..=SWEEPS {
        let is_balanced = Arch::new().dispatch(|| balance(scale, largest));
        if is_balanced || sweep == SWEEPS {
            break;
        }
        structure.measure_scaled(values, scale, largest);
    }
    structure.scale(values, scaled, scale);
}

/// Brings the scales of rows nearer to those that make their largest magnitudes one. Says whether all were near enough.
#[inline(always)]
fn balance(scale: &mut [f64], largest: &[f64]) -> bool {
    // Without branches, so that rows go side by side.
    let mut done = true;
    for (s, &size) in scale.iter_mut().zip(largest) {
        let is_near = (0.25..=4.0).contains(&size) | (size == 0.0);
        *s *= if is_near { 1.0 } else { near_inverse_root(size) };
        done &= is_near;
    }
    done
}

/// Smallest of the largest magnitudes of the rows that are not zero; 1 if all are.
pub(crate) fn smallest_row(largest: &[f64]) -> f64 {
    let smallest = largest.iter().filter(|&&m| m > 0.0).fold(f64::INFINITY, |a, &b| a.min(b));
    if smallest.is_finite() { smallest } else { 1.0 }
}

/// Largest power of two not above a positive `x`; at least the smallest normal number.
pub(crate) fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.max(f64::MIN_POSITIVE).to_bits() & 0x7ff0_0000_0000_0000)
}

/// A power of two within a factor of two of `1 / sqrt(x)`, by its exponent alone.
#[inline(always)]
fn near_inverse_root(x: f64) -> f64 {
    // A normal number stores its exponent `e` as `e + 1023`. The result stores `1023 - floor((e + 1) / 2)`, here found without negative numbers,
    // which vectors shift more easily.
    let stored = x.max(f64::MIN_POSITIVE).to_bits() >> 52;
    f64::from_bits((1535 - ((stored + 2) >> 1)) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ordering;
    use crate::analysis::Analysis;

    #[test]
    fn rows_come_near_one() {
        let (rows, cols) = ([0, 0, 1, 1, 2], [0, 1, 1, 2, 2]);
        let analysis = Analysis::new(3, &rows, &cols, &Ordering::Custom(vec![0, 1, 2])).expect("small");
        let original = [1e12, 1e3, 0.0, 1e-9, 1e-30];
        let mut values = [0.0; 5];
        let (mut scale, mut largest) = ([0.0; 3], [0.0; 3]);
        equilibrate(&analysis.structure, &original, &mut values, &mut scale, &mut largest);
        // Rows: {1e12, 1e3}, {1e3, 1e-9}, {1e-9, 1e-30}.
        for (k, (i, j)) in [(0, 0), (0, 1), (1, 1), (1, 2), (2, 2)].into_iter().enumerate() {
            assert_eq!(values[k], original[k] * (scale[i] * scale[j]));
        }
        let norms = [values[0].max(values[1]), values[1].max(values[3]), values[3].max(values[4])];
        assert!(norms.iter().all(|&r| r > 0.05 && r < 20.0), "{norms:?}");
        assert_eq!(power_of_two(3.9), 2.0);
        for size in [f64::MIN_POSITIVE, 1e-9, 0.2, 5.0, 1e12, f64::MAX] {
            assert!((0.5..=2.0).contains(&(near_inverse_root(size) * size.sqrt())), "{size}");
        }
    }
}
