//! Flight without thrust through the atmosphere of a rotating planet, in spherical coordinates that rotate with it.
//!
//! With the distance `r` from the centre, the geocentric latitude `lat`, the speed `v` relative to the planet, the flight path angle `g`
//! from the local horizontal, positive up, the azimuth `psi` from north, clockwise, and the bank angle `b`:
//!
//! ```text
//! h'   = v sin g
//! lon' = v cos g sin psi / (r cos lat)
//! lat' = v cos g cos psi / r
//! v'   = -D/m - g_r sin g + g_n cos g cos psi + w^2 r cos lat (sin g cos lat - cos g sin lat cos psi)
//! g'   = (L cos b / m - g_r cos g - g_n sin g cos psi) / v + v cos g / r + 2 w cos lat sin psi
//!        + w^2 r cos lat (cos g cos lat + sin g sin lat cos psi) / v
//! psi' = (L sin b / m - g_n sin psi) / (v cos g) + v cos g sin psi tan lat / r
//!        - 2 w (tan g cos lat cos psi - sin lat) + w^2 r sin lat cos lat sin psi / (v cos g)
//! ```
//!
//! (N. X. Vinh, A. Busemann and R. D. Culp, Hypersonic and Planetary Entry Flight Mechanics, 1980, chapter 2; A. Alami Naeini and
//! J. Roshanian, Modares Mechanical Engineering 14(13), 2014, eq. 23.) `g_r` is gravity towards the centre and `g_n` its component
//! towards north, zero for a sphere. Altitudes are above the sphere of the body's radius.
//!
//! The azimuth may as well count [from east, towards north](Heading::FromEast), as in the second source. A positive bank turns the flight
//! towards larger azimuths in both conventions: to the right from north, to the left from east.
//!
//! The equations are singular at the poles, in vertical flight and at rest.
//!
//! ```
//! use apsides_ad::{Dynamics, PathFunction};
//! use apsides_dynamics::aerodynamics::MachTable;
//! use apsides_dynamics::entry::{Banked, EntryFlight, EntryLoads, Heading};
//! use apsides_dynamics::{Aerodynamics, Atmosphere, EntryVehicle, HeatingLaw, Planet};
//!
//! let aerodynamics = Aerodynamics::Mach(MachTable::apollo_10());
//! let capsule = EntryVehicle::new(2800.0, 6.1575, 3.36, aerodynamics)?;
//! let planet = Planet::earth(Atmosphere::UsStandard1976);
//! let model = Banked(EntryFlight::new(planet, capsule, Heading::FromNorth, HeatingLaw::CAPSULE));
//! let state = [60e3, 0.9, 0.5, 6800.0, -0.04, 2.3]; // altitude, longitude, latitude, speed, flight path angle, azimuth
//! let bank = [0.8];
//! let rate = model.rate(0.0, &state, &bank, &[]);
//! let [pressure, acceleration, heat_rate] = EntryLoads(model).evaluate(0.0, &state, &bank, &[]);
//! assert!(rate[3] < 0.0 && pressure > 7e3 && acceleration > 20.0 && heat_rate > 600e3);
//! # Ok::<(), apsides_dynamics::DynamicsError>(())
//! ```

use apsides_ad::{Dynamics, PathFunction, Scalar};

use crate::aerodynamics::EntryVehicle;
use crate::atmosphere::Atmosphere;
use crate::heating::HeatingLaw;
use crate::planet::Planet;
use crate::{DynamicsError, Quantity};

pub use crate::aerodynamics::ATTACK;

/// Height above the sphere of the body's radius.
pub const ALTITUDE: Quantity = Quantity::new("altitude", "m");
/// Longitude, positive eastwards, on the rotating planet.
pub const LONGITUDE: Quantity = Quantity::new("longitude", "rad");
/// Geocentric latitude.
pub const LATITUDE: Quantity = Quantity::new("latitude", "rad");
/// Speed relative to the rotating planet.
pub const SPEED: Quantity = Quantity::new("speed", "m/s");
/// Angle of the velocity above the local horizontal.
pub const FLIGHT_PATH_ANGLE: Quantity = Quantity::new("flight path angle", "rad");
/// Direction of the velocity in the local horizontal; see [`Heading`].
pub const AZIMUTH: Quantity = Quantity::new("azimuth", "rad");
/// Rotation of the lift about the velocity: zero upwards, positive towards larger azimuths.
pub const BANK: Quantity = Quantity::new("bank angle", "rad");
/// Cosine of the bank angle: the part of the lift in the vertical plane.
pub const BANK_COSINE: Quantity = Quantity::new("cosine of bank", "-");
/// Sine of the bank angle: the part of the lift across the vertical plane.
pub const BANK_SINE: Quantity = Quantity::new("sine of bank", "-");
/// Dynamic pressure.
pub const DYNAMIC_PRESSURE: Quantity = Quantity::new("dynamic pressure", "Pa");
/// Aerodynamic force by mass.
pub const AERODYNAMIC_ACCELERATION: Quantity = Quantity::new("aerodynamic acceleration", "m/s2");
/// Aerodynamic force across the body's axis by mass.
pub const NORMAL_ACCELERATION: Quantity = Quantity::new("normal acceleration", "m/s2");

/// States of all models.
pub const STATES: [Quantity; 6] = [ALTITUDE, LONGITUDE, LATITUDE, SPEED, FLIGHT_PATH_ANGLE, AZIMUTH];

/// A state of all models by name, in the order of [`STATES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EntryState {
    /// Height above the sphere of the body's radius, m.
    pub altitude: f64,
    /// Longitude on the rotating planet, positive eastwards, rad.
    pub longitude: f64,
    /// Geocentric latitude, rad.
    pub latitude: f64,
    /// Speed relative to the rotating planet, m/s.
    pub speed: f64,
    /// Angle of the velocity above the local horizontal, rad.
    pub path_angle: f64,
    /// Direction of the velocity in the local horizontal, rad; see [`Heading`].
    pub azimuth: f64,
}

impl EntryState {
    /// The state as an array.
    #[must_use]
    pub fn array(&self) -> [f64; 6] {
        [self.altitude, self.longitude, self.latitude, self.speed, self.path_angle, self.azimuth]
    }

    /// Longitude and latitude, rad.
    #[must_use]
    pub fn place(&self) -> [f64; 2] {
        [self.longitude, self.latitude]
    }
}

impl From<[f64; 6]> for EntryState {
    fn from([altitude, longitude, latitude, speed, path_angle, azimuth]: [f64; 6]) -> Self {
        Self { altitude, longitude, latitude, speed, path_angle, azimuth }
    }
}

/// The direction that the azimuth counts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heading {
    /// From north, clockwise: east is 90 deg.
    #[default]
    FromNorth,
    /// From east, towards north: north is 90 deg.
    FromEast,
}

impl Heading {
    /// The azimuth (rad) in this convention of a course from north, clockwise (rad). It is its own inverse.
    #[must_use]
    pub fn of_course(self, course: f64) -> f64 {
        match self {
            Self::FromNorth => course,
            Self::FromEast => std::f64::consts::FRAC_PI_2 - course,
        }
    }

    /// Components towards east and north of the unit vector at an azimuth.
    #[inline]
    fn components<S: Scalar>(self, azimuth: S) -> (S, S) {
        let (sin, cos) = azimuth.sin_cos();
        match self {
            Self::FromNorth => (sin, cos),
            Self::FromEast => (cos, sin),
        }
    }
}

/// A planet, a vehicle and a law of heating: what the equations of motion and the loads need to know.
#[derive(Clone, Debug, PartialEq)]
pub struct EntryFlight {
    /// The planet with its atmosphere.
    pub planet: Planet,
    /// The vehicle.
    pub vehicle: EntryVehicle,
    /// The direction that the azimuth counts from.
    pub heading: Heading,
    /// The law of heating.
    pub heating: HeatingLaw,
}

/// Aerodynamic forces by mass, m/s2, before the lift is turned.
#[derive(Clone, Copy, Debug)]
struct Forces<S> {
    lift: S,
    drag: S,
}

impl EntryFlight {
    /// Flight of a vehicle on a planet.
    #[must_use]
    pub fn new(planet: Planet, vehicle: EntryVehicle, heading: Heading, heating: HeatingLaw) -> Self {
        Self { planet, vehicle, heading, heating }
    }

    /// Passes a state on from which the equations of motion can start.
    ///
    /// # Errors
    /// When a number is not finite, the altitude is below the surface, the speed is not positive, or the state is at a pole or flies
    /// vertically.
    pub fn checked(&self, state: [f64; 6]) -> Result<[f64; 6], DynamicsError> {
        for (quantity, value) in STATES.iter().zip(state) {
            crate::error::finite(quantity.name, value, quantity.unit)?;
        }
        self.planet.above_surface(ALTITUDE.name, state[0])?;
        crate::error::positive(SPEED.name, state[3], SPEED.unit)?;
        for (quantity, value) in [(LATITUDE, state[2]), (FLIGHT_PATH_ANGLE, state[4])] {
            if value.abs() >= std::f64::consts::FRAC_PI_2 {
                let allowed = "between -pi/2 and pi/2, both excluded";
                let (what, unit) = (quantity.name, quantity.unit);
                return Err(DynamicsError::Parameter { what, value, unit, allowed });
            }
        }
        Ok(state)
    }

    /// Dynamic pressure, Pa, at an altitude (m) and a speed (m/s).
    #[inline]
    pub fn dynamic_pressure<S: Scalar>(&self, altitude: S, speed: S) -> S {
        self.planet.atmosphere.density(altitude) * speed.square() * 0.5
    }

    /// Heat rate, W/m2, at an altitude (m) and a speed (m/s).
    #[inline]
    pub fn heat_rate<S: Scalar>(&self, altitude: S, speed: S) -> S {
        self.heat_rate_at(self.planet.atmosphere.density(altitude), speed)
    }

    /// The same at a density (kg/m3). A vacuum is left out, where the square root has no derivative.
    #[inline]
    fn heat_rate_at<S: Scalar>(&self, density: S, speed: S) -> S {
        if self.in_vacuum() {
            return S::from(0.0);
        }
        self.heating.rate(density, speed, self.vehicle.nose_radius)
    }

    #[inline]
    fn in_vacuum(&self) -> bool {
        matches!(self.planet.atmosphere, Atmosphere::Vacuum)
    }

    /// Mach number at an altitude (m) and a speed (m/s).
    #[inline]
    pub fn mach<S: Scalar>(&self, altitude: S, speed: S) -> S {
        speed / self.planet.atmosphere.speed_of_sound(altitude)
    }

    /// Coefficients of lift and drag in flight.
    #[inline]
    fn coefficients<S: Scalar>(&self, altitude: S, speed: S, attack: S) -> [S; 2] {
        let aerodynamics = &self.vehicle.aerodynamics;
        let mach = if aerodynamics.depends_on_mach() { self.mach(altitude, speed) } else { S::from(0.0) };
        aerodynamics.coefficients(mach, attack)
    }

    /// Lift and drag by mass.
    #[inline]
    fn forces<S: Scalar>(&self, altitude: S, speed: S, attack: S) -> Forces<S> {
        if self.in_vacuum() {
            return Forces { lift: S::from(0.0), drag: S::from(0.0) };
        }
        let size = self.planet.atmosphere.density(altitude)
            * speed.square()
            * (0.5 * self.vehicle.reference_area / self.vehicle.mass);
        let [lift, drag] = self.coefficients(altitude, speed, attack);
        Forces { lift: size * lift, drag: size * drag }
    }

    /// The equations of motion with the lift in the vertical plane, across it towards larger azimuths, and the drag, by mass.
    #[inline]
    fn rate<S: Scalar>(&self, x: &[S; 6], lift_up: S, lift_across: S, drag: S) -> [S; 6] {
        let [altitude, _, latitude, v, gamma, azimuth] = *x;
        let r = altitude + self.planet.body.radius;
        let (sin_gamma, cos_gamma) = gamma.sin_cos();
        let (sin_latitude, cos_latitude) = latitude.sin_cos();
        let (east, north) = self.heading.components(azimuth);
        let (down, northward) = self.planet.gravity(r, sin_latitude, cos_latitude);
        // Accelerations along the velocity, upwards across it, and to the right.
        let mut along = -drag - down * sin_gamma;
        let mut up = lift_up - down * cos_gamma;
        let mut right = S::from(0.0);
        if let Some(northward) = northward {
            let forward = northward * north;
            along += forward * cos_gamma;
            up -= forward * sin_gamma;
            right -= northward * east;
        }
        let angular_rate = v / r * cos_gamma;
        let meridian_rate = angular_rate * north;
        let longitude_rate = angular_rate * east / cos_latitude;
        let mut pitch_rate = angular_rate;
        let mut course_rate = longitude_rate * sin_latitude;
        let w = self.planet.rotation_rate;
        if w != 0.0 {
            let centrifugal = r * cos_latitude * (w * w);
            let (outward, towards_pole) = (centrifugal * cos_latitude, centrifugal * sin_latitude);
            along += outward * sin_gamma - towards_pole * cos_gamma * north;
            up += outward * cos_gamma + towards_pole * sin_gamma * north;
            right += towards_pole * east;
            pitch_rate += cos_latitude * east * (2.0 * w);
            course_rate += (sin_latitude - sin_gamma / cos_gamma * cos_latitude * north) * (2.0 * w);
        }
        let across = v * cos_gamma;
        let azimuth_rate = match self.heading {
            Heading::FromNorth => (lift_across + right) / across + course_rate,
            Heading::FromEast => (lift_across - right) / across - course_rate,
        };
        [v * sin_gamma, longitude_rate, meridian_rate, along, up / v + pitch_rate, azimuth_rate]
    }
}

/// The steering of a model: what the loads need to know of its controls.
pub trait EntryModel<const NU: usize>: Dynamics<6, NU> {
    /// The flight.
    fn flight(&self) -> &EntryFlight;

    /// Angle of attack, rad.
    fn attack<S: Scalar>(&self, u: &[S; NU]) -> S;

    /// Parts of the lift in the vertical plane and across it.
    fn lift_direction<S: Scalar>(&self, u: &[S; NU]) -> (S, S);

    /// The equations of motion.
    #[inline]
    fn motion<S: Scalar>(&self, x: &[S; 6], u: &[S; NU]) -> [S; 6] {
        let Forces { lift, drag } = self.flight().forces(x[0], x[3], self.attack(u));
        let (up, across) = self.lift_direction(u);
        self.flight().rate(x, lift * up, lift * across, drag)
    }
}

/// The vehicle's own angle of attack; control: bank angle (rad).
#[derive(Clone, Debug, PartialEq)]
pub struct Banked(pub EntryFlight);

/// The vehicle's own angle of attack; controls: cosine and sine of the bank angle, whose squares are to add up to one
/// ([`BankVectorNorm`]). Free of the ambiguity of the angle.
#[derive(Clone, Debug, PartialEq)]
pub struct BankVector(pub EntryFlight);

/// Controls: bank angle and angle of attack (rad).
#[derive(Clone, Debug, PartialEq)]
pub struct BankedAtAttack(pub EntryFlight);

impl EntryModel<1> for Banked {
    fn flight(&self) -> &EntryFlight {
        &self.0
    }

    #[inline]
    fn attack<S: Scalar>(&self, _u: &[S; 1]) -> S {
        S::from(self.0.vehicle.attack)
    }

    #[inline]
    fn lift_direction<S: Scalar>(&self, u: &[S; 1]) -> (S, S) {
        let (sin, cos) = u[0].sin_cos();
        (cos, sin)
    }
}

impl EntryModel<2> for BankVector {
    fn flight(&self) -> &EntryFlight {
        &self.0
    }

    #[inline]
    fn attack<S: Scalar>(&self, _u: &[S; 2]) -> S {
        S::from(self.0.vehicle.attack)
    }

    #[inline]
    fn lift_direction<S: Scalar>(&self, u: &[S; 2]) -> (S, S) {
        (u[0], u[1])
    }
}

impl EntryModel<2> for BankedAtAttack {
    fn flight(&self) -> &EntryFlight {
        &self.0
    }

    #[inline]
    fn attack<S: Scalar>(&self, u: &[S; 2]) -> S {
        u[1]
    }

    #[inline]
    fn lift_direction<S: Scalar>(&self, u: &[S; 2]) -> (S, S) {
        let (sin, cos) = u[0].sin_cos();
        (cos, sin)
    }
}

impl Dynamics<6, 1> for Banked {
    #[inline]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 1], _p: &[S; 0]) -> [S; 6] {
        self.motion(x, u)
    }
}

impl Dynamics<6, 2> for BankVector {
    #[inline]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 6] {
        self.motion(x, u)
    }
}

impl Dynamics<6, 2> for BankedAtAttack {
    #[inline]
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 6] {
        self.motion(x, u)
    }
}

/// Loads of a model: [`DYNAMIC_PRESSURE`], the total [`AERODYNAMIC_ACCELERATION`] and the
/// [heat rate](crate::heating::HEAT_RATE).
#[derive(Clone, Debug, PartialEq)]
pub struct EntryLoads<M>(pub M);

impl<M: EntryModel<NU>, const NU: usize> PathFunction<6, NU, 3> for EntryLoads<M> {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; NU], _p: &[S; 0]) -> [S; 3] {
        let flight = self.0.flight();
        let density = flight.planet.atmosphere.density(x[0]);
        let pressure = density * x[3].square() * 0.5;
        let [lift, drag] = flight.coefficients(x[0], x[3], self.0.attack(u));
        let coefficient = (lift.square() + drag.square()).sqrt();
        let acceleration = pressure * coefficient * (flight.vehicle.reference_area / flight.vehicle.mass);
        [pressure, acceleration, flight.heat_rate_at(density, x[3])]
    }
}

/// Aerodynamic accelerations of a model along the axes of the body: [`NORMAL_ACCELERATION`] `L cos a + D sin a`, and the axial one
/// towards the rear `D cos a - L sin a`, over the mass.
///
/// A capsule with its heat shield as the nose lifts at a negative angle of attack, about -20 deg: its load is nearly all axial.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyLoads<M>(pub M);

impl<M: EntryModel<NU>, const NU: usize> PathFunction<6, NU, 2> for BodyLoads<M> {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 6], u: &[S; NU], _p: &[S; 0]) -> [S; 2] {
        let attack = self.0.attack(u);
        let Forces { lift, drag } = self.0.flight().forces(x[0], x[3], attack);
        let (sin, cos) = attack.sin_cos();
        [lift * cos + drag * sin, drag * cos - lift * sin]
    }
}

/// The [heat rate](crate::heating::HEAT_RATE) of a model: its integral is the heat load.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatRate<M>(pub M);

impl<M: EntryModel<NU>, const NU: usize> PathFunction<6, NU, 1> for HeatRate<M> {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 6], _u: &[S; NU], _p: &[S; 0]) -> [S; 1] {
        [self.0.flight().heat_rate(x[0], x[3])]
    }
}

/// The sum of the squares of the controls of [`BankVector`]: one for a bank angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BankVectorNorm;

impl PathFunction<6, 2, 1> for BankVectorNorm {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 6], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + u[1].square()]
    }
}
