//! The flight of a case as a report: a record, its scalars and its curves.

use std::collections::BTreeMap;

use apsides_control::record::Sample;
use apsides_dynamics::rigid_body::STATES;
use apsides_pipeline::simulation::{MarginLine, Simulated, SimulationSummary, Watch, figure};
use apsides_pipeline::{Curve, Error};

use super::case::{Case, MassModel, Masses};
use super::descent::{Descent, Metrics, Record, ending_text, ending_word};
use super::margins::{LeastMargins, MARGIN_HEIGHTS, MarginRow, without_margins};

/// Steps of a root locus from a tenth of the gain to the gain, and from there to ten times it.
const LOCUS_STEPS: i32 = 100;
/// Most rows of a record that is handed on.
const MOST_ROWS: usize = 4000;

/// Flies a case once. Names and times of the report are those of the mission, which fills them in.
pub(super) fn simulate(case: &Case, watch: &Watch<'_>) -> Result<Simulated, Error> {
    let descent = Descent::new(case)?;
    let mut record = Record::every(1);
    let metrics = descent.fly_watched(&mut record, watch)?;
    let margins = descent.margins(&record, &MARGIN_HEIGHTS)?;
    let factor = |k: i32| 10_f64.powf(f64::from(k) / f64::from(LOCUS_STEPS));
    let factors: Vec<f64> = (-LOCUS_STEPS..=LOCUS_STEPS).map(factor).collect();
    let root_locus = descent.root_locus(&record, &factors)?;
    let columns = columns(descent.case());
    let rows = rows(&descent, &record);
    let mut warnings = Vec::new();
    if metrics.beyond_table > 0.0 {
        warnings.push(format!(
            "the total angle of attack is beyond the table of coefficients for {:.2} s; they are held at its edge there",
            metrics.beyond_table
        ));
    }
    if case.mass_model != MassModel::QuasiStatic && !margins.is_empty() {
        warnings.push(
            "margins and root locus are those of quasi-static masses; the flight has the momentum of the masses".into(),
        );
    }
    warnings.extend(descent.too_long_delay().map(without_margins));
    if let Some(row) = margins.iter().find(|row| !row.stable()) {
        warnings.push(format!(
            "the linear loop is not stable at {:.1} km, {:.1} s",
            row.altitude / 1e3,
            row.time
        ));
    }
    Ok(Simulated {
        summary: SimulationSummary {
            mission: String::new(),
            law: case.law.word().into(),
            status: ending_word(&metrics.ending).into(),
            ending: ending_text(&descent.case().run, descent.vehicle(), &metrics.ending),
            end_time_s: metrics.time,
            results: results(&descent, &metrics, &margins, &rows),
            margins: margins.iter().map(line).collect(),
            warnings,
            time_ms: 0.0,
        },
        curves: curves(&columns, &rows),
        root_locus,
        columns,
        rows,
        mission_file: String::new(),
    })
}

fn line(row: &MarginRow) -> MarginLine {
    let [gain, phase_deg, delay_s, crossover_hz] = row.least();
    MarginLine {
        altitude_km: row.altitude / 1e3,
        time_s: row.time,
        dynamic_pressure_kpa: row.dynamic_pressure / 1e3,
        stable: row.stable(),
        gain,
        phase_deg,
        delay_s,
        crossover_hz,
    }
}

fn results(
    descent: &Descent,
    metrics: &Metrics,
    margins: &[MarginRow],
    rows: &[Vec<f64>],
) -> BTreeMap<String, f64> {
    let mut found = BTreeMap::new();
    let mut add = |key: &str, value: f64| {
        // Nothing that is not finite goes into files.
        if value.is_finite() {
            found.insert(key.to_owned(), value);
        }
    };
    add("flight_time_s", metrics.time);
    if let Some(window) = &metrics.window {
        add("attack_rms_deg", window.rms[0].to_degrees());
        add("sideslip_rms_deg", window.rms[1].to_degrees());
        add("attack_peak_deg", window.peak[0].to_degrees());
        add("sideslip_peak_deg", window.peak[1].to_degrees());
    }
    add("saturation_time_s", metrics.saturated_time);
    add("mass_1_travel_m", metrics.largest_travel[0]);
    add("mass_2_travel_m", metrics.largest_travel[1]);
    add("mass_1_rate_m_s", metrics.largest_rate[0]);
    add("mass_2_rate_m_s", metrics.largest_rate[1]);
    add("beyond_table_time_s", metrics.beyond_table);
    let end = descent.condition(&metrics.state);
    add("final_altitude_km", end.altitude / 1e3);
    add("final_airspeed_m_s", end.airspeed);
    if let Some(pressure) = columns(descent.case()).iter().position(|(name, _)| *name == PRESSURE) {
        let peak = rows.iter().map(|row| row[pressure]).fold(0.0, f64::max);
        add("peak_dynamic_pressure_kpa", peak / 1e3);
    }
    let least = LeastMargins::among(margins);
    add("gain_margin", least.gain);
    add("phase_margin_deg", least.phase.to_degrees());
    add("delay_margin_s", least.delay);
    found
}

/// Name of the dynamic pressure among the columns.
const PRESSURE: &str = "dynamic pressure";

fn columns(case: &Case) -> Vec<(&'static str, &'static str)> {
    let position = match case.masses {
        Masses::Cross { .. } => "m",
        Masses::Radial { .. } => "rad",
    };
    let flow = [
        ("time", "s"),
        ("altitude", "m"),
        ("angle of attack", "rad"),
        ("sideslip", "rad"),
        ("total angle of attack", "rad"),
        ("airspeed", "m/s"),
        ("Mach number", "-"),
        (PRESSURE, "Pa"),
    ];
    let states = STATES.iter().map(|s| (s.name, s.unit));
    let masses = [
        ("command of mass 1", position),
        ("command of mass 2", position),
        ("position of mass 1", position),
        ("position of mass 2", position),
        ("centre of mass y", "m"),
        ("centre of mass z", "m"),
    ];
    flow.into_iter().chain(states).chain(masses).collect()
}

/// The samples of a record that are handed on: the last, and as many as there is room for, at equal distances.
pub(crate) fn kept(record: &Record) -> impl Iterator<Item = &Sample<13, 2>> {
    let samples = record.samples();
    let every = samples.len().div_ceil(MOST_ROWS).max(1);
    let last = samples.len().saturating_sub(1);
    let kept = samples.iter().enumerate().filter(move |(k, _)| k.is_multiple_of(every) || *k == last);
    kept.map(|(_, sample)| sample)
}

fn rows(descent: &Descent, record: &Record) -> Vec<Vec<f64>> {
    let row = |s: &Sample<13, 2>| {
        let c = descent.condition(&s.state);
        let [_, y, z] = descent.vehicle().centre(&s.control);
        let mut row = vec![
            s.time,
            c.altitude,
            c.attack,
            c.sideslip,
            c.total_attack,
            c.airspeed,
            c.mach,
            c.dynamic_pressure,
        ];
        row.extend(s.state.iter().chain(&s.command).chain(&s.control));
        row.extend([y, z]);
        row
    };
    kept(record).map(row).filter(|row| row.iter().all(|v| v.is_finite())).collect()
}

fn curves(columns: &[(&'static str, &'static str)], rows: &[Vec<f64>]) -> Vec<Curve> {
    let figure =
        |title: &str, x: &str, y: &str, names: &[(&str, &str)]| figure(title, columns, x, y, names, rows);
    let angles = [("angle of attack", "attack"), ("sideslip", "sideslip")];
    let masses = [("position of mass 1", "mass 1"), ("position of mass 2", "mass 2")];
    vec![
        figure("angles over height", "altitude", "angle", &angles),
        figure("angles", "time", "angle", &angles),
        figure("masses", "time", "position", &masses),
        figure("centre of mass", "time", "offset", &[("centre of mass y", "y"), ("centre of mass z", "z")]),
        figure(
            "angular velocity",
            "time",
            "angular velocity",
            &[("roll rate", "roll"), ("pitch rate", "pitch"), ("yaw rate", "yaw")],
        ),
        figure("height", "time", "altitude", &[("altitude", "")]),
        figure("airspeed", "time", "airspeed", &[("airspeed", "")]),
        figure("Mach number", "time", "Mach number", &[("Mach number", "")]),
        figure("dynamic pressure", "time", "dynamic pressure", &[("dynamic pressure", "")]),
        figure(
            "position",
            "time",
            "position",
            &[("position x", "x"), ("position y", "y"), ("position z", "z")],
        ),
        figure(
            "velocity",
            "time",
            "velocity",
            &[("velocity x", "x"), ("velocity y", "y"), ("velocity z", "z")],
        ),
        figure(
            "attitude",
            "time",
            "quaternion",
            &[("attitude 0", "0"), ("attitude 1", "1"), ("attitude 2", "2"), ("attitude 3", "3")],
        ),
    ]
}
