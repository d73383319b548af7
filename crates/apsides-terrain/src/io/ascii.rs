//! ESRI ASCII grids: keywords with numbers, then the heights from the north-western pixel, row by row.

use std::io::{BufRead, BufReader, Read, Seek, Write};

use super::sample::Sample;
use super::source::{Head, Store};
use super::{malformed, number, shortened, unreadable, unwritable};
use crate::{ElevationMap, TerrainError};

pub(super) const NAME: &str = "ESRI ASCII grid";

pub(super) const KEYS: [&str; 10] = [
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "dx",
    "dy",
    "nodata_value",
];

/// Longest keyword or number, bytes.
const LONGEST: usize = 64;

/// Words of a text between white space.
struct Words<R> {
    reader: BufReader<R>,
    word: Vec<u8>,
}

impl<R: Read> Words<R> {
    /// The next word into `self.word`; whether there is one.
    fn advance(&mut self) -> Result<bool, TerrainError> {
        self.word.clear();
        loop {
            let buffer = self.reader.fill_buf().map_err(|e| unreadable(NAME, "text", e))?;
            if buffer.is_empty() {
                return Ok(!self.word.is_empty());
            }
            let skip = if self.word.is_empty() {
                buffer.iter().take_while(|b| b.is_ascii_whitespace()).count()
            } else {
                0
            };
            let rest = &buffer[skip..];
            let count = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
            let done = count < rest.len();
            if self.word.len() + count > LONGEST {
                return Err(malformed(NAME, "text", format!("a word of more than {LONGEST} characters")));
            }
            self.word.extend_from_slice(&rest[..count]);
            self.reader.consume(skip + count);
            if done {
                return Ok(true);
            }
        }
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(&self.word).into_owned()
    }
}

pub(super) fn open<R: Read + Seek>(
    reader: R,
    len: u64,
    max_pixels: u64,
) -> Result<(Head, Store<R>), TerrainError> {
    let mut words = Words { reader: BufReader::with_capacity(1 << 16, reader), word: Vec::new() };
    let mut values = [None; KEYS.len()];
    let early = || malformed(NAME, "text", "the file ends early");
    loop {
        if !words.advance()? {
            return Err(early());
        }
        let Some(key) =
            KEYS.iter().position(|k| words.text().trim_start_matches('\u{feff}').eq_ignore_ascii_case(k))
        else {
            break;
        };
        if values[key].is_some() {
            return Err(malformed(NAME, KEYS[key], "stated twice"));
        }
        if !words.advance()? {
            return Err(early());
        }
        // A gap may be written as NaN.
        let value = words.text();
        let gap = KEYS[key] == "nodata_value" && value.eq_ignore_ascii_case("nan");
        values[key] = Some(if gap { f64::NAN } else { number(NAME, KEYS[key], &value)? });
    }
    let mut head = head(values)?;
    let Head { rows, cols, .. } = head;
    let pixels = rows.saturating_mul(cols);
    if pixels > max_pixels {
        return Err(TerrainError::TooLarge { rows, cols, limit: max_pixels });
    }
    // A height takes a digit and a space at least.
    if pixels > len / 2 + 1 {
        let problem = format!("{rows} x {cols} pixels do not fit into the {len} bytes of the file");
        return Err(malformed(NAME, "size of the map", problem));
    }
    let mut held = Vec::with_capacity(pixels as usize);
    loop {
        let place = || format!("row {}, column {}", held.len() as u64 / cols, held.len() as u64 % cols);
        let text = std::str::from_utf8(&words.word).ok();
        let value = text.and_then(|t| t.parse::<f64>().ok());
        let Some(value) = value else {
            let problem = format!("{:?} is not a number", shortened(&words.text()));
            return Err(malformed(NAME, place(), problem));
        };
        held.push(value);
        let more = words.advance()?;
        match (held.len() as u64 == pixels, more) {
            (true, false) => break,
            (true, true) => return Err(malformed(NAME, "text", format!("more than {pixels} heights"))),
            (false, true) => {}
            (false, false) => return Err(early()),
        }
    }
    head.sample = Sample::F64;
    Ok((head, Store::Held(held)))
}

fn head(values: [Option<f64>; KEYS.len()]) -> Result<Head, TerrainError> {
    let [cols, rows, x_corner, x_centre, y_corner, y_centre, cell, dx, dy, nodata] = values;
    let side = |name: &str, value: Option<f64>| {
        let value = value.ok_or_else(|| malformed(NAME, name, "missing"))?;
        if !(value >= 1.0 && value.fract() == 0.0 && value < 4294967296.0) {
            return Err(malformed(
                NAME,
                name,
                format!("{value}: a whole number from 1 to 2^32 - 1 is allowed"),
            ));
        }
        Ok(value as u64)
    };
    let mut head = Head::plain(NAME, side("nrows", rows)?, side("ncols", cols)?, Sample::F64);
    let pixel = match (cell, dx, dy) {
        (Some(cell), None, None) => [cell; 2],
        (None, Some(dx), Some(dy)) => [dx, dy],
        _ => return Err(malformed(NAME, "cellsize", "either cellsize or dx and dy is needed")),
    };
    let place = |name: &str, corner: Option<f64>, centre: Option<f64>, pixel: f64| match (corner, centre) {
        (Some(corner), None) => Ok(corner + 0.5 * pixel),
        (None, Some(centre)) => Ok(centre),
        _ => Err(malformed(NAME, name, "either the corner or the centre is needed")),
    };
    let west = place("xllcorner", x_corner, x_centre, pixel[0])?;
    let south = place("yllcorner", y_corner, y_centre, pixel[1])?;
    head.pixel = Some(pixel);
    head.north_west = [west, south + (head.rows - 1) as f64 * pixel[1]];
    head.missing.extend(nodata);
    Ok(head)
}

/// Writes the heights of a map in metres as an ESRI ASCII grid with `xllcorner` and `yllcorner`; `nodata` stands for gaps. Oblong pixels
/// are written with `dx` and `dy`. The unit of the map coordinates is not kept.
///
/// # Errors
/// The writer's; a `nodata` that is not finite or that is a height of the map.
///
/// # Examples
/// ```
/// use apsides_terrain::io::{ReadOptions, read, write_ascii_grid};
/// use apsides_terrain::{ElevationMap, Geometry};
/// use std::io::Cursor;
///
/// let map = ElevationMap::from_heights(Geometry::square(2, 3, 10.0)?, &[1.0, 2.0, 3.0, f64::NAN, 5.0, 6.5])?;
/// let mut file = Vec::new();
/// write_ascii_grid(&mut file, &map, -9999.0)?;
/// let again = read(Cursor::new(file), &ReadOptions::default())?;
/// assert_eq!((again.height(1, 2), again.height(1, 0)), (Some(6.5), None));
/// assert_eq!(again.geometry(), map.geometry());
/// # Ok::<(), apsides_terrain::TerrainError>(())
/// ```
pub fn write_ascii_grid<W: Write>(
    mut writer: W,
    map: &ElevationMap,
    nodata: f64,
) -> Result<(), TerrainError> {
    let g = map.geometry();
    let taken = (0..g.rows()).any(|r| (0..g.cols()).any(|c| map.height(r, c) == Some(nodata)));
    if !nodata.is_finite() || taken {
        let allowed = "it must be finite and not a height of the map";
        return Err(TerrainError::Number { name: "number for gaps", value: nodata, allowed: allowed.into() });
    }
    let [dx, dy] = g.pixel();
    let [west, south] = g.position(g.rows() as f64 - 0.5, -0.5);
    let size = if dx == dy { format!("cellsize {dx}") } else { format!("dx {dx}\ndy {dy}") };
    let mut text = format!(
        "ncols {}\nnrows {}\nxllcorner {west}\nyllcorner {south}\n{size}\nNODATA_value {nodata}\n",
        g.cols(),
        g.rows()
    );
    for row in 0..g.rows() {
        for col in 0..g.cols() {
            use std::fmt::Write as _;
            let z = map.height(row, col).unwrap_or(nodata);
            let space = if col == 0 { "" } else { " " };
            // A `String` takes every text.
            let _ = write!(text, "{space}{z}");
        }
        text.push('\n');
        writer.write_all(text.as_bytes()).map_err(unwritable)?;
        text.clear();
    }
    writer.flush().map_err(unwritable)
}
