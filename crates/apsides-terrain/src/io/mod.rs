//! Elevation maps from files and back, from bytes and readers: the library opens no file itself.
//!
//! [`read`] reads a whole map, [`Windows`] parts of one that is larger than memory. The format follows from the first bytes.
//!
//! | format | stored numbers | place and size of a pixel |
//! |---|---|---|
//! | GeoTIFF, BigTIFF, plain TIFF | u8, u16, i16, u32, i32, f32, f64; one band; strips, tiles; no compression, deflate, LZW, PackBits, zstd, LERC; predictors | pixel scale and tie point, or a transformation along the axes; geokeys |
//! | ESRI ASCII grid | decimal | `cellsize`, `xllcorner` or `xllcenter`; metres are assumed |
//! | NumPy `.npy` | u1, i1, u2, i2, u4, i4, f4, f8; two dimensions | none |
//! | PDS3, PDS4 | 8, 16, 32 bit integers, IEEE reals; one band | map projection of the label |
//! | PNG | 8 and 16 bit grey | none |
//!
//! **Units.** Height = (stored number x the file's own scale + the file's own offset) x [`ReadOptions::z_scale`] +
//! [`ReadOptions::z_offset`], m. Map coordinates are metres or degrees; feet and kilometres become metres, radians degrees.
//! With the radius of the body degrees become metres ([`ReadOptions::body_radius_m`]).
//!
//! **Orientation.** Row 0 of a map is its northernmost row; a file that begins in the south is turned over. Rotated maps and maps that
//! run from east to west are refused.
//!
//! **Area or point.** Map coordinates belong to the centres of pixels. A file that states them for a corner (a GeoTIFF whose pixels are
//! areas, `xllcorner`) is shifted by half a pixel; one that states them for a centre (pixels are points, `xllcenter`) is not.
//!
//! **Memory.** Nothing is allocated for more pixels than [`ReadOptions::max_pixels`] or than the bytes of the input can hold. Reading
//! takes 12 bytes for each pixel; GeoTIFF keeps decoded strips or tiles up to 64 MiB in addition.

use std::io::{Read, Seek, SeekFrom};

use crate::{ElevationMap, TerrainError};

mod ascii;
mod chunks;
mod degrees;
mod digits;
mod geo_keys;
mod geotiff;
mod npy;
mod pds;
mod pds3;
mod pds4;
mod picture;
mod png_map;
mod raw;
mod relief;
mod sample;
mod source;
mod windows;

pub use ascii::write_ascii_grid;
pub use degrees::Equirectangular;
pub use geo_keys::GeoKeys;
pub use geotiff::{GeoTiffOptions, GeoTiffWriter, write_geotiff};
pub use npy::write_npy;
pub use picture::{ColourMap, Legend, write_png};
pub use relief::{Mark, ReliefPicture, Tint};
pub use windows::Windows;

/// A file format of elevation maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// TIFF with or without geographic tags, BigTIFF.
    Tiff,
    /// ESRI ASCII grid.
    AsciiGrid,
    /// NumPy array.
    Npy,
    /// PDS3 label, with the raster behind it or in a file of its own.
    Pds3,
    /// PDS4 label; the raster is always in a file of its own.
    Pds4,
    /// Portable network graphics.
    Png,
}

impl Format {
    /// The format of a file that begins with `start`; a few hundred bytes are enough.
    pub fn detect(start: &[u8]) -> Option<Format> {
        let is_tiff = |s: &[u8]| matches!(s, b"II*\0" | b"MM\0*" | b"II+\0" | b"MM\0+");
        if start.get(..4).is_some_and(is_tiff) {
            return Some(Format::Tiff);
        }
        if start.starts_with(b"\x93NUMPY") {
            return Some(Format::Npy);
        }
        if start.starts_with(b"\x89PNG\r\n\x1a\n") {
            return Some(Format::Png);
        }
        let text = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start).trim_ascii_start();
        let begins =
            |word: &str| text.get(..word.len()).is_some_and(|t| t.eq_ignore_ascii_case(word.as_bytes()));
        if begins("<?xml") || begins("<Product_") {
            return Some(Format::Pds4);
        }
        if ["PDS_VERSION_ID", "ODL_VERSION_ID", "CCSD3ZF", "/*"].into_iter().any(begins) {
            return Some(Format::Pds3);
        }
        ascii::KEYS.into_iter().any(begins).then_some(Format::AsciiGrid)
    }

    /// Its usual name.
    pub fn name(self) -> &'static str {
        match self {
            Format::Tiff => geotiff::NAME,
            Format::AsciiGrid => ascii::NAME,
            Format::Npy => npy::NAME,
            Format::Pds3 => pds3::NAME,
            Format::Pds4 => pds4::NAME,
            Format::Png => png_map::NAME,
        }
    }
}

/// Settings of the reader: facts that a file may not state, and a limit on its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOptions {
    /// Size of a square pixel, m. It replaces the geometry of the file: the centre of pixel (0, 0) becomes the origin. Needed where the
    /// file states no size.
    pub pixel_m: Option<f64>,
    /// Radius of the body, m: a map in degrees becomes one of square pixels in metres on this sphere ([`Equirectangular`]). Without it
    /// such a map stays in degrees; one in metres needs none.
    pub body_radius_m: Option<f64>,
    /// Factor of the heights of the file; for grey levels, metres in one level.
    pub z_scale: f64,
    /// Added to the scaled heights, m.
    pub z_offset: f64,
    /// A stored number that stands for a gap, beside those the file states.
    pub nodata: Option<f64>,
    /// Most pixels that may be held at once.
    pub max_pixels: u64,
}

impl Default for ReadOptions {
    /// The file's own geometry and heights; at most 2^28 pixels.
    fn default() -> ReadOptions {
        ReadOptions {
            pixel_m: None,
            body_radius_m: None,
            z_scale: 1.0,
            z_offset: 0.0,
            nodata: None,
            max_pixels: 1 << 28,
        }
    }
}

/// Reads a whole map.
///
/// # Errors
/// A file that cannot be read, is damaged or not supported; more pixels than [`ReadOptions::max_pixels`]; a map of gaps alone.
pub fn read<R: Read + Seek>(reader: R, options: &ReadOptions) -> Result<ElevationMap, TerrainError> {
    Windows::open(reader, options)?.whole()
}

/// Reads a whole map whose label (PDS3 or PDS4) is apart from its raster.
///
/// # Errors
/// As of [`read`].
///
/// # Examples
/// ```
/// use apsides_terrain::io::{ReadOptions, read_labelled};
/// use std::io::Cursor;
///
/// let label = "PDS_VERSION_ID = PDS3
/// ^IMAGE = \"HEIGHTS.IMG\"
/// OBJECT = IMAGE
/// LINES = 1
/// LINE_SAMPLES = 2
/// SAMPLE_TYPE = MSB_INTEGER
/// SAMPLE_BITS = 16
/// SCALING_FACTOR = 0.5
/// END_OBJECT = IMAGE
/// OBJECT = IMAGE_MAP_PROJECTION
/// MAP_SCALE = 0.118 <KM/PIXEL>
/// END_OBJECT = IMAGE_MAP_PROJECTION
/// END
/// ";
/// let heights: Vec<u8> = [20_i16, -6].iter().flat_map(|height| height.to_be_bytes()).collect();
/// let map = read_labelled(label.as_bytes(), Cursor::new(heights), &ReadOptions::default())?;
/// assert_eq!((map.height(0, 0), map.height(0, 1)), (Some(10.0), Some(-3.0)));
/// assert_eq!(map.geometry().square_pixel()?, 118.0);
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn read_labelled<R: Read + Seek>(
    label: &[u8],
    data: R,
    options: &ReadOptions,
) -> Result<ElevationMap, TerrainError> {
    Windows::open_labelled(label, data, options)?.whole()
}

/// A defect of the bytes.
fn malformed(format: &'static str, place: impl Into<String>, problem: impl Into<String>) -> TerrainError {
    TerrainError::Malformed { format, place: place.into(), problem: problem.into() }
}

/// A failure while reading; an early end is a defect of the bytes.
fn unreadable(format: &'static str, place: impl Into<String>, source: std::io::Error) -> TerrainError {
    if source.kind() == std::io::ErrorKind::UnexpectedEof {
        malformed(format, place, "the file ends early")
    } else {
        TerrainError::Io { doing: "reading a map", source }
    }
}

/// A failure while writing.
fn unwritable(source: std::io::Error) -> TerrainError {
    TerrainError::Io { doing: "writing a map", source }
}

/// Length of the input, bytes.
fn length(reader: &mut impl Seek) -> Result<u64, TerrainError> {
    reader.seek(SeekFrom::End(0)).map_err(|e| unreadable("map", "end of the file", e))
}

/// Up to `most` bytes from `at`.
fn bytes_at<R: Read + Seek>(reader: &mut R, at: u64, most: u64) -> std::io::Result<Vec<u8>> {
    reader.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    reader.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The number a keyword, tag or attribute holds as text.
fn number(format: &'static str, place: &str, text: &str) -> Result<f64, TerrainError> {
    let value = text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    value.ok_or_else(|| malformed(format, place, format!("{:?} is not a finite number", shortened(text))))
}

/// The first characters of a text, for messages.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}
