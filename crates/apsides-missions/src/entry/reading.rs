//! The capsule of the values of a mission.

use apsides_dynamics::aerodynamics::{
    Aerodynamics, AxisymmetricAerodynamics, Damping, EntryVehicle, Interpolation, MachAlphaTable, MachTable,
    Newtonian,
};
use apsides_dynamics::atmosphere::{Atmosphere, Exponential, Gas};
use apsides_dynamics::entry::{EntryFlight, EntryState, Heading};
use apsides_dynamics::frames::Local;
use apsides_dynamics::heating::HeatingLaw;
use apsides_dynamics::planet::Planet;
use apsides_dynamics::{Body, DynamicsError};
use apsides_ephemeris::{CentralBody, Epoch, Frames, StateVector};
use apsides_pipeline::Error;
use apsides_pipeline::placing::{INITIAL_STATE_PATH, NO_MESSAGE, placing};
use apsides_pipeline::values::Values;

use super::capsule::{CapsuleEntry, Goal, SteeredMasses, TrimmedShape};
use super::load::Load;
use super::steering::Steering;
use super::{atmosphere_table, keys};
use crate::data::{J2, ROTATION_RATE, central_body};

impl CapsuleEntry {
    /// The capsule of values.
    ///
    /// # Errors
    /// Values that do not go together, and what planet, atmosphere or vehicle refuse.
    pub(super) fn of(v: &Values) -> Result<Self, Error> {
        let heading =
            if v.word("azimuth_from")? == keys::NORTH { Heading::FromNorth } else { Heading::FromEast };
        let shape = match v.word(keys::AERODYNAMICS)? {
            keys::OFFSET => Some(shape(v)?),
            _ => None,
        };
        let vehicle = vehicle(v, shape.as_ref())?;
        let flight = EntryFlight::new(planet(v)?, vehicle, heading, heating(v)?);
        let (start, epoch) = match v.word(INITIAL_STATE_PATH)? {
            NO_MESSAGE => (start(v)?, None),
            message => {
                let instead = format!("the message states the start; leave `{INITIAL_STATE_PATH}` away");
                v.refuse_without_effect(&keys::START, INITIAL_STATE_PATH, &instead)?;
                state_of_message(v, &flight, message)?
            }
        };
        check_start(v, &flight, &start)?;
        let target_altitude = target_altitude(v, &flight.planet, &start)?;
        let acceleration = match v.word("load")? {
            keys::NORMAL => Load::NormalAcceleration,
            _ => Load::TotalAcceleration,
        };
        let thousand = |limit: f64| limit * 1e3;
        Ok(Self {
            start,
            epoch,
            target_altitude,
            target: [radians(v, keys::TARGET_LONGITUDE)?, radians(v, keys::TARGET_LATITUDE)?],
            acceleration,
            dynamic_pressure_limit: v.limit(keys::DYNAMIC_PRESSURE_LIMIT)?.map(thousand),
            acceleration_limit: v.limit(keys::LOAD_LIMIT)?,
            heat_rate_limit: v.limit(keys::HEAT_RATE_LIMIT)?.map(thousand),
            longest_flight: v.number("max_flight_time_s")?,
            goal: goal(v, acceleration)?,
            steering: if v.word(keys::STEERING)? == keys::BANK { Steering::Angle } else { Steering::Vector },
            margins: v.flag(keys::MARGINS)?,
            shape,
            steered: steered(v)?,
            flight,
        })
    }
}

/// The number of a key in deg, as rad.
fn radians(v: &Values, path: &str) -> Result<f64, Error> {
    v.number(path).map(f64::to_radians)
}

/// State and instant of an orbit parameter message.
fn state_of_message(
    v: &Values,
    flight: &EntryFlight,
    message: &str,
) -> Result<(EntryState, Option<Epoch>), Error> {
    let refuse = |reason: String| v.conflict(format!("`{INITIAL_STATE_PATH}`: {reason}"));
    let state = StateVector::read_opm(message).map_err(|e| refuse(e.to_string()))?;
    let body = &flight.planet.body;
    if CentralBody::of_gravity(body.gravitational_parameter) != Some(state.body) {
        return Err(refuse(format!("the message is about the {}, `body` is another one", state.body.word())));
    }
    let mass = flight.vehicle.mass;
    if let Some(stated) = state.mass.filter(|stated| (stated / mass - 1.0).abs() > SAME_MASS) {
        return Err(refuse(format!("the message has a mass of {stated} kg, `initial_mass_kg` is {mass}")));
    }
    // On a body that does not turn the coordinates are in the mission's inertial axes.
    let (position, velocity) = match flight.planet.rotation_rate == 0.0 {
        true => {
            let frames = Frames::new(state.body, state.epoch, &placing(v)?.plane);
            (frames.icrf_to_inertial(state.position), frames.icrf_to_inertial(state.velocity))
        }
        false => state.body.orientation(&state.epoch).to_fixed(state.position, state.velocity),
    };
    let (radius, longitude, latitude) = Local::spherical(position);
    let [up, east, north] = Local::at(longitude, latitude).components(velocity);
    let across = east.hypot(north);
    let start = EntryState {
        altitude: radius - body.radius,
        longitude,
        latitude,
        speed: across.hypot(up),
        path_angle: up.atan2(across),
        azimuth: flight.heading.of_course(east.atan2(north)),
    };
    Ok((start, Some(state.epoch)))
}

/// Part by which the mass of a message may differ from that of the vehicle.
const SAME_MASS: f64 = 1e-6;

fn start(v: &Values) -> Result<EntryState, Error> {
    let [altitude, longitude, latitude, speed, path_angle, azimuth] = keys::START;
    Ok(EntryState {
        altitude: v.number(altitude)? * 1e3,
        longitude: radians(v, longitude)?,
        latitude: radians(v, latitude)?,
        speed: v.number(speed)?,
        path_angle: radians(v, path_angle)?,
        azimuth: radians(v, azimuth)?,
    })
}

/// Refuses a start that the flight does not have.
fn check_start(v: &Values, flight: &EntryFlight, start: &EntryState) -> Result<(), Error> {
    flight.checked(start.array()).map_err(v.refusal(&["entry_altitude_km", "entry_speed_m_s"]))?;
    let [_, highest] = flight.planet.atmosphere.range();
    if start.altitude > highest {
        return Err(v.conflict(format!(
            "`entry_altitude_km` is {}, above the top of the atmosphere \"{}\", {} km",
            start.altitude / 1e3,
            v.word(keys::ATMOSPHERE)?,
            highest / 1e3
        )));
    }
    Ok(())
}

fn target_altitude(v: &Values, planet: &Planet, start: &EntryState) -> Result<f64, Error> {
    let altitude = v.number("target_altitude_km")? * 1e3;
    let refused = |e: DynamicsError| v.conflict(e.to_string());
    planet.above_surface("`target_altitude_km`", altitude).map_err(refused)?;
    if altitude >= start.altitude {
        return Err(v.conflict(format!(
            "`target_altitude_km` is {}, it must be below `entry_altitude_km` = {}",
            altitude / 1e3,
            start.altitude / 1e3
        )));
    }
    Ok(altitude)
}

fn planet(v: &Values) -> Result<Planet, Error> {
    let rotation_rate = if v.flag("body_rotation")? { v.number(&ROTATION_RATE.path)? } else { 0.0 };
    let j2 = if v.flag("oblateness")? { v.number(&J2.path)? } else { 0.0 };
    let body = central_body(v)?;
    let refusal = v.refusal(&[&ROTATION_RATE.path, &J2.path]);
    Planet::new(body, rotation_rate, j2, atmosphere(v, &body)?).map_err(refusal)
}

fn atmosphere(v: &Values, body: &Body) -> Result<Atmosphere, Error> {
    let (constant, ratio) = (v.number(keys::GAS_CONSTANT)?, v.number(keys::HEAT_CAPACITY_RATIO)?);
    let gas =
        Gas::new(constant, ratio).map_err(v.refusal(&[keys::GAS_CONSTANT, keys::HEAT_CAPACITY_RATIO]))?;
    if v.word(keys::ATMOSPHERE)? != keys::TABLE {
        let instead = format!("set `{}` to {}, too", keys::ATMOSPHERE, keys::TABLE);
        v.refuse_without_effect(&[keys::ATMOSPHERE_TABLE], keys::ATMOSPHERE, &instead)?;
    }
    Ok(match v.word(keys::ATMOSPHERE)? {
        keys::US_1976 => Atmosphere::UsStandard1976,
        keys::US_1976_PRINTED => Atmosphere::UsStandard1976Printed,
        keys::TABLE => {
            let rows = v.word(keys::ATMOSPHERE_TABLE)?;
            Atmosphere::Table(atmosphere_table::parse(rows, gas, |reason| v.conflict(reason))?)
        }
        // The key takes no other words.
        _ => {
            let [density, height] = [v.number(keys::SURFACE_DENSITY)?, v.number(keys::SCALE_HEIGHT)?];
            let law = Exponential::new(density, 0.0, height, gas, body.surface_gravity());
            Atmosphere::Exponential(law.map_err(v.refusal(&[keys::SURFACE_DENSITY, keys::SCALE_HEIGHT]))?)
        }
    })
}

fn vehicle(v: &Values, shape: Option<&TrimmedShape>) -> Result<EntryVehicle, Error> {
    let word = v.word(keys::AERODYNAMICS)?;
    if word == keys::NEWTONIAN {
        return newtonian(v);
    }
    let aerodynamics = match (shape, word) {
        (Some(shape), _) => shape.aerodynamics.trimmed(shape.offset).map(Aerodynamics::Mach),
        (None, keys::APOLLO) => Ok(Aerodynamics::Mach(MachTable::apollo_10())),
        (None, _) => {
            Aerodynamics::constant(v.number(keys::LIFT_COEFFICIENT)?, v.number(keys::DRAG_COEFFICIENT)?)
        }
    };
    let [mass, area] = [v.number("initial_mass_kg")?, v.number(keys::REFERENCE_AREA)?];
    let nose_radius = v.number("nose_radius_m")?;
    let aerodynamics = aerodynamics.map_err(v.refusal(&[keys::AERODYNAMICS]))?;
    EntryVehicle::new(mass, area, nose_radius, aerodynamics).map_err(v.refusal(&[
        "initial_mass_kg",
        keys::REFERENCE_AREA,
        "nose_radius_m",
    ]))
}

/// A sphere-cone or a segment of a sphere at an angle of attack.
fn newtonian(v: &Values) -> Result<EntryVehicle, Error> {
    let [mass, area, nose] =
        [v.number("initial_mass_kg")?, v.number(keys::REFERENCE_AREA)?, v.number("nose_radius_m")?];
    let (base, ratio) = (0.5 * diameter(v)?, v.number(keys::HEAT_CAPACITY_RATIO)?);
    let shape = match v.optional(keys::HALF_ANGLE)? {
        Some(angle) => Newtonian::sphere_cone(nose, base, angle.to_radians(), ratio),
        None => Newtonian::segment(nose, base, ratio),
    };
    let shape = shape.map_err(v.refusal(&["nose_radius_m", keys::REFERENCE_AREA, keys::HALF_ANGLE]))?;
    let attack = radians(v, keys::ATTACK)?;
    if attack.abs() > shape.largest_attack() {
        return Err(v.conflict(format!(
            "`{}` is {}, but beyond {:.3} deg a part of the front is in the shadow, which the impact theory leaves out",
            keys::ATTACK,
            attack.to_degrees(),
            shape.largest_attack().to_degrees()
        )));
    }
    EntryVehicle::new(mass, area, nose, Aerodynamics::Newtonian(shape))
        .and_then(|vehicle| vehicle.at_attack(attack))
        .map_err(v.refusal(&["initial_mass_kg", keys::REFERENCE_AREA, "nose_radius_m"]))
}

/// Diameter, m, of the circle of the reference area.
fn diameter(v: &Values) -> Result<f64, Error> {
    Ok((4.0 / std::f64::consts::PI * v.number(keys::REFERENCE_AREA)?).sqrt())
}

/// The shape of the aerodynamics "apollo-offset".
fn shape(v: &Values) -> Result<TrimmedShape, Error> {
    let table = MachAlphaTable::apollo(Interpolation::Smooth);
    let shape =
        AxisymmetricAerodynamics::new(table, diameter(v)?, v.number(keys::STATION)?, Damping::constant());
    let offset = v.number(keys::TRIM_OFFSET)?;
    Ok(TrimmedShape {
        aerodynamics: shape.map_err(v.refusal(&[keys::REFERENCE_AREA, keys::STATION]))?,
        offset,
    })
}

fn heating(v: &Values) -> Result<HeatingLaw, Error> {
    Ok(match v.word(keys::HEATING)? {
        keys::SUTTON_GRAVES => HeatingLaw::SuttonGraves { constant: v.number(keys::SUTTON_GRAVES_CONSTANT)? },
        _ => HeatingLaw::Stagnation { constant: v.number("heating_constant")? },
    })
}

fn goal(v: &Values, acceleration: Load) -> Result<Goal, Error> {
    Ok(match v.word(keys::GOAL)? {
        keys::PEAK_DYNAMIC_PRESSURE => Goal::Peak(Load::DynamicPressure),
        keys::PEAK_LOAD => Goal::Peak(acceleration),
        keys::PEAK_HEAT_RATE => Goal::Peak(Load::HeatRate),
        keys::LEAST_LIFT => Goal::LeastLift,
        keys::MISS => Goal::Miss,
        keys::REACH => Goal::Reach {
            bearing: radians(v, keys::REACH_BEARING)?,
            half_width: v.limit(keys::REACH_WIDTH)?.map(|km| km * 1e3),
        },
        _ => Goal::HeatLoad,
    })
}

fn steered(v: &Values) -> Result<SteeredMasses, Error> {
    let [y, z] = keys::UNKNOWN_OFFSET;
    Ok(SteeredMasses {
        gyration: [v.number(keys::ROLL_GYRATION)?, v.number(keys::PITCH_GYRATION)?],
        moving_mass: v.number(keys::MOVING_MASS)?,
        rim_radius: v.number(keys::RIM_RADIUS)?,
        rate_limit: v.limit(keys::RATE_LIMIT)?,
        acceleration_limit: v.limit(keys::ACCELERATION_LIMIT)?,
        unknown_offset: [v.number(y)?, v.number(z)?],
        bandwidth: v.number(keys::BANDWIDTH)?,
        sample_time: v.number(keys::SAMPLE_TIME)?,
    })
}
