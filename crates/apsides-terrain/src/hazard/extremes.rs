//! Largest values within a disk, exactly.

use pulp::{Arch, Simd, WithSimd};

use crate::disk::Disk;

/// For a block of rows of `stride` values: the largest value within a disk around each, for the rows and columns that are at least
/// `disk.reach` inside; the others are minus infinity. `work` becomes as long as `values`.
pub(super) fn largest_within(
    values: &[f32],
    stride: usize,
    disk: &Disk,
    work: &mut Vec<f32>,
    out: &mut Vec<f32>,
) {
    work.clear();
    work.extend_from_slice(values);
    out.clear();
    out.resize(values.len(), f32::NEG_INFINITY);
    Arch::new().dispatch(LargestHeights { stride, disk, work, out });
}

struct LargestHeights<'a> {
    stride: usize,
    disk: &'a Disk,
    work: &'a mut [f32],
    out: &'a mut [f32],
}

impl WithSimd for LargestHeights<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let LargestHeights { stride, disk, work, out } = self;
        let rows = work.len() / stride;
        let reach = disk.reach;
        if rows <= 2 * reach || stride <= 2 * reach {
            return;
        }
        let cols = stride - 2 * reach;
        // `work[x]` is the largest of the `span` values from x on.
        let mut span = 1;
        for half in 0..=reach {
            let chord = 2 * half + 1;
            if disk.half.iter().all(|&w| w != half) {
                continue;
            }
            while 2 * span <= chord {
                for row in work.chunks_exact_mut(stride) {
                    for x in 0..stride - span {
                        row[x] = larger(row[x], row[x + span]);
                    }
                }
                span *= 2;
            }
            for (dy, _) in disk.half.iter().enumerate().filter(|(_, w)| **w == half) {
                for y in reach..rows - reach {
                    let from = &work[(y + dy - reach) * stride..][..stride];
                    let first = &from[reach - half..][..cols];
                    let last = &from[reach + half + 1 - span..][..cols];
                    let to = &mut out[y * stride + reach..][..cols];
                    for ((to, &a), &b) in to.iter_mut().zip(first).zip(last) {
                        *to = larger(*to, larger(a, b));
                    }
                }
            }
        }
    }
}

/// The larger one of two numbers that are not NaN, in one instruction.
#[inline(always)]
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller one of two numbers that are not NaN, in one instruction.
#[inline(always)]
pub(super) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_of_the_disk_counts() {
        let (rows, stride) = (31, 37);
        let values: Vec<f32> = (0..rows * stride).map(|k| ((k * 7919) % 1013) as f32).collect();
        for radius in [0.0, 1.0, 1.5, 2.5, 5.0, 7.3] {
            let disk = Disk::new(radius, 1.0);
            let (mut work, mut out) = (Vec::new(), Vec::new());
            largest_within(&values, stride, &disk, &mut work, &mut out);
            let r = disk.reach as isize;
            for y in r..rows as isize - r {
                for x in r..stride as isize - r {
                    let mut best = f32::NEG_INFINITY;
                    for dy in -r..=r {
                        for dx in -r..=r {
                            if ((dy * dy + dx * dx) as f64) <= radius * radius {
                                best = best.max(values[(y + dy) as usize * stride + (x + dx) as usize]);
                            }
                        }
                    }
                    assert_eq!(out[y as usize * stride + x as usize], best, "{radius} {y} {x}");
                }
            }
        }
    }
}
