//! Parts of all flights, with their intervals of confidence.

use serde::Serialize;

/// The normal deviate that 2.5 % exceed.
const NORMAL_975: f64 = 1.959_963_984_540_054;

/// A part of all flights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Proportion {
    /// Flights of the part.
    pub count: usize,
    /// All flights.
    pub of: usize,
    /// Their ratio.
    pub part: f64,
    /// Interval of 95 % confidence for the probability (E. B. Wilson, Probable inference, the law of succession, and statistical inference,
    /// Journal of the American Statistical Association 22, 1927, pp. 209-212, <https://doi.org/10.1080/01621459.1927.10502953>).
    pub interval: [f64; 2],
}

impl Proportion {
    /// `count` of `of` flights; the interval is 0 to 1 where there are none.
    #[must_use]
    pub fn new(count: usize, of: usize) -> Self {
        if of == 0 {
            return Self { count, of, part: f64::NAN, interval: [0.0, 1.0] };
        }
        let (n, part, z2) = (of as f64, count as f64 / of as f64, NORMAL_975 * NORMAL_975);
        let middle = part + z2 / (2.0 * n);
        let half = NORMAL_975 * (part * (1.0 - part) / n + z2 / (4.0 * n * n)).sqrt();
        // At both ends the formula gives the bound up to rounding.
        let low = if count == 0 { 0.0 } else { (middle - half) / (1.0 + z2 / n) };
        let high = if count == of { 1.0 } else { (middle + half) / (1.0 + z2 / n) };
        Self { count, of, part, interval: [low, high] }
    }
}

#[cfg(test)]
mod tests {
    use super::Proportion;

    /// Published: four digits.
    const PUBLISHED: f64 = 5e-5;

    /// R. G. Newcombe, Two-sided confidence intervals for the single proportion, Statistics in Medicine 17 (1998), table I, method 3.
    #[test]
    fn intervals_are_those_of_newcombe() {
        for (count, of, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let p = Proportion::new(count, of);
            assert!(
                (p.interval[0] - low).abs() < PUBLISHED && (p.interval[1] - high).abs() < PUBLISHED,
                "{p:?}"
            );
        }
        let all = Proportion::new(20, 20);
        assert_eq!((all.part, all.interval[1]), (1.0, 1.0));
        assert_eq!(Proportion::new(0, 0).interval, [0.0, 1.0]);
    }
}
