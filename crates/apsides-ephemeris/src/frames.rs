//! Axes: those of a mission, of the ICRF, fixed to the body, and of a place on it.

use apsides_dynamics::Ellipsoid;

use crate::Epoch;
use crate::iau::CentralBody;
use crate::orientation::{Orientation, about, product, sum, times, transposed_times};

/// The axes that the plane of a mission is given in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The axes fixed to the body, as they stand at the epoch.
    Body,
    /// Axes of the ICRF.
    Icrf,
}

/// The inertial axes of a mission: turned from the reference about its third axis, then about the first, then about the third, rad.
///
/// For a flight in a plane that begins on the first axis these are the longitude of the ascending node, the inclination and the argument
/// of the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The axes that the angles count from.
    pub reference: Reference,
    /// Longitude of the ascending node.
    pub node: f64,
    /// Inclination.
    pub inclination: f64,
    /// Angle from the node to the first axis.
    pub argument: f64,
}

/// The axes of a mission about a body, from an epoch on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// The body.
    pub body: CentralBody,
    /// Time zero of the mission.
    pub epoch: Epoch,
    /// Turns components in the ICRF into components in the mission's inertial axes.
    mission: [[f64; 3]; 3],
}

impl Frames {
    /// The axes of a mission whose inertial axes are those of a plane.
    #[must_use]
    pub fn new(body: CentralBody, epoch: Epoch, plane: &Plane) -> Self {
        let [node, _] = about(true, plane.node);
        let [tilt, _] = about(false, plane.inclination);
        let [turn, _] = about(true, plane.argument);
        let of_plane = product(&turn, &product(&tilt, &node));
        let mission = match plane.reference {
            Reference::Icrf => of_plane,
            Reference::Body => product(&of_plane, &body.orientation(&epoch).matrix),
        };
        Self { body, epoch, mission }
    }

    /// The axes fixed to the body at a time (s) of the mission.
    #[must_use]
    pub fn orientation(&self, time: f64) -> Orientation {
        self.body.orientation(&self.epoch.elapsed(time))
    }

    /// A vector in the axes of the ICRF from its components in the mission's inertial axes.
    #[must_use]
    pub fn inertial_to_icrf(&self, vector: [f64; 3]) -> [f64; 3] {
        transposed_times(&self.mission, vector)
    }

    /// A vector in the mission's inertial axes from its components in those of the ICRF.
    #[must_use]
    pub fn icrf_to_inertial(&self, vector: [f64; 3]) -> [f64; 3] {
        times(&self.mission, vector)
    }
}

/// Axes to the east, to the north and upwards at a place on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Topocentric {
    /// The place, m, in axes fixed to the body.
    pub origin: [f64; 3],
    /// Rows to the east, to the north, and upwards.
    axes: [[f64; 3]; 3],
}

impl Topocentric {
    /// Axes at a longitude and a geodetic latitude (rad) and a height (m) above a surface.
    #[must_use]
    pub fn at(surface: &Ellipsoid, longitude: f64, latitude: f64, altitude: f64) -> Self {
        let ((sl, cl), (sp, cp)) = (longitude.sin_cos(), latitude.sin_cos());
        let axes = [[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]];
        Self { origin: surface.position(longitude, latitude, altitude), axes }
    }

    /// A position (m) in axes fixed to the body from its components to the east, to the north and upwards (m).
    #[must_use]
    pub fn position(&self, components: [f64; 3]) -> [f64; 3] {
        sum(self.origin, self.vector(components))
    }

    /// A vector in axes fixed to the body from its components to the east, to the north and upwards.
    #[must_use]
    pub fn vector(&self, components: [f64; 3]) -> [f64; 3] {
        transposed_times(&self.axes, components)
    }

    /// Components to the east, to the north and upwards (m) of a position (m) in axes fixed to the body.
    #[must_use]
    pub fn components(&self, position: [f64; 3]) -> [f64; 3] {
        times(&self.axes, sum(position, self.origin.map(|c| -c)))
    }
}

#[cfg(test)]
mod tests;
