//! Times of the rows of an ephemeris: equally spaced, and both ends of each part of the flight.

use std::str::FromStr;

use crate::EphemerisError;
use crate::flight::Span;

/// Spacing of the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sampling {
    /// A step, s; rows stand at its multiples from the start of the flight.
    Step(f64),
    /// A number of rows from the start of the flight to its end, at least two.
    Points(u64),
}

/// Bytes that a row takes in all files together, with its table.
const ROW: f64 = 4e3;

/// Part of the step within which a multiple of it is the end of a phase.
const SAME: f64 = 1e-6;

impl Sampling {
    fn step(self, spans: &[Span]) -> f64 {
        match self {
            Self::Step(step) => step,
            Self::Points(points) => total(spans) / points.saturating_sub(1).max(1) as f64,
        }
    }

    /// Rows of a flight, no fewer than [`Self::times`] has.
    #[must_use]
    pub fn rows(self, spans: &[Span]) -> f64 {
        (total(spans) / self.step(spans)).ceil() + 1.0 + 2.0 * spans.len() as f64
    }

    /// Bytes that the files of a flight take while they are written, foreseen.
    #[must_use]
    pub fn bytes(self, spans: &[Span]) -> f64 {
        ROW * self.rows(spans)
    }

    /// Times of the rows of each part: its start, multiples of the step from the start of the flight, its end.
    #[must_use]
    pub fn times(self, spans: &[Span]) -> Vec<Vec<f64>> {
        let step = self.step(spans);
        let start = spans.first().map_or(0.0, |span| span.times[0]);
        let of_span = |span: &Span| {
            let [begin, end] = span.times;
            let first = ((begin - start) / step + SAME).floor() + 1.0;
            let count = ((end - start) / step - SAME).ceil() - first;
            let inner = (0..count.max(0.0) as u64).map(|k| start + step * (first + k as f64));
            let inner = inner.filter(|t| *t > begin && *t < end);
            let mut times: Vec<f64> = std::iter::once(begin).chain(inner).collect();
            if end > begin {
                times.push(end);
            }
            times
        };
        spans.iter().map(of_span).collect()
    }
}

fn total(spans: &[Span]) -> f64 {
    match (spans.first(), spans.last()) {
        (Some(first), Some(last)) => last.times[1] - first.times[0],
        _ => 0.0,
    }
}

/// Units of a step, longer names first, and their seconds.
const UNITS: [(&str, f64); 6] =
    [("min", 60.0), ("ms", 1e-3), ("us", 1e-6), ("s", 1.0), ("h", 3600.0), ("d", 86_400.0)];

/// A step as a text with a unit: `10s`, `0.5`, `2min`, `1h`; s without one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step(pub f64);

impl FromStr for Step {
    type Err = EphemerisError;

    fn from_str(text: &str) -> Result<Self, EphemerisError> {
        let trimmed = text.trim();
        let with_unit =
            UNITS.iter().find_map(|(name, seconds)| Some((trimmed.strip_suffix(name)?, *seconds)));
        let (number, seconds) = with_unit.unwrap_or((trimmed, 1.0));
        match number.trim().parse::<f64>().map(|v| v * seconds) {
            Ok(step) if step > 0.0 && step.is_finite() => Ok(Self(step)),
            _ => Err(EphemerisError::Step { text: text.into() }),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn span(begin: f64, end: f64) -> Span {
        Span { name: "p".into(), times: [begin, end] }
    }

    #[test]
    fn both_sides_of_a_boundary_have_a_row() {
        let spans = [span(0.0, 25.0), span(25.0, 40.0), span(40.0, 42.0)];
        let times = Sampling::Step(10.0).times(&spans);
        assert_eq!(times, [vec![0.0, 10.0, 20.0, 25.0], vec![25.0, 30.0, 40.0], vec![40.0, 42.0]]);
        assert!(Sampling::Step(10.0).rows(&spans) >= 9.0);
    }

    #[test]
    fn points_divide_the_flight() {
        let spans = [span(3.0, 7.0)];
        assert_eq!(Sampling::Points(5).times(&spans), [vec![3.0, 4.0, 5.0, 6.0, 7.0]]);
        assert_eq!(Sampling::Points(2).times(&spans), [vec![3.0, 7.0]]);
        // A step that divides the flight but for rounding has no row beside its end.
        assert_eq!(Sampling::Step(0.1).times(&[span(0.0, 0.3)])[0].len(), 4);
        assert_eq!(Sampling::Step(1e9).times(&spans), [vec![3.0, 7.0]]);
        assert_eq!(Sampling::Step(1.0).times(&[span(2.0, 2.0)]), [vec![2.0]]);
        assert!(Sampling::Step(1e-12).bytes(&spans) > 1e15);
    }

    #[test]
    fn steps_have_units() {
        for (text, seconds) in
            [("10s", 10.0), ("0.5", 0.5), ("2min", 120.0), ("1 h", 3600.0), ("250ms", 0.25)]
        {
            assert_eq!(text.parse::<Step>().unwrap(), Step(seconds));
        }
        for text in ["0", "-1s", "nan", "inf", "", "s", "1m", "1e400", "ten"] {
            let message = text.parse::<Step>().unwrap_err().to_string();
            assert!(message.contains("a time above 0 is expected"), "{text}: {message}");
        }
    }
}
