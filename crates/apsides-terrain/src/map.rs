//! Elevation maps.

use crate::{Geometry, Raster, TerrainError};

/// Heights on pixels.
///
/// Heights are kept as `f32` above a datum that is near them, so that a map at -4000 m has the same resolution as one at 0 m.
#[derive(Clone, Debug, PartialEq)]
pub struct ElevationMap {
    /// Heights above the datum, m; NaN is a gap.
    relative: Raster<f32>,
    datum: f64,
}

impl ElevationMap {
    /// From heights in metres, row by row; what is not finite is a gap. The datum is the middle of the range of heights, rounded to a
    /// whole metre.
    ///
    /// # Errors
    /// Another number of heights than pixels.
    pub fn from_heights(geometry: Geometry, heights: &[f64]) -> Result<ElevationMap, TerrainError> {
        let finite = || heights.iter().copied().filter(|z| z.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let datum = if low <= high { (0.5 * low + 0.5 * high).round() } else { 0.0 };
        let data =
            heights.iter().map(|&z| if z.is_finite() { (z - datum) as f32 } else { f32::NAN }).collect();
        Ok(ElevationMap { relative: Raster::new(geometry, data)?, datum })
    }

    /// From heights above `datum`, m; NaN and infinities are gaps.
    ///
    /// # Errors
    /// A datum that is not finite.
    pub fn from_relative(mut relative: Raster<f32>, datum: f64) -> Result<ElevationMap, TerrainError> {
        if !datum.is_finite() {
            return Err(TerrainError::Number {
                name: "datum",
                value: datum,
                allowed: "it must be finite".into(),
            });
        }
        relative.data_mut().iter_mut().filter(|z| !z.is_finite()).for_each(|z| *z = f32::NAN);
        Ok(ElevationMap { relative, datum })
    }

    /// The places of the pixels.
    pub fn geometry(&self) -> &Geometry {
        self.relative.geometry()
    }

    /// Heights above [`ElevationMap::datum`], m; NaN is a gap.
    pub fn relative(&self) -> &Raster<f32> {
        &self.relative
    }

    /// Height of the datum, m.
    pub fn datum(&self) -> f64 {
        self.datum
    }

    /// Height of a pixel of the map, m; none in a gap.
    pub fn height(&self, row: usize, col: usize) -> Option<f64> {
        let z = f64::from(self.relative.get(row, col));
        z.is_finite().then_some(self.datum + z)
    }

    /// Least and largest height, m; none if all pixels are gaps.
    pub fn range(&self) -> Option<[f64; 2]> {
        let heights = self.relative.data().iter().filter(|z| z.is_finite());
        let (low, high) = heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &z| (l.min(z), h.max(z)));
        (low <= high).then(|| [self.datum + f64::from(low), self.datum + f64::from(high)])
    }

    /// Number of pixels without a height.
    pub fn gaps(&self) -> usize {
        self.relative.data().iter().filter(|z| z.is_nan()).count()
    }

    /// A copy of the window of `rows` x `cols` pixels whose first pixel is (`row`, `col`), with the same datum.
    ///
    /// # Errors
    /// A window that is empty or leaves the map.
    pub fn window(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<ElevationMap, TerrainError> {
        Ok(ElevationMap { relative: self.relative.window(row, col, rows, cols)?, datum: self.datum })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f64 = 1e-6;

    #[test]
    fn heights_keep_their_resolution_far_from_zero() {
        let geometry = Geometry::square(1, 4, 1.0).unwrap();
        let map = ElevationMap::from_heights(geometry, &[-4450.001, -4449.9997, f64::NAN, -4440.0]).unwrap();
        assert!((map.height(0, 0).unwrap() + 4450.001).abs() < SINGLE);
        assert!((map.height(0, 1).unwrap() + 4449.9997).abs() < SINGLE);
        assert_eq!((map.height(0, 2), map.gaps()), (None, 1));
        assert_eq!(map.range().unwrap()[1], -4440.0);
    }

    #[test]
    fn a_map_of_gaps_has_no_range() {
        let map = ElevationMap::from_heights(Geometry::square(2, 2, 1.0).unwrap(), &[f64::NAN; 4]).unwrap();
        assert_eq!((map.range(), map.gaps(), map.datum()), (None, 4, 0.0));
    }
}
