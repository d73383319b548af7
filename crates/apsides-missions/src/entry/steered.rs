//! The planned re-entry flown in six degrees of freedom, its lift pointed by two masses on a rim.

use apsides_control::record::Sample;
use apsides_dynamics::entry::EntryState;
use apsides_dynamics::great_circle::along_and_across;
use apsides_ocp::Trajectory;
use apsides_pipeline::simulation::{SimulationSummary, Watch, figure};
use apsides_pipeline::{Curve, Error, Outcome, Scalars, Simulated};

use super::capsule::CapsuleEntry;
use super::{keys, results};
use crate::moving_mass::simulation::kept;
use crate::moving_mass::state::BodyState;
use crate::moving_mass::{
    ActuatorLimits, BankProfile, Record, SteeredEntry, SteeredFlight, SteeredReady, ending_text, ending_word,
};

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

impl CapsuleEntry {
    /// The re-entry of the capsule with its masses.
    ///
    /// # Errors
    /// A capsule whose coefficients are not those of a shape.
    pub fn steered_entry(&self) -> Result<SteeredEntry, Error> {
        let Some(shape) = &self.shape else {
            return Err(Error::in_mission(format!(
                "six degrees of freedom need the coefficients of a shape: set `{}` to \"{}\"",
                keys::AERODYNAMICS,
                keys::OFFSET
            )));
        };
        let masses = self.steered;
        Ok(SteeredEntry {
            flight: self.flight.clone(),
            start: self.start,
            end_altitude: self.target_altitude,
            shape: shape.aerodynamics.clone(),
            gyration: masses.gyration,
            trim_offset: shape.offset,
            unknown_offset: masses.unknown_offset,
            moving_mass: masses.moving_mass,
            rim_radius: masses.rim_radius,
            actuators: ActuatorLimits {
                rate: masses.rate_limit,
                acceleration: masses.acceleration_limit,
                ..ActuatorLimits::IDEAL
            },
            bandwidth: masses.bandwidth,
            sample_time: masses.sample_time,
            time_limit: self.longest_flight,
        })
    }

    /// The bank angles of a solution.
    ///
    /// # Errors
    /// A solution without falling energy.
    pub fn bank_profile(&self, planned: &Trajectory) -> Result<BankProfile, Error> {
        BankProfile::new(&self.flight, results::moments(self, planned))
    }

    /// Flies the bank angles of a solution. Names and times of the report are those of the mission, which fills them in.
    pub(super) fn fly_steered(&self, plan: &Outcome, watch: &Watch<'_>) -> Result<Simulated, Error> {
        let entry = self.steered_entry()?;
        let (_, planned) = plan.solved();
        let profile = self.bank_profile(planned)?;
        let ready = entry.ready(Some(&profile))?;
        let mut record = Record::every(1);
        let flight = ready.fly_watched(&mut record, watch)?;
        let rows = rows(&ready, &record);
        let mut results = scalars(&entry, &flight, planned);
        for key in ["heat_load_mj_m2", "flight_time_s"] {
            results.extend(plan.summary.results.get(key).map(|value| (format!("planned_{key}"), *value)));
        }
        Ok(Simulated {
            summary: SimulationSummary {
                mission: String::new(),
                law: "masses that point the lift along the planned bank angle".into(),
                status: ending_word(&flight.ending).into(),
                ending: ending_text(&entry.run(), ready.vehicle(), &flight.ending),
                end_time_s: flight.time,
                results,
                margins: Vec::new(),
                warnings: warning(&entry, &flight).into_iter().collect(),
                time_ms: 0.0,
            },
            columns: COLUMNS.to_vec(),
            curves: curves(&rows),
            rows,
            root_locus: None,
            mission_file: String::new(),
        })
    }
}

/// A sentence on an angle of attack beyond the table of coefficients.
fn warning(entry: &SteeredEntry, flight: &SteeredFlight) -> Option<String> {
    let [_, most] = entry.shape.table().attack_range();
    (flight.largest_attack > most).then(|| {
        format!(
            "the total angle of attack reaches {:.1} deg, beyond the table of coefficients; they are held at its edge there",
            flight.largest_attack.to_degrees()
        )
    })
}

fn curves(rows: &[Vec<f64>]) -> Vec<Curve> {
    let curve =
        |title: &str, y: &str, names: &[(&str, &str)]| figure(title, &COLUMNS, "time", y, names, rows);
    vec![
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
    ]
}

/// The scalars of a flight beside its plan.
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
    let [pressure, load, heat_rate] = flight.peaks;
    add("peak_dynamic_pressure_kpa", pressure / 1e3);
    add("peak_load_m_s2", load);
    add("peak_heat_rate_kw_m2", heat_rate / 1e3);
    let [[bank_rms, bank_peak], [attack_rms, attack_peak]] = [flight.bank_error, flight.attack_error];
    add("bank_error_rms_deg", bank_rms.to_degrees());
    add("bank_error_peak_deg", bank_peak.to_degrees());
    add("attack_error_rms_deg", attack_rms.to_degrees());
    add("attack_error_peak_deg", attack_peak.to_degrees());
    add("largest_attack_deg", flight.largest_attack.to_degrees());
    add("mass_rate_m_s", flight.largest_rate);
    add("saturation_time_s", flight.saturated_time);
    let end = planned.phases.first().and_then(|p| <[f64; 6]>::try_from(p.final_state()).ok());
    if let Some(end) = end.map(EntryState::from) {
        let course = entry.flight.heading.of_course(end.azimuth);
        let radius_km = entry.flight.planet.body.radius / 1e3;
        let [along, across] = along_and_across(end.place(), flight.place, course);
        add("downrange_error_km", along * radius_km);
        add("crossrange_error_km", across * radius_km);
    }
    found
}

fn rows(ready: &SteeredReady<'_>, record: &Record) -> Vec<Vec<f64>> {
    let row = |s: &Sample<13, 2>| {
        let at = ready.condition(&s.state);
        let [_, y, z] = ready.vehicle().centre(&s.control);
        let [roll_rate, pitch_rate, yaw_rate] = BodyState::of(&s.state).spin;
        let [first, second] = s.control;
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
            roll_rate,
            pitch_rate,
            yaw_rate,
            first,
            second,
            y,
            z,
            at.heat_rate,
        ]
    };
    kept(record).map(row).filter(|row| row.iter().all(|v| v.is_finite())).collect()
}
