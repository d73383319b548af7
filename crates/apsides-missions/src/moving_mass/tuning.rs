//! Gains of PID laws, and the twelve coefficients of nonlinear ones, by a search over a set of descents: the worst of all counts, with margins
//! of the linear loops as limits.
//!
//! The same gains for both angles, which are alike by symmetry. They are searched by their logarithms with CMA-ES of
//! [`apsides_metaheuristics`]; the result depends on the seed, not on the number of threads.

use std::time::Duration;

use apsides_control::nonlinear_pid::NonlinearGains;
use apsides_control::pid::PidGains;
use apsides_metaheuristics::{
    CmaEsSettings, Evaluation, Method, Restarts, Search, SearchSpace, Stagnation, StopReason,
};

use super::cases::{CaseSet, SetFlight, worst_flight};
use super::margins::LeastMargins;
use super::{Case, Descent, Law, Record};
use apsides_pipeline::Error;

/// A search of gains.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    /// The descents.
    pub set: CaseSet,
    /// Margins that the loops must have.
    pub required: RequiredMargins,
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
    /// Longest time of the search, looked at after each generation; the result depends on it.
    pub time_limit: Option<Duration>,
}

/// Gains that a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    /// The gains.
    pub gains: TunedGains,
    /// The flights with them.
    pub flights: Vec<SetFlight>,
    /// Margins of the loops with them.
    pub margins: LeastMargins,
    /// Sets of descents that were flown.
    pub evaluations: usize,
    /// The reason for the end of the search.
    pub stop: StopReason,
}

/// The numbers of a tuned law, the same for both angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TunedGains {
    /// Gains of the linear law.
    Linear(PidGains),
    /// Coefficients of the nonlinear law: `k1, k2, mu, epsilon` of the error, of its integral, of its rate; all positive, as Karimabadeh and Tayefi have it.
    Nonlinear([f64; TWELVE]),
}

/// Coefficients of a nonlinear law.
const TWELVE: usize = 12;

impl TunedGains {
    /// The law with these numbers.
    #[must_use]
    pub fn law(&self) -> Law {
        match self {
            Self::Linear(gains) => Law::pid(*gains),
            Self::Nonlinear(c) => {
                Law::NonlinearPid { gains: [NonlinearGains::from_coefficients(c); 2], filter_time: 0.0 }
            }
        }
    }
}

/// Least and greatest coefficients of a term of the nonlinear law: `k1`, `k2`, `mu`, `epsilon`.
const TERM_RANGE: [[f64; 2]; 4] = [[1e-3, 1e2], [1e-3, 1e2], [1e-1, 1e4], [0.3, 1.5]];
/// `k2` and `mu` of the first generation: next to nothing, and a bend at some 6 deg.
const FIRST_NEAR: f64 = 1e-2;
const FIRST_STEEPNESS: f64 = 100.0;

/// Rate limits (m/s) with gains that hold two masses of 10 kg across the axis in all directions of an offset of 1 cm, at 2 and 10 deg at
/// the entry, with either set of damping derivatives and the margins of [`RequiredMargins::default`]: found by [`tune`].
pub const RATE_LIMITED_GAINS: [(f64, [f64; 3]); 5] = [
    (1.0, [19.03, 20.68, 7.284]),
    (0.5, [1.076, 8.458, 7.533]),
    (0.2, [0.3, 2.513, 7.391]),
    (0.1, [0.02032, 0.7798, 2.361]),
    (0.05, [0.002317, 1.229, 0.6327]),
];

/// Gains that a search starts from: (10, 5, 5), which hold ideal actuators, and gains for limited rates from 0.5 to 0.05 m/s, of an independent
/// simulation with the unstable damping derivatives.
const STARTS: [[f64; 3]; 5] = [
    [10.0, 5.0, 5.0],
    [34.453, 21.191, 30.502],
    [6.184, 2.522, 24.139],
    [0.429, 1.082, 3.490],
    [0.031, 1.018, 1.170],
];

/// Lower limits of the [least margins](LeastMargins) of a case; a factor up to 1, a phase and a delay up to 0 ask for nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequiredMargins {
    /// Factor by which the gain may grow or fall.
    pub gain: f64,
    /// Phase, rad.
    pub phase: f64,
    /// Delay, s.
    pub delay: f64,
}

impl Default for RequiredMargins {
    /// A factor of 2, 30 deg, 20 ms.
    fn default() -> Self {
        Self { gain: 2.0, phase: 30_f64.to_radians(), delay: 0.02 }
    }
}

impl RequiredMargins {
    /// Returns true if margins are at least these, and the loops stable.
    #[must_use]
    pub fn met_by(&self, found: &LeastMargins) -> bool {
        self.missing(found) == 0.0
    }

    /// The largest part of a required margin that is missing, 0 to 1; 1 where a loop is not stable.
    fn missing(&self, found: &LeastMargins) -> f64 {
        if !found.stable && (self.gain > 1.0 || self.phase > 0.0 || self.delay > 0.0) {
            return 1.0;
        }
        let gain = if self.gain > 1.0 { 1.0 - found.gain.ln() / self.gain.ln() } else { 0.0 };
        let part = |found: f64, wanted: f64| if wanted > 0.0 { 1.0 - found / wanted } else { 0.0 };
        gain.max(part(found.phase, self.phase)).max(part(found.delay, self.delay)).max(0.0)
    }
}

impl Tuning {
    /// The set [around](CaseSet::around) a case, gains from 1 mm to 100 m per unit, 300 sets, one thread, from gains for ideal and for slow
    /// actuators.
    #[must_use]
    pub fn new(case: &Case) -> Self {
        Self {
            set: CaseSet::around(case),
            required: RequiredMargins::default(),
            range: [[1e-3, 1e2]; 3],
            starts: STARTS.map(|[p, i, d]| PidGains::new(p, i, d)).into(),
            evaluations: 300,
            seed: 0,
            threads: 1,
            time_limit: None,
        }
    }
}

/// Degrees, beyond those of any angle, that a failed flight counts; it counts less the lower it came.
const FAILED: f64 = 1e3;
/// Degrees that a loop without any of a required margin counts besides: more than an angle that is held.
const NO_MARGIN: f64 = 10.0;

/// The numbers that are searched, by their logarithms to the base ten.
struct Unknowns<'a> {
    tuning: &'a Tuning,
    nonlinear: bool,
}

impl Unknowns<'_> {
    fn range(&self) -> Vec<[f64; 2]> {
        if self.nonlinear {
            (0..TWELVE).map(|k| TERM_RANGE[k % TERM_RANGE.len()]).collect()
        } else {
            self.tuning.range.to_vec()
        }
    }

    fn space(&self) -> Result<SearchSpace, Error> {
        let ends = |k: usize| self.range().iter().map(|r| r[k].log10()).collect::<Vec<f64>>();
        Ok(SearchSpace::new(ends(0), ends(1))?)
    }

    fn gains(&self, x: &[f64]) -> TunedGains {
        let at = |k: usize| 10_f64.powf(x.get(k).copied().unwrap_or(0.0));
        if self.nonlinear {
            TunedGains::Nonlinear(std::array::from_fn(at))
        } else {
            TunedGains::Linear(PidGains::new(at(0), at(1), at(2)))
        }
    }

    /// Points of the first generation: the linear gains, of the nonlinear law with little else.
    fn starts(&self) -> Vec<Vec<f64>> {
        let point = |g: &PidGains| {
            let values = [g.proportional, g.integral, g.derivative];
            let all: Vec<f64> = if self.nonlinear {
                values.iter().flat_map(|k| [*k, FIRST_NEAR, FIRST_STEEPNESS, 1.0]).collect()
            } else {
                values.to_vec()
            };
            all.iter().zip(self.range()).map(|(v, [least, most])| v.clamp(least, most).log10()).collect()
        };
        self.tuning.starts.iter().map(point).collect()
    }
}

/// Searches gains for a case: those of the nonlinear law where the case has it, of the linear law otherwise.
///
/// # Errors
/// Those of [`Descent::new`](super::Descent::new) for the case, and an ill-posed search.
pub fn tune(case: &Case, tuning: &Tuning) -> Result<Tuned, Error> {
    let with = |gains: TunedGains| {
        let mut case = case.clone();
        case.law = gains.law();
        case
    };
    let unknowns = Unknowns { tuning, nonlinear: matches!(case.law, Law::NonlinearPid { .. }) };
    let space = unknowns.space()?;
    // The case itself is checked before the search hides its errors.
    Descent::new(case)?;
    let objective = |x: &[f64]| {
        let mut record = Record::every(1);
        let case = with(unknowns.gains(x));
        let Ok(flights) = tuning.set.fly(&case, &mut record) else { return Evaluation::FAILED };
        let cost = |flight: &SetFlight| match flight.metrics.worst_rms() {
            rms if rms.is_finite() => rms.to_degrees(),
            _ => FAILED - flight.metrics.time,
        };
        let worst = flights.iter().map(cost).fold(0.0, f64::max);
        if !flights.iter().all(|f| f.metrics.held()) {
            return Evaluation::new(worst);
        }
        let Ok(margins) = LeastMargins::of(&case, &tuning.set.damping, &mut record) else {
            return Evaluation::FAILED;
        };
        Evaluation::new(worst + NO_MARGIN * tuning.required.missing(&margins))
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
        time_limit: tuning.time_limit,
        stagnation: Some(Stagnation { generations: 60, improvement: 1e-9 }),
        start: unknowns.starts(),
        ..Search::default()
    };
    let report = search.minimize(&space, &objective)?;
    let best = report.best.map_or_else(Vec::new, |best| best.x);
    let gains = unknowns.gains(&best);
    let (case, mut record) = (with(gains), Record::every(1));
    let flights = tuning.set.fly(&case, &mut record)?;
    let margins = LeastMargins::of(&case, &tuning.set.damping, &mut record)?;
    Ok(Tuned { gains, flights, margins, evaluations: report.evaluations, stop: report.stop })
}

impl Tuned {
    /// True if the search ended by its time limit: the gains are the best until then.
    #[must_use]
    pub fn ended_by_time(&self) -> bool {
        self.stop == StopReason::TimeLimit
    }

    /// The flight with the largest root mean square of an angle.
    #[must_use]
    pub fn worst(&self) -> Option<&SetFlight> {
        worst_flight(&self.flights)
    }

    /// The largest root mean square, rad, of the flights that differ from the case in the direction of the offset alone.
    #[must_use]
    pub fn worst_rms_of_directions(&self) -> f64 {
        let [own, ..] = &self.flights[..] else { return f64::NAN };
        let alone = self.flights.iter().filter(|f| f.attack == own.attack && f.damping == own.damping);
        alone.map(|f| f.metrics.worst_rms()).fold(0.0, f64::max)
    }

    /// Returns true if every flight was flown to its end.
    #[must_use]
    pub fn held(&self) -> bool {
        self.flights.iter().all(|f| f.metrics.held())
    }
}
