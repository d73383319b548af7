//! Kepler's motion by universal variables, counted from the periapsis.

use std::f64::consts::{PI, TAU};

use apsides_ad::vector;

use crate::DynamicsError;
use crate::elements::Cartesian;
use crate::error::{finite, positive};

/// Below this magnitude of the argument the power series is as exact as the closed form.
const SERIES: f64 = 1.0;

/// Terms of the series: the next one is below 1e-19 of the first at an argument of 1.
const TERMS: u32 = 9;

/// Stumpff's functions `c_k(x) = 1/k! - x/(k+2)! + x^2/(k+4)! - ..` for `k` from 0 to 3.
///
/// With `x = s^2 > 0` these are `cos(s)`, `sin(s)/s`, `(1 - cos(s))/s^2`, `(s - sin(s))/s^3`, with `x < 0` the same of hyperbolic
/// functions (Battin 1999, section 4.5; Vallado 2013, section 2.2, for `c_2` and `c_3`).
#[must_use]
pub fn stumpff(x: f64) -> [f64; 4] {
    if x.abs() < SERIES {
        let (mut c2, mut c3) = (1.0, 1.0);
        for k in (1..=TERMS).rev() {
            let n = f64::from(2 * k);
            c2 = 1.0 - c2 * x / ((n + 1.0) * (n + 2.0));
            c3 = 1.0 - c3 * x / ((n + 2.0) * (n + 3.0));
        }
        let (c2, c3) = (c2 / 2.0, c3 / 6.0);
        return [1.0 - x * c2, 1.0 - x * c3, c2, c3];
    }
    let s = x.abs().sqrt();
    let (cos, sin, half) =
        if x > 0.0 { (s.cos(), s.sin(), (0.5 * s).sin()) } else { (s.cosh(), s.sinh(), (0.5 * s).sinh()) };
    let c1 = sin / s;
    [cos, c1, 2.0 * half * half / x.abs(), (1.0 - c1) / x]
}

/// A conic with `mu = 1`, in any unit of length; no two of its numbers are computed from another with loss of digits.
///
/// With the universal anomaly `c` from the periapsis, `dc/dt = 1 / r`, and `U_k = c^k c_k(a c^2)` (Battin 1999, section 4.5)
///
/// ```text
/// t = q c + e U_3
/// r = q + e U_2
/// x = q - U_2,  y = sqrt(p) U_1    (periapsis at y = 0)
/// r' = e U_1 / r
/// ```
///
/// Terms of `t` and `r` have one sign on every conic, so that nothing cancels.
#[derive(Clone, Copy)]
pub(super) struct Conic {
    /// Distance of the periapsis `q`.
    pub(super) periapsis: f64,
    /// Eccentricity `e`.
    pub(super) eccentricity: f64,
    /// Reciprocal `a` of the semi-major axis: minus twice the energy.
    pub(super) reciprocal_axis: f64,
}

/// Enough for bisection over all exponents and digits; Laguerre's method takes about four.
const MAX_ITERATIONS: usize = 2200;

impl Conic {
    /// Time from the periapsis to a universal anomaly.
    pub(super) fn time(&self, c: f64) -> f64 {
        let [_, _, _, c3] = stumpff(self.reciprocal_axis * c * c);
        self.periapsis * c + self.eccentricity * c * c * c * c3
    }

    /// Universal anomaly at a time from the periapsis, on an ellipse within half a revolution.
    ///
    /// Laguerre's method of degree 5 (Conway 1986), with bisection where it leaves the bracket or does not halve the error.
    pub(super) fn anomaly(&self, time: f64) -> f64 {
        let Self { periapsis: q, eccentricity: e, reciprocal_axis: a } = *self;
        let t = time.abs();
        // All terms are positive: q c <= t, and U_3 >= c^3 / 6, on an ellipse c^3 / pi^2 up to the apoapsis.
        let least = if a > 0.0 { PI * PI } else { 6.0 };
        let mut high = (t / q).min((least * t / e).cbrt());
        if a < 0.0 {
            // t >= q U_1, since U_1 >= c and q = (e - 1) / -a.
            let root = (-a).sqrt();
            high = high.min((t * root / q).asinh() / root);
        }
        let (mut low, mut c, mut last) = (0.0, high, f64::INFINITY);
        for _ in 0..MAX_ITERATIONS {
            let [_, c1, c2, c3] = stumpff(a * c * c);
            let reached = q * c + e * c * c * c * c3;
            let (excess, radius) = (reached - t, q + e * c * c * c2);
            if excess.abs() <= f64::EPSILON * t {
                break;
            }
            if excess < 0.0 {
                low = c;
            } else {
                high = c;
            }
            let discriminant = 16.0 * radius * radius - 20.0 * excess * e * c * c1;
            let laguerre = c - 5.0 * excess / (radius + discriminant.abs().sqrt());
            if (laguerre - c).abs() <= f64::EPSILON * c {
                c = laguerre;
                break;
            }
            let fast = laguerre > low && laguerre < high && excess.abs() <= 0.5 * last;
            let next = if fast { laguerre } else { 0.5 * (low + high) };
            if next == c {
                break;
            }
            (last, c) = (excess.abs(), next);
        }
        c.copysign(time)
    }
}

/// Position and velocity after a time (s; negative for before) on the conic through a state, with the gravitational parameter `mu`
/// (m3/s2).
///
/// By the universal anomaly from the periapsis, on an ellipse over any number of revolutions, of which the whole ones are taken off first.
/// Errors are a few rounding errors times the sensitivity of the end to the data.
///
/// # Errors
/// When `mu` is not positive, the time not finite, or the state not on an orbit ([`Cartesian::checked`]).
pub fn propagate(mu: f64, state: &Cartesian, time: f64) -> Result<Cartesian, DynamicsError> {
    let mu = positive("gravitational parameter", mu, "m3/s2")?;
    finite("time of flight", time, "s")?;
    let Cartesian { position, velocity } = state.checked()?;
    // Units: the radius, and the speed of a circular orbit there.
    let radius = vector::norm(&position, 0.0);
    let speed = (mu / radius).sqrt();
    let (up, v0) = (position.map(|c| c / radius), velocity.map(|c| c / speed));
    let momentum = vector::cross(&up, &v0);
    let h = vector::norm(&momentum, 0.0);
    let forward = vector::cross(&momentum.map(|c| c / h), &up);
    let rise = vector::dot(&up, &v0);

    let a = 2.0 - vector::dot(&v0, &v0);
    let eccentricity = (h * h - 1.0).hypot(rise * h);
    let conic = Conic { periapsis: h * h / (1.0 + eccentricity), eccentricity, reciprocal_axis: a };
    let root = a.abs().sqrt();
    // e U_1 = r r' and e U_0 = 1 - a r.
    let start = if a > 0.0 {
        (rise * root).atan2(1.0 - a) / root
    } else if a < 0.0 {
        (rise * root / eccentricity).asinh() / root
    } else {
        rise / eccentricity
    };
    let mut elapsed = conic.time(start) + time * speed / radius;
    if a > 0.0 {
        let period = TAU / (a * root);
        if elapsed.abs() > 0.5 * period {
            elapsed -= period * (elapsed / period).round();
        }
    }
    // Polar angle from the periapsis, radius, and radius times its rate.
    let place = |c: f64| {
        let [_, c1, c2, _] = stumpff(a * c * c);
        let (u1, u2) = (c * c1, c * c * c2);
        let [x, y] = [conic.periapsis - u2, h * u1];
        (y.atan2(x), conic.periapsis + eccentricity * u2, eccentricity * u1)
    };
    let (first, ..) = place(start);
    let (last, r, radial) = place(conic.anomaly(elapsed));
    let (sin, cos) = (last - first).sin_cos();
    let outward: [f64; 3] = std::array::from_fn(|k| cos * up[k] + sin * forward[k]);
    let onward: [f64; 3] = std::array::from_fn(|k| cos * forward[k] - sin * up[k]);
    Ok(Cartesian {
        position: outward.map(|c| c * r * radius),
        velocity: std::array::from_fn(|k| (radial * outward[k] + h * onward[k]) / r * speed),
    })
}
