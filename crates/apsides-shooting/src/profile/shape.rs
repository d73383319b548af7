//! The shape of a profile and the box of its decision vectors.
//!
//! ```text
//! [ values at the nodes, sub-interval after sub-interval, node after node, component after component
//! | weights of the lengths, one per sub-interval     where lengths are free and more than one sub-interval is allowed
//! | degrees, one per sub-interval, to be rounded     where they are free
//! | number of sub-intervals, to be rounded           where it is free ]
//! ```
//!
//! With fewer sub-intervals than the most, values, weights and degrees of the last ones have no effect. There is room for the nodes of the largest
//! degree on each sub-interval; a smaller degree takes the first values and the last, which is that of the joint, for its own nodes.

use apsides_ocp::{Bounds, Phase};

use crate::error::ShootingError;

/// Highest degree of a profile.
pub const MAX_DEGREE: usize = 5;
/// Most sub-intervals of a profile.
pub const MAX_INTERVALS: usize = 1000;

/// Piecewise polynomials on sub-intervals of `[0, 1]`, given by values at nodes.
///
/// The nodes of a sub-interval are its middle for constants, else its Lobatto points, ends included. Bounds hold at the nodes and,
/// since values between them are cut off at the bounds, everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileShape {
    /// Degree of the polynomials, 0 to [`MAX_DEGREE`]; the least one where degrees are free.
    pub degree: usize,
    /// Largest degree, up to [`MAX_DEGREE`]; the degree of each sub-interval is a decision variable when this exceeds the least.
    pub most_degree: usize,
    /// Fewest sub-intervals, at least 1.
    pub least_intervals: usize,
    /// Most sub-intervals, up to [`MAX_INTERVALS`]; their number is a decision variable when this exceeds the fewest.
    pub most_intervals: usize,
    /// The lengths of the sub-intervals are decision variables; else they are equal.
    pub free_lengths: bool,
    /// Largest ratio of two free lengths, above 1.
    pub length_ratio: f64,
    /// The profile is continuous at the joints, which takes a degree of at least 1.
    pub continuous: bool,
    /// Allowed values of each component, finite.
    pub bounds: Vec<Bounds>,
}

impl ProfileShape {
    /// A given number of equal sub-intervals, free at the joints.
    #[must_use]
    pub fn new(degree: usize, intervals: usize, bounds: Vec<Bounds>) -> Self {
        Self {
            degree,
            most_degree: degree,
            least_intervals: intervals,
            most_intervals: intervals,
            free_lengths: false,
            length_ratio: 20.0,
            continuous: false,
            bounds,
        }
    }

    /// The same with the bounds of the controls of a phase.
    #[must_use]
    pub fn of_controls(degree: usize, intervals: usize, phase: &Phase) -> Self {
        Self::new(degree, intervals, phase.controls.iter().map(|c| c.bounds).collect())
    }

    /// Number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.bounds.len()
    }

    /// Values per component.
    pub(crate) fn nodal_points(&self) -> usize {
        if self.continuous {
            self.most_intervals * self.most_degree + 1
        } else {
            self.most_intervals * (self.most_degree + 1)
        }
    }

    /// Number of weights of lengths.
    pub(crate) fn weights(&self) -> usize {
        if self.free_lengths && self.most_intervals > 1 { self.most_intervals } else { 0 }
    }

    /// Number of free degrees.
    pub(crate) fn free_degrees(&self) -> usize {
        if self.most_degree > self.degree { self.most_intervals } else { 0 }
    }

    pub(crate) fn has_free_number(&self) -> bool {
        self.most_intervals > self.least_intervals
    }

    /// Number of decision variables.
    #[must_use]
    pub fn variables(&self) -> usize {
        self.nodal_points() * self.components()
            + self.weights()
            + self.free_degrees()
            + usize::from(self.has_free_number())
    }

    /// Lower and upper ends of the decision variables, in the order of the module's documentation.
    ///
    /// The number of sub-intervals reaches half below the fewest and half above the most, so that rounding gives each the same share; degrees alike.
    ///
    /// # Errors
    /// [`ShootingError::Setting`] or [`ShootingError::Profile`] naming what does not fit.
    pub fn space(&self) -> Result<(Vec<f64>, Vec<f64>), ShootingError> {
        self.check()?;
        let points = self.nodal_points();
        let mut lower: Vec<f64> = (0..points).flat_map(|_| self.bounds.iter().map(|b| b.lower)).collect();
        let mut upper: Vec<f64> = (0..points).flat_map(|_| self.bounds.iter().map(|b| b.upper)).collect();
        for _ in 0..self.weights() {
            lower.push(1.0 / self.length_ratio);
            upper.push(1.0);
        }
        for _ in 0..self.free_degrees() {
            lower.push(self.degree as f64 - 0.5);
            upper.push(self.most_degree as f64 + 0.5);
        }
        if self.has_free_number() {
            lower.push(self.least_intervals as f64 - 0.5);
            upper.push(self.most_intervals as f64 + 0.5);
        }
        Ok((lower, upper))
    }

    pub(crate) fn check(&self) -> Result<(), ShootingError> {
        let setting =
            |name, value: usize, allowed| Err(ShootingError::Setting { name, value: value as f64, allowed });
        if self.degree > MAX_DEGREE {
            return setting("degree", self.degree, "a whole number from 0 to 5");
        }
        if self.most_degree < self.degree || self.most_degree > MAX_DEGREE {
            return setting("most_degree", self.most_degree, "from degree to 5");
        }
        if self.least_intervals == 0 {
            return setting("least_intervals", 0, "at least 1");
        }
        if self.most_intervals < self.least_intervals || self.most_intervals > MAX_INTERVALS {
            return setting("most_intervals", self.most_intervals, "from least_intervals to 1000");
        }
        if self.continuous && self.degree == 0 && self.most_intervals > 1 {
            return setting("continuous", 1, "off where the degree is 0");
        }
        if self.free_lengths && !(self.length_ratio > 1.0 && self.length_ratio.is_finite()) {
            let allowed = "a finite number above 1";
            return Err(ShootingError::Setting { name: "length_ratio", value: self.length_ratio, allowed });
        }
        if self.bounds.is_empty() {
            let reason = "it has no component; give bounds of at least one".into();
            return Err(ShootingError::Profile { place: "shape".into(), reason });
        }
        for (k, b) in self.bounds.iter().enumerate() {
            if !(b.lower <= b.upper && b.lower.is_finite() && b.upper.is_finite()) {
                return Err(ShootingError::Profile {
                    place: format!("component {k}"),
                    reason: format!("bounds [{}, {}] must be finite and in order", b.lower, b.upper),
                });
            }
        }
        Ok(())
    }
}
