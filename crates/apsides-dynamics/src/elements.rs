//! Orbital elements and states, and what leads from one to the other.
//!
//! | set | where it is regular |
//! | --- | --- |
//! | [`Cartesian`]: position and velocity | everywhere |
//! | [`Equinoctial`]: modified equinoctial elements `p, f, g, h, k, L` of one [`Sense`] | all conics; not at an inclination of 180 deg (prograde) or 0 deg (retrograde) |
//! | [`Classical`]: `p, e, i, W, w, v` | all conics; not circular or equatorial orbits, where a convention chooses the angles |
//! | [`PlanarEquinoctial`]: `p, f, g, L` in one plane | all conics |
//! | [`PlanarPolar`]: radius, angle and speeds in one plane | everywhere |
//!
//! No set describes rectilinear motion. Modified equinoctial elements of either sense are, with `I` = 1 (prograde) or -1 (retrograde),
//!
//! ```text
//! p = a (1 - e^2)        f = e cos(w + I W)      h = tan(i/2)^I cos(W)
//! L = w + I W + v        g = e sin(w + I W)      k = tan(i/2)^I sin(W)
//! ```
//!
//! with the axes of the equinoctial frame, `s2 = 1 + h^2 + k^2`: towards true longitude 0, towards 90 deg, along the angular momentum
//!
//! ```text
//! [1 + h^2 - k^2,  2 h k,  -2 I k] / s2
//! [2 I h k,  I (1 - h^2 + k^2),  2 h] / s2
//! [2 k,  -2 h,  I (1 - h^2 - k^2)] / s2
//! ```
//!
//! (M. J. H. Walker, B. Ireland, J. Owens, *Celestial Mechanics* 36 (1985) 409, doi 10.1007/BF01227493; Vallado 2013, section
//! 2.4.) The retrograde elements of an orbit are, but for the sign of `h`, the prograde ones in the frame that is turned by 180 deg
//! about its first axis. An oblate body's field is the same in both, so that the models of [`equinoctial`](crate::equinoctial), but those
//! with a thrust in an inertial direction, serve retrograde elements with `h` negated.
//!
//! Conversions that are smooth are generic in the scalar and check nothing; those that branch are for `f64` and refuse what is no orbit.
//! Round trips agree to 1e-12 of the state.

use apsides_ad::{Scalar, vector};

use crate::DynamicsError;
use crate::error::{finite, positive};

mod classical;
mod place;
mod plane;

pub use classical::Classical;
pub(crate) use place::Place;
pub use plane::{PlanarEquinoctial, PlanarPolar};

/// The inclination that the equinoctial elements leave out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// `I = 1`: for inclinations from 0 up to, not including, 180 deg.
    Prograde,
    /// `I = -1`: for inclinations from 180 down to, not including, 0 deg.
    Retrograde,
}

impl Sense {
    /// The factor `I`.
    #[must_use]
    pub const fn factor(self) -> f64 {
        match self {
            Self::Prograde => 1.0,
            Self::Retrograde => -1.0,
        }
    }

    /// The sense that is regular by the widest margin at an inclination (rad).
    #[must_use]
    pub fn of(inclination: f64) -> Self {
        if inclination > std::f64::consts::FRAC_PI_2 { Self::Retrograde } else { Self::Prograde }
    }
}

/// Position and velocity in inertial space, in m and m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cartesian<S = f64> {
    /// Position from the centre of the body, m.
    pub position: [S; 3],
    /// Velocity, m/s.
    pub velocity: [S; 3],
}

/// Modified equinoctial elements of one sense, with the true longitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equinoctial<S = f64> {
    /// Semi-latus rectum `p`, m.
    pub semi_latus_rectum: S,
    /// Component `f` of the eccentricity.
    pub f: S,
    /// Component `g` of the eccentricity.
    pub g: S,
    /// Component `h` of the inclination.
    pub h: S,
    /// Component `k` of the inclination.
    pub k: S,
    /// True longitude `L`, rad.
    pub true_longitude: S,
    /// The inclination that is left out.
    pub sense: Sense,
}

/// The axes of the equinoctial frame in inertial space: true longitude 0 and 90 deg, and the angular momentum.
pub(crate) fn equinoctial_axes<S: Scalar>(h: S, k: S, sense: Sense) -> [[S; 3]; 3] {
    let one = S::from(1.0);
    let sign = sense.factor();
    let (h2, k2, hk) = (h * h, k * k, h * k * 2.0);
    let scale = (h2 + k2 + 1.0).recip();
    [
        [one + h2 - k2, hk, k * (-2.0 * sign)],
        [hk * sign, (one - h2 + k2) * sign, h * 2.0],
        [k * 2.0, h * -2.0, (one - h2 - k2) * sign],
    ]
    .map(|axis| vector::scale(&axis, scale))
}

impl<S: Scalar> Equinoctial<S> {
    /// Prograde elements `[p, f, g, h, k, L]`, the states of the models in [`equinoctial`](crate::equinoctial).
    #[must_use]
    pub const fn prograde([p, f, g, h, k, l]: [S; 6]) -> Self {
        Self { semi_latus_rectum: p, f, g, h, k, true_longitude: l, sense: Sense::Prograde }
    }

    /// `[p, f, g, h, k, L]`.
    #[must_use]
    pub const fn array(&self) -> [S; 6] {
        [self.semi_latus_rectum, self.f, self.g, self.h, self.k, self.true_longitude]
    }

    /// The elements in the orbital plane.
    #[must_use]
    pub const fn in_plane(&self) -> PlanarEquinoctial<S> {
        PlanarEquinoctial {
            semi_latus_rectum: self.semi_latus_rectum,
            f: self.f,
            g: self.g,
            true_longitude: self.true_longitude,
        }
    }

    /// Position and velocity, with the gravitational parameter `mu` (m3/s2).
    #[must_use]
    pub fn to_cartesian(&self, mu: f64) -> Cartesian<S> {
        let place = Place::new(mu, self.semi_latus_rectum, self.f, self.g, self.true_longitude);
        let [first, second, _] = equinoctial_axes(self.h, self.k, self.sense);
        let at = |a: S, b: S| vector::add(&vector::scale(&first, a), &vector::scale(&second, b));
        Cartesian {
            position: at(place.radius * place.cos, place.radius * place.sin),
            velocity: at(-(place.sin + self.g) / place.root, (place.cos + self.f) / place.root),
        }
    }
}

impl Equinoctial {
    /// Passes elements of an orbit on, at a point of it.
    ///
    /// # Errors
    /// When an element is not finite, the semi-latus rectum not positive, or the true longitude beyond the asymptotes of a hyperbola.
    pub fn checked(self) -> Result<Self, DynamicsError> {
        self.in_plane().checked()?;
        finite("equinoctial element h", self.h, "-")?;
        finite("equinoctial element k", self.k, "-")?;
        Ok(self)
    }
}

impl<S: Scalar> Cartesian<S> {
    /// Modified equinoctial elements, with the gravitational parameter `mu` (m3/s2); the true longitude is in (-pi, pi].
    ///
    /// Not a number where there is no orbit: at the centre, in rectilinear motion, and at the inclination that the sense leaves out;
    /// see [`Cartesian::checked`] and [`Cartesian::sense`]. At a distance `d` (rad) from that inclination rounding errors grow by
    /// `1 / d^2`.
    #[must_use]
    pub fn to_equinoctial(&self, mu: f64, sense: Sense) -> Equinoctial<S> {
        let radius = vector::norm(&self.position, 0.0);
        let momentum = vector::cross(&self.position, &self.velocity);
        let size = vector::norm(&momentum, 0.0);
        let [wx, wy, wz] = vector::scale(&momentum, size.recip());
        let lean = wz * sense.factor() + 1.0;
        let (h, k) = (-wy / lean, wx / lean);
        let [first, second, _] = equinoctial_axes(h, k, sense);
        let p = size.square() / mu;
        // Components along the radius, which carry the lengths: the angle alone enters.
        let (x, y) = (vector::dot(&self.position, &first), vector::dot(&self.position, &second));
        let true_longitude = y.atan2(x);
        let (cos, sin) = (x / radius, y / radius);
        let (e_cos, e_sin) =
            (p / radius - 1.0, vector::dot(&self.position, &self.velocity) * size / (radius * mu));
        Equinoctial {
            semi_latus_rectum: p,
            f: e_cos * cos + e_sin * sin,
            g: e_cos * sin - e_sin * cos,
            h,
            k,
            true_longitude,
            sense,
        }
    }
}

/// Sine of the angle between position and velocity below which rounding errors decide on the orbital plane.
const RECTILINEAR: f64 = 1e-15;

impl Cartesian {
    /// Passes a state on an orbit on.
    ///
    /// # Errors
    /// When a component is not finite, the position is the centre of the body, or the motion is rectilinear: a velocity of zero or
    /// along the radius.
    pub fn checked(self) -> Result<Self, DynamicsError> {
        for (what, unit, vector) in [("position", "m", self.position), ("velocity", "m/s", self.velocity)] {
            for component in vector {
                finite(what, component, unit)?;
            }
        }
        let radius = positive("distance from the centre of the body", length(&self.position), "m")?;
        let speed = length(&self.velocity);
        let momentum = vector::cross(
            &vector::scale(&self.position, 1.0 / radius),
            &vector::scale(&self.velocity, 1.0 / speed),
        );
        // Not a number where the speed is zero.
        if length(&momentum) > RECTILINEAR {
            Ok(self)
        } else {
            Err(DynamicsError::Rectilinear { radius, speed })
        }
    }

    /// The sense whose elements are regular here by the widest margin.
    #[must_use]
    pub fn sense(&self) -> Sense {
        let [x, y, _] = self.position;
        let [vx, vy, _] = self.velocity;
        if x * vy - y * vx < 0.0 { Sense::Retrograde } else { Sense::Prograde }
    }

    /// Classical elements, with the gravitational parameter `mu` (m3/s2).
    ///
    /// # Errors
    /// As [`Cartesian::checked`], and when `mu` is not positive and finite.
    pub fn to_classical(&self, mu: f64) -> Result<Classical, DynamicsError> {
        let mu = positive("gravitational parameter", mu, "m3/s2")?;
        self.checked()?.to_equinoctial(mu, self.sense()).to_classical()
    }
}

/// Euclidean norm.
fn length(a: &[f64; 3]) -> f64 {
    vector::norm(a, 0.0)
}

#[cfg(test)]
mod tests;
