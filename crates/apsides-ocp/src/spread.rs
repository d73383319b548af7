//! Points that are spread evenly over a cube, for starts that are tried one after the other.

/// Points of a unit cube, each far from those before it: multiples of powers of a generalised golden ratio (M. Roberts, The unreasonable
/// effectiveness of quasirandom sequences, 2018).
#[derive(Clone, Debug)]
pub struct Spread {
    steps: Vec<f64>,
    point: Vec<f64>,
}

impl Spread {
    /// Iterations to the ratio, each of which halves its error at least.
    const ITERATIONS: usize = 60;

    /// The points of a cube of so many dimensions, of which its middle is the first one.
    #[must_use]
    pub fn of(dimension: usize) -> Self {
        // The root of x^(d + 1) = x + 1.
        let exponent = 1.0 / (dimension + 1) as f64;
        let ratio = (0..Self::ITERATIONS).fold(2.0, |x: f64, _| (1.0 + x).powf(exponent));
        let steps = std::iter::successors(Some(1.0 / ratio), |step| Some(step / ratio)).take(dimension);
        Self { steps: steps.collect(), point: vec![0.5; dimension] }
    }
}

impl Iterator for Spread {
    type Item = Vec<f64>;

    fn next(&mut self) -> Option<Vec<f64>> {
        let next = self.point.iter().zip(&self.steps).map(|(value, step)| (value + step).fract()).collect();
        Some(std::mem::replace(&mut self.point, next))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points that are looked at.
    const POINTS: usize = 100;
    /// Round-off: sums and powers of numbers of order one.
    const ROUNDING: f64 = 1e-14;

    /// In one dimension the ratio is the golden one, and no two of the points are closer than they must be.
    #[test]
    fn points_are_spread() {
        let points: Vec<f64> = Spread::of(1).take(POINTS).map(|p| p[0]).collect();
        let mut sorted = points.clone();
        sorted.sort_by(f64::total_cmp);
        let least = sorted.windows(2).map(|w| w[1] - w[0]).fold(1.0, f64::min);
        let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
        assert!((points[1] - (0.5 + 1.0 / golden).fract()).abs() < ROUNDING);
        assert!(least > 0.4 / POINTS as f64, "{least}");
        // Each quarter of a square has its part.
        let corner = Spread::of(2).take(POINTS).filter(|p| p[0] < 0.5 && p[1] < 0.5).count();
        assert!((20..=30).contains(&corner), "{corner}");
    }
}
