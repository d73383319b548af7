//! Where values, ticks and labels of an axis stand.

use crate::figure::{Axis, AxisScale};
use crate::number::power_of_ten;
use crate::units::display_unit;

/// Values beyond this are gaps: their differences must not overflow.
const LARGEST: f64 = 1e150;

/// Numbers below this are zero: their inverses must not overflow.
const SMALLEST: f64 = 1e-150;

/// Spread below this part of the magnitude is what solutions leave, not data.
pub(crate) const FLAT: f64 = 1e-6;

/// Half of an axis in differences that are none.
const STILL: f64 = 100.0;

/// A tick: place on the axis from 0 to 1, and text.
pub(crate) struct Tick {
    pub(crate) position: f64,
    pub(crate) label: String,
}

/// An axis with its range and ticks decided.
pub(crate) struct AxisLayout {
    scale: AxisScale,
    /// Data unit to the numbers at the ticks.
    factor: f64,
    /// Ends, as numbers at the ticks (their decadic logarithms on a logarithmic axis).
    low: f64,
    high: f64,
    /// Ticks with labels.
    pub(crate) ticks: Vec<Tick>,
    /// Positions of fine grid lines.
    pub(crate) minor: Vec<f64>,
    /// Name and unit.
    pub(crate) title: String,
}

impl AxisLayout {
    /// The ends, as numbers at the ticks; their decadic logarithms on a logarithmic axis.
    pub(crate) fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    pub(crate) fn is_logarithmic(&self) -> bool {
        self.scale == AxisScale::Logarithmic
    }

    /// An axis for `values`; `padding` is free space at both ends as a part of the range, `ticks` the wanted number.
    pub(crate) fn new(axis: &Axis, values: impl Iterator<Item = f64>, padding: f64, ticks: usize) -> Self {
        let (low, high) = range(axis.scale, values.chain(axis.including));
        match axis.scale {
            AxisScale::Linear => Self::linear(axis, low, high, padding, ticks),
            AxisScale::Logarithmic => Self::logarithmic(axis, low, high, ticks),
        }
    }

    fn linear(axis: &Axis, low: f64, high: f64, padding: f64, ticks: usize) -> Self {
        // What is left of zero is drawn on the axis of a zero.
        let size = low.abs().max(high.abs());
        let size = if size < SMALLEST.max(axis.resolution) { 0.0 } else { size };
        let unit = display_unit(&axis.unit, size);
        let (mut low, mut high) = (low * unit.factor, high * unit.factor);
        let (magnitude, resolution) = (size * unit.factor, axis.resolution * unit.factor);
        if high - low <= resolution.max(FLAT * magnitude) || magnitude == 0.0 {
            let about = if magnitude > 0.0 { 0.05 * magnitude } else { 1.0 };
            let half = about.max(STILL * resolution);
            let middle = 0.5 * (low + high);
            (low, high) = (middle - half, middle + half);
        } else {
            let space = padding * (high - low);
            (low, high) = (low - space, high + space);
        }
        // Large and small numbers share a power of ten in the title.
        let exponent = magnitude.log10().floor();
        let power = if magnitude > 0.0 && !(-3.0..5.0).contains(&exponent) {
            (exponent / 3.0).floor() as i32 * 3
        } else {
            0
        };
        let factor = unit.factor * 10f64.powi(-power);
        let (low, high) = (low * 10f64.powi(-power), high * 10f64.powi(-power));
        let (values, decimals) = linear_ticks(low, high, ticks, unit.name.starts_with("deg"));
        let ticks = values
            .into_iter()
            .map(|v| Tick { position: (v - low) / (high - low), label: tick_label(v, decimals) })
            .collect();
        let title = title(&axis.label, &unit.name, power);
        Self { scale: AxisScale::Linear, factor, low, high, ticks, minor: Vec::new(), title }
    }

    fn logarithmic(axis: &Axis, low: f64, high: f64, wanted: usize) -> Self {
        // Whole decades, so that at least two labels stand at the axis.
        let low = low.log10().floor();
        let high = high.log10().ceil().max(low + 1.0);
        let (first, last) = (low as i32, high as i32);
        let step = ((last - first) as usize).div_ceil(wanted.max(1)).max(1);
        let position = |exponent: f64| (exponent - low) / (high - low);
        let ticks = (first..=last)
            .step_by(step)
            .map(|e| Tick { position: position(f64::from(e)), label: power_of_ten(e) })
            .collect();
        let minor = if last - first <= 4 {
            let parts = |e| (2..10).map(move |k| f64::from(e) + f64::from(k).log10());
            (first..last).flat_map(parts).map(position).collect()
        } else if last - first <= 40 {
            (first..=last).map(|e| position(f64::from(e))).collect()
        } else {
            Vec::new()
        };
        let unit = crate::units::pretty(&axis.unit);
        Self {
            scale: AxisScale::Logarithmic,
            factor: 1.0,
            low,
            high,
            ticks,
            minor,
            title: title(&axis.label, &unit, 0),
        }
    }

    /// Place of a value from 0 to 1, beyond these outside the range; none where nothing can be drawn.
    pub(crate) fn position(&self, value: f64) -> Option<f64> {
        let number = match self.scale {
            AxisScale::Linear => value * self.factor,
            AxisScale::Logarithmic => value.log10(),
        };
        (drawable(self.scale, value)).then(|| (number - self.low) / (self.high - self.low))
    }
}

/// Returns true if a value has a place on an axis.
fn drawable(scale: AxisScale, value: f64) -> bool {
    value.abs() < LARGEST && (scale == AxisScale::Linear || value >= f64::MIN_POSITIVE)
}

/// Least and largest drawable value; a unit range when there is none.
fn range(scale: AxisScale, values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| drawable(scale, *v))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    match (low <= high, scale) {
        (true, _) => (low, high),
        (false, AxisScale::Linear) => (0.0, 1.0),
        (false, AxisScale::Logarithmic) => (0.1, 1.0),
    }
}

/// Round numbers within `[low, high]`, and the decimals that tell them apart.
fn linear_ticks(low: f64, high: f64, wanted: usize, degrees: bool) -> (Vec<f64>, usize) {
    let rough = (high - low) / wanted.max(1) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let turns = [15.0, 30.0, 45.0, 90.0, 180.0, 360.0];
    let step = if degrees && (6.0..=360.0).contains(&rough) {
        turns.into_iter().find(|s| *s >= rough * 0.99).unwrap_or(360.0)
    } else {
        let step = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().find(|s| s * power >= rough * 0.99).unwrap_or(10.0);
        step * power
    };
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    let decimals = (0..15).find(|d| {
        let shifted = step * 10f64.powi(*d);
        (shifted - shifted.round()).abs() < 1e-6 * shifted
    });
    // The step exceeds a part of the range, so that these are a handful.
    ((first..=last).map(|k| k as f64 * step).collect(), decimals.unwrap_or(15) as usize)
}

fn tick_label(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.trim_start_matches('-').bytes().all(|b| matches!(b, b'0' | b'.'));
    if zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "\u{2212}") }
}

fn title(label: &str, unit: &str, power: i32) -> String {
    let power = if power == 0 { String::new() } else { power_of_ten(power) };
    match (power.is_empty(), unit.is_empty()) {
        (true, true) => label.to_owned(),
        (true, false) => format!("{label} ({unit})"),
        (false, true) => format!("{label} ({power})"),
        (false, false) => format!("{label} ({power} {unit})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of a range that is drawn about one value.
    const ROUNDING: f64 = 1e-6;

    fn labels(layout: &AxisLayout) -> Vec<&str> {
        layout.ticks.iter().map(|t| t.label.as_str()).collect()
    }

    #[test]
    fn linear_axes_choose_units_and_round_ticks() {
        let axis = AxisLayout::new(&Axis::new("altitude", "m"), [0.0, 15_000.0].into_iter(), 0.0, 5);
        assert_eq!(axis.title, "altitude (km)");
        assert_eq!(labels(&axis), ["0", "5", "10", "15"]);
        assert_eq!(axis.position(7_500.0), Some(0.5));
        assert_eq!(axis.position(f64::NAN), None);
        let angle = AxisLayout::new(&Axis::new("angle", "rad"), [-1.6, 1.6].into_iter(), 0.0, 5);
        assert_eq!(angle.title, "angle (deg)");
        assert_eq!(labels(&angle), ["\u{2212}90", "\u{2212}45", "0", "45", "90"]);
    }

    /// Rounding of an angle, and less than a solver promises of a place, are not drawn as motions; what is larger is.
    #[test]
    fn differences_below_the_resolution_are_none() {
        let drawn = |axis: &Axis, values: [f64; 2]| {
            let layout = AxisLayout::new(axis, values.into_iter(), 0.05, 5);
            let [a, b] = values.map(|v| layout.position(v).expect("drawable"));
            ((b - a).abs(), layout.title)
        };
        let angle = Axis::new("sideslip", "rad");
        assert_eq!(drawn(&angle, [-3e-13, 4e-13]).1, "sideslip (deg)");
        assert!(drawn(&angle, [-3e-13, 4e-13]).0 < 0.005 && drawn(&angle, [-3e-9, 4e-9]).0 > 0.9);
        assert!(drawn(&Axis::new("rate", "deg/s"), [0.0, 1e-9]).0 < 0.005);
        let place = || Axis::new("cross range", "m");
        assert!(drawn(&place(), [0.0, 1e-4]).0 > 0.9);
        let place = place().resolved_to(1e-3);
        for (values, is_flat, title) in [
            ([0.0, 1e-4], true, "cross range (m)"),
            ([-9e-4, 0.0], true, "cross range (m)"),
            ([1e4, 1e4 + 5e-4], true, "cross range (km)"),
            ([0.0, 0.02], false, "cross range (mm)"),
        ] {
            let (height, found) = drawn(&place, values);
            assert_eq!((height < 0.01, found.as_str()), (is_flat, title), "{values:?}: {height}");
        }
        assert_eq!(place.clone().resolved_to(f64::NAN).resolved_to(1e-9), place);
    }

    #[test]
    fn constants_and_extremes_have_a_range() {
        for value in [0.0, 1e-300, 1e149, -3.0, 1e6] {
            let axis = AxisLayout::new(&Axis::new("x", "-"), [value].into_iter(), 0.05, 5);
            let position = axis.position(value).expect("drawable");
            assert!((position - 0.5).abs() < ROUNDING, "{value}: {position}");
            assert!((2..12).contains(&axis.ticks.len()), "{value}: {}", axis.ticks.len());
        }
        let noisy = AxisLayout::new(&Axis::new("x", "kg"), [600.0, 600.0 + 1e-9].into_iter(), 0.05, 5);
        assert!(labels(&noisy).iter().all(|l| l.len() <= 4), "{:?}", labels(&noisy));
        let large = AxisLayout::new(&Axis::new("x", "kg"), [0.0, 2e7].into_iter(), 0.0, 4);
        assert_eq!(large.title, "x (10⁶ kg)");
        assert_eq!(labels(&large), ["0", "5", "10", "15", "20"]);
    }

    #[test]
    fn no_data_and_infinite_data() {
        let axis = AxisLayout::new(&Axis::new("x", "-"), [f64::NAN, f64::INFINITY].into_iter(), 0.0, 5);
        assert_eq!(axis.position(0.5), Some(0.5));
    }

    #[test]
    fn logarithmic_axes_have_whole_decades() {
        let axis =
            AxisLayout::new(&Axis::new("error", "-").logarithmic(), [3e-9, 2e-6, 0.0].into_iter(), 0.05, 5);
        assert_eq!(labels(&axis), ["10⁻⁹", "10⁻⁸", "10⁻⁷", "10⁻⁶", "10⁻⁵"]);
        assert_eq!(axis.position(1e-7), Some(0.5));
        assert_eq!(axis.position(0.0), None);
    }
}
