//! Figures of several flights drawn over each other.

use apsides_ephemeris::Ephemeris;

use crate::figure::{Axis, Figure, Series, SeriesStyle};
use crate::flight_figures::Presentation;

/// A flight by its name, with its rows.
#[derive(Clone, Copy, Debug)]
pub struct NamedFlight<'a> {
    /// Its name in legends.
    pub name: &'a str,
    /// Its rows.
    pub rows: &'a Ephemeris,
}

/// The figures that all flights have, each with the curves of all of them in colours of their own: paths and quantities over time of flights
/// about a body, all columns of others. The body is that of the first flight.
#[must_use]
pub fn overlaid(flights: &[NamedFlight<'_>]) -> Vec<Figure> {
    let drawn: Vec<(&str, Vec<Figure>)> =
        flights.iter().map(|flight| (flight.name, figures(flight.rows))).collect();
    let Some(((_, first), others)) = drawn.split_first() else { return Vec::new() };
    let all_have = |figure: &&Figure| {
        others.iter().all(|(_, figures)| figures.iter().any(|other| other.title == figure.title))
    };
    let overlay = |figure: &Figure| {
        let mut whole = Figure { series: Vec::new(), spans: Vec::new(), ..figure.clone() };
        for (k, (name, figures)) in drawn.iter().enumerate() {
            let same = figures.iter().filter(|other| other.title == figure.title);
            for (j, series) in same.flat_map(|other| &other.series).enumerate() {
                // Quantities of a flight over time are told apart; parts of a path are one line.
                let color = if figure.x.label == "time" { k + j * drawn.len() } else { k };
                match series.style {
                    SeriesStyle::Body | SeriesStyle::Bound if k > 0 => {}
                    SeriesStyle::Body | SeriesStyle::Bound => whole.series.push(series.clone()),
                    SeriesStyle::Line | SeriesStyle::Dots => whole.series.push(named(series, name, color)),
                }
            }
        }
        whole
    };
    first.iter().filter(all_have).map(overlay).collect()
}

/// The series in a colour, under the name of that and its own.
fn named(series: &Series, name: &str, color: usize) -> Series {
    let label = if series.label.is_empty() { name.to_owned() } else { format!("{name}: {}", series.label) };
    Series { label, ..series.clone() }.colored(color)
}

fn figures(rows: &Ephemeris) -> Vec<Figure> {
    let Presentation { paths, histories, .. } = Presentation::new("", Vec::new(), Some(rows));
    if !histories.is_empty() {
        return paths.into_iter().chain(histories).collect();
    }
    let figure = |(column, values): &(apsides_ephemeris::Column, Vec<f64>)| {
        let points = rows.times.iter().zip(values).map(|(t, v)| [*t, *v]).collect();
        let height = Axis::new(column.name.as_str(), column.unit.as_str());
        Figure::new(column.name.as_str(), Axis::new("time", "s"), height).with(Series::line("", points))
    };
    rows.columns.iter().map(figure).collect()
}
