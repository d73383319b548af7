//! Distances of heights from the planes fitted to them.

use pulp::{Arch, Simd, WithSimd};

use super::footprint::Disk;
use super::plane::Planes;
use super::tile::Tile;

/// Largest and least residual `z - plane` (vertical, m) within a disk, for the pixels of a tile that are `active`; others are
/// left as they are where that saves time.
pub(super) fn residuals(
    tile: &Tile,
    disk: &Disk,
    planes: &Planes,
    active: &[u8],
    high: &mut Vec<f32>,
    low: &mut Vec<f32>,
) {
    high.resize(tile.size(), 0.0);
    low.resize(tile.size(), 0.0);
    Arch::new().dispatch(Residuals { tile, disk, planes, active, high, low });
}

struct Residuals<'a> {
    tile: &'a Tile,
    disk: &'a Disk,
    planes: &'a Planes,
    active: &'a [u8],
    high: &'a mut [f32],
    low: &'a mut [f32],
}

/// Vectors that are treated together.
const TOGETHER: usize = 4;

impl WithSimd for Residuals<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Residuals { tile, disk, planes, active, high, low } = self;
        let length = TOGETHER * S::F32_LANES;
        let (least, most) = (simd.splat_f32s(f32::NEG_INFINITY), simd.splat_f32s(f32::INFINITY));
        for y in 0..tile.rows {
            for x in (0..tile.width).step_by(length) {
                let at = y * tile.width + x;
                if active[at..at + length].iter().fold(0, |any, a| any | a) == 0 {
                    continue;
                }
                let mut east = [least; TOGETHER];
                east.copy_from_slice(S::as_simd_f32s(&planes.east[at..at + length]).0);
                let (mut highest, mut lowest) = ([least; TOGETHER], [most; TOGETHER]);
                for (dy, w) in disk.chords() {
                    let first = tile.offset(y, x, (dy, -(w as isize)));
                    let row = &tile.z[first..][..2 * w + length];
                    let (mut above, mut below) = ([least; TOGETHER], [most; TOGETHER]);
                    let mut dx = -(w as f32);
                    for d in 0..=2 * w {
                        let (z, _) = S::as_simd_f32s(&row[d..d + length]);
                        let dx_all = simd.splat_f32s(dx);
                        for i in 0..TOGETHER {
                            let flat = simd.sub_f32s(z[i], simd.mul_f32s(dx_all, east[i]));
                            above[i] = simd.max_f32s(above[i], flat);
                            below[i] = simd.min_f32s(below[i], flat);
                        }
                        dx += 1.0;
                    }
                    let dy = simd.splat_f32s(dy as f32);
                    let (south, _) = S::as_simd_f32s(&planes.south[at..at + length]);
                    let (mean, _) = S::as_simd_f32s(&planes.mean[at..at + length]);
                    for i in 0..TOGETHER {
                        let base = simd.add_f32s(mean[i], simd.mul_f32s(dy, south[i]));
                        highest[i] = simd.max_f32s(highest[i], simd.sub_f32s(above[i], base));
                        lowest[i] = simd.min_f32s(lowest[i], simd.sub_f32s(below[i], base));
                    }
                }
                S::as_mut_simd_f32s(&mut high[at..at + length]).0.copy_from_slice(&highest);
                S::as_mut_simd_f32s(&mut low[at..at + length]).0.copy_from_slice(&lowest);
            }
        }
    }
}

/// The largest residual normal to the plane, all in `f64` and by the definition: what decides where `f32` leaves it open.
pub(super) fn roughness_at(tile: &Tile, disk: &Disk, pixel_m: f64, y: usize, x: usize) -> f64 {
    let each = || {
        disk.chords().flat_map(|(dy, w)| {
            (-(w as isize)..=w as isize).map(move |dx| (dy as f64, dx as f64, tile.offset(y, x, (dy, dx))))
        })
    };
    let level = f64::from(tile.z[tile.index(y, x)]);
    let height = |at: usize| f64::from(tile.z[at]) - level;
    let (mut sum, mut east, mut south) = (0.0, 0.0, 0.0);
    for (dy, dx, at) in each() {
        sum += height(at);
        east += dx * height(at);
        south += dy * height(at);
    }
    let (mean, east, south) = (sum / disk.count as f64, east / disk.moment, south / disk.moment);
    let residual = |(dy, dx, at): (f64, f64, usize)| (height(at) - mean - dx * east - dy * south).abs();
    let largest = each().map(residual).fold(0.0, f64::max);
    largest / (1.0 + (east * east + south * south) / (pixel_m * pixel_m)).sqrt()
}
