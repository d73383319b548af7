//! Modified Newtonian impact on sphere-cones and spherical segments.

use apsides_ad::{HyperDual, Scalar};

use crate::DynamicsError;
use crate::error::positive;

/// A sphere-cone or spherical segment that flies with its nose ahead: pressure coefficient `C sin^2` of the angle between surface and air,
/// with the [coefficient at the stagnation point](stagnation_pressure_coefficient) `C` (J. D. Anderson, Hypersonic and High-Temperature Gas
/// Dynamics, 2nd ed., 2006, section 3.3). Coefficients refer to the area of the base, whose own pressure is left out.
///
/// With the half angle `d` of the cone, the part `f = (Rn cos d / Rb)^2` of the base in front of which the sphere is, and the angle of
/// attack `a`, up to `d` in size, where no part of the front is in the shadow:
///
/// ```text
/// CA / C = f (cos^2 a (1 + sin^2 d) / 2 + sin^2 a cos^2 d / 4) + (1 - f) (cos^2 a sin^2 d + sin^2 a cos^2 d / 2)
/// CN / C = sin a cos a cos^2 d (1 - f / 2)
/// CL = CN cos a - CA sin a,   CD = CN sin a + CA cos a
/// ```
///
/// The lift of a blunt body, whose axial force is the larger, is positive at negative angles of attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newtonian {
    /// Half angle of the cone, or of the cone that the segment would go on as, rad.
    half_angle: f64,
    /// Part of the base that is behind the sphere.
    spherical: f64,
    /// Ratio of the specific heats of the gas.
    heat_ratio: f64,
}

impl Newtonian {
    /// A cone of a half angle (rad) with a spherical nose of a radius (m, zero for a sharp one) and a base of a radius (m), in a gas of a
    /// ratio of specific heats.
    ///
    /// # Errors
    /// When a number is out of its range, or the nose wider than the base.
    pub fn sphere_cone(
        nose_radius: f64,
        base_radius: f64,
        half_angle: f64,
        heat_ratio: f64,
    ) -> Result<Self, DynamicsError> {
        let refused = |what, value, unit, allowed| DynamicsError::Parameter { what, value, unit, allowed };
        if !(half_angle > 0.0 && half_angle < std::f64::consts::FRAC_PI_2) {
            return Err(refused(
                "half angle of the cone",
                half_angle,
                "rad",
                "between 0 and pi/2, both excluded",
            ));
        }
        if !(heat_ratio > 1.0 && heat_ratio.is_finite()) {
            return Err(refused("ratio of the specific heats", heat_ratio, "-", "above 1"));
        }
        let base_radius = positive("radius of the base", base_radius, "m")?;
        let width = nose_radius * half_angle.cos() / base_radius;
        // A segment is all sphere, to rounding.
        if !(nose_radius >= 0.0 && width <= 1.0 + 1e-12) {
            let allowed = "a number not below 0, with the sphere's end inside the base";
            return Err(refused("radius of the nose", nose_radius, "m", allowed));
        }
        Ok(Self { half_angle, spherical: width.min(1.0).powi(2), heat_ratio })
    }

    /// The segment of a sphere of a radius (m) with a base of a radius (m), as the heat shields of capsules.
    ///
    /// # Errors
    /// When a number is out of its range, or the base not narrower than the sphere.
    pub fn segment(nose_radius: f64, base_radius: f64, heat_ratio: f64) -> Result<Self, DynamicsError> {
        let nose_radius = positive("radius of the nose", nose_radius, "m")?;
        if base_radius >= nose_radius {
            let allowed = "below the radius of the nose";
            let what = "radius of the base";
            return Err(DynamicsError::Parameter { what, value: base_radius, unit: "m", allowed });
        }
        Self::sphere_cone(nose_radius, base_radius, (base_radius / nose_radius).acos(), heat_ratio)
    }

    /// Largest size of the angle of attack, rad, at which the whole front meets the air and the formulas hold.
    #[must_use]
    pub fn largest_attack(&self) -> f64 {
        self.half_angle
    }

    /// Coefficients of the forces across the axis and along it, by the coefficient of pressure at the stagnation point.
    #[inline]
    fn relative_forces<S: Scalar>(&self, sin: S, cos: S) -> [S; 2] {
        let (sin_half, cos_half) = self.half_angle.sin_cos();
        let (slope, width, sphere) = (sin_half * sin_half, cos_half * cos_half, self.spherical);
        let along = sphere * (1.0 + slope) / 2.0 + (1.0 - sphere) * slope;
        let across = width * (sphere / 4.0 + (1.0 - sphere) / 2.0);
        [sin * cos * (width * (1.0 - sphere / 2.0)), cos.square() * along + sin.square() * across]
    }

    /// Coefficients of the normal and the axial force at a Mach number and an angle of attack (rad).
    #[inline]
    pub fn body_coefficients<S: Scalar>(&self, mach: S, attack: S) -> [S; 2] {
        let (sin, cos) = attack.sin_cos();
        let stagnation = stagnation_pressure_coefficient(mach, self.heat_ratio);
        self.relative_forces(sin, cos).map(|c| c * stagnation)
    }

    /// Coefficients of lift and drag at a Mach number and an angle of attack (rad).
    #[inline]
    pub fn coefficients<S: Scalar>(&self, mach: S, attack: S) -> [S; 2] {
        let (sin, cos) = attack.sin_cos();
        let [normal, axial] = self.body_coefficients(mach, attack);
        [normal * cos - axial * sin, normal * sin + axial * cos]
    }
}

/// Coefficient of pressure at the stagnation point at a Mach number, in a gas of a ratio of specific heats: behind a normal shock by
/// Rayleigh's pitot formula, isentropic below Mach 1 (NACA Report 1135, 1953, eqs. 44 and 100). Two continuous derivatives.
#[inline]
pub fn stagnation_pressure_coefficient<S: Scalar>(mach: S, heat_ratio: f64) -> S {
    mach.map(|m| {
        let HyperDual { re, e1: [slope], e12: [curvature], .. } =
            stagnation(m, HyperDual { re: m, e1: [1.0], e2: [1.0], e12: [0.0] }, heat_ratio);
        [re, slope, curvature]
    })
}

/// The formula that holds at a Mach number, on a scalar of that value.
fn stagnation<S: Scalar>(at: f64, mach: S, k: f64) -> S {
    let square = mach.square();
    if at.abs() < 0.1 {
        // The series of the isentropic formula, which cancels here.
        let c3 = (2.0 - k) * (3.0 - 2.0 * k) / 192.0;
        return square * (square * (square * c3 + (2.0 - k) / 24.0) + 0.25) + 1.0;
    }
    let ratio = if at <= 1.0 {
        (square * ((k - 1.0) / 2.0) + 1.0).powf(k / (k - 1.0))
    } else {
        let entropy = square * (k + 1.0).powi(2) / (square * (4.0 * k) - 2.0 * (k - 1.0));
        entropy.powf(k / (k - 1.0)) * (square * (2.0 * k) + (1.0 - k)) / (k + 1.0)
    };
    (ratio - 1.0) / square * (2.0 / k)
}
