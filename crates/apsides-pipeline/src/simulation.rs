//! Missions that are simulated under a law: a record of the flight with what it amounts to.

use std::collections::BTreeMap;

use apsides_control::state_space::LocusPoint;
use apsides_ephemeris::header;
use serde::Serialize;

use crate::outcome::Curve;

/// Is told the time of a flight, s, again and again while it is computed, and says whether to go on.
pub type Watch<'a> = dyn Fn(f64) -> bool + Send + Sync + 'a;

/// The word of a flight that its [`Watch`] ended.
pub const INTERRUPTED: &str = "interrupted";

/// A simulated flight.
pub struct Simulated {
    /// The summary of the flight.
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

impl Simulated {
    /// Headers of the columns: name and unit as one word.
    #[must_use]
    pub fn headers(&self) -> Vec<String> {
        self.columns.iter().map(|(name, unit)| header(name, unit)).collect()
    }
}

/// Root loci of the loops of angle of attack and sideslip at a state of a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct RootLocus {
    /// Height, m.
    pub altitude: f64,
    /// Time, s.
    pub time: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure: f64,
    /// Time between samples of the law, s.
    pub sample_time: f64,
    /// Poles, 1/s, of each loop at each factor on its gain: logarithms of the poles of the sampled loop over the sample time. Poles at the same
    /// place of each point are a branch.
    pub loops: [Vec<LocusPoint>; 2],
}

/// The summary of a simulated flight, for files and scripts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulationSummary {
    /// Name of the mission.
    pub mission: String,
    /// Name of the law.
    pub law: String,
    /// `completed`, or one word on why the flight ended before.
    pub status: String,
    /// The end of the flight, in words.
    pub ending: String,
    /// Time of the end, s.
    pub end_time_s: f64,
    /// Scalars; the unit ends the key.
    pub results: BTreeMap<String, f64>,
    /// Margins of the loop along the flight.
    pub margins: Vec<MarginLine>,
    /// Warnings to the reader, one sentence each.
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
    /// True if both loops are stable.
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

/// A figure of columns of a record: the abscissa by name, the series by name and label; all have the unit of the first.
#[must_use]
pub fn figure(
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
