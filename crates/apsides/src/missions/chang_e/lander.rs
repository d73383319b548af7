//! The vehicle, its orbit and its gate.

use apsides_dynamics::gravity::{MOON_C22, MOON_J2, MOON_REFERENCE_RADIUS};
use apsides_dynamics::great_circle::destination;
use apsides_dynamics::planar::PlanarFlight;
use apsides_dynamics::powered_descent::{MOON_ROTATION_RATE, PoweredDescent};
use apsides_dynamics::{Body, DynamicsError, Engine, GravityField};

use super::keys;
use crate::key::Values;

/// Whether the flight is in one plane or over the rotating Moon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Plane,
    Space,
}

/// Direction of the velocity at the gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GateDirection {
    Free,
    Down,
    Horizontal,
}

/// Whether all phases are optimised together, or one stage after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Joint,
    Stages,
}

/// A flight from above one place to above another, in the vertical plane through both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Divert {
    /// Longitude and latitude of the start.
    pub(super) from: [f64; 2],
    /// Course there, from north towards east.
    pub(super) course: f64,
    /// Angle at the centre.
    pub(super) angle: f64,
    /// Longitude and latitude of the end.
    pub(super) to: [f64; 2],
    /// Height of the ground at the end above that at the start, m.
    pub(super) rise: f64,
    /// Largest tilt of the thrust on the way.
    pub(super) tilt: f64,
}

impl Divert {
    /// To a site east, north and up (m) of the ground at the start, on a sphere of a radius (m); open coordinates count as zero.
    fn new(from: [f64; 2], site: [f64; 3], radius: f64, tilt: f64) -> Self {
        let [east, north, rise] = site.map(|c| if c.is_finite() { c } else { 0.0 });
        let (course, angle) = (east.atan2(north), east.hypot(north) / radius);
        Self { from, course, angle, to: destination(from, course, angle), rise, tilt }
    }

    /// Whether there is a way to go.
    pub(super) fn is_needed(&self) -> bool {
        self.angle > 0.0
    }
}

/// Everything that the file says, in SI units and rad.
#[derive(Clone, Debug)]
pub(super) struct Lander {
    pub(super) body: Body,
    pub(super) descent: PoweredDescent,
    /// Least thrust by the largest.
    pub(super) least_throttle: f64,
    pub(super) initial_mass: f64,
    pub(super) dry_mass: f64,
    pub(super) motion: Motion,
    pub(super) perilune_radius: f64,
    pub(super) apolune_radius: f64,
    /// Speed at the start in inertial space.
    pub(super) start_speed: f64,
    pub(super) azimuth: f64,
    /// Longitude and latitude of the site that is aimed at from the orbit.
    pub(super) site: [f64; 2],
    /// From above that site to the coarse one, and from there to the landing site; of no length without maps.
    pub(super) coarse_divert: Divert,
    pub(super) fine_divert: Divert,
    /// Velocity at the gate where it is decided: upwards, to the east (in the plane not used), to the north (in the plane forward).
    pub(super) gate_velocity: Option<[f64; 3]>,
    /// Upward speed at the end of the adjustment where it is decided.
    pub(super) adjusted_speed: Option<f64>,
    pub(super) gate_radius: f64,
    pub(super) gate_speed: f64,
    pub(super) gate_direction: GateDirection,
    pub(super) order: Order,
    /// Largest tilt of the thrust from the vertical in the adjustment.
    pub(super) adjustment_tilt: f64,
    /// Propellant that a metre of path in the adjustment counts as, kg/m.
    pub(super) path_weight: f64,
    /// Where the coarse avoidance begins, where it hovers, where the fine one ends, where the engine is cut off: altitudes above the ground
    /// at the site of each.
    pub(super) coarse_radius: f64,
    pub(super) hover_radius: f64,
    pub(super) fine_radius: f64,
    pub(super) cutoff_radius: f64,
    pub(super) hover_time: f64,
}

impl Lander {
    /// # Errors
    /// Values that do not go together, in words.
    pub(super) fn of(v: &Values) -> Result<Self, String> {
        let text = |e: DynamicsError| e.to_string();
        let radius = v.number(keys::RADIUS) * 1e3 + v.number(keys::SITE_ALTITUDE);
        let body = Body::new(v.number(keys::MU) * 1e9, radius).map_err(text)?;
        let (least, thrust) = (v.number(keys::LEAST_THRUST), v.number(keys::THRUST));
        if least >= thrust {
            return Err(format!(
                "`{}` is {least}, it must be below `{}` = {thrust}",
                keys::LEAST_THRUST,
                keys::THRUST
            ));
        }
        let engine = Engine::with_exhaust_velocity(thrust, v.number(keys::EXHAUST_VELOCITY)).map_err(text)?;
        let motion = if v.word(keys::MOTION) == keys::PLANE { Motion::Plane } else { Motion::Space };
        let gravity = if v.word(keys::GRAVITY) == keys::SECOND_DEGREE {
            GravityField::second_degree(body, MOON_REFERENCE_RADIUS, MOON_J2, MOON_C22).map_err(text)?
        } else {
            GravityField::central(body)
        };
        let site = [v.number(keys::SITE_LONGITUDE).to_radians(), v.number(keys::SITE_LATITUDE).to_radians()];
        let tilt = |limit: &str| v.number(limit).to_radians();
        let place = |path: [&str; 3]| path.map(|key| v.number(key));
        let coarse = Divert::new(site, place(keys::COARSE_SITE), radius, tilt(keys::COARSE_TILT));
        let fine = Divert::new(coarse.to, place(keys::FINE_SITE), radius, tilt(keys::FINE_TILT));
        let gate_velocity = place(keys::GATE_VELOCITY);
        let rotation = if v.flag(keys::ROTATION) { MOON_ROTATION_RATE } else { 0.0 };
        let ground = body.radius + coarse.rise + fine.rise;
        let lander = Self {
            body,
            descent: PoweredDescent::new(gravity, rotation, engine).map_err(text)?,
            least_throttle: least / thrust,
            initial_mass: v.number(keys::INITIAL_MASS),
            dry_mass: v.number(keys::DRY_MASS),
            motion,
            perilune_radius: body.radius + v.number(keys::PERILUNE) * 1e3,
            apolune_radius: body.radius + v.number(keys::APOLUNE) * 1e3,
            start_speed: v.number(keys::SPEED),
            azimuth: v.number(keys::AZIMUTH).to_radians(),
            site,
            coarse_divert: coarse,
            fine_divert: fine,
            gate_velocity: gate_velocity.iter().all(|v| v.is_finite()).then_some(gate_velocity),
            adjusted_speed: Some(v.number(keys::ADJUSTED_SPEED)).filter(|v| v.is_finite()),
            gate_radius: body.radius + v.number(keys::GATE_ALTITUDE) * 1e3,
            gate_speed: v.number(keys::GATE_SPEED),
            gate_direction: match v.word(keys::GATE_DIRECTION) {
                keys::DOWN => GateDirection::Down,
                keys::HORIZONTAL => GateDirection::Horizontal,
                _ => GateDirection::Free,
            },
            order: if v.word(keys::ORDER) == keys::STAGES { Order::Stages } else { Order::Joint },
            path_weight: v.number(keys::PATH_WEIGHT),
            adjustment_tilt: v.number(keys::ADJUSTMENT_TILT).to_radians(),
            coarse_radius: body.radius + v.number(keys::COARSE_ALTITUDE) * 1e3,
            hover_radius: body.radius + coarse.rise + v.number(keys::HOVER_ALTITUDE),
            fine_radius: ground + v.number(keys::FINE_ALTITUDE),
            cutoff_radius: ground + v.number(keys::CUTOFF_ALTITUDE),
            hover_time: v.number(keys::HOVER_TIME),
        };
        let start_speed =
            if lander.start_speed.is_finite() { lander.start_speed } else { lander.orbit_speeds()[0] };
        let lander = Self { start_speed, ..lander };
        lander.check()?;
        Ok(lander)
    }

    /// The same with gates that follow each other downwards.
    ///
    /// # Errors
    /// Values that do not go together, in words.
    pub(super) fn of_landing(v: &Values) -> Result<Self, String> {
        let lander = Self::of(v)?;
        let gates = [
            (keys::GATE_ALTITUDE, 1e3),
            (keys::COARSE_ALTITUDE, 1e3),
            (keys::HOVER_ALTITUDE, 1.0),
            (keys::FINE_ALTITUDE, 1.0),
            (keys::CUTOFF_ALTITUDE, 1.0),
        ]
        .map(|(key, unit)| (key, unit * v.number(key)));
        for pair in gates.windows(2) {
            let [(above, high), (below, low)] = [pair[0], pair[1]];
            if low >= high {
                return Err(format!(
                    "`{below}` is {}, it must be below `{above}` = {}",
                    v.number(below),
                    v.number(above)
                ));
            }
        }
        if lander.hover_radius >= lander.coarse_radius || lander.fine_radius >= lander.hover_radius {
            return Err(format!(
                "the ground at the site is {:.1} m above the one aimed at, too high for `{}` = {} and `{}` = {}; choose a lower site",
                lander.coarse_divert.rise + lander.fine_divert.rise,
                keys::COARSE_ALTITUDE,
                v.number(keys::COARSE_ALTITUDE),
                keys::HOVER_ALTITUDE,
                v.number(keys::HOVER_ALTITUDE)
            ));
        }
        let maps = [keys::COARSE_MAP, keys::FINE_MAP];
        if let Some(key) = maps.into_iter().find(|k| v.word(k) != keys::NO_MAP)
            && lander.motion == Motion::Plane
        {
            return Err(format!(
                "`{key}` needs `{}` = \"{}\": a site lies beside the plane",
                keys::MOTION,
                keys::SPACE
            ));
        }
        Ok(lander)
    }

    /// What no flight can mend.
    fn check(&self) -> Result<(), String> {
        let km = |r: f64| (r - self.body.radius) / 1e3;
        if self.perilune_radius > self.apolune_radius {
            return Err(format!(
                "`{}` is {}, it must not be above `{}` = {}",
                keys::PERILUNE,
                km(self.perilune_radius),
                keys::APOLUNE,
                km(self.apolune_radius)
            ));
        }
        if self.gate_radius >= self.perilune_radius {
            return Err(format!(
                "`{}` is {}, it must be below the perilune (`{}` = {})",
                keys::GATE_ALTITUDE,
                km(self.gate_radius),
                keys::PERILUNE,
                km(self.perilune_radius)
            ));
        }
        if self.dry_mass >= self.initial_mass {
            return Err(format!(
                "`{}` is {}, it must be below `{}` = {}",
                keys::DRY_MASS,
                self.dry_mass,
                keys::INITIAL_MASS,
                self.initial_mass
            ));
        }
        let (engine, weight) = (self.descent.engine, self.dry_mass * self.body.surface_gravity());
        if engine.thrust <= weight {
            return Err(format!(
                "`{}` is {}, it cannot stop the vehicle: even empty (`{}` = {}) it weighs {weight:.1} N on the surface; \
                 raise the thrust or reduce the dry mass",
                keys::THRUST,
                engine.thrust,
                keys::DRY_MASS,
                self.dry_mass
            ));
        }
        let available = engine.velocity_change(self.initial_mass, self.dry_mass);
        let needed = self.start_speed - self.gate_speed;
        if available <= needed {
            return Err(format!(
                "the propellant gives {available:.1} m/s down to `{}` = {}, but {needed:.1} m/s must be braked; raise \
                 `{}` or `{}` or reduce the dry mass",
                keys::DRY_MASS,
                self.dry_mass,
                keys::EXHAUST_VELOCITY,
                keys::INITIAL_MASS
            ));
        }
        Ok(())
    }

    pub(super) fn planar(&self) -> PlanarFlight {
        PlanarFlight::new(self.body, self.descent.engine)
    }

    /// Speeds of the orbit at its perilune and apolune, m/s.
    pub(super) fn orbit_speeds(&self) -> [f64; 2] {
        let axis = 0.5 * (self.perilune_radius + self.apolune_radius);
        [self.perilune_radius, self.apolune_radius].map(|r| self.body.orbital_speed(r, axis))
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
