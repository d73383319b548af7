//! Monte Carlo: many flights that deviate, from a solved one with the thrust of the plan or planned anew, or simulated under their law.
//!
//! The deviations of a sample depend on seed and index alone, so that results are the same for any number of threads, and a run can be
//! continued behind the samples that are there.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use serde::Serialize;

use crate::Error;
use crate::dispersion::{Deviations, Guidance, Onboard};
use crate::fault::{Fault, guarded};
use crate::memory::Foreseen;
use crate::outcome::Outcome;
use crate::pipeline::Pipeline;

mod exact_sum;
mod percentiles;
mod proportion;
mod statistics;

pub use proportion::Proportion;
pub use statistics::{Ellipse, Extreme, Spread, Statistics, statistics, statistics_in_passes};

/// Least time between two plans.
const SHORTEST_PERIOD_S: f64 = 1.0;

/// A run of flights: how many, how they deviate and how they are steered.
#[derive(Clone, Debug, PartialEq)]
pub struct MonteCarlo {
    /// Number of samples, those that are there already included.
    pub samples: usize,
    /// Seed of the deviations.
    pub seed: u64,
    /// Threads; the results do not depend on it.
    pub threads: usize,
    /// Sizes of the deviations.
    pub dispersions: Deviations,
    /// Steering.
    pub guidance: Guidance,
    /// Knowledge and reserve of the steering.
    pub onboard: Onboard,
}

/// One flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Index from 0.
    pub index: usize,
    /// Its deviations, in the order of [`Deviations::names`].
    pub deviations: Vec<f64>,
    /// Its results, in the order of the columns of the kind of mission ([`Offers::dispersed`](crate::Offers::dispersed)); NaN all over for a flight
    /// that did not end.
    pub results: Vec<f64>,
    /// The message of the panic that ended its computation, where there was one. Rows do not have it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

impl Sample {
    /// The fault of a sample of a run of this seed.
    #[must_use]
    pub fn fault_of(&self, seed: u64) -> Option<Fault> {
        self.fault.clone().map(|message| Fault { index: self.index, seed, message })
    }
}

impl MonteCarlo {
    /// Flies the samples behind those that are `done`, in order; `each` sees every new one and says whether to go on.
    ///
    /// # Errors
    /// As of [`fly`](Self::fly).
    pub fn run(
        &self,
        mission: &Pipeline,
        plan: &Outcome,
        done: Vec<Sample>,
        each: impl FnMut(&Sample) -> bool,
    ) -> Result<(Vec<Sample>, Statistics), Error> {
        let columns = mission.kind().offers.dispersed;
        gathered(self.samples, self.seed, done, each, columns, |indices, take| {
            self.fly(mission, plan, indices, take)
        })
    }

    /// Flies the samples of some indices, in order; `each` takes every one and says whether to go on.
    ///
    /// # Errors
    /// A mission without dispersions or a plan that cannot be flown; negative or infinite sizes.
    pub fn fly(
        &self,
        mission: &Pipeline,
        plan: &Outcome,
        indices: Range<usize>,
        each: impl FnMut(Sample) -> bool,
    ) -> Result<LinearCovariance, Error> {
        self.check(mission)?;
        let columns = mission.kind().offers.dispersed.len();
        let flights = mission.decided(&plan.decisions)?.mission().dispersed(&plan.trajectory)?;
        let flights = flights.ok_or_else(|| without_flights(mission))?;
        if let Some(reason) = flights.refused(&self.guidance) {
            return Err(Error::Conflict { place: "guidance".into(), reason: reason.into() });
        }
        let deviations = |index: usize| self.dispersions.sample(self.seed, index).values().to_vec();
        let fly = |_: &mut (), index: usize| {
            let deviation = self.dispersions.sample(self.seed, index);
            flights.fly(&deviation, &self.guidance, &self.onboard)
        };
        fly_all(Batch { indices, threads: self.threads, columns }, deviations, || (), fly, each);
        Ok(match self.guidance {
            Guidance::OpenLoop => flights.linear_covariance(&self.dispersions),
            _ => None,
        })
    }

    /// Refuses, before a plan is solved, what [`run`](Self::run) would refuse after it.
    ///
    /// # Errors
    /// A mission without dispersions; negative or infinite sizes, a steering that makes no sense.
    pub fn check(&self, mission: &Pipeline) -> Result<(), Error> {
        if mission.kind().offers.dispersed.is_empty() {
            return Err(without_flights(mission));
        }
        check_sizes(&Deviations::names(), &self.dispersions.values())?;
        self.check_steering()
    }

    fn check_steering(&self) -> Result<(), Error> {
        let conflict = |place: &str, reason: String| Err(Error::Conflict { place: place.into(), reason });
        if let Guidance::Replanned(r) = &self.guidance {
            if let Some(t) = r.at_s.iter().find(|t| !(**t >= 0.0 && t.is_finite())) {
                return conflict("re-planning", format!("{t} s is not a time of the flight"));
            }
            if let Some(period) = r.every_s.filter(|p| !(*p >= SHORTEST_PERIOD_S && p.is_finite())) {
                let reason = format!("every {period} s is too often: {SHORTEST_PERIOD_S} s at least");
                return conflict("re-planning", reason);
            }
        }
        if let Guidance::LinearRadial(law) = &self.guidance {
            let gains = [law.along, law.along_speed, law.across, law.across_speed];
            if let Some(gain) = gains.iter().find(|gain| !gain.is_finite()) {
                return conflict("feed-forward", format!("{gain} is not a gain: finite numbers alone"));
            }
        }
        match self.onboard.full_thrust_n {
            Some(thrust) if !(thrust > 0.0 && thrust.is_finite()) => {
                conflict("thrust in flight", format!("{thrust} N is not a thrust"))
            }
            _ => Ok(()),
        }
    }
}

fn without_flights(mission: &Pipeline) -> Error {
    Error::in_mission(format!(
        "`{}` has no Monte Carlo with these deviations; missions that have: {}; every optimised one flies its controls in open loop from \
         another start (`--state NAME=SIGMA`) or with other numbers (`--vary KEY=SIGMA`), or is solved anew with them (`--sigma KEY=SIGMA`)",
        mission.name(),
        mission.kinds_that(|o| !o.dispersed.is_empty())
    ))
}

/// Refuses standard deviations that are negative or not finite.
///
/// # Errors
/// The first of them, by name.
pub fn check_sizes(names: &[&str], sizes: &[f64]) -> Result<(), Error> {
    match names.iter().zip(sizes).find(|(_, sigma)| !(**sigma >= 0.0 && sigma.is_finite())) {
        None => Ok(()),
        Some((name, sigma)) => {
            let reason =
                format!("the standard deviation of `{name}` is {sigma}, it must be finite and not negative");
            Err(Error::Conflict { place: "dispersions".into(), reason })
        }
    }
}

/// Covariance of the first results by the state-transition matrix of the plan, row-major, where there is one.
pub type LinearCovariance = Option<Vec<f64>>;

/// Samples that are computed together.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Their indices.
    pub indices: Range<usize>,
    /// Threads; the results do not depend on it.
    pub threads: usize,
    /// Results of a sample.
    pub columns: usize,
}

impl Batch {
    /// The memory of samples that are held, with their deviations and statistics.
    #[must_use]
    pub fn foreseen_memory(samples: usize, deviations: usize, columns: usize) -> Foreseen {
        // The numbers of a sample, its two lists with what the allocator adds, and one column sorted.
        let each = 8 * (deviations + columns) + 128;
        Foreseen { bytes: samples as f64 * each as f64, cause: format!("{samples} samples") }
    }
}

/// All samples of a run that are kept in memory, with their statistics: those that are `done`, and those that `fly` hands on behind them, which
/// `each` sees.
///
/// # Errors
/// As of `fly`.
pub fn gathered(
    samples: usize,
    seed: u64,
    mut done: Vec<Sample>,
    mut each: impl FnMut(&Sample) -> bool,
    columns: &[&str],
    fly: impl FnOnce(Range<usize>, &mut dyn FnMut(Sample) -> bool) -> Result<LinearCovariance, Error>,
) -> Result<(Vec<Sample>, Statistics), Error> {
    done.truncate(samples);
    let linear_covariance = fly(done.len()..samples, &mut |sample| {
        let go_on = each(&sample);
        done.push(sample);
        go_on
    })?;
    let statistics = statistics(&done, columns, linear_covariance);
    let faults = done.iter().filter_map(|sample| sample.fault_of(seed)).collect();
    Ok((done, Statistics { faults, ..statistics }))
}

/// Flies samples on several threads, each with a workspace of its own, and hands them on in their order until `each` returns false; those that
/// are under way then are handed on as well, as far as none is missing before them. `deviations` gives those of an index, `fly` the results,
/// none where a flight did not end. A sample whose flight panics has none either, and the message of the panic.
pub fn fly_all<W>(
    batch: Batch,
    deviations: impl Fn(usize) -> Vec<f64> + Sync,
    workspace: impl Fn() -> W + Sync,
    fly: impl Fn(&mut W, usize) -> Option<Vec<f64>> + Sync,
    mut each: impl FnMut(Sample) -> bool,
) {
    let Batch { indices, threads, columns } = batch;
    let (next, stopped) = (AtomicUsize::new(indices.start), AtomicBool::new(false));
    let (sender, inbox) = mpsc::channel::<Sample>();
    thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            let sender = sender.clone();
            let (next, stopped, workspace, fly) = (&next, &stopped, &workspace, &fly);
            let deviations = &deviations;
            scope.spawn(move || {
                let mut place = workspace();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= indices.end || stopped.load(Ordering::Relaxed) {
                        break;
                    }
                    let (results, fault) = match guarded(|| fly(&mut place, index)) {
                        Ok(results) => (results, None),
                        Err(message) => {
                            // A flight that broke off may have left anything in its workspace.
                            place = workspace();
                            (None, Some(message))
                        }
                    };
                    let results = results.unwrap_or_else(|| vec![f64::NAN; columns]);
                    // The receiver outlives all threads.
                    let _ = sender.send(Sample { index, deviations: deviations(index), results, fault });
                }
            });
        }
        drop(sender);
        // Out of order they wait for those before them.
        let mut waiting = BTreeMap::new();
        let mut expected = indices.start;
        for sample in inbox {
            waiting.insert(sample.index, sample);
            while let Some(sample) = waiting.remove(&expected) {
                expected += 1;
                if !each(sample) {
                    stopped.store(true, Ordering::Relaxed);
                }
            }
        }
    });
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_panic_is_a_sample_that_failed() {
        const SEED: u64 = 7;
        let batch = |threads, indices| Batch { indices, threads, columns: 1 };
        let fly = |state: &mut f64, index: usize| {
            *state += 1.0;
            assert!(index != 5 && index != 23, "flight {index} broke off");
            (index != 11).then(|| vec![index as f64])
        };
        let deviations = |index: usize| vec![0.5 * index as f64];
        let flown = |threads, indices| {
            let mut samples = Vec::new();
            fly_all(
                batch(threads, indices),
                deviations,
                || 0.0,
                fly,
                |sample| {
                    samples.push(sample);
                    true
                },
            );
            let faults: Vec<Fault> = samples.iter().filter_map(|s: &Sample| s.fault_of(SEED)).collect();
            (samples, faults)
        };
        let (samples, faults) = flown(3, 0..40);
        assert_eq!(samples.len(), 40);
        let failed: Vec<usize> = samples.iter().filter(|s| s.results[0].is_nan()).map(|s| s.index).collect();
        assert_eq!(failed, [5, 11, 23]);
        assert!(samples.iter().all(|s| s.deviations == deviations(s.index)));
        let message =
            |index: usize| Fault { index, seed: SEED, message: format!("flight {index} broke off") };
        assert_eq!(faults, [message(5), message(23)]);
        assert!(faults[1].to_string().starts_with("sample 23 of seed 7 has no result"));
        assert_eq!(flown(1, 0..40).1, faults);
        let statistics = Statistics { faults, ..statistics(&samples, &["end_m"], None) };
        assert_eq!((statistics.samples, statistics.failed, statistics.faults.len()), (40, 3, 2));
        // A part has the samples of the whole, without those before it.
        let (part, faults) = flown(2, 20..30);
        assert_eq!(part.iter().map(|s| s.index).collect::<Vec<_>>(), (20..30).collect::<Vec<_>>());
        assert!(part.iter().zip(&samples[20..]).all(|(a, b)| a.deviations == b.deviations));
        assert_eq!(faults, [message(23)]);
        assert!(flown(2, 30..30).0.is_empty());
    }

    #[test]
    fn who_takes_the_samples_ends_the_work() {
        let batch = Batch { indices: 10..1_000_000, threads: 2, columns: 1 };
        let mut taken = Vec::new();
        let fly = |_: &mut (), index: usize| Some(vec![index as f64]);
        fly_all(
            batch,
            |_| Vec::new(),
            || (),
            fly,
            |sample| {
                taken.push(sample.index);
                sample.index < 12
            },
        );
        assert!(taken.len() < 1_000_000);
        assert_eq!(taken, (10..10 + taken.len()).collect::<Vec<_>>());
    }
}
