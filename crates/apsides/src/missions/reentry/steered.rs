//! The planned re-entry flown in six degrees of freedom, its lift pointed by two masses on a rim.

use std::time::Instant;

use apsides_dynamics::great_circle::along_and_across;
use apsides_ocp::Trajectory;

use super::capsule::{Capsule, shape};
use super::{keys, results};
use crate::key::Values;
use crate::missions::Scalars;
use crate::moving_mass::{
    ActuatorLimits, BankProfile, Record, SteeredEntry, SteeredFlight, SteeredReady, ending_text, ending_word,
};
use crate::simulation::{Simulated, SimulationSummary, figure, kept};
use crate::{Error, Mission};

/// Columns of the record.
const COLUMNS: [(&str, &str); 19] = [
    ("time", "s"),
    ("altitude", "m"),
    ("airspeed", "m/s"),
    ("Mach number", "-"),
    ("dynamic pressure", "Pa"),
    ("bank angle", "rad"),
    ("planned bank angle", "rad"),
    ("total angle of attack", "rad"),
    ("trim", "rad"),
    ("angle of attack", "rad"),
    ("sideslip", "rad"),
    ("roll rate", "rad/s"),
    ("pitch rate", "rad/s"),
    ("yaw rate", "rad/s"),
    ("angle of mass 1", "rad"),
    ("angle of mass 2", "rad"),
    ("centre of mass y", "m"),
    ("centre of mass z", "m"),
    ("heat rate", "W/m2"),
];

/// The capsule of the values with its masses.
///
/// # Errors
/// Values that do not make a capsule, or one whose coefficients are not those of a shape.
pub(crate) fn entry(v: &Values) -> Result<SteeredEntry, Error> {
    if v.word(keys::AERODYNAMICS) != keys::OFFSET {
        return Err(Error::in_mission(format!(
            "six degrees of freedom need the coefficients of a shape: set `{}` to \"{}\"",
            keys::AERODYNAMICS,
            keys::OFFSET
        )));
    }
    let capsule = Capsule::of(v).map_err(Error::in_mission)?;
    let shape = shape(v).map_err(Error::in_mission)?;
    let diameter = shape.diameter();
    Ok(SteeredEntry {
        start: capsule.start,
        end_altitude: capsule.target_altitude,
        gyration: [keys::ROLL_GYRATION, keys::PITCH_GYRATION].map(|k| v.number(k) * diameter),
        shape,
        trim_offset: v.number(keys::TRIM_OFFSET),
        unknown_offset: keys::UNKNOWN_OFFSET.map(|k| v.number(k)),
        moving_mass: v.number(keys::MOVING_MASS),
        rim_radius: v.number(keys::RIM_RADIUS),
        actuators: ActuatorLimits {
            rate: v.number(keys::RATE_LIMIT),
            acceleration: v.number(keys::ACCELERATION_LIMIT),
            ..ActuatorLimits::IDEAL
        },
        bandwidth: v.number(keys::BANDWIDTH),
        sample_time: v.number(keys::SAMPLE_TIME),
        time_limit: capsule.longest_flight,
        flight: capsule.flight,
    })
}

/// The bank angles of a solution.
///
/// # Errors
/// A solution without falling energy.
pub(crate) fn profile(v: &Values, planned: &Trajectory) -> Result<BankProfile, Error> {
    let capsule = Capsule::of(v).map_err(Error::in_mission)?;
    BankProfile::new(&capsule.flight, results::moments(&capsule, planned))
}

/// Solves a mission and flies its bank angles.
pub(super) fn simulate(mission: &Mission) -> Result<Simulated, Error> {
    let begin = Instant::now();
    let entry = entry(&mission.values)?;
    // What cannot be steered is refused before the solve, which takes seconds.
    entry.ready(None)?;
    // Margins take solves of their own.
    let bare = Mission { values: mission.values.with_flag(keys::MARGINS, false), ..mission.clone() };
    let outcome = bare.solve(None, &mut ())?;
    if !outcome.status.is_success() {
        let reason = format!("the flight to follow has no solution: {}", outcome.summary.status);
        return Err(Error::in_mission(reason));
    }
    let (_, planned) = outcome.solved();
    let profile = profile(&mission.values, planned)?;
    let ready = entry.ready(Some(&profile))?;
    let mut record = Record::every(1);
    let flight = ready.fly(&mut record)?;
    let rows = rows(&ready, &record);
    let mut warnings = Vec::new();
    let [_, most] = entry.shape.table().attack_range();
    if flight.largest_attack > most {
        warnings.push(format!(
            "the total angle of attack reaches {:.1} deg, beyond the table of coefficients; they are held at its edge there",
            flight.largest_attack.to_degrees()
        ));
    }
    let curve =
        |title: &str, y: &str, names: &[(&str, &str)]| figure(title, &COLUMNS, "time", y, names, &rows);
    let curves = vec![
        curve("bank angle", "bank angle", &[("bank angle", "flown"), ("planned bank angle", "planned")]),
        curve("total angle of attack", "angle", &[("total angle of attack", "flown"), ("trim", "trim")]),
        curve("centre of mass", "offset", &[("centre of mass y", "y"), ("centre of mass z", "z")]),
        curve("masses", "angle on the rim", &[("angle of mass 1", "mass 1"), ("angle of mass 2", "mass 2")]),
        curve(
            "angular velocity",
            "angular velocity",
            &[("roll rate", "roll"), ("pitch rate", "pitch"), ("yaw rate", "yaw")],
        ),
        curve("height", "altitude", &[("altitude", "")]),
        curve("dynamic pressure", "dynamic pressure", &[("dynamic pressure", "")]),
        curve("heat rate", "heat rate", &[("heat rate", "")]),
    ];
    let mut results = scalars(&entry, &flight, planned);
    for key in ["heat_load_mj_m2", "flight_time_s"] {
        results.extend(outcome.summary.results.get(key).map(|value| (format!("planned_{key}"), *value)));
    }
    Ok(Simulated {
        summary: SimulationSummary {
            mission: mission.name().into(),
            law: "masses that point the lift along the planned bank angle".into(),
            status: ending_word(&flight.ending).into(),
            ending: ending_text(&entry.run(), ready.vehicle(), &flight.ending),
            end_time_s: flight.time,
            results,
            margins: Vec::new(),
            warnings,
            time_ms: begin.elapsed().as_secs_f64() * 1e3,
        },
        columns: COLUMNS.to_vec(),
        rows,
        curves,
        root_locus: None,
        mission_file: mission.to_file(),
    })
}

/// What a flight amounts to, beside its plan.
fn scalars(entry: &SteeredEntry, flight: &SteeredFlight, planned: &Trajectory) -> Scalars {
    let mut found = Scalars::new();
    let mut add = |key: &str, value: f64| {
        // Nothing that is not finite goes into files.
        if value.is_finite() {
            found.insert(key.to_owned(), value);
        }
    };
    add("flight_time_s", flight.time);
    add("heat_load_mj_m2", flight.heat_load / 1e6);
    for (key, value) in ["peak_dynamic_pressure_kpa", "peak_load_m_s2", "peak_heat_rate_kw_m2"].iter().zip([
        flight.peaks[0] / 1e3,
        flight.peaks[1],
        flight.peaks[2] / 1e3,
    ]) {
        add(key, value);
    }
    add("bank_error_rms_deg", flight.bank_error[0].to_degrees());
    add("bank_error_peak_deg", flight.bank_error[1].to_degrees());
    add("attack_error_rms_deg", flight.attack_error[0].to_degrees());
    add("attack_error_peak_deg", flight.attack_error[1].to_degrees());
    add("largest_attack_deg", flight.largest_attack.to_degrees());
    add("mass_rate_m_s", flight.largest_rate);
    add("saturation_time_s", flight.saturated_time);
    if let Some(end) = planned.phases.first().map(|p| p.final_state()) {
        let course = entry.flight.heading.of_course(end[5]);
        let radius_km = entry.flight.planet.body.radius / 1e3;
        let [along, across] = along_and_across([end[1], end[2]], flight.place, course);
        add("downrange_error_km", along * radius_km);
        add("crossrange_error_km", across * radius_km);
    }
    found
}

fn rows(ready: &SteeredReady<'_>, record: &Record) -> Vec<Vec<f64>> {
    let row = |s: &apsides_control::record::Sample<13, 2>| {
        let at = ready.condition(&s.state);
        let [_, y, z] = ready.vehicle().centre(&s.control);
        vec![
            s.time,
            at.flow.altitude,
            at.flow.airspeed,
            at.flow.mach,
            at.flow.dynamic_pressure,
            at.bank,
            at.planned_bank,
            at.flow.total_attack,
            at.trim,
            at.flow.attack,
            at.flow.sideslip,
            s.state[10],
            s.state[11],
            s.state[12],
            s.control[0],
            s.control[1],
            y,
            z,
            at.heat_rate,
        ]
    };
    kept(record).map(row).filter(|row| row.iter().all(|v| v.is_finite())).collect()
}
