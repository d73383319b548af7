//! The transfer by impulses: the limit of the propellant, the orbits of a guess, and the cost to go whose gradient is a guess of
//! the costates.
//!
//! All impulses are horizontal and at the ends of the line of nodes: the first, at perigee, raises the apogee and turns a part of the
//! inclination, the second, at apogee, turns the rest and raises the perigee; above the target a third one lowers the apogee. What
//! each turns is chosen for the least sum (Vallado 2013, section 6.5.3).

use apsides_ad::{Dual, Scalar};

use super::injection::{Apsis, Injection};

/// A horizontal velocity: along the equator, and across it in the direction of the motion, m/s.
type Horizontal<S> = [S; 2];

/// One impulse at an apsis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impulse {
    pub(super) apsis: Apsis,
    /// Distance from the centre, m.
    pub(super) radius: f64,
    pub(super) before: Horizontal<f64>,
    pub(super) after: Horizontal<f64>,
}

/// The impulses of a transfer.
#[derive(Clone, Debug)]
pub(super) struct Impulses {
    mu: f64,
    exhaust_velocity: f64,
    pub(super) all: Vec<Impulse>,
}

/// An orbit whose apses are on the first axis, perigee towards true longitude zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct ApsidalOrbit {
    /// Semi-latus rectum, m.
    pub(super) p: f64,
    /// Eccentricity, with the sign of the perigee's side.
    pub(super) f: f64,
    /// Tangent of half the inclination.
    pub(super) h: f64,
}

/// Steps of the golden section: more than the digits of a number.
const SEARCH_STEPS: usize = 80;
/// Part of an impulse after which its cost has no kink yet.
const BEFORE_THE_KINK: f64 = 0.999;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Impulses {
    pub(super) fn of(injection: &Injection) -> Self {
        let (mu, parking) = (injection.mu(), injection.parking_radius);
        let [target_perigee, target_apogee] = injection.target_apses();
        let top = injection.transfer_apogee();
        let inclination = injection.inclination;
        let speed = |radius: f64, other: f64| apsis_speed(mu, radius, other);
        let parking_velocity = horizontal(speed(parking, parking), inclination);
        let sequence = |first: f64, second: f64| {
            let mut all = vec![
                Impulse {
                    apsis: Apsis::Perigee,
                    radius: parking,
                    before: parking_velocity,
                    after: horizontal(speed(parking, top), first),
                },
                Impulse {
                    apsis: Apsis::Apogee,
                    radius: top,
                    before: horizontal(speed(top, parking), first),
                    after: horizontal(speed(top, target_perigee), second),
                },
            ];
            if injection.is_supersynchronous() {
                all.push(Impulse {
                    apsis: Apsis::Perigee,
                    radius: target_perigee,
                    before: horizontal(speed(target_perigee, top), second),
                    after: horizontal(speed(target_perigee, target_apogee), 0.0),
                });
            }
            Self { mu, exhaust_velocity: injection.engine().exhaust_velocity, all }
        };
        if !injection.is_spatial() {
            return sequence(0.0, 0.0);
        }
        let second = |first: f64| {
            if injection.is_supersynchronous() {
                least(inclination, |second| sequence(first, second).velocity_change())
            } else {
                0.0
            }
        };
        let first = least(inclination, |first| sequence(first, second(first)).velocity_change());
        sequence(first, second(first))
    }

    /// Sum of all impulses, m/s.
    pub(super) fn velocity_change(&self) -> f64 {
        self.all.iter().map(Impulse::size).sum()
    }

    /// Gradient of the cost to go, minus the final mass, with respect to `[p, f, h, m]` on an orbit from which the rest of the first
    /// impulse and all later ones are to come.
    ///
    /// How the inclination is divided is optimal, so that it may be held: the envelope theorem. With nothing left of the first
    /// impulse the cost has a kink; the gradient is that of a little before.
    pub(super) fn costates(&self, fraction: f64, mass: f64) -> [f64; 4] {
        let orbit = self.all[0].orbit(self.mu, fraction.min(BEFORE_THE_KINK));
        let v = |value, lane| Dual::<4>::variable(value, lane);
        self.cost_to_go([v(orbit.p, 0), v(orbit.f, 1), v(orbit.h, 2), v(mass, 3)]).eps
    }

    fn cost_to_go<S: Scalar>(&self, [p, f, h, mass]: [S; 4]) -> S {
        let first = &self.all[0];
        let q = f + 1.0;
        let radius = p / q;
        let before = horizontal((p.recip() * self.mu).sqrt() * q, h.atan() * 2.0);
        let (apogee, inclination) = first.other_end(self.mu);
        let (apogee, inclination) = (S::from(apogee), S::from(inclination));
        let after = horizontal(apsis_speed(self.mu, radius, apogee), inclination);
        let mut sum = distance(before, after);
        if let Some(second) = self.all.get(1) {
            let arrival = horizontal(apsis_speed(self.mu, apogee, radius), inclination);
            sum += distance(arrival, second.after.map(S::from));
        }
        for later in self.all.iter().skip(2) {
            sum += S::from(later.size());
        }
        -(mass * (-(sum / self.exhaust_velocity)).exp())
    }
}

impl Impulse {
    /// Its size, m/s.
    pub(super) fn size(&self) -> f64 {
        distance(self.before, self.after)
    }

    /// The velocity after a part of the impulse.
    fn part(&self, fraction: f64) -> Horizontal<f64> {
        [0, 1].map(|i| self.before[i] + fraction * (self.after[i] - self.before[i]))
    }

    /// The orbit after a part of the impulse.
    pub(super) fn orbit(&self, mu: f64, fraction: f64) -> ApsidalOrbit {
        let [along, across] = self.part(fraction);
        let speed2 = along * along + across * across;
        let p = self.radius * self.radius * speed2 / mu;
        let f = self.apsis.side() * (p / self.radius - 1.0);
        ApsidalOrbit { p, f, h: (0.5 * across.atan2(along)).tan() }
    }

    /// Speed after a part of the impulse, m/s.
    pub(super) fn speed(&self, fraction: f64) -> f64 {
        let [along, across] = self.part(fraction);
        along.hypot(across)
    }

    /// Latitude of the impulse's direction, rad, and the angles of the thrust along it when a part of it is done: in the orbital plane
    /// from the direction of motion, and out of it.
    pub(super) fn angles(&self, fraction: f64) -> (f64, [f64; 2]) {
        let change = [self.after[0] - self.before[0], self.after[1] - self.before[1]];
        let [along, across] = self.part(fraction);
        let speed = along.hypot(across);
        let forward = (change[0] * along + change[1] * across) / speed;
        let normal = (change[1] * along - change[0] * across) / speed;
        let in_plane = if forward < 0.0 { std::f64::consts::PI } else { 0.0 };
        let side = self.apsis.side();
        let latitude = (side * change[1]).atan2(change[0].abs());
        (latitude, [in_plane, (side * normal).atan2(forward.abs())])
    }

    /// Radius of the other apsis and inclination of the orbit after the impulse.
    fn other_end(&self, mu: f64) -> (f64, f64) {
        let [along, across] = self.after;
        let s = self.radius * (along * along + across * across) / (2.0 * mu);
        (self.radius * s / (1.0 - s), across.atan2(along))
    }
}

impl Apsis {
    /// Cosine of its true longitude.
    pub(super) fn side(self) -> f64 {
        match self {
            Self::Perigee => 1.0,
            Self::Apogee => -1.0,
        }
    }
}

/// Speed at one apsis of an orbit, m/s.
fn apsis_speed<S: Scalar>(mu: f64, radius: S, other: S) -> S {
    (other * (2.0 * mu) / (radius * (radius + other))).sqrt()
}

fn horizontal<S: Scalar>(speed: S, inclination: S) -> Horizontal<S> {
    let (sin, cos) = inclination.sin_cos();
    [speed * cos, speed * sin]
}

fn distance<S: Scalar>(a: Horizontal<S>, b: Horizontal<S>) -> S {
    apsides_ad::vector::norm(&[b[0] - a[0], b[1] - a[1]], 0.0)
}

/// Where a function of one variable with one minimum between zero and `end` has it (golden section).
fn least(end: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (0.0, end);
    for _ in 0..SEARCH_STEPS {
        let (left, right) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
        if function(left) < function(right) {
            b = right;
        } else {
            a = left;
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mission;

    fn injection(overrides: &[&str]) -> Injection {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).into()).collect();
        Injection::of(&Mission::load("geo-3-burn", &overrides).expect("a mission").values).expect("values")
    }

    /// Sums of the impulses by an independent program, m/s, printed to 1e-9: see `missions/README.md`.
    #[test]
    fn impulses_have_their_least_sum() {
        let cases: [(&[&str], f64); 4] = [
            (&[], 3931.8570092948544),
            (&["inclination_deg=28.5"], 4267.011352164652),
            (&["inclination_deg=51.6"], 4845.704822326793),
            (&["inclination_deg=51.6", "burns=4", "pattern=PPAP", "apogee_cap_km=80000"], 4695.191160750792),
        ];
        for (overrides, expected) in cases {
            let found = Impulses::of(&injection(overrides)).velocity_change();
            assert!((found - expected).abs() < 1e-7, "{overrides:?}: {found}");
        }
    }

    /// The cost to go falls with the impulse; its gradient is that of a difference.
    #[test]
    fn gradient_of_the_cost_to_go() {
        let injection =
            injection(&["inclination_deg=51.6", "burns=4", "pattern=PPAP", "apogee_cap_km=80000"]);
        let impulses = Impulses::of(&injection);
        for fraction in [0.0, 0.5, 1.0] {
            let at = impulses.all[0].orbit(impulses.mu, fraction.min(BEFORE_THE_KINK));
            let z = [at.p, at.f, at.h, 1000.0];
            let left = impulses.velocity_change() - fraction.min(BEFORE_THE_KINK) * impulses.all[0].size();
            let mass = -1000.0 * (-left / impulses.exhaust_velocity).exp();
            assert!((impulses.cost_to_go(z) - mass).abs() < 1e-9);
            let gradient = impulses.costates(fraction, 1000.0);
            for i in 0..4 {
                let step = 1e-6 * z[i].abs().max(1.0);
                let side = |s: f64| {
                    let mut z = z;
                    z[i] += s * step;
                    impulses.cost_to_go(z)
                };
                let difference = (side(1.0) - side(-1.0)) / (2.0 * step);
                assert!(
                    (gradient[i] - difference).abs() < 1e-6 * difference.abs().max(1e-3),
                    "{fraction} {i}"
                );
            }
        }
    }
}
