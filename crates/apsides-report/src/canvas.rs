//! The elements of an SVG drawing.
//!
//! A drawing is made in CSS pixels. Coordinates are written as whole tenths of one, and the view box scales them back: paths stay
//! short. Text is positioned by anchors, so that no font is needed here.

use std::fmt::Write as _;

use crate::markup::{base64, escape};
use crate::palette::{BODY, BOUND, INK};

/// Drawing units per CSS pixel.
pub(crate) const ENLARGEMENT: f64 = 10.0;
/// Height of letters in CSS pixels.
pub(crate) const FONT_SIZE: f64 = 12.0;

/// A point in CSS pixels.
pub(crate) type Point = (f64, f64);

/// Where a text stands beside its point, horizontally: the value of `text-anchor`.
#[derive(Clone, Copy)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// Where a text stands beside its point, vertically.
#[derive(Clone, Copy)]
pub(crate) enum Baseline {
    Below,
    Centred,
    Above,
}

/// The elements drawn so far. Writing into a `String` cannot fail, hence the discarded results.
#[derive(Default)]
pub(crate) struct Canvas {
    elements: String,
}

fn enlarged((x, y): Point) -> (i32, i32) {
    ((x * ENLARGEMENT).round() as i32, (y * ENLARGEMENT).round() as i32)
}

impl Canvas {
    /// The drawing of a size in CSS pixels as an SVG element with a title and further `attributes`.
    pub(crate) fn finish(self, [width, height]: [f64; 2], title: &str, attributes: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" stroke-linejoin=\"round\" \
             stroke-linecap=\"round\" font-family=\"sans-serif\" font-size=\"{}\"{attributes}>\n<title>{}</title>\n{}</svg>\n",
            width * ENLARGEMENT,
            height * ENLARGEMENT,
            FONT_SIZE * ENLARGEMENT,
            escape(title),
            self.elements
        )
    }

    /// Elements in a group of a class.
    pub(crate) fn group(&mut self, class: &str, draw: impl FnOnce(&mut Self)) {
        let _ = writeln!(self.elements, "<g class=\"{class}\">");
        draw(self);
        self.elements.push_str("</g>\n");
    }

    /// A picture in PNG between the upper left and the lower right corner.
    pub(crate) fn png(&mut self, from: Point, to: Point, png: &[u8]) {
        let ((x, y), (right, bottom)) = (enlarged(from), enlarged(to));
        let (width, height) = (right - x, bottom - y);
        let _ = writeln!(
            self.elements,
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
             href=\"data:image/png;base64,{}\"/>",
            base64(png)
        );
    }

    pub(crate) fn line(&mut self, points: &[Point], color: &str, width: f64) {
        self.curve(points, color, width, None, false);
    }

    /// A line, of a series with this name where a page may ask for its values; of dashes where another one has its colour.
    pub(crate) fn curve(
        &mut self,
        points: &[Point],
        color: &str,
        width: f64,
        series: Option<&str>,
        is_dashed: bool,
    ) {
        let mut path: Vec<_> = points.iter().map(|p| enlarged(*p)).collect();
        path.dedup();
        if path.len() < 2 {
            return;
        }
        let width = (width * ENLARGEMENT).round();
        let _ = write!(
            self.elements,
            "<polyline{} fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"{} points=\"",
            series.map_or(String::new(), |name| format!(" data-series=\"{}\"", escape(name))),
            if is_dashed { " stroke-dasharray=\"70 45\"" } else { "" }
        );
        for (k, (x, y)) in path.iter().enumerate() {
            let _ = write!(self.elements, "{}{x},{y}", if k == 0 { "" } else { " " });
        }
        self.elements.push_str("\"/>\n");
    }

    /// A line of dashes, which go on over the points of a curve.
    pub(crate) fn dashes(&mut self, points: &[Point], color: &str) {
        const DASH: f64 = 6.0;
        const GAP: f64 = 4.0;
        let mut dash: Vec<Point> = points.first().copied().into_iter().collect();
        // Length that is left of the dash or of the gap.
        let (mut left, mut is_dash) = (DASH, true);
        for (from, to) in points.iter().zip(points.iter().skip(1)) {
            let (dx, dy) = (to.0 - from.0, to.1 - from.1);
            let length = dx.hypot(dy);
            let at = |s: f64| (from.0 + dx * s / length, from.1 + dy * s / length);
            let mut start = 0.0;
            while length - start > left {
                start += left;
                if is_dash {
                    dash.push(at(start));
                    self.line(&dash, color, 1.4);
                }
                dash = vec![at(start)];
                is_dash = !is_dash;
                left = if is_dash { DASH } else { GAP };
            }
            left -= length - start;
            if is_dash {
                dash.push(*to);
            }
        }
        if is_dash {
            self.line(&dash, color, 1.4);
        }
    }

    /// A filled outline.
    pub(crate) fn area(&mut self, points: &[Point]) {
        let _ = write!(
            self.elements,
            "<polygon fill=\"{BODY}\" stroke=\"{BOUND}\" stroke-width=\"10\" points=\""
        );
        for (k, point) in points.iter().enumerate() {
            let (x, y) = enlarged(*point);
            let _ = write!(self.elements, "{}{x},{y}", if k == 0 { "" } else { " " });
        }
        self.elements.push_str("\"/>\n");
    }

    pub(crate) fn dot(&mut self, at: Point, color: &str) {
        let (x, y) = enlarged(at);
        let radius = 2.2 * ENLARGEMENT;
        let _ = writeln!(self.elements, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{color}\"/>");
    }

    /// A rectangle between its upper left and its lower right corner.
    pub(crate) fn fill(&mut self, from: Point, to: Point, color: &str) {
        let ((x, y), (right, bottom)) = (enlarged(from), enlarged(to));
        let (width, height) = (right - x, bottom - y);
        let _ = writeln!(
            self.elements,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{color}\"/>"
        );
    }

    pub(crate) fn text(&mut self, text: &str, at: Point, anchor: Anchor, baseline: Baseline) {
        let (x, y) = enlarged(at);
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let shift = match baseline {
            Baseline::Below => "0.76em",
            Baseline::Centred => "0.5ex",
            Baseline::Above => "-0.5ex",
        };
        let _ = writeln!(
            self.elements,
            "<text x=\"{x}\" y=\"{y}\" dy=\"{shift}\" text-anchor=\"{anchor}\" fill=\"{INK}\">{}</text>",
            escape(text)
        );
    }
}
