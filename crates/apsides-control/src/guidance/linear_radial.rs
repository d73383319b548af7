//! Full thrust whose angle makes the radial acceleration linear in time.
//!
//! Over the time to go `T` the radial motion is the cubic that ends at the target's radius `r_f` with its radial speed `w_f`:
//!
//! ```text
//! r''(t) = a + b t,  a = 6 (r_f - r) / T^2 - (4 w + 2 w_f) / T,  b = -12 (r_f - r) / T^3 + 6 (w + w_f) / T^2
//! ```
//!
//! The radial component of the thrust adds what gravity and the curvature of the path take (feed-forward), its horizontal component is what
//! is left of the full thrust and brakes:
//!
//! ```text
//! (F / m) sin(pitch) = a + mu / r^2 - u^2 / r,   u' = -(F / m) cos(pitch) - w u / r
//! ```
//!
//! The time to go is the one at which this `u` reaches the target's horizontal speed; it is found by integration of the second equation
//! along the cubic. Near the end a small miss of the altitude asks for a large acceleration: the last two seconds or so are to be flown with
//! the command before them. Altitude and velocity are met; the range is what comes out.
//!
//! The law of the angle is that of the Chinese contest in mathematical modelling (CUMCM) 2014, problem A, in a published solution's section
//! 5.3.5; radial accelerations linear in time go back to G. W. Cherry, A general, explicit, optimizing guidance law for rocket-propelled
//! spaceflight, AIAA 64-638, 1964.

use apsides_dynamics::Engine;

use crate::ControlError;
use crate::error::{finite, positive};

/// Runge-Kutta steps over the time to go: that of a braking from orbit is right to 1e-8 s.
const STEPS: usize = 64;
/// Relative accuracy of the time to go.
const ACCURACY: f64 = 1e-12;
const MOST_ITERATIONS: usize = 60;
/// The longest time to go, as a part of the time that burns the whole mass.
const LONGEST: f64 = 0.999;
/// The shortest time to go that a search starts from, s.
const SHORTEST: f64 = 1e-3;

/// A state in the vertical plane of its velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DescentState {
    /// Distance from the centre, m.
    pub radius: f64,
    /// Upward speed, m/s.
    pub radial_speed: f64,
    /// Horizontal speed, m/s.
    pub horizontal_speed: f64,
    /// Mass, kg.
    pub mass: f64,
}

/// The law with its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearRadialLaw {
    /// Gravitational parameter of the body, m3/s2.
    pub gravitational_parameter: f64,
    /// The engine, always at full thrust.
    pub engine: Engine,
    /// Distance from the centre at the end, m.
    pub radius: f64,
    /// Upward speed at the end, m/s.
    pub radial_speed: f64,
    /// Horizontal speed at the end, m/s.
    pub horizontal_speed: f64,
}

/// A thrust angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleCommand {
    /// Angle of the thrust above the horizontal against the velocity, rad.
    pub pitch: f64,
    /// Time to go, s.
    pub time_to_go: f64,
    /// Says whether the radial acceleration asks for more than the full thrust, so that it points along the radius.
    pub saturated: bool,
}

impl LinearRadialLaw {
    /// The command at a state; `guess` is a time to go (s) to start from, if there is one.
    ///
    /// # Errors
    /// States that are not finite, an engine without thrust or exhaust velocity, horizontal speeds that are at or below the target's, and
    /// targets that the propellant does not reach.
    pub fn command(&self, state: &DescentState, guess: Option<f64>) -> Result<AngleCommand, ControlError> {
        positive("the radius", state.radius)?;
        positive("the mass", state.mass)?;
        positive("the thrust", self.engine.thrust)?;
        positive("the exhaust velocity", self.engine.exhaust_velocity)?;
        finite("the radial speed", state.radial_speed)?;
        finite("the horizontal speed", state.horizontal_speed)?;
        let time_to_go = self.time_to_go(state, guess)?;
        let (a, _) = self.radial_profile(state, time_to_go);
        let needed = self.radial_thrust(a, state.radius, state.horizontal_speed);
        let sine = needed * state.mass / self.engine.thrust;
        let pitch = sine.clamp(-1.0, 1.0).asin();
        Ok(AngleCommand { pitch, time_to_go, saturated: sine.abs() > 1.0 })
    }

    /// Radial acceleration now, and its slope.
    fn radial_profile(&self, s: &DescentState, t: f64) -> (f64, f64) {
        let (way, w, w_f) = (self.radius - s.radius, s.radial_speed, self.radial_speed);
        let start = 6.0 * way / (t * t) - (4.0 * w + 2.0 * w_f) / t;
        (start, -12.0 * way / (t * t * t) + 6.0 * (w + w_f) / (t * t))
    }

    /// Acceleration by the thrust along the radius for a radial acceleration.
    fn radial_thrust(&self, acceleration: f64, radius: f64, horizontal_speed: f64) -> f64 {
        acceleration + self.gravitational_parameter / (radius * radius)
            - horizontal_speed * horizontal_speed / radius
    }

    /// Horizontal speed at the end of a time to go, above that of the target.
    fn excess(&self, s: &DescentState, time_to_go: f64) -> f64 {
        let (a, b) = self.radial_profile(s, time_to_go);
        let flow = self.engine.mass_flow();
        let slope = |t: f64, u: f64| {
            let radius = s.radius + t * (s.radial_speed + t * (0.5 * a + t * b / 6.0));
            let upward = s.radial_speed + t * (a + 0.5 * t * b);
            let thrust = self.engine.thrust / (s.mass - flow * t);
            let radial = self.radial_thrust(a + b * t, radius, u);
            -(thrust * thrust - radial * radial).max(0.0).sqrt() - upward * u / radius
        };
        let (mut u, h) = (s.horizontal_speed, time_to_go / STEPS as f64);
        for k in 0..STEPS {
            let t = k as f64 * h;
            let k1 = slope(t, u);
            let k2 = slope(t + 0.5 * h, u + 0.5 * h * k1);
            let k3 = slope(t + 0.5 * h, u + 0.5 * h * k2);
            let k4 = slope(t + h, u + h * k3);
            u += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        }
        u - self.horizontal_speed
    }

    fn time_to_go(&self, s: &DescentState, guess: Option<f64>) -> Result<f64, ControlError> {
        let none = |reason| Err(ControlError::NoTimeToGo { reason });
        if s.horizontal_speed <= self.horizontal_speed {
            return none("the horizontal speed is not above that of the target");
        }
        let longest = LONGEST * s.mass / self.engine.mass_flow();
        let change = s.horizontal_speed - self.horizontal_speed;
        let burnt = s.mass - self.engine.mass_after(s.mass, change);
        // All of the thrust against the horizontal speed: no time is shorter.
        let shortest = burnt / self.engine.mass_flow();
        let start = guess.filter(|t| t.is_finite()).unwrap_or(1.02 * shortest);
        // A bracket around the start, widened until the excess changes its sign.
        let (mut low, mut high) = (start, start);
        let mut above = self.excess(s, start.max(SHORTEST).min(longest));
        let mut below;
        let mut step = 1e-3 * start.abs() + 1e-3;
        if above > 0.0 {
            loop {
                if high >= longest {
                    return none("the propellant is used up before");
                }
                high = (high + step).min(longest);
                below = self.excess(s, high);
                if below <= 0.0 {
                    break;
                }
                (low, above, step) = (high, below, 2.0 * step);
            }
        } else {
            below = above;
            loop {
                if low <= 0.5 * shortest.min(start) {
                    return none("braking along the cubic takes more than the full thrust");
                }
                low = (low - step).max(0.5 * shortest.min(start));
                above = self.excess(s, low);
                if above > 0.0 {
                    break;
                }
                (high, below, step) = (low, above, 2.0 * step);
            }
        }
        // Regula falsi with halved ordinates (Illinois).
        let mut side = 0;
        for _ in 0..MOST_ITERATIONS {
            let t = (low * below - high * above) / (below - above);
            let f = self.excess(s, t);
            if f == 0.0 || high - low <= ACCURACY * t {
                return Ok(t);
            }
            let last = if f > 0.0 { low } else { high };
            if f > 0.0 {
                (low, above) = (t, f);
                below *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                (high, below) = (t, f);
                above *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            }
            if (t - last).abs() <= ACCURACY * t {
                return Ok(t);
            }
        }
        Ok(0.5 * (low + high))
    }
}
