//! Transverse Mercator projection (Gauss-Krueger) of a sphere or an oblate ellipsoid, both ways.
//!
//! Krueger's series in the third flattening `n` to `n^6`: from the conformal latitude and the longitude by the spherical projection,
//! `zeta' = xi' + i eta'`, then `zeta = zeta' + sum a_j sin(2 j zeta')`. The way back solves this equation by Newton's method, so that both
//! ways belong to each other to rounding. Truncation is below 5 nm within 3900 km of the central meridian of the Earth.
//!
//! Reference: C. F. F. Karney, Transverse Mercator with an accuracy of a few nanometers, J. Geodesy 85 (2011) 475,
//! doi 10.1007/s00190-011-0445-3, equations 7 to 14, 19 to 21 and 35.

use crate::DynamicsError;
use crate::error::{finite, positive};

/// Largest flattening at which the series is good to a micrometre.
const MOST_FLATTENING: f64 = 0.01;
/// Newton steps from a start that is good to the flattening; each doubles the digits.
const STEPS: usize = 6;

/// A transverse Mercator projection with a central meridian. Northings count from the equator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverseMercator {
    eccentricity: f64,
    meridian: f64,
    /// Scale times the rectifying radius, m.
    size: f64,
    series: [f64; 6],
}

impl TransverseMercator {
    /// Equatorial radius (m), flattening (0: a sphere), longitude of the central meridian (rad) and the scale along it.
    ///
    /// # Errors
    /// A radius or a scale that is not positive, a flattening outside 0 to 0.01, a meridian that is not finite.
    pub fn new(radius: f64, flattening: f64, meridian: f64, scale: f64) -> Result<Self, DynamicsError> {
        let radius = positive("equatorial radius", radius, "m")?;
        let scale = positive("scale on the central meridian", scale, "-")?;
        let meridian = finite("central meridian", meridian, "rad")?;
        if !(0.0..=MOST_FLATTENING).contains(&flattening) {
            return Err(DynamicsError::Parameter {
                what: "flattening",
                value: flattening,
                unit: "-",
                allowed: "0 to 0.01",
            });
        }
        let n = flattening / (2.0 - flattening);
        let square = n * n;
        let rectifying =
            radius / (1.0 + n) * (1.0 + square * (1.0 / 4.0 + square * (1.0 / 64.0 + square / 256.0)));
        Ok(Self {
            eccentricity: (flattening * (2.0 - flattening)).sqrt(),
            meridian,
            size: scale * rectifying,
            series: series(n),
        })
    }

    /// Easting and northing (m) of a longitude and a geodetic latitude (rad) less than a right angle from the central meridian.
    #[must_use]
    pub fn forward(&self, longitude: f64, latitude: f64) -> [f64; 2] {
        let (sin, cos) = (longitude - self.meridian).sin_cos();
        let tangent = self.conformal(latitude.tan());
        let (xi, eta) = (tangent.atan2(cos), (sin / tangent.hypot(cos)).asinh());
        let ([x, y], _) = self.stretched(xi, eta);
        [self.size * y, self.size * x]
    }

    /// Longitude, within half a turn of the central meridian, and geodetic latitude (rad) of an easting and a northing (m).
    #[must_use]
    pub fn inverse(&self, [easting, northing]: [f64; 2]) -> [f64; 2] {
        let target = [northing / self.size, easting / self.size];
        let [mut xi, mut eta] = target;
        for _ in 0..STEPS {
            let ([x, y], [a, b]) = self.stretched(xi, eta);
            let (dx, dy, square) = (target[0] - x, target[1] - y, a * a + b * b);
            let step = [(dx * a + dy * b) / square, (dy * a - dx * b) / square];
            (xi, eta) = (xi + step[0], eta + step[1]);
            if step[0].abs().max(step[1].abs()) < f64::EPSILON {
                break;
            }
        }
        let (sin, cos) = xi.sin_cos();
        let sinh = eta.sinh();
        [self.meridian + sinh.atan2(cos), self.geodetic(sin / sinh.hypot(cos)).atan()]
    }

    /// `zeta` of `zeta'`, and its derivative, each with real and imaginary part.
    fn stretched(&self, xi: f64, eta: f64) -> ([f64; 2], [f64; 2]) {
        let (mut zeta, mut slope) = ([xi, eta], [1.0, 0.0]);
        for (j, a) in self.series.iter().enumerate() {
            let order = 2.0 * (j as f64 + 1.0);
            let (sin, cos) = (order * xi).sin_cos();
            let (sinh, cosh) = ((order * eta).sinh(), (order * eta).cosh());
            zeta[0] += a * sin * cosh;
            zeta[1] += a * cos * sinh;
            slope[0] += order * a * cos * cosh;
            slope[1] -= order * a * sin * sinh;
        }
        (zeta, slope)
    }

    /// Tangent of the conformal latitude from that of the geodetic one.
    fn conformal(&self, tangent: f64) -> f64 {
        let e = self.eccentricity;
        let secant = 1.0_f64.hypot(tangent);
        let sigma = (e * (e * tangent / secant).atanh()).sinh();
        tangent * 1.0_f64.hypot(sigma) - sigma * secant
    }

    /// Tangent of the geodetic latitude from that of the conformal one.
    fn geodetic(&self, conformal: f64) -> f64 {
        let factor = 1.0 - self.eccentricity * self.eccentricity;
        let mut tangent = conformal / factor;
        for _ in 0..STEPS {
            let found = self.conformal(tangent);
            let square = tangent * tangent;
            let step = (conformal - found) / 1.0_f64.hypot(found) * (1.0 + factor * square)
                / (factor * (1.0 + square).sqrt());
            tangent += step;
            if step.abs() <= f64::EPSILON * tangent.abs() {
                break;
            }
        }
        tangent
    }
}

/// Coefficients of `sin(2 j zeta')`, j = 1 to 6: Karney's equation 35.
fn series(n: f64) -> [f64; 6] {
    let polynomial = |power: i32, c: &[f64]| n.powi(power) * c.iter().rev().fold(0.0, |sum, c| sum * n + c);
    [
        polynomial(1, &[1.0 / 2.0, -2.0 / 3.0, 5.0 / 16.0, 41.0 / 180.0, -127.0 / 288.0, 7_891.0 / 37_800.0]),
        polynomial(2, &[13.0 / 48.0, -3.0 / 5.0, 557.0 / 1_440.0, 281.0 / 630.0, -1_983_433.0 / 1_935_360.0]),
        polynomial(3, &[61.0 / 240.0, -103.0 / 140.0, 15_061.0 / 26_880.0, 167_603.0 / 181_440.0]),
        polynomial(4, &[49_561.0 / 161_280.0, -179.0 / 168.0, 6_601_661.0 / 7_257_600.0]),
        polynomial(5, &[34_729.0 / 80_640.0, -3_418_889.0 / 1_995_840.0]),
        polynomial(6, &[212_378_941.0 / 319_334_400.0]),
    ]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const WGS84: [f64; 2] = [6_378_137.0, 1.0 / 298.257_223_563];
    /// A flattened Moon.
    const MOON: [f64; 2] = [1_737_400.0, 1.0 / 963.7256];

    fn of([radius, flattening]: [f64; 2]) -> TransverseMercator {
        TransverseMercator::new(radius, flattening, 0.0, 1.0).unwrap()
    }

    /// EPSG guidance note 7-2, method 9807, with the parameters as printed there: British National Grid, 50 deg 30' N, 0 deg 30' E, to
    /// 1 cm.
    #[test]
    fn british_national_grid() {
        let meridian = (-2_f64).to_radians();
        let grid = TransverseMercator::new(6_377_563.396, 1.0 / 299.324_96, meridian, 0.999_601_3).unwrap();
        let [_, origin] = grid.forward(meridian, 49_f64.to_radians());
        let [e, n] = grid.forward(0.5_f64.to_radians(), 50.5_f64.to_radians());
        assert!((400_000.0 + e - 577_274.99).abs() < 5e-3, "{e}");
        assert!((n - origin - 100_000.0 - 69_740.50).abs() < 5e-3, "{}", n - origin);
    }

    /// Closed form: J. P. Snyder, Map projections - a working manual, USGS professional paper 1395 (1987), equations 8-1 and 8-3.
    #[test]
    fn sphere() {
        let [radius, meridian, scale] = [1_737_013.0, -0.34, 0.9996];
        let projection = TransverseMercator::new(radius, 0.0, meridian, scale).unwrap();
        for (longitude, latitude) in [(-0.34, 0.77), (0.1, 0.2), (-0.8, -1.2), (0.9, 1.5)] {
            let b = f64::cos(latitude) * f64::sin(longitude - meridian);
            let y = f64::atan2(f64::tan(latitude), f64::cos(longitude - meridian));
            let [e, n] = projection.forward(longitude, latitude);
            assert!((e - scale * radius * b.atanh()).abs() < 2e-9);
            assert!((n - scale * radius * y).abs() < 2e-9);
        }
    }

    /// The meridian arc of a complex latitude in 40 digits: easting and northing of longitude and latitude in deg.
    #[test]
    fn ellipsoids() {
        for (body, [longitude, latitude], [e, n]) in [
            (WGS84, [3.0, 50.0], [215_070.264_840_762_72, 5_545_162.083_482_495_7]),
            (WGS84, [-19.0, 44.0], [-1_524_475.015_604_685_6, 5_052_767.044_606_073_9]),
            (WGS84, [30.0, -70.0], [1_104_821.046_616_297_5, -8_048_641.080_698_485_9]),
            (WGS84, [30.0, 5.0], [3_488_706.502_130_276_1, 638_590.134_427_783_52]),
            (WGS84, [1.0, 0.0], [111_325.180_963_786_7, 0.0]),
            (MOON, [-19.0, 44.0], [-414_793.927_208_564_92, 1_380_869.150_698_580_5]),
            (MOON, [30.0, -70.0], [300_336.441_078_468_17, -2_196_686.547_505_028_9]),
            (MOON, [30.0, 5.0], [950_073.066_901_956_47, 174_622.761_547_246_42]),
        ] {
            let [x, y] = of(body).forward(f64::to_radians(longitude), f64::to_radians(latitude));
            // Rounding, and the truncation of 5 nm on the Earth.
            assert!(
                (x - e).abs() < 6e-9 && (y - n).abs() < 6e-9,
                "{longitude} {latitude}: {} {}",
                x - e,
                y - n
            );
        }
    }

    /// A nanometre on the Moon; on the Earth two units of the last place of a northing of 10 000 km.
    #[test]
    fn there_and_back() {
        for (body, tolerance) in [(MOON, 1e-9), ([1_737_013.0, 0.0], 1e-9), (WGS84, 4e-9)] {
            let projection = of(body);
            for k in -30..=30 {
                for latitude in (-88..=88).step_by(4) {
                    let place = [f64::from(k).to_radians(), f64::from(latitude).to_radians()];
                    let [longitude, back] = projection.inverse(projection.forward(place[0], place[1]));
                    let east = (longitude - place[0]) * place[1].cos() * body[0];
                    let north = (back - place[1]) * body[0];
                    assert!(east.abs().max(north.abs()) < tolerance, "{k} {latitude}: {east:e} {north:e}");
                }
            }
        }
    }

    #[test]
    fn what_makes_no_projection_is_refused() {
        for (values, word) in [
            ([0.0, 0.0, 0.0, 1.0], "equatorial radius"),
            ([1e6, -0.1, 0.0, 1.0], "flattening"),
            ([1e6, 0.1, 0.0, 1.0], "flattening"),
            ([1e6, 0.0, f64::NAN, 1.0], "central meridian"),
            ([1e6, 0.0, 0.0, 0.0], "scale"),
        ] {
            let [a, f, meridian, scale] = values;
            let error = TransverseMercator::new(a, f, meridian, scale).unwrap_err().to_string();
            assert!(error.starts_with(word), "{error}");
        }
    }
}
