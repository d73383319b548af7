//! The lander on its four footpads, over all headings.

use pulp::{Arch, Simd, WithSimd};

use super::footprint::{Footpads, Tap};
use super::tile::Tile;

/// Squares of the tangents of the contact slope over all headings, and how low the lander can stand.
#[derive(Debug, Default)]
pub(super) struct Stance {
    /// Largest.
    pub(super) most: Vec<f32>,
    /// Least.
    pub(super) least: Vec<f32>,
    /// Least mean height of the higher diagonal, m.
    pub(super) seat: Vec<f32>,
}

impl Stance {
    /// All headings on a tile whose heights under footpads are `top`, for the pixels that are `active`. `least` and `seat` are made
    /// if `all`.
    pub(super) fn stand(&mut self, tile: &Tile, top: &[f32], pads: &Footpads, active: &[u8], all: bool) {
        self.most.resize(tile.size(), 0.0);
        let rest = if all { tile.size() } else { 0 };
        self.least.resize(rest, 0.0);
        self.seat.resize(rest, 0.0);
        let stand = Stand { tile, top, pads, active, stance: self };
        if all { Arch::new().dispatch(Everything(stand)) } else { Arch::new().dispatch(LargestTilt(stand)) }
    }
}

struct Stand<'a> {
    tile: &'a Tile,
    top: &'a [f32],
    pads: &'a Footpads,
    active: &'a [u8],
    stance: &'a mut Stance,
}

struct Everything<'a>(Stand<'a>);

impl WithSimd for Everything<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.run::<S, true>(simd);
    }
}

struct LargestTilt<'a>(Stand<'a>);

impl WithSimd for LargestTilt<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.0.run::<S, false>(simd);
    }
}

/// Vectors that are treated together.
const TOGETHER: usize = 2;

impl Stand<'_> {
    #[inline(always)]
    fn run<S: Simd, const ALL: bool>(self, simd: S) {
        let Stand { tile, top, pads, active, stance } = self;
        let headings: Vec<[Corner; 4]> =
            pads.headings.iter().map(|heading| heading.map(|tap| Corner::new(tile, tap))).collect();
        let length = TOGETHER * S::F32_LANES;
        let infinite = simd.splat_f32s(f32::INFINITY);
        let quarter = (0.25 / (pads.circle_m * pads.circle_m)) as f32;
        let (quarter, half) = (simd.splat_f32s(quarter), simd.splat_f32s(0.5));
        for y in 0..tile.rows {
            for x in (0..tile.width).step_by(length) {
                let at = y * tile.width + x;
                if active[at..at + length].iter().fold(0, |any, a| any | a) == 0 {
                    continue;
                }
                let mut most = [simd.splat_f32s(0.0); TOGETHER];
                let (mut least, mut seat) = ([infinite; TOGETHER], [infinite; TOGETHER]);
                let centre = tile.index(y, x);
                for [c0, c1, c2, c3] in &headings {
                    // One by one: a closure would not have the vector instructions of this function.
                    let p = [
                        sample(simd, top, centre, c0),
                        sample(simd, top, centre, c1),
                        sample(simd, top, centre, c2),
                        sample(simd, top, centre, c3),
                    ];
                    for i in 0..TOGETHER {
                        let [p0, p1, p2, p3] = [p[0][i], p[1][i], p[2][i], p[3][i]];
                        let (one, other) = (simd.sub_f32s(p0, p2), simd.sub_f32s(p1, p3));
                        let (first, second) = (simd.add_f32s(p0, p2), simd.add_f32s(p1, p3));
                        // With the differences d along the diagonals and e between their sums, the square of the tangent is
                        // (d1^2 + (|d2| + |e|)^2) / 4 rho^2 if diagonal 1 is the higher.
                        let lead = simd.sub_f32s(first, second);
                        let lower = simd.greater_than_or_equal_f32s(lead, simd.splat_f32s(0.0));
                        let lower = simd.abs_f32s(simd.select_f32s(lower, other, one));
                        let squares = simd.add_f32s(simd.mul_f32s(one, one), simd.mul_f32s(other, other));
                        let lead = simd.abs_f32s(lead);
                        let mixed = simd.mul_f32s(lead, simd.add_f32s(lead, simd.add_f32s(lower, lower)));
                        let tilt = simd.add_f32s(squares, mixed);
                        most[i] = simd.max_f32s(most[i], tilt);
                        if ALL {
                            least[i] = simd.min_f32s(least[i], tilt);
                            seat[i] = simd.min_f32s(seat[i], simd.max_f32s(first, second));
                        }
                    }
                }
                let (to, _) = S::as_mut_simd_f32s(&mut stance.most[at..at + length]);
                for i in 0..TOGETHER {
                    to[i] = simd.mul_f32s(most[i], quarter);
                }
                if ALL {
                    let (to, _) = S::as_mut_simd_f32s(&mut stance.least[at..at + length]);
                    for i in 0..TOGETHER {
                        to[i] = simd.mul_f32s(least[i], quarter);
                    }
                    let (to, _) = S::as_mut_simd_f32s(&mut stance.seat[at..at + length]);
                    for i in 0..TOGETHER {
                        to[i] = simd.mul_f32s(seat[i], half);
                    }
                }
            }
        }
    }
}

/// A tap in the memory of a tile.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Places from the centre to the pixel to the north west.
    offset: isize,
    stride: usize,
    south: f32,
    east: f32,
}

impl Corner {
    fn new(tile: &Tile, tap: Tap) -> Corner {
        let stride = tile.stride;
        let offset = tap.row * stride as isize + tap.col;
        Corner { offset, stride, south: tap.south as f32, east: tap.east as f32 }
    }
}

/// Bilinear heights at one offset from pixels in a row.
#[inline(always)]
fn sample<S: Simd>(simd: S, top: &[f32], centre: usize, corner: &Corner) -> [S::f32s; TOGETHER] {
    let length = TOGETHER * S::F32_LANES;
    let first = centre.wrapping_add_signed(corner.offset);
    let north = &top[first..][..length + 1];
    let south = &top[first + corner.stride..][..length + 1];
    let (north_west, north_east) = (S::as_simd_f32s(&north[..length]).0, S::as_simd_f32s(&north[1..]).0);
    let (south_west, south_east) = (S::as_simd_f32s(&south[..length]).0, S::as_simd_f32s(&south[1..]).0);
    let (east_part, south_part) = (simd.splat_f32s(corner.east), simd.splat_f32s(corner.south));
    let mut out = [south_part; TOGETHER];
    for i in 0..TOGETHER {
        let rise = simd.mul_f32s(east_part, simd.sub_f32s(north_east[i], north_west[i]));
        let above = simd.add_f32s(north_west[i], rise);
        let rise = simd.mul_f32s(east_part, simd.sub_f32s(south_east[i], south_west[i]));
        let below = simd.add_f32s(south_west[i], rise);
        out[i] = simd.add_f32s(above, simd.mul_f32s(south_part, simd.sub_f32s(below, above)));
    }
    out
}

/// The largest contact slope over all headings, rad, all in `f64` and by the definition: what decides where `f32` leaves it open.
pub(super) fn contact_slope_at(tile: &Tile, top: &[f32], pads: &Footpads, y: usize, x: usize) -> f64 {
    let level = f64::from(top[tile.index(y, x)]);
    let height = |tap: &Tap| {
        let pixel = |row, col| f64::from(top[tile.offset(y, x, (tap.row + row, tap.col + col))]) - level;
        let along = |row| (1.0 - tap.east) * pixel(row, 0) + tap.east * pixel(row, 1);
        (1.0 - tap.south) * along(0) + tap.south * along(1)
    };
    let mut most: f64 = 0.0;
    for heading in &pads.headings {
        let p = [0, 1, 2, 3].map(|k| height(&heading[k]));
        let (first, second) = (0.5 * (p[0] + p[2]), 0.5 * (p[1] + p[3]));
        let (i, j, mean) = if first >= second { (0, 1, first) } else { (1, 0, second) };
        let along = 0.5 * (p[i] - p[i + 2]);
        let across = (p[j] - mean).abs().max((p[j + 2] - mean).abs());
        most = most.max(along * along + across * across);
    }
    (most.sqrt() / pads.circle_m).atan()
}
