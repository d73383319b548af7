//! Coasts in closed form: time between two true longitudes of an orbit, and the way back.
//!
//! With the eccentric longitude `F` (argument of perigee and node added to the eccentric anomaly) and `b = 1 + sqrt(1 - f^2 - g^2)`:
//!
//! ```text
//! F = L - 2 atan[(f sin(L) - g cos(L)) / (b + f cos(L) + g sin(L))]
//! sqrt(mu / a^3) t = F - f sin(F) + g cos(F),        a = p / (1 - f^2 - g^2)
//! ```
//!
//! Kepler's equation in equinoctial elements (R. A. Broucke, P. J. Cefola, *Celestial Mechanics* 5 (1972) 303,
//! doi 10.1007/BF01228432); both denominators are positive, so that `F` and `L` count revolutions alike.

use apsides_ad::{Scalar, VectorFunction};

/// The conic that a vehicle coasts along.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conic<S> {
    p: S,
    f: S,
    g: S,
    /// `sqrt(1 - f^2 - g^2)`.
    root: S,
}

impl<S: Scalar> Conic<S> {
    pub(super) fn new(p: S, f: S, g: S) -> Self {
        Self { p, f, g, root: (-(f * f + g * g) + 1.0).sqrt() }
    }

    /// `[x sin - y cos, x cos + y sin]` of an angle.
    fn turned(&self, angle: S) -> [S; 2] {
        let (sin, cos) = angle.sin_cos();
        [self.f * sin - self.g * cos, self.f * cos + self.g * sin]
    }

    /// Eccentric longitude at a true longitude, rad.
    pub(super) fn eccentric_longitude(&self, longitude: S) -> S {
        let [across, along] = self.turned(longitude);
        longitude - (across / (self.root + 1.0 + along)).atan() * 2.0
    }

    /// True longitude at an eccentric longitude, rad.
    pub(super) fn true_longitude(&self, eccentric: S) -> S {
        let [across, along] = self.turned(eccentric);
        eccentric + (across / (self.root + 1.0 - along)).atan() * 2.0
    }

    /// Mean longitude at an eccentric longitude, rad: Kepler's equation.
    pub(super) fn mean_longitude(&self, eccentric: S) -> S {
        eccentric - self.turned(eccentric)[0]
    }

    /// Time in which the mean longitude grows by 1 rad, s.
    pub(super) fn time_per_radian(&self, mu: f64) -> S {
        let a = self.p / self.root.square();
        (a * a * a / mu).sqrt()
    }

    /// Time from one true longitude to another, s.
    pub(super) fn time(&self, mu: f64, from: S, to: S) -> S {
        let mean = |longitude| self.mean_longitude(self.eccentric_longitude(longitude));
        (mean(to) - mean(from)) * self.time_per_radian(mu)
    }
}

/// Newton steps; from the mean longitude of a nearby point a few suffice.
const NEWTON_STEPS: usize = 30;

impl Conic<f64> {
    /// Returns true if it is an ellipse of finite size.
    pub(super) fn is_ellipse(&self) -> bool {
        self.p > 0.0 && self.p.is_finite() && self.root > 0.0
    }

    /// Eccentric longitude at a mean longitude, rad, from one nearby.
    pub(super) fn eccentric_at(&self, mean: f64, nearby: f64) -> f64 {
        let mut eccentric = nearby;
        for _ in 0..NEWTON_STEPS {
            let [across, along] = self.turned(eccentric);
            let step = (mean - (eccentric - across)) / (1.0 - along);
            eccentric += step;
            if step.abs() <= 4.0 * f64::EPSILON * eccentric.abs().max(1.0) {
                break;
            }
        }
        eccentric
    }
}

/// Time of a whole flight, of `6 n - 5` quantities for `n` burns: the time of each burn, then `[p, f, g, L at cut-off, L at ignition]` of
/// each coast.
pub(super) struct FlightTime {
    pub(super) mu: f64,
}

/// Quantities of a coast.
const COAST: usize = 5;

impl<const N: usize> VectorFunction<N, 1> for FlightTime {
    fn evaluate<S: Scalar>(&self, z: &[S; N]) -> [S; 1] {
        let (burns, coasts) = z.split_at(N.div_ceil(COAST + 1));
        let mut sum = S::from(0.0);
        for burn in burns {
            sum += *burn;
        }
        for coast in coasts.as_chunks::<COAST>().0 {
            let [p, f, g, cut_off, ignition] = *coast;
            sum += Conic::new(p, f, g).time(self.mu, cut_off, ignition);
        }
        [sum]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-13;

    /// Half an ellipse from perigee takes half the period (Kepler's third law), each revolution a whole one, both ways.
    #[test]
    fn revolutions_take_periods() {
        let (mu, a, e) = (3.986_004_418e14, 24.5e6, 0.73);
        let period = TAU * f64::sqrt(a * a * a / mu);
        for apse in [0.0, 1.0, -2.5] {
            let conic = Conic::new(a * (1.0 - e * e), e * f64::cos(apse), e * f64::sin(apse));
            for (turns, expected) in [(0.5, 0.5), (1.0, 1.0), (3.5, 3.5)] {
                let time = conic.time(mu, apse, apse + turns * TAU);
                assert!((time / period - expected).abs() < 0.1 * ROUNDING, "{time}");
            }
            for k in 0..40 {
                let longitude = -PI + 0.35 * f64::from(k);
                let eccentric = conic.eccentric_longitude(longitude);
                assert!((conic.true_longitude(eccentric) - longitude).abs() < ROUNDING);
                let mean = conic.mean_longitude(eccentric);
                assert!((conic.eccentric_at(mean, eccentric + 0.2) - eccentric).abs() < ROUNDING);
            }
        }
    }
}
