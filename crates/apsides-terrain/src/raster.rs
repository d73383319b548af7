//! Values on pixels.

use crate::{Geometry, TerrainError};

/// One value for each pixel of a [`Geometry`], row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster<T> {
    geometry: Geometry,
    data: Vec<T>,
}

impl<T> Raster<T> {
    /// Values row by row, the northernmost row first.
    ///
    /// # Errors
    /// Another number of values than pixels.
    pub fn new(geometry: Geometry, data: Vec<T>) -> Result<Raster<T>, TerrainError> {
        if data.len() != geometry.pixels() {
            return Err(TerrainError::Shape {
                rows: geometry.rows(),
                cols: geometry.cols(),
                values: data.len(),
            });
        }
        Ok(Raster { geometry, data })
    }

    /// The places of the pixels.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// All values, row by row.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All values, row by row.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// One row.
    pub fn row(&self, row: usize) -> &[T] {
        let cols = self.geometry.cols();
        &self.data[row * cols..(row + 1) * cols]
    }

    /// A raster of the same geometry, each value made from the one here.
    pub fn map<U>(&self, of: impl FnMut(&T) -> U) -> Raster<U> {
        Raster { geometry: self.geometry, data: self.data.iter().map(of).collect() }
    }
}

impl<T: Copy> Raster<T> {
    /// The same value on all pixels.
    pub fn filled(geometry: Geometry, value: T) -> Raster<T> {
        Raster { geometry, data: vec![value; geometry.pixels()] }
    }

    /// The value of a pixel of the map.
    pub fn get(&self, row: usize, col: usize) -> T {
        self.data[self.geometry.index(row, col)]
    }

    /// A copy of the window of `rows` x `cols` pixels whose first pixel is (`row`, `col`).
    ///
    /// # Errors
    /// A window that is empty or leaves the map.
    pub fn window(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<Raster<T>, TerrainError> {
        let geometry = self.geometry.window(row, col, rows, cols)?;
        let data = (row..row + rows).flat_map(|r| &self.row(r)[col..col + cols]).copied().collect();
        Ok(Raster { geometry, data })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_copies_its_pixels() {
        let raster = Raster::new(Geometry::square(3, 4, 1.0).unwrap(), (0..12).collect()).unwrap();
        let window = raster.window(1, 1, 2, 3).unwrap();
        assert_eq!(window.data(), [5, 6, 7, 9, 10, 11]);
        assert_eq!(window.geometry().north_west(), [1.0, -1.0]);
        assert!(matches!(
            Raster::new(*raster.geometry(), vec![0; 11]),
            Err(TerrainError::Shape { values: 11, .. })
        ));
    }
}
