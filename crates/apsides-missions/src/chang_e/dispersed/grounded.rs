//! Flights that end where they meet the ground.

use apsides_ad::vector;
use apsides_dynamics::cartesian::CartesianForce;
use apsides_ode::Integrator;

use crate::deviating_flight::{N, Pushed, fly, parts, settings};

/// Part of the way to the ground, at the present vertical speed and this much more (m/s), that is flown without looking at the ground, and the
/// shortest time, s.
const WATCHED: f64 = 0.5;
const FASTER_M_S: f64 = 5.0;
const SHORTEST_S: f64 = 0.1;
/// Halvings of the time in which the ground is met: of a second they leave a rounding.
const HALVINGS: usize = 50;
/// A fall that lasts longer is none, s.
const LONGEST_FALL_S: f64 = 3600.0;
/// Pieces of a fall, s.
const FALL_S: f64 = 10.0;

/// A flight above ground that is a sphere, in inertial axes.
pub(super) struct GroundedFlight {
    /// The present time, s, and state.
    pub(super) now: f64,
    pub(super) x: [f64; N],
    /// True once it has met the ground.
    pub(super) landed: bool,
    model: CartesianForce,
    /// Distance of the ground from the centre, m.
    ground: f64,
    integrator: Integrator,
}

impl GroundedFlight {
    pub(super) fn new(now: f64, x: [f64; N], model: CartesianForce, ground: f64) -> Option<Self> {
        let integrator = Integrator::new(N, settings()).ok()?;
        Some(Self { now, x, landed: false, model, ground, integrator })
    }

    /// Goes on from another time and state; below the ground it has landed.
    pub(super) fn go_on_from(&mut self, (now, x): (f64, [f64; N])) {
        (self.now, self.x) = (now, x);
        self.landed = self.altitude() <= 0.0;
    }

    fn altitude(&self) -> f64 {
        let (p, ..) = parts(&self.x);
        vector::norm(&p, 0.0) - self.ground
    }

    /// Flies a thrust (N) in inertial axes until a time, or to the ground; none where the motion cannot be integrated.
    pub(super) fn push(&mut self, force: impl Fn(f64) -> [f64; 3], until: f64) -> Option<()> {
        let system = Pushed { force, model: self.model };
        while self.now < until && !self.landed {
            let (p, v, _) = parts(&self.x);
            let climb = vector::dot(&p, &v) / vector::norm(&p, 0.0);
            let unwatched = WATCHED * self.altitude() / (climb.abs() + FASTER_M_S);
            let end = (self.now + unwatched.max(SHORTEST_S)).min(until);
            let before = (self.now, self.x);
            fly(&mut self.integrator, &system, &mut self.x, self.now, end)?;
            self.now = end;
            if self.altitude() <= 0.0 {
                self.meet_ground(&system, before)?;
            }
        }
        Some(())
    }

    /// Ends the flight where it meets the ground between an earlier time and now.
    fn meet_ground<F: Fn(f64) -> [f64; 3]>(
        &mut self,
        system: &Pushed<F>,
        (start, x): (f64, [f64; N]),
    ) -> Option<()> {
        let (mut above, mut below) = (start, self.now);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (above + below);
            if middle <= above || middle >= below {
                break;
            }
            (self.x, self.now) = (x, middle);
            fly(&mut self.integrator, system, &mut self.x, start, middle)?;
            if self.altitude() > 0.0 {
                above = middle;
            } else {
                below = middle;
            }
        }
        self.landed = true;
        Some(())
    }

    /// Falls to the ground without thrust; none where the fall does not end there.
    pub(super) fn fall(&mut self) -> Option<()> {
        let last = self.now + LONGEST_FALL_S;
        while !self.landed {
            let until = self.now + FALL_S;
            self.push(|_| [0.0; 3], until)?;
            if self.now > last {
                return None;
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use apsides_dynamics::Body;

    use super::*;
    use crate::deviating_flight::joined;

    /// Round-off of heights by distances from the centre, m, and of times, s.
    const ROUNDING: f64 = 1e-6;

    /// A fall from rest by Kepler's equation of the degenerate ellipse: `t = sqrt(a^3 / mu) (E - sin E)`-like closed form
    /// `sqrt(r0^3 / (2 mu)) (acos sqrt s + sqrt(s (1 - s)))` with `s = r / r0`, speed `sqrt(2 mu (1 / r - 1 / r0))`.
    #[test]
    fn a_fall_from_rest_meets_the_ground_in_time() {
        let (mu, ground): (f64, f64) = (4.9e12, 1.737e6);
        let body = Body::new(mu, ground).unwrap();
        let model = CartesianForce { body, exhaust_velocity: 3000.0 };
        for height in [4.0, 2400.0, 50e3] {
            let r0 = ground + height;
            let mut flight =
                GroundedFlight::new(10.0, joined([r0, 0.0, 0.0], [0.0; 3], 1e3), model, ground).unwrap();
            flight.fall().unwrap();
            let s = ground / r0;
            let time = (r0.powi(3) / (2.0 * mu)).sqrt() * (s.sqrt().acos() + (s * (1.0 - s)).sqrt());
            assert!((flight.now - 10.0 - time).abs() < ROUNDING * time.max(1.0), "{} {time}", flight.now);
            let speed = (2.0 * mu * (ground.recip() - r0.recip())).sqrt();
            assert!((flight.x[3] + speed).abs() < ROUNDING * speed.max(1.0), "{} {speed}", flight.x[3]);
            assert!(flight.landed && flight.altitude().abs() < ROUNDING);
            // What has landed stays.
            let rest = flight.x;
            flight.push(|_| [1e5, 0.0, 0.0], flight.now + 10.0).unwrap();
            assert_eq!(flight.x, rest);
        }
        // A flight that leaves the body for good does not end.
        let away = joined([ground + 10.0, 0.0, 0.0], [3000.0, 0.0, 0.0], 1e3);
        assert!(GroundedFlight::new(0.0, away, model, ground).unwrap().fall().is_none());
    }
}
