//! Writing GeoTIFF in bands of rows.

use std::io::{Seek, SeekFrom, Write};

use flate2::Compression as Level;
use flate2::write::ZlibEncoder;

use super::super::geo_keys::GeoKeys;
use super::super::unwritable;
use super::tag;
use crate::{ElevationMap, Geometry, TerrainError};

/// Bytes of a strip before compression.
const STRIP: usize = 1 << 18;

/// Options of writing a GeoTIFF.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeoTiffOptions {
    /// Compress strips with deflate.
    pub deflate: bool,
    /// Number that stands for gaps; NaN if none.
    pub nodata: Option<f32>,
    /// The meaning of the map coordinates, for example [`crate::io::Windows::geo_keys`] of the map that was read; if none, metres or degrees
    /// without a reference system.
    pub geo_keys: Option<GeoKeys>,
}

/// Writes a GeoTIFF (BigTIFF from 4 GB) of 32-bit reals from bands of rows, so that the whole map need not be in memory.
///
/// Little-endian, strips of 256 KiB, pixels as areas, the tie point at the north-western corner.
pub struct GeoTiffWriter<W: Write + Seek> {
    writer: W,
    geometry: Geometry,
    options: GeoTiffOptions,
    big: bool,
    rows_per_strip: usize,
    /// Bytes of the strip that is not yet full.
    strip: Vec<u8>,
    at: u64,
    offsets: Vec<u64>,
    sizes: Vec<u64>,
    rows: usize,
}

impl<W: Write + Seek> GeoTiffWriter<W> {
    /// Begins a file at the start of `writer`.
    ///
    /// # Errors
    /// The writer's; a side of 2^32 pixels or more.
    pub fn new(
        mut writer: W,
        geometry: Geometry,
        options: GeoTiffOptions,
    ) -> Result<GeoTiffWriter<W>, TerrainError> {
        if u32::try_from(geometry.rows().max(geometry.cols())).is_err() {
            let (rows, cols) = (geometry.rows() as u64, geometry.cols() as u64);
            return Err(TerrainError::TooLarge { rows, cols, limit: u64::from(u32::MAX) });
        }
        let row = geometry.cols() * 4;
        // Below 2^32 with room for the directory and for the bytes deflate may add to each strip.
        let big = geometry.pixels() as u64 * 4 > 4_200_000_000;
        let rows_per_strip = (STRIP / row).clamp(1, geometry.rows());
        let head: &[u8] = if big { b"II+\0\x08\0\0\0\0\0\0\0\0\0\0\0" } else { b"II*\0\0\0\0\0" };
        writer.seek(SeekFrom::Start(0)).and_then(|_| writer.write_all(head)).map_err(unwritable)?;
        Ok(GeoTiffWriter {
            writer,
            geometry,
            options,
            big,
            rows_per_strip,
            strip: Vec::with_capacity(rows_per_strip * row),
            at: head.len() as u64,
            offsets: Vec::new(),
            sizes: Vec::new(),
            rows: 0,
        })
    }

    /// Appends whole rows of heights in metres, from north to south; what is not finite is a gap.
    ///
    /// # Errors
    /// The writer's; a part of a row; more rows than the geometry has.
    pub fn write_rows(&mut self, heights: &[f32]) -> Result<(), TerrainError> {
        let cols = self.geometry.cols();
        let rows = heights.len() / cols;
        if !heights.len().is_multiple_of(cols) || self.rows + rows > self.geometry.rows() {
            return Err(TerrainError::Shape {
                rows: self.geometry.rows() - self.rows,
                cols,
                values: heights.len(),
            });
        }
        let gap = self.options.nodata.unwrap_or(f32::NAN);
        for row in heights.chunks_exact(cols) {
            for &z in row {
                self.strip.extend(if z.is_finite() { z } else { gap }.to_le_bytes());
            }
            self.rows += 1;
            if self.rows.is_multiple_of(self.rows_per_strip) || self.rows == self.geometry.rows() {
                self.flush_strip().map_err(unwritable)?;
            }
        }
        Ok(())
    }

    fn flush_strip(&mut self) -> std::io::Result<()> {
        let size = if self.options.deflate {
            let mut encoder = ZlibEncoder::new(Vec::new(), Level::default());
            encoder.write_all(&self.strip)?;
            let packed = encoder.finish()?;
            self.writer.write_all(&packed)?;
            packed.len()
        } else {
            self.writer.write_all(&self.strip)?;
            self.strip.len()
        };
        self.strip.clear();
        self.offsets.push(self.at);
        self.sizes.push(size as u64);
        self.at += size as u64;
        Ok(())
    }

    /// Writes the directory and gives the writer back.
    ///
    /// # Errors
    /// The writer's; fewer rows than the geometry has.
    pub fn finish(mut self) -> Result<W, TerrainError> {
        let (rows, cols) = (self.geometry.rows(), self.geometry.cols());
        if self.rows < rows {
            return Err(TerrainError::Shape { rows, cols, values: self.rows * cols });
        }
        self.write_directory().map_err(unwritable)?;
        Ok(self.writer)
    }

    fn write_directory(&mut self) -> std::io::Result<()> {
        let mut tags = self.tags();
        tags.sort_by_key(|t| t.tag);
        // The directory begins on a word boundary.
        let pad = self.at % 2;
        let start = self.at + pad;
        let (entry, inline) = if self.big { (20, 8) } else { (12, 4) };
        let table = if self.big { 16 } else { 6 } + entry * tags.len();
        let word = |n: u64| n.to_le_bytes()[..inline].to_vec();
        let mut head = vec![0; pad as usize];
        let count = tags.len() as u64;
        head.extend(&count.to_le_bytes()[..if self.big { 8 } else { 2 }]);
        let mut values: Vec<u8> = Vec::new();
        for t in &tags {
            head.extend(t.tag.to_le_bytes());
            head.extend(t.kind.to_le_bytes());
            head.extend(word(t.count));
            if t.bytes.len() <= inline {
                let mut bytes = t.bytes.clone();
                bytes.resize(inline, 0);
                head.extend(bytes);
            } else {
                head.extend(word(start + (table + values.len()) as u64));
                values.extend(&t.bytes);
                values.resize(values.len().next_multiple_of(2), 0);
            }
        }
        head.extend(word(0));
        self.writer.write_all(&head)?;
        self.writer.write_all(&values)?;
        self.writer.seek(SeekFrom::Start(if self.big { 8 } else { 4 }))?;
        self.writer.write_all(&word(start))?;
        self.writer.seek(SeekFrom::End(0))?;
        self.writer.flush()
    }

    fn tags(&self) -> Vec<Tag> {
        let g = &self.geometry;
        let [east, south] = g.pixel();
        let [x, y] = g.north_west();
        let keys = self.options.geo_keys.clone().unwrap_or_else(|| GeoKeys::plain(g.unit())).for_areas();
        let list = |tag: u16, values: &[u64]| {
            if self.big {
                Tag::new(tag, 16, values, |v| v.to_le_bytes().to_vec())
            } else {
                Tag::new(tag, 4, values, |v| (*v as u32).to_le_bytes().to_vec())
            }
        };
        let short = |tag: u16, value: u16| Tag::new(tag, 3, &[value], |v| v.to_le_bytes().to_vec());
        let long = |tag: u16, value: usize| Tag::new(tag, 4, &[value as u32], |v| v.to_le_bytes().to_vec());
        let reals = |tag: u16, values: &[f64]| Tag::new(tag, 12, values, |v| v.to_le_bytes().to_vec());
        let text = |tag: u16, value: &str| Tag::new(tag, 2, format!("{value}\0").as_bytes(), |v| vec![*v]);
        let nodata = self.options.nodata.map_or("nan".to_owned(), |n| n.to_string());
        let mut tags = vec![
            long(tag::WIDTH, g.cols()),
            long(tag::LENGTH, g.rows()),
            short(tag::BITS, 32),
            short(tag::COMPRESSION, if self.options.deflate { 8 } else { 1 }),
            short(tag::PHOTOMETRIC, 1),
            list(tag::STRIP_OFFSETS, &self.offsets),
            short(tag::SAMPLES, 1),
            long(tag::ROWS_PER_STRIP, self.rows_per_strip),
            list(tag::STRIP_SIZES, &self.sizes),
            short(tag::SAMPLE_FORMAT, 3),
            reals(tag::PIXEL_SCALE, &[east, south, 0.0]),
            reals(tag::TIE_POINT, &[0.0, 0.0, 0.0, x - 0.5 * east, y + 0.5 * south, 0.0]),
            Tag::new(tag::GEO_KEYS, 3, &keys.directory, |v| v.to_le_bytes().to_vec()),
            text(tag::GDAL_NODATA, &nodata),
        ];
        if !keys.doubles.is_empty() {
            tags.push(reals(tag::GEO_DOUBLES, &keys.doubles));
        }
        if !keys.text.is_empty() {
            tags.push(text(tag::GEO_TEXT, &keys.text));
        }
        tags
    }
}

struct Tag {
    tag: u16,
    kind: u16,
    count: u64,
    bytes: Vec<u8>,
}

impl Tag {
    fn new<T>(tag: u16, kind: u16, values: &[T], bytes: impl Fn(&T) -> Vec<u8>) -> Tag {
        Tag { tag, kind, count: values.len() as u64, bytes: values.iter().flat_map(bytes).collect() }
    }
}

/// Writes the heights of a map in metres as a GeoTIFF of 32-bit reals: see [`GeoTiffWriter`].
///
/// # Errors
/// The writer's.
///
/// # Examples
/// ```
/// use apsides_terrain::io::{GeoTiffOptions, ReadOptions, read, write_geotiff};
/// use apsides_terrain::{ElevationMap, Geometry};
/// use std::io::Cursor;
///
/// let map = ElevationMap::from_heights(Geometry::square(2, 3, 10.0)?, &[1.0, 2.0, 3.0, f64::NAN, 5.0, 6.5])?;
/// let options = GeoTiffOptions { deflate: true, ..GeoTiffOptions::default() };
/// let file = write_geotiff(Cursor::new(Vec::new()), &map, options)?;
/// let again = read(file, &ReadOptions::default())?;
/// assert_eq!((again.height(1, 2), again.height(1, 0)), (Some(6.5), None));
/// assert_eq!(again.geometry(), map.geometry());
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn write_geotiff<W: Write + Seek>(
    writer: W,
    map: &ElevationMap,
    options: GeoTiffOptions,
) -> Result<W, TerrainError> {
    let mut file = GeoTiffWriter::new(writer, *map.geometry(), options)?;
    let mut heights = vec![0.0; map.geometry().cols()];
    for row in 0..map.geometry().rows() {
        for (height, &z) in heights.iter_mut().zip(map.relative().row(row)) {
            *height = (map.datum() + f64::from(z)) as f32;
        }
        file.write_rows(&heights)?;
    }
    file.finish()
}
