//! Analytic guess of a burn from circle to circle in minimum time: constant mass, no gravity but for the speeds of both circles.
//!
//! Then the costate of the radius is constant, that of the radial speed falls linearly through zero at half time and that of the
//! horizontal speed is constant. In canonical units, with the acceleration `A`, the ratio of the radii `R`, the burn time `t` and
//! `k = lambda_v / |lambda_u|` at the start,
//!
//! ```text
//! R - 1         = A t^2 / 4 [sqrt(1 + k^2) - k^2 asinh(1 / k)]
//! 1 - R^(-1/2)  = A t k asinh(1 / k)
//! lambda_r = -1,   lambda_u = -t / 2,   lambda_v = k t / 2
//! ```
//!
//! and the costates of the time are `2 / (A t sqrt(1 + k^2))` times these. The equation of the publication (16) that gives the guess is
//! lost in its text; this one follows from the assumptions stated there, those of J. D. Thorne and C. D. Hall.

/// Bisections: more than the digits of a number.
const STEPS: usize = 200;
/// The interval that `k` is in.
const RATIOS: (f64, f64) = (1e-12, 50.0);

/// A guess in canonical units, costates scaled by `lambda_r = -1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AnalyticGuess {
    pub(super) time: f64,
    /// Costates of the radial and horizontal speed at ignition.
    pub(super) costates: [f64; 2],
    /// By which all costates are those of the time.
    pub(super) scale: f64,
}

impl AnalyticGuess {
    /// With a constant acceleration, that at ignition.
    pub(super) fn constant_mass(ratio: f64, acceleration: f64) -> Self {
        let time = |k: f64| {
            let bracket = k.hypot(1.0) - k * k * (1.0 / k).asinh();
            (4.0 * (ratio - 1.0) / (acceleration * bracket)).sqrt()
        };
        let loss = 1.0 - ratio.sqrt().recip();
        let (mut low, mut high) = RATIOS;
        for _ in 0..STEPS {
            let k = (low * high).sqrt();
            if acceleration * time(k) * k * (1.0 / k).asinh() < loss { low = k } else { high = k }
        }
        let k = (low * high).sqrt();
        let t = time(k);
        Self { time: t, costates: [-0.5 * t, 0.5 * k * t], scale: 2.0 / (acceleration * t * k.hypot(1.0)) }
    }

    /// With the mean of the acceleration over the burn, whose mass falls at a rate of `flow` from one:
    /// `A ln(1 / (1 - flow t)) / (flow t)`.
    pub(super) fn mean_acceleration(ratio: f64, acceleration: f64, flow: f64) -> Self {
        let at = |time: f64| {
            let burnt = flow * time;
            Self::constant_mass(ratio, acceleration * -(-burnt).ln_1p() / burnt)
        };
        let (mut low, mut high) = (0.0, 1.0 / flow);
        for _ in 0..STEPS {
            let time = 0.5 * (low + high);
            if at(time).time > time { low = time } else { high = time }
        }
        at(0.5 * (low + high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published: half a unit of the last digit, and as much as the acceleration has been rounded by.
    const PUBLISHED: f64 = 6e-6;

    /// Discretisation: what a mass flow of 1e-7 changes.
    const LITTLE_FLOW: f64 = 1e-6;

    /// Reference: the two equations solved by an independent program (Breeze-M, Block DM, Yastreb of Table 1).
    #[test]
    fn constant_mass_solves_both_equations() {
        let cases = [
            (1.05, 0.09824394073637328, [-0.715809421810527, 0.0323615388396768, 1.431618843621054]),
            (1.1, 0.5396235165885299, [-0.43091, 0.00958, 0.86182]),
            (1.75, 0.1917402976166284, [-2.00668, 0.21842, 4.01337]),
        ];
        for (ratio, acceleration, [u, v, time]) in cases {
            let guess = AnalyticGuess::constant_mass(ratio, acceleration);
            for (found, expected) in [(guess.costates[0], u), (guess.costates[1], v), (guess.time, time)] {
                assert!((found - expected).abs() < PUBLISHED, "{ratio}: {found} {expected}");
            }
        }
    }

    /// With little propellant burnt both guesses are the same.
    #[test]
    fn mean_acceleration_without_flow_is_constant_mass() {
        let (one, other) =
            (AnalyticGuess::constant_mass(1.2, 0.3), AnalyticGuess::mean_acceleration(1.2, 0.3, 1e-7));
        assert!((one.time - other.time).abs() < LITTLE_FLOW && other.time < one.time);
    }
}
