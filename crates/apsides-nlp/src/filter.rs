//! The filter: pairs of constraint violation and barrier function that no later iterate may be dominated by
//! (Waechter and Biegler, section 2.3).

/// Relative margin in the violation.
pub(crate) const VIOLATION_MARGIN: f64 = 1e-5;
/// Margin in the barrier function, relative to the violation.
pub(crate) const BARRIER_MARGIN: f64 = 1e-8;

/// `lhs <= rhs` up to rounding of numbers of size `base`.
pub(crate) fn at_most(lhs: f64, rhs: f64, base: f64) -> bool {
    lhs - rhs <= 10.0 * f64::EPSILON * base.abs()
}

/// Forbidden corners, margins included.
#[derive(Debug, Clone)]
pub(crate) struct Filter {
    corners: Vec<(f64, f64)>,
    /// Upper limit on the violation.
    pub max_violation: f64,
}

impl Filter {
    pub(crate) fn new() -> Self {
        Self { corners: Vec::with_capacity(64), max_violation: f64::INFINITY }
    }

    pub(crate) fn clear(&mut self) {
        self.corners.clear();
    }

    /// Returns true if no corner dominates the pair.
    pub(crate) fn accepts(&self, violation: f64, barrier: f64) -> bool {
        self.corners.iter().all(|&(v, b)| at_most(violation, v, v) || at_most(barrier, b, b))
    }

    /// Forbids everything that is not better than the pair by the margins.
    pub(crate) fn add(&mut self, violation: f64, barrier: f64) {
        let corner = ((1.0 - VIOLATION_MARGIN) * violation, barrier - BARRIER_MARGIN * violation);
        self.corners.retain(|&(v, b)| v < corner.0 || b < corner.1);
        self.corners.push(corner);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_must_improve_on_every_corner_in_one_of_the_two() {
        let mut filter = Filter::new();
        assert!(filter.accepts(1e9, 1e9));
        filter.add(1.0, 5.0);
        filter.add(2.0, 3.0);
        assert!(filter.accepts(0.5, 9.0));
        assert!(filter.accepts(1.5, 4.0));
        assert!(!filter.accepts(1.5, 6.0));
        assert!(!filter.accepts(2.5, 4.0));
        assert!(!filter.accepts(1.0, 5.0), "the margin is missing");
        filter.add(0.1, 0.0);
        assert_eq!(filter.corners.len(), 1, "dominated corners stay");
        filter.clear();
        assert!(filter.accepts(3.0, 7.0));
    }
}
