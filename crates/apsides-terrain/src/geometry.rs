//! Places of the pixels of a raster.

use serde::{Deserialize, Serialize};

use crate::{MapUnit, TerrainError};

/// Rows, columns, size and place of pixels. Row 0 is the northernmost, column 0 the westernmost; a height belongs to the centre of its
/// pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    rows: usize,
    cols: usize,
    /// Extents of a pixel to the east and to the south, positive, in `unit`.
    pixel: [f64; 2],
    /// Map coordinates (east, north) of the centre of pixel (0, 0), in `unit`.
    north_west: [f64; 2],
    unit: MapUnit,
}

impl Geometry {
    /// Square pixels of `pixel` metres, the centre of pixel (0, 0) at the origin.
    ///
    /// # Errors
    /// No pixels, or a size that is not positive and finite.
    pub fn square(rows: usize, cols: usize, pixel: f64) -> Result<Geometry, TerrainError> {
        Geometry::new(rows, cols, [pixel; 2], [0.0; 2], MapUnit::Metre)
    }

    /// Pixels of `pixel` (to the east, to the south), the centre of pixel (0, 0) at `north_west` (east, north), all in `unit`.
    ///
    /// # Errors
    /// No pixels, a size that is not positive and finite, or a place that is not finite.
    pub fn new(
        rows: usize,
        cols: usize,
        pixel: [f64; 2],
        north_west: [f64; 2],
        unit: MapUnit,
    ) -> Result<Geometry, TerrainError> {
        if rows == 0 || cols == 0 || rows.checked_mul(cols).is_none() {
            return Err(TerrainError::Shape { rows, cols, values: 0 });
        }
        for value in pixel {
            if !(value.is_finite() && value > 0.0) {
                return Err(TerrainError::Number {
                    name: "size of a pixel",
                    value,
                    allowed: "it must be positive and finite".into(),
                });
            }
        }
        for value in north_west {
            if !value.is_finite() {
                return Err(TerrainError::Number {
                    name: "map coordinate",
                    value,
                    allowed: "it must be finite".into(),
                });
            }
        }
        Ok(Geometry { rows, cols, pixel, north_west, unit })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.rows * self.cols
    }

    /// Extents of a pixel to the east and to the south, in [`Geometry::unit`].
    pub fn pixel(&self) -> [f64; 2] {
        self.pixel
    }

    /// Map coordinates (east, north) of the centre of pixel (0, 0), in [`Geometry::unit`].
    pub fn north_west(&self) -> [f64; 2] {
        self.north_west
    }

    /// Unit of sizes and places.
    pub fn unit(&self) -> MapUnit {
        self.unit
    }

    /// Size of a square pixel, m.
    ///
    /// # Errors
    /// Pixels in degrees, or whose sides differ by more than one part in a million.
    pub fn square_pixel(&self) -> Result<f64, TerrainError> {
        let [east, south] = self.pixel;
        if self.unit != MapUnit::Metre || (east - south).abs() > 1e-6 * east {
            return Err(TerrainError::Pixel { east, south, unit: self.unit });
        }
        Ok(east)
    }

    /// Index of a pixel in the data of a raster, which goes row by row.
    pub fn index(&self, row: usize, col: usize) -> usize {
        debug_assert!(row < self.rows && col < self.cols);
        row * self.cols + col
    }

    /// Map coordinates (east, north) of row `row` and column `col`, whole numbers being centres of pixels.
    pub fn position(&self, row: f64, col: f64) -> [f64; 2] {
        [self.north_west[0] + col * self.pixel[0], self.north_west[1] - row * self.pixel[1]]
    }

    /// Row and column of map coordinates (east, north); whole numbers are centres of pixels. The point may be outside the map.
    pub fn row_col(&self, position: [f64; 2]) -> [f64; 2] {
        [
            (self.north_west[1] - position[1]) / self.pixel[1],
            (position[0] - self.north_west[0]) / self.pixel[0],
        ]
    }

    /// The geometry of the window of `rows` x `cols` pixels whose first pixel is (`row`, `col`).
    ///
    /// # Errors
    /// A window that is empty or leaves the map.
    pub fn window(&self, row: usize, col: usize, rows: usize, cols: usize) -> Result<Geometry, TerrainError> {
        let inside =
            |first: usize, count: usize, all: usize| first.checked_add(count).is_some_and(|end| end <= all);
        if !inside(row, rows, self.rows) || !inside(col, cols, self.cols) {
            let (row, col) = (row.saturating_add(rows), col.saturating_add(cols));
            return Err(TerrainError::Outside { row, col, rows: self.rows, cols: self.cols });
        }
        Geometry::new(rows, cols, self.pixel, self.position(row as f64, col as f64), self.unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_zero_is_north_and_centres_are_whole_numbers() {
        let g = Geometry::new(4, 5, [2.0, 3.0], [100.0, 50.0], MapUnit::Metre).unwrap();
        assert_eq!(g.position(0.0, 0.0), [100.0, 50.0]);
        assert_eq!(g.position(2.0, 1.0), [102.0, 44.0]);
        assert_eq!(g.row_col([102.0, 44.0]), [2.0, 1.0]);
        let w = g.window(1, 2, 3, 3).unwrap();
        assert_eq!((w.rows(), w.cols(), w.north_west()), (3, 3, [104.0, 47.0]));
    }

    #[test]
    fn ill_posed_geometries_are_refused() {
        assert!(matches!(Geometry::square(0, 4, 1.0), Err(TerrainError::Shape { .. })));
        assert!(matches!(Geometry::square(usize::MAX, 4, 1.0), Err(TerrainError::Shape { .. })));
        for pixel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Geometry::square(2, 2, pixel), Err(TerrainError::Number { .. })));
        }
        let g = Geometry::square(4, 4, 1.0).unwrap();
        assert!(matches!(g.window(2, 2, 3, 1), Err(TerrainError::Outside { .. })));
        assert!(matches!(g.window(2, 2, usize::MAX, 1), Err(TerrainError::Outside { .. })));
        assert!(matches!(g.window(2, 2, 0, 1), Err(TerrainError::Shape { .. })));
        let oblong = Geometry::new(2, 2, [1.0, 1.1], [0.0; 2], MapUnit::Metre).unwrap();
        assert!(matches!(oblong.square_pixel(), Err(TerrainError::Pixel { .. })));
    }
}
