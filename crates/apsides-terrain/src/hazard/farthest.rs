//! The height of a disk that is farthest from the plane fitted to it, without looking at all of them.

use pulp::{Arch, Simd, WithSimd};

use super::extremes::{larger, smaller};
use super::plane::Planes;
use super::tile::Tile;
use crate::disk::Disk;

/// Side of the blocks whose extremes are known.
const SIDE: usize = 8;

/// Disks of less reach have too few blocks.
pub(super) const LEAST_REACH: usize = 12;

/// Roundings of `f32` that bounds may be off by, in units of the largest height.
const ROUNDINGS: f32 = 8.0;

/// A square of pixels that overlaps a disk.
#[derive(Debug)]
struct Block {
    /// Offset of its first pixel.
    row: isize,
    col: isize,
    /// Says whether all of it is in the disk.
    whole: bool,
    /// Rows with the first column and the number of pixels in the disk.
    rows: Vec<(isize, isize, usize)>,
}

/// Blocks of a disk.
fn blocks(disk: &Disk) -> Vec<Block> {
    let reach = disk.reach as isize;
    let side = SIDE as isize;
    let last = reach + 1 - side;
    let starts = || (-reach..=reach).step_by(SIDE).map(move |start| start.min(last));
    let cut = |row: isize, col: isize| {
        let rows: Vec<_> = disk
            .chords()
            .filter(|(dy, _)| (row..row + side).contains(dy))
            .map(|(dy, w)| (dy, col.max(-(w as isize)), (col + side - 1).min(w as isize)))
            .filter(|(_, first, last)| first <= last)
            .map(|(dy, first, last)| (dy, first, (last - first + 1) as usize))
            .collect();
        let whole = rows.iter().map(|(_, _, count)| count).sum::<usize>() == SIDE * SIDE;
        Block { row, col, whole, rows }
    };
    let all = starts().flat_map(|row| starts().map(move |col| (row, col)));
    all.map(|(row, col)| cut(row, col)).filter(|block| !block.rows.is_empty()).collect()
}

/// Memory for the extremes of blocks.
#[derive(Debug, Default)]
pub(super) struct Extremes {
    high: Vec<f32>,
    low: Vec<f32>,
    work: Vec<f32>,
    bounds: Vec<f32>,
}

impl Extremes {
    /// Largest absolute residual `z - plane` (vertical, m) within a disk of at least [`LEAST_REACH`], for the active pixels of a tile:
    /// the same numbers as by looking at all heights. The extremes of a block bound its residuals, so that only blocks whose bound is
    /// beyond what is found already are looked at.
    pub(super) fn farthest(
        &mut self,
        tile: &Tile,
        disk: &Disk,
        planes: &Planes,
        active: &[u8],
        out: &mut Vec<f32>,
    ) {
        out.resize(tile.size(), 0.0);
        self.high.clone_from(&tile.z);
        self.low.clone_from(&tile.z);
        self.work.clone_from(&tile.z);
        let blocks = blocks(disk);
        Arch::new().dispatch(Farthest { tile, blocks: &blocks, planes, active, extremes: self, out });
    }
}

struct Farthest<'a> {
    tile: &'a Tile,
    blocks: &'a [Block],
    planes: &'a Planes,
    active: &'a [u8],
    extremes: &'a mut Extremes,
    out: &'a mut [f32],
}

/// Vectors that are treated together.
const TOGETHER: usize = 2;

impl WithSimd for Farthest<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Farthest { tile, blocks, planes, active, extremes, out } = self;
        let Extremes { high, low, work, bounds } = extremes;
        let mut span = 1;
        while span < SIDE {
            for step in [span, span * tile.stride] {
                // Into another buffer: in place, compilers make no vectors of it.
                let rest = high.len() - step;
                for ((to, a), b) in work.iter_mut().zip(&high[..rest]).zip(&high[step..]) {
                    *to = larger(*a, *b);
                }
                std::mem::swap(high, work);
                for ((to, a), b) in work.iter_mut().zip(&low[..rest]).zip(&low[step..]) {
                    *to = smaller(*a, *b);
                }
                std::mem::swap(low, work);
            }
            span *= 2;
        }
        let length = TOGETHER * S::F32_LANES;
        bounds.resize(blocks.len() * length, 0.0);
        let middle = (SIDE - 1) as f32 / 2.0;
        let (least, most) = (simd.splat_f32s(f32::NEG_INFINITY), simd.splat_f32s(f32::INFINITY));
        let slack = simd.splat_f32s(ROUNDINGS * f32::EPSILON * tile.largest);
        for y in 0..tile.rows {
            for x in (0..tile.width).step_by(length) {
                let at = y * tile.width + x;
                if active[at..at + length].iter().fold(0, |any, a| any | a) == 0 {
                    continue;
                }
                let (east, _) = S::as_simd_f32s(&planes.east[at..at + length]);
                let (south, _) = S::as_simd_f32s(&planes.south[at..at + length]);
                let (mean, _) = S::as_simd_f32s(&planes.mean[at..at + length]);
                let mut best = [simd.splat_f32s(0.0); TOGETHER];
                let mut spread = [slack; TOGETHER];
                for i in 0..TOGETHER {
                    let steep = simd.add_f32s(simd.abs_f32s(east[i]), simd.abs_f32s(south[i]));
                    spread[i] = simd.add_f32s(slack, simd.mul_f32s(simd.splat_f32s(middle), steep));
                }
                for (block, bounds) in blocks.iter().zip(bounds.chunks_exact_mut(length)) {
                    let first = tile.offset(y, x, (block.row, block.col));
                    let (high, _) = S::as_simd_f32s(&high[first..first + length]);
                    let (low, _) = S::as_simd_f32s(&low[first..first + length]);
                    let (bounds, _) = S::as_mut_simd_f32s(bounds);
                    let dx = simd.splat_f32s(block.col as f32 + middle);
                    let dy = simd.splat_f32s(block.row as f32 + middle);
                    for i in 0..TOGETHER {
                        let rise = simd.add_f32s(simd.mul_f32s(dx, east[i]), simd.mul_f32s(dy, south[i]));
                        let base = simd.add_f32s(mean[i], rise);
                        let far = simd.max_f32s(simd.sub_f32s(high[i], base), simd.sub_f32s(base, low[i]));
                        bounds[i] = simd.add_f32s(far, spread[i]);
                        if block.whole {
                            best[i] = simd.max_f32s(best[i], simd.sub_f32s(far, spread[i]));
                        }
                    }
                }
                for (block, bounds) in blocks.iter().zip(bounds.chunks_exact(length)) {
                    let (bounds, _) = S::as_simd_f32s(bounds);
                    let mut beyond = least;
                    for i in 0..TOGETHER {
                        beyond = simd.max_f32s(beyond, simd.sub_f32s(bounds[i], best[i]));
                    }
                    if simd.reduce_max_f32s(beyond) <= 0.0 {
                        continue;
                    }
                    for &(dy, dx, count) in &block.rows {
                        let first = tile.offset(y, x, (dy, dx));
                        let row = &tile.z[first..][..count - 1 + length];
                        let (mut above, mut below) = ([least; TOGETHER], [most; TOGETHER]);
                        let mut dx = dx as f32;
                        for d in 0..count {
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
                        for i in 0..TOGETHER {
                            let base = simd.add_f32s(mean[i], simd.mul_f32s(dy, south[i]));
                            let far =
                                simd.max_f32s(simd.sub_f32s(above[i], base), simd.sub_f32s(base, below[i]));
                            best[i] = simd.max_f32s(best[i], far);
                        }
                    }
                }
                S::as_mut_simd_f32s(&mut out[at..at + length]).0.copy_from_slice(&best);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::residual::residuals;
    use super::super::tile::Rows;
    use super::*;

    #[test]
    fn nothing_is_overlooked() {
        let (rows, cols) = (120, 150);
        let mut state = 1_u64;
        let data: Vec<f32> = (0..rows * cols)
            .map(|k| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let noise = (state >> 40) as f32 / (1 << 24) as f32;
                let (row, col) = ((k / cols) as f32, (k % cols) as f32);
                let rock = if noise > 0.999 { 3.0 } else { 0.0 };
                10.0 + 0.1 * row - 0.3 * col + (0.1 * row).sin() * (0.07 * col).cos() + 0.05 * noise + rock
            })
            .collect();
        for radius in [12.0, 17.3, 25.0] {
            let disk = Disk::new(radius, 1.0);
            let mut tile = Tile::default();
            tile.load(&Rows { data: &data, first: 0, map: [rows, cols] }, [0, 0], rows, disk.reach);
            let mut planes = Planes::default();
            planes.fit(&tile, &disk, 1.0, false);
            let active = vec![1; tile.size()];
            let (mut high, mut low, mut far) = (Vec::new(), Vec::new(), Vec::new());
            residuals(&tile, &disk, &planes, &active, &mut high, &mut low);
            Extremes::default().farthest(&tile, &disk, &planes, &active, &mut far);
            for k in 0..tile.size() {
                assert_eq!(far[k], high[k].max(-low[k]), "{radius} {k}");
            }
        }
    }
}
