//! One profile: sub-intervals of `[0, 1]` and a polynomial on each.

use apsides_basis::Lobatto;
use apsides_ocp::Bounds;

use super::shape::{MAX_DEGREE, ProfileShape};
use crate::error::ShootingError;

/// A decoded profile. Owns all storage, so that decoding another vector allocates nothing.
#[derive(Clone, Debug)]
pub struct Profile {
    shape: ProfileShape,
    /// Nodes on [-1, 1] of the largest degree.
    nodes: Vec<f64>,
    /// For each degree, from the least: from the values at its nodes to the coefficients of powers on [-1, 1], row-major, a row per power.
    powers: Vec<Vec<f64>>,
    /// Degrees of the sub-intervals.
    degrees: Vec<usize>,
    /// Ends of the sub-intervals from 0 to 1.
    joints: Vec<f64>,
    /// Values at the nodes, row-major: sub-intervals by nodes by components.
    values: Vec<f64>,
    /// Coefficients, in the same order with powers for nodes.
    coefficients: Vec<f64>,
}

impl ProfileShape {
    /// The profile of a decision vector; numbers outside of the box count as the nearest inside.
    ///
    /// # Errors
    /// As [`space`](Self::space), and [`ShootingError::Dimension`].
    pub fn decode(&self, decision: &[f64]) -> Result<Profile, ShootingError> {
        let mut profile = Profile::new(self)?;
        profile.decode(decision)?;
        Ok(profile)
    }
}

impl Profile {
    /// A profile of a shape, in the middle of its box.
    ///
    /// # Errors
    /// As [`ProfileShape::space`].
    pub fn new(shape: &ProfileShape) -> Result<Self, ShootingError> {
        let (lower, upper) = shape.space()?;
        let nodes = nodes_of(shape.most_degree)?;
        let powers = (shape.degree..=shape.most_degree).map(|d| Ok(lagrange_powers(&nodes_of(d)?)));
        let powers = powers.collect::<Result<_, ShootingError>>()?;
        let size = shape.most_intervals * nodes.len() * shape.components();
        let mut profile = Self {
            shape: shape.clone(),
            powers,
            nodes,
            degrees: Vec::with_capacity(shape.most_intervals),
            joints: Vec::with_capacity(shape.most_intervals + 1),
            values: vec![0.0; size],
            coefficients: vec![0.0; size],
        };
        let middle: Vec<f64> = lower.iter().zip(&upper).map(|(a, b)| 0.5 * (a + b)).collect();
        profile.decode(&middle)?;
        Ok(profile)
    }

    /// Replaces the profile by that of a decision vector; numbers outside of the box count as the nearest inside.
    ///
    /// # Errors
    /// [`ShootingError::Dimension`].
    pub fn decode(&mut self, decision: &[f64]) -> Result<(), ShootingError> {
        let Self { shape, joints, .. } = self;
        if decision.len() != shape.variables() {
            return Err(ShootingError::Dimension {
                place: "profile".into(),
                what: "decision variables",
                expected: shape.variables(),
                found: decision.len(),
            });
        }
        let components = shape.components();
        let (values, rest) = decision.split_at(shape.nodal_points() * components);
        let (weights, rest) = rest.split_at(shape.weights());
        let (degrees, number) = rest.split_at(shape.free_degrees());
        let least = shape.least_intervals;
        // A number that is none counts as the fewest.
        let count = number.first().map_or(least, |n| n.round().max(least as f64) as usize);
        let count = count.min(shape.most_intervals);
        let weight = |k: usize| weights.get(k).map_or(1.0, |w| w.clamp(1.0 / shape.length_ratio, 1.0));
        let total: f64 = (0..count).map(weight).sum();
        joints.clear();
        joints.push(0.0);
        let mut sum = 0.0;
        for k in 0..count - 1 {
            sum += weight(k);
            joints.push(sum / total);
        }
        joints.push(1.0);
        let points = self.nodes.len();
        let stride = if shape.continuous { shape.most_degree } else { points };
        self.degrees.clear();
        for interval in 0..count {
            let degree = degrees.get(interval).map_or(shape.degree, |d| d.round().max(0.0) as usize);
            let degree = degree.clamp(shape.degree, shape.most_degree);
            self.degrees.push(degree);
            for node in 0..=degree {
                // The last is that of the joint.
                let given = if node > 0 && node == degree { points - 1 } else { node };
                let from = &values[(interval * stride + given) * components..][..components];
                let to = &mut self.values[(interval * points + node) * components..][..components];
                for ((to, from), b) in to.iter_mut().zip(from).zip(&shape.bounds) {
                    *to = from.clamp(b.lower, b.upper);
                }
            }
            let block = interval * points * components..(interval + 1) * points * components;
            let (values, coefficients) = (&mut self.values[block.clone()], &mut self.coefficients[block]);
            coefficients.fill(0.0);
            for (power, row) in self.powers[degree - shape.degree].chunks(degree + 1).enumerate() {
                for c in 0..components {
                    let terms = row.iter().zip(values[c..].iter().step_by(components));
                    coefficients[power * components + c] = terms.map(|(a, v)| a * v).sum();
                }
            }
            if degree < shape.most_degree {
                for (node, x) in self.nodes.iter().enumerate() {
                    for (c, b) in shape.bounds.iter().enumerate() {
                        let powers = (0..=degree).rev().map(|power| coefficients[power * components + c]);
                        let value = powers.fold(0.0, |sum, a| sum * x + a);
                        values[node * components + c] = value.clamp(b.lower, b.upper);
                    }
                }
            }
        }
        Ok(())
    }

    /// Its shape.
    #[must_use]
    pub fn shape(&self) -> &ProfileShape {
        &self.shape
    }

    /// Number of sub-intervals.
    #[must_use]
    pub fn intervals(&self) -> usize {
        self.joints.len() - 1
    }

    /// Ends of the sub-intervals, from 0 to 1.
    #[must_use]
    pub fn joints(&self) -> &[f64] {
        &self.joints
    }

    /// Degree of each sub-interval.
    #[must_use]
    pub fn degrees(&self) -> &[usize] {
        &self.degrees
    }

    /// Nodes of the largest degree on [-1, 1], which is mapped onto each sub-interval.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Values at the nodes of a sub-interval, row-major nodes by components.
    ///
    /// # Examples
    /// ```
    /// use apsides_ocp::Bounds;
    /// use apsides_shooting::profile::ProfileShape;
    ///
    /// // Two straight lines with a jump between them.
    /// let shape = ProfileShape::new(1, 2, vec![Bounds::new(-1.0, 1.0)]);
    /// let profile = shape.decode(&[0.0, 0.4, -0.3, 2.0])?;
    /// assert_eq!(profile.nodal_values(0), [0.0, 0.4]);
    /// assert_eq!(profile.nodal_values(1), [-0.3, 1.0], "what is beyond a bound is moved to it");
    /// # Ok::<(), apsides_shooting::ShootingError>(())
    /// ```
    #[must_use]
    pub fn nodal_values(&self, interval: usize) -> &[f64] {
        let size = self.nodes.len() * self.shape.components();
        &self.values[interval * size..][..size]
    }

    /// The sub-interval of an abscissa: the later one at a joint, the first or last outside of `[0, 1]`.
    #[must_use]
    pub fn interval_at(&self, s: f64) -> usize {
        self.joints[1..self.intervals()].partition_point(|j| *j <= s)
    }

    /// Writes the components at an abscissa; outside of `[0, 1]` they keep their values at the ends.
    pub fn at(&self, s: f64, out: &mut [f64]) {
        self.at_in(self.interval_at(s), s, out);
    }

    /// The same for one sub-interval. Beyond its joints with others they go on along the tangents, within their bounds: an integration
    /// that steps across a joint sees no kink there.
    pub fn at_in(&self, interval: usize, s: f64, out: &mut [f64]) {
        let s = s.clamp(0.0, 1.0);
        let (a, b) = (self.joints[interval], self.joints[interval + 1]);
        let x = ((s - a) - (b - s)) / (b - a);
        // A NaN stays one, also where the profile is constant.
        let inside = x.clamp(-1.0, 1.0);
        let (points, components) = (self.nodes.len(), self.shape.components());
        let rows = &self.coefficients[interval * points * components..][..points * components];
        for (c, (out, &Bounds { lower, upper })) in out.iter_mut().zip(&self.shape.bounds).enumerate() {
            let (mut sum, mut slope) = (rows[(points - 1) * components + c], 0.0);
            for power in (0..points - 1).rev() {
                slope = slope * inside + sum;
                sum = sum * inside + rows[power * components + c];
            }
            *out = (sum + slope * (x - inside)).clamp(lower, upper);
        }
    }
}

/// Nodes of a degree: the middle, else Lobatto points.
fn nodes_of(degree: usize) -> Result<Vec<f64>, ShootingError> {
    Ok(match degree {
        0 => vec![0.0],
        degree => Lobatto::new(degree + 1)?.nodes().to_vec(),
    })
}

/// Coefficients of powers of the Lagrange polynomials of the nodes, row-major: a row per power, a column per node.
fn lagrange_powers(nodes: &[f64]) -> Vec<f64> {
    let n = nodes.len();
    let mut matrix = vec![0.0; n * n];
    for (j, node) in nodes.iter().enumerate() {
        let mut polynomial = [0.0; MAX_DEGREE + 1];
        polynomial[0] = 1.0;
        for (_, other) in nodes.iter().enumerate().filter(|(m, _)| *m != j) {
            for power in (0..=MAX_DEGREE).rev() {
                let below = if power > 0 { polynomial[power - 1] } else { 0.0 };
                polynomial[power] = (below - other * polynomial[power]) / (node - other);
            }
        }
        for (row, c) in matrix.chunks_mut(n).zip(polynomial) {
            row[j] = c;
        }
    }
    matrix
}
