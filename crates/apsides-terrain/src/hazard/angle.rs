//! Angles from tangents, in a form that compilers make vectors of.

/// Coefficients of `atan(t) / t` in powers of `t^2` on [0, 1], fitted for the least largest relative error, 1.6e-8.
const SERIES: [f32; 9] = [
    1.0,
    -0.333_330_72,
    0.199_926_2,
    -0.142_036_44,
    0.106_409_334,
    -0.075_042_926,
    0.042_691_5,
    -0.016_068_615,
    0.002_849_886_4,
];

/// Arc tangent of a number that is not negative, rad, within 2e-7.
#[inline(always)]
pub(super) fn angle(tangent: f32) -> f32 {
    let steep = tangent > 1.0;
    let t = if steep { 1.0 / tangent } else { tangent };
    let square = t * t;
    let mut sum = SERIES[8];
    for k in (0..8).rev() {
        sum = sum * square + SERIES[k];
    }
    let sum = sum * t;
    if steep { std::f32::consts::FRAC_PI_2 - sum } else { sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f32 = 2e-7;

    #[test]
    fn angles_are_those_of_the_library() {
        for k in 0..=4000 {
            let tangent = 0.002 * k as f32;
            assert!((angle(tangent) - tangent.atan()).abs() < SINGLE, "{tangent}");
        }
        assert_eq!(angle(0.0), 0.0);
        assert!((angle(1e30) - std::f32::consts::FRAC_PI_2).abs() < SINGLE);
    }
}
