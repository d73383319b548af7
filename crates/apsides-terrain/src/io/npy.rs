//! NumPy arrays of two dimensions (format versions 1, 2 and 3), rows from north to south.

use std::io::{Read, Seek, Write};

use super::raw::{Layout, Raw};
use super::sample::{Order, Sample};
use super::source::{Head, Store};
use super::{bytes_at, malformed, shortened, unreadable, unwritable};
use crate::{ElevationMap, TerrainError};

pub(super) const NAME: &str = "NumPy .npy";

/// Longest header read, bytes.
const LONGEST_HEADER: u64 = 1 << 16;

pub(super) fn open<R: Read + Seek>(mut reader: R, len: u64) -> Result<(Head, Store<R>), TerrainError> {
    let bytes =
        bytes_at(&mut reader, 0, LONGEST_HEADER + 12).map_err(|e| unreadable(NAME, "first bytes", e))?;
    let early = || malformed(NAME, "header", "the file ends early");
    let (begin, size) = match bytes.get(6).ok_or_else(early)? {
        1 => (10, Order::Little.bits(bytes.get(8..10).ok_or_else(early)?)),
        2 | 3 => (12, Order::Little.bits(bytes.get(8..12).ok_or_else(early)?)),
        version => {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: format!("version {version}"),
                supported: "versions 1, 2 and 3",
            });
        }
    };
    if size > LONGEST_HEADER {
        return Err(malformed(
            NAME,
            "header",
            format!("{size} bytes long: at most {LONGEST_HEADER} are allowed"),
        ));
    }
    let start = begin + size as usize;
    let header = std::str::from_utf8(bytes.get(begin..start).ok_or_else(early)?)
        .map_err(|_| malformed(NAME, "header", "not text"))?;
    let (sample, order) = element(field(header, "descr")?)?;
    let by_column = match field(header, "fortran_order")? {
        "True" => true,
        "False" => false,
        other => {
            return Err(malformed(
                NAME,
                "fortran_order",
                format!("{:?}: True or False is allowed", shortened(other)),
            ));
        }
    };
    let [rows, cols] = shape(field(header, "shape")?)?;
    let head = Head::plain(NAME, rows, cols, sample);
    let stored = if by_column { [cols, rows] } else { [rows, cols] };
    let stride = stored[1].saturating_mul(sample.size() as u64);
    let end = stored[0].checked_mul(stride).and_then(|size| size.checked_add(start as u64));
    if let Some(more) =
        end.and_then(|end| len.checked_sub(end)).filter(|more| *more > 0 && !stored.contains(&0))
    {
        return Err(malformed(NAME, "data", format!("{more} bytes after the end of the array")));
    }
    let layout = Layout { by_column, ..Layout::rows(NAME, stored, sample, order, start as u64, stride) };
    Ok((head, Store::Raw(Raw::new(reader, len, layout)?)))
}

/// The text of the value of a key of the header, which is a Python dictionary: a string without its quotes, a tuple without its
/// parentheses, a word.
fn field<'a>(header: &'a str, key: &str) -> Result<&'a str, TerrainError> {
    let missing = || malformed(NAME, "header", format!("no value of {key:?}"));
    let (_, rest) = ['\'', '"']
        .into_iter()
        .find_map(|quote| header.split_once(&format!("{quote}{key}{quote}")))
        .ok_or_else(missing)?;
    let rest = rest.trim_start().strip_prefix(':').ok_or_else(missing)?.trim_start();
    let close = match rest.chars().next().ok_or_else(missing)? {
        '(' => ')',
        quote @ ('\'' | '"') => quote,
        _ => return Ok(rest[..rest.find([',', '}']).ok_or_else(missing)?].trim()),
    };
    rest[1..].split_once(close).map(|(value, _)| value).ok_or_else(missing)
}

fn element(descr: &str) -> Result<(Sample, Order), TerrainError> {
    let unsupported = || TerrainError::Unsupported {
        format: NAME,
        feature: format!("element type {:?}", shortened(descr)),
        supported: "u1, i1, u2, i2, u4, i4, f4 and f8 in either byte order",
    };
    let (order, kind) = match descr.split_at_checked(1) {
        Some(("<", kind)) => (Order::Little, kind),
        Some((">", kind)) => (Order::Big, kind),
        Some(("|" | "=", kind)) => (Order::NATIVE, kind),
        _ => return Err(unsupported()),
    };
    let sample = match kind {
        "u1" => Sample::U8,
        "i1" => Sample::I8,
        "u2" => Sample::U16,
        "i2" => Sample::I16,
        "u4" => Sample::U32,
        "i4" => Sample::I32,
        "f4" => Sample::F32,
        "f8" => Sample::F64,
        _ => return Err(unsupported()),
    };
    Ok((sample, order))
}

fn shape(tuple: &str) -> Result<[u64; 2], TerrainError> {
    let sides: Option<Vec<u64>> =
        tuple.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect();
    let sides = sides.ok_or_else(|| {
        malformed(NAME, "shape", format!("({}): whole numbers are needed", shortened(tuple)))
    })?;
    <[u64; 2]>::try_from(sides).map_err(|sides| TerrainError::Unsupported {
        format: NAME,
        feature: format!("an array of {} dimensions", sides.len()),
        supported: "two dimensions, row and column",
    })
}

/// Writes the heights of a map in metres as an array of `f4`, little-endian, rows from north to south; gaps are NaN. The size of a pixel
/// is not kept.
///
/// # Errors
/// The writer's.
///
/// # Examples
/// ```
/// use apsides_terrain::io::{ReadOptions, read, write_npy};
/// use apsides_terrain::{ElevationMap, Geometry};
/// use std::io::Cursor;
///
/// let map = ElevationMap::from_heights(Geometry::square(2, 3, 10.0)?, &[1.0, 2.0, 3.0, f64::NAN, 5.0, 6.5])?;
/// let mut file = Vec::new();
/// write_npy(&mut file, &map)?;
/// // The size of a pixel is not in such files.
/// let options = ReadOptions { pixel_m: Some(10.0), ..ReadOptions::default() };
/// let again = read(Cursor::new(file), &options)?;
/// assert_eq!((again.height(1, 2), again.height(1, 0)), (Some(6.5), None));
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn write_npy<W: Write>(mut writer: W, map: &ElevationMap) -> Result<(), TerrainError> {
    let geometry = map.geometry();
    let mut header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}",
        geometry.rows(),
        geometry.cols()
    );
    // The header ends with a line feed, and data begin at a multiple of 64 bytes.
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    writer.write_all(&bytes).map_err(unwritable)?;
    for row in 0..geometry.rows() {
        bytes.clear();
        for &z in map.relative().row(row) {
            bytes.extend(((map.datum() + f64::from(z)) as f32).to_le_bytes());
        }
        writer.write_all(&bytes).map_err(unwritable)?;
    }
    writer.flush().map_err(unwritable)
}
