//! Attitude by unit quaternions, scalar first.
//!
//! A quaternion `q` turns vectors from the axes of the body to the local axes: `v_local = q v_body q*`. Its rate follows from the angular
//! velocity `w` of the body relative to the local axes, in body axes:
//!
//! ```text
//! q' = q (0, w) / 2
//! ```
//!
//! (B. L. Stevens, F. L. Lewis and E. N. Johnson, Aircraft Control and Simulation, 3rd ed., 2016, section 1.3.) The [`rotation`] is that of
//! `q / |q|`, so that the norm, which integration lets drift by its error, has no effect.
//!
//! Angles: yaw about z, then pitch about y, then roll about x, from the local axes to the body.

use apsides_ad::Scalar;

/// A quaternion, scalar first.
pub type Quaternion<S> = [S; 4];

/// Rows of the matrix that turns vectors from the axes of the body to the local axes.
#[inline]
#[must_use]
pub fn rotation<S: Scalar>(q: &Quaternion<S>) -> [[S; 3]; 3] {
    let [w, x, y, z] = *q;
    let (ww, xx, yy, zz) = (w * w, x * x, y * y, z * z);
    let double = (ww + xx + yy + zz).recip() * 2.0;
    let product = |a: S, b: S| a * b * double;
    let (xy, xz, yz) = (product(x, y), product(x, z), product(y, z));
    let (wx, wy, wz) = (product(w, x), product(w, y), product(w, z));
    let diagonal = |sum: S| -(sum * double) + 1.0;
    [
        [diagonal(yy + zz), xy - wz, xz + wy],
        [xy + wz, diagonal(xx + zz), yz - wx],
        [xz - wy, yz + wx, diagonal(xx + yy)],
    ]
}

/// A matrix times a vector.
#[inline]
#[must_use]
pub fn turned<S: Scalar>(matrix: &[[S; 3]; 3], v: &[S; 3]) -> [S; 3] {
    std::array::from_fn(|i| matrix[i][0] * v[0] + matrix[i][1] * v[1] + matrix[i][2] * v[2])
}

/// The transpose of a matrix times a vector: the way back of a rotation.
#[inline]
#[must_use]
pub fn turned_back<S: Scalar>(matrix: &[[S; 3]; 3], v: &[S; 3]) -> [S; 3] {
    std::array::from_fn(|i| matrix[0][i] * v[0] + matrix[1][i] * v[1] + matrix[2][i] * v[2])
}

/// Rate of a quaternion at the angular velocity (rad/s) of the body relative to the local axes, in body axes.
#[inline]
#[must_use]
pub fn rate<S: Scalar>(q: &Quaternion<S>, [p, r, s]: &[S; 3]) -> Quaternion<S> {
    let [w, x, y, z] = *q;
    let (p, r, s) = (*p * 0.5, *r * 0.5, *s * 0.5);
    [-(x * p + y * r + z * s), w * p + y * s - z * r, w * r + z * p - x * s, w * s + x * r - y * p]
}

/// The rotation `b`, followed by the rotation `a`.
#[must_use]
pub fn product(a: &Quaternion<f64>, b: &Quaternion<f64>) -> Quaternion<f64> {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
        a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
    ]
}

/// The quaternion of length one; of zero, no rotation.
#[must_use]
pub fn normalised(q: Quaternion<f64>) -> Quaternion<f64> {
    let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    if norm > 0.0 { q.map(|c| c / norm) } else { [1.0, 0.0, 0.0, 0.0] }
}

/// The quaternion of an angle (rad) about an axis: 0, 1, 2 for x, y, z.
#[must_use]
pub fn about(axis: usize, angle: f64) -> Quaternion<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    let mut q = [cos, 0.0, 0.0, 0.0];
    q[1 + axis] = sin;
    q
}

/// The attitude of yaw, pitch and roll, rad.
#[must_use]
pub fn from_angles([yaw, pitch, roll]: [f64; 3]) -> Quaternion<f64> {
    product(&product(&about(2, yaw), &about(1, pitch)), &about(0, roll))
}

/// Yaw, pitch and roll, rad, of an attitude; at pitch +-90 deg only a sum of yaw and roll is determined, and roll is zero.
///
/// # Examples
/// ```
/// use apsides_dynamics::attitude::{from_angles, to_angles};
///
/// let angles = [0.3, -0.2, 1.5];
/// let found = to_angles(&from_angles(angles));
/// assert!(found.iter().zip(angles).all(|(found, angle)| (found - angle).abs() < 1e-15));
/// ```
#[must_use]
pub fn to_angles(q: &Quaternion<f64>) -> [f64; 3] {
    let m = rotation(q);
    let across = m[2][1].hypot(m[2][2]);
    if across < 1e-12 {
        return [(-m[0][1]).atan2(m[1][1]), (-m[2][0]).atan2(across), 0.0];
    }
    [m[1][0].atan2(m[0][0]), (-m[2][0]).atan2(across), m[2][1].atan2(m[2][2])]
}

/// The attitude, relative to local axes north, east, down, of a body that flies at an azimuth from north and a flight path angle, rolled by a
/// bank angle about the velocity, at an angle of attack `atan2(w, u)` and a sideslip `asin(v / V)`; rad.
#[must_use]
pub fn from_flow(azimuth: f64, path: f64, bank: f64, attack: f64, sideslip: f64) -> Quaternion<f64> {
    let velocity = from_angles([azimuth, path, bank]);
    product(&product(&velocity, &about(2, -sideslip)), &about(1, attack))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-10;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-14;

    const ANGLES: [f64; 3] = [2.1, -1.2, 0.7];

    fn close(a: &[f64], b: &[f64]) {
        assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < ROUNDING), "{a:?} {b:?}");
    }

    #[test]
    fn angles_there_and_back() {
        close(&to_angles(&from_angles(ANGLES)), &ANGLES);
        // At pitch 90 deg, where angles are singular, the rotation is still the same.
        let upright = from_angles([0.4, std::f64::consts::FRAC_PI_2, 0.0]);
        let again = from_angles(to_angles(&upright));
        close(rotation(&upright).as_flattened(), rotation(&again).as_flattened());
    }

    #[test]
    fn rotations_follow_each_other() {
        let (a, b) = (from_angles(ANGLES), from_angles([-0.3, 0.5, 1.9]));
        let v = [0.3, -0.8, 1.4];
        let one = turned(&rotation(&product(&a, &b)), &v);
        close(&one, &turned(&rotation(&a), &turned(&rotation(&b), &v)));
        close(&turned_back(&rotation(&a), &turned(&rotation(&a), &v)), &v);
        close(rotation(&a.map(|c| 3.0 * c)).as_flattened(), rotation(&a).as_flattened());
        close(&normalised(a.map(|c| -2.0 * c)), &a.map(|c| -c));
        assert_eq!(normalised([0.0; 4]), [1.0, 0.0, 0.0, 0.0]);
    }

    /// A body that turns at a constant angular velocity in body axes.
    #[test]
    fn the_rate_turns_the_body() {
        let (q, w) = (from_angles(ANGLES), [0.2, -0.5, 0.9]);
        let h = 1e-5;
        let size = w.iter().map(|c| c * c).sum::<f64>().sqrt();
        let step = |t: f64| {
            let (sin, cos) = (0.5 * size * t).sin_cos();
            product(&q, &[cos, sin * w[0] / size, sin * w[1] / size, sin * w[2] / size])
        };
        let (before, after, found) = (step(-h), step(h), rate(&q, &w));
        for k in 0..4 {
            assert!((found[k] - (after[k] - before[k]) / (2.0 * h)).abs() < DIFFERENCES);
        }
    }

    /// The velocity is where the angles of the flow say.
    #[test]
    fn angles_of_the_flow() {
        let (azimuth, path, attack, sideslip) = (0.8_f64, -1.48_f64, 0.2_f64, -0.1_f64);
        let q = from_flow(azimuth, path, 0.3, attack, sideslip);
        let velocity = [path.cos() * azimuth.cos(), path.cos() * azimuth.sin(), -path.sin()];
        let [u, v, w] = turned_back(&rotation(&q), &velocity);
        close(&[w.atan2(u), v.asin()], &[attack, sideslip]);
    }
}
