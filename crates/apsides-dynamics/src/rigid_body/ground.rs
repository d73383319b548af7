//! The ground that a body flies over: its axes, gravity, and the wind above it.

use apsides_ad::{Outside, Pchip, Scalar};

use crate::DynamicsError;
use crate::attitude::{self, Quaternion};
use crate::ellipsoid::{Ellipsoid, Geodetic};
use crate::error::{finite, finite_column, increasing, short};

/// A plane that does not turn, with gravity downwards that depends on the height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatEarth {
    /// Terms of gravity (m/s2, m/s3, m/s4) in powers of the height.
    gravity: [f64; 3],
}

impl FlatEarth {
    /// Normal gravity of WGS 84 above a geodetic latitude (rad), of [second degree in the height](Ellipsoid::gravity_with_height).
    ///
    /// # Errors
    /// When the latitude is not finite.
    pub fn wgs84(latitude: f64) -> Result<Self, DynamicsError> {
        let latitude = finite("latitude", latitude, "rad")?;
        Ok(Self { gravity: Ellipsoid::WGS84.gravity_with_height(latitude) })
    }

    /// The same gravity (m/s2) at all heights.
    ///
    /// # Errors
    /// When it is not finite.
    pub fn uniform(gravity: f64) -> Result<Self, DynamicsError> {
        Ok(Self { gravity: [finite("gravity", gravity, "m/s2")?, 0.0, 0.0] })
    }

    /// Gravity, m/s2, downwards, at a height (m).
    #[inline]
    pub fn gravity<S: Scalar>(&self, height: S) -> S {
        let [g0, g1, g2] = self.gravity;
        (height * g2 + g1) * height + g0
    }

    /// Potential energy by mass, J/kg, at a height (m) above the plane.
    #[must_use]
    pub fn potential(&self, height: f64) -> f64 {
        let [g0, g1, g2] = self.gravity;
        height * (g0 + height * (g1 / 2.0 + height * g2 / 3.0))
    }
}

/// The ground, and the axes of position, velocity and attitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    /// Axes north, east, down from a point at height 0.
    Flat(FlatEarth),
    /// Axes fixed to the [rotating ellipsoid](crate::ellipsoid), from its centre.
    Ellipsoid(Ellipsoid),
}

/// Where and how a flight starts: angles in rad, lengths in m, speeds in m/s relative to the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Start {
    /// Longitude; unused over a plane.
    pub longitude: f64,
    /// Geodetic latitude; unused over a plane.
    pub latitude: f64,
    /// Height.
    pub altitude: f64,
    /// Speed.
    pub speed: f64,
    /// Angle of the velocity above the horizontal.
    pub path: f64,
    /// Direction of the velocity from north, clockwise.
    pub azimuth: f64,
    /// Roll about the velocity.
    pub bank: f64,
    /// Angle of attack `atan2(w, u)`.
    pub attack: f64,
    /// Sideslip `asin(v / V)`.
    pub sideslip: f64,
    /// Angular velocity relative to inertial space, in body axes, rad/s.
    pub spin: [f64; 3],
}

impl Ground {
    /// Height, m, at a position (m).
    #[inline]
    pub fn altitude<S: Scalar>(&self, r: &[S; 3]) -> S {
        match self {
            Self::Flat(_) => -r[2],
            Self::Ellipsoid(earth) => earth.geodetic(r).altitude,
        }
    }

    /// Height and local axes at a position (m).
    #[inline]
    pub fn local<S: Scalar>(&self, r: &[S; 3]) -> Geodetic<S> {
        match self {
            Self::Flat(_) => {
                let (o, i) = (S::from(0.0), S::from(1.0));
                Geodetic { altitude: -r[2], up: [o, o, -i], north: [i, o, o], east: [o, i, o] }
            }
            Self::Ellipsoid(earth) => earth.geodetic(r),
        }
    }

    /// Acceleration of a free body, m/s2, at a position (m) and a velocity (m/s) relative to the ground: with the Coriolis and the centrifugal
    /// part of the rotation.
    #[inline(always)]
    pub fn gravity<S: Scalar>(&self, r: &[S; 3], v: &[S; 3]) -> [S; 3] {
        match self {
            Self::Flat(flat) => [S::from(0.0), S::from(0.0), flat.gravity(-r[2])],
            Self::Ellipsoid(earth) => {
                let [x, y, z] = earth.gravitation(r);
                let w = earth.rotation_rate;
                [x + (v[1] * 2.0 + r[0] * w) * w, y + (-v[0] * 2.0 + r[1] * w) * w, z]
            }
        }
    }

    /// Angular velocity of the ground about its z axis, rad/s, if it turns.
    #[must_use]
    pub fn rotation_rate(&self) -> Option<f64> {
        match self {
            Self::Flat(_) => None,
            Self::Ellipsoid(earth) => Some(earth.rotation_rate),
        }
    }

    /// The state in which a flight starts.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn state(&self, start: &Start) -> Result<[f64; 13], DynamicsError> {
        let values = [
            ("longitude", start.longitude, "rad"),
            ("latitude", start.latitude, "rad"),
            ("altitude", start.altitude, "m"),
            ("speed", start.speed, "m/s"),
            ("flight path angle", start.path, "rad"),
            ("azimuth", start.azimuth, "rad"),
            ("bank angle", start.bank, "rad"),
            ("angle of attack", start.attack, "rad"),
            ("sideslip", start.sideslip, "rad"),
        ];
        for (what, value, unit) in values {
            finite(what, value, unit)?;
        }
        for rate in start.spin {
            finite("angular velocity", rate, "rad/s")?;
        }
        let q = attitude::from_flow(start.azimuth, start.path, start.bank, start.attack, start.sideslip);
        let (position, local): ([f64; 3], Quaternion<f64>) = match self {
            Self::Flat(_) => ([0.0, 0.0, -start.altitude], [1.0, 0.0, 0.0, 0.0]),
            Self::Ellipsoid(earth) => {
                // Axes north, east, down in those fixed to the Earth.
                let turn = attitude::about(1, -start.latitude - std::f64::consts::FRAC_PI_2);
                (
                    earth.position(start.longitude, start.latitude, start.altitude),
                    attitude::product(&attitude::about(2, start.longitude), &turn),
                )
            }
        };
        let (sin, cos) = start.path.sin_cos();
        let (east, north) = start.azimuth.sin_cos();
        let velocity = [cos * north, cos * east, -sin].map(|c| c * start.speed);
        let v = attitude::turned(&attitude::rotation(&local), &velocity);
        let q = attitude::product(&local, &q);
        let (r, w) = (position, start.spin);
        Ok([r[0], r[1], r[2], v[0], v[1], v[2], q[0], q[1], q[2], q[3], w[0], w[1], w[2]])
    }

    /// Energy of the motion by mass, J/kg, that free flight keeps: kinetic energy relative to the ground, and the potential of gravity with the
    /// centrifugal part.
    #[must_use]
    pub fn energy(&self, r: [f64; 3], v: [f64; 3]) -> f64 {
        let kinetic = 0.5 * v.iter().map(|c| c * c).sum::<f64>();
        kinetic
            + match self {
                Self::Flat(flat) => flat.potential(-r[2]),
                Self::Ellipsoid(earth) => {
                    let turning = 0.5 * earth.rotation_rate.powi(2) * (r[0] * r[0] + r[1] * r[1]);
                    -earth.potential(r) - turning
                }
            }
    }
}

/// A horizontal wind by height: shape-preserving cubics, constant beyond the ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    north: Pchip,
    east: Pchip,
}

impl Wind {
    /// Velocity of the air (m/s) towards north and towards east at heights (m) that increase, at least two.
    ///
    /// # Errors
    /// When a number is not finite, a height not above the one before it, or the columns differ in length.
    pub fn new(altitudes: &[f64], north: &[f64], east: &[f64]) -> Result<Self, DynamicsError> {
        increasing("altitude", altitudes)?;
        finite_column("wind to the north", north, altitudes.len())?;
        finite_column("wind to the east", east, altitudes.len())?;
        let table = |values: &[f64]| {
            Pchip::new(altitudes, values, Outside::Constant)
                .map_err(|_| short("altitude", altitudes.len(), 2))
        };
        Ok(Self { north: table(north)?, east: table(east)? })
    }

    /// Velocity of the air towards north and east, m/s, at a height (m).
    #[inline]
    pub fn at<S: Scalar>(&self, altitude: S) -> [S; 2] {
        [self.north.at(altitude), self.east.at(altitude)]
    }
}
