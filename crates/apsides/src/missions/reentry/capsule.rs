//! What the values of a mission say: planet, capsule, start, target, limits and goal.

use apsides_dynamics::aerodynamics::{
    Aerodynamics, AxisymmetricAerodynamics, Damping, EntryVehicle, Interpolation, MachAlphaTable, MachTable,
};
use apsides_dynamics::atmosphere::{Atmosphere, Exponential, Gas};
use apsides_dynamics::entry::{EntryFlight, Heading};
use apsides_dynamics::equinoctial::EARTH_J2;
use apsides_dynamics::great_circle::{central_angle, initial_course};
use apsides_dynamics::heating::HeatingLaw;
use apsides_dynamics::planet::{MARS_J2, Planet};
use apsides_dynamics::{Body, DynamicsError};

use super::problem::{Load, Steering};
use super::{atmosphere_table, keys};
use crate::key::Values;

/// What is to be least or largest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Goal {
    /// Least heat load.
    HeatLoad,
    /// Least peak of a load.
    Peak(Load),
    /// Least factor on the lift.
    LeastLift,
    /// Least distance from the target.
    Miss,
    /// Largest distance past the target along a bearing (rad from north towards east), this far off the line at most (km).
    Reach { bearing: f64, half_width: f64 },
}

/// Flight, ends, limits; SI units.
#[derive(Clone, Debug)]
pub(super) struct Capsule {
    pub(super) flight: EntryFlight,
    /// In the order of the equations of motion.
    pub(super) start: [f64; 6],
    pub(super) target_altitude: f64,
    /// Longitude and latitude.
    pub(super) target: [f64; 2],
    /// Loads that are limited.
    pub(super) limits: Vec<(Load, f64)>,
    /// The acceleration that the mission limits and reports.
    pub(super) acceleration: Load,
    pub(super) longest_flight: f64,
    pub(super) goal: Goal,
    pub(super) steering: Steering,
}

impl Capsule {
    pub(super) fn of(v: &Values) -> Result<Self, String> {
        let heading = if v.word("azimuth_from") == "north" { Heading::FromNorth } else { Heading::FromEast };
        let flight = EntryFlight::new(planet(v)?, vehicle(v)?, heading, heating(v));
        let degrees = |key: &str| v.number(key).to_radians();
        let start = [
            v.number("entry_altitude_km") * 1e3,
            degrees("entry_longitude_deg"),
            degrees("entry_latitude_deg"),
            v.number("entry_speed_m_s"),
            degrees("entry_path_angle_deg"),
            degrees("entry_azimuth_deg"),
        ];
        let start = flight.checked(start).map_err(text)?;
        let target_altitude = v.number("target_altitude_km") * 1e3;
        let [_, highest] = flight.planet.atmosphere.range();
        if start[0] > highest {
            return Err(format!(
                "`entry_altitude_km` is {}, above the top of the atmosphere \"{}\", {} km",
                start[0] / 1e3,
                v.word(keys::ATMOSPHERE),
                highest / 1e3
            ));
        }
        flight.planet.above_surface("`target_altitude_km`", target_altitude).map_err(text)?;
        if target_altitude >= start[0] {
            return Err(format!(
                "`target_altitude_km` is {}, it must be below `entry_altitude_km` = {}",
                target_altitude / 1e3,
                start[0] / 1e3
            ));
        }
        let acceleration =
            if v.word("load") == keys::NORMAL { Load::NormalAcceleration } else { Load::TotalAcceleration };
        let limits = [
            (Load::DynamicPressure, v.number(keys::DYNAMIC_PRESSURE_LIMIT) * 1e3),
            (acceleration, v.number(keys::LOAD_LIMIT)),
            (Load::HeatRate, v.number(keys::HEAT_RATE_LIMIT) * 1e3),
        ];
        Ok(Self {
            flight,
            start,
            target_altitude,
            target: [keys::TARGET_LONGITUDE, keys::TARGET_LATITUDE].map(degrees),
            limits: limits.into_iter().filter(|(_, limit)| limit.is_finite()).collect(),
            acceleration,
            longest_flight: v.number("longest_flight_s"),
            goal: goal(v, acceleration),
            steering: if v.word(keys::STEERING) == keys::BANK { Steering::Angle } else { Steering::Vector },
        })
    }

    /// The same capsule with another goal.
    pub(super) fn with_goal_of(&self, goal: Goal) -> Self {
        Self { goal, ..self.clone() }
    }

    /// Great-circle distance (m) over the surface from a place, as longitude and latitude, to the target.
    pub(super) fn distance_to_target(&self, from: [f64; 2]) -> f64 {
        central_angle(from, self.target) * self.flight.planet.body.radius
    }

    /// The loads that are reported.
    pub(super) fn loads(&self) -> [Load; 3] {
        [Load::DynamicPressure, self.acceleration, Load::HeatRate]
    }

    /// Lift by drag at entry.
    pub(super) fn lift_to_drag(&self) -> f64 {
        self.flight.vehicle.lift_to_drag(self.flight.mach(self.start[0], self.start[3]))
    }

    /// Azimuth of the great circle from the start to the target, near that of the start.
    pub(super) fn course_to_target(&self) -> f64 {
        let course = initial_course([self.start[1], self.start[2]], self.target);
        let azimuth = self.flight.heading.of_course(course);
        let turns = ((self.start[5] - azimuth) / std::f64::consts::TAU).round();
        azimuth + turns * std::f64::consts::TAU
    }
}

fn planet(v: &Values) -> Result<Planet, String> {
    let is_mars = v.word("planet") == keys::MARS;
    let body = if is_mars { Body::MARS } else { Body::EARTH };
    let gas = if is_mars { Gas::MARS } else { Gas::AIR };
    let atmosphere = match v.word(keys::ATMOSPHERE) {
        keys::US_1976 => Atmosphere::UsStandard1976,
        keys::US_1976_PRINTED => Atmosphere::UsStandard1976Printed,
        keys::TABLE => Atmosphere::Table(atmosphere_table::parse(v.word(keys::ATMOSPHERE_TABLE), gas)?),
        keys::OF_MARS => Atmosphere::Exponential(Exponential::MARS),
        _ => {
            let (density, height) = (v.number("surface_density_kg_m3"), v.number("scale_height_m"));
            let law = Exponential::new(density, 0.0, height, gas, body.surface_gravity());
            Atmosphere::Exponential(law.map_err(text)?)
        }
    };
    let planet = if is_mars { Planet { atmosphere, ..Planet::mars() } } else { Planet::earth(atmosphere) };
    let planet =
        if v.flag("oblateness") { planet.with_j2(if is_mars { MARS_J2 } else { EARTH_J2 }) } else { planet };
    let rotation_rate = if v.flag("planet_rotation") { planet.rotation_rate } else { 0.0 };
    Ok(Planet { rotation_rate, ..planet })
}

fn vehicle(v: &Values) -> Result<EntryVehicle, String> {
    let aerodynamics = match v.word(keys::AERODYNAMICS) {
        keys::APOLLO => Aerodynamics::Mach(MachTable::apollo_10()),
        keys::OFFSET => Aerodynamics::Mach(shape(v)?.trimmed(v.number(keys::TRIM_OFFSET)).map_err(text)?),
        _ => Aerodynamics::constant(v.number(keys::LIFT_COEFFICIENT), v.number(keys::DRAG_COEFFICIENT))
            .map_err(text)?,
    };
    EntryVehicle::new(
        v.number("mass_kg"),
        v.number("reference_area_m2"),
        v.number("nose_radius_m"),
        aerodynamics,
    )
    .map_err(text)
}

/// The shape of the aerodynamics "apollo-offset".
pub(super) fn shape(v: &Values) -> Result<AxisymmetricAerodynamics, String> {
    let table = MachAlphaTable::apollo(Interpolation::Smooth);
    let diameter = (4.0 / std::f64::consts::PI * v.number("reference_area_m2")).sqrt();
    AxisymmetricAerodynamics::new(table, diameter, v.number(keys::STATION), Damping::constant()).map_err(text)
}

fn heating(v: &Values) -> HeatingLaw {
    match v.word(keys::HEATING) {
        keys::SUTTON_GRAVES if v.word("planet") == keys::MARS => HeatingLaw::SUTTON_GRAVES_MARS,
        keys::SUTTON_GRAVES => HeatingLaw::SUTTON_GRAVES_EARTH,
        _ => HeatingLaw::Stagnation { constant: v.number("heating_constant") },
    }
}

fn goal(v: &Values, acceleration: Load) -> Goal {
    match v.word(keys::GOAL) {
        keys::PEAK_DYNAMIC_PRESSURE => Goal::Peak(Load::DynamicPressure),
        keys::PEAK_LOAD => Goal::Peak(acceleration),
        keys::PEAK_HEAT_RATE => Goal::Peak(Load::HeatRate),
        keys::LEAST_LIFT => Goal::LeastLift,
        keys::MISS => Goal::Miss,
        keys::REACH => Goal::Reach {
            bearing: v.number(keys::REACH_BEARING).to_radians(),
            half_width: v.number(keys::REACH_WIDTH),
        },
        _ => Goal::HeatLoad,
    }
}

fn text(e: DynamicsError) -> String {
    e.to_string()
}
