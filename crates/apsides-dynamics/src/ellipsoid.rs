//! The reference ellipsoid of the Earth: geodetic coordinates and normal gravity.
//!
//! Axes are fixed to the Earth: x through the equator at longitude 0, y through longitude 90 deg east, z through the north pole.
//!
//! Source: NGA.STND.0036, Department of Defense World Geodetic System 1984, 2014; formulas of W. A. Heiskanen and H. Moritz, Physical
//! Geodesy, 1967, sections 2-7 to 2-10.

use apsides_ad::Scalar;
use apsides_ad::vector::{dot, norm};

/// An oblate ellipsoid of revolution that is a surface of constant potential of gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Semi-major axis, m.
    pub semi_major_axis: f64,
    /// Flattening.
    pub flattening: f64,
    /// Gravitational parameter, m3/s2.
    pub gravitational_parameter: f64,
    /// Angular velocity, rad/s.
    pub rotation_rate: f64,
    /// Normal gravity at the equator, m/s2.
    pub equatorial_gravity: f64,
    /// Constant `k` of Somigliana's formula.
    pub gravity_constant: f64,
    /// Zonal harmonics `J2`, `J4`, `J6` of the normal potential.
    pub zonals: [f64; 3],
}

/// Distance, m, that keeps the horizontal direction defined at a pole.
const AT_POLE: f64 = 1e-3;

/// A place above an ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geodetic<S> {
    /// Height above the ellipsoid, m.
    pub altitude: S,
    /// Unit vector upwards, along the normal of the ellipsoid.
    pub up: [S; 3],
    /// Unit vector to the north.
    pub north: [S; 3],
    /// Unit vector to the east.
    pub east: [S; 3],
}

impl Ellipsoid {
    /// WGS 84. `J4` and `J6` are those of the field whose equipotential the ellipsoid is.
    pub const WGS84: Self = Self {
        semi_major_axis: 6_378_137.0,
        flattening: 1.0 / 298.257_223_563,
        gravitational_parameter: 3.986_004_418e14,
        rotation_rate: 7.292_115e-5,
        equatorial_gravity: 9.780_325_335_9,
        gravity_constant: 1.931_852_652_41e-3,
        zonals: [1.082_629_821_313e-3, -2.370_911_200_53e-6, 6.083_464_988_82e-9],
    };

    /// A sphere of a radius (m) with a gravitational parameter (m3/s2), an angular velocity (rad/s) and an oblateness `J2` of its field.
    /// The constants of normal gravity are those on it without that: a sphere is no surface of constant potential where it turns.
    #[must_use]
    pub fn sphere(radius: f64, gravitational_parameter: f64, rotation_rate: f64, j2: f64) -> Self {
        Self {
            semi_major_axis: radius,
            flattening: 0.0,
            gravitational_parameter,
            rotation_rate,
            equatorial_gravity: gravitational_parameter / (radius * radius),
            gravity_constant: 0.0,
            zonals: [j2, 0.0, 0.0],
        }
    }

    /// Square of the first eccentricity.
    #[must_use]
    pub fn eccentricity_squared(&self) -> f64 {
        self.flattening * (2.0 - self.flattening)
    }

    /// Semi-minor axis, m.
    #[must_use]
    pub fn semi_minor_axis(&self) -> f64 {
        self.semi_major_axis * (1.0 - self.flattening)
    }

    /// Normal gravity on the surface at a geodetic latitude (rad), m/s2: Somigliana's formula.
    #[must_use]
    pub fn surface_gravity(&self, latitude: f64) -> f64 {
        let s = latitude.sin().powi(2);
        self.equatorial_gravity * (1.0 + self.gravity_constant * s)
            / (1.0 - self.eccentricity_squared() * s).sqrt()
    }

    /// Normal gravity above a geodetic latitude (rad) as a polynomial of second degree in the height, m/s2, m/s3 and m/s4:
    ///
    /// ```text
    /// g (1 - 2 h (1 + f + m - 2 f sin^2(lat)) / a + 3 h^2 / a^2),   m = w^2 a^2 b / mu
    /// ```
    ///
    /// (Heiskanen and Moritz, eq. 2-123).
    #[must_use]
    pub fn gravity_with_height(&self, latitude: f64) -> [f64; 3] {
        let (a, f) = (self.semi_major_axis, self.flattening);
        let m = (self.rotation_rate * a).powi(2) * self.semi_minor_axis() / self.gravitational_parameter;
        let g = self.surface_gravity(latitude);
        [g, -2.0 * g * (1.0 + f + m - 2.0 * f * latitude.sin().powi(2)) / a, 3.0 * g / (a * a)]
    }

    /// Position, m, at a longitude and a geodetic latitude (rad) and a height (m).
    #[must_use]
    pub fn position(&self, longitude: f64, latitude: f64, altitude: f64) -> [f64; 3] {
        let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
        let e2 = self.eccentricity_squared();
        let n = self.semi_major_axis / (1.0 - e2 * sp * sp).sqrt();
        let across = (n + altitude) * cp;
        [across * cl, across * sl, (n * (1.0 - e2) + altitude) * sp]
    }

    /// Height and local axes at a position (m), by one step of Bowring's method, whose height is within 1e-7 m up to 1000 km (B. R. Bowring,
    /// Survey Review 23, 1976, 323).
    #[inline]
    pub fn geodetic<S: Scalar>(&self, [x, y, z]: &[S; 3]) -> Geodetic<S> {
        let (a, b, e2) = (self.semi_major_axis, self.semi_minor_axis(), self.eccentricity_squared());
        let across = norm(&[*x, *y], AT_POLE);
        let (parametric_sin, parametric_cos) = unit(*z * a, across * b);
        let along = *z + parametric_sin.square() * parametric_sin * (e2 / (1.0 - e2) * b);
        let radial = across - parametric_cos.square() * parametric_cos * (e2 * a);
        let (sin, cos) = unit(along, radial);
        let altitude = across * cos + *z * sin - (-sin.square() * e2 + 1.0).sqrt() * a;
        let (cl, sl) = (*x / across, *y / across);
        let zero = S::from(0.0);
        Geodetic {
            altitude,
            up: [cos * cl, cos * sl, sin],
            north: [-sin * cl, -sin * sl, cos],
            east: [-sl, cl, zero],
        }
    }

    /// Acceleration of gravitation at a position (m), m/s2, without the centrifugal part.
    #[inline]
    pub fn gravitation<S: Scalar>(&self, r: &[S; 3]) -> [S; 3] {
        let [j2, j4, j6] = self.zonals;
        let by_distance = dot(r, r).sqrt().recip();
        let inverse = by_distance.square();
        let t = r[2] * by_distance;
        let tt = t.square();
        let q = inverse * (self.semi_major_axis * self.semi_major_axis);
        // Derivatives of P2, P4 and P6 by t, divided by t, and (n + 1) P_n.
        let (d2, p2) = (S::from(3.0), tt * 1.5 - 0.5);
        let (d4, p4) = (tt * 17.5 - 7.5, (tt * 35.0 - 30.0) * tt * 0.125 + 0.375);
        let d6 = ((tt * 1386.0 - 1260.0) * tt + 210.0) * 0.0625;
        let p6 = (((tt * 231.0 - 315.0) * tt + 105.0) * tt - 5.0) * 0.0625;
        let sum = |two: S, four: S, six: S| q * (two * j2 + q * (four * j4 + q * six * j6));
        let along = sum(d2, d4, d6) * t;
        let radial = sum(p2 * 3.0, p4 * 5.0, p6 * 7.0) - 1.0;
        let size = inverse * self.gravitational_parameter;
        // Gradient of mu/r (1 - sum J_n (a/r)^n P_n(z/r)).
        let central = (radial + along * t) * by_distance;
        [r[0] * central * size, r[1] * central * size, (r[2] * central - along) * size]
    }

    /// Gravitational potential at a position (m), m2/s2, zero far away and positive.
    #[must_use]
    pub fn potential(&self, r: [f64; 3]) -> f64 {
        let [j2, j4, j6] = self.zonals;
        let rr = dot(&r, &r);
        let (tt, q) = (r[2] * r[2] / rr, self.semi_major_axis.powi(2) / rr);
        let p2 = 1.5 * tt - 0.5;
        let p4 = (35.0 * tt - 30.0) * tt / 8.0 + 0.375;
        let p6 = (((231.0 * tt - 315.0) * tt + 105.0) * tt - 5.0) / 16.0;
        self.gravitational_parameter / rr.sqrt() * (1.0 - q * (p2 * j2 + q * (p4 * j4 + q * p6 * j6)))
    }
}

/// Sine and cosine of the angle of a point.
#[inline]
fn unit<S: Scalar>(ordinate: S, abscissa: S) -> (S, S) {
    let size = (ordinate.square() + abscissa.square()).sqrt().recip();
    (ordinate * size, abscissa * size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-7;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    const EARTH: Ellipsoid = Ellipsoid::WGS84;

    /// Published: the digits of the zonals, relative.
    const ZONALS: f64 = 1e-8;

    /// Published: gravity by the formula of the reference, whose constants have these digits, m/s2.
    const PUBLISHED_M_S2: f64 = 1e-10;

    #[test]
    fn geodetic_coordinates_there_and_back() {
        for (longitude, latitude, altitude) in
            [(0.3, 0.6, 1e5), (-2.5, -1.2, -100.0), (3.0, 0.0, 1e6), (1.0, 1.57, 3e4), (1.0, -0.7, 0.0)]
        {
            let at = EARTH.geodetic(&EARTH.position(longitude, latitude, altitude));
            assert!((at.altitude - altitude).abs() < 1e5 * ROUNDING, "{altitude} {}", at.altitude);
            let (sp, cp) = f64::sin_cos(latitude);
            let up = [cp * longitude.cos(), cp * longitude.sin(), sp];
            assert!(
                (0..3).all(|k| (at.up[k] - up[k]).abs() < 100.0 * ROUNDING),
                "{latitude} {:?} {up:?}",
                at.up
            );
        }
        let pole = EARTH.geodetic(&[0.0, 0.0, 6.4e6]);
        assert!((pole.altitude - (6.4e6 - EARTH.semi_minor_axis())).abs() < 1e6 * ROUNDING);
        assert!(pole.up.iter().chain(&pole.north).all(|c| c.is_finite()));
    }

    /// The zonals of the level ellipsoid from its J2 (Heiskanen and Moritz, eq. 2-92).
    #[test]
    fn zonals_of_the_level_ellipsoid() {
        let (e2, [j2, j4, j6]) = (EARTH.eccentricity_squared(), EARTH.zonals);
        let zonal = |n: f64| {
            let sign = if n % 2.0 == 0.0 { -1.0 } else { 1.0 };
            sign * 3.0 * e2.powf(n) / ((2.0 * n + 1.0) * (2.0 * n + 3.0)) * (1.0 - n + 5.0 * n * j2 / e2)
        };
        assert!((zonal(2.0) / j4 - 1.0).abs() < ZONALS && (zonal(3.0) / j6 - 1.0).abs() < ZONALS);
    }

    /// Gravitation and centrifugal acceleration on the surface make Somigliana's gravity, along the normal; J8 and beyond, which are
    /// left out, are below 1e-9 of it.
    #[test]
    fn normal_gravity_on_the_surface() {
        for latitude in [0.0, 0.3, 35.0_f64.to_radians(), 0.9, 1.5] {
            let r = EARTH.position(0.4, latitude, 0.0);
            let w2 = EARTH.rotation_rate.powi(2);
            let [x, y, z] = EARTH.gravitation(&r);
            let gravity = [x + w2 * r[0], y + w2 * r[1], z];
            let at = EARTH.geodetic(&r);
            let expected = EARTH.surface_gravity(latitude);
            assert!((dot(&gravity, &at.up) / -expected - 1.0).abs() < 1e3 * ROUNDING, "{latitude}");
            assert!(
                dot(&gravity, &at.north).abs() < 1e4 * ROUNDING && dot(&gravity, &at.east).abs() < ROUNDING
            );
        }
        // g0 of the moving-mass reference, WGS 84 at 35 deg.
        let g = EARTH.surface_gravity(35.0_f64.to_radians());
        assert!((g - 9.797_336_012_948_563).abs() < PUBLISHED_M_S2, "{g}");
    }

    /// With height, against the full field along the normal. The polynomial leaves out terms of the orders `(h / a)^3`, `f^2 h / a` and
    /// `f (h / a)^2`.
    #[test]
    fn gravity_with_height() {
        let latitude = 35.0_f64.to_radians();
        let [g0, g1, g2] = EARTH.gravity_with_height(latitude);
        for h in [1e3, 2e4, 1e5] {
            let r = EARTH.position(0.0, latitude, h);
            let w2 = EARTH.rotation_rate.powi(2);
            let [x, y, z] = EARTH.gravitation(&r);
            let full = -dot(&[x + w2 * r[0], y + w2 * r[1], z], &EARTH.geodetic(&r).up);
            let (x, f) = (h / EARTH.semi_major_axis, EARTH.flattening);
            let left_out = 5.0 * x * (x * x + f * f + f * x);
            let found = (g0 + h * (g1 + h * g2)) / full - 1.0;
            assert!(found.abs() < left_out, "{h} {found}");
        }
    }

    #[test]
    fn gravitation_is_the_gradient_of_the_potential() {
        let r = [3.1e6, -2.2e6, 5.4e6];
        let a = EARTH.gravitation(&r);
        for k in 0..3 {
            let moved = |s: f64| {
                let mut r = r;
                r[k] += 10.0 * s;
                EARTH.potential(r)
            };
            let slope = (moved(1.0) - moved(-1.0)) / 20.0;
            assert!((a[k] - slope).abs() < DIFFERENCES, "{} {slope}", a[k]);
        }
    }
}
