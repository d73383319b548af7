//! Attitude of axes and its rate: matrices and quaternions.

use apsides_dynamics::attitude;

/// An angle and its rate, rad and rad/s.
#[derive(Clone, Copy)]
pub(crate) struct Turning {
    pub(crate) angle: f64,
    pub(crate) rate: f64,
}

impl Turning {
    /// From deg and deg/s.
    pub(crate) fn degrees(angle: f64, rate: f64) -> Self {
        Self { angle: angle.to_radians(), rate: rate.to_radians() }
    }
}

/// Rows of a matrix.
pub(crate) type Matrix = [[f64; 3]; 3];

/// A matrix times a vector.
pub(crate) fn times(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The transpose of a matrix times a vector.
pub(crate) fn transposed_times(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2])
}

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = [0, 1, 2].map(|k| times(a, [b[0][k], b[1][k], b[2][k]]));
    [0, 1, 2].map(|i| [columns[0][i], columns[1][i], columns[2][i]])
}

pub(crate) fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// Components in axes that are turned about the third (`z`) or the first axis, and the derivative of that matrix by the angle.
pub(crate) fn about(z: bool, angle: f64) -> [Matrix; 2] {
    let (s, c) = angle.sin_cos();
    if z {
        [[[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], [[-s, c, 0.0], [-c, -s, 0.0], [0.0; 3]]]
    } else {
        [[[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]], [[0.0; 3], [0.0, -s, c], [0.0, -c, -s]]]
    }
}

/// Axes fixed to a body at an instant, and how they turn, in those of the ICRF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Rows are the axes of the body: it turns components in the ICRF into components in them.
    pub matrix: [[f64; 3]; 3],
    /// Its rate, 1/s.
    pub rate: [[f64; 3]; 3],
}

impl Orientation {
    /// Axes of a pole at a right ascension and a declination, the prime meridian at an angle from the node of the equator.
    pub(crate) fn of_pole(alpha: Turning, delta: Turning, meridian: Turning) -> Self {
        let quarter = std::f64::consts::FRAC_PI_2;
        let [node, node_by_angle] = about(true, quarter + alpha.angle);
        let [tilt, tilt_by_angle] = about(false, quarter - delta.angle);
        let [turn, turn_by_angle] = about(true, meridian.angle);
        let scaled = |m: Matrix, by: f64| m.map(|row| row.map(|v| v * by));
        let parts = [
            scaled(product(&turn_by_angle, &product(&tilt, &node)), meridian.rate),
            scaled(product(&turn, &product(&tilt_by_angle, &node)), -delta.rate),
            scaled(product(&turn, &product(&tilt, &node_by_angle)), alpha.rate),
        ];
        let rate = [0, 1, 2].map(|i| [0, 1, 2].map(|k| parts.iter().map(|m| m[i][k]).sum()));
        Self { matrix: product(&turn, &product(&tilt, &node)), rate }
    }

    /// Position and velocity (m, m/s) relative to the body, in its axes, from those in axes of the ICRF.
    #[must_use]
    pub fn to_fixed(&self, position: [f64; 3], velocity: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let carried = times(&self.rate, position);
        (times(&self.matrix, position), sum(times(&self.matrix, velocity), carried))
    }

    /// Position and velocity (m, m/s) in axes of the ICRF from those relative to the body, in its axes.
    #[must_use]
    pub fn to_icrf(&self, position: [f64; 3], velocity: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let inertial = transposed_times(&self.matrix, position);
        let carried = times(&self.rate, inertial).map(|v| -v);
        (inertial, transposed_times(&self.matrix, sum(velocity, carried)))
    }

    /// A vector in axes of the ICRF from its components in those of the body, at the instant.
    #[must_use]
    pub fn vector_to_icrf(&self, vector: [f64; 3]) -> [f64; 3] {
        transposed_times(&self.matrix, vector)
    }

    /// A vector in the axes of the body from its components in those of the ICRF, at the instant.
    #[must_use]
    pub fn vector_to_fixed(&self, vector: [f64; 3]) -> [f64; 3] {
        times(&self.matrix, vector)
    }
}

/// The quaternion (scalar first) of an attitude in the axes that `to` turns vectors into, from one in the axes before: that of the matrix
/// whose columns are the turned axes of the vehicle.
pub(crate) fn turned_quaternion(q: [f64; 4], to: &dyn Fn([f64; 3]) -> [f64; 3]) -> [f64; 4] {
    let m = attitude::rotation(&q);
    let columns = [0, 1, 2].map(|k| to([m[0][k], m[1][k], m[2][k]]));
    quaternion(&[0, 1, 2].map(|i| [columns[0][i], columns[1][i], columns[2][i]]))
}

/// The unit quaternion (scalar first, not negative) of a rotation: the largest of its components is found first, which loses no digits.
///
/// S. W. Shepperd, Journal of Guidance and Control 1 (1978) 223, doi 10.2514/3.55767b.
fn quaternion(m: &Matrix) -> [f64; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let squares = [trace, m[0][0], m[1][1], m[2][2]];
    let largest = (0..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
    let [x, y, z] = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
    let [xy, xz, yz] = [m[1][0] + m[0][1], m[0][2] + m[2][0], m[2][1] + m[1][2]];
    let of = |square: f64| (1.0 + square).max(0.0);
    let raw = match largest {
        0 => [of(trace), x, y, z],
        1 => [x, of(2.0 * m[0][0] - trace), xy, xz],
        2 => [y, xy, of(2.0 * m[1][1] - trace), yz],
        _ => [z, xz, yz, of(2.0 * m[2][2] - trace)],
    };
    let unit = attitude::normalised(raw);
    if unit[0] < 0.0 { unit.map(|c| -c) } else { unit }
}
