//! Monte Carlo: many flights that deviate, from a solved one with the thrust of the plan or planned anew, or simulated under their law.
//!
//! The deviations of a sample depend on seed and index alone, so that results are the same for any number of threads, and a run can be
//! continued behind the samples that are there.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::thread;

use serde::Serialize;

use crate::Error;
use crate::dispersion::{Deviations, Guidance, Onboard};
use crate::fault::{Fault, guarded};
use crate::memory::Foreseen;
use crate::outcome::Outcome;
use crate::pipeline::Pipeline;

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
}

/// One result over all flights that ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Its name, the unit at the end.
    pub name: String,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// Standard deviation by the state-transition matrix of the planned flight, with its thrust.
    pub linear_sigma: Option<f64>,
    /// Percentiles 1, 50, 99.
    pub percentiles: [f64; 3],
    /// Largest absolute value.
    pub largest: f64,
}

/// The ellipse of one standard deviation of the ends over ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ellipse {
    /// Its centre along and across the course, m.
    pub centre_m: [f64; 2],
    /// Its semi-axes, the larger first, m.
    pub semi_axes_m: [f64; 2],
    /// Angle of the larger one from the course, to the right, deg.
    pub angle_deg: f64,
}

/// The statistics of the samples.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of flights.
    pub samples: usize,
    /// Those that did not end.
    pub failed: usize,
    /// Part of all flights that ended within 1 m of the planned end, where there is one.
    pub within_1_m: Option<f64>,
    /// Each result.
    pub spreads: Vec<Spread>,
    /// Ends over ground.
    pub ellipse: Option<Ellipse>,
    /// The same by the state-transition matrix.
    pub linear_ellipse: Option<Ellipse>,
    /// Covariance of the results that have a linear sigma, by the state-transition matrix, row-major.
    pub linear_covariance: Option<Vec<f64>>,
    /// Samples whose computation panicked; they count among those that failed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

impl MonteCarlo {
    /// Flies the samples behind those that are `done`, in order; `each` sees every new one and says whether to go on.
    ///
    /// # Errors
    /// A mission without dispersions or a plan that cannot be flown; negative or infinite sizes.
    pub fn run(
        &self,
        mission: &Pipeline,
        plan: &Outcome,
        done: Vec<Sample>,
        each: impl FnMut(&Sample) -> bool,
    ) -> Result<(Vec<Sample>, Statistics), Error> {
        self.check(mission)?;
        let columns = mission.kind().offers.dispersed;
        let flights = mission.decided(&plan.decisions)?.mission().dispersed(&plan.trajectory)?;
        let flights = flights.ok_or_else(|| without_flights(mission))?;
        let deviations = |index: usize| self.dispersions.sample(self.seed, index).values().to_vec();
        let fly = |_: &mut (), index: usize| {
            let deviation = self.dispersions.sample(self.seed, index);
            flights.fly(&deviation, &self.guidance, &self.onboard)
        };
        let of =
            Batch { samples: self.samples, threads: self.threads, seed: self.seed, columns: columns.len() };
        let (done, faults) = fly_all(of, done, deviations, || (), fly, each);
        let linear = match self.guidance {
            Guidance::OpenLoop => flights.linear_covariance(&self.dispersions),
            _ => None,
        };
        let statistics = Statistics { faults, ..statistics(&done, columns, linear) };
        Ok((done, statistics))
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
        "`{}` has no Monte Carlo; missions that have: {}",
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

/// Samples that are computed together.
#[derive(Clone, Copy, Debug)]
pub struct Batch {
    /// Number of samples, those that are there already included.
    pub samples: usize,
    /// Threads; the results do not depend on it.
    pub threads: usize,
    /// Seed of the deviations.
    pub seed: u64,
    /// Results of a sample.
    pub columns: usize,
}

impl Batch {
    /// The memory of all samples with their deviations and statistics.
    #[must_use]
    pub fn foreseen_memory(samples: usize, deviations: usize, columns: usize) -> Foreseen {
        // The numbers of a sample, its two lists with what the allocator adds, and one column sorted.
        let each = 8 * (deviations + columns) + 128;
        Foreseen { bytes: samples as f64 * each as f64, cause: format!("{samples} samples") }
    }
}

/// Flies samples behind those that are done on several threads, each with a workspace of its own, and hands them on in their order.
/// `deviations` gives those of an index, `fly` the results, none where a flight did not end. A sample whose flight panics has none either; its
/// fault is returned.
pub fn fly_all<W>(
    batch: Batch,
    mut done: Vec<Sample>,
    deviations: impl Fn(usize) -> Vec<f64> + Sync,
    workspace: impl Fn() -> W + Sync,
    fly: impl Fn(&mut W, usize) -> Option<Vec<f64>> + Sync,
    mut each: impl FnMut(&Sample) -> bool,
) -> (Vec<Sample>, Vec<Fault>) {
    let Batch { samples, threads, seed, columns } = batch;
    let faults = Mutex::new(Vec::new());
    done.truncate(samples);
    let (next, stopped) = (AtomicUsize::new(done.len()), AtomicBool::new(false));
    let (sender, inbox) = mpsc::channel::<Sample>();
    thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            let sender = sender.clone();
            let (next, stopped, workspace, fly) = (&next, &stopped, &workspace, &fly);
            let (deviations, faults) = (&deviations, &faults);
            scope.spawn(move || {
                let mut place = workspace();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= samples || stopped.load(Ordering::Relaxed) {
                        break;
                    }
                    let results = guarded(|| fly(&mut place, index)).unwrap_or_else(|message| {
                        // A flight that broke off may have left anything in its workspace.
                        place = workspace();
                        let fault = Fault { index, seed, message };
                        faults.lock().unwrap_or_else(PoisonError::into_inner).push(fault);
                        None
                    });
                    let results = results.unwrap_or_else(|| vec![f64::NAN; columns]);
                    // The receiver outlives all threads.
                    let _ = sender.send(Sample { index, deviations: deviations(index), results });
                }
            });
        }
        drop(sender);
        // Out of order they wait for those before them.
        let mut waiting = std::collections::BTreeMap::new();
        for sample in inbox {
            waiting.insert(sample.index, sample);
            while let Some(sample) = waiting.remove(&done.len()) {
                if !each(&sample) {
                    stopped.store(true, Ordering::Relaxed);
                }
                done.push(sample);
            }
        }
    });
    let mut faults = faults.into_inner().unwrap_or_else(PoisonError::into_inner);
    faults.sort_by_key(|f| f.index);
    (done, faults)
}

/// The statistics of samples, by the names of their results; `linear_covariance` is that of the first ones by the state-transition matrix.
#[must_use]
pub fn statistics(samples: &[Sample], columns: &[&str], linear_covariance: Option<Vec<f64>>) -> Statistics {
    let linear = linear_covariance.as_deref().unwrap_or_default();
    let rows = linear.len().isqrt();
    let ended: Vec<&Sample> = samples.iter().filter(|s| s.results.iter().all(|v| v.is_finite())).collect();
    let column = |name: &str| columns.iter().position(|c| *c == name);
    let spread = |(k, name): (usize, &&str)| {
        let mut values: Vec<f64> = ended.iter().map(|s| s.results[k]).collect();
        values.sort_by(f64::total_cmp);
        let mean = mean(&values);
        Spread {
            name: (*name).to_owned(),
            mean,
            sigma: covariance(&values, &values, mean, mean).sqrt(),
            linear_sigma: (k < rows).then(|| linear[k * rows + k].sqrt()),
            percentiles: [0.01, 0.5, 0.99].map(|p| percentile(&values, p)),
            largest: values.iter().fold(0.0, |m: f64, v| m.max(v.abs())),
        }
    };
    let spreads: Vec<Spread> = columns.iter().enumerate().map(spread).collect();
    let places = column("up_m").zip(column("along_m")).zip(column("across_m"));
    let near = |s: &&&Sample| {
        places.is_some_and(|((u, a), c)| {
            [u, a, c].iter().map(|k| s.results[*k].powi(2)).sum::<f64>().sqrt() <= 1.0
        })
    };
    let within = places.map(|_| ended.iter().filter(near).count() as f64 / samples.len().max(1) as f64);
    let ellipse = places.filter(|_| ended.len() > 2).map(|((_, along), across)| {
        let of = |k: usize| ended.iter().map(|s| s.results[k]).collect::<Vec<f64>>();
        ellipse(&of(along), &of(across))
    });
    let linear_ellipse = places.filter(|((_, a), c)| *a.max(c) < rows).map(|((_, a), c)| {
        let entry = |i: usize, j: usize| linear[i * rows + j];
        Ellipse::of([0.0; 2], entry(a, a), entry(c, c), entry(a, c))
    });
    Statistics {
        samples: samples.len(),
        failed: samples.len() - ended.len(),
        within_1_m: within,
        spreads,
        ellipse,
        linear_ellipse,
        linear_covariance,
        faults: Vec::new(),
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn covariance(a: &[f64], b: &[f64], mean_a: f64, mean_b: f64) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
    sum / (a.len() as f64 - 1.0)
}

/// The value at a part of sorted values, between neighbours by a straight line.
fn percentile(values: &[f64], part: f64) -> f64 {
    let place = part * (values.len() as f64 - 1.0);
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    match (values.get(low), values.get(high)) {
        (Some(a), Some(b)) => a + (place - low as f64) * (b - a),
        _ => f64::NAN,
    }
}

fn ellipse(along: &[f64], across: &[f64]) -> Ellipse {
    let (a, c) = (mean(along), mean(across));
    let (aa, cc) = (covariance(along, along, a, a), covariance(across, across, c, c));
    let ac = covariance(along, across, a, c);
    Ellipse::of([a, c], aa, cc, ac)
}

impl Ellipse {
    /// From its centre and the covariance along and across the course.
    fn of(centre_m: [f64; 2], along: f64, across: f64, both: f64) -> Self {
        let (middle, half) = (0.5 * (along + across), (0.25 * (along - across).powi(2) + both * both).sqrt());
        Self {
            centre_m,
            semi_axes_m: [(middle + half).sqrt(), (middle - half).max(0.0).sqrt()],
            angle_deg: (0.5 * (2.0 * both).atan2(along - across)).to_degrees(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_panic_is_a_sample_that_failed() {
        let batch = |threads| Batch { samples: 40, threads, seed: 7, columns: 1 };
        let fly = |state: &mut f64, index: usize| {
            *state += 1.0;
            assert!(index != 5 && index != 23, "flight {index} broke off");
            (index != 11).then(|| vec![index as f64])
        };
        let deviations = |index: usize| vec![0.5 * index as f64];
        let flown = |threads| fly_all(batch(threads), Vec::new(), deviations, || 0.0, fly, |_| true);
        let (samples, faults) = flown(3);
        assert_eq!(samples.len(), 40);
        let failed: Vec<usize> = samples.iter().filter(|s| s.results[0].is_nan()).map(|s| s.index).collect();
        assert_eq!(failed, [5, 11, 23]);
        assert!(samples.iter().all(|s| s.deviations == deviations(s.index)));
        let message = |index: usize| Fault { index, seed: 7, message: format!("flight {index} broke off") };
        assert_eq!(faults, [message(5), message(23)]);
        assert!(faults[1].to_string().starts_with("sample 23 of seed 7 has no result"));
        assert_eq!(flown(1).1, faults);
        let statistics = Statistics { faults, ..statistics(&samples, &["end_m"], None) };
        assert_eq!((statistics.samples, statistics.failed, statistics.faults.len()), (40, 3, 2));
    }

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn percentiles_and_ellipses() {
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        assert_eq!([0.01, 0.5, 0.995].map(|p| percentile(&values, p)), [1.0, 50.0, 99.5]);
        assert!(percentile(&[], 0.5).is_nan());
        // Points on a line at 30 deg to the right of the course.
        let points: Vec<f64> = (-10..=10).map(f64::from).collect();
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let along: Vec<f64> = points.iter().map(|p| 3.0 + cos * p).collect();
        let across: Vec<f64> = points.iter().map(|p| sin * p).collect();
        let e = ellipse(&along, &across);
        assert!((e.angle_deg - 30.0).abs() < 1e3 * ROUNDING && (e.centre_m[0] - 3.0).abs() < ROUNDING);
        assert!(
            (e.semi_axes_m[0] - (770.0_f64 / 20.0).sqrt()).abs() < 1e3 * ROUNDING
                && e.semi_axes_m[1] < 1e6 * ROUNDING
        );
    }
}
