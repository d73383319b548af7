//! A vehicle against the ground: footprints, touchdown on four pads, swept bodies, lines of sight.
//!
//! [`Ground`] is the surface of triangles through the heights of a map: each cell between four centres of pixels is cut from its
//! south-west to its north-east corner. It verifies what rasters say of a site, one site at a time.
//!
//! **Frame.** x east, y north, in the map coordinates of [`Geometry`](crate::Geometry), m; z up, the height itself (not that above
//! the datum), m. Angles in rad. Gravity points to -z.
//!
//! **Gaps.** A cell with a gap at one of its corners is a hole. What a hole or the outside of the map could change is unknown:
//! the answer is then `None` (or [`Sight::Unknown`]), never a guess.

mod field;
mod footprint;
mod path;
#[cfg(test)]
mod tests;
mod touchdown;

use field::Field;
pub use path::{Clearance, Sight};
pub use touchdown::{Lander, LowerFace, Rest, Touchdown};

use crate::{ElevationMap, TerrainError};

/// A surface of triangles through the heights of a map.
#[derive(Clone, Debug)]
pub struct Ground {
    field: Field,
    /// x and y of the middle of the map, and its datum.
    middle: [f64; 3],
    pixel: f64,
}

/// A convex body that moves without turning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    /// A ball.
    Ball {
        /// Its radius, m.
        radius: f64,
    },
    /// An upright cylinder.
    Cylinder {
        /// Its radius, m.
        radius: f64,
        /// Its height, m; the place of a cylinder is its middle.
        height: f64,
    },
}

impl Ground {
    /// The ground of a map (or of a window of it): 9 bytes a pixel, built in one pass.
    ///
    /// # Errors
    /// Pixels that are not square or not in metres, less than two rows or columns, more than 2^30 cells, or no height at all.
    pub fn new(map: &ElevationMap) -> Result<Ground, TerrainError> {
        let geometry = map.geometry();
        let pixel = geometry.square_pixel()?;
        let field = Field::new(map, pixel)?;
        let [x, y] =
            geometry.position(0.5 * (geometry.rows() - 1) as f64, 0.5 * (geometry.cols() - 1) as f64);
        Ok(Ground { field, middle: [x, y, map.datum()], pixel })
    }

    /// Height of the ground at (east, north), m; none in a hole or outside the map.
    pub fn height(&self, position: [f64; 2]) -> Option<f64> {
        let [x, y, _] = self.local([position[0], position[1], 0.0]);
        let [row, col] = self.cell_coordinates([x, y]);
        self.relative_height(row, col).map(|z| z + self.middle[2])
    }

    /// A point from the middle of the map and above the datum.
    fn local(&self, point: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| point[i] - self.middle[i])
    }

    fn global(&self, point: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| point[i] + self.middle[i])
    }

    /// Row and column, whole numbers being centres of pixels, of a point from the middle of the map.
    fn cell_coordinates(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [rows, cols] = self.field.cells().map(|n| n as f64);
        [0.5 * rows - y / self.pixel, 0.5 * cols + x / self.pixel]
    }

    /// The cell that holds a row and a column; none outside the map (the edge belongs to it).
    fn cell(&self, row: f64, col: f64) -> Option<[usize; 2]> {
        let [rows, cols] = self.field.cells();
        // Rounding of map coordinates must not push a point of the edge outside.
        let margin = 1e-9;
        let inside = |at: f64, n: usize| (-margin..=n as f64 + margin).contains(&at);
        (inside(row, rows) && inside(col, cols))
            .then(|| [(row.max(0.0) as usize).min(rows - 1), (col.max(0.0) as usize).min(cols - 1)])
    }

    /// Height above the datum at a row and column.
    fn relative_height(&self, row: f64, col: f64) -> Option<f64> {
        let [i, j] = self.cell(row, col)?;
        (!self.field.is_hole(i, j)).then(|| self.height_in_cell([i, j], row, col))
    }

    fn height_in_cell(&self, [i, j]: [usize; 2], row: f64, col: f64) -> f64 {
        let [nw, ne, sw, se] = self.field.corners(i, j);
        let (south, east) = (row - i as f64, col - j as f64);
        if south + east <= 1.0 {
            nw + east * (ne - nw) + south * (sw - nw)
        } else {
            se + (1.0 - east) * (sw - se) + (1.0 - south) * (ne - se)
        }
    }
}

fn positive(name: &'static str, value: f64) -> Result<f64, TerrainError> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(TerrainError::Number { name, value, allowed: "it must be positive and finite".into() })
}

fn not_negative(name: &'static str, value: f64) -> Result<f64, TerrainError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(TerrainError::Number { name, value, allowed: "it must be finite and not negative".into() })
}
