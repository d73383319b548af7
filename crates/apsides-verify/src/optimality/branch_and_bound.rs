//! The least value of a function over a box, proved by interval branch and bound.
//!
//! A box of controls holds nothing better if a lower bound of the function over it is not below the best value known, less what is
//! allowed, or if a constraint row has no admissible value there; other boxes are halved, the one with the lowest bound first. Lower bounds
//! are the best of the interval extension, the mean value form and Taylor's form of second order,
//!
//! ```text
//! f(v) >= f(c) + sum_j min over d_j of (g_j d_j + m_j d_j^2 / 2),        m: a lower bound of the Hessian by Gershgorin's discs or eigenvalues,
//! ```
//!
//! of the function itself and of its Lagrangian with the multipliers that the trajectory states, which is not above it at
//! admissible controls. Along an axis in which the function is affine and no row occurs, the ends of the box hold its least value. What is
//! affine or quadratic is settled by the first box, infinite ones too; where the rules of
//! [`mod@crate::convexity`] call the function convex, `m` is not negative. R. B. Kearfott, Rigorous Global Search:
//! Continuous Problems, Kluwer 1996; C. S. Adjiman et al., Comput. Chem. Eng. 22 (1998) 1137, doi 10.1016/S0098-1354(98)00027-1 (the bounds
//! of the Hessian).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use apsides_ad::{Derivatives, Expansion};
use nalgebra::DMatrix;

use super::search::Found;
use crate::convexity;

/// All values between two.
pub(super) type Between = [f64; 2];

/// Boxes that are narrower than this part of the whole are not halved.
const NARROWEST: f64 = 1e-12;
/// The way from the control to where an infinite box is divided grows to this many times the range met, at most.
const FARTHEST: f64 = 1e9;

/// Some functions of the controls at one point, with their part in what is minimised.
pub(super) struct Part {
    pub(super) expansion: Expansion,
    /// Weights of the outputs in the function that is minimised.
    pub(super) weights: Vec<f64>,
    /// The outputs that are constraint rows.
    pub(super) rows: Vec<LimitedRow>,
}

/// An output that must be within bounds.
pub(super) struct LimitedRow {
    pub(super) output: usize,
    pub(super) lower: f64,
    pub(super) upper: f64,
    /// Multiplier of the row in the Lagrangian, positive where the upper bound counts.
    pub(super) multiplier: f64,
}

/// From a point with steps of some size, an admissible point near it with a value below a limit.
type Improve<'a> = dyn FnMut(&[f64], &[f64], f64) -> Option<Found> + 'a;

/// A function over a box: its value, gradient and the lower triangle of the Hessian.
type Series = Vec<Between>;

/// The search for the least value over a box.
pub(super) struct Least<'a> {
    parts: Vec<Part>,
    /// Weights of the outputs in the Lagrangian, part by part, and its constant; none where no row has a multiplier.
    lagrangian: Option<(Vec<Vec<f64>>, f64)>,
    /// The function, and the Lagrangian, are convex over the whole.
    is_convex: [bool; 2],
    /// The control of the trajectory.
    own: &'a [f64],
    /// The range met and its surroundings: finite, and the scale of what is infinite.
    met: &'a [Between],
}

/// The outcome of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Outcome {
    /// Nothing in the box is better than what was found by more than is allowed.
    Proved,
    /// The budget ended, or boxes became too narrow, before that was known.
    Open,
    /// The same with what is left of an infinite box.
    OpenFarAway,
}

struct Candidate {
    lower: f64,
    range: Vec<Between>,
    /// An axis in which the function is affine and no row occurs.
    straight: Option<usize>,
    /// Slopes over the box.
    slopes: Vec<f64>,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    /// The lowest bound is the greatest candidate.
    fn cmp(&self, other: &Self) -> Ordering {
        other.lower.total_cmp(&self.lower)
    }
}

impl<'a> Least<'a> {
    pub(super) fn new(parts: Vec<Part>, own: &'a [f64], met: &'a [Between]) -> Self {
        let mut constant = 0.0;
        let mut any = false;
        let mut weights: Vec<Vec<f64>> = Vec::new();
        for part in &parts {
            let mut with_rows = part.weights.clone();
            for row in &part.rows {
                let bound = if row.multiplier > 0.0 { row.upper } else { row.lower };
                if row.multiplier != 0.0 && (row.multiplier * bound).is_finite() {
                    with_rows[row.output] += row.multiplier;
                    constant -= row.multiplier * bound;
                    any = true;
                }
            }
            weights.push(with_rows);
        }
        Self { parts, lagrangian: any.then_some((weights, constant)), is_convex: [false; 2], own, met }
    }

    /// Searches a box; `best` is the best value known, which is allowed to be above the least one by `allowed`. From a point of a box
    /// that may hold better ones, with steps of its size, `improve` gives an admissible point near it, if there is one below a value.
    /// Each box takes one from the budget.
    pub(super) fn search(
        &mut self,
        root: &[Between],
        best: &mut Found,
        allowed: f64,
        budget: &mut usize,
        improve: &mut Improve<'_>,
    ) -> Outcome {
        if !best.0.is_finite() {
            return Outcome::Open;
        }
        let mut heap = BinaryHeap::new();
        heap.extend(self.bounded(root.to_vec(), best.0 - allowed));
        if !heap.is_empty() {
            self.is_convex = [self.sum_is_convex(root, false), self.sum_is_convex(root, true)];
        }
        // Boxes that are not divided any more stay open; those between them may hold better points still.
        let mut outcome = Outcome::Proved;
        while let Some(candidate) = heap.pop() {
            if candidate.lower >= best.0 - allowed {
                return outcome;
            }
            let open = if is_finite(&candidate.range) { Outcome::Open } else { Outcome::OpenFarAway };
            if *budget == 0 {
                let is_far = heap.iter().any(|c| !is_finite(&c.range) && c.lower < best.0 - allowed);
                return if is_far { Outcome::OpenFarAway } else { open.max(outcome) };
            }
            let Some((axis, parts)) = self.division(root, &candidate) else {
                outcome = outcome.max(open);
                continue;
            };
            *budget -= 1;
            let (middle, steps) = self.middle(&candidate.range);
            if let Some(better) = improve(&middle, &steps, best.0) {
                *best = better;
            }
            for part in parts {
                let mut range = candidate.range.clone();
                range[axis] = part;
                heap.extend(self.bounded(range, best.0 - allowed));
            }
        }
        outcome
    }

    fn sum_is_convex(&self, root: &[Between], of_lagrangian: bool) -> bool {
        let lagrangian = self.lagrangian.as_ref().filter(|_| of_lagrangian);
        self.parts.iter().enumerate().all(|(k, part)| {
            let weights = lagrangian.map_or(&part.weights, |(weights, _)| &weights[k]);
            convexity::sum_is_convex(part.expansion.formula(), weights, root)
        })
    }

    /// The axis along which a box is divided, and the parts of its range; none if it is too narrow or too far away.
    fn division(&self, root: &[Between], candidate: &Candidate) -> Option<(usize, [Between; 2])> {
        if let Some(axis) = candidate.straight {
            return Some((axis, candidate.range[axis].map(|end| [end, end])));
        }
        let halves = |at: f64, [a, b]: Between| [[a, at], [at, b]];
        // Of several infinite axes the one along which the box is nearest.
        let far = |(j, &[a, b]): (usize, &Between)| {
            if a.is_finite() && b.is_finite() {
                return None;
            }
            let [lower, upper] = self.met[j];
            let width = (upper - lower).max(f64::MIN_POSITIVE);
            let at = if a < upper && b > upper {
                upper
            } else if a < lower && b > lower {
                lower
            } else if b.is_infinite() {
                a + (a - self.own[j]).abs().max(width)
            } else {
                b - (b - self.own[j]).abs().max(width)
            };
            Some((j, at, (at - self.own[j]).abs() / width))
        };
        let nearest = candidate.range.iter().enumerate().filter_map(far).min_by(|a, b| a.2.total_cmp(&b.2));
        if let Some((j, at, distance)) = nearest {
            return (distance <= FARTHEST).then(|| (j, halves(at, candidate.range[j])));
        }
        let share = |j: usize| {
            let [a, b] = candidate.range[j];
            let whole = root[j][1] - root[j][0];
            (b - a) / if whole.is_finite() { whole } else { self.met[j][1] - self.met[j][0] }
        };
        let wide = (0..candidate.range.len()).filter(|j| {
            let [a, b] = candidate.range[*j];
            share(*j) > NARROWEST && a < 0.5 * (a + b) && 0.5 * (a + b) < b
        });
        let smear = |j: usize| candidate.slopes[j] * (candidate.range[j][1] - candidate.range[j][0]);
        let is_known = candidate.slopes.iter().all(|s| s.is_finite());
        let rank = |j: &usize| if is_known { smear(*j) } else { share(*j) };
        let axis = wide.max_by(|i, j| rank(i).total_cmp(&rank(j)).then(share(*i).total_cmp(&share(*j))))?;
        let [a, b] = candidate.range[axis];
        Some((axis, halves(0.5 * (a + b), [a, b])))
    }

    /// An axis of some width in which the function, by its derivatives over a box, is affine and no row occurs.
    fn straight(&self, range: &[Between], over: &[Between]) -> Option<usize> {
        let n = range.len();
        let is_affine = |j: usize| over[1 + n + j * (j + 3) / 2] == [0.0; 2];
        let is_wide = |[a, b]: Between| a < b && (b - a).is_finite();
        (0..n).find(|&j| is_wide(range[j]) && is_affine(j) && !self.is_in_rows(j))
    }

    /// The middle of a box and half its widths; of an infinite one a point near what was met.
    fn middle(&self, range: &[Between]) -> (Vec<f64>, Vec<f64>) {
        let one = |(j, &[a, b]): (usize, &Between)| {
            if a.is_finite() && b.is_finite() {
                (0.5 * (a + b), 0.5 * (b - a))
            } else {
                let [lower, upper] = self.met[j];
                (self.own[j].max(a).min(b), 0.5 * (upper - lower))
            }
        };
        range.iter().enumerate().map(one).unzip()
    }

    /// The box with a lower bound, unless that is at least a limit or no point of it is admissible.
    fn bounded(&mut self, range: Vec<Between>, limit: f64) -> Option<Candidate> {
        let n = range.len();
        for part in &mut self.parts {
            part.expansion.set_to(Derivatives::Values, &range);
            let is_outside = |row: &LimitedRow| {
                let [least, largest] = part.expansion.value(row.output);
                least > row.upper || largest < row.lower
            };
            if part.rows.iter().any(is_outside) {
                return None;
            }
        }
        if self.value(false)[0] >= limit || (self.lagrangian.is_some() && self.value(true)[0] >= limit) {
            return None;
        }
        self.parts.iter_mut().for_each(|part| part.expansion.set(&range));
        let own = self.series(n, false);
        if let Some(faces) = self.faces(&range, &own[1..=n]) {
            return self.bounded(faces, limit);
        }
        let lagrangian = self.lagrangian.is_some().then(|| self.series(n, true));
        let mut lower = own[0][0];
        if lower < limit {
            lower = lower.max(self.taylor(&range, &own, false, limit));
        }
        if let Some(series) = lagrangian.filter(|_| lower < limit) {
            lower = lower.max(series[0][0]);
            lower = lower.max(self.taylor(&range, &series, true, limit));
        }
        if lower >= limit {
            return None;
        }
        let slopes = own[1..=n].iter().map(|g| g[0].abs().max(g[1].abs())).collect();
        let straight = self.straight(&range, &own);
        Some(Candidate { lower, range, straight, slopes })
    }

    /// The box with its axes along which the function grows or falls all along, and no row occurs, at the ends where it is least; none where
    /// there are no such axes.
    fn faces(&self, range: &[Between], slopes: &[Between]) -> Option<Vec<Between>> {
        let mut faces = range.to_vec();
        for (j, ([a, b], slope)) in range.iter().copied().zip(slopes).enumerate() {
            let end = match *slope {
                [least, _] if least >= 0.0 && a.is_finite() => a,
                [_, largest] if largest <= 0.0 && b.is_finite() => b,
                _ => continue,
            };
            if a < b && !self.is_in_rows(j) {
                faces[j] = [end, end];
            }
        }
        (faces != range).then_some(faces)
    }

    /// Says whether a control occurs in a row.
    fn is_in_rows(&self, j: usize) -> bool {
        self.parts.iter().any(|p| p.rows.iter().any(|r| p.expansion.inputs_of(r.output).contains(&j)))
    }

    /// The values of the function, or of the Lagrangian, over the box to which the parts went.
    fn value(&self, of_lagrangian: bool) -> Between {
        let mut sum = [[0.0; 2]];
        self.add_parts(of_lagrangian, &mut sum);
        sum[0]
    }

    /// The function, or the Lagrangian, with its derivatives over the box to which the parts went.
    fn series(&self, n: usize, of_lagrangian: bool) -> Series {
        let mut sum = vec![[0.0; 2]; 1 + n + n * (n + 1) / 2];
        self.add_parts(of_lagrangian, &mut sum);
        sum
    }

    /// Adds the parts to a sum of zeros: the value, and as many derivatives as there is room for.
    fn add_parts(&self, of_lagrangian: bool, sum: &mut [Between]) {
        let lagrangian = self.lagrangian.as_ref().filter(|_| of_lagrangian);
        for (k, part) in self.parts.iter().enumerate() {
            let weights = lagrangian.map_or(&part.weights, |(weights, _)| &weights[k]);
            part.expansion.add_weighted(weights, sum);
        }
        let constant = lagrangian.map_or(0.0, |(_, constant)| *constant);
        sum[0] = [sum[0][0] + constant, sum[0][1] + constant];
    }

    /// The best lower bound from values and derivatives at one point and those over the box.
    fn taylor(&mut self, range: &[Between], over: &[Between], of_lagrangian: bool, limit: f64) -> f64 {
        let n = range.len();
        let slopes = &over[1..=n];
        // Where the function grows all along an axis, the least is at the end of the axis.
        let centre = |j: usize| {
            let [a, b] = range[j];
            let inner = if (a..=b).contains(&self.own[j]) || !a.is_finite() || !b.is_finite() {
                self.own[j].max(a).min(b)
            } else {
                0.5 * (a + b)
            };
            match slopes[j] {
                [least, _] if least >= 0.0 && a.is_finite() => a,
                [_, largest] if largest <= 0.0 && b.is_finite() => b,
                _ => inner,
            }
        };
        let centre: Vec<f64> = (0..n).map(centre).collect();
        let point: Vec<Between> = centre.iter().map(|c| [*c, *c]).collect();
        self.parts.iter_mut().for_each(|part| part.expansion.set_to(Derivatives::Slopes, &point));
        let mut at = vec![[0.0; 2]; 1 + n];
        self.add_parts(of_lagrangian, &mut at);
        let ways: Vec<Between> = range.iter().zip(&centre).map(|([a, b], c)| [a - c, b - c]).collect();
        let mean: f64 = slopes.iter().zip(&ways).map(|(g, d)| least_product(*g, *d)).sum();
        let quadratic = |curvatures: &[f64]| -> f64 {
            let terms = at[1..].iter().zip(&ways).zip(curvatures);
            terms.map(|((g, d), m)| least_quadratic(*g, *m, *d)).sum()
        };
        let scales: Vec<f64> = (0..n).map(|j| self.scale(range[j], j)).collect();
        let hessian = &over[1 + n..];
        let bound = |least: f64| {
            let bound = at[0][0] + least;
            if bound.is_nan() { f64::NEG_INFINITY } else { bound }
        };
        let mut curvatures = discs(hessian, &scales);
        if self.is_convex[usize::from(of_lagrangian)] {
            curvatures.iter_mut().for_each(|m| *m = m.max(0.0));
        }
        let mut lower = bound(mean).max(bound(quadratic(&curvatures)));
        if n > 1
            && lower < limit
            && let Some(curvatures) = eigenvalue(hessian, &scales)
        {
            lower = lower.max(bound(quadratic(&curvatures)));
        }
        lower
    }

    /// A finite width of a box along an axis.
    fn scale(&self, [a, b]: Between, j: usize) -> f64 {
        let width = if (b - a).is_finite() { b - a } else { self.met[j][1] - self.met[j][0] };
        width.max(f64::MIN_POSITIVE.sqrt())
    }
}

fn is_finite(range: &[Between]) -> bool {
    range.iter().flatten().all(|v| v.is_finite())
}

/// The least product of numbers of two intervals; nothing times anything is nothing.
fn least_product(x: Between, y: Between) -> f64 {
    let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
    let corners = [times(x[0], y[0]), times(x[0], y[1]), times(x[1], y[0]), times(x[1], y[1])];
    corners
        .into_iter()
        .fold(f64::INFINITY, |least, v| if v.is_nan() { f64::NEG_INFINITY } else { least.min(v) })
}

/// The least `g d + m d^2 / 2` for slopes and ways of two intervals.
fn least_quadratic(slopes: Between, m: f64, way: Between) -> f64 {
    if m.is_nan() || m == f64::NEG_INFINITY || (m < 0.0 && !is_finite(&[way])) {
        return if way == [0.0; 2] { 0.0 } else { f64::NEG_INFINITY };
    }
    if m == 0.0 {
        return least_product(slopes, way);
    }
    if m < 0.0 {
        let ends = way.map(|d| least_product(slopes, [d, d]) + 0.5 * m * d * d);
        return ends[0].min(ends[1]);
    }
    let least = |g: f64| {
        let d = (-g / m).max(way[0]).min(way[1]);
        if d.is_finite() { g * d + 0.5 * m * d * d } else { f64::NEG_INFINITY }
    };
    least(slopes[0]).min(least(slopes[1]))
}

/// Lower bounds of the Hessian along the axes, by the discs of Gershgorin in scaled controls.
fn discs(hessian: &[Between], scales: &[f64]) -> Vec<f64> {
    let n = scales.len();
    let entry = |i: usize, j: usize| hessian[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
    let curvature = |j: usize| {
        let others = (0..n).filter(|i| *i != j).map(|i| {
            let [a, b] = entry(i, j);
            let size = a.abs().max(b.abs());
            if size == 0.0 { 0.0 } else { size * scales[i] / scales[j] }
        });
        entry(j, j)[0] - others.sum::<f64>()
    };
    (0..n).map(curvature).collect()
}

/// The same by the least eigenvalue of the middle of the Hessian less its radius (J. Rohn, SIAM J. Matrix Anal. Appl. 15 (1994) 175, doi
/// 10.1137/S0895479891219216); none if an entry is infinite.
fn eigenvalue(hessian: &[Between], scales: &[f64]) -> Option<Vec<f64>> {
    let n = scales.len();
    if !is_finite(hessian) {
        return None;
    }
    let entry = |i: usize, j: usize| {
        let [a, b] = hessian[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
        let scale = scales[i] * scales[j];
        (0.5 * (a + b) * scale, 0.5 * (b - a) * scale)
    };
    let middle = DMatrix::from_fn(n, n, |i, j| entry(i, j).0);
    let radius = (0..n).map(|i| (0..n).map(|j| entry(i, j).1).sum::<f64>()).fold(0.0, f64::max);
    if !middle.iter().all(|v| v.is_finite()) {
        return None;
    }
    let least = middle.symmetric_eigenvalues().min() - radius;
    Some(scales.iter().map(|s| least / (s * s)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use apsides_ad::{FormulaBuilder, Value};

    const ALL: Between = [f64::NEG_INFINITY, f64::INFINITY];
    /// The best value known may be above the least by this much.
    const ALLOWED: f64 = 1e-6;
    /// The least value of a well beside a slope, beside that at its place.
    const BESIDE: f64 = 1e-2;

    /// Outcome, best value and boxes for a function of some controls from the origin.
    fn least(
        controls: usize,
        build: impl Fn(&mut FormulaBuilder) -> Value,
        root: Between,
        rows: Vec<LimitedRow>,
    ) -> (Outcome, Found, usize) {
        let mut builder = FormulaBuilder::new(controls);
        let value = build(&mut builder);
        let first = builder.input(0);
        let formula = builder.formula(&[value, first]).expect("well formed");
        let own = vec![0.0; controls];
        let mut best = (formula.evaluate(&own)[0], own.clone());
        let admits = |u: &[f64]| rows.iter().all(|r| u[0] >= r.lower && u[0] <= r.upper);
        let limits: Vec<(f64, f64)> = rows.iter().map(|r| (r.lower, r.upper)).collect();
        let mut improve = |u: &[f64], _: &[f64], than: f64| {
            let is_inside = limits.iter().all(|(a, b)| (*a..=*b).contains(&u[0]));
            let h = formula.evaluate(u)[0];
            (is_inside && h < than).then(|| (h, u.to_vec()))
        };
        assert!(admits(&own));
        let part = Part { expansion: Expansion::new(formula.clone()), weights: vec![1.0, 0.0], rows };
        let met = vec![[-1.0, 1.0]; controls];
        let mut budget = 1000;
        let mut search = Least::new(vec![part], &own, &met);
        let outcome = search.search(&vec![root; controls], &mut best, ALLOWED, &mut budget, &mut improve);
        (outcome, best, 1000 - budget)
    }

    #[test]
    fn a_quadratic_is_settled_by_one_box() {
        // a^2 + a b + b^2 over the whole plane.
        let form = |f: &mut FormulaBuilder| {
            let (a, b) = (f.input(0), f.input(1));
            let (first, mixed, last) = (f.square(a), f.mul(a, b), f.square(b));
            let sum = f.add(first, mixed);
            f.add(sum, last)
        };
        assert_eq!(least(2, form, ALL, vec![]), (Outcome::Proved, (0.0, vec![0.0; 2]), 0));
    }

    #[test]
    fn a_direction_is_settled_by_few_boxes() {
        let cosine = |f: &mut FormulaBuilder| {
            let a = f.input(0);
            let cosine = f.cos(a);
            f.neg(cosine)
        };
        let (outcome, best, boxes) = least(1, cosine, [-3.0, 3.0], vec![]);
        assert_eq!((outcome, best.0), (Outcome::Proved, -1.0));
        assert!(boxes <= 8, "{boxes}");
        // Over all numbers the sine has the same values, which the interval extension sees.
        assert_eq!(least(1, cosine, ALL, vec![]).0, Outcome::Proved);
    }

    #[test]
    fn along_an_axis_in_which_it_is_affine_the_ends_are_enough() {
        // -T cos(a) for T of -3 to 3: the ends of T, and few boxes of the angle for each.
        let thrust = |f: &mut FormulaBuilder| {
            let (thrust, angle) = (f.input(0), f.input(1));
            let cosine = f.cos(angle);
            let along = f.mul(thrust, cosine);
            f.neg(along)
        };
        let (outcome, best, boxes) = least(2, thrust, [-3.0, 3.0], vec![]);
        assert_eq!((outcome, best.0), (Outcome::Proved, -3.0));
        assert!(boxes <= 20, "{boxes}");
        // A row that keeps T within 1 has its least value inside.
        let row = LimitedRow { output: 1, lower: -1.0, upper: 1.0, multiplier: 0.0 };
        let (outcome, best, _) = least(2, thrust, [-3.0, 3.0], vec![row]);
        assert_eq!(outcome, Outcome::Proved);
        assert!((best.0 + 1.0).abs() <= ALLOWED, "{best:?}");
    }

    #[test]
    fn what_the_rules_call_convex_is_settled_far_away() {
        // sqrt(1 + a^2) + 1e-9 a grows like |a|: the least is at -1e-9.
        let length = |f: &mut FormulaBuilder| {
            let (a, one, tilt) = (f.input(0), f.constant(1.0), f.constant(1e-9));
            let square = f.square(a);
            let sum = f.add(one, square);
            let (root, product) = (f.sqrt(sum), f.mul(tilt, a));
            f.add(root, product)
        };
        let (outcome, best, boxes) = least(1, length, ALL, vec![]);
        assert_eq!((outcome, best.0), (Outcome::Proved, 1.0));
        assert!(boxes <= 4, "{boxes}");
    }

    #[test]
    fn a_narrow_well_between_two_axes_without_bounds_is_found() {
        // a^2 + b^2 - 1000/(1 + (100 (b - 20))^2): 400 - 1000 beside the bottom of the well.
        let well = |f: &mut FormulaBuilder| {
            let (a, b) = (f.input(0), f.input(1));
            let (place, steep, one, depth) =
                (f.constant(20.0), f.constant(100.0), f.constant(1.0), f.constant(1000.0));
            let apart = f.sub(b, place);
            let scaled = f.mul(apart, steep);
            let square = f.square(scaled);
            let under = f.add(one, square);
            let line = f.div(depth, under);
            let (first, second) = (f.square(a), f.square(b));
            let sum = f.add(first, second);
            f.sub(sum, line)
        };
        let (outcome, best, boxes) = least(2, well, ALL, vec![]);
        assert_eq!(outcome, Outcome::Proved);
        // The bottom is beside 20 by what the square of b gains.
        assert!((best.0 + 600.0).abs() <= BESIDE, "{best:?}");
        assert!(boxes <= 500, "{boxes}");
    }

    #[test]
    fn a_multiplier_settles_what_a_row_holds() {
        // -a, of which a row allows no more than 0: with the multiplier 1 the Lagrangian is constant.
        let falling = |f: &mut FormulaBuilder| {
            let a = f.input(0);
            f.neg(a)
        };
        let row = |multiplier| LimitedRow { output: 1, lower: f64::NEG_INFINITY, upper: 0.0, multiplier };
        assert_eq!(least(1, falling, [-5.0, 5.0], vec![row(1.0)]), (Outcome::Proved, (0.0, vec![0.0]), 0));
        let (outcome, best, boxes) = least(1, falling, [-5.0, 5.0], vec![row(0.0)]);
        assert_eq!((outcome, best.0), (Outcome::Proved, 0.0));
        assert!(boxes > 0 && boxes < 50, "{boxes}");
    }

    #[test]
    fn what_falls_for_ever_is_left_open() {
        let cube = |f: &mut FormulaBuilder| {
            let a = f.input(0);
            f.powi(a, 3)
        };
        let (outcome, best, _) = least(1, cube, ALL, vec![]);
        assert_eq!(outcome, Outcome::OpenFarAway);
        assert!(best.0 < -1e6, "{best:?}");
    }

    #[test]
    fn least_quadratics_by_case() {
        let cases = [
            ([0.0, 0.0], 2.0, ALL, 0.0),
            ([2.0, 2.0], 2.0, ALL, -1.0),
            ([2.0, 2.0], 2.0, [-0.5, 1.0], -0.75),
            ([-1.0, 2.0], 2.0, [-3.0, 3.0], -1.0),
            ([1.0, 1.0], 0.0, [0.0, f64::INFINITY], 0.0),
            ([1.0, 1.0], 0.0, ALL, f64::NEG_INFINITY),
            ([1.0, 1.0], -2.0, [-1.0, 1.0], -2.0),
            ([1.0, 1.0], -2.0, ALL, f64::NEG_INFINITY),
        ];
        for (slopes, m, way, expected) in cases {
            assert_eq!(least_quadratic(slopes, m, way), expected, "{slopes:?} {m} {way:?}");
        }
    }
}
