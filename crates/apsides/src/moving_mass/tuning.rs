//! Gains of PID laws by a search over a set of descents: the worst of all counts.
//!
//! The same gains for both angles, which are alike by symmetry. They are searched by their logarithms with CMA-ES of
//! [`apsides_metaheuristics`]; the result depends on the seed, not on the number of threads.

use apsides_control::pid::PidGains;
use apsides_metaheuristics::{
    CmaEsSettings, Evaluation, Method, Restarts, Search, SearchSpace, Stagnation, StopReason,
};

use super::cases::{CaseSet, SetFlight, worst_flight};
use super::{Case, Law, Record};
use crate::Error;

/// What is searched.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    /// The descents.
    pub set: CaseSet,
    /// Least and greatest gains: proportional, integral, derivative; all above 0.
    pub range: [[f64; 2]; 3],
    /// Gains of the first generation.
    pub starts: Vec<PidGains>,
    /// Sets of descents that are flown at most.
    pub evaluations: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Threads; the result does not depend on it.
    pub threads: usize,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    /// The gains.
    pub gains: PidGains,
    /// The flights with them.
    pub flights: Vec<SetFlight>,
    /// Sets of descents that were flown.
    pub evaluations: usize,
    /// Why the search ended.
    pub stop: StopReason,
}

/// Rate limits (m/s) with gains that hold two masses of 10 kg across the axis in all directions of an offset of 1 cm, at 2 and 10 deg at
/// the entry, with either set of damping derivatives: found by [`tune`].
pub const RATE_LIMITED_GAINS: [(f64, [f64; 3]); 5] = [
    (1.0, [34.453, 21.191, 30.502]),
    (0.5, [1.4934, 6.4189, 7.6751]),
    (0.2, [6.1845, 2.5219, 24.139]),
    (0.1, [0.001, 0.7373, 0.65616]),
    (0.05, [0.023408, 0.68235, 0.4221]),
];

impl Tuning {
    /// The set [around](CaseSet::around) a case, gains from 1 mm to 100 m per unit, 300 sets, one thread, from the tabulated gains of all
    /// rate limits.
    #[must_use]
    pub fn new(case: &Case) -> Self {
        Self {
            set: CaseSet::around(case),
            range: [[1e-3, 1e2]; 3],
            starts: RATE_LIMITED_GAINS.map(|(_, [p, i, d])| PidGains::new(p, i, d)).into(),
            evaluations: 300,
            seed: 0,
            threads: 1,
        }
    }
}

/// Degrees, beyond those of any angle, that a failed flight counts; it counts less the lower it came.
const FAILED: f64 = 1e3;

/// Searches gains for a case.
///
/// # Errors
/// What [`Descent::new`](super::Descent::new) refuses of the case, and an ill-posed search.
pub fn tune(case: &Case, tuning: &Tuning) -> Result<Tuned, Error> {
    let with = |gains: PidGains| {
        let mut case = case.clone();
        case.law = Law::pid(gains);
        case
    };
    let logs = |k: usize| tuning.range.map(|ends| ends[k].log10()).to_vec();
    let space = SearchSpace::new(logs(0), logs(1))?;
    let decode = |x: &[f64]| {
        let [p, i, d] = [0, 1, 2].map(|k| 10_f64.powf(x[k]));
        PidGains::new(p, i, d)
    };
    // The case itself is checked before the search hides its errors.
    super::Descent::new(case)?;
    let objective = |x: &[f64]| {
        let mut record = Record::every(1);
        let Ok(flights) = tuning.set.fly(&with(decode(x)), &mut record) else { return Evaluation::FAILED };
        let cost = |flight: &SetFlight| match flight.metrics.worst_rms() {
            rms if rms.is_finite() => rms.to_degrees(),
            _ => FAILED - flight.metrics.time,
        };
        Evaluation::new(flights.iter().map(cost).fold(0.0, f64::max))
    };
    let search = Search {
        method: Method::CmaEs(CmaEsSettings {
            step: 0.2,
            restarts: Restarts::TwoRegimes,
            tolerance: 1e-9,
            ..CmaEsSettings::default()
        }),
        seed: tuning.seed,
        budget: tuning.evaluations,
        threads: tuning.threads,
        stagnation: Some(Stagnation { generations: 60, improvement: 1e-9 }),
        start: tuning
            .starts
            .iter()
            .map(|g| {
                let values = [g.proportional, g.integral, g.derivative];
                (0..3).map(|k| values[k].clamp(tuning.range[k][0], tuning.range[k][1]).log10()).collect()
            })
            .collect(),
        ..Search::default()
    };
    let report = search.minimize(&space, &objective)?;
    let best = report.best.map_or_else(|| vec![0.0; 3], |best| best.x);
    let gains = decode(&best);
    let flights = tuning.set.fly(&with(gains), &mut Record::every(1))?;
    Ok(Tuned { gains, flights, evaluations: report.evaluations, stop: report.stop })
}

impl Tuned {
    /// The flight with the largest root mean square of an angle.
    #[must_use]
    pub fn worst(&self) -> Option<&SetFlight> {
        worst_flight(&self.flights)
    }

    /// Whether every flight was flown to its end.
    #[must_use]
    pub fn held(&self) -> bool {
        self.flights.iter().all(|f| f.metrics.held())
    }
}
