//! Parts of a map, read when they are needed.

use std::io::{Read, Seek, SeekFrom};

use super::degrees::{Columns, Equirectangular};
use super::geo_keys::GeoKeys;
use super::source::{Head, Store};
use super::{Format, ReadOptions, ascii, geotiff, length, malformed, npy, pds3, pds4, png_map, unreadable};
use crate::{ElevationMap, Geometry, MapUnit, TerrainError};

/// No ground has heights that differ by more: a spike would take the resolution of all others.
const LARGEST_RELIEF_M: f64 = 1e6;

/// Heights whose median stands for that of all.
const SAMPLES: usize = 1024;

/// A map that is read in windows.
///
/// GeoTIFF, `.npy` and PDS rasters are read where a window needs them: whole strips or tiles if they are compressed (64 MiB of them are
/// kept for the next window), else the bytes of the window alone. ASCII grids and PNG are read whole when they are opened.
pub struct Windows<R> {
    store: Store<R>,
    head: Head,
    geometry: Geometry,
    /// The way from stored columns in degrees to those of the geometry.
    columns: Option<Columns>,
    options: ReadOptions,
    /// Most pixels the bytes of the input can hold.
    capacity: u64,
}

/// Pixels for which memory is taken without asking how long the input is.
const SMALL: u64 = 1 << 16;

impl<R: Read + Seek> Windows<R> {
    /// Reads the head of a map.
    ///
    /// # Errors
    /// A head that cannot be read, is damaged or not supported.
    pub fn open(mut reader: R, options: &ReadOptions) -> Result<Windows<R>, TerrainError> {
        let start = super::bytes_at(&mut reader, 0, 512).map_err(|e| unreadable("map", "first bytes", e))?;
        let Some(format) = Format::detect(&start) else {
            let problem = if start.is_empty() {
                "the file is empty".to_owned()
            } else {
                "not the beginning of a GeoTIFF, ESRI ASCII grid, .npy, PDS3 or PDS4 label or PNG".to_owned()
            };
            return Err(malformed("map", "first bytes", problem));
        };
        let len = length(&mut reader)?;
        reader.seek(SeekFrom::Start(0)).map_err(|e| unreadable("map", "first bytes", e))?;
        let (head, store) = match format {
            Format::Tiff => geotiff::open(reader, len)?,
            Format::Npy => npy::open(reader, len)?,
            Format::AsciiGrid => ascii::open(reader, len, options.max_pixels)?,
            Format::Png => png_map::open(reader, len, options.max_pixels)?,
            Format::Pds3 => pds3::open(reader, len)?,
            Format::Pds4 => {
                return Err(TerrainError::Unsupported {
                    format: format.name(),
                    feature: "a label without its raster".to_owned(),
                    supported: "label and raster together (read_labelled)",
                });
            }
        };
        Windows::new(head, store, len, options)
    }

    /// Reads the head of a map whose label (PDS3 or PDS4) is apart from its raster.
    ///
    /// # Errors
    /// As of [`Windows::open`].
    pub fn open_labelled(
        label: &[u8],
        mut data: R,
        options: &ReadOptions,
    ) -> Result<Windows<R>, TerrainError> {
        let len = length(&mut data)?;
        let (head, store) = match Format::detect(label) {
            Some(Format::Pds3) => pds3::open_labelled(label, data, len)?,
            Some(Format::Pds4) => pds4::open(label, data, len)?,
            _ => return Err(malformed("label", "first bytes", "not the beginning of a PDS3 or PDS4 label")),
        };
        Windows::new(head, store, len, options)
    }

    fn new(
        mut head: Head,
        store: Store<R>,
        len: u64,
        options: &ReadOptions,
    ) -> Result<Windows<R>, TerrainError> {
        for (name, value) in [("scale of heights", options.z_scale), ("offset of heights", options.z_offset)]
        {
            if !value.is_finite() || (value == 0.0 && name == "scale of heights") {
                let allowed = "it must be finite, and a scale not zero";
                return Err(TerrainError::Number { name, value, allowed: allowed.into() });
            }
        }
        let mut geometry = head.geometry(options)?;
        let mut columns = None;
        if let Some(radius) = options.body_radius_m.filter(|_| geometry.unit() == MapUnit::Degree) {
            let (found, on_ground) = Columns::new(head.format, &geometry, radius, head.radius_m)?;
            (columns, geometry) = (Some(found), on_ground);
        }
        head.missing.extend(options.nodata);
        head.missing.iter_mut().for_each(|m| *m = head.sample.nearest(*m));
        let expansion = match &store {
            Store::Raw(_) => 1,
            Store::Chunks(chunks) => chunks.expansion(),
            Store::Held(_) => u64::MAX,
        };
        let capacity = (len.saturating_mul(expansion) / head.sample.size() as u64).max(SMALL);
        Ok(Windows { store, head, geometry, columns, options: *options, capacity })
    }

    /// The places of the pixels of the whole map.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The geokeys of a GeoTIFF, for a file made from this one; none if the caller replaced the geometry or the unit.
    pub fn geo_keys(&self) -> Option<&GeoKeys> {
        self.head.geo_keys.as_ref().filter(|_| self.options.pixel_m.is_none() && self.columns.is_none())
    }

    /// The projection to metres of a map in degrees that is read with [`ReadOptions::body_radius_m`]; none for others.
    pub fn projection(&self) -> Option<Equirectangular> {
        self.columns.map(|c| c.projection)
    }

    /// Radius of the body that the file states for its degrees, m.
    pub fn stated_radius_m(&self) -> Option<f64> {
        self.head.radius_m
    }

    /// Reads the window of `rows` x `cols` pixels whose first pixel is (`row`, `col`). The datum is the window's own; a window may be
    /// all gaps.
    ///
    /// # Errors
    /// A window that is empty or leaves the map, more pixels than [`ReadOptions::max_pixels`], damaged bytes.
    pub fn window(
        &mut self,
        row: usize,
        col: usize,
        rows: usize,
        cols: usize,
    ) -> Result<ElevationMap, TerrainError> {
        let geometry = self.geometry.window(row, col, rows, cols)?;
        let pixels = geometry.pixels() as u64;
        if pixels > self.options.max_pixels {
            let (rows, cols) = (rows as u64, cols as u64);
            return Err(TerrainError::TooLarge { rows, cols, limit: self.options.max_pixels });
        }
        if pixels > self.capacity {
            return Err(malformed(
                self.head.format,
                "size of the map",
                format!("{pixels} pixels do not fit into the bytes of the file"),
            ));
        }
        let heights = match self.columns {
            None => self.stored(row, col, rows, cols)?,
            Some(columns) => {
                let [first, count] = columns.needed(col, cols);
                columns.interpolate(&self.stored(row, first, rows, count)?, col, cols)
            }
        };
        ElevationMap::from_heights(geometry, &heights)
    }

    /// Heights of a window of the stored pixels, m.
    fn stored(&mut self, row: usize, col: usize, rows: usize, cols: usize) -> Result<Vec<f64>, TerrainError> {
        let first = if self.head.south_up { self.geometry.rows() - row - rows } else { row };
        let mut heights = vec![f64::NAN; rows * cols];
        let all = self.columns.map_or(self.geometry.cols(), |c| c.stored());
        match &mut self.store {
            Store::Raw(raw) => raw.fill(first, col, cols, &mut heights)?,
            Store::Chunks(chunks) => chunks.fill(first, col, cols, &mut heights)?,
            Store::Held(held) => {
                for (r, out) in heights.chunks_exact_mut(cols).enumerate() {
                    let at = (first + r) * all + col;
                    out.copy_from_slice(&held[at..at + cols]);
                }
            }
        }
        self.to_metres(&mut heights);
        if self.head.south_up {
            turn_over(&mut heights, cols);
        }
        if let Some(k) = spike(&heights) {
            return Err(malformed(
                self.head.format,
                format!("row {}, column {}", row + k / cols, col + k % cols),
                format!(
                    "height of {:e} m: more than {LARGEST_RELIEF_M:e} m from the others; if the number marks missing heights, state it as such (nodata)",
                    heights[k]
                ),
            ));
        }
        Ok(heights)
    }

    /// The whole map, which must have a height.
    pub(super) fn whole(mut self) -> Result<ElevationMap, TerrainError> {
        let (rows, cols) = (self.geometry.rows(), self.geometry.cols());
        let map = self.window(0, 0, rows, cols)?;
        if map.range().is_none() {
            return Err(TerrainError::Empty { pixels: map.geometry().pixels() });
        }
        Ok(map)
    }

    /// Stored numbers to heights in metres, NaN for gaps.
    fn to_metres(&self, values: &mut [f64]) {
        let scale = self.head.scale * self.options.z_scale;
        let offset = self.head.offset * self.options.z_scale + self.options.z_offset;
        let missing = &self.head.missing;
        for value in values {
            *value = if missing.contains(value) { f64::NAN } else { *value * scale + offset };
        }
    }
}

/// The first height too far from the others; none where all are near each other.
fn spike(heights: &[f64]) -> Option<usize> {
    let finite = || heights.iter().copied().filter(|z| z.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
    if low > high || high - low <= LARGEST_RELIEF_M {
        return None;
    }
    let mut some: Vec<f64> = finite().step_by(heights.len().div_ceil(SAMPLES)).collect();
    some.sort_unstable_by(f64::total_cmp);
    let middle = some[some.len() / 2];
    let far = |z: &f64| z.is_finite() && (z - middle).abs() > 0.5 * LARGEST_RELIEF_M;
    heights.iter().position(far)
}

/// Reverses the order of rows.
fn turn_over(values: &mut [f64], cols: usize) {
    let rows = values.len() / cols;
    for row in 0..rows / 2 {
        let (north, south) = values.split_at_mut((rows - 1 - row) * cols);
        north[row * cols..(row + 1) * cols].swap_with_slice(&mut south[..cols]);
    }
}
