//! Statistics of samples, of one run or of the parts of one: the same bits however it was divided, in memory that does not grow with the
//! samples.
//!
//! With `S_a` and `S_ab` the sums of a result and of products of two, both without rounding, the mean is `S_a / n` and the covariance
//! `(n S_ab - S_a S_b) / (n (n - 1))`.

use std::cmp::Ordering;
use std::convert::Infallible;

use serde::Serialize;

use super::Sample;
use super::exact_sum::ExactSum;
use super::percentiles::{RankSearch, ranks_of};
use super::proportion::Proportion;
use crate::fault::Fault;

/// Parts of all flights whose values are told.
const PERCENTILES: [f64; 3] = [0.01, 0.5, 0.99];

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
    /// The least value.
    pub least: Extreme,
    /// The greatest value.
    pub greatest: Extreme,
}

/// A value that no other exceeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extreme {
    /// The value; NaN where no flight ended.
    pub value: f64,
    /// Index of the first sample that has it.
    pub sample: Option<usize>,
}

impl Extreme {
    /// True if this one is beyond another on a side of it, or of an earlier sample at the same place.
    fn exceeds(&self, other: &Self, side: Ordering) -> bool {
        match (other.sample, self.value.total_cmp(&other.value)) {
            (None, _) => true,
            (_, Ordering::Equal) => self.sample < other.sample,
            (_, found) => found == side,
        }
    }
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
    /// Flights that ended, with an interval of confidence.
    pub success: Proportion,
    /// Part of all flights that ended within 1 m of the planned end, where there is one.
    pub within_1_m: Option<f64>,
    /// Interval of 95 % confidence for its probability, as of [`success`](Self::success).
    pub within_1_m_interval: Option<[f64; 2]>,
    /// Each result.
    pub spreads: Vec<Spread>,
    /// Covariance of the results of flights that ended, row-major in the order of [`spreads`](Self::spreads).
    pub covariance: Vec<f64>,
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

impl Statistics {
    /// That of the result of this name.
    #[must_use]
    pub fn spread(&self, name: &str) -> Option<&Spread> {
        self.spreads.iter().find(|spread| spread.name == name)
    }
}

/// The statistics of samples in memory, by the names of their results; `linear_covariance` is that of the first ones by the state-transition
/// matrix.
#[must_use]
pub fn statistics(samples: &[Sample], columns: &[&str], linear_covariance: Option<Vec<f64>>) -> Statistics {
    let all = |each: &mut dyn FnMut(&Sample)| {
        samples.iter().for_each(each);
        Ok::<(), Infallible>(())
    };
    match statistics_in_passes(columns, linear_covariance, all) {
        Ok(statistics) => statistics,
        Err(never) => match never {},
    }
}

/// The statistics of samples that are read again and again: `pass` hands all of them on, in the order of their indices, each time it is called,
/// at most four times.
///
/// # Errors
/// The first of a pass.
pub fn statistics_in_passes<E>(
    columns: &[&str],
    linear_covariance: Option<Vec<f64>>,
    mut pass: impl FnMut(&mut dyn FnMut(&Sample)) -> Result<(), E>,
) -> Result<Statistics, E> {
    let mut tally = Tally::new(columns);
    pass(&mut |sample| tally.add(sample))?;
    tally.ask();
    while tally.searches.iter().any(RankSearch::is_open) {
        pass(&mut |sample| tally.look_again(sample))?;
        tally.searches.iter_mut().for_each(RankSearch::narrow);
    }
    Ok(tally.statistics(linear_covariance))
}

/// Numbers from which statistics follow.
struct Tally<'a> {
    columns: &'a [&'a str],
    /// Columns of the miss of the planned end: up, along and across the course.
    places: Option<[usize; 3]>,
    samples: usize,
    ended: usize,
    near: usize,
    sums: Vec<ExactSum>,
    /// Sums of the pairs of columns, those of the first with itself and all behind it first.
    products: Vec<ExactSum>,
    extremes: Vec<[Extreme; 2]>,
    searches: Vec<RankSearch>,
}

/// The results of a flight that ended.
fn results_of_end(sample: &Sample) -> Option<&[f64]> {
    sample.results.iter().all(|v| v.is_finite()).then_some(&sample.results)
}

impl<'a> Tally<'a> {
    fn new(columns: &'a [&'a str]) -> Self {
        let column = |name: &str| columns.iter().position(|c| *c == name);
        let places = column("up_m").zip(column("along_m")).zip(column("across_m"));
        let n = columns.len();
        let none = Extreme { value: f64::NAN, sample: None };
        Self {
            columns,
            places: places.map(|((up, along), across)| [up, along, across]),
            samples: 0,
            ended: 0,
            near: 0,
            sums: vec![ExactSum::new(); n],
            products: vec![ExactSum::new(); n * (n + 1) / 2],
            extremes: vec![[none; 2]; n],
            searches: vec![RankSearch::new(); n],
        }
    }

    fn add(&mut self, sample: &Sample) {
        self.samples += 1;
        let Some(results) = results_of_end(sample) else { return };
        self.ended += 1;
        let miss = |places: [usize; 3]| places.iter().map(|k| results[*k].powi(2)).sum::<f64>().sqrt();
        self.near += usize::from(self.places.is_some_and(|places| miss(places) <= 1.0));
        let mut products = self.products.iter_mut();
        for (k, value) in results.iter().enumerate() {
            self.sums[k].add(*value);
            for (other, product) in results[k..].iter().zip(products.by_ref()) {
                product.add_product(*value, *other);
            }
            self.searches[k].add(*value);
            let [least, greatest] = &mut self.extremes[k];
            let new = Extreme { value: *value, sample: Some(sample.index) };
            if new.exceeds(least, Ordering::Less) {
                *least = new;
            }
            if new.exceeds(greatest, Ordering::Greater) {
                *greatest = new;
            }
        }
    }

    /// Ends the first pass.
    fn ask(&mut self) {
        let count = self.ended as u64;
        for search in &mut self.searches {
            search.ask(PERCENTILES.iter().flat_map(|p| ranks_of(*p, count)).filter(|rank| *rank < count));
        }
    }

    fn look_again(&mut self, sample: &Sample) {
        for (search, value) in self.searches.iter_mut().zip(results_of_end(sample).unwrap_or_default()) {
            search.add(*value);
        }
    }

    fn covariance(&self) -> Vec<f64> {
        let n = self.columns.len();
        let mut all = vec![f64::NAN; n * n];
        let mut products = self.products.iter();
        for i in 0..n {
            for (j, product) in (i..n).zip(products.by_ref()) {
                let entry = ExactSum::covariance(product, &self.sums[i], &self.sums[j], self.ended);
                (all[i * n + j], all[j * n + i]) = (entry, entry);
            }
        }
        all
    }

    fn statistics(self, linear_covariance: Option<Vec<f64>>) -> Statistics {
        let linear = linear_covariance.as_deref().unwrap_or_default();
        let (rows, n) = (linear.len().isqrt(), self.columns.len());
        let covariance = self.covariance();
        let mean = |k: usize| self.sums[k].rounded() / self.ended as f64;
        let spread = |(k, name): (usize, &&str)| {
            let [least, greatest] = self.extremes[k];
            Spread {
                name: (*name).to_owned(),
                mean: mean(k),
                sigma: covariance[k * n + k].sqrt(),
                linear_sigma: (k < rows).then(|| linear[k * rows + k].sqrt()),
                percentiles: PERCENTILES.map(|p| self.searches[k].percentile(p, self.ended as u64)),
                largest: least.value.abs().max(greatest.value.abs()).max(0.0),
                least,
                greatest,
            }
        };
        let spreads = self.columns.iter().enumerate().map(spread).collect();
        let within = self.places.map(|_| Proportion::new(self.near, self.samples));
        let ellipse = self.places.filter(|_| self.ended > 2).map(|[_, along, across]| {
            let entry = |i: usize, j: usize| covariance[i * n + j];
            let centre = [mean(along), mean(across)];
            Ellipse::of(centre, entry(along, along), entry(across, across), entry(along, across))
        });
        let linear_ellipse = self.places.filter(|[_, a, c]| *a.max(c) < rows).map(|[_, a, c]| {
            let entry = |i: usize, j: usize| linear[i * rows + j];
            Ellipse::of([0.0; 2], entry(a, a), entry(c, c), entry(a, c))
        });
        Statistics {
            samples: self.samples,
            failed: self.samples - self.ended,
            success: Proportion::new(self.ended, self.samples),
            within_1_m: within.map(|p| p.part),
            within_1_m_interval: within.map(|p| p.interval),
            spreads,
            covariance,
            ellipse,
            linear_ellipse,
            linear_covariance,
            faults: Vec::new(),
        }
    }
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

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    fn sample(index: usize, results: Vec<f64>) -> Sample {
        Sample { index, deviations: Vec::new(), results, fault: None }
    }

    #[test]
    fn numbers_of_a_line_are_those_of_its_formula() {
        // Points on a line at 30 deg to the right of the course, one flight that did not end.
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let mut samples: Vec<Sample> = (-10..=10)
            .zip(0..)
            .map(|(p, k)| sample(k, vec![0.0, 3.0 + cos * f64::from(p), sin * f64::from(p)]))
            .collect();
        samples.push(sample(21, vec![0.0, f64::NAN, 1.0]));
        let columns = ["up_m", "along_m", "across_m"];
        let s = statistics(&samples, &columns, None);
        assert_eq!((s.samples, s.failed, s.success.count), (22, 1, 21));
        let e = s.ellipse.unwrap();
        assert!((e.angle_deg - 30.0).abs() < 1e3 * ROUNDING && (e.centre_m[0] - 3.0).abs() < ROUNDING);
        assert!((e.semi_axes_m[0] - (770.0_f64 / 20.0).sqrt()).abs() < 1e3 * ROUNDING, "{e:?}");
        assert!(e.semi_axes_m[1] < 1e6 * ROUNDING, "{e:?}");
        let [up, along, across] = [0, 1, 2].map(|k| &s.spreads[k]);
        assert_eq!((up.sigma, up.largest, up.percentiles), (0.0, 0.0, [0.0; 3]));
        assert_eq!((across.least.sample, across.greatest.sample), (Some(0), Some(20)));
        assert_eq!(along.percentiles[1], 3.0);
        assert_eq!(s.covariance[5], s.covariance[7]);
        assert!((s.covariance[5] - 38.5 * sin * cos).abs() < 1e3 * ROUNDING);
        // The same in another order of the sums.
        samples.reverse();
        let reversed = statistics(&samples, &columns, None);
        assert_eq!(
            (reversed.spreads, reversed.covariance, reversed.ellipse),
            (s.spreads, s.covariance, s.ellipse)
        );
    }

    #[test]
    fn no_flights_and_one_have_no_spread() {
        let none = statistics(&[], &["a"], None);
        assert!(none.spreads[0].mean.is_nan() && none.spreads[0].least.sample.is_none());
        let one = statistics(&[sample(4, vec![2.5])], &["a"], None);
        assert!(
            (one.spreads[0].mean, one.spreads[0].percentiles) == (2.5, [2.5; 3])
                && one.spreads[0].sigma.is_nan()
        );
        assert_eq!(one.spreads[0].greatest, Extreme { value: 2.5, sample: Some(4) });
    }

    #[test]
    fn a_pass_that_fails_ends_the_work() {
        let mut passes = 0;
        let found = statistics_in_passes(&["a"], None, |_| {
            passes += 1;
            Err("the disk is gone")
        });
        assert_eq!((found.unwrap_err(), passes), ("the disk is gone", 1));
    }
}
