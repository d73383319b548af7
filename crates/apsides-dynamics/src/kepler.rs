//! Motion on a conic: where a vehicle is after a time, and the time from place to place.
//!
//! ```text
//! r'' = -mu r / |r|^3
//! ```
//!
//! | names | subject |
//! | --- | --- |
//! | [`propagate`] | state after a time, forward or backward, on any conic, by universal variables |
//! | [`stumpff`] | the functions of that |
//! | [`eccentric_anomaly`], [`hyperbolic_anomaly`], [`parabolic_anomaly`] | Kepler's equation and Barker's |
//! | [`true_from_eccentric`], [`eccentric_from_true`] | anomalies of an ellipse, revolutions counted |
//! | [`time_since_periapsis`] | time from the lowest point to a true anomaly, on any conic |
//! | [`mean_longitude`], [`coast_duration`], [`longitude_after`] | time between true longitudes of an ellipse, smooth, and back |
//!
//! References: Vallado 2013, chapter 2; B. A. Conway, *Celestial Mechanics* 39 (1986) 199, doi 10.1007/BF01230852 (Laguerre's method
//! for Kepler's equation); R. H. Battin, *An Introduction to the Mathematics and Methods of Astrodynamics*, AIAA 1999,
//! doi 10.2514/4.861543, section 4.5.

use std::f64::consts::{PI, TAU};

use apsides_ad::Scalar;

use crate::DynamicsError;
use crate::elements::PlanarEquinoctial;
use crate::error::{finite, positive};

mod anomaly;
mod universal;

pub use anomaly::{
    eccentric_anomaly, eccentric_from_true, hyperbolic_anomaly, parabolic_anomaly, true_from_eccentric,
};
use universal::Conic;
pub use universal::{propagate, stumpff};

/// Time (s) from the periapsis to a true anomaly (rad) on a conic of semi-latus rectum `p` (m) and eccentricity `e`; negative before the
/// periapsis. On an ellipse the true anomaly counts revolutions.
///
/// # Errors
/// When `mu` or `p` is not positive, `e` is negative, the true anomaly is beyond the asymptotes, or a number is not finite.
///
/// # Examples
/// ```
/// use apsides_dynamics::kepler::time_since_periapsis;
/// use std::f64::consts::PI;
///
/// // Half of the period pi sqrt(a^3 / mu) of an ellipse of a = p / (1 - e^2) lies between its ends.
/// let (mu, p, e) = (3.986_004_418e14_f64, 1e7_f64, 0.6);
/// let half = PI * ((p / (1.0 - e * e)).powi(3) / mu).sqrt();
/// assert!((time_since_periapsis(mu, p, e, PI)? / half - 1.0).abs() < 1e-14);
/// # Ok::<(), apsides_dynamics::DynamicsError>(())
/// ```
pub fn time_since_periapsis(mu: f64, p: f64, e: f64, true_anomaly: f64) -> Result<f64, DynamicsError> {
    let mu = positive("gravitational parameter", mu, "m3/s2")?;
    let p = positive("semi-latus rectum", p, "m")?;
    let anomaly = finite("true anomaly", true_anomaly, "rad")?;
    let refused = |what, value, unit, allowed| Err(DynamicsError::Parameter { what, value, unit, allowed });
    if !(0.0..f64::INFINITY).contains(&e) {
        return refused("eccentricity", e, "-", "a finite number from 0 on");
    }
    if e >= 1.0 && (anomaly.abs() >= PI || 1.0 + e * anomaly.cos() <= 0.0) {
        return refused("true anomaly", anomaly, "rad", "what lies between the asymptotes of the orbit");
    }
    let turns = (anomaly / TAU).round();
    let within = anomaly - TAU * turns;
    let tangent = (0.5 * within).tan();
    // In units of p, with mu = 1.
    let axis = (1.0 - e) * (1.0 + e);
    let root = axis.abs().sqrt();
    let (universal, revolutions) = if e < 1.0 {
        (eccentric_from_true(within, e) / root, turns * TAU / (axis * root))
    } else if e > 1.0 {
        (2.0 * (((e - 1.0) / (e + 1.0)).sqrt() * tangent).atanh() / root, 0.0)
    } else {
        (tangent, 0.0)
    };
    let conic = Conic { periapsis: 1.0 / (1.0 + e), eccentricity: e, reciprocal_axis: axis };
    Ok(p * (p / mu).sqrt() * (conic.time(universal) + revolutions))
}

/// Mean longitude (rad) at the true longitude `l` (rad) of an ellipse with `f = e cos(w + W)`, `g = e sin(w + W)`.
///
/// With `n = sqrt(1 - e^2)`, `q = 1 + f cos(l) + g sin(l)` and `s = f sin(l) - g cos(l)`, which are `1 + e cos` and `e sin` of the true
/// anomaly,
///
/// ```text
/// l - 2 atan(s / (n + q)) - n s / q
/// ```
///
/// (Battin 1999, section 4.3, for the difference of true and eccentric anomaly.) Smooth for every `l` and for `e` from 0 up to, not
/// including, 1; `l` and the result count revolutions together.
#[must_use]
pub fn mean_longitude<S: Scalar>(f: S, g: S, l: S) -> S {
    let (sin, cos) = l.sin_cos();
    let q = f * cos + g * sin + 1.0;
    let s = f * sin - g * cos;
    let n = axis_ratio(f, g);
    l - (s / (n + q)).atan() * 2.0 - n * s / q
}

/// Time (s) of the flight without thrust from one true longitude to another (rad) on an ellipse of semi-latus rectum `p` (m) and
/// eccentricity `f`, `g`, with the gravitational parameter `mu` (m3/s2).
///
/// The difference of the mean longitudes by the mean motion: smooth in all arguments, negative backward, and a difference of 2 pi is one
/// period. For `e` close to 1 rounding errors grow by `(1 - e^2)^-1.5`; not a number from `e = 1` on.
#[must_use]
pub fn coast_duration<S: Scalar>(mu: f64, p: S, f: S, g: S, from: S, to: S) -> S {
    (mean_longitude(f, g, to) - mean_longitude(f, g, from)) * (p / axis_ratio(f, g).square()).powf(1.5)
        / mu.sqrt()
}

/// True longitude (rad), revolutions counted, after a time (s) on an ellipse: what [`coast_duration`] inverts.
///
/// # Errors
/// When `mu` is not positive, the time not finite, or the orbit not an ellipse.
pub fn longitude_after(mu: f64, orbit: &PlanarEquinoctial, time: f64) -> Result<f64, DynamicsError> {
    let mu = positive("gravitational parameter", mu, "m3/s2")?;
    let time = finite("time of flight", time, "s")?;
    let [p, f, g, l] = orbit.checked()?.array();
    let e = orbit.eccentricity();
    let motion = mu.sqrt() * ((1.0 - e) * (1.0 + e) / p).powf(1.5);
    let periapsis = g.atan2(f);
    let mean = mean_longitude(f, g, l) - periapsis + motion * time;
    Ok(periapsis + true_from_eccentric(eccentric_anomaly(mean, e)?, e))
}

/// `sqrt(1 - e^2)`: the minor by the major axis of an ellipse.
fn axis_ratio<S: Scalar>(f: S, g: S) -> S {
    (S::from(1.0) - f * f - g * g).sqrt()
}

#[cfg(test)]
mod tests;
