//! The landing that is asked for: vehicle, start, target, limits.

use crate::ConvexError;
use crate::error::require;

/// Limits along the flight; all are convex in the variables of the conic program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DescentLimits {
    /// Largest angle between thrust and the vertical, rad, from 0 to pi.
    pub pointing: Option<f64>,
    /// Least elevation of the lander as seen from the target, rad, from 0 to below pi/2: `z >= tan(e) |(x, y)|` from the target.
    /// Zero keeps it above the height of the target.
    pub glide_slope: Option<f64>,
    /// Largest speed, m/s.
    pub speed: Option<f64>,
    /// Largest rate of the thrust vector, N/s.
    pub thrust_rate: Option<f64>,
    /// True if the thrust at the end is vertical.
    pub upright_end: bool,
}

/// Minimum-propellant powered descent in a frame fixed to the landing site: `x`, `y` horizontal, `z` up.
///
/// ```text
/// r'' = g + T/m - 2 w x r' - w x (w x r),   m' = -|T|/c,   T1 <= |T| <= T2,   m(tf) >= dry mass
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DescentProblem {
    /// `g` at the origin, its centrifugal part included, m/s2.
    pub gravity: [f64; 3],
    /// `w`, rotation of the frame, rad/s.
    pub rotation: [f64; 3],
    /// Mass at the start, kg.
    pub mass: f64,
    /// Least mass, kg.
    pub dry_mass: f64,
    /// `c`, thrust per mass flow, m/s; of canted engines that of the axial thrust.
    pub exhaust_velocity: f64,
    /// `T1` and `T2`, N.
    pub thrust: [f64; 2],
    /// Position at the start, m.
    pub position: [f64; 3],
    /// Velocity at the start, m/s.
    pub velocity: [f64; 3],
    /// Position at the end, m.
    pub target: [f64; 3],
    /// Velocity at the end, m/s.
    pub target_velocity: [f64; 3],
    /// Limits along the flight.
    pub limits: DescentLimits,
}

impl DescentProblem {
    /// The landing on Mars of B. Acikmese and S. Ploen, J. Guid. Control Dyn. 30 (2007) 1353, doi 10.2514/1.27553: six engines of 3100 N,
    /// canted by 27 deg, between 0.3 and 0.8 of their thrust, without limits along the flight (case a; case c has a glide slope of
    /// 4 deg).
    #[must_use]
    pub fn mars_lander() -> Self {
        let cant = 27_f64.to_radians().cos();
        Self {
            gravity: [0.0, 0.0, -3.7114],
            rotation: [0.0; 3],
            mass: 1905.0,
            dry_mass: 1505.0,
            exhaust_velocity: 225.0 * 9.807 * cant,
            thrust: [0.3, 0.8].map(|throttle| throttle * 6.0 * 3100.0 * cant),
            position: [2000.0, 0.0, 1500.0],
            velocity: [100.0, 0.0, -75.0],
            target: [0.0; 3],
            target_velocity: [0.0; 3],
            limits: DescentLimits::default(),
        }
    }

    /// Propellant, kg.
    #[must_use]
    pub fn propellant(&self) -> f64 {
        self.mass - self.dry_mass
    }

    /// Flight times outside which no landing can be, s: the speed must be lost at the largest acceleration, and the propellant
    /// must last at the least thrust (at no thrust: ten times as long as at the largest).
    #[must_use]
    pub fn time_range(&self) -> [f64; 2] {
        let acceleration = self.thrust[1] / self.dry_mass + norm(&self.gravity);
        let change = norm(&difference(&self.target_velocity, &self.velocity));
        let distance = norm(&difference(&self.target, &self.position));
        let least = (change / acceleration).max((distance / acceleration).sqrt()).max(1e-3);
        let flow = self.thrust[0].max(0.1 * self.thrust[1]) / self.exhaust_velocity;
        [least, (self.propellant() / flow).max(1.001 * least)]
    }

    /// # Errors
    /// [`ConvexError`] naming the quantity: not finite, out of range, reversed bounds, a start outside its own limits.
    pub fn check(&self) -> Result<(), ConvexError> {
        for (what, unit, values) in [
            ("gravity", "m/s2", &self.gravity),
            ("rotation", "rad/s", &self.rotation),
            ("position", "m", &self.position),
            ("velocity", "m/s", &self.velocity),
            ("target", "m", &self.target),
            ("target velocity", "m/s", &self.target_velocity),
        ] {
            for v in values {
                require(v.is_finite(), what, *v, unit, "finite")?;
            }
        }
        let positive = |v: f64| v > 0.0 && v.is_finite();
        for (what, unit, value) in [
            ("mass", "kg", self.mass),
            ("dry mass", "kg", self.dry_mass),
            ("exhaust velocity", "m/s", self.exhaust_velocity),
            ("largest thrust", "N", self.thrust[1]),
        ] {
            require(positive(value), what, value, unit, "positive and finite")?;
        }
        require(self.thrust[0] >= 0.0, "least thrust", self.thrust[0], "N", "at least 0")?;
        for (what, unit, [lower, upper]) in
            [("thrust", "N", self.thrust), ("mass, dry to full", "kg", [self.dry_mass, self.mass])]
        {
            if lower >= upper {
                let (lower, upper) = (lower.to_string(), upper.to_string());
                return Err(ConvexError::Bounds { what, lower, upper, unit });
            }
        }
        self.check_limits()
    }

    fn check_limits(&self) -> Result<(), ConvexError> {
        use std::f64::consts::{FRAC_PI_2, PI};
        let l = &self.limits;
        if let Some(a) = l.pointing {
            require((0.0..=PI).contains(&a), "pointing limit", a, "rad", "from 0 to pi")?;
        }
        if let Some(v) = l.thrust_rate {
            require(v > 0.0 && v.is_finite(), "thrust rate limit", v, "N/s", "positive and finite")?;
        }
        if let Some(v) = l.speed {
            require(v > 0.0 && v.is_finite(), "speed limit", v, "m/s", "positive and finite")?;
            let speed = norm(&self.velocity);
            if speed > v {
                let (value, allowed) = (speed.to_string(), format!("at most {v}"));
                return Err(ConvexError::Start { limit: "speed", value, allowed, unit: "m/s" });
            }
        }
        if let Some(e) = l.glide_slope {
            require((0.0..FRAC_PI_2).contains(&e), "glide slope", e, "rad", "from 0 to below pi/2")?;
            let d = difference(&self.position, &self.target);
            let elevation = d[2].atan2(d[0].hypot(d[1]));
            if elevation < e {
                let (value, allowed) = (elevation.to_string(), format!("at least {e}"));
                return Err(ConvexError::Start { limit: "glide slope", value, allowed, unit: "rad" });
            }
        }
        Ok(())
    }
}

pub(crate) fn norm(v: &[f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

pub(crate) fn difference(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}
