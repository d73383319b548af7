//! Bounds of tables of one variable over intervals.

use crate::interval::{ALL, Interval, ZERO, hull};
use crate::pchip::Outside;
use crate::table::Table;

impl Table {
    /// Bounds of value, first and second derivative of a table of one variable over an interval: those of the control points of its cubics
    /// (the Bernstein form; R. T. Farouki, Comput. Aided Geom. Design 29 (2012) 379, doi 10.1016/j.cagd.2012.03.001).
    pub(crate) fn curve_enclosure(&self, x: Interval) -> [Interval; 3] {
        let (knots, stays): (&[f64], _) = match self {
            Self::Cubic(t) => (t.knots(), false),
            Self::Pchip(t) => (t.knots(), t.outside() == Outside::Constant),
            Self::Bicubic(_) => return [ALL; 3],
        };
        let [first, last] = [knots[0], knots[knots.len() - 1]];
        // Beyond the ends a value that stays is that at the end.
        let x = if stays { [x[0].max(first.min(x[1])), x[1].min(last.max(x[0]))] } else { x };
        if x.iter().any(|v| !v.is_finite()) {
            return [ALL; 3];
        }
        if stays && (x[1] <= first || x[0] >= last) {
            let value = self.curve_jet(x[0])[0];
            return [[value; 2], ZERO, ZERO];
        }
        let inner = knots.iter().copied().filter(|k| x[0] < *k && *k < x[1]);
        let mut ends: Vec<f64> = inner.collect();
        ends.insert(0, x[0]);
        ends.push(x[1]);
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for w in ends.windows(2) {
            let piece = self.cubic_enclosure(w[0], w[1]);
            bounds = std::array::from_fn(|k| hull(bounds[k], piece[k]));
        }
        if stays && (x[0] <= first || x[1] >= last) {
            bounds[1] = hull(bounds[1], ZERO);
            bounds[2] = if self.kinks().is_empty() { hull(bounds[2], ZERO) } else { ALL };
        }
        bounds
    }

    /// The same within one piece.
    fn cubic_enclosure(&self, a: f64, b: f64) -> [Interval; 3] {
        let h = b - a;
        let [start, end] = [a, b].map(|x| self.curve_jet(x));
        if h <= 0.0 {
            return [0, 1, 2].map(|k| [start[k].min(end[k]), start[k].max(end[k])]);
        }
        // Values, slopes and second derivatives of the control points.
        let points = [start[0], start[0] + start[1] * h / 3.0, end[0] - end[1] * h / 3.0, end[0]];
        let slopes = [start[1], 3.0 * (points[2] - points[1]) / h, end[1]];
        // A knot has the curvature of the piece behind it.
        let curvatures = [2.0 * (slopes[1] - slopes[0]) / h, 2.0 * (slopes[2] - slopes[1]) / h, end[2]];
        [&points[..], &slopes, &curvatures]
            .map(|values| values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |all, v| hull(all, [*v; 2])))
    }
}
