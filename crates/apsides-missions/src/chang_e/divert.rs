//! Diverts from above one place to above another.

use apsides_dynamics::great_circle::destination;

/// A flight from above one place to above another, in the vertical plane through both. Angles are in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divert {
    /// Longitude and latitude of the start.
    pub from: [f64; 2],
    /// Course there, from north towards east.
    pub course: f64,
    /// Angle at the centre.
    pub angle: f64,
    /// Longitude and latitude of the end.
    pub to: [f64; 2],
    /// Height of the ground at the end above that at the start, m.
    pub rise: f64,
    /// Largest tilt of the thrust from the vertical on the way.
    pub tilt: f64,
}

impl Divert {
    /// A divert to a site east, north and up (m) of the ground at the start, on a sphere of a radius (m); open coordinates count as zero.
    #[must_use]
    pub fn new(from: [f64; 2], site: [Option<f64>; 3], radius: f64, tilt: f64) -> Self {
        let [east, north, rise] = site.map(|c| c.unwrap_or(0.0));
        let (course, angle) = (east.atan2(north), east.hypot(north) / radius);
        Self { from, course, angle, to: destination(from, course, angle), rise, tilt }
    }

    /// Returns true if there is a way to go.
    #[must_use]
    pub fn is_needed(&self) -> bool {
        self.angle > 0.0
    }
}
