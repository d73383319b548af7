//! Vector-valued piecewise polynomials of time: the common form of states, controls and costates of every method.

use std::sync::Arc;

use apsides_basis::Barycentric;

use crate::OcpError;

/// Distance from an end of a piece at which what may jump there is looked at, relative to the largest time: some roundings.
const CLEAR: f64 = 128.0 * f64::EPSILON;

/// One polynomial piece, by its values at the nodes of a basis on [-1, 1].
#[derive(Clone, Debug)]
pub struct Segment {
    /// Nodes on [-1, 1], which is mapped onto the segment's times.
    pub basis: Arc<Barycentric>,
    /// Values at the nodes, row-major `nodes x dimension`.
    pub values: Vec<f64>,
}

/// A piecewise polynomial of time; it may jump at its breaks.
#[derive(Clone, Debug)]
pub struct PiecewisePolynomial {
    dimension: usize,
    breaks: Vec<f64>,
    segments: Vec<Segment>,
}

impl PiecewisePolynomial {
    /// Pieces between consecutive `breaks`.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when the breaks are not finite and increasing, or a count does not fit.
    pub fn new(dimension: usize, breaks: Vec<f64>, segments: Vec<Segment>) -> Result<Self, OcpError> {
        let fail = |reason: String| Err(OcpError::Mesh { place: "piecewise polynomial".into(), reason });
        if segments.is_empty() || breaks.len() != segments.len() + 1 {
            return fail(format!("{} segments need one break more, got {}", segments.len(), breaks.len()));
        }
        if !breaks.iter().all(|b| b.is_finite()) || breaks.windows(2).any(|w| w[0] >= w[1]) {
            return fail("the breaks must be finite and increasing".into());
        }
        for (k, s) in segments.iter().enumerate() {
            let expected = s.basis.nodes().len() * dimension;
            if s.values.len() != expected {
                return fail(format!("segment {k} has {} values, expected {expected}", s.values.len()));
            }
        }
        Ok(Self { dimension, breaks, segments })
    }

    /// The same polynomials by their values at the nodes of other bases, one for each piece; exact where a basis has at least as many
    /// nodes as the piece.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when there is not one basis for each piece.
    pub fn on(&self, bases: Vec<Arc<Barycentric>>) -> Result<Self, OcpError> {
        let pieces = bases.into_iter().zip(&self.segments).map(|(basis, piece)| {
            let mut values = vec![0.0; basis.nodes().len() * self.dimension];
            for (x, out) in basis.nodes().iter().zip(values.chunks_exact_mut(self.dimension.max(1))) {
                piece.basis.evaluate_all(&piece.values, *x, out);
            }
            Segment { basis, values }
        });
        Self::new(self.dimension, self.breaks.clone(), pieces.collect())
    }

    /// The same polynomials with an end of a piece at each of these times, which increase; those at ends of pieces and outside count for
    /// nothing.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when the times are not finite and increasing.
    pub fn divided_at(&self, times: &[f64]) -> Result<Self, OcpError> {
        let (mut breaks, mut segments) = (vec![self.breaks[0]], Vec::new());
        for (k, piece) in self.segments.iter().enumerate() {
            let [start, end] = [self.breaks[k], self.breaks[k + 1]];
            let inner = times.iter().copied().filter(|t| *t > start && *t < end);
            let mut from = start;
            for to in inner.chain([end]) {
                breaks.push(to);
                let mut part = piece.clone();
                if [from, to] != [start, end] {
                    let nodes = piece.basis.nodes().iter();
                    for (x, out) in nodes.zip(part.values.chunks_exact_mut(self.dimension.max(1))) {
                        self.evaluate_in(k, from + 0.5 * (to - from) * (x + 1.0), out);
                    }
                }
                segments.push(part);
                from = to;
            }
        }
        Self::new(self.dimension, breaks, segments)
    }

    /// Polynomials with other values at the same nodes: `f` gets the values at a node, one node after the other, and fills the
    /// `dimension` values in their place.
    #[must_use]
    pub fn map_nodes(&self, dimension: usize, mut f: impl FnMut(&[f64], &mut [f64])) -> Self {
        let segments = self.segments.iter().map(|s| {
            let nodes = s.basis.nodes().len();
            let mut values = vec![0.0; nodes * dimension];
            for node in 0..nodes {
                let [from, to] = [self.dimension, dimension].map(|d| node * d..(node + 1) * d);
                f(&s.values[from], &mut values[to]);
            }
            Segment { basis: Arc::clone(&s.basis), values }
        });
        Self { dimension, breaks: self.breaks.clone(), segments: segments.collect() }
    }

    /// Number of components.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Times between which the pieces live, `segments + 1` of them.
    #[must_use]
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// The pieces.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Index of the piece that holds `t`; the later one at a break, the nearest one outside.
    #[must_use]
    pub fn segment_at(&self, t: f64) -> usize {
        self.breaks.partition_point(|b| *b <= t).saturating_sub(1).min(self.segments.len() - 1)
    }

    /// Times of the nodes of a piece.
    pub fn node_times(&self, segment: usize) -> impl Iterator<Item = f64> + '_ {
        let (a, b) = (self.breaks[segment], self.breaks[segment + 1]);
        self.segments[segment].basis.nodes().iter().map(move |x| a + 0.5 * (b - a) * (x + 1.0))
    }

    /// Value at `t` (length `dimension`); extrapolates outside.
    pub fn evaluate(&self, t: f64, out: &mut [f64]) {
        self.evaluate_in(self.segment_at(t), t, out);
    }

    /// Value at `t` of one piece, which matters at breaks.
    pub fn evaluate_in(&self, segment: usize, t: f64, out: &mut [f64]) {
        let s = &self.segments[segment];
        s.basis.evaluate_all(&s.values, self.local(segment, t), out);
    }

    /// The time at which to look at what may jump at the ends of a piece: `t`, but clear of them, unless they are those of all pieces.
    #[must_use]
    pub fn within(&self, segment: usize, t: f64) -> f64 {
        let (start, end) = (self.breaks[segment], self.breaks[segment + 1]);
        let distance = CLEAR * self.breaks[0].abs().max(self.breaks[self.segments.len()].abs());
        if end - start <= 2.0 * distance {
            return t;
        }
        let clear = t.clamp(start + distance, end - distance);
        let is_first = segment == 0 && clear > t;
        let is_last = segment + 1 == self.segments.len() && clear < t;
        if is_first || is_last { t } else { clear }
    }

    /// Time derivative at `t` of one piece.
    pub fn derivative_in(&self, segment: usize, t: f64, out: &mut [f64]) {
        let s = &self.segments[segment];
        s.basis.derivative_all(&s.values, self.local(segment, t), out);
        let rate = 2.0 / (self.breaks[segment + 1] - self.breaks[segment]);
        out.iter_mut().for_each(|v| *v *= rate);
    }

    /// One component at `t`.
    #[must_use]
    pub fn component(&self, t: f64, index: usize) -> f64 {
        let k = self.segment_at(t);
        let s = &self.segments[k];
        s.basis.evaluate(&s.values, self.dimension, index, self.local(k, t))
    }

    fn local(&self, segment: usize, t: f64) -> f64 {
        let (a, b) = (self.breaks[segment], self.breaks[segment + 1]);
        ((t - a) - (b - t)) / (b - a)
    }
}
