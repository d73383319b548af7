//! Gravity fields of bodies in spherical harmonics.
//!
//! ```text
//! U = mu / r sum_n (Re / r)^n sum_m P_nm(sin lat) (C_nm cos(m lon) + S_nm sin(m lon))
//! ```
//!
//! with fully normalised functions and coefficients (W. A. Heiskanen and H. Moritz, Physical Geodesy, 1967, sections 1-14 and 2-5);
//! coordinates are fixed to the body. Degree 0 is the inverse-square field.

use apsides_ad::Scalar;

use crate::error::finite;
use crate::{Body, DynamicsError};

/// Oblateness `J2` and the coefficient `C22`, not normalised, of the Moon: normalised -9.0881e-5 and 3.4674e-5 (GRGM1200A, Goossens et al.
/// 2016; principal axes), for the reference radius 1738 km.
pub const MOON_J2: f64 = 2.032_16e-4;
/// See [`MOON_J2`].
pub const MOON_C22: f64 = 2.238_2e-5;
/// Reference radius of the coefficients of the Moon, m.
pub const MOON_REFERENCE_RADIUS: f64 = 1.738e6;

/// Highest degree that is read.
pub const MAX_DEGREE: usize = 50;

/// A field of a given degree.
#[derive(Clone, Debug, PartialEq)]
pub struct GravityField {
    mu: f64,
    /// Reference radius of the coefficients, m.
    radius: f64,
    degree: usize,
    /// Orders of one degree after another, from degree 0 on: `C_nm` and `S_nm`.
    coefficients: Vec<[f64; 2]>,
    /// Factors of the recursion `P_nm = a sin(lat) P_(n-1)m - b P_(n-2)m`, and of the derivative.
    factors: Vec<[f64; 3]>,
}

/// Components of an acceleration upwards, to the east and to the north, m/s2.
pub type LocalAcceleration<S> = [S; 3];

const fn index(n: usize, m: usize) -> usize {
    n * (n + 1) / 2 + m
}

impl GravityField {
    /// The inverse-square field of a body.
    #[must_use]
    pub fn central(body: Body) -> Self {
        Self::with(body.gravitational_parameter, body.radius, 0, vec![[1.0, 0.0]])
    }

    /// The field of degree 2 of a body with `J2` and `C22` (not normalised) in its principal axes, for a reference radius (m).
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn second_degree(body: Body, radius: f64, j2: f64, c22: f64) -> Result<Self, DynamicsError> {
        let radius = crate::error::positive("reference radius", radius, "m")?;
        let mut coefficients = vec![[0.0; 2]; index(3, 0)];
        coefficients[0][0] = 1.0;
        coefficients[index(2, 0)][0] = -finite("oblateness J2", j2, "-")? / 5.0_f64.sqrt();
        coefficients[index(2, 2)][0] = finite("coefficient C22", c22, "-")? / (5.0_f64 / 12.0).sqrt();
        Ok(Self::with(body.gravitational_parameter, radius, 2, coefficients))
    }

    /// A field from a table of spherical harmonics in the format SHADR of the Planetary Data System, up to a degree.
    ///
    /// The first line has the reference radius (km) and the gravitational parameter (km3/s2), each other line `n, m, C, S` and perhaps
    /// more, separated by commas or blanks; coefficients are fully normalised.
    ///
    /// # Errors
    /// When the degree is above [`MAX_DEGREE`] or a line does not fit: says which.
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::GravityField;
    ///
    /// // Degree 2 of the Moon (GRAIL, rounded): radius (km), gravitational parameter (km3/s2), then n, m, C, S.
    /// let table = "1738.0, 4902.8001\n2, 0, -9.0883e-05, 0.0\n2, 1, 1.2e-10, 1.3e-09\n2, 2, 3.4674e-05, -2.4e-10\n";
    /// let field = GravityField::from_shadr(table, 2)?;
    /// assert_eq!((field.degree(), field.gravitational_parameter()), (2, 4902.8001e9));
    /// // Above the equator, where the oblateness pulls down as well.
    /// let [radial, ..] = field.acceleration(1838e3, 0.0, 0.0);
    /// assert!(radial < -4902.8001e9 / 1838e3_f64.powi(2));
    /// # Ok::<(), apsides_dynamics::DynamicsError>(())
    /// ```
    pub fn from_shadr(text: &str, degree: usize) -> Result<Self, DynamicsError> {
        let bad = |line: usize, reason: &str| DynamicsError::Table {
            what: "gravity field",
            row: line + 1,
            reason: reason.into(),
        };
        if degree > MAX_DEGREE {
            let allowed = "a degree from 0 to 50";
            let (what, value) = ("degree of the gravity field", degree as f64);
            return Err(DynamicsError::Parameter { what, value, unit: "-", allowed });
        }
        let numbers = |line: &str| -> Option<Vec<f64>> {
            let fields = line.split(|c: char| c == ',' || c.is_whitespace()).filter(|f| !f.is_empty());
            fields.map(|f| f.parse().ok().filter(|v: &f64| v.is_finite())).collect()
        };
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let (_, header) = lines.next().ok_or_else(|| bad(0, "the header is missing"))?;
        let header = numbers(header).filter(|h| h.len() >= 2 && h[0] > 0.0 && h[1] > 0.0);
        let header = header.ok_or_else(|| {
            bad(0, "needs the reference radius (km) and the gravitational parameter (km3/s2)")
        })?;
        let mut coefficients = vec![[0.0; 2]; index(degree + 1, 0)];
        coefficients[0][0] = 1.0;
        for (k, line) in lines {
            let row = numbers(line).filter(|r| r.len() >= 4).ok_or_else(|| bad(k, "needs n, m, C, S"))?;
            let whole = |v: f64| (v >= 0.0 && v.fract() == 0.0 && v < 1e5).then_some(v as usize);
            let (n, m) = whole(row[0])
                .zip(whole(row[1]))
                .filter(|(n, m)| m <= n)
                .ok_or_else(|| bad(k, "needs whole numbers m <= n"))?;
            if (1..=degree).contains(&n) {
                coefficients[index(n, m)] = [row[2], row[3]];
            }
        }
        Ok(Self::with(header[1] * 1e9, header[0] * 1e3, degree, coefficients))
    }

    fn with(mu: f64, radius: f64, degree: usize, coefficients: Vec<[f64; 2]>) -> Self {
        let mut factors = Vec::with_capacity(coefficients.len());
        for n in 0..=degree {
            for m in 0..=n {
                let (nf, mf) = (n as f64, m as f64);
                let square = (nf - mf) * (nf + mf);
                let a = ((2.0 * nf - 1.0) * (2.0 * nf + 1.0) / square).sqrt();
                let b = if n > m + 1 {
                    ((2.0 * nf + 1.0) * (nf + mf - 1.0) * (nf - mf - 1.0) / (square * (2.0 * nf - 3.0)))
                        .sqrt()
                } else {
                    0.0
                };
                let derivative =
                    if n > 0 { (square * (2.0 * nf + 1.0) / (2.0 * nf - 1.0)).sqrt() } else { 0.0 };
                factors.push(if n > m { [a, b, derivative] } else { [0.0, 0.0, derivative] });
            }
        }
        Self { mu, radius, degree, coefficients, factors }
    }

    /// Gravitational parameter, m3/s2.
    #[must_use]
    pub fn gravitational_parameter(&self) -> f64 {
        self.mu
    }

    /// Degree of the field.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Gravity upwards, to the east and to the north, m/s2, at a distance from the centre (m), a longitude and a geocentric latitude
    /// (rad); not at the poles unless the field is central.
    #[inline]
    pub fn acceleration<S: Scalar>(&self, r: S, longitude: S, latitude: S) -> LocalAcceleration<S> {
        let zero = S::from(0.0);
        let central = r.powi(-2) * self.mu;
        if self.degree == 0 {
            return [-central, zero, zero];
        }
        let (sin, cos) = latitude.sin_cos();
        let (sin_1, cos_1) = longitude.sin_cos();
        let ratio = r.recip() * self.radius;
        let [mut up, mut east, mut north] = [zero; 3];
        // Of the order: P_mm, (Re / r)^m, cos(m lon), sin(m lon).
        let (mut sectorial, mut power, mut c, mut s) = (S::from(1.0), S::from(1.0), S::from(1.0), zero);
        for m in 0..=self.degree {
            if m > 0 {
                let factor = if m == 1 { 3.0 } else { (2 * m + 1) as f64 / (2 * m) as f64 };
                sectorial = sectorial * cos * factor.sqrt();
                power *= ratio;
                (c, s) = (c * cos_1 - s * sin_1, s * cos_1 + c * sin_1);
            }
            let (mut before, mut p, mut reach) = (zero, sectorial, power);
            for n in m..=self.degree {
                let k = index(n, m);
                let [a, b, derivative] = self.factors[k];
                if n > m {
                    (before, p) = (p, sin * p * a - before * b);
                    reach *= ratio;
                }
                let [cnm, snm] = self.coefficients[k];
                if cnm == 0.0 && snm == 0.0 {
                    continue;
                }
                let along = c * cnm + s * snm;
                let slope = before * derivative - sin * p * n as f64;
                up -= reach * p * along * (n + 1) as f64;
                north += reach * slope * along;
                east += reach * p * (c * snm - s * cnm) * m as f64;
            }
        }
        let across = central / cos;
        [up * central, east * across, north * across]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-8;

    /// The potential from unnormalised functions of degree 2, by hand.
    fn potential(j2: f64, c22: f64, [x, y, z]: [f64; 3]) -> f64 {
        let (mu, re) = (Body::MOON.gravitational_parameter, MOON_REFERENCE_RADIUS);
        let r = (x * x + y * y + z * z).sqrt();
        let ratio = (re / r).powi(2);
        mu / r
            * (1.0 - j2 * ratio * (1.5 * z * z / (r * r) - 0.5)
                + 3.0 * c22 * ratio * (x * x - y * y) / (r * r))
    }

    fn axes(longitude: f64, latitude: f64) -> [[f64; 3]; 3] {
        let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
        [[cp * cl, cp * sl, sp], [-sl, cl, 0.0], [-sp * cl, -sp * sl, cp]]
    }

    #[test]
    fn second_degree_is_the_gradient_of_its_potential() {
        let field =
            GravityField::second_degree(Body::MOON, MOON_REFERENCE_RADIUS, MOON_J2, MOON_C22).unwrap();
        for (r, longitude, latitude) in [(1.75e6, 0.3, 0.7), (1.74e6, -2.0, -1.1), (1.9e6, 1.2, 0.0)] {
            let found = field.acceleration(r, longitude, latitude);
            let axes = axes(longitude, latitude);
            let position = axes[0].map(|a| a * r);
            for (axis, found) in axes.iter().zip(found) {
                let at = |h: f64| potential(MOON_J2, MOON_C22, [0, 1, 2].map(|k| position[k] + h * axis[k]));
                // Fourth order; the step balances truncation and rounding at 1e-10 m/s2.
                let h = 500.0;
                let slope = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                assert!((found - slope).abs() < 0.2 * DIFFERENCES, "{found} {slope}");
            }
        }
    }

    #[test]
    fn any_degree_is_free_of_divergence_and_rotation() {
        // Pseudo-random coefficients of degree 8; the field in Cartesian axes by central differences.
        let mut text = String::from("1738.0, 4902.8, 0, 8, 8, 1\n");
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 1e-3
        };
        for n in 1..=8 {
            for m in 0..=n {
                text.push_str(&format!("{n}, {m}, {:e}, {:e}\n", next(), if m > 0 { next() } else { 0.0 }));
            }
        }
        let field = GravityField::from_shadr(&text, 8).unwrap();
        assert_eq!((field.degree(), field.gravitational_parameter()), (8, 4902.8e9));
        let at = |p: [f64; 3]| -> [f64; 3] {
            let r = p.iter().map(|v| v * v).sum::<f64>().sqrt();
            let (longitude, latitude) = (p[1].atan2(p[0]), (p[2] / r).asin());
            let (local, axes) = (field.acceleration(r, longitude, latitude), axes(longitude, latitude));
            [0, 1, 2].map(|k| (0..3).map(|a| local[a] * axes[a][k]).sum())
        };
        let (p, h) = ([0.9e6, -0.7e6, 1.2e6], 300.0);
        let mut gradient = [[0.0; 3]; 3];
        for k in 0..3 {
            let moved = |s: f64| at([0, 1, 2].map(|j| p[j] + if j == k { s * h } else { 0.0 }));
            let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(moved);
            gradient[k] = [0, 1, 2].map(|j| (8.0 * (a[j] - b[j]) - (c[j] - d[j])) / (12.0 * h));
        }
        let size = gradient[0][0].abs();
        assert!((gradient[0][0] + gradient[1][1] + gradient[2][2]).abs() < DIFFERENCES * size);
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            assert!((gradient[i][j] - gradient[j][i]).abs() < DIFFERENCES * size);
        }
    }

    #[test]
    fn bad_tables_are_refused_by_line() {
        let error = |text: &str, degree| GravityField::from_shadr(text, degree).unwrap_err().to_string();
        assert!(error("", 2).contains("row 1"));
        assert!(error("1738, -1", 2).contains("row 1"));
        assert!(error("1738, 4902.8\n2, 0, x, 0", 2).contains("row 2"));
        assert!(error("1738, 4902.8\n2, 0, 1e-4, 0\n2, 3, 0, 0", 2).contains("row 3"));
        assert!(error("1738, 4902.8", 51).contains("51"));
        let central = GravityField::from_shadr("1738, 4902.8\n1, 0, 0, 0\n", 0).unwrap();
        assert_eq!(central.acceleration(2e6, 0.1, 0.2), [-4902.8e9 / 4e12, 0.0, 0.0]);
    }
}
