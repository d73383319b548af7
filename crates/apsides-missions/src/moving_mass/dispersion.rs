//! Descents under their law that deviate at random.

use std::ops::Range;

use apsides_metaheuristics::Generator;
use apsides_pipeline::Error;
use apsides_pipeline::dispersion::sample_seed;
use apsides_pipeline::montecarlo::{
    Batch, LinearCovariance, Sample, Statistics, check_sizes, fly_all, gathered,
};
use serde::Serialize;

use super::case::Case;
use super::descent::{Descent, Metrics, Record};

/// Deviations of a descent under its law, or the standard deviations of many, which are normal and independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DescentDeviations {
    /// Offset of the centre of mass along y and z, m.
    pub offset_m: [f64; 2],
    /// Angle of attack and sideslip at the entry, deg.
    pub entry_angles_deg: [f64; 2],
    /// Flight path angle at the entry, deg.
    pub path_angle_deg: f64,
    /// Gain of the sensors, relative.
    pub sensor_gain: f64,
    /// Damping in pitch and yaw, relative.
    pub damping: f64,
    /// Wind towards north and east at 12 km, m/s.
    pub wind_m_s: [f64; 2],
}

impl DescentDeviations {
    /// Names in the order of [`values`](Self::values), the unit at the end.
    pub const NAMES: &'static [&'static str] = &[
        "offset_y_m",
        "offset_z_m",
        "entry_attack_deg",
        "entry_sideslip_deg",
        "entry_path_angle_deg",
        "sensor_gain",
        "damping",
        "wind_north_m_s",
        "wind_east_m_s",
    ];

    /// The deviations of the sample of an index, these being standard deviations, and a seed for its noise: functions of seed and index alone.
    #[must_use]
    pub fn sample(&self, seed: u64, index: usize) -> (Self, u64) {
        let own = sample_seed(seed, index);
        let mut random = Generator::new(own);
        let mut draw = |sigma: f64| sigma * random.normal();
        let deviations = Self {
            offset_m: self.offset_m.map(&mut draw),
            entry_angles_deg: self.entry_angles_deg.map(&mut draw),
            path_angle_deg: draw(self.path_angle_deg),
            sensor_gain: draw(self.sensor_gain),
            damping: draw(self.damping),
            wind_m_s: self.wind_m_s.map(&mut draw),
        };
        (deviations, own.rotate_left(32))
    }

    /// All of them, in the order of the names.
    #[must_use]
    pub fn values(&self) -> [f64; 9] {
        let ([a, b], [c, d], [e, f]) = (self.offset_m, self.entry_angles_deg, self.wind_m_s);
        [a, b, c, d, self.path_angle_deg, self.sensor_gain, self.damping, e, f]
    }

    /// A case with these deviations.
    #[must_use]
    pub fn applied(&self, case: &Case) -> Case {
        let mut case = case.clone();
        for k in 0..2 {
            case.vehicle.offset[k] += self.offset_m[k];
            case.wind[k] += self.wind_m_s[k];
        }
        case.entry.attack += self.entry_angles_deg[0].to_radians();
        case.entry.sideslip += self.entry_angles_deg[1].to_radians();
        case.entry.path += self.path_angle_deg.to_radians();
        case.sensors.gain *= 1.0 + self.sensor_gain;
        case.vehicle.damping_factor *= 1.0 + self.damping;
        case
    }
}

/// Descents under their law that deviate at random.
#[derive(Clone, Debug, PartialEq)]
pub struct Descents {
    /// Number of samples, those that are there already included.
    pub samples: usize,
    /// Seed of the deviations and of the noise of sensors.
    pub seed: u64,
    /// Threads; the results do not depend on it.
    pub threads: usize,
    /// Sizes of the deviations.
    pub dispersions: DescentDeviations,
}

impl Descents {
    /// Names of the results of a flight.
    pub const COLUMNS: &'static [&'static str] = &[
        "attack_rms_deg",
        "sideslip_rms_deg",
        "attack_peak_deg",
        "sideslip_peak_deg",
        "saturation_time_s",
        "mass_1_travel_m",
        "mass_2_travel_m",
        "mass_1_rate_m_s",
        "mass_2_rate_m_s",
        "flight_time_s",
    ];

    /// Flies the samples of a case behind those that are `done`, in order; `each` sees every new one and says whether to go on.
    ///
    /// # Errors
    /// As of [`fly`](Self::fly).
    pub fn run(
        &self,
        case: &Case,
        done: Vec<Sample>,
        each: impl FnMut(&Sample) -> bool,
    ) -> Result<(Vec<Sample>, Statistics), Error> {
        gathered(self.samples, self.seed, done, each, Self::COLUMNS, |indices, take| {
            self.fly(case, indices, take)
        })
    }

    /// Flies the samples of some indices, in order; `each` takes every one and says whether to go on. The results of a flight that failed are
    /// NaN.
    ///
    /// # Errors
    /// Negative or infinite sizes.
    pub fn fly(
        &self,
        case: &Case,
        indices: Range<usize>,
        each: impl FnMut(Sample) -> bool,
    ) -> Result<LinearCovariance, Error> {
        check_sizes(DescentDeviations::NAMES, &self.dispersions.values())?;
        let fly = |record: &mut Record, index: usize| {
            let (deviations, noise) = self.dispersions.sample(self.seed, index);
            let mut case = deviations.applied(case);
            case.sensors.seed = noise;
            // Deviations may make an impossible case, such as a gain below zero: it failed.
            let metrics = Descent::new(&case).and_then(|descent| descent.fly(record)).ok();
            metrics.filter(Metrics::held).as_ref().map(descent_results)
        };
        let columns = Self::COLUMNS.len();
        let of = Batch { indices, threads: self.threads, columns };
        let deviations = |index: usize| self.dispersions.sample(self.seed, index).0.values().to_vec();
        fly_all(of, deviations, || Record::every(1), fly, each);
        Ok(None)
    }
}

/// Results of a flight in the order of [`Descents::COLUMNS`].
fn descent_results(m: &Metrics) -> Vec<f64> {
    let [[a, b], [c, d]] = m.window.map_or([[f64::NAN; 2]; 2], |w| [w.rms, w.peak]);
    let mut results: Vec<f64> = [a, b, c, d].map(f64::to_degrees).into();
    results.push(m.saturated_time);
    results.extend(m.largest_travel);
    results.extend(m.largest_rate);
    results.push(m.time);
    results
}
