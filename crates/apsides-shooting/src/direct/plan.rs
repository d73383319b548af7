//! The division of a phase: segments, control points and steps in each, and the grid of the steps.

use apsides_basis::{Gauss, Lobatto};
use apsides_ocp::PhaseMesh;

use crate::error::ShootingError;

/// Division of one phase. The mesh has the segments and, as its points, the control points of each.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhasePlan {
    pub(crate) mesh: PhaseMesh,
    /// Steps of each segment, where they are not forced to end at control points.
    pub(crate) steps: Vec<usize>,
    /// True where the bounds on states are rows at the inner constraint points of a segment.
    pub(crate) inner_bounds: Vec<bool>,
}

impl PhasePlan {
    pub(crate) fn new(mesh: PhaseMesh, steps: usize) -> Self {
        let segments = mesh.intervals();
        Self { mesh: mesh.without_arcs(), steps: vec![steps; segments], inner_bounds: vec![false; segments] }
    }

    /// Says whether two plans differ by their steps at most.
    pub(crate) fn has_unknowns_of(&self, other: &Self) -> bool {
        self.mesh == other.mesh && self.inner_bounds == other.inner_bounds
    }
}

/// Points of a segment on [-1, 1] and the weights of their quadrature: both ends and Lobatto points between them, or the
/// middle alone.
pub(crate) fn points_of(points: usize) -> Result<(Vec<f64>, Vec<f64>), ShootingError> {
    if points == 1 {
        let rule = Gauss::new(1)?;
        return Ok((rule.nodes().to_vec(), rule.weights().to_vec()));
    }
    let rule = Lobatto::new(points)?;
    Ok((rule.nodes().to_vec(), rule.weights().to_vec()))
}

/// Ends of equal steps, so many on `[0, 1]` and at least one between neighbours of `stops`, which increase; with the index of
/// each stop.
pub(crate) fn step_grid(steps: usize, stops: &[f64]) -> (Vec<f64>, Vec<usize>) {
    let mut grid = vec![0.0];
    let mut at = Vec::with_capacity(stops.len());
    let reach = |end: f64, grid: &mut Vec<f64>| {
        let start = grid[grid.len() - 1];
        if end > start {
            // Rounding is not to add a step where the stops divide the segment evenly.
            let count = ((end - start) * steps as f64 - 1e-9).ceil().max(1.0) as usize;
            for k in 1..count {
                grid.push(start + (end - start) * k as f64 / count as f64);
            }
            grid.push(end);
        }
        grid.len() - 1
    };
    for stop in stops {
        at.push(reach(*stop, &mut grid));
    }
    reach(1.0, &mut grid);
    (grid, at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn steps_end_at_the_stops() {
        let (grid, at) = step_grid(4, &[0.0, 0.3, 1.0]);
        assert_eq!(at, [0, 2, 5]);
        let expected = [0.0, 0.15, 0.3, 0.3 + 0.7 / 3.0, 0.3 + 1.4 / 3.0, 1.0];
        for (a, b) in grid.iter().zip(expected) {
            assert!((a - b).abs() < ROUNDING, "{grid:?}");
        }
        assert_eq!(
            step_grid(5, &[0.2, 0.8]),
            (vec![0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0], vec![1, 4])
        );
        assert_eq!(step_grid(2, &[]), (vec![0.0, 0.5, 1.0], vec![]));
    }

    #[test]
    fn one_point_is_in_the_middle() {
        assert_eq!(points_of(1).unwrap(), (vec![0.0], vec![2.0]));
        assert_eq!(points_of(2).unwrap(), (vec![-1.0, 1.0], vec![1.0, 1.0]));
        assert!(points_of(0).is_err());
        assert!(points_of(61).is_err());
    }
}
