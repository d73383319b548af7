//! Legends of figures: the names of series, reference lines and phases, each with a sample of how it is drawn.

use std::fmt::Write as _;

use crate::figure::{Figure, SeriesStyle};
use crate::markup::escape;
use crate::palette::{BODY, BOUND, INK, reference_color, series_color};

/// Names with samples, as SVG elements of 26 by 10 pixels.
pub(crate) fn entries(figure: &Figure) -> Vec<(&str, String)> {
    let series = figure.series.iter().zip(figure.colors()).map(|(s, color)| {
        let color = series_color(color);
        let sample = match s.style {
            SeriesStyle::Line => format!("<path d=\"M1 5H25\" stroke=\"{color}\" stroke-width=\"2\"/>"),
            SeriesStyle::Dots => format!("<circle cx=\"13\" cy=\"5\" r=\"3\" fill=\"{color}\"/>"),
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
