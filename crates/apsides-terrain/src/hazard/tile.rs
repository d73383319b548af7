//! A piece of the map with a margin, small enough for the cache.

/// Rows and columns of a tile. Tiles lie on a fixed grid of the map, so that results do not depend on how it is cut into bands.
pub(super) const TILE_ROWS: usize = 64;
pub(super) const TILE_COLS: usize = 256;
/// Widths are padded to a multiple of this, so that vectors leave no rest.
const GROUP: usize = 32;

/// Full rows of the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<'a> {
    /// Heights; NaN is a gap.
    pub(super) data: &'a [f32],
    /// Row of the map of the first height.
    pub(super) first: usize,
    /// Rows and columns of the map.
    pub(super) map: [usize; 2],
}

impl Rows<'_> {
    fn row(&self, row: usize) -> &[f32] {
        let cols = self.map[1];
        &self.data[(row - self.first) * cols..][..cols]
    }
}

/// Heights of a tile and its margin.
#[derive(Debug, Default)]
pub(super) struct Tile {
    /// First row and column in the map.
    pub(super) at: [usize; 2],
    pub(super) rows: usize,
    pub(super) cols: usize,
    /// Columns with padding.
    pub(super) width: usize,
    pub(super) halo: usize,
    /// Values from one row of `z` to the next.
    pub(super) stride: usize,
    /// Heights, halo included; 0 in gaps and outside the map.
    pub(super) z: Vec<f32>,
    /// 1 in gaps, empty if there are none.
    pub(super) gap: Vec<f32>,
    /// A height in the tile, near which the others are.
    pub(super) level: f32,
    /// Largest absolute height.
    pub(super) largest: f32,
    map: [usize; 2],
}

impl Tile {
    /// Takes the tile whose first pixel is `at` from rows that contain it and its margin, as far as they are inside the map.
    pub(super) fn load(&mut self, source: &Rows, at: [usize; 2], end_row: usize, halo: usize) {
        self.at = at;
        self.map = source.map;
        self.rows = TILE_ROWS.min(end_row - at[0]);
        self.cols = TILE_COLS.min(source.map[1] - at[1]);
        self.width = self.cols.next_multiple_of(GROUP);
        self.halo = halo;
        self.stride = self.width + 2 * halo;
        let size = self.stride * (self.rows + 2 * halo);
        self.z.clear();
        self.z.resize(size, 0.0);
        self.gap.clear();
        let (first, last) = (at[0].saturating_sub(halo), (at[0] + self.rows + halo).min(source.map[0]));
        let (west, east) = (at[1].saturating_sub(halo), (at[1] + self.width + halo).min(source.map[1]));
        for row in first..last {
            let to = self.place(row, west);
            self.z[to..to + east - west].copy_from_slice(&source.row(row)[west..east]);
        }
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut gaps = false;
        for &z in &self.z {
            gaps |= z.is_nan();
            low = if z < low { z } else { low };
            high = if z > high { z } else { high };
        }
        if gaps {
            self.gap.extend(self.z.iter().map(|z| f32::from(u8::from(z.is_nan()))));
            self.z.iter_mut().filter(|z| z.is_nan()).for_each(|z| *z = 0.0);
        }
        self.largest = if low <= high { high.max(-low) } else { 0.0 };
        self.level = self.z[self.index(self.rows / 2, self.cols / 2)];
    }

    /// Place in `z` of a pixel of the map within tile and margin.
    fn place(&self, row: usize, col: usize) -> usize {
        (row + self.halo - self.at[0]) * self.stride + col + self.halo - self.at[1]
    }

    /// Place in `z` of a pixel of the tile.
    pub(super) fn index(&self, row: usize, col: usize) -> usize {
        (row + self.halo) * self.stride + col + self.halo
    }

    /// Place in `z` of the pixel at an offset, which is within the margin.
    pub(super) fn offset(&self, row: usize, col: usize, offset: (isize, isize)) -> usize {
        let row = (row + self.halo) as isize + offset.0;
        let col = (col + self.halo) as isize + offset.1;
        row as usize * self.stride + col as usize
    }

    /// Rows with margin.
    pub(super) fn height(&self) -> usize {
        self.rows + 2 * self.halo
    }

    /// Pixels of results, padding included.
    pub(super) fn size(&self) -> usize {
        self.rows * self.width
    }

    /// Sets what is outside the map.
    pub(super) fn set_outside(&self, values: &mut [f32], to: f32) {
        let inside =
            |k: usize, first: usize, all: usize| k + first >= self.halo && k + first - self.halo < all;
        for (row, values) in values.chunks_mut(self.stride).enumerate() {
            if !inside(row, self.at[0], self.map[0]) {
                values.fill(to);
                continue;
            }
            let west = self.halo.saturating_sub(self.at[1]);
            let east = (self.map[1] + self.halo - self.at[1]).min(self.stride);
            values[..west].fill(to);
            values[east..].fill(to);
        }
    }

    /// 1 for the pixels of the tile that are at least `reach` pixels inside the map, else 0.
    pub(super) fn inside(&self, reach: usize, known: &mut Vec<u8>) {
        known.clear();
        known.resize(self.size(), 0);
        let within = |k: usize, all: usize| k >= reach && k + reach < all;
        for row in (0..self.rows).filter(|r| within(self.at[0] + r, self.map[0])) {
            let first = reach.saturating_sub(self.at[1]).min(self.cols);
            let last = self.map[1].saturating_sub(reach + self.at[1]).min(self.cols).max(first);
            known[row * self.width..][first..last].fill(1);
        }
    }
}
