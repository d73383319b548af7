//! Distances, courses and destinations on the sphere.

/// Angle (rad) at the centre between two places of given longitude and latitude (rad), exact for near and opposite ones.
#[must_use]
pub fn central_angle(from: [f64; 2], to: [f64; 2]) -> f64 {
    let ((sin_a, cos_a), (sin_b, cos_b)) = (from[1].sin_cos(), to[1].sin_cos());
    let (sin_l, cos_l) = (to[0] - from[0]).sin_cos();
    let across = (cos_b * sin_l).hypot(cos_a * sin_b - sin_a * cos_b * cos_l);
    across.atan2(sin_a * sin_b + cos_a * cos_b * cos_l)
}

/// Course (rad, from north, clockwise, in (-pi, pi]) at the first of two places on the great circle to the second.
#[must_use]
pub fn initial_course(from: [f64; 2], to: [f64; 2]) -> f64 {
    let ((sin_a, cos_a), (sin_b, cos_b)) = (from[1].sin_cos(), to[1].sin_cos());
    let (sin_l, cos_l) = (to[0] - from[0]).sin_cos();
    (cos_b * sin_l).atan2(cos_a * sin_b - sin_a * cos_b * cos_l)
}

/// Longitude and latitude (rad) at the end of the great circle from a place along a course (rad, from north, clockwise) over an angle at the
/// centre (rad).
#[must_use]
pub fn destination(from: [f64; 2], course: f64, angle: f64) -> [f64; 2] {
    let ((sin_a, cos_a), (sin_s, cos_s)) = (from[1].sin_cos(), angle.sin_cos());
    let (sin_c, cos_c) = course.sin_cos();
    let north = sin_a * cos_s + cos_a * sin_s * cos_c;
    let [x, y] = [cos_a * cos_s - sin_a * sin_s * cos_c, sin_s * sin_c];
    [from[0] + y.atan2(x), north.atan2(x.hypot(y))]
}

/// Angles (rad) along and to the right of a course (rad, from north, clockwise) from one place to another.
#[must_use]
pub fn along_and_across(from: [f64; 2], to: [f64; 2], course: f64) -> [f64; 2] {
    let (angle, off) = (central_angle(from, to), initial_course(from, to) - course);
    [(angle.sin() * off.cos()).atan2(angle.cos()), (angle.sin() * off.sin()).asin()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    /// Round-off of angles over the step of 1e-9 between them.
    const CANCELLATION: f64 = 1e-6;

    #[test]
    fn angles_along_meridians_and_across_the_pole() {
        let (latitude, step) = (0.7, 1e-9);
        assert!((central_angle([0.3, latitude], [0.3, latitude + step]) / step - 1.0).abs() < CANCELLATION);
        let over = central_angle([0.3, 1.2], [0.3 + std::f64::consts::PI, 1.1]);
        assert!((over - (std::f64::consts::PI - 2.3)).abs() < ROUNDING);
    }

    #[test]
    fn a_destination_is_at_its_angle_on_its_course() {
        let from = [-0.34, 0.77];
        for (course, angle) in [(0.3, 1e-6), (2.0, 0.4), (-2.9, 3.0), (1.5, 1e-3)] {
            let to = destination(from, course, angle);
            assert!((central_angle(from, to) - angle).abs() < ROUNDING, "{course} {angle}");
            assert!((initial_course(from, to) - course).abs() < 1e6 * ROUNDING, "{course} {angle}");
        }
    }

    #[test]
    fn along_and_across_a_course() {
        let (from, course) = ([0.2, 0.4], 2.1);
        let [along, across] = along_and_across(from, destination(from, course, 0.3), course);
        assert!((along - 0.3).abs() < ROUNDING && across.abs() < ROUNDING);
        // Napier's rules for a right-angled triangle on the sphere.
        let [along, across] = along_and_across(from, destination(from, course + 0.5, 0.3), course);
        assert!((along.cos() * across.cos() - 0.3_f64.cos()).abs() < ROUNDING && across > 0.0);
    }
}
