//! The content of a figure: axes, series, reference lines and labelled spans, in the units of the data.

use std::ops::Range;

use crate::palette::COLORS;

/// The scale of an axis: linear or logarithmic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AxisScale {
    /// Equal steps.
    #[default]
    Linear,
    /// Equal ratios; values that are not positive are gaps.
    Logarithmic,
}

/// Name, unit and scale of an axis.
///
/// The page shows the unit that is easiest to read: 15000 m as 15 km, rad as deg.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name of the quantity.
    pub label: String,
    /// Unit of the data, `-` for none.
    pub unit: String,
    /// Linear unless stated.
    pub scale: AxisScale,
    /// A value that the axis must reach, such as zero for a count.
    pub including: Option<f64>,
    /// Differences below this are what solvers and arithmetic leave: a linear axis is not narrow enough to show them. Zero where everything counts.
    pub resolution: f64,
}

/// Angles (rad) and their rates below this are the rounding of an attitude or of a direction.
const ANGLE_ROUNDING: f64 = 1e-10;

impl Axis {
    /// A linear axis. Angles and angular rates are resolved to their rounding, other quantities without limit.
    #[must_use]
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        let (label, unit) = (label.into(), unit.into());
        let resolution = match unit.split('/').next() {
            Some("rad") => ANGLE_ROUNDING,
            Some("deg") => ANGLE_ROUNDING.to_degrees(),
            _ => 0.0,
        };
        Self { label, unit, scale: AxisScale::Linear, including: None, resolution }
    }

    /// The same axis, on which differences below `resolution`, in the unit of the data, are none.
    #[must_use]
    pub fn resolved_to(self, resolution: f64) -> Self {
        let resolution =
            if resolution.is_finite() { self.resolution.max(resolution) } else { self.resolution };
        Self { resolution, ..self }
    }

    /// The same axis, logarithmic.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { scale: AxisScale::Logarithmic, ..self }
    }

    /// The same axis, reaching `value`.
    #[must_use]
    pub fn including(self, value: f64) -> Self {
        Self { including: Some(value), ..self }
    }
}

/// The style in which the points of a series are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SeriesStyle {
    /// A line through the points.
    #[default]
    Line,
    /// A dot at each point.
    Dots,
    /// A dashed grey line that does not widen the axes much: bounds.
    Bound,
    /// A filled outline: the body, or the ground.
    Body,
}

/// Points with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; no entry when empty.
    pub label: String,
    /// `[x, y]` in the units of the axes; a point that is not finite is a gap.
    pub points: Vec<[f64; 2]>,
    /// Line unless stated.
    pub style: SeriesStyle,
    /// Index of the colour in the palette; the next free one when absent.
    pub color: Option<usize>,
}

impl Series {
    /// A line.
    #[must_use]
    pub fn line(label: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), points, style: SeriesStyle::Line, color: None }
    }

    /// Dots.
    #[must_use]
    pub fn dots(label: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { style: SeriesStyle::Dots, ..Self::line(label, points) }
    }

    /// A bound.
    #[must_use]
    pub fn bound(label: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { style: SeriesStyle::Bound, ..Self::line(label, points) }
    }

    /// An outline that is filled: the body that a flight is about, or the ground.
    #[must_use]
    pub fn body(label: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { style: SeriesStyle::Body, ..Self::line(label, points) }
    }

    /// The same series in a colour of the palette, to pair it with another one.
    #[must_use]
    pub fn colored(self, color: usize) -> Self {
        Self { color: Some(color), ..self }
    }
}

/// A straight line across the figure.
#[derive(Clone, Debug, PartialEq)]
pub enum ReferenceLine {
    /// At a value of the vertical axis.
    Horizontal {
        /// Value in the unit of the vertical axis.
        value: f64,
        /// Name in the legend.
        label: String,
    },
    /// At a value of the horizontal axis.
    Vertical {
        /// Value in the unit of the horizontal axis.
        value: f64,
        /// Name in the legend.
        label: String,
    },
}

impl ReferenceLine {
    /// Name in the legend.
    #[must_use]
    pub fn label(&self) -> &str {
        let (Self::Horizontal { label, .. } | Self::Vertical { label, .. }) = self;
        label
    }
}

/// A named part of the horizontal axis, such as a phase: its ends are marked, its name stands above.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Name; left out where it does not fit.
    pub label: String,
    /// Ends in the unit of the horizontal axis.
    pub range: Range<f64>,
}

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Lines and dots, later ones above earlier ones.
    pub series: Vec<Series>,
    /// Reference lines.
    pub references: Vec<ReferenceLine>,
    /// Named parts of the horizontal axis.
    pub spans: Vec<Span>,
    /// Length on the page of a unit of the vertical axis by that of the horizontal one, for two linear axes of the same unit; each
    /// axis fills the page when absent.
    pub scale_ratio: Option<f64>,
}

impl Figure {
    /// A figure with axes and no data.
    #[must_use]
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            series: Vec::new(),
            references: Vec::new(),
            spans: Vec::new(),
            scale_ratio: None,
        }
    }

    /// Adds a series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The same figure with this length of a unit of the vertical axis by that of the horizontal one.
    #[must_use]
    pub fn to_scale(self, ratio: f64) -> Self {
        Self { scale_ratio: Some(ratio), ..self }
    }

    /// Adds a horizontal reference line at `value`, in the unit of the vertical axis.
    #[must_use]
    pub fn horizontal(mut self, label: impl Into<String>, value: f64) -> Self {
        self.references.push(ReferenceLine::Horizontal { value, label: label.into() });
        self
    }

    /// Adds a vertical reference line at `value`, in the unit of the horizontal axis.
    #[must_use]
    pub fn vertical(mut self, label: impl Into<String>, value: f64) -> Self {
        self.references.push(ReferenceLine::Vertical { value, label: label.into() });
        self
    }

    /// Names of the series with their colours in words, for a text beside the figure.
    #[must_use]
    pub fn legend(&self) -> String {
        let named = self.series.iter().zip(self.colors()).filter(|(s, _)| !s.label.is_empty());
        let words = named.map(|(s, color)| match color {
            Some(k) => format!("{} {}", s.label, COLORS[k % COLORS.len()].0),
            None if s.style == SeriesStyle::Body => format!("{} grey", s.label),
            None => format!("{} dashed", s.label),
        });
        words.collect::<Vec<_>>().join(", ")
    }

    /// Index into the palette for each series; bounds have none.
    pub(crate) fn colors(&self) -> Vec<Option<usize>> {
        let mut next = 0;
        let color = |s: &Series| match (s.style, s.color) {
            (SeriesStyle::Bound | SeriesStyle::Body, _) => None,
            (_, Some(color)) => Some(color),
            (_, None) => {
                next += 1;
                Some(next - 1)
            }
        };
        self.series.iter().map(color).collect()
    }
}
