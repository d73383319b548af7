//! The only place that speaks parry's language: x east, y up, z south, relative to the middle of the map, in glam's vectors.
//!
//! With z to the south, the rows of parry's array are those of the map (row 0 north), and its cells are cut from their south-west to
//! their north-east corner.

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{self, ShapeCastOptions};
use parry3d_f64::shape::{Ball, Cylinder, HeightField, HeightFieldCellStatus, Shape, Triangle};
use parry3d_f64::utils::Array2;

use super::{Body, Ground};
use crate::{ElevationMap, TerrainError};

/// Most cells of a height field: parry numbers two triangles in each, from both sides, in 32 bits.
const MOST_CELLS: u64 = 1 << 30;

/// A motion whose vertical part is less than this part of its length gets this one: parry ends a level cast after the first cells.
const LEAST_DESCENT: f64 = 1e-9;

/// A height field in parry's frame, heights relative to the datum.
#[derive(Clone, Debug)]
pub(super) struct Field {
    shape: HeightField,
    holes: bool,
}

impl Field {
    pub(super) fn new(map: &ElevationMap, pixel: f64) -> Result<Field, TerrainError> {
        let (rows, cols) = (map.geometry().rows(), map.geometry().cols());
        for (name, value) in [("rows of the ground", rows), ("columns of the ground", cols)] {
            if value < 2 {
                let value = value as f64;
                return Err(TerrainError::Number {
                    name,
                    value,
                    allowed: "there must be at least two".into(),
                });
            }
        }
        let cells = (rows as u64 - 1) * (cols as u64 - 1);
        if cells > MOST_CELLS {
            let (rows, cols) = (rows as u64, cols as u64);
            return Err(TerrainError::TooLarge { rows, cols, limit: MOST_CELLS });
        }
        let Some([low, _]) = map.range() else {
            return Err(TerrainError::Empty { pixels: rows * cols });
        };
        let low = low - map.datum();
        let heights = map.relative();
        // parry keeps its array column by column.
        let data = (0..cols)
            .flat_map(|col| (0..rows).map(move |row| (row, col)))
            .map(|(row, col)| f64::from(heights.get(row, col)))
            .map(|z| if z.is_nan() { low } else { z })
            .collect();
        let scale = Vector::new((cols - 1) as f64 * pixel, 1.0, (rows - 1) as f64 * pixel);
        let mut shape = HeightField::new(Array2::new(rows, cols, data), scale);
        let mut holes = false;
        for row in 0..rows {
            for col in (0..cols).filter(|&col| heights.get(row, col).is_nan()) {
                holes = true;
                for r in row.saturating_sub(1)..=row.min(rows - 2) {
                    for c in col.saturating_sub(1)..=col.min(cols - 2) {
                        shape.set_cell_status(r, c, HeightFieldCellStatus::CELL_REMOVED);
                    }
                }
            }
        }
        Ok(Field { shape, holes })
    }

    pub(super) fn holes(&self) -> bool {
        self.holes
    }

    /// Numbers of cells to the south and to the east.
    pub(super) fn cells(&self) -> [usize; 2] {
        [self.shape.nrows(), self.shape.ncols()]
    }

    pub(super) fn is_hole(&self, row: usize, col: usize) -> bool {
        self.shape.cell_status(row, col).contains(HeightFieldCellStatus::CELL_REMOVED)
    }

    /// Heights of the corners of a cell: north-west, north-east, south-west, south-east.
    pub(super) fn corners(&self, row: usize, col: usize) -> [f64; 4] {
        let z = self.shape.heights();
        [z[(row, col)], z[(row, col + 1)], z[(row + 1, col)], z[(row + 1, col + 1)]]
    }

    /// The two triangles of a cell, corners as (east, north, up) from the middle of the map; none of a hole.
    pub(super) fn triangles(&self, row: usize, col: usize) -> [Option<[[f64; 3]; 3]>; 2] {
        let corners = |t: Triangle| [t.a, t.b, t.c].map(from_parry);
        let (north_west, south_east) = self.shape.triangles_at(row, col);
        [north_west.map(corners), south_east.map(corners)]
    }

    /// Part of the way at which a body that moves from `from` to `to` (its centre, from the middle of the map) meets the ground.
    #[expect(clippy::expect_used, reason = "invariant: parry casts convex shapes on height fields")]
    pub(super) fn sweep(&self, body: &Body, from: [f64; 3], to: [f64; 3]) -> Option<f64> {
        let shape: &dyn Shape = match *body {
            Body::Ball { radius } => &Ball::new(radius),
            Body::Cylinder { radius, height } => &Cylinder::new(0.5 * height, radius),
        };
        let start = to_parry(from);
        let mut way = to_parry(to) - start;
        let least = LEAST_DESCENT * way.length();
        if way.y.abs() < least {
            way.y = -least;
        }
        if way.length() == 0.0 {
            let touches = query::intersection_test(&Pose::IDENTITY, &self.shape, &at(start), shape)
                .expect("invariant: parry tests a height field against a convex shape");
            return touches.intersecting.then_some(0.0);
        }
        let options = ShapeCastOptions::with_max_time_of_impact(1.0);
        query::cast_shapes(&Pose::IDENTITY, Vector::ZERO, &self.shape, &at(start), way, shape, options)
            .expect("invariant: parry casts a convex shape on a height field")
            .map(|hit| hit.time_of_impact)
    }
}

impl Ground {
    #[cfg(test)]
    pub(super) fn shape(&self) -> &HeightField {
        &self.field.shape
    }
}

fn at(place: Vector) -> Pose {
    Pose::translation(place.x, place.y, place.z)
}

pub(super) fn to_parry([east, north, up]: [f64; 3]) -> Vector {
    Vector::new(east, up, -north)
}

fn from_parry(v: Vector) -> [f64; 3] {
    [v.x, -v.z, v.y]
}
