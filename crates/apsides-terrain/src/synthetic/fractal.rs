//! Gradient noise (K. Perlin, Improving noise, SIGGRAPH 2002, doi 10.1145/566570.566636) summed over octaves.

use super::Relief;

/// Angle between the lattices of successive octaves, rad, so that their lines do not coincide.
const TURN: f64 = 0.9;

/// One octave.
struct Octave {
    wavelength: f64,
    amplitude: f64,
    rotation: [f64; 2],
    seed: u64,
}

/// A sum of octaves whose amplitudes go with the wavelength to the power of the Hurst exponent.
pub(super) struct Fractal {
    octaves: Vec<Octave>,
}

impl Fractal {
    pub(super) fn new(relief: &Relief, pixel: f64, seed: u64) -> Fractal {
        let mut octaves = Vec::new();
        let mut wavelength = relief.longest;
        while wavelength >= 2.0 * pixel && relief.rms_slope > 0.0 {
            let k = octaves.len() as u64;
            let (s, c) = (TURN * (k + 1) as f64).sin_cos();
            let amplitude = wavelength.powf(relief.hurst);
            octaves.push(Octave { wavelength, amplitude, rotation: [s, c], seed: mix(seed ^ mix(k + 1)) });
            wavelength *= 0.5;
        }
        let mut fractal = Fractal { octaves };
        let mean_square: f64 = fractal
            .octaves
            .iter()
            .map(|o| o.amplitude * o.amplitude * structure(relief.baseline / o.wavelength))
            .sum();
        if mean_square > 0.0 {
            let scale = relief.rms_slope * relief.baseline / mean_square.sqrt();
            fractal.octaves.iter_mut().for_each(|o| o.amplitude *= scale);
        }
        fractal
    }

    /// Height at a point (east, north; m), m.
    pub(super) fn at(&self, east: f64, north: f64) -> f64 {
        let mut sum = 0.0;
        for o in &self.octaves {
            let [s, c] = o.rotation;
            let (x, y) = (c * east + s * north, c * north - s * east);
            sum += o.amplitude * noise(x / o.wavelength, y / o.wavelength, o.seed);
        }
        sum
    }
}

/// A 64-bit number that looks random (the finaliser of D. Stafford, variant 13, as in SplitMix64).
pub(super) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The number of a lattice point.
pub(super) fn lattice(seed: u64, i: i64, j: i64) -> u64 {
    mix(mix(seed ^ i as u64) ^ (j as u64).rotate_left(32))
}

/// Weight of the nearer of two lattice lines, with two continuous derivatives.
fn fade(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Gradient noise with a lattice of unit squares and gradients of unit length.
fn noise(x: f64, y: f64, seed: u64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let (u, v) = (x - i, y - j);
    let corner = |a: i64, b: i64| {
        // Sixteen directions, one half step off the axes.
        let [gx, gy] = DIRECTIONS[(lattice(seed, i as i64 + a, j as i64 + b) & 15) as usize];
        gx * (u - a as f64) + gy * (v - b as f64)
    };
    let (fu, fv) = (fade(u), fade(v));
    let (south, north) = (
        corner(0, 0) + fu * (corner(1, 0) - corner(0, 0)),
        corner(0, 1) + fu * (corner(1, 1) - corner(0, 1)),
    );
    south + fv * (north - south)
}

/// (cos a, sin a) for a = (k + 1/2) pi / 8: literal, so that no library's sine decides a bit.
const DIRECTIONS: [[f64; 2]; 16] = {
    const A: f64 = 0.980_785_280_403_230_4;
    const B: f64 = 0.831_469_612_302_545_2;
    const C: f64 = 0.555_570_233_019_602_2;
    const D: f64 = 0.195_090_322_016_128_27;
    [
        [A, D],
        [B, C],
        [C, B],
        [D, A],
        [-D, A],
        [-C, B],
        [-B, C],
        [-A, D],
        [-A, -D],
        [-B, -C],
        [-C, -B],
        [-D, -A],
        [D, -A],
        [C, -B],
        [B, -C],
        [A, -D],
    ]
};

/// Mean square difference of the noise over a distance, averaged over places and directions; the gradients are independent, so that
/// the squares of their coefficients add up, one half each.
fn structure(distance: f64) -> f64 {
    const PLACES: usize = 12;
    const HEADINGS: usize = 6;
    let mut sum = 0.0;
    for place in 0..PLACES * PLACES {
        let half = |k: usize| (k as f64 + 0.5) / PLACES as f64;
        let (x, y) = (half(place / PLACES), half(place % PLACES));
        for heading in 0..HEADINGS {
            let (s, c) = ((heading as f64 + 0.5) * std::f64::consts::FRAC_PI_2 / HEADINGS as f64).sin_cos();
            let mut coefficients: Vec<([i64; 2], [f64; 2])> = Vec::with_capacity(8);
            for (x, y, sign) in [(x, y, 1.0), (x + distance * c, y + distance * s, -1.0)] {
                let (i, j) = (x.floor(), y.floor());
                let (u, v) = (x - i, y - j);
                for (a, b) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let near = |t: f64, k: i64| if k == 0 { 1.0 - fade(t) } else { fade(t) };
                    let weight = sign * near(u, a) * near(v, b);
                    let key = [i as i64 + a, j as i64 + b];
                    let value = [weight * (u - a as f64), weight * (v - b as f64)];
                    match coefficients.iter_mut().find(|(k, _)| *k == key) {
                        Some((_, sum)) => *sum = [sum[0] + value[0], sum[1] + value[1]],
                        None => coefficients.push((key, value)),
                    }
                }
            }
            sum += coefficients.iter().map(|(_, [x, y])| 0.5 * (x * x + y * y)).sum::<f64>();
        }
    }
    sum / (PLACES * PLACES * HEADINGS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rms differences along and across over 200 x 200 points.
    fn deviation(fractal: &Fractal, spacing: f64, distance: f64) -> f64 {
        let mut sum = 0.0;
        for k in 0..40_000 {
            let (e, n) = ((k / 200) as f64 * spacing, (k % 200) as f64 * spacing);
            let z = fractal.at(e, n);
            sum += (fractal.at(e + distance, n) - z).powi(2) + (fractal.at(e, n - distance) - z).powi(2);
        }
        (sum / 80_000.0).sqrt()
    }

    #[test]
    fn the_rms_slope_and_the_exponent_are_as_stated() {
        for (hurst, tolerance) in [(0.4, 0.03), (0.6, 0.03), (0.8, 0.05), (0.95, 0.1)] {
            let relief = Relief { hurst, rms_slope: 0.1, baseline: 5.0, longest: 4000.0 };
            let fractal = Fractal::new(&relief, 0.5, 3);
            let at_baseline = deviation(&fractal, 37.3, 5.0) / 5.0;
            assert!((at_baseline / 0.1 - 1.0).abs() < 0.1, "{hurst}: {at_baseline}");
            let found = (deviation(&fractal, 37.3, 64.0) / deviation(&fractal, 37.3, 4.0)).log2() / 4.0;
            // Waves longer than 4000 m, which would add slope everywhere, are missing: the law is flatter towards 1.
            assert!((found - hurst).abs() < tolerance, "{hurst}: {found}");
        }
    }

    #[test]
    fn noise_vanishes_on_its_lattice_and_differs_by_seed() {
        assert_eq!(noise(3.0, -7.0, 1), 0.0);
        assert_ne!(noise(3.3, -7.2, 1), noise(3.3, -7.2, 2));
        let none = Relief { hurst: 0.5, rms_slope: 0.0, baseline: 1.0, longest: 10.0 };
        assert_eq!(Fractal::new(&none, 0.1, 1).at(1.0, 2.0), 0.0);
    }
}
