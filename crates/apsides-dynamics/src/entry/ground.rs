//! Distances and courses on the sphere.

/// Angle (rad) at the centre between two places of given longitude and latitude (rad), exact for near and opposite ones.
#[must_use]
pub fn great_circle_angle(from: [f64; 2], to: [f64; 2]) -> f64 {
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
