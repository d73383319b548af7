//! The function `L_eps` of the constraint transcription, and its integrands.
//!
//! With `v` what a constraint is violated by, `v <= 0` being feasible,
//!
//! ```text
//! L_eps(v) = 0                      v <= -eps
//!            (v + eps)^2 / (4 eps)  -eps < v < eps
//!            v                      v >= eps
//! ```
//!
//! goes to `max(v, 0)` with `eps`, is continuous with its slope, and is not negative, so that
//!
//! ```text
//! int L_eps(v(t)) dt <= tau
//! ```
//!
//! holds the constraint along the whole phase with one number. At the ends of the middle piece it is 0 and `eps`, those of its
//! neighbours. With `(v - eps)^2 / (4 eps)` there, as it is printed in places, it would be `eps` and 0: a jump by `eps` at both ends.
//! For a constraint written as `h >= 0` the same function is `(h - eps)^2 / (4 eps)` with `h = -v`; sign of the constraint and sign in
//! the square go together.

use std::sync::{Arc, Mutex, PoisonError};

use apsides_ad::{Formula, trace::OpaqueFunction};
use apsides_ad::{NodeFunction, NodePattern};
use apsides_ocp::Bounds;

/// `L_eps`, its slope and its second derivative at a violation.
///
/// ```
/// use apsides_piecewise::smoothing::smoothed;
///
/// assert_eq!(smoothed(-0.25, 0.25)[0], 0.0);
/// assert_eq!(smoothed(0.0, 0.25)[0], 0.0625);
/// assert_eq!(smoothed(0.25, 0.25)[0], 0.25);
/// ```
#[must_use]
pub fn smoothed(violation: f64, epsilon: f64) -> [f64; 3] {
    if violation <= -epsilon {
        [0.0; 3]
    } else if violation < epsilon {
        let above = violation + epsilon;
        [above * above / (4.0 * epsilon), above / (2.0 * epsilon), 0.5 / epsilon]
    } else {
        // What is not a number stays none.
        [violation, 1.0, 0.0]
    }
}

/// The quantity that a constraint bounds.
#[derive(Clone)]
pub(crate) enum Subject {
    /// A state, of a phase with so many states and controls together.
    State { index: usize, base: usize },
    /// An output of a path function.
    Row { function: Arc<dyn NodeFunction>, output: usize },
}

impl Subject {
    pub(crate) fn value(&self, z: &[f64], values: &mut [f64]) -> f64 {
        match self {
            Self::State { index, .. } => z[*index],
            Self::Row { function, output } => {
                function.value(z, values);
                values[*output]
            }
        }
    }

    /// Columns of its derivatives.
    fn columns(&self) -> Vec<usize> {
        match self {
            Self::State { index, .. } => vec![*index],
            Self::Row { function, output } => {
                let pattern = function.pattern();
                pattern.columns[pattern.row_offsets[*output]..pattern.row_offsets[output + 1]].to_vec()
            }
        }
    }
}

/// `L_eps` of the violations of both bounds on a subject, in units of its scale, as an integrand.
pub(crate) struct SmoothedRow {
    subject: Subject,
    bounds: Bounds,
    scale: f64,
    epsilon: f64,
    pattern: NodePattern,
    /// Entry of the Hessian for each entry of that of the subject, then for each pair of columns.
    places: Vec<usize>,
    scratch: Mutex<Scratch>,
}

#[derive(Default)]
struct Scratch {
    values: Vec<f64>,
    weights: Vec<f64>,
    entries: Vec<f64>,
    hessian: Vec<f64>,
}

impl SmoothedRow {
    pub(crate) fn new(subject: Subject, bounds: Bounds, scale: f64, epsilon: f64) -> Self {
        let columns = subject.columns();
        let (own, scratch) = match &subject {
            Subject::State { .. } => (Vec::new(), Scratch::default()),
            Subject::Row { function, output } => {
                let mut weights = vec![0.0; function.outputs()];
                weights[*output] = 1.0;
                let scratch = Scratch {
                    values: vec![0.0; function.outputs()],
                    weights,
                    entries: vec![0.0; function.pattern().jacobian_len()],
                    hessian: vec![0.0; function.pattern().hessian_len()],
                };
                (function.pattern().hessian.clone(), scratch)
            }
        };
        let pairs = columns.iter().enumerate().flat_map(|(a, &i)| columns[..=a].iter().map(move |&j| (i, j)));
        let all: Vec<(usize, usize)> = own.iter().copied().chain(pairs).collect();
        let mut hessian = all.clone();
        hessian.sort_unstable();
        hessian.dedup();
        let places = all.iter().map(|pair| hessian.partition_point(|p| p < pair)).collect();
        let pattern = NodePattern { row_offsets: vec![0, columns.len()], columns, hessian };
        Self { subject, bounds, scale, epsilon, pattern, places, scratch: Mutex::new(scratch) }
    }

    /// `L_eps` and its derivatives by the subject.
    fn of(&self, value: f64) -> [f64; 3] {
        let [below, above] = [self.bounds.lower - value, value - self.bounds.upper]
            .map(|excess| smoothed(excess / self.scale, self.epsilon));
        let slope = (above[1] - below[1]) / self.scale;
        [below[0] + above[0], slope, (below[2] + above[2]) / (self.scale * self.scale)]
    }

    fn scratch(&self) -> std::sync::MutexGuard<'_, Scratch> {
        // It is overwritten before each use.
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Value and derivatives by the subject, with the subject's own derivatives left in `entries`.
    fn slope(&self, z: &[f64], scratch: &mut Scratch) -> [f64; 3] {
        match &self.subject {
            Subject::State { index, .. } => self.of(z[*index]),
            Subject::Row { function, output } => {
                function.jacobian(z, &mut scratch.values, &mut scratch.entries);
                self.of(scratch.values[*output])
            }
        }
    }

    /// Derivatives of the subject by its columns.
    fn gradient<'a>(&self, entries: &'a [f64]) -> &'a [f64] {
        match &self.subject {
            Subject::State { .. } => &[1.0],
            Subject::Row { function, output } => {
                let offsets = &function.pattern().row_offsets;
                &entries[offsets[*output]..offsets[output + 1]]
            }
        }
    }
}

impl NodeFunction for SmoothedRow {
    fn inputs(&self) -> usize {
        match &self.subject {
            Subject::State { base, .. } => base + 1,
            Subject::Row { function, .. } => function.inputs(),
        }
    }

    fn outputs(&self) -> usize {
        1
    }

    fn pattern(&self) -> &NodePattern {
        &self.pattern
    }

    fn value(&self, z: &[f64], out: &mut [f64]) {
        let value = self.subject.value(z, &mut self.scratch().values);
        out[0] = self.of(value)[0];
    }

    fn jacobian(&self, z: &[f64], out: &mut [f64], entries: &mut [f64]) {
        let mut scratch = self.scratch();
        let [value, slope, _] = self.slope(z, &mut scratch);
        out[0] = value;
        for (entry, g) in entries.iter_mut().zip(self.gradient(&scratch.entries)) {
            *entry = slope * g;
        }
    }

    fn hessian(&self, z: &[f64], weights: &[f64], entries: &mut [f64]) {
        let mut scratch = self.scratch();
        let [_, slope, bend] = self.slope(z, &mut scratch);
        entries.fill(0.0);
        let Scratch { entries: own, hessian, weights: of_row, .. } = &mut *scratch;
        if let Subject::Row { function, .. } = &self.subject {
            function.hessian(z, of_row, hessian);
        }
        let mut places = self.places.iter();
        for (h, place) in hessian.iter().zip(&mut places) {
            entries[*place] += weights[0] * slope * h;
        }
        let gradient = self.gradient(own);
        let pairs = gradient.iter().enumerate().flat_map(|(a, i)| gradient[..=a].iter().map(move |j| i * j));
        for (product, place) in pairs.zip(places) {
            entries[*place] += weights[0] * bend * product;
        }
    }

    fn formula(&self) -> Result<Formula, OpaqueFunction> {
        Err(OpaqueFunction { name: "the smoothed violation of a constraint".into() })
    }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{PathFunction, Scalar, path_node};

    use super::*;

    /// Discretisation: difference quotients, by their steps.
    const DIFFERENCES: f64 = 1e-9;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-11;

    struct Curve;

    impl PathFunction<2, 1, 2> for Curve {
        fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
            [x[0] + u[0], x[0].sin() * x[1] + u[0].square() * t]
        }
    }

    /// The pieces meet with their slopes; the formula with the other sign in the square does not.
    #[test]
    fn the_pieces_meet() {
        let epsilon = 0.3;
        for end in [-epsilon, epsilon] {
            let (before, after) = (smoothed(end - 1e-12, epsilon), smoothed(end + 1e-12, epsilon));
            assert!((before[0] - after[0]).abs() < ROUNDING, "{before:?} {after:?}");
            assert!((before[1] - after[1]).abs() < ROUNDING, "{before:?} {after:?}");
            let other = (end - epsilon).powi(2) / (4.0 * epsilon);
            assert!(((other - smoothed(end, epsilon)[0]).abs() - epsilon).abs() < 1e-3 * ROUNDING);
        }
        assert!(smoothed(f64::NAN, epsilon)[0].is_nan());
        assert!((smoothed(1e-3, 1e-9)[0] - 1e-3).abs() < 1e-4 * ROUNDING);
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let function = path_node::<_, 2, 1, 2, 0>(Curve);
        let row = Subject::Row { function, output: 1 };
        let state = Subject::State { index: 1, base: 3 };
        for (subject, bounds) in [(row, Bounds::new(0.2, 0.9)), (state, Bounds::new(-0.5, 0.6))] {
            let smooth = SmoothedRow::new(subject, bounds, 0.7, 0.4);
            for z in [[0.8, 0.5, 0.3, 0.7], [1.9, 0.9, 0.7, 0.2], [0.1, -0.9, -0.2, 0.6]] {
                let entries = |z: &[f64]| {
                    let (mut value, mut entries) = ([0.0], vec![0.0; smooth.pattern().jacobian_len()]);
                    smooth.jacobian(z, &mut value, &mut entries);
                    let mut plain = [0.0];
                    smooth.value(z, &mut plain);
                    assert_eq!(plain, value);
                    (value[0], entries)
                };
                let (_, exact) = entries(&z);
                let mut hessian = vec![0.0; smooth.pattern().hessian_len()];
                smooth.hessian(&z, &[2.0], &mut hessian);
                let step = 1e-5;
                for column in 0..4 {
                    let [plus, minus] = [step, -step].map(|s| {
                        let mut moved = z;
                        moved[column] += s;
                        entries(&moved)
                    });
                    let slope = (plus.0 - minus.0) / (2.0 * step);
                    let known = smooth.pattern().columns.iter().position(|c| *c == column);
                    let expected = known.map_or(0.0, |k| exact[k]);
                    assert!((slope - expected).abs() < DIFFERENCES, "{z:?} {column}: {slope} {expected}");
                    for (k, &i) in smooth.pattern().columns.iter().enumerate() {
                        let bend = (plus.1[k] - minus.1[k]) / step;
                        let pair = (i.max(column), i.min(column));
                        let known = smooth.pattern().hessian.iter().position(|p| *p == pair);
                        let expected = known.map_or(0.0, |k| hessian[k]);
                        assert!(
                            (bend - expected).abs() < 10.0 * DIFFERENCES,
                            "{z:?} {pair:?}: {bend} {expected}"
                        );
                    }
                }
            }
        }
    }
}
