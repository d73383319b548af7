//! Disks of pixels, and planes over them by running sums along rows.

use crate::Raster;

/// Offsets below this, in pixels, are rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Pixels whose centres are within a radius, as one chord for each row.
#[derive(Clone, Debug)]
pub(crate) struct Disk {
    /// Radius in whole pixels.
    pub(crate) reach: usize,
    /// Half widths of the rows `-reach..=reach`: columns `-w..=w`.
    pub(crate) half: Vec<usize>,
    /// Number of pixels.
    pub(crate) count: usize,
    /// Sum of the squares of the column offsets; the same for rows.
    pub(crate) moment: f64,
}

impl Disk {
    pub(crate) fn new(radius_m: f64, pixel_m: f64) -> Disk {
        let radius = radius_m / pixel_m;
        let reach = (radius + ROUNDING).floor();
        let half: Vec<usize> = (-(reach as i64)..=reach as i64)
            .map(|dy| ((radius * radius - (dy * dy) as f64).max(0.0).sqrt() + ROUNDING).floor() as usize)
            .collect();
        let count = half.iter().map(|w| 2 * w + 1).sum();
        let moment = half.iter().map(|&w| (w * (w + 1) * (2 * w + 1)) as f64 / 3.0).sum();
        Disk { reach: reach as usize, half, count, moment }
    }

    /// Offsets of rows with half widths.
    pub(crate) fn chords(&self) -> impl Iterator<Item = (isize, usize)> + '_ {
        self.half.iter().enumerate().map(|(k, &w)| (k as isize - self.reach as isize, w))
    }
}

/// A least-squares plane around a pixel: height at its centre and gradient (to the east, to the south).
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalPlane {
    /// Height over the datum, m.
    pub(crate) height: f64,
    /// Rise per pixel to the east and to the south, m.
    pub(crate) rise: [f64; 2],
}

/// Running sums of heights and of column times height along each row.
pub(crate) struct RowSums {
    cols: usize,
    rows: usize,
    /// For each row one more entry than columns: number of heights, sum, sum weighted by the column.
    sums: Vec<[f64; 3]>,
}

impl RowSums {
    pub(crate) fn new(heights: &Raster<f32>) -> RowSums {
        let (rows, cols) = (heights.geometry().rows(), heights.geometry().cols());
        let mut sums = Vec::with_capacity(rows * (cols + 1));
        for row in 0..rows {
            let mut sum = [0.0; 3];
            sums.push(sum);
            for (col, &z) in heights.row(row).iter().enumerate() {
                if !z.is_nan() {
                    let z = f64::from(z);
                    sum = [sum[0] + 1.0, sum[1] + z, sum[2] + col as f64 * z];
                }
                sums.push(sum);
            }
        }
        RowSums { cols, rows, sums }
    }

    /// The plane over a disk; none if it leaves the map or has a gap.
    pub(crate) fn plane(&self, disk: &Disk, row: usize, col: usize) -> Option<LocalPlane> {
        let r = disk.reach;
        if row < r || col < r || row + r >= self.rows || col + r >= self.cols {
            return None;
        }
        let (mut count, mut sum, mut by_col, mut by_row) = (0.0, 0.0, 0.0, 0.0);
        for (i, &w) in disk.half.iter().enumerate() {
            let line = (row + i - r) * (self.cols + 1) + col;
            let (a, b) = (self.sums[line - w], self.sums[line + w + 1]);
            let z = b[1] - a[1];
            count += b[0] - a[0];
            sum += z;
            by_col += b[2] - a[2] - col as f64 * z;
            by_row += (i as f64 - r as f64) * z;
        }
        (count as usize == disk.count).then(|| LocalPlane {
            height: sum / disk.count as f64,
            rise: [by_col / disk.moment, by_row / disk.moment],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ElevationMap, Geometry};

    /// Round-off of sums over rows, m.
    const ROUNDING_M: f64 = 1e-9;

    /// Round-off of the slopes of exact heights.
    const ROUNDING_OF_SLOPES: f64 = 1e-12;

    #[test]
    fn the_disks_of_the_references() {
        let counts = [5.0, 25.0].map(|r| Disk::new(r, 1.0).count);
        assert_eq!(counts, [81, 1961]);
        assert_eq!(Disk::new(0.5, 1.0).count, 1);
    }

    #[test]
    fn a_plane_is_found_and_gaps_are_not_fitted() {
        let geometry = Geometry::square(20, 30, 1.0).unwrap();
        let mut heights: Vec<f64> =
            (0..600).map(|k| 0.5 * (k % 30) as f64 - 0.25 * (k / 30) as f64 + 3.0).collect();
        heights[5 * 30 + 9] = f64::NAN;
        let map = ElevationMap::from_heights(geometry, &heights).unwrap();
        let sums = RowSums::new(map.relative());
        let disk = Disk::new(3.2, 1.0);
        let plane = sums.plane(&disk, 12, 20).unwrap();
        assert!((plane.height + map.datum() - 10.0).abs() < ROUNDING_M);
        assert!(
            (plane.rise[0] - 0.5).abs() < ROUNDING_OF_SLOPES
                && (plane.rise[1] + 0.25).abs() < ROUNDING_OF_SLOPES
        );
        assert!(sums.plane(&disk, 6, 7).is_none() && sums.plane(&disk, 2, 15).is_none());
        assert!(sums.plane(&disk, 9, 9).is_some());
    }
}
