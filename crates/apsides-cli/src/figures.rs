//! Mission curves as figures of the report.

use apsides::Outcome;
use apsides_report::{Axis, Figure, Series};

/// The mission's own curves.
pub(crate) fn figures(outcome: &Outcome) -> Vec<Figure> {
    outcome
        .curves
        .iter()
        .map(|c| {
            let axis = |(name, unit): &(String, String)| Axis::new(name.clone(), unit.clone());
            c.series
                .iter()
                .fold(Figure::new(c.title.clone(), axis(&c.x), axis(&c.y)), |figure, (name, points)| {
                    figure.with(Series::line(name.clone(), points.clone()))
                })
        })
        .collect()
}
