//! Axes: inertial and fixed to a rotating body, local vertical, east and north.

/// Axes fixed to a body that turns about its third axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyFixed {
    /// Angular velocity, rad/s, positive eastwards.
    pub rotation_rate: f64,
    /// Angle from the first inertial axis to the first fixed one at time 0, rad.
    pub epoch_angle: f64,
}

impl BodyFixed {
    /// Position and velocity (m, m/s) in inertial axes at a time (s) from those relative to the body, in its axes.
    #[must_use]
    pub fn to_inertial(&self, time: f64, position: [f64; 3], velocity: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let w = self.rotation_rate;
        let carried = [velocity[0] - w * position[1], velocity[1] + w * position[0], velocity[2]];
        let angle = self.epoch_angle + w * time;
        (turned(position, angle), turned(carried, angle))
    }

    /// Position and velocity (m, m/s) relative to the body, in its axes, at a time (s) from those in inertial axes.
    #[must_use]
    pub fn to_fixed(&self, time: f64, position: [f64; 3], velocity: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let angle = -(self.epoch_angle + self.rotation_rate * time);
        let (p, v, w) = (turned(position, angle), turned(velocity, angle), self.rotation_rate);
        (p, [v[0] + w * p[1], v[1] - w * p[0], v[2]])
    }
}

/// A vector turned by an angle (rad) about the third axis.
fn turned([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// Local axes at a point of a sphere, as unit vectors in axes fixed to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Away from the centre.
    pub up: [f64; 3],
    /// To the east.
    pub east: [f64; 3],
    /// To the north.
    pub north: [f64; 3],
}

impl Local {
    /// The axes at a longitude and a geocentric latitude, rad.
    #[must_use]
    pub fn at(longitude: f64, latitude: f64) -> Self {
        let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
        Self { up: [cp * cl, cp * sl, sp], east: [-sl, cl, 0.0], north: [-sp * cl, -sp * sl, cp] }
    }

    /// Distance from the centre (m), longitude and latitude (rad) of a position (m); of the centre all zero.
    #[must_use]
    pub fn spherical([x, y, z]: [f64; 3]) -> (f64, f64, f64) {
        let across = x.hypot(y);
        (across.hypot(z), y.atan2(x), z.atan2(across))
    }

    /// Components upwards, to the east and to the north of a vector.
    #[must_use]
    pub fn components(&self, v: [f64; 3]) -> [f64; 3] {
        [self.up, self.east, self.north].map(|a| a.iter().zip(v).map(|(a, v)| a * v).sum())
    }

    /// The vector of components upwards, to the east and to the north.
    #[must_use]
    pub fn vector(&self, [w, e, n]: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| w * self.up[k] + e * self.east[k] + n * self.north[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-11;

    #[test]
    fn there_and_back() {
        let frame = BodyFixed { rotation_rate: 2.66e-6, epoch_angle: 1.2 };
        let (p, v) = ([1.2e6, -0.8e6, 0.9e6], [100.0, -1500.0, 30.0]);
        let (pi, vi) = frame.to_inertial(5e4, p, v);
        let (p2, v2) = frame.to_fixed(5e4, pi, vi);
        for k in 0..3 {
            assert!((p2[k] - p[k]).abs() < 1e3 * ROUNDING && (v2[k] - v[k]).abs() < ROUNDING);
        }
        let (r, longitude, latitude) = Local::spherical(p);
        let local = Local::at(longitude, latitude);
        let [w, e, n] = local.components(p);
        assert!((w - r).abs() < 1e3 * ROUNDING && e.abs() < 1e3 * ROUNDING && n.abs() < 1e3 * ROUNDING);
        let back = local.vector(local.components(v));
        assert!((0..3).all(|k| (back[k] - v[k]).abs() < ROUNDING));
    }

    /// A point at rest on the equator moves east at the rotation rate times the radius.
    #[test]
    fn rest_on_the_ground_moves_in_space() {
        let frame = BodyFixed { rotation_rate: 1e-5, epoch_angle: 0.0 };
        let (_, v) = frame.to_inertial(0.0, [2e6, 0.0, 0.0], [0.0; 3]);
        assert_eq!(v, [0.0, 20.0, 0.0]);
    }
}
