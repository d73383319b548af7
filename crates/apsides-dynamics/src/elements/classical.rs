//! Classical elements, with a convention for the angles that circular and equatorial orbits leave open.

use std::f64::consts::{PI, TAU};

use super::{Cartesian, Equinoctial, Sense};
use crate::DynamicsError;
use crate::error::{finite, positive};

/// Below this the eccentricity, and the inclination (rad) from 0 or 180 deg, are rounding errors.
const UNDEFINED: f64 = 1e-14;

/// Largest `tan(i/2)` of prograde, `cot(i/2)` of retrograde elements: beyond it rounding errors are larger than the distance from the
/// inclination that they leave out.
const STEEPEST: f64 = 1e7;

/// Classical elements of any conic.
///
/// The semi-latus rectum stands for the size, since the semi-major axis of a parabola is infinite. An orbit that comes from other
/// elements has its angles in the ranges below, an eccentricity under 1e-14 counts as zero and an inclination within 1e-14 rad of 0 or
/// 180 deg as equatorial. Then the periapsis is placed at the ascending node (`w = 0`), the ascending node on the first axis
/// (`W = 0`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Classical {
    /// Semi-latus rectum `p`, m.
    pub semi_latus_rectum: f64,
    /// Eccentricity `e`.
    pub eccentricity: f64,
    /// Inclination `i`, rad, in [0, pi].
    pub inclination: f64,
    /// Right ascension of the ascending node `W`, rad, in [0, 2 pi).
    pub node: f64,
    /// Argument of periapsis `w`, rad, in [0, 2 pi).
    pub periapsis: f64,
    /// True anomaly `v`, rad, in (-pi, pi].
    pub true_anomaly: f64,
}

impl Classical {
    /// The orbit of a semi-major axis (m; negative for a hyperbola) and an eccentricity other than 1; angles in rad.
    ///
    /// # Errors
    /// When the semi-major axis has not the sign of `1 - e`, and as [`Classical::checked`].
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::elements::Classical;
    ///
    /// // A transfer orbit from 200 km to the geostationary radius.
    /// let (low, high) = (6578e3, 42_164e3);
    /// let (a, e) = (0.5 * (low + high), (high - low) / (high + low));
    /// let orbit = Classical::with_semi_major_axis(a, e, 0.497, 0.0, 0.0, 0.0)?;
    /// assert!((orbit.periapsis_radius() / low - 1.0).abs() < 1e-15);
    /// assert!((orbit.apoapsis_radius() / high - 1.0).abs() < 1e-15);
    /// # Ok::<(), apsides_dynamics::DynamicsError>(())
    /// ```
    pub fn with_semi_major_axis(
        semi_major_axis: f64,
        eccentricity: f64,
        inclination: f64,
        node: f64,
        periapsis: f64,
        true_anomaly: f64,
    ) -> Result<Self, DynamicsError> {
        let semi_latus_rectum = semi_major_axis * (1.0 - eccentricity) * (1.0 + eccentricity);
        if semi_latus_rectum <= 0.0 && eccentricity >= 0.0 {
            return Err(DynamicsError::Parameter {
                what: "semi-major axis",
                value: semi_major_axis,
                unit: "m",
                allowed: "a positive number for an ellipse, a negative one for a hyperbola",
            });
        }
        Self { semi_latus_rectum, eccentricity, inclination, node, periapsis, true_anomaly }.checked()
    }

    /// Passes elements of an orbit on, at a point of it.
    ///
    /// # Errors
    /// When an element is not finite, the semi-latus rectum not positive, the eccentricity negative, the inclination outside 0 to 180
    /// deg, or the true anomaly beyond the asymptotes of a hyperbola.
    pub fn checked(self) -> Result<Self, DynamicsError> {
        positive("semi-latus rectum", self.semi_latus_rectum, "m")?;
        let refused =
            |what, value, unit, allowed| Err(DynamicsError::Parameter { what, value, unit, allowed });
        if !(self.eccentricity >= 0.0 && self.eccentricity.is_finite()) {
            return refused("eccentricity", self.eccentricity, "-", "a finite number from 0 on");
        }
        if !(0.0..=PI).contains(&self.inclination) {
            return refused("inclination", self.inclination, "rad", "0 to pi");
        }
        finite("right ascension of the ascending node", self.node, "rad")?;
        finite("argument of periapsis", self.periapsis, "rad")?;
        if 1.0 + self.eccentricity * self.true_anomaly.cos() > 0.0 {
            Ok(self)
        } else {
            let allowed = "what lies between the asymptotes of the orbit";
            refused("true anomaly", self.true_anomaly, "rad", allowed)
        }
    }

    /// Semi-major axis, m: negative for a hyperbola, infinite for a parabola.
    #[must_use]
    pub fn semi_major_axis(&self) -> f64 {
        self.semi_latus_rectum / ((1.0 - self.eccentricity) * (1.0 + self.eccentricity))
    }

    /// Distance of the lowest point from the centre of the body, m.
    #[must_use]
    pub fn periapsis_radius(&self) -> f64 {
        self.semi_latus_rectum / (1.0 + self.eccentricity)
    }

    /// Distance of the highest point from the centre of the body, m; infinite without one.
    ///
    /// # Examples
    /// ```
    /// use apsides_dynamics::elements::Classical;
    ///
    /// let parabola = Classical {
    ///     semi_latus_rectum: 2e7,
    ///     eccentricity: 1.0,
    ///     inclination: 0.1,
    ///     node: 0.0,
    ///     periapsis: 0.0,
    ///     true_anomaly: 0.5,
    /// };
    /// assert_eq!(parabola.apoapsis_radius(), f64::INFINITY);
    /// assert_eq!(Classical { eccentricity: 0.5, ..parabola }.apoapsis_radius(), 4e7);
    /// ```
    #[must_use]
    pub fn apoapsis_radius(&self) -> f64 {
        if self.eccentricity < 1.0 {
            self.semi_latus_rectum / (1.0 - self.eccentricity)
        } else {
            f64::INFINITY
        }
    }

    /// Period, s, with the gravitational parameter `mu` (m3/s2); infinite without one.
    #[must_use]
    pub fn period(&self, mu: f64) -> f64 {
        if self.eccentricity < 1.0 {
            let a = self.semi_major_axis();
            TAU * a * (a / mu).sqrt()
        } else {
            f64::INFINITY
        }
    }

    /// Modified equinoctial elements of one sense; the true longitude is the sum of the angles, revolutions included.
    ///
    /// # Errors
    /// When the inclination is the one that the sense leaves out, within 2e-7 rad, and as [`Classical::checked`].
    pub fn to_equinoctial(&self, sense: Sense) -> Result<Equinoctial, DynamicsError> {
        self.checked()?;
        let (lean, allowed) = match sense {
            Sense::Prograde => (self.inclination, "less than pi for prograde elements"),
            Sense::Retrograde => (PI - self.inclination, "more than 0 for retrograde elements"),
        };
        let steepness = (0.5 * lean).tan();
        // The tangent of a quarter turn is negative where it is rounded up.
        if !(0.0..=STEEPEST).contains(&steepness) {
            let (what, value, unit) = ("inclination", self.inclination, "rad");
            return Err(DynamicsError::Parameter { what, value, unit, allowed });
        }
        let longitude = self.periapsis + sense.factor() * self.node;
        Ok(Equinoctial {
            semi_latus_rectum: self.semi_latus_rectum,
            f: self.eccentricity * longitude.cos(),
            g: self.eccentricity * longitude.sin(),
            h: steepness * self.node.cos(),
            k: steepness * self.node.sin(),
            true_longitude: longitude + self.true_anomaly,
            sense,
        })
    }

    /// Position and velocity, with the gravitational parameter `mu` (m3/s2).
    ///
    /// # Errors
    /// As [`Classical::checked`], and when `mu` is not positive and finite.
    pub fn to_cartesian(&self, mu: f64) -> Result<Cartesian, DynamicsError> {
        let mu = positive("gravitational parameter", mu, "m3/s2")?;
        Ok(self.to_equinoctial(Sense::of(self.inclination))?.to_cartesian(mu))
    }
}

impl Equinoctial {
    /// Classical elements.
    ///
    /// # Errors
    /// As [`Equinoctial::checked`].
    pub fn to_classical(&self) -> Result<Classical, DynamicsError> {
        self.checked()?;
        let lean = 2.0 * self.h.hypot(self.k).atan();
        let node = if lean < UNDEFINED { 0.0 } else { self.k.atan2(self.h) };
        let inclination = match self.sense {
            Sense::Prograde => lean,
            Sense::Retrograde => PI - lean,
        };
        // The node turns with the equinoctial frame, or against it.
        let turned = self.sense.factor() * node;
        let mut eccentricity = self.in_plane().eccentricity();
        let mut longitude = turned;
        if eccentricity < UNDEFINED {
            eccentricity = 0.0;
        } else {
            longitude = self.g.atan2(self.f);
        }
        Ok(Classical {
            semi_latus_rectum: self.semi_latus_rectum,
            eccentricity,
            inclination,
            node: full_turn(node),
            periapsis: full_turn(longitude - turned),
            true_anomaly: half_turn(self.true_longitude - longitude),
        })
    }
}

/// The angle (rad) in [0, 2 pi).
fn full_turn(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    // The remainder of a small negative angle is rounded to the divisor.
    if turned < TAU { turned } else { 0.0 }
}

/// The angle (rad) in (-pi, pi].
fn half_turn(angle: f64) -> f64 {
    let turned = full_turn(angle);
    if turned > PI { turned - TAU } else { turned }
}
