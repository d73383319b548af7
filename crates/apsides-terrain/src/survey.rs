//! Hazards and sites of a map that is larger than memory, in bands of rows.
//!
//! A band is read with rows above and below it, so that every footprint and every clearance up to [`CLEARANCE_REACH`] times the least
//! one is known as on the whole map; larger clearances are lower bounds. The candidates are kept as one bit a pixel, and sites are
//! those of [`SiteRule::Spiral`](crate::site::SiteRule::Spiral).

use std::io::{Read, Seek};
use std::ops::Range;

use crate::hazard::{HazardMap, HazardOptions, LayerChoice, SiteCriteria, Verdict, hazard_map_with};
use crate::io::Windows;
use crate::site::{Site, SiteRequest, choose_sites, spiral};
use crate::{ElevationMap, Geometry, TerrainError};

/// Clearances are exact up to this many times the least clearance of the criteria.
pub const CLEARANCE_REACH: f64 = 4.0;

/// Bytes that a pixel of a band takes while it is read and its layers are made.
const BYTES_PER_PIXEL: u64 = 64;

/// What is asked for.
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
    /// Layers that bands contain.
    pub layers: LayerChoice,
}

impl Default for SurveyOptions {
    /// 1 GiB, one site from the middle, the layers that are tested.
    fn default() -> SurveyOptions {
        SurveyOptions {
            memory: 1 << 30,
            start: None,
            count: 1,
            separation_m: 0.0,
            layers: LayerChoice::Tested,
        }
    }
}

/// Rows of a map with their hazards.
#[derive(Clone, Copy, Debug)]
pub struct Band<'a> {
    first: usize,
    count: usize,
    skip: usize,
    map: &'a ElevationMap,
    hazards: &'a HazardMap,
}

impl<'a> Band<'a> {
    /// The whole map as one band.
    pub fn whole(map: &'a ElevationMap, hazards: &'a HazardMap) -> Band<'a> {
        Band { first: 0, count: map.geometry().rows(), skip: 0, map, hazards }
    }

    /// Its rows on the whole map.
    pub fn rows(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Its rows in [`Band::map`] and [`Band::hazards`]; those before and after are its neighbours'.
    pub fn inner(&self) -> Range<usize> {
        self.skip..self.skip + self.count
    }

    /// Heights.
    pub fn map(&self) -> &'a ElevationMap {
        self.map
    }

    /// Layers and verdicts.
    pub fn hazards(&self) -> &'a HazardMap {
        self.hazards
    }
}

/// Whether a map fits into `memory` bytes as one band.
pub fn fits(geometry: &Geometry, memory: u64) -> bool {
    (geometry.pixels() as u64).saturating_mul(BYTES_PER_PIXEL) <= memory
}

/// Makes the hazards of a map band by band, gives each band to `each` and returns the sites, best first; `each` returns whether to go
/// on, and no site is returned if it does not.
///
/// # Errors
/// As [`hazard_map_with`] and [`choose_sites`]; memory for less than one row; a threshold on the height over the plane of the whole map,
/// which no band has.
pub fn survey<R: Read + Seek>(
    map: &mut Windows<R>,
    criteria: &SiteCriteria,
    options: &SurveyOptions,
    mut each: impl FnMut(&Band<'_>) -> Result<bool, TerrainError>,
) -> Result<Vec<Site>, TerrainError> {
    criteria.check()?;
    let geometry = *map.geometry();
    let (rows, cols) = (geometry.rows(), geometry.cols());
    let start = options.start.unwrap_or([rows / 2, cols / 2]);
    if start[0] >= rows || start[1] >= cols {
        return Err(TerrainError::Outside { row: start[0], col: start[1], rows, cols });
    }
    if let Some(value) = criteria.relative_elevation_max_m {
        return Err(TerrainError::Number {
            name: "relative_elevation_max_m",
            value,
            allowed: "it needs the plane of the whole map: give enough memory for the whole map or leave it out",
        });
    }
    if !(options.separation_m.is_finite() && options.separation_m >= 0.0) {
        let value = options.separation_m;
        return Err(TerrainError::Number { name: "separation_m", value, allowed: "it must not be negative" });
    }
    let halo = halo(criteria, geometry.square_pixel()?, rows);
    let bits = (geometry.pixels() as u64).div_ceil(8);
    let held = options.memory.saturating_sub(bits) / (BYTES_PER_PIXEL * cols as u64);
    let held = usize::try_from(held).unwrap_or(usize::MAX).min(rows);
    let height = if held == rows { rows } else { held.saturating_sub(2 * halo) };
    if height == 0 {
        return Err(TerrainError::Number {
            name: "memory",
            value: options.memory as f64,
            allowed: "it must hold a row with the rows above and below that its footprints reach",
        });
    }
    let hazard_options = HazardOptions { layers: options.layers.clone(), plane: None };
    let mut candidates = Candidates::new(cols, geometry.pixels());
    let mut first = 0;
    while first < rows {
        let count = height.min(rows - first);
        let (top, bottom) = (first.saturating_sub(halo), (first + count + halo).min(rows));
        let window = map.window(top, 0, bottom - top, cols)?;
        let hazards = hazard_map_with(&window, criteria, &hazard_options)?;
        let band = Band { first, count, skip: first - top, map: &window, hazards: &hazards };
        let least = criteria.clearance_min_m as f32;
        for (row, inner) in band.rows().zip(band.inner()) {
            let verdicts = hazards.verdict().row(inner).iter().zip(hazards.clearance().row(inner));
            for (col, (verdict, clearance)) in verdicts.enumerate() {
                if *verdict == Verdict::Safe && *clearance >= least {
                    candidates.add(row, col);
                }
            }
        }
        if !each(&band)? {
            return Ok(Vec::new());
        }
        first += count;
    }
    let pixel = geometry.square_pixel()?;
    let mut sites = Vec::new();
    for (visited, [row, col]) in candidates.along_spiral(start, rows, pixel, options) {
        // The numbers of a site come from the window that they depend on.
        let (top, left) = (row.saturating_sub(halo), col.saturating_sub(halo));
        let (bottom, right) = ((row + halo + 1).min(rows), (col + halo + 1).min(cols));
        let window = map.window(top, left, bottom - top, right - left)?;
        let hazards = hazard_map_with(&window, criteria, &hazard_options)?;
        let request = SiteRequest { start: Some([row - top, col - left]), ..SiteRequest::default() };
        let found = choose_sites(&window, &hazards, &request)?.sites.into_iter().next();
        let divert = (row.abs_diff(start[0]) as f64).hypot(col.abs_diff(start[1]) as f64) * pixel;
        sites.extend(found.map(|site| Site {
            row,
            col,
            divert_m: divert,
            visited,
            value: -(visited as f64),
            ..site
        }));
    }
    Ok(sites)
}

/// Rows above and below a band: those of footprints and those of clearances.
fn halo(criteria: &SiteCriteria, pixel: f64, rows: usize) -> usize {
    let belly = criteria.belly.map_or(0.0, |b| b.radius_m);
    let stance = criteria.footpad_circle_radius_m + criteria.footpad_radius_m;
    let reach = criteria.footprint_radius_m.max(stance).max(belly);
    let pixels = (reach / pixel).ceil() + (CLEARANCE_REACH * criteria.clearance_min_m / pixel).ceil() + 3.0;
    // More rows than the map has are not needed; the cast saturates.
    (pixels as usize).min(rows)
}

/// One bit a pixel.
struct Candidates {
    cols: usize,
    bits: Vec<u64>,
    count: u64,
}

impl Candidates {
    fn new(cols: usize, pixels: usize) -> Candidates {
        Candidates { cols, bits: vec![0; pixels.div_ceil(64)], count: 0 }
    }

    fn add(&mut self, row: usize, col: usize) {
        let at = row * self.cols + col;
        self.bits[at / 64] |= 1 << (at % 64);
        self.count += 1;
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
        let mut left = self.count;
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
    use crate::hazard::hazard_map;
    use crate::io::{GeoTiffOptions, ReadOptions, write_geotiff};
    use crate::synthetic::{Synthetic, Terrain};

    fn file() -> (ElevationMap, Vec<u8>) {
        let terrain = Terrain { rows: 330, cols: 210, ..Terrain::fine() };
        let map = Synthetic::new(terrain, 3).unwrap().map().unwrap();
        let bytes =
            write_geotiff(Cursor::new(Vec::new()), &map, GeoTiffOptions::default()).unwrap().into_inner();
        let map = crate::io::read(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
        (map, bytes)
    }

    #[test]
    fn bands_give_what_the_whole_map_gives() {
        let (map, bytes) = file();
        let criteria = SiteCriteria { clearance_min_m: 0.5, ..SiteCriteria::CHANG_E_3_FINE };
        let whole = hazard_map(&map, &criteria).unwrap();
        let request =
            SiteRequest { count: 5, separation_m: 2.0, start: Some([100, 40]), ..SiteRequest::default() };
        let expected = choose_sites(&map, &whole, &request).unwrap().sites;
        assert!(expected.len() == 5);
        for memory in [1 << 30, 64 * 210 * 140 + 9000] {
            let options = SurveyOptions {
                memory,
                start: request.start,
                count: 5,
                separation_m: 2.0,
                ..SurveyOptions::default()
            };
            let mut windows = Windows::open(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
            let mut next = 0;
            let mut bands = 0;
            let sites = survey(&mut windows, &criteria, &options, |band| {
                assert_eq!(band.rows().start, next);
                next = band.rows().end;
                bands += 1;
                for (row, inner) in band.rows().zip(band.inner()) {
                    assert_eq!(band.hazards().verdict().row(inner), whole.verdict().row(row));
                    let clearances =
                        band.hazards().clearance().row(inner).iter().zip(whole.clearance().row(row));
                    for (found, expected) in clearances {
                        assert!(
                            found == expected || (*found >= 2.0 && found < expected),
                            "{found} {expected}"
                        );
                    }
                }
                Ok(true)
            })
            .unwrap();
            assert_eq!((next, bands > 1), (330, memory < 1 << 30));
            assert_eq!(sites.len(), expected.len());
            for (found, expected) in sites.iter().zip(&expected) {
                assert_eq!(
                    (found.row, found.col, found.visited),
                    (expected.row, expected.col, expected.visited)
                );
                assert_eq!(found.divert_m, expected.divert_m);
                assert!((found.height_m - expected.height_m).abs() < 1e-6);
                for (a, b) in found.layers.iter().zip(&expected.layers) {
                    assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-5, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn a_stop_and_mistakes() {
        let (_, bytes) = file();
        let mut windows = Windows::open(Cursor::new(&bytes), &ReadOptions::default()).unwrap();
        let criteria = SiteCriteria::CHANG_E_3_FINE;
        let options = SurveyOptions::default();
        assert_eq!(survey(&mut windows, &criteria, &options, |_| Ok(false)).unwrap(), []);
        let mut refused = |criteria: &SiteCriteria, options: &SurveyOptions| {
            survey(&mut windows, criteria, options, |_| Ok(true)).unwrap_err().to_string()
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
