//! Orbital flight with finite thrust in modified equinoctial elements, in the plane and in space.
//!
//! With the classical elements (semi-major axis `a`, eccentricity `e`, inclination `i`, right ascension of the ascending node `W`,
//! argument of periapsis `w`, true anomaly `v`):
//!
//! ```text
//! p = a (1 - e^2)      f = e cos(w + W)      h = tan(i/2) cos(W)
//! L = W + w + v        g = e sin(w + W)      k = tan(i/2) sin(W)
//! ```
//!
//! and `q = 1 + f cos(L) + g sin(L)`, `s2 = 1 + h^2 + k^2`, `z = h sin(L) - k cos(L)`, `r = p / q`, a perturbing acceleration with the
//! components `R` (along the radius), `T` (transverse, in the direction of motion) and `N` (along the angular momentum) gives
//!
//! ```text
//! p' = 2 (p / q) sqrt(p / mu) T
//! f' = sqrt(p / mu) [ R sin(L) + ((q + 1) cos(L) + f) T / q - g z N / q]
//! g' = sqrt(p / mu) [-R cos(L) + ((q + 1) sin(L) + g) T / q + f z N / q]
//! h' = sqrt(p / mu) s2 cos(L) N / (2 q)
//! k' = sqrt(p / mu) s2 sin(L) N / (2 q)
//! L' = sqrt(mu p) (q / p)^2 + sqrt(p / mu) z N / q
//! ```
//!
//! (Walker, Ireland, Owens 1985; Betts 2010, chapter 6.) The mass falls by `m' = -thrust / c`. The
//! oblateness `J2` of the body, with its equatorial radius `Re`, adds
//!
//! ```text
//! R = -(3/2) mu J2 Re^2 / r^4 [1 - 12 z^2 / s2^2]
//! T = -12 mu J2 Re^2 / r^4  z (h cos(L) + k sin(L)) / s2^2
//! N =  -6 mu J2 Re^2 / r^4  z (1 - h^2 - k^2) / s2^2
//! ```
//!
//! (Betts 2010, chapter 6.) In the equatorial plane, `h = k = 0`, it is a radial force alone.
//!
//! The elements are regular for circular, equatorial, elliptic, parabolic and hyperbolic orbits, not for an inclination of 180 deg
//! and not for rectilinear motion, `p = 0`. Without thrust and oblateness all of them are constant but `L`, which grows by 2 pi in
//! each revolution.
//!
//! Every model below is the one rate of the plane or of space with a thrust of its own: none, steered, along the velocity, in a fixed
//! direction of inertial space. The thrust is on and full wherever there is one.
//!
//! References: M. J. H. Walker, B. Ireland, J. Owens, *Celestial Mechanics* 36 (1985) 409, doi 10.1007/BF01227493; J. T. Betts,
//! *Practical Methods for Optimal Control and Estimation Using Nonlinear Programming*, 2nd ed., SIAM 2010,
//! doi 10.1137/1.9780898718577.

use apsides_ad::{Scalar, vector};

use crate::elements::Place;
pub use crate::planar::{MASS, THRUST_ANGLE};
use crate::{Body, Engine, Quantity};

mod plane;
mod space;

pub use plane::{PlanarCoast, PlanarInertialThrust, PlanarThrust, PlanarVelocityThrust};
pub(crate) use space::inertial_direction;
pub use space::{SpatialCoast, SpatialInertialThrust, SpatialThrust, SpatialVelocityThrust};

/// Semi-latus rectum `p`.
pub const SEMI_LATUS_RECTUM: Quantity = Quantity::new("semi-latus rectum", "m");
/// Component `f` of the eccentricity.
pub const ECCENTRICITY_F: Quantity = Quantity::new("eccentricity f", "-");
/// Component `g` of the eccentricity.
pub const ECCENTRICITY_G: Quantity = Quantity::new("eccentricity g", "-");
/// Component `h` of the inclination.
pub const INCLINATION_H: Quantity = Quantity::new("inclination h", "-");
/// Component `k` of the inclination.
pub const INCLINATION_K: Quantity = Quantity::new("inclination k", "-");
/// True longitude `L`, not reduced to one revolution.
pub const TRUE_LONGITUDE: Quantity = Quantity::new("true longitude", "rad");
/// Angle of the thrust out of the orbital plane, positive along the angular momentum.
pub const OUT_OF_PLANE_ANGLE: Quantity = Quantity::new("out-of-plane thrust angle", "rad");
/// Angle of the thrust from the first axis of inertial space, in the plane of the first two.
pub const THRUST_LONGITUDE: Quantity = Quantity::new("inertial thrust longitude", "rad");
/// Angle of the thrust from the plane of the first two axes of inertial space.
pub const THRUST_LATITUDE: Quantity = Quantity::new("inertial thrust latitude", "rad");

/// States of the planar models; [`PlanarInertialThrust`] adds [`THRUST_LONGITUDE`].
pub const PLANAR_STATES: [Quantity; 5] =
    [SEMI_LATUS_RECTUM, ECCENTRICITY_F, ECCENTRICITY_G, TRUE_LONGITUDE, MASS];
/// States of the spatial models; [`SpatialInertialThrust`] adds [`THRUST_LONGITUDE`] and [`THRUST_LATITUDE`].
pub const SPATIAL_STATES: [Quantity; 7] =
    [SEMI_LATUS_RECTUM, ECCENTRICITY_F, ECCENTRICITY_G, INCLINATION_H, INCLINATION_K, TRUE_LONGITUDE, MASS];

/// Oblateness of the Earth: EGM96, `J2 = -sqrt(5) C20` with the normalised `C20 = -484.165371736e-6`.
pub const EARTH_J2: f64 = 1.082_626_68e-3;

/// A body with its oblateness, and an engine: what the equations of motion need to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitalFlight {
    /// Central body; its radius enters with `j2` alone, and is then the equatorial one.
    pub body: Body,
    /// Engine.
    pub engine: Engine,
    /// Oblateness `J2` of the body, zero for a sphere.
    pub j2: f64,
}

impl OrbitalFlight {
    /// Flight of a vehicle with one engine around a spherical body.
    #[must_use]
    pub const fn new(body: Body, engine: Engine) -> Self {
        Self { body, engine, j2: 0.0 }
    }

    /// The same around an oblate body.
    #[must_use]
    pub const fn with_j2(self, j2: f64) -> Self {
        Self { j2, ..self }
    }

    /// `mu J2 Re^2`, in m5/s2.
    pub(crate) fn oblateness(&self) -> f64 {
        self.body.gravitational_parameter * self.j2 * self.body.radius * self.body.radius
    }

    /// Acceleration by the full thrust along a unit vector.
    pub(crate) fn thrust_acceleration<S: Scalar, const N: usize>(
        &self,
        mass: S,
        direction: &[S; N],
    ) -> [S; N] {
        vector::scale(direction, mass.recip() * self.engine.thrust)
    }

    /// Rate of the mass with the thrust on or off.
    pub(crate) fn mass_rate<S: Scalar>(&self, on: bool) -> S {
        S::from(if on { -self.engine.mass_flow() } else { 0.0 })
    }
}

impl<S: Scalar> Place<S> {
    /// Rates of `p`, `f`, `g`, `L` from the radial and transverse component of the acceleration, if there is one: without, all but the
    /// last are constants, which keeps them out of the pattern of derivatives.
    fn in_plane(&self, f: S, g: S, acceleration: Option<[S; 2]>) -> [S; 4] {
        let Self { sin, cos, q, root, radius } = *self;
        // sqrt(mu p) / r^2 = (p / r) / (r sqrt(p / mu))
        let l = q / (radius * root);
        let Some([radial, transverse]) = acceleration else {
            let zero = S::from(0.0);
            return [zero, zero, zero, l];
        };
        let turn = transverse / q;
        [
            radius * root * transverse * 2.0,
            root * (radial * sin + ((q + 1.0) * cos + f) * turn),
            root * (((q + 1.0) * sin + g) * turn - radial * cos),
            l,
        ]
    }

    /// Radial and transverse component of the unit vector along the velocity.
    fn velocity_direction(&self, f: S, g: S) -> [S; 2] {
        let velocity = self.hodograph(f, g);
        // Not zero before the semi-latus rectum is.
        let speed = vector::norm(&velocity, 0.0);
        velocity.map(|component| component / speed)
    }
}

#[cfg(test)]
mod tests;
