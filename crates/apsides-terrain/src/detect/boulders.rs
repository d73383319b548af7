//! Boulders by their height over the ground around.

use rayon::prelude::*;

use crate::disk::{Disk, RowSums};
use crate::hazard::Watch;
use crate::{ElevationMap, TerrainError};

/// Part of the least height at which a boulder's outline is drawn.
const OUTLINE: f64 = 0.5;

/// Largest diameter, pixels.
const WIDEST: f64 = 1000.0;

/// Least area over that of the circle around it: less is a ridge.
const COMPACT: f64 = 0.3;

/// The boulders to look for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoulderSearch {
    /// Least height over the ground around, m.
    pub height: f64,
    /// Largest diameter, m; also the radius of the disk whose plane is the ground around.
    pub diameter: f64,
}

/// A boulder that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundBoulder {
    /// Mean place (east, north) of its pixels, m.
    pub centre: [f64; 2],
    /// Diameter of the circle with the area of its pixels, m: of what stands out by half of the least height.
    pub diameter: f64,
    /// Height of its top over the ground around, m.
    pub height: f64,
}

/// Boulders of a map, row by row.
///
/// Pixels that stand out of the least-squares plane over the disk around them by half of the least height are joined to pieces (eight
/// neighbours). The height of a piece is that of its top over the plane through the pixels around the piece that belong to none. Pieces
/// that are too low, too wide, or much longer than wide are no boulders. What is nearer to a gap or the edge than the radius of the
/// disk is not found, nor what is in rows that `watch` does not let pass.
///
/// # Errors
/// A height that is not positive, a diameter of less than two pixels or more than 1000, or pixels that are not square or in degrees.
pub fn boulders(
    map: &ElevationMap,
    search: &BoulderSearch,
    watch: Watch<'_>,
) -> Result<Vec<FoundBoulder>, TerrainError> {
    let pixel = map.geometry().square_pixel()?;
    for (name, value, fits, allowed) in [
        (
            "height of a boulder, m",
            search.height,
            search.height > 0.0 && search.height.is_finite(),
            "it must be positive and finite",
        ),
        (
            "diameter of a boulder, m",
            search.diameter,
            search.diameter >= 2.0 * pixel && search.diameter <= WIDEST * pixel,
            "it must be from 2 to 1000 pixels",
        ),
    ] {
        if !fits {
            return Err(TerrainError::Number { name, value, allowed: allowed.into() });
        }
    }
    let (rows, cols) = (map.geometry().rows(), map.geometry().cols());
    let heights = map.relative();
    let (disk, sums) = (Disk::new(search.diameter, pixel), RowSums::new(heights));
    let mut marks = vec![0_u8; rows * cols];
    marks.par_chunks_mut(cols).enumerate().filter(|_| watch(cols)).for_each(|(row, line)| {
        for (col, mark) in line.iter_mut().enumerate() {
            if let Some(plane) = sums.plane(&disk, row, col) {
                let over = f64::from(heights.get(row, col)) - plane.height;
                *mark = u8::from(over >= OUTLINE * search.height);
            }
        }
    });
    let mut found = Vec::new();
    let mut piece = Vec::new();
    for start in 0..marks.len() {
        if marks[start] == 1 {
            collect(&mut marks, [rows, cols], start, &mut piece);
            found.extend(judge(map, &marks, &piece, pixel, search));
        }
    }
    Ok(found)
}

/// The pixels joined to one, marked as seen.
fn collect(marks: &mut [u8], [rows, cols]: [usize; 2], start: usize, piece: &mut Vec<[usize; 2]>) {
    piece.clear();
    piece.push([start / cols, start % cols]);
    marks[start] = 2;
    let mut next = 0;
    while let Some(&[row, col]) = piece.get(next) {
        for r in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
            for c in col.saturating_sub(1)..=(col + 1).min(cols - 1) {
                if marks[r * cols + c] == 1 {
                    marks[r * cols + c] = 2;
                    piece.push([r, c]);
                }
            }
        }
        next += 1;
    }
}

/// A piece as a boulder, if it is one.
fn judge(
    map: &ElevationMap,
    marks: &[u8],
    piece: &[[usize; 2]],
    pixel: f64,
    search: &BoulderSearch,
) -> Option<FoundBoulder> {
    let (rows, cols) = (map.geometry().rows(), map.geometry().cols());
    let ends = |axis: usize| {
        piece.iter().fold([usize::MAX, 0], |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
    };
    let ([top, bottom], [left, right]) = (ends(0), ends(1));
    let extent = (bottom - top).max(right - left) + 1;
    let area = piece.len() as f64;
    let diameter = (area / std::f64::consts::FRAC_PI_4).sqrt() * pixel;
    let circle = std::f64::consts::FRAC_PI_4 * (extent * extent) as f64;
    if extent as f64 * pixel > search.diameter || area < COMPACT * circle {
        return None;
    }
    let mean = |axis: usize| piece.iter().map(|p| p[axis] as f64).sum::<f64>() / area;
    let centre = [mean(0), mean(1)];
    // The plane through the bare pixels around, by its normal equations about the centre.
    let margin = extent.max(2);
    let mut sums = [0.0; 9];
    for row in top.saturating_sub(margin)..=(bottom + margin).min(rows - 1) {
        for col in left.saturating_sub(margin)..=(right + margin).min(cols - 1) {
            let z = f64::from(map.relative().get(row, col));
            let beside = row + 1 >= top && row <= bottom + 1 && col + 1 >= left && col <= right + 1;
            if marks[row * cols + col] == 0 && !z.is_nan() && !beside {
                let (y, x) = (row as f64 - centre[0], col as f64 - centre[1]);
                let terms = [1.0, x, y, x * x, x * y, y * y, z, x * z, y * z];
                sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            }
        }
    }
    let plane = plane_of(&sums)?;
    let height = piece
        .iter()
        .map(|&[row, col]| {
            let (y, x) = (row as f64 - centre[0], col as f64 - centre[1]);
            f64::from(map.relative().get(row, col)) - plane[0] - plane[1] * x - plane[2] * y
        })
        .fold(f64::NEG_INFINITY, f64::max);
    (height >= search.height).then(|| FoundBoulder {
        centre: map.geometry().position(centre[0], centre[1]),
        diameter,
        height,
    })
}

/// Height and slopes from n, x, y, xx, xy, yy, z, xz, yz; none if the points do not span a plane.
fn plane_of(&[n, x, y, xx, xy, yy, z, xz, yz]: &[f64; 9]) -> Option<[f64; 3]> {
    if n < 3.0 {
        return None;
    }
    let (mx, my, mz) = (x / n, y / n, z / n);
    let (cxx, cxy, cyy) = (xx - x * mx, xy - x * my, yy - y * my);
    let (cxz, cyz) = (xz - x * mz, yz - y * mz);
    let determinant = cxx * cyy - cxy * cxy;
    if determinant <= 1e-9 * cxx * cyy {
        return None;
    }
    let (a, b) = ((cxz * cyy - cyz * cxy) / determinant, (cyz * cxx - cxz * cxy) / determinant);
    Some([mz - a * mx - b * my, a, b])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;
    use crate::synthetic::{Synthetic, Terrain};

    /// Single precision of the heights, m.
    const SINGLE: f64 = 1e-6;

    /// Published: the digits of the diameter of the circle with the area of the block, m.
    const DIAMETER_M: f64 = 1e-3;

    /// Round-off of positions, m.
    const ROUNDING: f64 = 1e-9;

    /// Boulders of 0.3 m and more on ground with craters: what is found, and whether it is a boulder.
    #[test]
    fn recall_and_precision_on_synthetic_ground() {
        let (mut sought, mut hit, mut found_count, mut right, mut error) = (0, 0, 0, 0, 0.0_f64);
        for seed in 1..=3 {
            let mut terrain = Terrain { rows: 700, cols: 700, ..Terrain::fine() };
            terrain.boulders.abundance = 0.06;
            let ground = Synthetic::new(terrain, seed).unwrap();
            let truth = ground.boulders(0, 0, 700, 700).unwrap();
            let found =
                boulders(&ground.map().unwrap(), &BoulderSearch { height: 0.2, diameter: 2.0 }, &|_| true)
                    .unwrap();
            let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            for boulder in truth.iter().filter(|b| {
                let inside = |x: f64| (2.5..67.4).contains(&x);
                b.height >= 0.3 && b.axes[0] < 1.5 && inside(b.centre[0]) && inside(-b.centre[1])
            }) {
                sought += 1;
                let same = found.iter().find(|f| near(f.centre, boulder.centre) < 0.5 * boulder.axes[0]);
                if let Some(same) = same {
                    hit += 1;
                    error += (same.height - boulder.height) / boulder.height;
                }
            }
            found_count += found.len();
            right += found
                .iter()
                .filter(|f| {
                    truth.iter().any(|b| b.height > 0.1 && near(f.centre, b.centre) < 0.5 * b.axes[0])
                })
                .count();
        }
        let (recall, precision) = (hit as f64 / sought as f64, right as f64 / found_count as f64);
        let bias = error / hit as f64;
        println!(
            "boulders: recall {recall:.3} of {sought}, precision {precision:.3} of {found_count}, height {bias:+.3}"
        );
        assert!(sought > 40 && recall > 0.85 && precision > 0.85, "{recall} {precision}");
        assert!(bias.abs() < 0.15, "{bias}");
    }

    #[test]
    fn a_block_on_a_slope_has_its_height_and_size() {
        let heights: Vec<f64> = (0..3600)
            .map(|k| {
                let (row, col) = (k / 60, k % 60);
                let block = (28..32).contains(&row) && (30..34).contains(&col);
                0.02 * f64::from(col) + if block { 0.5 } else { 0.0 }
            })
            .collect();
        let map = ElevationMap::from_heights(Geometry::square(60, 60, 0.1).unwrap(), &heights).unwrap();
        let search = BoulderSearch { height: 0.3, diameter: 1.0 };
        let found = boulders(&map, &search, &|_| true).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0].height - 0.5).abs() < SINGLE, "{:?}", found[0]);
        assert!((found[0].diameter - 0.4514).abs() < DIAMETER_M);
        assert!((found[0].centre[0] - 3.15).abs() < ROUNDING && (found[0].centre[1] + 2.95).abs() < ROUNDING);
        assert!(boulders(&map, &BoulderSearch { height: 0.6, ..search }, &|_| true).unwrap().is_empty());
        // Disks without measure take more memory than there is.
        for diameter in [1e9, 1e300, f64::INFINITY] {
            assert!(boulders(&map, &BoulderSearch { diameter, ..search }, &|_| true).is_err(), "{diameter}");
        }
        assert!(boulders(&map, &BoulderSearch { diameter: 0.1, ..search }, &|_| true).is_err());
        assert!(boulders(&map, &BoulderSearch { height: 0.0, ..search }, &|_| true).is_err());
    }
}
