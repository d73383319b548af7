//! Largest magnitudes of vectors, with the vector instructions that the processor has.

use pulp::{Arch, Simd, WithSimd};

/// Independent lanes, so that the comparisons need not wait for each other; the same for all vector instructions.
const LANES: usize = 16;

/// Largest magnitude; NaN if any entry is.
pub(crate) fn maximum(v: &[f64]) -> f64 {
    Arch::new().dispatch(Maximum(v))
}

/// Largest magnitudes in the rows of positive and of negative sign; NaN if any entry there is.
pub(crate) fn maxima(v: &[f64], signs: &[f64]) -> [f64; 2] {
    Arch::new().dispatch(Maxima { v, signs })
}

/// Says whether no entry is infinite or NaN.
pub(crate) fn all_finite(v: &[f64]) -> bool {
    maximum(v) < f64::INFINITY
}

struct Maximum<'a>(&'a [f64]);

impl WithSimd for Maximum<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let (chunks, rest) = self.0.as_chunks::<LANES>();
        let mut lanes = [0.0; LANES];
        for chunk in chunks {
            for (m, v) in lanes.iter_mut().zip(chunk) {
                *m = larger(*m, v.abs());
            }
        }
        let rest = rest.iter().fold(0.0, |m, v| larger(m, v.abs()));
        lanes.into_iter().fold(rest, larger)
    }
}

struct Maxima<'a> {
    v: &'a [f64],
    signs: &'a [f64],
}

impl WithSimd for Maxima<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 2] {
        let (chunks, rest) = self.v.as_chunks::<LANES>();
        let (sign_chunks, rest_signs) = self.signs.as_chunks::<LANES>();
        let (mut positive, mut negative) = ([0.0; LANES], [0.0; LANES]);
        for (chunk, signs) in chunks.iter().zip(sign_chunks) {
            for lane in 0..LANES {
                let [above, below] = by_sign(chunk[lane], signs[lane]);
                positive[lane] = larger(positive[lane], above);
                negative[lane] = larger(negative[lane], below);
            }
        }
        let mut maxima = [positive, negative].map(|lanes| lanes.into_iter().fold(0.0, larger));
        for (v, sign) in rest.iter().zip(rest_signs) {
            let [above, below] = by_sign(*v, *sign);
            maxima = [larger(maxima[0], above), larger(maxima[1], below)];
        }
        maxima
    }
}

/// The magnitude where the sign is positive, else zero, and the other way round.
#[inline(always)]
fn by_sign(v: f64, sign: f64) -> [f64; 2] {
    let negative = ((sign.to_bits() as i64) >> 63) as u64;
    let magnitude = v.abs().to_bits();
    [f64::from_bits(magnitude & !negative), f64::from_bits(magnitude & negative)]
}

/// The larger of two magnitudes; a NaN stays.
#[inline(always)]
fn larger(m: f64, v: f64) -> f64 {
    if v > m || v.is_nan() { v } else { m }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_none_stays() {
        assert!(maximum(&[f64::NAN, 1.0]).is_nan() && maximum(&[1.0, f64::NAN]).is_nan());
        assert!(maximum(&[&[f64::NAN][..], &[1.0; 40]].concat()).is_nan());
        assert_eq!(maximum(&[1.0, -3.0, 2.0]), 3.0);
        assert_eq!(maximum(&[]), 0.0);
        assert!(all_finite(&[1.0; 40]) && !all_finite(&[f64::NEG_INFINITY]) && !all_finite(&[f64::NAN]));
    }

    #[test]
    fn rows_count_by_their_signs() {
        let v: Vec<f64> = (0..50).map(|k| f64::from(k) * if k % 3 == 0 { -1.0 } else { 1.0 }).collect();
        // Zeros have signs, too.
        let signs: Vec<f64> = (0..50).map(|k| if k % 2 == 0 { 0.0 } else { -0.0 }).collect();
        assert_eq!(maxima(&v, &signs), [48.0, 49.0]);
        for at in [3, 48] {
            let mut v = v.clone();
            v[at] = f64::NAN;
            let found = maxima(&v, &signs);
            assert_eq!(found.map(f64::is_nan), [at % 2 == 0, at % 2 == 1]);
        }
    }
}
