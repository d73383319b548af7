//! Windows of synthetic terrain and their ground truth.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Terrain;
use super::features::{self, Boulder, Crater, Feature, boulders, craters};
use super::fractal::{Fractal, mix};
use crate::{ElevationMap, Geometry, Raster, TerrainError};

/// Rows that are made together.
const BAND: usize = 32;

/// Bytes of a pixel while it is made: height, mask, and both as they are written.
const BYTES_PER_PIXEL: f64 = 24.0;

/// Bit of a mask: inside the rim of a crater.
pub const CRATER: u8 = 1;

/// Bit of a mask: on a boulder.
pub const BOULDER: u8 = 2;

/// Features that count as hazards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Least depth of a crater, from rim to floor, m.
    pub crater_depth: f64,
    /// Least height of a boulder, m.
    pub boulder_height: f64,
}

/// A synthetic terrain: what it is like and its seed.
pub struct Synthetic {
    terrain: Terrain,
    geometry: Geometry,
    fractal: Fractal,
    seed: u64,
}

impl Synthetic {
    /// The terrain of a seed. The centre of pixel (0, 0) is at the origin of map coordinates, heights are over the mean plane there.
    ///
    /// # Errors
    /// A number outside its range, or no pixels.
    pub fn new(terrain: Terrain, seed: u64) -> Result<Synthetic, TerrainError> {
        terrain.check()?;
        let geometry = Geometry::square(terrain.rows, terrain.cols, terrain.pixel)?;
        let fractal = Fractal::new(&terrain.relief, terrain.pixel, mix(seed));
        Ok(Synthetic { terrain, geometry, fractal, seed })
    }

    /// The description that the terrain was made from.
    pub fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    /// The places of the pixels of the whole map.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The whole map.
    ///
    /// # Errors
    /// A map with more craters or boulders than memory holds.
    pub fn map(&self) -> Result<ElevationMap, TerrainError> {
        self.window(0, 0, self.terrain.rows, self.terrain.cols)
    }

    /// The window of `rows` x `cols` pixels whose first pixel is (`row`, `col`): the same bits as in the whole map.
    ///
    /// # Errors
    /// A window that is empty or leaves the map, or with more craters or boulders than memory holds.
    pub fn window(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<ElevationMap, TerrainError> {
        let geometry = self.geometry.window(row, col, rows, cols)?;
        let limits = self.limits(row, col, rows, cols);
        let craters = Placed::new(self, craters(&self.terrain.craters, self.seed_of(1), limits)?, row, rows);
        let boulders =
            Placed::new(self, boulders(&self.terrain.boulders, self.seed_of(2), limits)?, row, rows);
        let (s, c) = self.terrain.upslope.sin_cos();
        let tangent = self.terrain.slope.tan();
        let mut data = vec![0.0_f32; geometry.pixels()];
        data.par_chunks_mut(BAND * cols).enumerate().for_each(|(band, out)| {
            let first = row + band * BAND;
            let mut heights: Vec<f64> = (0..out.len())
                .map(|k| {
                    let [east, north] = self.place(first + k / cols, col + k % cols);
                    tangent * (s * east + c * north) + self.fractal.at(east, north)
                })
                .collect();
            craters.stamp(self, band, [first, col], cols, &mut heights, |z, crater, offset| {
                *z += crater.height_at(offset);
            });
            // Boulders do not stand on each other: the highest counts.
            let mut rocks = vec![0.0; if boulders.bands[band].is_empty() { 0 } else { out.len() }];
            boulders.stamp(self, band, [first, col], cols, &mut rocks, |z, boulder, offset| {
                *z = boulder.height_at(offset).max(*z);
            });
            heights.iter_mut().zip(&rocks).for_each(|(z, rock)| *z += rock);
            out.iter_mut().zip(&heights).for_each(|(out, z)| *out = *z as f32);
        });
        ElevationMap::from_relative(Raster::new(geometry, data)?, 0.0)
    }

    /// Says before the work whether a window can be made.
    ///
    /// # Errors
    /// As of [`window`](Self::window).
    pub fn check(&self, row: usize, col: usize, rows: usize, cols: usize) -> Result<(), TerrainError> {
        self.geometry.window(row, col, rows, cols)?;
        features::check(&self.terrain, self.limits(row, col, rows, cols))
    }

    /// Bytes that a window takes while it is made: its features, and pixels with what is added to them.
    ///
    /// # Errors
    /// As of [`window`](Self::window).
    pub fn foreseen_memory(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<f64, TerrainError> {
        let window = self.geometry.window(row, col, rows, cols)?;
        let [craters, boulders] = features::expected(&self.terrain, self.limits(row, col, rows, cols))?;
        let sizes = [size_of::<Crater>(), size_of::<Boulder>()];
        // Lists grow by doubling.
        let features = 2.0 * (craters * sizes[0] as f64 + boulders * sizes[1] as f64);
        Ok(features + BYTES_PER_PIXEL * window.pixels() as f64)
    }

    /// Craters whose centres are in a window, in the order in which they are laid down.
    ///
    /// # Errors
    /// A window that is empty or leaves the map, or with more craters or boulders than memory holds.
    pub fn craters(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<Vec<Crater>, TerrainError> {
        self.geometry.window(row, col, rows, cols)?;
        let limits = self.limits(row, col, rows, cols);
        Ok(centred(craters(&self.terrain.craters, self.seed_of(1), limits)?, limits))
    }

    /// Boulders whose centres are in a window.
    ///
    /// # Errors
    /// A window that is empty or leaves the map, or with more craters or boulders than memory holds.
    pub fn boulders(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<Vec<Boulder>, TerrainError> {
        self.geometry.window(row, col, rows, cols)?;
        let limits = self.limits(row, col, rows, cols);
        Ok(centred(boulders(&self.terrain.boulders, self.seed_of(2), limits)?, limits))
    }

    /// The hazards of a window: [`CRATER`] inside the rim of a crater and [`BOULDER`] on a boulder that reach `least`.
    ///
    /// # Errors
    /// A window that is empty or leaves the map, or with more craters or boulders than memory holds.
    pub fn hazards(
        &self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
        least: &Limits,
    ) -> Result<Raster<u8>, TerrainError> {
        let geometry = self.geometry.window(row, col, rows, cols)?;
        let limits = self.limits(row, col, rows, cols);
        let mut deep = craters(&self.terrain.craters, self.seed_of(1), limits)?;
        deep.retain(|c| c.depth >= least.crater_depth);
        let mut high = boulders(&self.terrain.boulders, self.seed_of(2), limits)?;
        high.retain(|b| b.height >= least.boulder_height);
        let (deep, high) = (Placed::new(self, deep, row, rows), Placed::new(self, high, row, rows));
        let mut data = vec![0_u8; geometry.pixels()];
        data.par_chunks_mut(BAND * cols).enumerate().for_each(|(band, out)| {
            let first = [row + band * BAND, col];
            deep.stamp(self, band, first, cols, out, |bits, crater, offset| {
                *bits |= if crater.covers(offset) { CRATER } else { 0 };
            });
            high.stamp(self, band, first, cols, out, |bits, boulder, offset| {
                *bits |= if boulder.covers(offset) { BOULDER } else { 0 };
            });
        });
        Raster::new(geometry, data)
    }

    fn seed_of(&self, part: u64) -> u64 {
        mix(self.seed ^ mix(part << 32))
    }

    /// Map coordinates of a pixel of the whole map.
    fn place(&self, row: usize, col: usize) -> [f64; 2] {
        self.geometry.position(row as f64, col as f64)
    }

    /// West, east, south and north limits of the pixels of a window, m.
    fn limits(&self, row: usize, col: usize, rows: usize, cols: usize) -> [f64; 4] {
        let corner = |row: usize, col: usize| self.geometry.position(row as f64 - 0.5, col as f64 - 0.5);
        let ([west, north], [east, south]) = (corner(row, col), corner(row + rows, col + cols));
        [west, east, south, north]
    }
}

fn centred<F: Feature>(mut all: Vec<F>, [west, east, south, north]: [f64; 4]) -> Vec<F> {
    all.retain(|f| {
        let [x, y] = f.centre();
        x >= west && x < east && y > south && y <= north
    });
    all
}

/// Features with the bands of a window that they reach.
struct Placed<F> {
    features: Vec<F>,
    /// Indices, for each band, in the order of the features.
    bands: Vec<Vec<u32>>,
}

impl<F: Feature> Placed<F> {
    fn new(ground: &Synthetic, features: Vec<F>, row: usize, rows: usize) -> Placed<F> {
        let mut bands = vec![Vec::new(); rows.div_ceil(BAND)];
        for (k, feature) in features.iter().enumerate() {
            let Some([top, bottom]) = span(ground, feature, 1, row, rows) else { continue };
            for band in (top - row) / BAND..=(bottom - row) / BAND {
                bands[band].push(k as u32);
            }
        }
        Placed { features, bands }
    }

    /// Calls for each value of a band and feature that may reach it, with the offset (east, north) from the feature's centre.
    fn stamp<T>(
        &self,
        ground: &Synthetic,
        band: usize,
        [row, col]: [usize; 2],
        cols: usize,
        values: &mut [T],
        one: impl Fn(&mut T, &F, [f64; 2]),
    ) {
        if values.is_empty() {
            return;
        }
        for &k in &self.bands[band] {
            let feature = &self.features[k as usize];
            let Some([top, bottom]) = span(ground, feature, 1, row, values.len() / cols) else { continue };
            let Some([left, right]) = span(ground, feature, 0, col, cols) else { continue };
            let [x, y] = feature.centre();
            for r in top..=bottom {
                for c in left..=right {
                    let [east, north] = ground.place(r, c);
                    one(&mut values[(r - row) * cols + c - col], feature, [east - x, north - y]);
                }
            }
        }
    }
}

/// First and last row (`axis` 1) or column (`axis` 0) of a range that a feature may reach.
fn span(
    ground: &Synthetic,
    feature: &impl Feature,
    axis: usize,
    first: usize,
    count: usize,
) -> Option<[usize; 2]> {
    let (mut centre, reach) = (feature.centre(), feature.reach());
    let mut ends = [-reach, reach].map(|side| {
        let kept = centre[axis];
        centre[axis] += side;
        let [row, col] = ground.geometry.row_col(centre);
        centre[axis] = kept;
        if axis == 1 { row } else { col }
    });
    ends.sort_by(f64::total_cmp);
    // One pixel more, for rounding; offsets outside the feature change nothing.
    let low = (ends[0].floor() - 1.0).max(first as f64);
    let high = (ends[1].ceil() + 1.0).min((first + count - 1) as f64);
    (low <= high).then_some([low as usize, high as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Relief;

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f64 = 1e-6;

    fn bits(map: &ElevationMap) -> Vec<u32> {
        map.relative().data().iter().map(|z| z.to_bits()).collect()
    }

    #[test]
    fn windows_equal_the_whole_on_any_number_of_threads() {
        for (terrain, seed) in [(Terrain::coarse(), 1), (Terrain::fine(), 2)] {
            let ground = Synthetic::new(Terrain { rows: 210, cols: 170, ..terrain }, seed).unwrap();
            let whole = ground.map().unwrap();
            for (row, col, rows, cols) in
                [(0, 0, 10, 170), (33, 21, 97, 64), (209, 169, 1, 1), (70, 0, 64, 33)]
            {
                let part = ground.window(row, col, rows, cols).unwrap();
                assert_eq!(bits(&part), bits(&whole.window(row, col, rows, cols).unwrap()));
                let least = Limits { crater_depth: 0.1, boulder_height: 0.1 };
                let all = ground.hazards(0, 0, 210, 170, &least).unwrap();
                let few = ground.hazards(row, col, rows, cols, &least).unwrap();
                assert_eq!(few, all.window(row, col, rows, cols).unwrap());
            }
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                assert_eq!(bits(&pool.install(|| ground.map()).unwrap()), bits(&whole));
            }
            let other = Synthetic::new(Terrain { rows: 210, cols: 170, ..terrain }, seed + 1).unwrap();
            assert_ne!(bits(&other.map().unwrap()), bits(&whole));
        }
    }

    #[test]
    fn more_features_than_memory_holds_are_refused() {
        let ground =
            Synthetic::new(Terrain { rows: 20, cols: 20, pixel: 1e18, ..Terrain::coarse() }, 1).unwrap();
        let refused = |e: TerrainError| {
            let text = e.to_string();
            assert!(text.starts_with("number of craters on these pixels is "), "{text}");
            assert!(
                text.len() < 160 && text.contains("at most 2e7") && text.contains("smaller pixels"),
                "{text}"
            );
        };
        refused(ground.map().unwrap_err());
        refused(ground.check(0, 0, 1, 1).unwrap_err());
        refused(ground.craters(0, 0, 20, 20).unwrap_err());
        refused(
            ground.hazards(0, 0, 20, 20, &Limits { crater_depth: 0.1, boulder_height: 0.1 }).unwrap_err(),
        );
        assert!(ground.check(0, 0, 21, 20).is_err());
        let preset = Synthetic::new(Terrain::coarse(), 1).unwrap();
        assert!(preset.check(0, 0, 2300, 2300).is_ok());
    }

    /// A far window of a map that would not fit in memory.
    #[test]
    fn a_window_of_a_large_map() {
        let ground = Synthetic::new(Terrain { rows: 20_000, cols: 20_000, ..Terrain::coarse() }, 5).unwrap();
        let a = ground.window(19_900, 10_000, 100, 300).unwrap();
        let b = ground.window(19_900, 10_150, 100, 150).unwrap();
        assert_eq!(bits(&a.window(0, 150, 100, 150).unwrap()), bits(&b));
        assert_eq!(a.geometry().north_west(), [10_000.0, -19_900.0]);
        assert!(matches!(ground.window(19_990, 0, 20, 20), Err(TerrainError::Outside { .. })));
    }

    /// On a bare plane the difference to a map without boulders is the highest boulder, and the mask is where it stands.
    #[test]
    fn the_truth_is_what_the_map_shows() {
        let bare = Terrain {
            rows: 300,
            cols: 300,
            slope: 0.1,
            upslope: 1.0,
            relief: Relief { rms_slope: 0.0, ..Terrain::fine().relief },
            ..Terrain::fine()
        };
        let mut plain = bare;
        plain.boulders.abundance = 0.0;
        let with = Synthetic::new(bare, 9).unwrap();
        let without = Synthetic::new(plain, 9).unwrap();
        let (a, b) = (with.map().unwrap(), without.map().unwrap());
        let mask = with.hazards(0, 0, 300, 300, &Limits { crater_depth: 0.0, boulder_height: 0.0 }).unwrap();
        let boulders = with.boulders(0, 0, 300, 300).unwrap();
        assert!(boulders.len() > 20);
        for k in 0..90_000 {
            let added = f64::from(a.relative().data()[k]) - f64::from(b.relative().data()[k]);
            assert!(added > -SINGLE);
            assert!(mask.data()[k] & BOULDER != 0 || added.abs() < SINGLE);
        }
        let tallest = boulders.iter().max_by(|a, b| a.height.total_cmp(&b.height)).unwrap();
        let [row, col] = with.geometry().row_col(tallest.centre).map(|x| x.round() as usize);
        let added = a.height(row, col).unwrap() - b.height(row, col).unwrap();
        assert!(added > 0.8 * tallest.height && added <= tallest.height + 1e-5);
        // The mean plane: without craters only it is left.
        plain.craters.density = 0.0;
        let plane = Synthetic::new(plain, 9).unwrap().map().unwrap();
        let drop = plane.height(0, 0).unwrap() - plane.height(100, 0).unwrap();
        assert!((drop - 10.0 * 0.1_f64.tan() * 1.0_f64.cos()).abs() < 10.0 * SINGLE);
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let mut terrain = Terrain::fine();
        terrain.relief.hurst = 1.0;
        assert!(matches!(
            Synthetic::new(terrain, 0),
            Err(TerrainError::Number { name: "Hurst exponent", .. })
        ));
        let mut terrain = Terrain::fine();
        terrain.boulders.diameters = [1.0, f64::NAN];
        assert!(Synthetic::new(terrain, 0).is_err());
        assert!(Synthetic::new(Terrain { rows: 0, ..Terrain::fine() }, 0).is_err());
    }
}
