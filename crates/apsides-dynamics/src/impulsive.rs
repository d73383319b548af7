//! Impulsive transfers from an inclined orbit, circular or with its apses on the line of nodes, into an orbit of the reference plane.
//!
//! All impulses are horizontal and at the ends of the line of nodes. The first, at the periapsis, raises the apoapsis and turns a part of
//! the inclination; the second, at the apoapsis, turns the rest and raises the periapsis; where the transfer passes above the target, a
//! third one lowers the apoapsis (a supersynchronous transfer). A transfer from an elliptic orbit may begin at its apoapsis: the first impulse raises
//! the periapsis, the second, at the periapsis, makes the apoapsis that of the target. The inclination is divided among them for the least sum
//!
//! ```text
//! |dv_1| + |dv_2| (+ |dv_3|),    v(r, r') = sqrt(2 mu r' / (r (r + r')))
//! ```
//!
//! with the speed `v` at an apsis of radius `r` whose other apsis is at `r'` (D. A. Vallado, *Fundamentals of Astrodynamics and
//! Applications*, 4th ed., 2013, section 6.5.3, for two impulses).
//!
//! ```
//! use apsides_dynamics::Body;
//! use apsides_dynamics::impulsive::{Apsis, ImpulsiveTransfer, TransferOrbits};
//!
//! let orbits = TransferOrbits {
//!     parking_apses: [6578.137e3; 2],
//!     first: Apsis::Periapsis,
//!     inclination: 28.5_f64.to_radians(),
//!     target_apses: [42_164e3; 2],
//!     transfer_apoapsis: None,
//! };
//! let earth = Body::new(3.986_004_418e14, 6378.137e3)?;
//! let transfer = ImpulsiveTransfer::least(&earth, &orbits)?;
//! assert!((transfer.velocity_change() - 4267.011).abs() < 1e-3);
//! # Ok::<(), apsides_dynamics::DynamicsError>(())
//! ```

use std::f64::consts::PI;

use apsides_ad::{Dual, Scalar};
use apsides_basis::golden_section;

use crate::error::positive;
use crate::{Body, DynamicsError};

/// An end of the major axis of an orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Apsis {
    /// The end next to the centre of the body.
    Periapsis,
    /// The end away from it.
    Apoapsis,
}

impl Apsis {
    /// Cosine of the true anomaly there: 1 or -1.
    #[must_use]
    pub const fn side(self) -> f64 {
        match self {
            Self::Periapsis => 1.0,
            Self::Apoapsis => -1.0,
        }
    }
}

/// The orbits that a transfer joins; radii from the centre of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferOrbits {
    /// Periapsis and apoapsis radius of the parking orbit, m; the periapsis is towards true longitude zero, on the line of nodes.
    pub parking_apses: [f64; 2],
    /// The apsis of the first impulse.
    pub first: Apsis,
    /// Inclination of the parking orbit to the plane of the target, rad, from 0 to pi.
    pub inclination: f64,
    /// Periapsis and apoapsis radius of the target orbit, m.
    pub target_apses: [f64; 2],
    /// Apoapsis radius, m, of a transfer that passes above the target; none where it ends at the target's own apoapsis. A transfer whose first
    /// impulse is at the apoapsis has that of the parking orbit.
    pub transfer_apoapsis: Option<f64>,
}

/// A horizontal velocity at an end of the line of nodes: along the reference plane, and across it in the direction of the motion, m/s.
type Horizontal<S> = [S; 2];

/// One impulse at an apsis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// The apsis where it is given.
    pub apsis: Apsis,
    /// Distance from the centre, m.
    pub radius: f64,
    /// Velocity before it, along the reference plane and across it, m/s.
    pub before: [f64; 2],
    /// Velocity after it, along the reference plane and across it, m/s.
    pub after: [f64; 2],
}

/// An orbit whose apses are on the line of nodes, the first apsis of the transfer towards true longitude zero; in modified equinoctial
/// elements, of which `g` and `k` are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApsidalOrbit {
    /// Semi-latus rectum, m.
    pub p: f64,
    /// Eccentricity, negative where the periapsis is towards true longitude pi.
    pub f: f64,
    /// Tangent of half the inclination.
    pub h: f64,
}

/// The impulses of a transfer, in the order of the flight.
#[derive(Clone, Debug, PartialEq)]
pub struct ImpulsiveTransfer {
    /// Gravitational parameter of the body, m3/s2.
    pub gravitational_parameter: f64,
    /// The impulses.
    pub impulses: Vec<Impulse>,
}

/// Evaluations of the golden section: more than the digits of a number.
const SEARCH_EVALUATIONS: usize = 82;
/// Part of an impulse after which its cost has no kink yet.
const BEFORE_THE_KINK: f64 = 0.999;
/// Size of an impulse that is rounding, m/s.
const NOTHING: f64 = 1e-6;

impl ImpulsiveTransfer {
    /// The transfer whose impulses have the least sum.
    ///
    /// # Errors
    /// When a radius is not positive and finite, or the inclination is not in 0 to pi.
    pub fn least(body: &Body, orbits: &TransferOrbits) -> Result<Self, DynamicsError> {
        let parking = positive("periapsis radius of the parking orbit", orbits.parking_apses[0], "m")?;
        let parking_apoapsis =
            positive("apoapsis radius of the parking orbit", orbits.parking_apses[1], "m")?;
        let target_periapsis = positive("periapsis radius of the target", orbits.target_apses[0], "m")?;
        let target_apoapsis = positive("apoapsis radius of the target", orbits.target_apses[1], "m")?;
        let top = match orbits.transfer_apoapsis {
            Some(radius) => positive("apoapsis radius of the transfer", radius, "m")?,
            None => target_apoapsis,
        };
        let inclination = orbits.inclination;
        if !(0.0..=PI).contains(&inclination) {
            return Err(DynamicsError::Parameter {
                what: "inclination",
                value: inclination,
                unit: "rad",
                allowed: "0 to pi",
            });
        }
        let mu = body.gravitational_parameter;
        let passes_above = orbits.transfer_apoapsis.is_some();
        let speed = |radius: f64, other: f64| apsis_speed(mu, radius, other);
        let parking_velocity = horizontal(speed(parking, parking_apoapsis), inclination);
        let sequence = |first: f64, second: f64| {
            let mut impulses = vec![
                Impulse {
                    apsis: Apsis::Periapsis,
                    radius: parking,
                    before: parking_velocity,
                    after: horizontal(speed(parking, top), first),
                },
                Impulse {
                    apsis: Apsis::Apoapsis,
                    radius: top,
                    before: horizontal(speed(top, parking), first),
                    after: horizontal(speed(top, target_periapsis), second),
                },
            ];
            if passes_above {
                impulses.push(Impulse {
                    apsis: Apsis::Periapsis,
                    radius: target_periapsis,
                    before: horizontal(speed(target_periapsis, top), second),
                    after: horizontal(speed(target_periapsis, target_apoapsis), 0.0),
                });
            }
            Self { gravitational_parameter: mu, impulses }
        };
        if orbits.first == Apsis::Apoapsis {
            let sequence = |left: f64| Self {
                gravitational_parameter: mu,
                impulses: vec![
                    Impulse {
                        apsis: Apsis::Apoapsis,
                        radius: parking_apoapsis,
                        before: horizontal(speed(parking_apoapsis, parking), inclination),
                        after: horizontal(speed(parking_apoapsis, target_periapsis), left),
                    },
                    Impulse {
                        apsis: Apsis::Periapsis,
                        radius: target_periapsis,
                        before: horizontal(speed(target_periapsis, parking_apoapsis), left),
                        after: horizontal(speed(target_periapsis, target_apoapsis), 0.0),
                    },
                ],
            };
            let left = if inclination == 0.0 {
                0.0
            } else {
                least(inclination, |left| sequence(left).velocity_change())
            };
            return Ok(sequence(left));
        }
        if inclination == 0.0 {
            return Ok(sequence(0.0, 0.0));
        }
        let second = |first: f64| {
            if passes_above {
                least(inclination, |second| sequence(first, second).velocity_change())
            } else {
                0.0
            }
        };
        let first = least(inclination, |first| sequence(first, second(first)).velocity_change());
        Ok(sequence(first, second(first)))
    }

    /// Sum of all impulses, m/s.
    #[must_use]
    pub fn velocity_change(&self) -> f64 {
        self.impulses.iter().map(Impulse::size).sum()
    }

    /// Gradient of minus the final mass (kg) with respect to `[p, f, h, m]` of [`ApsidalOrbit`] and the mass (kg), when a fraction of the
    /// first impulse is done and the rest of it and all later ones are to come, at an exhaust velocity (m/s). Without impulses it is that of
    /// the mass alone.
    ///
    /// This is the limit of the costates of a flight in which many short burns make the impulses. How the inclination is divided is
    /// optimal, so that it may be held: the envelope theorem. With nothing left of the first impulse the cost has a kink; the gradient is
    /// that of a little before.
    #[must_use]
    pub fn costates(&self, fraction: f64, mass: f64, exhaust_velocity: f64) -> [f64; 4] {
        let Some(first) = self.impulses.first() else { return [0.0, 0.0, 0.0, -1.0] };
        let orbit = first.orbit(self.gravitational_parameter, fraction.min(BEFORE_THE_KINK));
        let v = |value, lane| Dual::<4>::variable(value, lane);
        self.cost_to_go([v(orbit.p, 0), v(orbit.f, 1), v(orbit.h, 2), v(mass, 3)], exhaust_velocity).eps
    }

    fn cost_to_go<S: Scalar>(&self, [p, f, h, mass]: [S; 4], exhaust_velocity: f64) -> S {
        let mu = self.gravitational_parameter;
        let Some(first) = self.impulses.first() else { return -mass };
        let side = first.apsis.side();
        let q = f * side + 1.0;
        let radius = p / q;
        let before = horizontal((p.recip() * mu).sqrt() * q, h.atan() * 2.0);
        let (apogee, inclination) = first.other_end(mu);
        let (apogee, inclination) = (S::from(apogee), S::from(inclination));
        let after = horizontal(apsis_speed(mu, radius, apogee), inclination);
        let mut sum = distance(before, after);
        // An impulse that is nothing has a kink in its size, and stays nothing.
        if let Some(second) = self.impulses.get(1).filter(|second| second.size() > NOTHING) {
            let arrival = horizontal(apsis_speed(mu, apogee, radius), inclination);
            sum += distance(arrival, second.after.map(S::from));
        }
        for later in self.impulses.iter().skip(2) {
            sum += S::from(later.size());
        }
        -(mass * (-(sum / exhaust_velocity)).exp())
    }
}

impl Impulse {
    /// Its size, m/s.
    #[must_use]
    pub fn size(&self) -> f64 {
        distance(self.before, self.after)
    }

    /// The velocity after a part of the impulse.
    fn part(&self, fraction: f64) -> Horizontal<f64> {
        [0, 1].map(|i| self.before[i] + fraction * (self.after[i] - self.before[i]))
    }

    /// The orbit after a fraction of the impulse, with the gravitational parameter `mu` (m3/s2).
    #[must_use]
    pub fn orbit(&self, mu: f64, fraction: f64) -> ApsidalOrbit {
        let [along, across] = self.part(fraction);
        let speed2 = along * along + across * across;
        let p = self.radius * self.radius * speed2 / mu;
        let f = self.apsis.side() * (p / self.radius - 1.0);
        ApsidalOrbit { p, f, h: (0.5 * across.atan2(along)).tan() }
    }

    /// Speed after a fraction of the impulse, m/s.
    #[must_use]
    pub fn speed(&self, fraction: f64) -> f64 {
        let [along, across] = self.part(fraction);
        along.hypot(across)
    }

    /// Latitude of the impulse's direction, rad, and the angles of a thrust along it when a fraction of it is done, rad: in the orbital
    /// plane from the direction of motion (0 or pi), and out of it.
    #[must_use]
    pub fn angles(&self, fraction: f64) -> (f64, [f64; 2]) {
        let change = [self.after[0] - self.before[0], self.after[1] - self.before[1]];
        let [along, across] = self.part(fraction);
        let speed = along.hypot(across);
        let forward = (change[0] * along + change[1] * across) / speed;
        let normal = (change[1] * along - change[0] * across) / speed;
        let in_plane = if forward < 0.0 { PI } else { 0.0 };
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

/// The minimiser, between zero and `end`, of a function with one minimum there.
fn least(end: f64, function: impl Fn(f64) -> f64) -> f64 {
    let [at, _] = golden_section([0.0, end], SEARCH_EVALUATIONS, function);
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Hohmann;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-6;

    /// Thrust 20 kN by a mass flow of 6.14 kg/s, m/s.
    const EXHAUST_VELOCITY: f64 = 20_000.0 / 6.14;
    /// Identities in floating-point arithmetic, relative.
    const ROUNDING: f64 = 1e-13;

    /// Solver: least sums of impulses by two minimisations, m/s.
    const SOLVER_M_S: f64 = 1e-7;

    fn earth() -> Body {
        Body::new(398_600.441_8e9, 6378.137e3).unwrap()
    }

    fn to_geostationary(inclination_deg: f64, transfer_apoapsis: Option<f64>) -> TransferOrbits {
        TransferOrbits {
            parking_apses: [6578.137e3; 2],
            first: Apsis::Periapsis,
            inclination: inclination_deg.to_radians(),
            target_apses: [42_164e3; 2],
            transfer_apoapsis,
        }
    }

    /// Sums of the impulses by an independent program, m/s, printed to 1e-9.
    #[test]
    fn impulses_have_their_least_sum() {
        let cases = [
            (0.0, None, 3931.8570092948544),
            (28.5, None, 4267.011364993429),
            (51.6, Some(80_000e3), 4695.191160750792),
        ];
        for (inclination, top, expected) in cases {
            let transfer = ImpulsiveTransfer::least(&earth(), &to_geostationary(inclination, top)).unwrap();
            let found = transfer.velocity_change();
            assert!((found - expected).abs() < SOLVER_M_S, "{inclination}: {found}");
        }
    }

    /// Between circles of one plane it is the Hohmann transfer, and the orbits of its parts end at the target.
    #[test]
    fn in_one_plane_it_is_the_hohmann_transfer() {
        let transfer = ImpulsiveTransfer::least(&earth(), &to_geostationary(0.0, None)).unwrap();
        let hohmann = Hohmann::new(&earth(), 6578.137e3, 42_164e3).unwrap();
        let expected = hohmann.departure_impulse + hohmann.arrival_impulse;
        assert!((transfer.velocity_change() / expected - 1.0).abs() < ROUNDING);
        let last = transfer.impulses[1].orbit(transfer.gravitational_parameter, 1.0);
        assert!((last.p / 42_164e3 - 1.0).abs() < ROUNDING && last.f.abs() < ROUNDING && last.h == 0.0);
    }

    /// The cost to go falls with the impulse; its gradient is that of a difference.
    #[test]
    fn gradient_of_the_cost_to_go() {
        let transfer = ImpulsiveTransfer::least(&earth(), &to_geostationary(51.6, Some(80_000e3))).unwrap();
        let first = transfer.impulses[0];
        for fraction in [0.0, 0.3, 0.6] {
            let at = first.orbit(transfer.gravitational_parameter, fraction);
            let z = [at.p, at.f, at.h, 1000.0];
            let left = transfer.velocity_change() - fraction * first.size();
            let mass = -1000.0 * (-left / EXHAUST_VELOCITY).exp();
            assert!((transfer.cost_to_go(z, EXHAUST_VELOCITY) - mass).abs() < 1e4 * ROUNDING);
            let gradient = transfer.costates(fraction, 1000.0, EXHAUST_VELOCITY);
            for i in 0..4 {
                let step = 1e-6 * z[i].abs().max(1.0);
                let side = |s: f64| {
                    let mut z = z;
                    z[i] += s * step;
                    transfer.cost_to_go(z, EXHAUST_VELOCITY)
                };
                let difference = (side(1.0) - side(-1.0)) / (2.0 * step);
                assert!(
                    (gradient[i] - difference).abs() < DIFFERENCES * difference.abs().max(1e-3),
                    "{fraction} {i}"
                );
            }
        }
    }

    /// From the usual transfer orbit: the vis-viva equation at the apoapsis, in one plane, and with a turn of 7 deg by the law of cosines
    /// (with the apogee on the node that is one impulse).
    #[test]
    fn from_an_elliptic_orbit_the_apoapsis_alone() {
        let apses = [6628.137e3, 42_164e3];
        let mu = earth().gravitational_parameter;
        let (before, after) = (apsis_speed(mu, apses[1], apses[0]), apsis_speed(mu, apses[1], apses[1]));
        for turn_deg in [0.0, 7.0_f64] {
            let turn = turn_deg.to_radians();
            let orbits = TransferOrbits {
                parking_apses: apses,
                first: Apsis::Apoapsis,
                ..to_geostationary(turn_deg, None)
            };
            let transfer = ImpulsiveTransfer::least(&earth(), &orbits).unwrap();
            let expected = (before * before + after * after - 2.0 * before * after * turn.cos()).sqrt();
            let found = transfer.velocity_change();
            assert!((found - expected).abs() < SOLVER_M_S, "{turn_deg}: {found} {expected}");
            // Of the costates: the first impulse moves the orbit towards the target, and the gradient is that of a difference.
            let first = transfer.impulses[0];
            let at = first.orbit(mu, 0.5);
            let gradient = transfer.costates(0.5, 1000.0, EXHAUST_VELOCITY);
            let side = |s: f64| transfer.cost_to_go([at.p + s, at.f, at.h, 1000.0], EXHAUST_VELOCITY);
            let difference = 0.5 * (side(1.0) - side(-1.0));
            assert!(
                (gradient[0] - difference).abs() < DIFFERENCES * difference.abs(),
                "{gradient:?} {difference}"
            );
        }
        // The perigee impulse of the same orbit, to the same apogee, is nothing: the circular case has it all.
        let orbits = TransferOrbits { parking_apses: apses, ..to_geostationary(0.0, None) };
        let from_perigee = ImpulsiveTransfer::least(&earth(), &orbits).unwrap();
        assert!(from_perigee.impulses[0].size() < ROUNDING * after);
    }

    #[test]
    fn orbits_that_are_none_are_refused() {
        let good = to_geostationary(28.5, None);
        let bad = [
            TransferOrbits { parking_apses: [-1.0, 6578.137e3], ..good },
            TransferOrbits { parking_apses: [6578.137e3, f64::NAN], ..good },
            TransferOrbits { target_apses: [42_164e3, f64::INFINITY], ..good },
            TransferOrbits { target_apses: [f64::NAN, 42_164e3], ..good },
            TransferOrbits { transfer_apoapsis: Some(0.0), ..good },
            TransferOrbits { inclination: f64::NAN, ..good },
            TransferOrbits { inclination: -0.1, ..good },
        ];
        for orbits in bad {
            let refused = ImpulsiveTransfer::least(&earth(), &orbits);
            assert!(matches!(refused, Err(DynamicsError::Parameter { .. })), "{orbits:?}");
        }
    }
}
