//! Hazards and sites of a map that is larger than memory.
//!
//! [`hazard_bands`] makes the layers in bands of rows; candidates are kept as one bit a pixel, and sites are those of
//! [`SiteRule::Spiral`](crate::site::SiteRule::Spiral).

use std::io::{Read, Seek};

use crate::hazard::{
    Counts, HazardBand, HazardOptions, HazardSink, HeightSource, LayerChoice, SiteCriteria, Verdict, Watch,
    hazard_bands, hazard_map_with,
};
use crate::io::Windows;
use crate::site::{Site, SiteRequest, choose_sites, spiral};
use crate::{Geometry, TerrainError};

/// Bytes that a pixel of a band takes while it is read and its layers are made.
const BYTES_PER_PIXEL: u64 = 64;

/// Rows that bands are rounded to.
const BAND: usize = 128;

/// Settings of a survey.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyOptions {
    /// Memory for the pixels that are held at once, bytes.
    pub memory: u64,
    /// Row and column at which the spiral begins; the middle of the map if there is none.
    pub start: Option<[usize; 2]>,
    /// Number of sites.
    pub count: usize,
    /// Least distance between sites, m.
    pub separation_m: f64,
    /// Layers and plane.
    pub hazards: HazardOptions,
}

impl Default for SurveyOptions {
    /// 1 GiB, one site from the middle, the layers that are tested.
    fn default() -> SurveyOptions {
        let hazards = HazardOptions { layers: LayerChoice::Tested, plane: None };
        SurveyOptions { memory: 1 << 30, start: None, count: 1, separation_m: 0.0, hazards }
    }
}

/// Tells whether a map fits into `memory` bytes with all its layers.
pub fn fits(geometry: &Geometry, memory: u64) -> bool {
    (geometry.pixels() as u64).saturating_mul(BYTES_PER_PIXEL) <= memory
}

/// Makes the hazards of a map band by band, gives them to `sink`, and returns the number of pixels by verdict and the sites, best first.
///
/// Where `watch` ends the work, sites are those of the ground that is assessed. The clearance of a site is exact as long as the window that it takes fits into the memory, else a lower bound.
///
/// # Errors
/// As [`hazard_bands`] and [`choose_sites`]; memory for less than 128 rows with those that their footprints reach.
pub fn survey<R: Read + Seek>(
    map: &mut Windows<R>,
    criteria: &SiteCriteria,
    options: &SurveyOptions,
    sink: &mut impl HazardSink,
    watch: Watch<'_>,
) -> Result<(Counts, Vec<Site>), TerrainError> {
    criteria.check()?;
    let geometry = *map.geometry();
    let (rows, cols) = (geometry.rows(), geometry.cols());
    let pixel = geometry.square_pixel()?;
    let start = options.start.unwrap_or([rows / 2, cols / 2]);
    if start[0] >= rows || start[1] >= cols {
        return Err(TerrainError::Outside { row: start[0], col: start[1], rows, cols });
    }
    if !(options.separation_m.is_finite() && options.separation_m >= 0.0) {
        let value = options.separation_m;
        return Err(TerrainError::Number {
            name: "separation_m",
            value,
            allowed: "it must not be negative".into(),
        });
    }
    let reach = reach(criteria, pixel, rows.max(cols));
    // Two bits a pixel for the whole map.
    let bits = (geometry.pixels() as u64).div_ceil(4);
    let held = options.memory.saturating_sub(bits) / (BYTES_PER_PIXEL * cols as u64);
    let held = usize::try_from(held).unwrap_or(usize::MAX).saturating_sub(2 * reach);
    let band_rows = held / BAND * BAND;
    if band_rows == 0 && held < rows {
        return Err(TerrainError::Number {
            name: "memory",
            value: options.memory as f64,
            allowed: "it must hold 128 rows with the rows above and below that their footprints reach".into(),
        });
    }
    let datum = map.window(0, 0, BAND.min(rows), cols)?.datum();
    let mut source = Source { windows: map, geometry, datum };
    let mut candidates = Candidates::new(cols, geometry.pixels(), criteria.clearance_min_m, sink);
    let counts =
        hazard_bands(&mut source, criteria, &options.hazards, band_rows.max(1), &mut candidates, watch)?;
    let chosen = candidates.along_spiral(start, rows, pixel, options);
    let mut sites = Vec::new();
    for (visited, [row, col]) in chosen {
        let found = numbers(map, criteria, options, [row, col], reach)?;
        let divert = (row.abs_diff(start[0]) as f64).hypot(col.abs_diff(start[1]) as f64) * pixel;
        let value = -(visited as f64);
        sites.extend(found.map(|site| Site { row, col, divert_m: divert, visited, value, ..site }));
    }
    Ok((counts, sites))
}

/// Rows that the footprint of a pixel reaches, at most those of the map.
fn reach(criteria: &SiteCriteria, pixel: f64, most: usize) -> usize {
    let belly = criteria.belly.map_or(0.0, |b| b.radius_m);
    let stance = criteria.footpad_circle_radius_m + criteria.footpad_radius_m;
    let normals = criteria.normals.map_or(0.0, |n| n.radius_m);
    let reach = criteria.footprint_radius_m.max(stance).max(belly).max(normals);
    // The cast saturates.
    (((reach / pixel).ceil() + 3.0) as usize).min(most)
}

/// The numbers of a site, from a window around it that is as large as its clearance.
fn numbers<R: Read + Seek>(
    map: &mut Windows<R>,
    criteria: &SiteCriteria,
    options: &SurveyOptions,
    [row, col]: [usize; 2],
    reach: usize,
) -> Result<Option<Site>, TerrainError> {
    let geometry = *map.geometry();
    let (rows, cols) = (geometry.rows(), geometry.cols());
    let pixel = geometry.square_pixel()?;
    // Twice the least clearance, then more as long as the site is clearer than the window can tell.
    let mut clear = ((2.0 * criteria.clearance_min_m / pixel) as usize).max(16).min(rows.max(cols));
    loop {
        let around = clear + reach;
        let (top, left) = (row.saturating_sub(around), col.saturating_sub(around));
        let (bottom, right) = ((row + around + 1).min(rows), (col + around + 1).min(cols));
        let window = map.window(top, left, bottom - top, right - left)?;
        let hazards = hazard_map_with(&window, criteria, &options.hazards)?;
        let request = SiteRequest { start: Some([row - top, col - left]), ..SiteRequest::default() };
        let site = choose_sites(&window, &hazards, &request)?.sites.into_iter().next();
        let known = site.as_ref().is_none_or(|s| s.clearance_m <= clear as f64 * pixel);
        let whole = (bottom - top, right - left) == (rows, cols);
        let side = 4 * around as u64 + 1;
        if known || whole || side.saturating_mul(side).saturating_mul(BYTES_PER_PIXEL) > options.memory {
            return Ok(site);
        }
        clear *= 2;
    }
}

/// A file as bands of rows above one datum.
struct Source<'a, R: Read + Seek> {
    windows: &'a mut Windows<R>,
    geometry: Geometry,
    datum: f64,
}

impl<R: Read + Seek> HeightSource for Source<'_, R> {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn datum(&self) -> f64 {
        self.datum
    }

    fn read_rows(&mut self, first: usize, count: usize, heights: &mut Vec<f32>) -> Result<(), TerrainError> {
        let window = self.windows.window(first, 0, count, self.geometry.cols())?;
        let lift = window.datum() - self.datum;
        heights.clear();
        heights.extend(window.relative().data().iter().map(|z| (f64::from(*z) + lift) as f32));
        Ok(())
    }
}

/// Candidates, one bit a pixel, on the way to a sink.
struct Candidates<'a, S> {
    cols: usize,
    bits: Vec<u64>,
    /// In the precision of the layer.
    clearance_min: f32,
    sink: &'a mut S,
}

impl<S: HazardSink> HazardSink for Candidates<'_, S> {
    fn band(&mut self, band: &HazardBand) -> Result<(), TerrainError> {
        let first = band.first_row * self.cols;
        for (k, _) in band.verdict.iter().enumerate().filter(|(_, v)| **v == Verdict::Safe) {
            self.bits[(first + k) / 64] |= 1 << ((first + k) % 64);
        }
        self.sink.band(band)
    }

    fn clearance(&mut self, first_row: usize, clearance: &[f32]) -> Result<(), TerrainError> {
        let first = first_row * self.cols;
        for (k, _) in clearance.iter().enumerate().filter(|(_, c)| **c < self.clearance_min) {
            self.bits[(first + k) / 64] &= !(1 << ((first + k) % 64));
        }
        self.sink.clearance(first_row, clearance)
    }
}

impl<'a, S> Candidates<'a, S> {
    fn new(cols: usize, pixels: usize, clearance_min_m: f64, sink: &'a mut S) -> Candidates<'a, S> {
        Candidates { cols, bits: vec![0; pixels.div_ceil(64)], clearance_min: clearance_min_m as f32, sink }
    }

    /// The first candidates on the spiral that are far enough from each other, with their places on it.
    fn along_spiral(
        &self,
        start: [usize; 2],
        rows: usize,
        pixel: f64,
        options: &SurveyOptions,
    ) -> Vec<(u64, [usize; 2])> {
        let mut chosen: Vec<(u64, [usize; 2])> = Vec::new();
        let mut left: u64 = self.bits.iter().map(|word| u64::from(word.count_ones())).sum();
        for (visited, [row, col]) in (1_u64..).zip(spiral(start, rows, self.cols)) {
            if left == 0 || chosen.len() >= options.count {
                break;
            }
            let at = row * self.cols + col;
            if self.bits[at / 64] >> (at % 64) & 1 == 0 {
                continue;
            }
            left -= 1;
            let apart = |[r, c]: [usize; 2]| (r.abs_diff(row) as f64).hypot(c.abs_diff(col) as f64) * pixel;
            if chosen.iter().all(|&(_, site)| apart(site) >= options.separation_m) {
                chosen.push((visited, [row, col]));
            }
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::ElevationMap;
    use crate::hazard::{HazardMap, Layer, hazard_map};
    use crate::io::{GeoTiffOptions, ReadOptions, write_geotiff};
    use crate::synthetic::{Synthetic, Terrain};

    /// Round-off of single precision, in which rasters are stored.
    const SINGLE: f64 = 1e-6;

    fn file() -> (ElevationMap, Vec<u8>) {
        let terrain = Terrain { rows: 330, cols: 210, ..Terrain::fine() };
        let map = Synthetic::new(terrain, 3).unwrap().map().unwrap();
        let bytes =
            write_geotiff(Cursor::new(Vec::new()), &map, GeoTiffOptions::default()).unwrap().into_inner();
        let map = crate::io::read(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
        (map, bytes)
    }

    /// Compares what it gets with the hazards of the whole map.
    struct Compare {
        whole: HazardMap,
        next: [usize; 2],
        bands: usize,
    }

    impl HazardSink for Compare {
        fn band(&mut self, band: &HazardBand) -> Result<(), TerrainError> {
            let cols = self.whole.geometry().cols();
            let at = self.next[0] * cols;
            assert_eq!(band.first_row, self.next[0]);
            assert_eq!(band.verdict, &self.whole.verdict().data()[at..at + band.verdict.len()]);
            let slopes = band.layer(Layer::Slope).unwrap();
            for (a, b) in slopes.iter().zip(&self.whole.layer(Layer::Slope).unwrap().data()[at..]) {
                assert!(f64::from((a - b).abs()) < SINGLE || (a.is_nan() && b.is_nan()));
            }
            self.next[0] += band.verdict.len() / cols;
            self.bands += 1;
            Ok(())
        }

        fn clearance(&mut self, first_row: usize, clearance: &[f32]) -> Result<(), TerrainError> {
            let cols = self.whole.geometry().cols();
            assert_eq!(first_row, self.next[1]);
            assert_eq!(clearance, &self.whole.clearance().data()[first_row * cols..][..clearance.len()]);
            self.next[1] += clearance.len() / cols;
            Ok(())
        }
    }

    #[test]
    fn bands_give_what_the_whole_map_gives() {
        let (map, bytes) = file();
        let criteria = SiteCriteria { clearance_min_m: 0.5, ..SiteCriteria::CHANG_E_3_FINE };
        let whole = hazard_map(&map, &criteria).unwrap();
        let request =
            SiteRequest { count: 5, separation_m: 2.0, start: Some([100, 40]), ..SiteRequest::default() };
        let expected = choose_sites(&map, &whole, &request).unwrap().sites;
        assert_eq!(expected.len(), 5);
        for memory in [1 << 30, 64 * 210 * 200 + 18_000] {
            let options = SurveyOptions {
                memory,
                start: request.start,
                count: 5,
                separation_m: 2.0,
                ..SurveyOptions::default()
            };
            let mut windows = Windows::open(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
            let mut sink = Compare { whole: whole.clone(), next: [0; 2], bands: 0 };
            let (counts, sites) = survey(&mut windows, &criteria, &options, &mut sink, &|_| true).unwrap();
            assert_eq!((sink.next, sink.bands > 1), ([330; 2], memory < 1 << 30));
            assert_eq!((counts, sites.len()), (whole.counts(), expected.len()));
            for (found, expected) in sites.iter().zip(&expected) {
                assert_eq!(
                    (found.row, found.col, found.visited),
                    (expected.row, expected.col, expected.visited)
                );
                assert_eq!((found.divert_m, found.clearance_m), (expected.divert_m, expected.clearance_m));
                assert!((found.height_m - expected.height_m).abs() < SINGLE);
                for (a, b) in found.layers.iter().zip(&expected.layers) {
                    assert!(a.0 == b.0 && (a.1 - b.1).abs() < 10.0 * SINGLE, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn mistakes_are_named() {
        let (map, bytes) = file();
        let mut windows = Windows::open(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
        let criteria = SiteCriteria::CHANG_E_3_FINE;
        let whole = hazard_map(&map, &criteria).unwrap();
        let options = SurveyOptions::default();
        let mut refused = |criteria: &SiteCriteria, options: &SurveyOptions| {
            let mut sink = Compare { whole: whole.clone(), next: [0; 2], bands: 0 };
            survey(&mut windows, criteria, options, &mut sink, &|_| true).unwrap_err().to_string()
        };
        let little = SurveyOptions { memory: 1000, ..options.clone() };
        assert!(refused(&criteria, &little).starts_with("memory is 1000"));
        let outside = SurveyOptions { start: Some([330, 0]), ..options.clone() };
        assert!(refused(&criteria, &outside).contains("outside the map of 330 x 210"));
        let planar = SiteCriteria { relative_elevation_max_m: Some(1.0), ..criteria };
        assert!(refused(&planar, &options).starts_with("relative_elevation_max_m"));
        let apart = SurveyOptions { separation_m: -1.0, ..options };
        assert!(refused(&criteria, &apart).starts_with("separation_m"));
    }
}
