//! Missions that are simulated under a law: from a mission to a record of its flight with what it amounts to.

use std::collections::BTreeMap;
use std::time::Instant;

use serde::Serialize;

use crate::moving_mass::{
    Case, Descent, LeastMargins, MARGIN_HEIGHTS, MarginRow, Masses, Metrics, Record, RootLocus, ending_text,
    ending_word,
};
use crate::{Curve, Error, Mission};

/// A simulated flight.
pub struct Simulated {
    /// What it amounts to.
    pub summary: SimulationSummary,
    /// Names and units of the columns of the record; the first is the time.
    pub columns: Vec<(&'static str, &'static str)>,
    /// The record, moment by moment; all numbers are finite.
    pub rows: Vec<Vec<f64>>,
    /// Curves for figures.
    pub curves: Vec<Curve>,
    /// Poles of the loops where the dynamic pressure is largest, at a tenth to ten times the gain; none without law, nor with delays of many
    /// samples.
    pub root_locus: Option<RootLocus>,
    /// The mission file that gives this result again, with every value written out.
    pub mission_file: String,
}

/// What a simulated flight amounts to, for files and scripts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulationSummary {
    /// Name of the mission.
    pub mission: String,
    /// Name of the law.
    pub law: String,
    /// `completed`, or one word on why the flight ended before.
    pub status: String,
    /// How the flight ended.
    pub ending: String,
    /// Time of the end, s.
    pub end_time_s: f64,
    /// Scalars; the unit ends the key.
    pub results: BTreeMap<String, f64>,
    /// Margins of the loop along the flight.
    pub margins: Vec<MarginLine>,
    /// What the reader should know.
    pub warnings: Vec<String>,
    /// Wall-clock time of flight, margins and root locus, ms.
    pub time_ms: f64,
}

/// Margins at a height: the least of both loops; `None` where there is no crossing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MarginLine {
    /// Height, km.
    pub altitude_km: f64,
    /// Time, s.
    pub time_s: f64,
    /// Dynamic pressure, kPa.
    pub dynamic_pressure_kpa: f64,
    /// Whether both loops are stable.
    pub stable: bool,
    /// Factor by which the gain may grow or fall.
    pub gain: Option<f64>,
    /// Phase, deg.
    pub phase_deg: Option<f64>,
    /// Delay, s.
    pub delay_s: Option<f64>,
    /// Least frequency at which the loop has gain one, Hz.
    pub crossover_hz: Option<f64>,
}

/// Steps of a root locus from a tenth of the gain to the gain, and from there to ten times it.
const LOCUS_STEPS: i32 = 100;
/// Most rows of a record that is handed on.
const MOST_ROWS: usize = 4000;

impl Mission {
    /// The closed-loop case of a mission that is simulated, for loops of one's own.
    ///
    /// # Errors
    /// A mission that is optimised, and values that do not make a case.
    pub fn case(&self) -> Result<Case, Error> {
        (self.kind.simulated()?.case)(&self.values, self.seed)
    }

    /// Whether the mission is simulated under a law, not optimised.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.kind.as_optimised().is_none()
    }

    /// Flies a mission that is simulated, or the solution of one that is optimised with what its problem leaves out, where that is modelled.
    ///
    /// # Errors
    /// A mission that is optimised and not modelled further, values that do not make a case, a problem without a solution. A flight that fails
    /// is not an error: see [`SimulationSummary::status`].
    pub fn simulate(&self) -> Result<Simulated, Error> {
        match self.kind.as_optimised().and_then(|o| o.simulate) {
            Some(simulate) => simulate(self),
            None => self.descend(),
        }
    }

    fn descend(&self) -> Result<Simulated, Error> {
        let begin = Instant::now();
        let descent = Descent::new(&self.case()?)?;
        let mut record = Record::every(1);
        let metrics = descent.fly(&mut record)?;
        let margins = descent.margins(&record, &MARGIN_HEIGHTS)?;
        let factor = |k: i32| 10_f64.powf(f64::from(k) / f64::from(LOCUS_STEPS));
        let factors: Vec<f64> = (-LOCUS_STEPS..=LOCUS_STEPS).map(factor).collect();
        let root_locus = descent.root_locus(&record, &factors)?;
        let time_ms = begin.elapsed().as_secs_f64() * 1e3;
        let columns = columns(descent.case());
        let rows = rows(&descent, &record);
        let mut warnings = Vec::new();
        if metrics.beyond_table > 0.0 {
            warnings.push(format!(
                "the total angle of attack is beyond the table of coefficients for {:.2} s; they are held at its edge there",
                metrics.beyond_table
            ));
        }
        if let Some(row) = margins.iter().find(|row| !row.stable()) {
            warnings.push(format!(
                "the linear loop is not stable at {:.1} km, {:.1} s",
                row.altitude / 1e3,
                row.time
            ));
        }
        Ok(Simulated {
            summary: SimulationSummary {
                mission: self.name().into(),
                law: self.values.word("law").into(),
                status: ending_word(&metrics.ending).into(),
                ending: ending_text(&descent.case().run, descent.vehicle(), &metrics.ending),
                end_time_s: metrics.time,
                results: results(&descent, &metrics, &margins, &rows),
                margins: margins.iter().map(line).collect(),
                warnings,
                time_ms,
            },
            curves: curves(&columns, &rows),
            root_locus,
            columns,
            rows,
            mission_file: self.to_file(),
        })
    }
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
    let peak = |column: usize| rows.iter().map(|row| row[column]).fold(0.0, f64::max);
    add("peak_dynamic_pressure_kpa", peak(PRESSURE) / 1e3);
    let least = LeastMargins::among(margins);
    add("gain_margin", least.gain);
    add("phase_margin_deg", least.phase.to_degrees());
    add("delay_margin_s", least.delay);
    found
}

/// Place of the dynamic pressure among the columns.
const PRESSURE: usize = 7;

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
        ("dynamic pressure", "Pa"),
    ];
    let states = apsides_dynamics::rigid_body::STATES.iter().map(|s| (s.name, s.unit));
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
pub(crate) fn kept(record: &Record) -> impl Iterator<Item = &apsides_control::record::Sample<13, 2>> {
    let samples = record.samples();
    let every = samples.len().div_ceil(MOST_ROWS).max(1);
    let last = samples.len().saturating_sub(1);
    let kept = samples.iter().enumerate().filter(move |(k, _)| k.is_multiple_of(every) || *k == last);
    kept.map(|(_, sample)| sample)
}

fn rows(descent: &Descent, record: &Record) -> Vec<Vec<f64>> {
    let row = |s: &apsides_control::record::Sample<13, 2>| {
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

/// A figure of columns of a record: the abscissa by name, the series by name and label; all have the unit of the first.
pub(crate) fn figure(
    title: &str,
    columns: &[(&'static str, &'static str)],
    x: &str,
    y: &str,
    names: &[(&str, &str)],
    rows: &[Vec<f64>],
) -> Curve {
    let place = |name: &str| columns.iter().position(|(n, _)| *n == name).unwrap_or(0);
    let unit = |name: &str| columns[place(name)].1.to_owned();
    let abscissa = place(x);
    let series = names.iter().map(|(name, label)| {
        let k = place(name);
        ((*label).to_owned(), rows.iter().map(|row| [row[abscissa], row[k]]).collect())
    });
    Curve {
        title: title.into(),
        x: (x.into(), unit(x)),
        y: (y.into(), names.first().map_or_else(|| "-".into(), |(name, _)| unit(name))),
        series: series.collect(),
    }
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
