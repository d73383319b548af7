//! Legends of figures: the names of series, reference lines and phases, each with a sample of how it is drawn.

use std::fmt::Write as _;

use crate::figure::{Figure, Series, SeriesStyle};
use crate::markup::escape;
use crate::palette::{BODY, BOUND, INK, is_repeated, reference_color, series_color};

/// Names with samples, as SVG elements of 26 by 10 pixels.
pub(crate) fn entries(figure: &Figure) -> Vec<(&str, String)> {
    let colors = figure.colors();
    let series = figure.series.iter().zip(&colors).map(|(s, own)| {
        let sample = match s.style {
            SeriesStyle::Line | SeriesStyle::Dots => {
                // What has no name of its own belongs to the name of its colour.
                let of_name = figure.series.iter().zip(&colors).filter(|(other, color)| {
                    *color == own && (other.label.is_empty() || std::ptr::eq(*other, s))
                });
                let marks = of_name.map(|(series, _)| marks(series));
                let marks = marks.fold([false; 2], |[line, dot], m| [line || m[0], dot || m[1]]);
                line_and_dot(marks, series_color(*own), is_repeated(*own))
            }
            SeriesStyle::Bound => dashed(BOUND),
            SeriesStyle::Body => {
                format!("<rect width=\"26\" height=\"10\" fill=\"{BODY}\" stroke=\"{BOUND}\"/>")
            }
        };
        (s.label.as_str(), sample)
    });
    let references = figure.references.iter().enumerate();
    let references = references.map(|(k, r)| (r.label(), dashed(reference_color(k))));
    // Phases whose names do not fit above the drawing have numbers there.
    let phases = figure.numbered_spans().into_iter().map(|(number, name)| {
        let place = "x=\"13\" y=\"9\" font-size=\"11\" text-anchor=\"middle\"";
        (name, format!("<text {place} fill=\"{INK}\">{number}</text>"))
    });
    series.chain(references).chain(phases).filter(|(label, _)| !label.is_empty()).collect()
}

/// Says whether a series has a line and a dot on the drawing, where a point between gaps is a dot.
fn marks(series: &Series) -> [bool; 2] {
    let is_gap = |point: &[f64; 2]| !point.iter().all(|v| v.is_finite());
    let has_run = |is: fn(usize) -> bool| series.points.split(is_gap).any(|run| is(run.len()));
    match series.style {
        SeriesStyle::Dots => [false, has_run(|length| length > 0)],
        SeriesStyle::Line => [has_run(|length| length > 1), has_run(|length| length == 1)],
        SeriesStyle::Bound | SeriesStyle::Body => [false; 2],
    }
}

fn line_and_dot([line, dot]: [bool; 2], color: &str, is_dashed: bool) -> String {
    let dashes = if is_dashed { " stroke-dasharray=\"7 4\"" } else { "" };
    let mut sample = String::new();
    if line || !dot {
        let _ = write!(sample, "<path d=\"M1 5H25\" stroke=\"{color}\" stroke-width=\"2\"{dashes}/>");
    }
    if dot {
        let _ = write!(sample, "<circle cx=\"13\" cy=\"5\" r=\"3\" fill=\"{color}\"/>");
    }
    sample
}

fn dashed(color: &str) -> String {
    format!("<path d=\"M1 5H25\" stroke=\"{color}\" stroke-width=\"1.6\" stroke-dasharray=\"6 4\"/>")
}

/// Height of a line of a legend below a drawing, in CSS pixels.
const LINE: f64 = 20.0;
/// Width of a sample with its gap, and of a letter; generous, no font is measured.
const SAMPLE: f64 = 32.0;
const LETTER: f64 = 7.0;
/// Space between two entries.
const GAP: f64 = 18.0;

/// The legend as SVG elements from the origin on, in lines of this width, and its height, in CSS pixels.
pub(crate) fn drawn(figure: &Figure, width: f64) -> (String, f64) {
    let (mut text, mut x, mut line) = (String::new(), GAP, 0.0);
    let entries = entries(figure);
    for (label, sample) in &entries {
        let size = SAMPLE + LETTER * label.chars().count() as f64;
        if x > GAP && x + size > width {
            (x, line) = (GAP, line + 1.0);
        }
        let y = LINE * line;
        let _ = writeln!(
            text,
            "<g transform=\"translate({x:.0} {y:.0})\">{sample}<text x=\"{SAMPLE}\" y=\"9\" fill=\"{INK}\">{}</text></g>",
            escape(label)
        );
        x += size + GAP;
    }
    let height = if entries.is_empty() { 0.0 } else { LINE * (line + 1.0) };
    (text, height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Axis;

    /// A sample shows what stands on the drawing: a line, dots, or both.
    #[test]
    fn samples_are_drawn_as_their_series() {
        let empty = || Figure::new("", Axis::new("x", "-"), Axis::new("y", "-"));
        let run = vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 2.0], [4.0, 3.0]];
        let alone = vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 3.0]];
        let figures = [
            (empty().with(Series::line("a", run.clone())), [true, false]),
            (empty().with(Series::dots("a", run.clone())), [false, true]),
            (empty().with(Series::line("a", alone.clone())), [false, true]),
            (empty().with(Series::line("a", alone[..1].to_vec())), [false, true]),
            (empty().with(Series::line("a", Vec::new())), [true, false]),
            // The dots of a paper beside the line of a name, and dots where there is no line.
            (
                empty()
                    .with(Series::line("a", run.clone()).colored(3))
                    .with(Series::dots("", alone.clone()).colored(3)),
                [true, true],
            ),
            (
                empty()
                    .with(Series::line("a", Vec::new()).colored(3))
                    .with(Series::dots("", alone.clone()).colored(3)),
                [false, true],
            ),
            (
                empty()
                    .with(Series::line("a", run.clone()).colored(3))
                    .with(Series::dots("", alone).colored(4)),
                [true, false],
            ),
        ];
        for (k, (figure, [line, dot])) in figures.iter().enumerate() {
            let found = entries(figure);
            let [("a", sample)] = &found[..] else { panic!("{k}: {found:?}") };
            assert_eq!(
                [sample.contains("<path"), sample.contains("<circle")],
                [*line, *dot],
                "{k}: {sample}"
            );
        }
    }
}
