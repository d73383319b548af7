//! Meshes: intervals of a phase and the number of collocation points in each.

use crate::{Ocp, OcpError};

/// Mesh of one phase on the normalised time from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseMesh {
    fractions: Vec<f64>,
    points: Vec<usize>,
}

impl PhaseMesh {
    /// `intervals` equal intervals with `points` collocation points each.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when either is zero.
    pub fn uniform(intervals: usize, points: usize) -> Result<Self, OcpError> {
        let fractions = (0..=intervals).map(|k| k as f64 / intervals.max(1) as f64).collect();
        Self::new(fractions, vec![points; intervals])
    }

    /// Interval ends from 0 to 1 and points per interval.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when the ends do not increase from 0 to 1 or an interval has no point.
    pub fn new(fractions: Vec<f64>, points: Vec<usize>) -> Result<Self, OcpError> {
        let fail = |reason: &str| Err(OcpError::Mesh { place: "a phase".into(), reason: reason.into() });
        if points.is_empty() || fractions.len() != points.len() + 1 {
            return fail("needs at least one interval and one end more than intervals");
        }
        if points.contains(&0) {
            return fail("every interval needs at least one point");
        }
        let ends = fractions[0] == 0.0 && fractions[points.len()] == 1.0;
        if !ends || fractions.iter().any(|f| f.is_nan()) || fractions.windows(2).any(|w| w[0] >= w[1]) {
            return fail("the interval ends must increase from 0 to 1");
        }
        Ok(Self { fractions, points })
    }

    /// Interval ends from 0 to 1.
    #[must_use]
    pub fn fractions(&self) -> &[f64] {
        &self.fractions
    }

    /// Collocation points per interval.
    #[must_use]
    pub fn points(&self) -> &[usize] {
        &self.points
    }

    /// Number of intervals.
    #[must_use]
    pub fn intervals(&self) -> usize {
        self.points.len()
    }

    /// Collocation points of the phase.
    #[must_use]
    pub fn total_points(&self) -> usize {
        self.points.iter().sum()
    }
}

/// Meshes of all phases of a problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// One mesh per phase.
    pub phases: Vec<PhaseMesh>,
}

impl Mesh {
    /// The same uniform mesh in every phase.
    ///
    /// # Errors
    /// [`OcpError::Mesh`] when either number is zero.
    pub fn uniform(ocp: &Ocp, intervals: usize, points: usize) -> Result<Self, OcpError> {
        let phase = PhaseMesh::uniform(intervals, points)?;
        Ok(Self { phases: vec![phase; ocp.phases.len()] })
    }
}
