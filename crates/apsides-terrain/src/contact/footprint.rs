//! The highest ground within a disk, in any frame: closed form on each triangle.
//!
//! parry's casts of curved shapes are iterations that stop at 1e-8 and take a failure to converge for a miss; pads and bellies
//! need neither.

use super::Ground;

/// A point and three axes, the third being "up" of the footprint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// From the middle of the map and above the datum.
    pub(super) origin: [f64; 3],
    /// Unit vectors in (east, north, up).
    pub(super) axes: [[f64; 3]; 3],
}

impl Frame {
    pub(super) fn upright(origin: [f64; 3]) -> Frame {
        Frame { origin, axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    fn coordinates(&self, point: [f64; 3]) -> [f64; 3] {
        let d = [0, 1, 2].map(|i| point[i] - self.origin[i]);
        self.axes.map(|axis| dot(axis, d))
    }

    pub(super) fn point(&self, coordinates: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.origin[i] + (0..3).map(|k| coordinates[k] * self.axes[k][i]).sum::<f64>())
    }
}

impl Ground {
    /// Where an upright disk (or cylinder, or a point for a radius of zero) of `radius` whose axis is at (east, north) meets the ground
    /// as it descends: the highest point of the ground under it.
    ///
    /// None if a hole or the outside of the map is under the disk.
    ///
    /// # Examples
    /// ```
    /// use apsides_terrain::contact::Ground;
    /// use apsides_terrain::{ElevationMap, Geometry};
    ///
    /// // A wall of 5 m on the flat, along the column 20 m east.
    /// let geometry = Geometry::square(41, 41, 1.0)?;
    /// let heights: Vec<f64> = (0..41 * 41).map(|k| if k % 41 == 20 { 5.0 } else { 0.0 }).collect();
    /// let map = ElevationMap::from_heights(geometry, &heights)?;
    /// let ground = Ground::new(&map)?;
    /// assert!(ground.highest_under([19.0, -20.0], 0.5).is_some_and(|[.., height]| (height - 2.5).abs() < 1e-12));
    /// assert!(ground.highest_under([19.0, -20.0], 1.5).is_some_and(|[.., height]| (height - 5.0).abs() < 1e-12));
    /// assert_eq!(ground.highest_under([0.0, -20.0], 1.5), None, "beyond the edge of the map");
    /// # Ok::<(), apsides_terrain::TerrainError>(())
    /// ```
    pub fn highest_under(&self, position: [f64; 2], radius: f64) -> Option<[f64; 3]> {
        let origin = self.local([position[0], position[1], self.middle[2]]);
        let frame = Frame::upright(origin);
        self.highest(&frame, radius, radius).map(|c| self.global(frame.point(c)))
    }

    /// The highest ground within `radius` of the third axis of a frame, in coordinates of the frame. Cells within `reach` of the
    /// origin in plan count.
    pub(super) fn highest(&self, frame: &Frame, radius: f64, reach: f64) -> Option<[f64; 3]> {
        if !(radius >= 0.0 && reach.is_finite()) {
            return None;
        }
        let [row, col] = self.cell_coordinates([frame.origin[0], frame.origin[1]]);
        if radius == 0.0 {
            let z = self.relative_height(row, col)? - frame.origin[2];
            return Some([0.0, 0.0, z]);
        }
        let reach = reach / self.pixel;
        let [top, left] = self.cell(row - reach, col - reach)?;
        let [bottom, right] = self.cell(row + reach, col + reach)?;
        let mut best = None::<[f64; 3]>;
        for i in top..=bottom {
            for j in left..=right {
                if self.field.is_hole(i, j) {
                    if distance_to_cell([i, j], row, col) <= reach {
                        return None;
                    }
                    continue;
                }
                for triangle in self.field.triangles(i, j).into_iter().flatten() {
                    let triangle = triangle.map(|corner| frame.coordinates(corner));
                    let bar = best.map_or(f64::NEG_INFINITY, |b| b[2]);
                    if triangle.iter().any(|c| c[2] > bar) {
                        highest_in_disk(&triangle, radius, &mut best);
                    }
                }
            }
        }
        best
    }
}

/// Distance in pixels from a row and column to the nearest point of a cell.
fn distance_to_cell([i, j]: [usize; 2], row: f64, col: f64) -> f64 {
    let beside = |at: f64, first: f64| (first - at).max(at - first - 1.0).max(0.0);
    beside(row, i as f64).hypot(beside(col, j as f64))
}

/// Raises `best` to the highest point of the part of a triangle within `radius` of the third axis. The height is linear on the
/// triangle, so that it is largest at a corner, where an edge crosses the circle, or where the circle is highest.
fn highest_in_disk(triangle: &[[f64; 3]; 3], radius: f64, best: &mut Option<[f64; 3]>) {
    let mut raise = |point: [f64; 3]| {
        if best.is_none_or(|b| point[2] > b[2]) {
            *best = Some(point);
        }
    };
    let square = radius * radius;
    for k in 0..3 {
        let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
        if a[0] * a[0] + a[1] * a[1] <= square {
            raise(a);
        }
        let d = [0, 1, 2].map(|i| b[i] - a[i]);
        let (dd, ad) = (d[0] * d[0] + d[1] * d[1], a[0] * d[0] + a[1] * d[1]);
        // Distance of the edge's line from the axis, from the cross product: no cancellation when the edge is far longer.
        let cross = a[0] * d[1] - a[1] * d[0];
        let rest = square - cross * cross / dd;
        if dd > 0.0 && rest >= 0.0 {
            let half = (rest / dd).sqrt();
            for t in [-ad / dd - half, -ad / dd + half] {
                if (0.0..=1.0).contains(&t) {
                    raise([0, 1, 2].map(|i| a[i] + t * d[i]));
                }
            }
        }
    }
    let [a, b, c] = *triangle;
    let (p, q) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let area = p[0] * q[1] - p[1] * q[0];
    if area == 0.0 {
        return;
    }
    let slope = [(p[2] * q[1] - p[1] * q[2]) / area, (p[0] * q[2] - p[2] * q[0]) / area];
    let steep = slope[0].hypot(slope[1]);
    let top = if steep > 0.0 { slope.map(|s| radius * s / steep) } else { [0.0; 2] };
    let (u, v) = (top[0] - a[0], top[1] - a[1]);
    let (s, t) = ((u * q[1] - v * q[0]) / area, (p[0] * v - p[1] * u) / area);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        raise([top[0], top[1], a[2] + s * p[2] + t * q[2]]);
    }
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
