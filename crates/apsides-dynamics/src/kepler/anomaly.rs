//! Kepler's equation for ellipses and hyperbolas, Barker's for parabolas.

use std::f64::consts::TAU;

use super::universal::Conic;
use crate::DynamicsError;
use crate::error::finite;

/// Eccentric anomaly `E` (rad) from the mean anomaly `M` (rad) of an ellipse, `M = E - e sin(E)` (Vallado 2013, section 2.2); both
/// count revolutions. For any `e` in [0, 1), to the conditioning of the equation.
///
/// # Errors
/// When the mean anomaly is not finite or the eccentricity not in [0, 1).
pub fn eccentric_anomaly(mean_anomaly: f64, e: f64) -> Result<f64, DynamicsError> {
    let mean = finite("mean anomaly", mean_anomaly, "rad")?;
    eccentricity(e, 0.0..1.0, "0 up to, not including, 1")?;
    let turns = TAU * (mean / TAU).round();
    // In units of the semi-major axis, where universal and eccentric anomaly are the same.
    let ellipse = Conic { periapsis: 1.0 - e, eccentricity: e, reciprocal_axis: 1.0 };
    Ok(ellipse.anomaly(mean - turns) + turns)
}

/// Hyperbolic anomaly `H` from the mean anomaly `N = e sinh(H) - H` of a hyperbola (Vallado 2013, section 2.2).
///
/// # Errors
/// When the mean anomaly is not finite or the eccentricity not above 1 and finite.
///
/// # Examples
/// ```
/// use apsides_dynamics::kepler::hyperbolic_anomaly;
///
/// let e = 1.4;
/// let found = hyperbolic_anomaly(3.0, e)?;
/// assert!((e * found.sinh() - found - 3.0).abs() < 1e-14);
/// # Ok::<(), apsides_dynamics::DynamicsError>(())
/// ```
pub fn hyperbolic_anomaly(mean_anomaly: f64, e: f64) -> Result<f64, DynamicsError> {
    let mean = finite("mean anomaly", mean_anomaly, "rad")?;
    eccentricity(e, 1.0_f64.next_up()..f64::INFINITY, "a finite number above 1")?;
    Ok(Conic { periapsis: e - 1.0, eccentricity: e, reciprocal_axis: -1.0 }.anomaly(mean))
}

/// `D = tan(v/2)` of the true anomaly `v` from `M = D + D^3 / 3`, which grows by `2 sqrt(mu / p^3)` per second on a parabola: Barker's
/// equation (Vallado 2013, section 2.2), solved in closed form.
///
/// # Errors
/// When `M` is not finite.
///
/// # Examples
/// ```
/// use apsides_dynamics::kepler::parabolic_anomaly;
///
/// // At a right angle from the periapsis D = 1, and D + D^3 / 3 = 4 / 3.
/// assert!((parabolic_anomaly(4.0 / 3.0)? - 1.0).abs() < 1e-15);
/// # Ok::<(), apsides_dynamics::DynamicsError>(())
/// ```
pub fn parabolic_anomaly(mean_anomaly: f64) -> Result<f64, DynamicsError> {
    let m = finite("mean anomaly", mean_anomaly, "rad")?;
    Ok(2.0 * ((1.5 * m).asinh() / 3.0).sinh())
}

/// True anomaly (rad) from the eccentric one (rad) on an ellipse, revolutions counted.
#[must_use]
pub fn true_from_eccentric(eccentric: f64, e: f64) -> f64 {
    stretched(eccentric, (1.0 + e).sqrt(), (1.0 - e).sqrt())
}

/// Eccentric anomaly (rad) from the true one (rad) on an ellipse, revolutions counted.
#[must_use]
pub fn eccentric_from_true(true_anomaly: f64, e: f64) -> f64 {
    stretched(true_anomaly, (1.0 - e).sqrt(), (1.0 + e).sqrt())
}

/// The angle whose half has its tangent greater by `ordinate / abscissa`, in the same revolution.
fn stretched(angle: f64, ordinate: f64, abscissa: f64) -> f64 {
    let turns = TAU * (angle / TAU).round();
    let (sin, cos) = (0.5 * (angle - turns)).sin_cos();
    2.0 * (ordinate * sin).atan2(abscissa * cos) + turns
}

fn eccentricity(value: f64, range: std::ops::Range<f64>, allowed: &'static str) -> Result<(), DynamicsError> {
    if range.contains(&value) {
        Ok(())
    } else {
        Err(DynamicsError::Parameter { what: "eccentricity", value, unit: "-", allowed })
    }
}
