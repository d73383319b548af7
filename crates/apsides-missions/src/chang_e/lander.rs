//! The vehicle, its orbit, its site and its gate.

use apsides_dynamics::gravity::{MOON_C22, MOON_J2, MOON_REFERENCE_RADIUS};
use apsides_dynamics::planar::PlanarFlight;
use apsides_dynamics::powered_descent::PoweredDescent;
use apsides_dynamics::{Body, Engine, GravityField};
use apsides_pipeline::Error;
use apsides_pipeline::values::Values;

use super::keys;
use crate::data::{BODY_RADIUS, ROTATION_RATE, central_body};

/// The space that a flight is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// The plane of the orbit over a Moon that does not rotate, in polar coordinates.
    Plane,
    /// Three dimensions over the rotating Moon, in spherical coordinates fixed to it.
    Space,
}

/// Direction of the velocity at the gate, relative to the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GateDirection {
    /// Any direction.
    Free,
    /// Straight down.
    Down,
    /// Along the local horizontal, in any direction of it.
    Horizontal,
}

/// The lander on its orbit, the site that it aims at and the gate above it, in SI units and rad.
///
/// Distances from the centre and longitudes, latitudes are in axes that rotate with the Moon; altitudes count from the site.
#[derive(Clone, Debug)]
pub struct Lander {
    /// The Moon; its radius is the distance of the site from its centre.
    pub body: Body,
    /// Gravity, rotation and engine.
    pub descent: PoweredDescent,
    /// Least thrust of the engine, which stays on, by the largest.
    pub least_throttle: f64,
    /// Mass at the perilune, kg.
    pub initial_mass: f64,
    /// Mass without propellant, kg.
    pub dry_mass: f64,
    /// The space that the flight is in.
    pub motion: Motion,
    /// Distance of the perilune from the centre, m.
    pub perilune_radius: f64,
    /// Distance of the apolune from the centre, m.
    pub apolune_radius: f64,
    /// Speed at the perilune in inertial space, m/s.
    pub start_speed: f64,
    /// Direction of the inertial velocity at the perilune, rad from north towards east.
    pub azimuth: f64,
    /// Longitude and latitude of the site that is aimed at from the orbit, rad.
    pub site: [f64; 2],
    /// Distance of the gate from the centre, m.
    pub gate_radius: f64,
    /// Speed at the gate relative to the ground, m/s.
    pub gate_speed: f64,
    /// Direction of the velocity there.
    pub gate_direction: GateDirection,
    /// Velocity at the gate where it is decided, m/s: upwards, to the east (in the plane not used) and to the north (in the plane
    /// forward).
    pub gate_velocity: Option<[f64; 3]>,
}

impl Lander {
    /// The lander of values; its velocity at the gate is not decided.
    ///
    /// # Errors
    /// Values that do not go together, and what no flight can mend.
    pub fn read(values: &Values) -> Result<Self, Error> {
        let number = |path| values.number(path);
        let sphere = central_body(values)?;
        let radius = sphere.radius + number(keys::SITE_ALTITUDE)?;
        let body = Body::new(sphere.gravitational_parameter, radius)
            .map_err(values.refusal(&[keys::SITE_ALTITUDE, BODY_RADIUS]))?;
        let (least, thrust) = (number(keys::LEAST_THRUST)?, number(keys::THRUST)?);
        if least >= thrust {
            return Err(values.conflict(format!(
                "`{}` is {least}, it must be below `{}` = {thrust}",
                keys::LEAST_THRUST,
                keys::THRUST
            )));
        }
        let engine =
            Engine::new(thrust, number(keys::ISP)?).map_err(values.refusal(&[keys::ISP, keys::THRUST]))?;
        let motion = if values.word(keys::MOTION)? == keys::PLANE { Motion::Plane } else { Motion::Space };
        let gravity = if values.word(keys::GRAVITY)? == keys::SECOND_DEGREE {
            GravityField::second_degree(body, MOON_REFERENCE_RADIUS, MOON_J2, MOON_C22)
                .map_err(values.refusal(&[keys::GRAVITY, BODY_RADIUS]))?
        } else {
            GravityField::central(body)
        };
        let rotation = if values.flag(keys::ROTATION)? { values.number(&ROTATION_RATE.path)? } else { 0.0 };
        if values.limit(keys::SPEED)?.is_some() {
            let instead = format!("set `{}` to inf, the speed of the orbit, too", keys::SPEED);
            values.refuse_without_effect(&[keys::APOLUNE], keys::SPEED, &instead)?;
        }
        let [perilune_radius, apolune_radius] =
            [number(keys::PERILUNE)?, number(keys::APOLUNE)?].map(|altitude| body.radius + altitude * 1e3);
        let of_orbit = orbit_speeds(body, [perilune_radius, apolune_radius]);
        let lander = Self {
            body,
            descent: PoweredDescent::new(gravity, rotation, engine)
                .map_err(values.refusal(&[&ROTATION_RATE.path]))?,
            least_throttle: least / thrust,
            initial_mass: number(keys::INITIAL_MASS)?,
            dry_mass: number(keys::DRY_MASS)?,
            motion,
            perilune_radius,
            apolune_radius,
            start_speed: values.limit(keys::SPEED)?.unwrap_or(of_orbit[0]),
            azimuth: number(keys::AZIMUTH)?.to_radians(),
            site: [number(keys::SITE_LONGITUDE)?, number(keys::SITE_LATITUDE)?].map(f64::to_radians),
            gate_radius: body.radius + number(keys::GATE_ALTITUDE)? * 1e3,
            gate_speed: number(keys::GATE_SPEED)?,
            gate_direction: match values.word(keys::GATE_DIRECTION)? {
                keys::DOWN => GateDirection::Down,
                keys::HORIZONTAL => GateDirection::Horizontal,
                _ => GateDirection::Free,
            },
            gate_velocity: None,
        };
        lander.check(values)?;
        Ok(lander)
    }

    /// Refuses what no flight can mend.
    fn check(&self, values: &Values) -> Result<(), Error> {
        let km = |r: f64| (r - self.body.radius) / 1e3;
        if self.perilune_radius > self.apolune_radius {
            return Err(values.conflict(format!(
                "`{}` is {}, it must not be above `{}` = {}",
                keys::PERILUNE,
                km(self.perilune_radius),
                keys::APOLUNE,
                km(self.apolune_radius)
            )));
        }
        if self.gate_radius >= self.perilune_radius {
            return Err(values.conflict(format!(
                "`{}` is {}, it must be below the perilune (`{}` = {})",
                keys::GATE_ALTITUDE,
                km(self.gate_radius),
                keys::PERILUNE,
                km(self.perilune_radius)
            )));
        }
        if self.dry_mass >= self.initial_mass {
            return Err(values.conflict(format!(
                "`{}` is {}, it must be below `{}` = {}",
                keys::DRY_MASS,
                self.dry_mass,
                keys::INITIAL_MASS,
                self.initial_mass
            )));
        }
        let (engine, weight) = (self.descent.engine, self.dry_mass * self.body.surface_gravity());
        if engine.thrust <= weight {
            return Err(values.conflict(format!(
                "`{}` is {}, it cannot stop the vehicle: even empty (`{}` = {}) it weighs {weight:.1} N on the surface; \
                 raise the thrust or reduce the dry mass",
                keys::THRUST,
                engine.thrust,
                keys::DRY_MASS,
                self.dry_mass
            )));
        }
        let available = engine.velocity_change(self.initial_mass, self.dry_mass);
        let needed = self.start_speed - self.gate_speed;
        if available <= needed {
            return Err(values.conflict(format!(
                "the propellant gives {available:.1} m/s down to `{}` = {}, but {needed:.1} m/s must be braked; raise \
                 `{}` or `{}` or reduce the dry mass",
                keys::DRY_MASS,
                self.dry_mass,
                keys::ISP,
                keys::INITIAL_MASS
            )));
        }
        Ok(())
    }

    /// The same flight in the plane of the orbit.
    pub(super) fn planar(&self) -> PlanarFlight {
        PlanarFlight::new(self.body, self.descent.engine)
    }

    /// Speeds of the orbit at its perilune and apolune, m/s.
    #[must_use]
    pub fn orbit_speeds(&self) -> [f64; 2] {
        orbit_speeds(self.body, [self.perilune_radius, self.apolune_radius])
    }

    /// Gravity with its centrifugal part (m/s2) and the rotation of the axes (rad/s) at a distance from the centre above a place, as they are
    /// taken all along a short flight; to the east, to the north and upwards.
    pub(super) fn uniform_field(&self, radius: f64, [longitude, latitude]: [f64; 2]) -> ([f64; 3], [f64; 3]) {
        let [up, east, north] = self.descent.gravity.acceleration(radius, longitude, latitude);
        let (sin, cos) = latitude.sin_cos();
        let turn = self.descent.rotation_rate;
        let centrifugal = radius * turn * turn * cos;
        let gravity = [east, north - centrifugal * sin, up + centrifugal * cos];
        (gravity, [0.0, turn * cos, turn * sin])
    }

    /// Time to burn the whole mass with the least thrust, s: above any braking.
    pub(super) fn longest_burn(&self) -> f64 {
        let least = self.least_throttle.max(0.05);
        self.initial_mass / (self.descent.engine.mass_flow() * least)
    }

    /// Expected time of the main braking, s: the rocket equation at full thrust with a twentieth of losses.
    pub(super) fn expected_braking(&self) -> f64 {
        let engine = self.descent.engine;
        let burnt = self.initial_mass
            - engine.mass_after(self.initial_mass, 1.05 * (self.start_speed - self.gate_speed));
        burnt / engine.mass_flow()
    }
}

/// Speeds at both ends of an ellipse, m/s, from their distances from the centre.
fn orbit_speeds(body: Body, radii: [f64; 2]) -> [f64; 2] {
    let axis = 0.5 * (radii[0] + radii[1]);
    radii.map(|r| body.orbital_speed(r, axis))
}
