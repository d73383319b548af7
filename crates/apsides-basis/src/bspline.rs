//! B-splines: basis functions of any order over knots of any multiplicity, and what keeps a spline unchanged.
//!
//! With the order `k` (degree plus one) and non-decreasing knots `t_0 .. t_{n+k-1}` there are `n` basis functions
//!
//! ```text
//! B_{j,1}(x) = 1 on [t_j, t_{j+1}), else 0
//! B_{j,k}(x) = (x - t_j) / (t_{j+k-1} - t_j) B_{j,k-1}(x) + (t_{j+k} - x) / (t_{j+k} - t_{j+1}) B_{j+1,k-1}(x)
//! ```
//!
//! on the interval `[t_{k-1}, t_n]`. At a knot of multiplicity `m` a spline has `k - 1 - m` continuous derivatives; with `m = k`
//! it jumps. C. de Boor, *A Practical Guide to Splines*, Springer 2001, chapters IX to XI; W. Boehm, *Computer-Aided
//! Design* 12 (1980) 199, doi:10.1016/0010-4485(80)90154-2 (knot insertion); L. Ramshaw, *Computer Aided Geometric
//! Design* 6 (1989) 323, doi:10.1016/0167-8396(89)90032-0 (blossoms, from which degree elevation follows).

use crate::BasisError;

/// Largest order of a [`Bspline`].
pub const MAX_ORDER: usize = 32;

/// The B-splines of one order over one knot vector.
///
/// Coefficients of splines are row-major, one row of components per basis function. Evaluation allocates nothing; where a
/// slice is shorter than its documented length the methods panic, as indexing does. Outside the interval the first or last
/// polynomial piece continues.
#[derive(Debug, Clone, PartialEq)]
pub struct Bspline {
    order: usize,
    knots: Vec<f64>,
}

/// One row per order, filled from the left.
type Rows = [f64; MAX_ORDER];

impl Bspline {
    /// The basis of an order over knots: at least `2 order` of them, finite, not decreasing, none more than `order` times, and
    /// increasing somewhere between the `order`-th from both ends.
    ///
    /// # Errors
    /// [`BasisError::SplineOrder`], [`BasisError::KnotCount`], [`BasisError::Knot`] or [`BasisError::Multiplicity`].
    pub fn new(order: usize, knots: Vec<f64>) -> Result<Self, BasisError> {
        check_order("B-splines", order, 1)?;
        if knots.len() < 2 * order {
            return Err(BasisError::KnotCount { order, knots: knots.len(), min: 2 * order });
        }
        for (index, &value) in knots.iter().enumerate() {
            let least = if index == 0 { f64::NEG_INFINITY } else { knots[index - 1] };
            if !value.is_finite() || value < least {
                return Err(BasisError::Knot { index, value, least });
            }
        }
        let basis = Self { order, knots };
        for (value, multiplicity) in basis.distinct(0..basis.knots.len()) {
            check_multiplicity(value, multiplicity, order)?;
        }
        let (start, end) = basis.interval();
        if start == end {
            let index = basis.len();
            return Err(BasisError::Knot { index, value: end, least: start.next_up() });
        }
        Ok(basis)
    }

    /// `segments` equal pieces on `[0, 1]`, as smooth as the order allows; the knots at the ends have full multiplicity, so that
    /// a spline begins and ends at its first and last coefficient.
    ///
    /// # Errors
    /// [`BasisError::SplineOrder`] or, without a segment, [`BasisError::KnotCount`].
    pub fn clamped_uniform(order: usize, segments: usize) -> Result<Self, BasisError> {
        let breaks: Vec<f64> = (0..=segments).map(|j| j as f64 / segments.max(1) as f64).collect();
        Self::clamped(order, &breaks, &vec![1; segments.saturating_sub(1)])
    }

    /// Pieces between `breaks`, which increase; one multiplicity per inner break, 1 (smoothest) to `order` (a jump). The knots at the ends have full
    /// multiplicity.
    ///
    /// # Errors
    /// As [`Bspline::new`]; [`BasisError::KnotCount`] also where the number of multiplicities does not fit.
    pub fn clamped(order: usize, breaks: &[f64], multiplicities: &[usize]) -> Result<Self, BasisError> {
        check_order("B-splines", order, 1)?;
        let Some(inner) = breaks.len().checked_sub(2) else {
            return Err(BasisError::KnotCount { order, knots: order * breaks.len(), min: 2 * order });
        };
        if multiplicities.len() != inner {
            let (knots, min) = (2 * order + multiplicities.len(), 2 * order + inner);
            return Err(BasisError::KnotCount { order, knots, min });
        }
        let last = inner + 1;
        let mut knots = Vec::new();
        for (j, &value) in breaks.iter().enumerate() {
            let multiplicity = if j == 0 || j == last { order } else { multiplicities[j - 1] };
            check_multiplicity(value, multiplicity, order)?;
            if j > 0 && value <= breaks[j - 1] {
                return Err(BasisError::Knot { index: knots.len(), value, least: breaks[j - 1].next_up() });
            }
            knots.extend(std::iter::repeat_n(value, multiplicity));
        }
        Self::new(order, knots)
    }

    /// Order `k`, the degree plus one.
    pub fn order(&self) -> usize {
        self.order
    }

    /// The knots, not decreasing.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Number of basis functions, which is that of the coefficients.
    #[allow(clippy::len_without_is_empty)] // There is at least one.
    pub fn len(&self) -> usize {
        self.knots.len() - self.order
    }

    /// Ends of the interval on which the functions sum to one.
    pub fn interval(&self) -> (f64, f64) {
        (self.knots[self.order - 1], self.knots[self.len()])
    }

    /// The different knots from start to end of the interval: ends of the polynomial pieces.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots[self.order - 1..=self.len()].to_vec();
        breaks.dedup();
        breaks
    }

    /// Number of knots that are equal to `x`.
    pub fn multiplicity(&self, x: f64) -> usize {
        self.knots.iter().filter(|&&t| t == x).count()
    }

    /// Averages of `order - 1` consecutive knots, one per basis function: where a spline follows its coefficients. Not
    /// decreasing; some are outside the interval unless the ends are clamped.
    ///
    /// # Errors
    /// [`BasisError::SplineOrder`] for order 1, which has none.
    pub fn greville(&self) -> Result<Vec<f64>, BasisError> {
        check_order("Greville abscissae", self.order, 2)?;
        let mean = |j: usize| {
            let knots = &self.knots[j + 1..j + self.order];
            // Relative to the first, so that equal knots have exactly their value.
            let rise: f64 = knots.iter().map(|t| t - knots[0]).sum();
            knots[0] + rise / knots.len() as f64
        };
        Ok((0..self.len()).map(mean).collect())
    }

    /// Index `i` of the piece `[t_i, t_{i+1})` that holds `x`; the last one at the end of the interval, the nearest one outside.
    pub fn span(&self, x: f64) -> usize {
        let (first, last) = (self.order - 1, self.len());
        let above = self.knots[first..=last].partition_point(|t| *t <= x);
        let mut i = first + above.saturating_sub(1);
        if i == last || (above == 0 && self.knots[i] == self.knots[i + 1]) {
            // Beyond an end: the nearest piece of positive length.
            let pieces = first..last;
            let long = |i: &usize| self.knots[*i] < self.knots[i + 1];
            i = if above == 0 { pieces.clone().find(long) } else { pieces.rev().find(long) }.unwrap_or(first);
        }
        i
    }

    /// Values at `x` of the `order` basis functions that are not zero there, into `out`; returns the index of the first.
    pub fn values(&self, x: f64, out: &mut [f64]) -> usize {
        self.derivatives(x, &mut out[..self.order])
    }

    /// Value and derivatives at `x` of the `order` basis functions that are not zero there: row `d` of `out`, row-major rows of
    /// `order` numbers, has derivative `d`, as many as rows fit. From the right at a knot, from the left at the end. Returns the
    /// index of the first function.
    pub fn derivatives(&self, x: f64, out: &mut [f64]) -> usize {
        self.derivatives_in(self.span(x), x, out)
    }

    /// As [`derivatives`](Self::derivatives), of the piece that begins at knot `span` (see [`span`](Self::span)): at a break, the
    /// limit from one side.
    pub fn derivatives_in(&self, span: usize, x: f64, out: &mut [f64]) -> usize {
        let k = self.order;
        let t = &self.knots;
        let rows = out.len() / k;
        out.fill(0.0);
        let mut current: Rows = [0.0; MAX_ORDER];
        current[0] = 1.0;
        for order in 1..=k {
            // `current` holds the functions of this order; what lacks `d` orders becomes derivative `d`.
            let d = k - order;
            if d < rows {
                let row = &mut out[d * k..(d + 1) * k];
                row[..order].copy_from_slice(&current[..order]);
                for m in order..k {
                    differentiate(t, span, m, row);
                }
            }
            if order < k {
                raise(t, span, order, x, &mut current);
            }
        }
        span + 1 - k
    }

    /// Derivative number `derivative` at `x` of the spline with `coefficients`, `len` rows of `out.len()` components; 0 is the value.
    pub fn evaluate(&self, coefficients: &[f64], derivative: usize, x: f64, out: &mut [f64]) {
        self.evaluate_in(self.span(x), coefficients, derivative, x, out);
    }

    /// As [`evaluate`](Self::evaluate), of the piece that begins at knot `span`.
    pub fn evaluate_in(&self, span: usize, coefficients: &[f64], derivative: usize, x: f64, out: &mut [f64]) {
        let k = self.order;
        let dimension = out.len();
        out.fill(0.0);
        if derivative >= k {
            return;
        }
        // De Boor's algorithm on differences of the coefficients (chapter X, eqs. 12 and 16).
        let first = span + 1 - k;
        for (c, o) in out.iter_mut().enumerate() {
            let mut local: Rows = [0.0; MAX_ORDER];
            for (j, v) in local[..k].iter_mut().enumerate() {
                *v = coefficients[(first + j) * dimension + c];
            }
            for d in 1..=derivative {
                for j in (d..k).rev() {
                    let i = first + j;
                    let width = self.knots[i + k - d] - self.knots[i];
                    local[j] = (k - d) as f64 * (local[j] - local[j - 1]) / width;
                }
            }
            *o = self.triangle(span, derivative, &mut local, |_| x);
        }
    }

    /// De Boor's triangle from level `done` on, with the argument of each further level.
    fn triangle(&self, span: usize, done: usize, local: &mut Rows, argument: impl Fn(usize) -> f64) -> f64 {
        let k = self.order;
        let first = span + 1 - k;
        for level in done + 1..k {
            let x = argument(level - 1);
            for j in (level..k).rev() {
                let (low, high) = (self.knots[first + j], self.knots[first + j + k - level]);
                let a = (x - low) / (high - low);
                local[j] = (1.0 - a) * local[j - 1] + a * local[j];
            }
        }
        local[k - 1]
    }

    /// The basis with one knot more at `x`, and the coefficients with which a spline stays the same (Boehm 1980).
    ///
    /// # Errors
    /// [`BasisError::Knot`] outside the interval, [`BasisError::Multiplicity`] where `x` is a knot `order` times already, and
    /// [`BasisError::CoefficientCount`].
    pub fn insert_knot(&self, x: f64, coefficients: &[f64]) -> Result<(Self, Vec<f64>), BasisError> {
        let dimension = self.dimension(coefficients)?;
        let (start, end) = self.interval();
        if !(start <= x && x <= end) {
            return Err(BasisError::Knot { index: self.order, value: x, least: start });
        }
        check_multiplicity(x, self.multiplicity(x) + 1, self.order)?;
        let (k, span) = (self.order, self.span(x));
        let mut knots = self.knots.clone();
        knots.insert(span + 1, x);
        knots.sort_by(f64::total_cmp);
        let mut refined = Vec::with_capacity(coefficients.len() + dimension);
        for j in 0..=self.len() {
            let row = |i: usize| &coefficients[i * dimension..(i + 1) * dimension];
            if j + k <= span + 1 {
                refined.extend_from_slice(row(j));
            } else if j > span {
                refined.extend_from_slice(row(j - 1));
            } else {
                let (low, high) = (self.knots[j], self.knots[j + k - 1]);
                let a = ((x - low) / (high - low)).clamp(0.0, 1.0);
                let blend = |(before, after): (&f64, &f64)| (1.0 - a) * before + a * after;
                refined.extend(row(j - 1).iter().zip(row(j)).map(blend));
            }
        }
        Ok((Self { order: k, knots }, refined))
    }

    /// The basis of the next order with the same continuity at each knot, the ends clamped, and the coefficients with which a
    /// spline stays the same.
    ///
    /// Each coefficient is the mean of the spline's blossom at all but one of its `order` inner knots (Ramshaw 1989).
    ///
    /// # Errors
    /// [`BasisError::SplineOrder`] at [`MAX_ORDER`], and [`BasisError::CoefficientCount`].
    pub fn elevate(&self, coefficients: &[f64]) -> Result<(Self, Vec<f64>), BasisError> {
        let dimension = self.dimension(coefficients)?;
        let k = self.order;
        check_order("B-splines", k + 1, 1)?;
        let (start, end) = self.interval();
        let mut knots = vec![start; k + 1];
        let inside = self.distinct(k..self.len()).filter(|&(x, _)| start < x && x < end);
        for (x, _) in inside {
            knots.extend(std::iter::repeat_n(x, (self.multiplicity(x) + 1).min(k + 1)));
        }
        knots.extend(std::iter::repeat_n(end, k + 1));
        let elevated = Self { order: k + 1, knots };
        let mut raised = Vec::with_capacity(elevated.len() * dimension);
        for j in 0..elevated.len() {
            let support = &elevated.knots[j..=j + k + 1];
            let arguments = &support[1..=k];
            // Any piece within the support serves; the middle one loses least to rounding.
            let middle = (0..=k)
                .filter(|&i| support[i] < support[i + 1])
                .min_by_key(|&i| (2 * i).abs_diff(k))
                .map_or(start, |i| 0.5 * (support[i] + support[i + 1]));
            let span = self.span(middle);
            for c in 0..dimension {
                let mut sum = 0.0;
                for left_out in 0..k {
                    let mut local: Rows = [0.0; MAX_ORDER];
                    for (i, v) in local[..k].iter_mut().enumerate() {
                        *v = coefficients[(span + 1 - k + i) * dimension + c];
                    }
                    let argument = |i: usize| arguments[if i < left_out { i } else { i + 1 }];
                    sum += self.triangle(span, 0, &mut local, argument);
                }
                raised.push(sum / k as f64);
            }
        }
        Ok((elevated, raised))
    }

    /// Components per row of coefficients.
    fn dimension(&self, coefficients: &[f64]) -> Result<usize, BasisError> {
        let (found, rows) = (coefficients.len(), self.len());
        if found == 0 || found % rows != 0 {
            return Err(BasisError::CoefficientCount { found, rows });
        }
        Ok(found / rows)
    }

    /// Different knots of a range of indices, with how often each occurs there.
    fn distinct(&self, range: std::ops::Range<usize>) -> impl Iterator<Item = (f64, usize)> + '_ {
        let range = range.start..range.end.max(range.start);
        self.knots[range].chunk_by(|a, b| a == b).map(|c| (c[0], c.len()))
    }
}

/// Computes the functions of the next order from those of `order`, at `x` in the piece that begins at knot `span`.
fn raise(t: &[f64], span: usize, order: usize, x: f64, current: &mut Rows) {
    let mut carry = 0.0;
    for r in 0..order {
        let (high, low) = (t[span + 1 + r], t[span + 1 + r - order]);
        let share = current[r] / (high - low);
        current[r] = carry + (high - x) * share;
        carry = (x - low) * share;
    }
    current[order] = carry;
}

/// Turns combinations of the functions of `order` into their derivatives in terms of the next order.
fn differentiate(t: &[f64], span: usize, order: usize, row: &mut [f64]) {
    let mut carry = 0.0;
    for r in 0..order {
        let share = order as f64 * row[r] / (t[span + 1 + r] - t[span + 1 + r - order]);
        row[r] = carry - share;
        carry = share;
    }
    row[order] = carry;
}

fn check_order(what: &'static str, order: usize, min: usize) -> Result<(), BasisError> {
    if (min..=MAX_ORDER).contains(&order) {
        Ok(())
    } else {
        Err(BasisError::SplineOrder { what, order, min, max: MAX_ORDER })
    }
}

fn check_multiplicity(value: f64, multiplicity: usize, order: usize) -> Result<(), BasisError> {
    if (1..=order).contains(&multiplicity) {
        Ok(())
    } else {
        Err(BasisError::Multiplicity { value, multiplicity, max: order })
    }
}

#[cfg(test)]
mod tests;
