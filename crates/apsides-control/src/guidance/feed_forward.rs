//! The azimuth of a braking thrust, and corrections of both thrust angles by the errors of the start.
//!
//! With the speed `U` along the course and `V` across it, and those of the target, the horizontal part of the thrust points along the velocity
//! that is to be gained, so that both speeds are met at the same time:
//!
//! ```text
//! psi* = atan2(V_f - V, U_f - U)
//! ```
//!
//! The laws of both angles meet altitude and velocity; the place is what comes out. Errors of the start (planned less actual) along the course
//! and across it, `x_e` and `y_e` in metres, `U_e` and `V_e` in metres a second, are known before the flight; what they move the end by is
//! taken back by angles that are added all along it:
//!
//! ```text
//! theta = theta* + K_x x_e + K_U U_e,   psi = psi* + K_y y_e + K_V V_e
//! ```
//!
//! Source: the Chinese contest in mathematical modelling (CUMCM) 2014, problem A, a published solution's section 5.3.5, which measures ways
//! by angles from the centre of the Moon. Its gains come from simulations and are not printed.

use apsides_ad::vector;

/// Gains of the corrections.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedForward {
    /// `K_x`, rad/m.
    pub along: f64,
    /// `K_U`, rad s/m.
    pub along_speed: f64,
    /// `K_y`, rad/m.
    pub across: f64,
    /// `K_V`, rad s/m.
    pub across_speed: f64,
}

/// Angles that are added to those of a law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngleCorrections {
    /// Above the horizontal, rad.
    pub pitch: f64,
    /// From the velocity to be gained to the right, seen from above, rad.
    pub azimuth: f64,
}

impl FeedForward {
    /// The corrections for errors of the start (planned less actual) along the course and across it to the right: place, m, and speed, m/s.
    #[must_use]
    pub fn corrections(&self, place: [f64; 2], speed: [f64; 2]) -> AngleCorrections {
        AngleCorrections {
            pitch: self.along * place[0] + self.along_speed * speed[0],
            azimuth: self.across * place[1] + self.across_speed * speed[1],
        }
    }
}

/// The direction of a thrust at an angle (rad) above the horizontal, over the horizontal velocity that is to be gained (of any size), with
/// corrections of both angles. `up` is a unit vector. None without a velocity to be gained.
#[must_use]
pub fn thrust_direction(
    up: &[f64; 3],
    to_gain: &[f64; 3],
    pitch: f64,
    corrections: AngleCorrections,
) -> Option<[f64; 3]> {
    let size = vector::norm(to_gain, 0.0);
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let ahead = vector::scale(to_gain, size.recip());
    let right = vector::cross(&ahead, up);
    let (sin, cos) = (pitch + corrections.pitch).sin_cos();
    let (aside, onward) = corrections.azimuth.sin_cos();
    let level = vector::add(&vector::scale(&ahead, onward), &vector::scale(&right, aside));
    Some(vector::add(&vector::scale(up, sin), &vector::scale(&level, cos)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    /// By hand: 30 deg up and 90 deg to the right of a velocity to be gained northwards is eastwards.
    #[test]
    fn directions_by_hand() {
        let (up, north) = ([0.0, 0.0, 1.0], [0.0, 7.0, 0.0]);
        let right = AngleCorrections { pitch: 0.0, azimuth: std::f64::consts::FRAC_PI_2 };
        let found = thrust_direction(&up, &north, 30_f64.to_radians(), right).unwrap();
        let expected = [0.75_f64.sqrt(), 0.0, 0.5];
        assert!((0..3).all(|k| (found[k] - expected[k]).abs() < ROUNDING), "{found:?}");
        let straight = thrust_direction(&up, &north, 0.0, AngleCorrections::default()).unwrap();
        assert_eq!(straight, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn corrections_are_linear_in_the_errors_of_the_start() {
        let law = FeedForward { along: 2.0, along_speed: 30.0, across: 500.0, across_speed: 7000.0 };
        let found = law.corrections([1.0, 2.0], [3.0, 4.0]);
        assert_eq!(found, AngleCorrections { pitch: 92.0, azimuth: 29_000.0 });
    }

    #[test]
    fn no_velocity_to_be_gained_has_no_azimuth() {
        for to_gain in [[0.0; 3], [f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
            assert!(thrust_direction(&[0.0, 0.0, 1.0], &to_gain, 0.1, AngleCorrections::default()).is_none());
        }
    }
}
