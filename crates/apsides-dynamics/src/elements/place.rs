//! A point of a conic in its plane, seen from the equinoctial elements.

use apsides_ad::Scalar;

/// Quantities of a point of an orbit that equations in equinoctial elements need.
pub(crate) struct Place<S> {
    /// Sine of the true longitude.
    pub(crate) sin: S,
    /// Cosine of the true longitude.
    pub(crate) cos: S,
    /// Semi-latus rectum by radius.
    pub(crate) q: S,
    /// `sqrt(p / mu)`, s/m.
    pub(crate) root: S,
    /// Radius, m.
    pub(crate) radius: S,
}

impl<S: Scalar> Place<S> {
    /// The point at true longitude `l` (rad) of the orbit of semi-latus rectum `p` (m).
    pub(crate) fn new(mu: f64, p: S, f: S, g: S, l: S) -> Self {
        let (sin, cos) = l.sin_cos();
        let q = f * cos + g * sin + 1.0;
        Self { sin, cos, q, root: (p / mu).sqrt(), radius: p / q }
    }

    /// Radial and transverse component of the velocity times `sqrt(p / mu)`.
    pub(crate) fn hodograph(&self, f: S, g: S) -> [S; 2] {
        [f * self.sin - g * self.cos, self.q]
    }
}
