//! Orbits in one plane, flown in the direction of growing polar angle.

use apsides_ad::Scalar;

use super::Place;
use crate::DynamicsError;
use crate::error::{finite, positive};

/// Equinoctial elements of an orbit in one plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarEquinoctial<S = f64> {
    /// Semi-latus rectum `p`, m.
    pub semi_latus_rectum: S,
    /// Component `f` of the eccentricity.
    pub f: S,
    /// Component `g` of the eccentricity.
    pub g: S,
    /// True longitude `L`, rad.
    pub true_longitude: S,
}

/// A state in polar coordinates: those of [`planar`](crate::planar).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPolar<S = f64> {
    /// Distance from the centre of the body, m.
    pub radius: S,
    /// Polar angle, rad.
    pub angle: S,
    /// Speed along the local horizontal, m/s; positive.
    pub horizontal_speed: S,
    /// Speed along the local vertical, positive up, m/s.
    pub radial_speed: S,
}

impl<S: Scalar> PlanarEquinoctial<S> {
    /// Elements `[p, f, g, L]`, the states of the planar models in [`equinoctial`](crate::equinoctial).
    #[must_use]
    pub const fn new([p, f, g, l]: [S; 4]) -> Self {
        Self { semi_latus_rectum: p, f, g, true_longitude: l }
    }

    /// `[p, f, g, L]`.
    #[must_use]
    pub const fn array(&self) -> [S; 4] {
        [self.semi_latus_rectum, self.f, self.g, self.true_longitude]
    }

    /// Polar coordinates, with the gravitational parameter `mu` (m3/s2); the polar angle is the true longitude, revolutions included.
    #[must_use]
    pub fn to_polar(&self, mu: f64) -> PlanarPolar<S> {
        let place = Place::new(mu, self.semi_latus_rectum, self.f, self.g, self.true_longitude);
        let [radial_speed, horizontal_speed] = place.hodograph(self.f, self.g).map(|s| s / place.root);
        PlanarPolar { radius: place.radius, angle: self.true_longitude, horizontal_speed, radial_speed }
    }
}

impl<S: Scalar> PlanarPolar<S> {
    /// Elements, with the gravitational parameter `mu` (m3/s2); the true longitude is the polar angle, revolutions included.
    ///
    /// Meaningless for a horizontal speed that is not positive; see [`PlanarPolar::checked`].
    #[must_use]
    pub fn to_equinoctial(&self, mu: f64) -> PlanarEquinoctial<S> {
        let momentum = self.radius * self.horizontal_speed;
        let p = momentum.square() / mu;
        let (e_cos, e_sin) = (p / self.radius - 1.0, self.radial_speed * momentum / mu);
        let (sin, cos) = self.angle.sin_cos();
        PlanarEquinoctial {
            semi_latus_rectum: p,
            f: e_cos * cos + e_sin * sin,
            g: e_cos * sin - e_sin * cos,
            true_longitude: self.angle,
        }
    }
}

impl PlanarEquinoctial {
    /// Passes elements of an orbit on, at a point of it.
    ///
    /// # Errors
    /// When an element is not finite, the semi-latus rectum not positive, or the true longitude beyond the asymptotes of a hyperbola.
    pub fn checked(self) -> Result<Self, DynamicsError> {
        positive("semi-latus rectum", self.semi_latus_rectum, "m")?;
        finite("equinoctial element f", self.f, "-")?;
        finite("equinoctial element g", self.g, "-")?;
        let (what, unit) = ("true longitude", "rad");
        finite(what, self.true_longitude, unit)?;
        let (sin, cos) = self.true_longitude.sin_cos();
        if 1.0 + self.f * cos + self.g * sin > 0.0 {
            Ok(self)
        } else {
            let allowed = "what lies between the asymptotes of the orbit";
            Err(DynamicsError::Parameter { what, value: self.true_longitude, unit, allowed })
        }
    }

    /// Eccentricity.
    #[must_use]
    pub fn eccentricity(&self) -> f64 {
        self.f.hypot(self.g)
    }
}

impl PlanarPolar {
    /// Passes a state on an orbit on.
    ///
    /// # Errors
    /// When a component is not finite, or the radius or the horizontal speed not positive.
    pub fn checked(self) -> Result<Self, DynamicsError> {
        positive("distance from the centre of the body", self.radius, "m")?;
        finite("polar angle", self.angle, "rad")?;
        positive("horizontal speed", self.horizontal_speed, "m/s")?;
        finite("radial speed", self.radial_speed, "m/s")?;
        Ok(self)
    }
}
