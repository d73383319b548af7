//! Least-squares planes over a disk, by running sums.

use pulp::{Arch, Simd, WithSimd};

use super::footprint::Disk;
use super::tile::Tile;

/// Planes of a tile: `z = mean + east * columns + south * rows` around each pixel, m.
#[derive(Debug, Default)]
pub(super) struct Planes {
    pub(super) mean: Vec<f32>,
    pub(super) east: Vec<f32>,
    pub(super) south: Vec<f32>,
    /// Tangent of the slope.
    pub(super) tangent: Vec<f32>,
    /// Root mean square residual normal to the plane, m; empty unless asked for.
    pub(super) rms: Vec<f32>,
    sums: [Vec<f64>; 3],
}

impl Planes {
    /// Fits all planes of a tile.
    pub(super) fn fit(&mut self, tile: &Tile, disk: &Disk, pixel_m: f64, rms: bool) {
        for layer in [&mut self.mean, &mut self.east, &mut self.south, &mut self.tangent] {
            layer.resize(tile.size(), 0.0);
        }
        self.rms.clear();
        self.rms.resize(if rms { tile.size() } else { 0 }, 0.0);
        self.add_up(tile, rms);
        let fit = Fit { tile, disk, pixel_m, planes: self };
        if rms { Arch::new().dispatch(WithRms(fit)) } else { Arch::new().dispatch(WithoutRms(fit)) }
    }

    /// Sums of `z`, `x z` and `z^2` along each row, up to each column and without it.
    fn add_up(&mut self, tile: &Tile, squares: bool) {
        let size = (tile.stride + 1) * tile.height();
        let [s, sx, ss] = &mut self.sums;
        s.resize(size, 0.0);
        sx.resize(size, 0.0);
        let level = f64::from(tile.level);
        for (y, row) in tile.z.chunks_exact(tile.stride).enumerate() {
            let at = y * (tile.stride + 1);
            let (s, sx) = (&mut s[at..][..row.len() + 1], &mut sx[at..][..row.len() + 1]);
            let (mut sum, mut moment) = (0.0, 0.0);
            for (x, &z) in row.iter().enumerate() {
                s[x] = sum;
                sx[x] = moment;
                let z = f64::from(z) - level;
                sum += z;
                moment += x as f64 * z;
            }
            s[row.len()] = sum;
            sx[row.len()] = moment;
        }
        if squares {
            ss.resize(size, 0.0);
            for (row, ss) in tile.z.chunks_exact(tile.stride).zip(ss.chunks_exact_mut(tile.stride + 1)) {
                let mut sum = 0.0;
                for (&z, ss) in row.iter().zip(ss.iter_mut()) {
                    *ss = sum;
                    sum += (f64::from(z) - level).powi(2);
                }
                ss[row.len()] = sum;
            }
        }
    }
}

struct Fit<'a> {
    tile: &'a Tile,
    disk: &'a Disk,
    pixel_m: f64,
    planes: &'a mut Planes,
}

struct WithRms<'a>(Fit<'a>);

impl WithSimd for WithRms<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.run::<S, true>(simd);
    }
}

struct WithoutRms<'a>(Fit<'a>);

impl WithSimd for WithoutRms<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.run::<S, false>(simd);
    }
}

/// Vectors that are treated together.
const TOGETHER: usize = 2;
/// At most so many pixels are treated together.
const MOST: usize = 16;

impl Fit<'_> {
    #[inline(always)]
    fn run<S: Simd, const RMS: bool>(self, simd: S) {
        let Fit { tile, disk, pixel_m, planes } = self;
        let [s, sx, ss] = &planes.sums;
        let length = TOGETHER * S::F64_LANES;
        let zero = [simd.splat_f64s(0.0); TOGETHER];
        let moment = disk.moment;
        let (over_count, over_moment, over_pixel) = (1.0 / disk.count as f64, 1.0 / moment, 1.0 / pixel_m);
        let level = f64::from(tile.level);
        for y in 0..tile.rows {
            for x in (0..tile.width).step_by(length) {
                let (mut sum, mut along, mut across, mut square) = (zero, zero, zero, zero);
                for (k, &w) in disk.half.iter().enumerate() {
                    let row = y + tile.halo + k - disk.reach;
                    let first = row * (tile.stride + 1) + x + tile.halo - w;
                    let chord = |of: &[f64], i: usize| {
                        let (from, _) = S::as_simd_f64s(&of[first..][..length]);
                        let (to, _) = S::as_simd_f64s(&of[first + 2 * w + 1..][..length]);
                        simd.sub_f64s(to[i], from[i])
                    };
                    let dy = simd.splat_f64s(k as f64 - disk.reach as f64);
                    for i in 0..TOGETHER {
                        let chord_sum = chord(s, i);
                        sum[i] = simd.add_f64s(sum[i], chord_sum);
                        along[i] = simd.add_f64s(along[i], chord(sx, i));
                        across[i] = simd.add_f64s(across[i], simd.mul_f64s(dy, chord_sum));
                        if RMS {
                            square[i] = simd.add_f64s(square[i], chord(ss, i));
                        }
                    }
                }
                let mut totals = [[0.0; MOST]; 4];
                for (totals, sums) in totals.iter_mut().zip([sum, along, across, square]) {
                    let (totals, _) = S::as_mut_simd_f64s(&mut totals[..length]);
                    totals.copy_from_slice(&sums);
                }
                let at = y * tile.width + x;
                let mean = &mut planes.mean[at..at + length];
                let east = &mut planes.east[at..at + length];
                let south = &mut planes.south[at..at + length];
                let tangent = &mut planes.tangent[at..at + length];
                let first = (x + tile.halo) as f64;
                let [sum, along, across, square] = &totals;
                for i in 0..length {
                    let e = (along[i] - (first + i as f64) * sum[i]) * over_moment;
                    let s = across[i] * over_moment;
                    mean[i] = (sum[i] * over_count + level) as f32;
                    east[i] = e as f32;
                    south[i] = s as f32;
                    tangent[i] = ((e * e + s * s).sqrt() * over_pixel) as f32;
                    if RMS {
                        let bend = e * e + s * s;
                        let rest = square[i] - sum[i] * sum[i] * over_count - moment * bend;
                        let normal = 1.0 + bend * over_pixel * over_pixel;
                        planes.rms[at + i] = (rest.max(0.0) * over_count / normal).sqrt() as f32;
                    }
                }
            }
        }
    }
}
