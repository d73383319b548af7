//! Draws a figure as SVG.

use std::fmt::Write as _;

use crate::axis_layout::AxisLayout;
use crate::canvas::{Anchor, Baseline, Canvas, ENLARGEMENT, FONT_SIZE, Point};
use crate::figure::{AxisScale, Figure, ReferenceLine, Series, SeriesStyle};
use crate::legend::drawn;
use crate::markup::escape;
use crate::palette::{FRAME, GRID, INK, MINOR_GRID, SHADE, is_repeated, reference_color, series_color};

/// Size of a figure in CSS pixels.
pub(crate) const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 300.0;
/// Most height of a figure to scale.
const TALLEST: f64 = 520.0;
/// Room below the plot area for the labels of its axis.
const FOOT: f64 = 44.0;
/// Average width of a digit in this size; generous, no font is measured.
const DIGIT_WIDTH: f64 = 7.0;

impl Figure {
    /// The figure as an SVG element, without legend; it holds no script and refers to nothing outside.
    #[must_use]
    pub fn to_svg(&self) -> String {
        self.drawn().0
    }

    /// The element and its height in CSS pixels.
    fn drawn(&self) -> (String, f64) {
        let mut canvas = Canvas::default();
        let drawing = Drawing::new(self);
        drawing.draw(self, &mut canvas);
        (canvas.finish([WIDTH, drawing.height], &self.title, &drawing.attributes()), drawing.height)
    }
}

impl Figure {
    /// The spans whose names do not fit above them, with the numbers that stand there.
    pub(crate) fn numbered_spans(&self) -> Vec<(usize, &str)> {
        let drawing = Drawing::new(self);
        let spans = drawing.spans(self).into_iter().enumerate();
        let numbered = spans.filter(|(_, (from, to, label))| !label.is_empty() && !fits(label, to - from));
        numbered.map(|(k, (.., label))| (k + 1, label)).collect()
    }
}

/// Returns true of a text that fits this width, in CSS pixels.
fn fits(text: &str, width: f64) -> bool {
    text.chars().count() as f64 * DIGIT_WIDTH + 4.0 <= width
}

/// Figures below each other as one SVG element for a file of its own: each with its title and its legend, on white.
#[must_use]
pub fn stacked_svg(figures: &[Figure]) -> String {
    let (mut text, mut y) = (String::new(), 0.0);
    for figure in figures {
        let (legend, height) = drawn(figure, WIDTH);
        let titles = title_lines(&figure.title);
        for (k, line) in titles.iter().enumerate() {
            let _ = writeln!(
                text,
                "<text x=\"18\" y=\"{:.0}\" font-weight=\"bold\" fill=\"{INK}\">{}</text>",
                y + TITLE - 8.0 + k as f64 * TITLE_LINE,
                escape(line)
            );
        }
        y += titles.len().saturating_sub(1) as f64 * TITLE_LINE;
        let (svg, tall) = figure.drawn();
        let place = format!("<svg y=\"{:.0}\" width=\"{WIDTH}\" height=\"{tall:.0}\"", y + TITLE);
        text += &svg.replacen("<svg", &place, 1);
        y += TITLE + tall;
        let _ = writeln!(text, "<g transform=\"translate(0 {y:.0})\">\n{legend}</g>");
        y += height + LEGEND_SPACE;
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {y:.0}\" font-family=\"sans-serif\" font-size=\"{FONT_SIZE}\">\n\
         <rect width=\"{WIDTH}\" height=\"{y:.0}\" fill=\"#FFFFFF\"/>\n{text}</svg>\n"
    )
}

/// The lines of a title, broken where words end; a word alone is not broken.
fn title_lines(title: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in title.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= TITLE_LETTERS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Height of a title above a figure, of each further line of one, and of the space below a legend, in CSS pixels.
const TITLE: f64 = 26.0;
const TITLE_LINE: f64 = 17.0;
/// Letters of a line of a title; generous, no font is measured.
const TITLE_LETTERS: usize = 70;
const LEGEND_SPACE: f64 = 8.0;

/// A figure with its axes and its plot area decided.
struct Drawing {
    x: AxisLayout,
    y: AxisLayout,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    height: f64,
}

impl Drawing {
    fn new(figure: &Figure) -> Self {
        let [mut x_values, y_values] = [0, 1].map(|k| axis_values(figure, k));
        x_values.extend(figure.spans.iter().flat_map(|s| [s.range.start, s.range.end]));
        let named_spans = figure.spans.iter().any(|s| !s.label.is_empty());
        let top = if named_spans { 46.0 } else { 28.0 };
        let right = WIDTH - 18.0;
        let mut height = HEIGHT;
        let left_of = |y: &AxisLayout| {
            let widest = y.ticks.iter().map(|t| t.label.chars().count()).max().unwrap_or(0);
            (14.0 + DIGIT_WIDTH * widest as f64).clamp(40.0, 0.4 * WIDTH)
        };
        let layout_y =
            |values: &[f64], padding| AxisLayout::new(&figure.y, values.iter().copied(), padding, 6);
        let (mut x_ends, mut y) = (x_values, layout_y(&y_values, Y_PADDING));
        if let Some((x_span, y_span)) = figure.scale_ratio.and(ends(&x_ends).zip(ends(&y_values))) {
            let (ratio, width) = (figure.scale_ratio.unwrap_or(1.0), right - left_of(&y));
            // What is as high as it is wide is not drawn small in the middle of a low page.
            let shape = ratio * (y_span[1] - y_span[0]) / (x_span[1] - x_span[0]);
            let wanted = top + FOOT + width * shape;
            height = if wanted > HEIGHT { wanted.min(TALLEST).round() } else { HEIGHT };
            let page = [width, height - FOOT - top];
            let [x_wide, y_wide] = to_scale([x_span, y_span], page, ratio);
            (x_ends, y) = (x_wide.to_vec(), layout_y(&y_wide, 0.0));
        }
        let bottom = height - FOOT;
        // A dot on the frame is half a dot.
        let dots_alone = figure.series.iter().all(|s| s.style == SeriesStyle::Dots || s.points.is_empty());
        let x_padding = if dots_alone && figure.scale_ratio.is_none() { Y_PADDING } else { 0.0 };
        let x = AxisLayout::new(&figure.x, x_ends.into_iter(), x_padding, 7);
        Self { x, left: left_of(&y), y, right, top, bottom, height }
    }

    /// Attributes by which a script finds values at a place: the frame in drawing units, the values at its ends, names and scales of both axes.
    fn attributes(&self) -> String {
        let mut text = String::from(" data-frame=\"");
        for (k, edge) in [self.left, self.right, self.bottom, self.top].into_iter().enumerate() {
            let _ = write!(text, "{}{:.0}", if k == 0 { "" } else { " " }, edge * ENLARGEMENT);
        }
        text.push('"');
        for (name, axis) in [("x", &self.x), ("y", &self.y)] {
            let ([low, high], kind) = (axis.ends(), if axis.is_logarithmic() { "log" } else { "linear" });
            let title = escape(&axis.title);
            let _ = write!(text, " data-{name}=\"{low} {high} {kind}\" data-{name}-title=\"{title}\"");
        }
        text
    }

    fn horizontal(&self, position: f64) -> f64 {
        self.left + position * (self.right - self.left)
    }

    fn vertical(&self, position: f64) -> f64 {
        self.bottom - position * (self.bottom - self.top)
    }

    /// Place of a point of the data; none for gaps and for what lies outside.
    fn place(&self, [x, y]: [f64; 2]) -> Option<Point> {
        let inside = |p: &f64| (-1e-9..=1.0 + 1e-9).contains(p);
        let x = self.x.position(x).filter(inside)?;
        let y = self.y.position(y).filter(inside)?;
        Some((self.horizontal(x), self.vertical(y)))
    }

    /// Draws the data as a group of its own, as well as the labels of each axis: a script that zooms moves the one and writes the
    /// others anew.
    fn draw(&self, figure: &Figure, canvas: &mut Canvas) {
        let spans = self.spans(figure);
        canvas.group("plot", |canvas| {
            for (from, to, _) in spans.iter().skip(1).step_by(2) {
                canvas.fill((*from, self.top), (*to, self.bottom), SHADE);
            }
            self.grid(canvas);
            for (from, to, _) in &spans {
                for x in [*from, *to] {
                    if x > self.left + 0.5 && x < self.right - 0.5 {
                        canvas.line(&[(x, self.top), (x, self.bottom)], FRAME, 1.0);
                    }
                }
            }
            self.references(figure, canvas);
            for (series, color) in figure.series.iter().zip(figure.colors()) {
                self.series(series, color, canvas);
            }
        });
        let (left, right, top, bottom) = (self.left, self.right, self.top, self.bottom);
        let frame = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        canvas.line(&frame, FRAME, 1.0);
        self.labels(&spans, canvas);
    }

    /// Left end, right end and label of each span in the plot area.
    fn spans<'f>(&self, figure: &'f Figure) -> Vec<(f64, f64, &'f str)> {
        let end = |v: f64| self.x.position(v).map(|p| self.horizontal(p.clamp(0.0, 1.0)));
        let placed = |s: &'f crate::figure::Span| {
            let (from, to) = (end(s.range.start)?, end(s.range.end)?);
            (from < to).then_some((from, to, s.label.as_str()))
        };
        figure.spans.iter().filter_map(placed).collect()
    }

    fn grid(&self, canvas: &mut Canvas) {
        let across = |d: &Self, p: f64| [(d.left, d.vertical(p)), (d.right, d.vertical(p))];
        let along = |d: &Self, p: f64| [(d.horizontal(p), d.top), (d.horizontal(p), d.bottom)];
        for p in &self.y.minor {
            canvas.line(&across(self, *p), MINOR_GRID, 1.0);
        }
        for p in &self.x.minor {
            canvas.line(&along(self, *p), MINOR_GRID, 1.0);
        }
        for tick in &self.y.ticks {
            canvas.line(&across(self, tick.position), GRID, 1.0);
        }
        for tick in &self.x.ticks {
            canvas.line(&along(self, tick.position), GRID, 1.0);
        }
    }

    fn references(&self, figure: &Figure, canvas: &mut Canvas) {
        let inside = |p: &f64| (0.0..=1.0).contains(p);
        for (index, reference) in figure.references.iter().enumerate() {
            let ends = match reference {
                ReferenceLine::Horizontal { value, .. } => self.y.position(*value).filter(inside).map(|p| {
                    let y = self.vertical(p);
                    [(self.left, y), (self.right, y)]
                }),
                ReferenceLine::Vertical { value, .. } => self.x.position(*value).filter(inside).map(|p| {
                    let x = self.horizontal(p);
                    [(x, self.bottom), (x, self.top)]
                }),
            };
            if let Some([from, to]) = ends {
                canvas.dashes(&[from, to], reference_color(index));
            }
        }
    }

    fn series(&self, series: &Series, index: Option<usize>, canvas: &mut Canvas) {
        let color = series_color(index);
        let places: Vec<Option<Point>> = series.points.iter().map(|p| self.place(*p)).collect();
        match series.style {
            SeriesStyle::Dots => places.into_iter().flatten().for_each(|p| canvas.dot(p, color)),
            SeriesStyle::Bound => places.split(Option::is_none).for_each(|part| {
                canvas.dashes(&part.iter().copied().flatten().collect::<Vec<_>>(), color);
            }),
            SeriesStyle::Body => {
                let inside = |[x, y]: &[f64; 2]| {
                    let (x, y) = (self.x.position(*x)?.clamp(0.0, 1.0), self.y.position(*y)?.clamp(0.0, 1.0));
                    Some((self.horizontal(x), self.vertical(y)))
                };
                canvas.area(&series.points.iter().filter_map(inside).collect::<Vec<_>>());
            }
            SeriesStyle::Line => places.split(Option::is_none).for_each(|run| {
                let run: Vec<Point> = run.iter().flatten().copied().collect();
                match run.as_slice() {
                    [alone] => canvas.dot(*alone, color),
                    points => canvas.curve(points, color, 1.8, Some(&series.label), is_repeated(index)),
                }
            }),
        }
    }

    fn labels(&self, spans: &[(f64, f64, &str)], canvas: &mut Canvas) {
        canvas.group("y", |canvas| {
            for tick in &self.y.ticks {
                let at = (self.left - 6.0, self.vertical(tick.position));
                canvas.text(&tick.label, at, Anchor::End, Baseline::Centred);
            }
        });
        canvas.group("x", |canvas| {
            for tick in &self.x.ticks {
                let at = (self.horizontal(tick.position), self.bottom + 6.0);
                canvas.text(&tick.label, at, Anchor::Middle, Baseline::Below);
            }
            for (k, (from, to, label)) in spans.iter().enumerate() {
                let number = (k + 1).to_string();
                let text = [*label, number.as_str()].into_iter().find(|text| fits(text, to - from));
                if let Some(text) = text.filter(|_| !label.is_empty()) {
                    canvas.text(text, (0.5 * (from + to), self.top - 4.0), Anchor::Middle, Baseline::Above);
                }
            }
        });
        canvas.text(&self.y.title, (6.0, 6.0), Anchor::Start, Baseline::Below);
        let middle = 0.5 * (self.left + self.right);
        canvas.text(&self.x.title, (middle, self.height - 6.0), Anchor::Middle, Baseline::Above);
    }
}

/// Free space above and below the data as a part of their range.
const Y_PADDING: f64 = 0.05;

/// Least and largest value.
fn ends(values: &[f64]) -> Option<[f64; 2]> {
    let least = values.iter().copied().reduce(f64::min)?;
    let most = values.iter().copied().reduce(f64::max)?;
    Some([least, most])
}

/// Ranges around the data that have one scale on a page of this size: the one that needs less room is widened.
fn to_scale([x, y]: [[f64; 2]; 2], [width, height]: [f64; 2], ratio: f64) -> [[f64; 2]; 2] {
    let span = |[low, high]: [f64; 2]| (high - low) * (1.0 + 2.0 * Y_PADDING);
    // Units of the horizontal axis by pixel.
    let unit = (span(x) / width).max(ratio * span(y) / height);
    let around = |[low, high]: [f64; 2], span: f64| [0.5 * (low + high - span), 0.5 * (low + high + span)];
    [around(x, unit * width), around(y, unit * height / ratio)]
}

/// Values that an axis must show: all data, and those bounds and references that leave the data room.
fn axis_values(figure: &Figure, axis: usize) -> Vec<f64> {
    let scale = if axis == 0 { figure.x.scale } else { figure.y.scale };
    let of = |bound: bool| {
        figure
            .series
            .iter()
            .filter(move |s| matches!(s.style, SeriesStyle::Bound | SeriesStyle::Body) == bound)
            .flat_map(move |s| s.points.iter().map(move |p| p[axis]))
    };
    let mut values: Vec<f64> = of(false).filter(|v| v.is_finite()).collect();
    let references = figure.references.iter().filter_map(|r| match (r, axis) {
        (ReferenceLine::Vertical { value, .. }, 0) | (ReferenceLine::Horizontal { value, .. }, 1) => {
            Some(*value)
        }
        _ => None,
    });
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let magnitude = low.abs().max(high.abs());
    let spread = high - low;
    // Beyond this distance from the data an axis would flatten them.
    let distance = if spread > 1e-9 * magnitude { 2.0 * spread } else { 10.0 * magnitude };
    let near = |v: &f64| {
        let distant = *v < low - distance || *v > high + distance;
        v.is_finite()
            && (values.is_empty() || scale == AxisScale::Logarithmic || magnitude == 0.0 || !distant)
    };
    let extra: Vec<f64> = of(true).chain(references).filter(near).collect();
    values.extend(extra);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Axis;

    fn axes() -> Figure {
        Figure::new("test", Axis::new("time", "s"), Axis::new("thrust", "N"))
    }

    #[test]
    fn gaps_split_lines() {
        let points = vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, 2.0], [4.0, 1.0]];
        let svg = axes().with(Series::line("a", points)).to_svg();
        assert_eq!(svg.matches("stroke=\"#0072B2\"").count(), 2);
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn near_bounds_widen_the_axis_and_distant_ones_do_not() {
        let data = Series::line("a", vec![[0.0, 1.0], [1.0, 2.0]]);
        let bound = |y| Series::bound("b", vec![[0.0, y], [1.0, y]]);
        let near = axes().with(data.clone()).with(bound(3.0));
        assert!(near.to_svg().contains("#6B7580"));
        let distant = axes().with(data).with(bound(1e6));
        assert!(!distant.to_svg().contains("#6B7580"));
    }

    #[test]
    fn maps_have_one_scale() {
        for (x, y) in [(4.0, 1.0), (1.0, 4.0)] {
            let corners = vec![[10.0, 40.0], [10.0 + x, 40.0 + y]];
            let map = axes().with(Series::dots("a", corners)).to_scale(2.0);
            let drawing = Drawing::new(&map);
            let at = |p| drawing.place(p).expect("inside");
            let (a, b) = (at([10.0, 40.0]), at([10.0 + x, 40.0 + y]));
            let ratio = (a.1 - b.1) / y / ((b.0 - a.0) / x);
            assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
        }
    }

    /// A square is as high as the page allows, a strip not higher than any other figure.
    #[test]
    fn figures_to_scale_have_the_height_that_they_need() {
        for (x, y, height) in [(4.0, 1.0, HEIGHT), (1.0, 1.0, TALLEST), (1.0, 1e9, TALLEST)] {
            let corners = vec![[0.0, 0.0], [x, y]];
            let figure = axes().with(Series::dots("a", corners)).to_scale(1.0);
            assert_eq!(Drawing::new(&figure).height.to_bits(), f64::to_bits(height), "{x} by {y}");
            let svg = figure.to_svg();
            assert!(svg.contains(&format!("viewBox=\"0 0 5600 {height:.0}0\"")), "{svg}");
            assert!(stacked_svg(&[figure]).contains(&format!("height=\"{height:.0}\"")));
        }
    }

    /// The eighth series has the colour of the first, and dashes; so has its name.
    #[test]
    fn repeated_colours_are_dashed() {
        let line = |k: usize| Series::line(format!("{k}"), vec![[0.0, k as f64], [1.0, 1.0]]);
        let figure = (0..8).map(line).fold(axes(), Figure::with);
        let svg = stacked_svg(&[figure]);
        let drawn: Vec<&str> = svg.lines().filter(|l| l.contains("data-series=")).collect();
        let is_dashed: Vec<bool> = drawn.iter().map(|l| l.contains("stroke-dasharray")).collect();
        assert_eq!(is_dashed, [[false; 7].as_slice(), &[true]].concat());
        assert!(drawn[7].contains("#0072B2"), "{}", drawn[7]);
        let names: Vec<&str> = svg.lines().filter(|l| l.contains("<path d=\"M1 5H25\"")).collect();
        assert_eq!(names.len(), 8);
        assert!(names[7].contains("stroke-dasharray") && !names[0].contains("stroke-dasharray"));
    }

    /// A long title has several lines, and what is below it moves down by as much.
    #[test]
    fn long_titles_are_broken() {
        let titled = |title: &str| stacked_svg(&[Figure { title: title.into(), ..axes() }]);
        let height = |svg: &str| -> f64 {
            let sizes = svg.split("viewBox=\"0 0 ").nth(1).and_then(|rest| rest.split('"').next());
            sizes.and_then(|sizes| sizes.split(' ').nth(1)?.parse().ok()).expect("a view box")
        };
        let (short, long) = (titled("Speed"), titled(&"a word and another ".repeat(7)));
        assert_eq!((height(&long) - height(&short)).to_bits(), TITLE_LINE.to_bits());
        let lines: Vec<&str> = long.lines().filter(|line| line.contains("font-weight")).collect();
        assert_eq!(lines.len(), 2, "{lines:?}");
        // The drawing has the title as well, for readers that hear it.
        assert_eq!(long.matches("another").count(), 2 * 7, "{long}");
    }

    #[test]
    fn texts_are_escaped() {
        let figure = Figure::new("<b>&", Axis::new("<x>", "-"), Axis::new("y", "\"<&"));
        let svg = figure.to_svg();
        assert!(svg.contains("<title>&lt;b&gt;&amp;</title>"));
        assert!(!svg.contains("<x>") && !svg.contains("<b>"));
    }

    #[test]
    fn extreme_data_are_drawn() {
        for scale in [f64::NAN, f64::INFINITY, 0.0, 1e-320, 1e300, f64::MAX] {
            let points = vec![[0.0, -scale], [scale, scale], [1.0, 1.0]];
            let figure = axes().with(Series::line("a", points)).horizontal("r", scale).vertical("s", -scale);
            let svg = figure.to_svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{scale}");
        }
    }
}
