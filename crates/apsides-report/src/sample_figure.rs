//! Figures of samples: ends over ground, or the distribution of results.

use apsides_pipeline::montecarlo::{Ellipse, Sample, Statistics};
use apsides_pipeline::unit_ending::{name_of, unit_of};
use serde::{Deserialize, Serialize};

use crate::{Axis, Figure, Series};

/// Samples that are drawn at most: more dots than these are not told apart.
const MOST_DRAWN: usize = 20_000;

/// Points of the outline of an ellipse.
const OUTLINE: usize = 180;

/// The kind of a figure of samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SampleFigure {
    /// The ends over ground, to scale.
    Landing,
    /// The part of all samples over a result, by its column and its label.
    Result(String, String),
    /// The part of all flights over results of one unit: columns and their labels.
    Distribution {
        /// Name of the axis.
        axis: String,
        /// Unit of the axis.
        unit: String,
        /// Columns and their labels.
        results: Vec<(String, String)>,
    },
}

impl SampleFigure {
    /// Draws the samples of a picture, with the statistics of all.
    #[must_use]
    pub fn draw(&self, title: &str, picture: &Picture, columns: &[&str], statistics: &Statistics) -> Figure {
        match self {
            Self::Landing => landing_figure(title, &picture.samples, columns, statistics),
            Self::Result(result, label) => {
                let axis = Axis::new(name_of(result).replace('_', " "), unit_of(result));
                distribution_figure(title, axis, &picture.samples, columns, &[(result, label)])
            }
            Self::Distribution { axis, unit, results } => {
                let axis = Axis::new(axis.clone(), unit.clone()).logarithmic();
                let results: Vec<_> = results.iter().map(|(name, label)| (&**name, &**label)).collect();
                distribution_figure(title, axis, &picture.samples, columns, &results)
            }
        }
    }
}

/// Samples that are drawn: all, or of many every so-manieth by its index, so that it does not matter how a run was divided.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    every: usize,
    samples: Vec<Sample>,
}

impl Picture {
    /// The picture of so many samples, empty as yet.
    #[must_use]
    pub fn of(count: usize) -> Self {
        Self { every: count.div_ceil(MOST_DRAWN).max(1), samples: Vec::new() }
    }

    /// Adds a sample if it is drawn.
    pub fn add(&mut self, sample: &Sample) {
        if sample.index.is_multiple_of(self.every) {
            self.samples.push(sample.clone());
        }
    }

    /// The title of a figure of a mission with so many samples.
    #[must_use]
    pub fn title(&self, mission: &str, count: usize) -> String {
        match self.every {
            1 => format!("{mission}: {count} flights"),
            every => format!("{mission}: {count} flights, one of {every} drawn"),
        }
    }
}

/// The ends over ground, to scale, with the ellipses of one and three standard deviations, and that of the state-transition matrix.
fn landing_figure(title: &str, samples: &[Sample], columns: &[&str], statistics: &Statistics) -> Figure {
    let column = |name: &str| columns.iter().position(|c| *c == name);
    let (along, across) = (column("along_m"), column("across_m"));
    let place = |s: &Sample| Some([*s.results.get(across?)?, *s.results.get(along?)?]);
    let ends = samples.iter().filter_map(place).filter(|p| p.iter().all(|v| v.is_finite())).collect();
    let mut figure =
        Figure::new(title, Axis::new("across the course", "m"), Axis::new("along the course", "m"))
            .with(Series::dots("ends", ends));
    if let Some(ellipse) = &statistics.ellipse {
        for (k, sigmas) in [1.0, 3.0].into_iter().enumerate() {
            figure =
                figure.with(Series::line(format!("{sigmas} sigma"), outline(ellipse, sigmas)).colored(k + 1));
        }
    }
    if let Some(ellipse) = &statistics.linear_ellipse {
        figure = figure.with(Series::bound("3 sigma, by the state-transition matrix", outline(ellipse, 3.0)));
    }
    figure.to_scale(1.0)
}

/// The part of all flights whose result is not above a value, for results of one unit: flights that did not end count as above all.
fn distribution_figure(
    title: &str,
    x: Axis,
    samples: &[Sample],
    columns: &[&str],
    results: &[(&str, &str)],
) -> Figure {
    let mut figure = Figure::new(title, x, Axis::new("part of all flights", "-").including(0.0));
    for (name, label) in results {
        let Some(k) = columns.iter().position(|c| c == name) else { continue };
        let mut values: Vec<f64> = samples.iter().map(|s| s.results[k]).filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let part = |rank: usize| (rank + 1) as f64 / samples.len() as f64;
        // More points than this are not told apart.
        let every = values.len().div_ceil(1000).max(1);
        let points = values.iter().enumerate().step_by(every).map(|(rank, v)| [*v, part(rank)]).collect();
        figure = figure.with(Series::line(*label, points));
    }
    figure
}

fn outline(e: &Ellipse, sigmas: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = e.angle_deg.to_radians().sin_cos();
    let point = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / OUTLINE as f64).sin_cos();
        let (a, b) = (sigmas * e.semi_axes_m[0] * c, sigmas * e.semi_axes_m[1] * s);
        [e.centre_m[1] + a * sin + b * cos, e.centre_m[0] + a * cos - b * sin]
    };
    (0..=OUTLINE).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_samples_are_thinned_by_their_index() {
        let sample = |index| Sample { index, deviations: Vec::new(), results: vec![0.0], fault: None };
        let count = 2 * MOST_DRAWN + 1;
        let mut whole = Picture::of(count);
        (0..count).for_each(|k| whole.add(&sample(k)));
        assert_eq!((whole.every, whole.samples.len()), (3, count.div_ceil(3)));
        assert!(whole.samples.iter().all(|s| s.index % 3 == 0));
        assert_eq!(whole.title("lunar", count), "lunar: 40001 flights, one of 3 drawn");
        assert_eq!(Picture::of(MOST_DRAWN).title("lunar", 7), "lunar: 7 flights");
        assert_eq!(Picture::of(0).every, 1);
    }
}
