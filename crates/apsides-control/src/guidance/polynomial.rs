//! Explicit guidance to a position and a velocity by polynomials of time.
//!
//! The commanded acceleration is a polynomial of time that meets position `r_t` and velocity `v_t` of the target after the time to go `T`.
//! The thrust is what it takes beyond the acceleration of free motion `g`, so that gravity needs no model of the path:
//!
//! ```text
//! linear     a =  6 (r_t - r) / T^2 - (4 v + 2 v_t) / T
//! quadratic  a = 12 (r_t - r) / T^2 - 6 (v + v_t) / T + a_t
//! thrust = m (a - g)
//! ```
//!
//! The first is E-guidance (G. W. Cherry, A general, explicit, optimizing guidance law for rocket-propelled spaceflight, AIAA 64-638, 1964),
//! the second, which meets the acceleration `a_t` too, is that of the lunar module (A. R. Klumpp, Apollo lunar descent guidance,
//! Automatica 10, 1974, doi 10.1016/0005-1098(74)90019-3). The component along one direction has one condition more, which says what the
//! time to go is: with the linear law its acceleration at the end, with the quadratic one its jerk `j_t` there,
//!
//! ```text
//! linear     a_t T^2 - (2 v + 4 v_t) T + 6 (r_t - r) = 0
//! quadratic  j_t T^3 - 6 a_t T^2 + (6 v + 18 v_t) T - 24 (r_t - r) = 0
//! ```

use apsides_ad::vector;

use crate::ControlError;
use crate::error::{finite, positive};

/// Relative accuracy of the time to go.
const ACCURACY: f64 = 1e-14;
const MOST_ITERATIONS: usize = 100;

/// Where to be, in the axes of the states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Position, m.
    pub position: [f64; 3],
    /// Velocity, m/s.
    pub velocity: [f64; 3],
    /// Acceleration, m/s2; the linear law uses its component along [`PolynomialLaw::axis`] alone.
    pub acceleration: [f64; 3],
}

/// The commanded acceleration as a function of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// Linear in time: E-guidance.
    Linear,
    /// Quadratic in time: the law of Apollo.
    Quadratic {
        /// Jerk at the end along the axis, m/s3.
        jerk: f64,
    },
}

/// Least and largest thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustLimits {
    least: f64,
    most: f64,
}

impl ThrustLimits {
    /// From least to largest thrust, N.
    ///
    /// # Errors
    /// Values that are not in order, or not finite.
    pub fn new(least: f64, most: f64) -> Result<Self, ControlError> {
        if least >= 0.0 && least <= most && most.is_finite() {
            Ok(Self { least, most })
        } else {
            let allowed = "not negative and not above the largest thrust";
            Err(ControlError::Parameter { what: "least thrust", value: least, allowed })
        }
    }

    /// A thrust (N) along the same direction within the limits, and whether it is another.
    #[must_use]
    pub fn limit(&self, thrust: [f64; 3]) -> ([f64; 3], bool) {
        let size = vector::norm(&thrust, 0.0);
        let limited = size.clamp(self.least, self.most);
        // A thrust of no size has no direction to keep.
        if limited == size || size == 0.0 {
            return (thrust, limited != size);
        }
        (vector::scale(&thrust, limited / size), true)
    }
}

/// The law with its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolynomialLaw {
    /// The state to reach.
    pub target: Target,
    /// The acceleration over time.
    pub profile: Profile,
    /// Unit vector along which the time to go is found: where the way is long.
    pub axis: [f64; 3],
    /// Limits of the thrust of the engine.
    pub limits: ThrustLimits,
}

/// A thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrustCommand {
    /// Thrust in the axes of the states, N.
    pub thrust: [f64; 3],
    /// Time to go, s.
    pub time_to_go: f64,
    /// Says whether a limit of the thrust is in the way of the commanded one.
    pub saturated: bool,
}

impl PolynomialLaw {
    /// The command at a position (m), velocity (m/s) and mass (kg) with the acceleration `free` (m/s2) that the vehicle has without
    /// thrust; in rotating axes that is gravity with the apparent accelerations. `guess` is a time to go (s) to start from.
    ///
    /// # Errors
    /// Values that are not finite, and a time to go that does not come out.
    pub fn command(
        &self,
        position: &[f64; 3],
        velocity: &[f64; 3],
        mass: f64,
        free: &[f64; 3],
        guess: f64,
    ) -> Result<ThrustCommand, ControlError> {
        positive("the mass", mass)?;
        positive("the guessed time to go", guess)?;
        for value in position.iter().chain(velocity).chain(free) {
            finite("a component of position, velocity or free acceleration", *value)?;
        }
        let time_to_go = self.time_to_go(position, velocity, guess)?;
        let acceleration = self.acceleration(position, velocity, time_to_go);
        let wanted = vector::scale(&minus(&acceleration, free), mass);
        let (thrust, saturated) = self.limits.limit(wanted);
        Ok(ThrustCommand { thrust, time_to_go, saturated })
    }

    /// The commanded acceleration (m/s2) for a time to go (s).
    #[must_use]
    pub fn acceleration(&self, position: &[f64; 3], velocity: &[f64; 3], time_to_go: f64) -> [f64; 3] {
        let t = &self.target;
        std::array::from_fn(|k| {
            let (way, v, v_t) = (t.position[k] - position[k], velocity[k], t.velocity[k]);
            match self.profile {
                Profile::Linear => (6.0 * way / time_to_go - (4.0 * v + 2.0 * v_t)) / time_to_go,
                Profile::Quadratic { .. } => {
                    (12.0 * way / time_to_go - 6.0 * (v + v_t)) / time_to_go + t.acceleration[k]
                }
            }
        })
    }

    /// The time to go (s) by Newton's method from a guess.
    fn time_to_go(&self, position: &[f64; 3], velocity: &[f64; 3], guess: f64) -> Result<f64, ControlError> {
        let along = |v: &[f64; 3]| vector::dot(v, &self.axis);
        let way = along(&minus(&self.target.position, position));
        let (v, v_t) = (along(velocity), along(&self.target.velocity));
        let a_t = along(&self.target.acceleration);
        // Coefficients of the powers of the time, from the third down.
        let c = match self.profile {
            Profile::Linear => [0.0, a_t, -(2.0 * v + 4.0 * v_t), 6.0 * way],
            Profile::Quadratic { jerk } => [jerk, -6.0 * a_t, 6.0 * v + 18.0 * v_t, -24.0 * way],
        };
        let mut t = guess;
        for _ in 0..MOST_ITERATIONS {
            let value = ((c[0] * t + c[1]) * t + c[2]) * t + c[3];
            let slope = (3.0 * c[0] * t + 2.0 * c[1]) * t + c[2];
            let step = value / slope;
            if !step.is_finite() {
                break;
            }
            let last = t;
            // Not past zero: the time to go is positive.
            t = (t - step).max(0.5 * t);
            if (t - last).abs() <= ACCURACY * t {
                return Ok(t);
            }
        }
        Err(ControlError::NoTimeToGo { reason: "its equation has no root near the guess" })
    }
}

fn minus(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}
