//! PDS3 labels (Planetary Data System Standards Reference 3.8, chapter 12 and appendices A and C): an `IMAGE` object with one band, before
//! its raster or in a file of its own.
//!
//! `MAP_SCALE` is in km for each pixel unless its unit says metres; with `MAP_RESOLUTION` alone (pixels for each degree) the map is in
//! degrees. The centre of the first pixel is at (-`SAMPLE_PROJECTION_OFFSET`, `LINE_PROJECTION_OFFSET`) pixels from the origin of the
//! projection, as the data dictionary has it; archives differ in this by half a pixel.

use std::io::{Read, Seek};

use super::pds::{LONGEST_LABEL, RowLayout, raster};
use super::sample::{Order, Sample};
use super::source::{Head, Store};
use super::{bytes_at, malformed, number, shortened, unreadable};
use crate::{MapUnit, TerrainError};

pub(super) const NAME: &str = "PDS3";

/// A label before its raster.
pub(super) fn open<R: Read + Seek>(mut reader: R, len: u64) -> Result<(Head, Store<R>), TerrainError> {
    let label = bytes_at(&mut reader, 0, LONGEST_LABEL).map_err(|e| unreadable(NAME, "label", e))?;
    let label = Label::parse(&label);
    let pointer = label.get("^IMAGE")?;
    if pointer.contains('"') {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("a label without its raster (in {})", shortened(pointer)),
            supported: "label and raster together (read_labelled)",
        });
    }
    described(&label, pointer, reader, len)
}

/// A label in a file of its own; `data` is the file it points to.
pub(super) fn open_labelled<R: Read + Seek>(
    label: &[u8],
    data: R,
    len: u64,
) -> Result<(Head, Store<R>), TerrainError> {
    let label = Label::parse(&label[..label.len().min(LONGEST_LABEL as usize)]);
    let pointer = label.get("^IMAGE")?;
    // ("FILE.IMG", 3 <BYTES>) or "FILE.IMG".
    let place = pointer.rsplit_once('"').map_or(pointer, |(_, rest)| rest);
    let place = place.trim_matches(['(', ')', ',', ' ', '\t']);
    described(&label, if place.is_empty() { "1" } else { place }, data, len)
}

fn described<R: Read + Seek>(
    label: &Label,
    pointer: &str,
    data: R,
    len: u64,
) -> Result<(Head, Store<R>), TerrainError> {
    let one = |key: &str| Ok(label.whole(key)?.unwrap_or(1));
    if one("BANDS")? != 1 {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("{} bands", one("BANDS")?),
            supported: "one band",
        });
    }
    if let Some(kind) = label.find("ENCODING_TYPE").filter(|k| !matches!(k.trim_matches('"'), "N/A" | "NONE"))
    {
        return Err(TerrainError::Unsupported {
            format: NAME,
            feature: format!("encoding {}", shortened(kind)),
            supported: "rasters without encoding",
        });
    }
    let bits = label.needed("SAMPLE_BITS")?;
    let (sample, order) = element(label.get("SAMPLE_TYPE")?, bits)?;
    let mut head = Head::plain(NAME, label.needed("LINES")?, label.needed("LINE_SAMPLES")?, sample);
    head.scale = label.real("SCALING_FACTOR")?.unwrap_or(1.0);
    head.offset = label.real("OFFSET")?.unwrap_or(0.0);
    for key in ["MISSING_CONSTANT", "MISSING", "NULL", "CORE_NULL", "INVALID_CONSTANT"] {
        if let Some(text) = label.find(key) {
            for text in text.trim_matches(['(', ')']).split(',') {
                head.missing.extend(constant(key, text, sample)?);
            }
        }
    }
    place(label, &mut head)?;

    let (count, unit) = split_unit(pointer);
    let count = count.parse::<u64>().ok().filter(|&n| n > 0);
    let count = count.ok_or_else(|| {
        malformed(NAME, "^IMAGE", format!("{:?}: a record or a byte from 1 is needed", shortened(pointer)))
    })?;
    let record = if unit.is_some_and(|u| u.eq_ignore_ascii_case("bytes")) {
        1
    } else if count == 1 {
        0
    } else {
        label.needed("RECORD_BYTES")?
    };
    let overflow = || malformed(NAME, "size of the map", "too large");
    let start = (count - 1).checked_mul(record).ok_or_else(overflow)?;
    let prefix = label.whole("LINE_PREFIX_BYTES")?.unwrap_or(0);
    let suffix = label.whole("LINE_SUFFIX_BYTES")?.unwrap_or(0);
    let stride = head.cols.checked_mul(sample.size() as u64);
    let stride = stride.and_then(|s| s.checked_add(prefix)?.checked_add(suffix)).ok_or_else(overflow)?;
    let start = start.checked_add(prefix).ok_or_else(overflow)?;
    raster(head, RowLayout { order, start, stride }, data, len)
}

fn element(kind: &str, bits: u64) -> Result<(Sample, Order), TerrainError> {
    let kind = kind.trim_matches(['"', '\'']);
    let found = match kind {
        "MSB_INTEGER" | "INTEGER" | "MAC_INTEGER" | "SUN_INTEGER" => {
            Sample::integer(bits, true).map(|s| (s, Order::Big))
        }
        "MSB_UNSIGNED_INTEGER" | "UNSIGNED_INTEGER" | "MAC_UNSIGNED_INTEGER" | "SUN_UNSIGNED_INTEGER" => {
            Sample::integer(bits, false).map(|s| (s, Order::Big))
        }
        "LSB_INTEGER" | "PC_INTEGER" | "VAX_INTEGER" => {
            Sample::integer(bits, true).map(|s| (s, Order::Little))
        }
        "LSB_UNSIGNED_INTEGER" | "PC_UNSIGNED_INTEGER" | "VAX_UNSIGNED_INTEGER" => {
            Sample::integer(bits, false).map(|s| (s, Order::Little))
        }
        "IEEE_REAL" | "REAL" | "FLOAT" | "MAC_REAL" | "SUN_REAL" => {
            Sample::real(bits).map(|s| (s, Order::Big))
        }
        "PC_REAL" => Sample::real(bits).map(|s| (s, Order::Little)),
        _ => None,
    };
    found.ok_or_else(|| TerrainError::Unsupported {
        format: NAME,
        feature: format!("SAMPLE_TYPE {} of {bits} bits", shortened(kind)),
        supported: "MSB and LSB integers of 8, 16 and 32 bits, IEEE_REAL and PC_REAL of 32 and 64 bits",
    })
}

/// A number that stands for gaps, in decimal or as bits (`16#FF7FFFFB#`).
fn constant(key: &str, text: &str, sample: Sample) -> Result<Option<f64>, TerrainError> {
    let text = split_unit(text.trim().trim_matches('"')).0;
    if ["", "NULL", "N/A", "UNK"].contains(&text) {
        return Ok(None);
    }
    if let Some((radix, digits)) = text.trim_end_matches('#').split_once('#') {
        let radix = radix.parse().ok().filter(|r| (2..=16).contains(r));
        let bits = radix.and_then(|r| u64::from_str_radix(digits, r).ok());
        let bits =
            bits.ok_or_else(|| malformed(NAME, key, format!("{:?} is not a number", shortened(text))))?;
        return Ok(Some(sample.of_bits(bits)));
    }
    number(NAME, key, text).map(Some)
}

/// Puts size, place and unit of the pixels into `head`.
fn place(label: &Label, head: &mut Head) -> Result<(), TerrainError> {
    let pixel = if let Some(scale) = label.find("MAP_SCALE") {
        let (value, unit) = split_unit(scale);
        let value = number(NAME, "MAP_SCALE", value)?;
        let unit = unit.unwrap_or("KM/PIXEL").to_ascii_uppercase();
        match unit.split('/').next().map(str::trim) {
            Some("KM" | "KILOMETERS" | "KILOMETER") => 1000.0 * value,
            Some("M" | "METERS" | "METER") => value,
            _ => return Err(malformed(NAME, "MAP_SCALE", format!("unit {:?}", shortened(&unit)))),
        }
    } else if let Some(resolution) = label.real("MAP_RESOLUTION")? {
        head.unit = MapUnit::Degree;
        if let Some(radius) = label.find("A_AXIS_RADIUS") {
            // In km, whether the unit stands behind it or not.
            head.radius_m = Some(1000.0 * number(NAME, "A_AXIS_RADIUS", split_unit(radius).0)?);
        }
        1.0 / resolution
    } else {
        return Ok(());
    };
    head.pixel = Some([pixel; 2]);
    let west = label.real("SAMPLE_PROJECTION_OFFSET")?.unwrap_or(0.0);
    let north = label.real("LINE_PROJECTION_OFFSET")?.unwrap_or(0.0);
    head.north_west = [-west * pixel, north * pixel];
    Ok(())
}

/// A value and the unit in angle brackets behind it.
fn split_unit(text: &str) -> (&str, Option<&str>) {
    match text.split_once('<') {
        Some((value, unit)) => (value.trim(), Some(unit.trim_end().trim_end_matches('>').trim())),
        None => (text.trim(), None),
    }
}

/// Keywords of a label with their values as text. Keywords inside `IMAGE` and `IMAGE_MAP_PROJECTION` come before those outside; those of
/// other objects are left out.
struct Label {
    keys: Vec<(String, String)>,
}

impl Label {
    fn parse(bytes: &[u8]) -> Label {
        let text = String::from_utf8_lossy(bytes);
        let mut keys: Vec<(String, String)> = Vec::new();
        let mut objects: Vec<String> = Vec::new();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            // A comment takes the rest of its line.
            let line = line.split("/*").next().unwrap_or_default().trim();
            if line == "END" {
                break;
            }
            let Some((key, value)) = line.split_once('=') else { continue };
            let (key, mut value) = (key.trim().to_ascii_uppercase(), value.trim().to_owned());
            // A list or a text may go on over several lines.
            let open = |v: &str| {
                v.matches('"').count() % 2 == 1
                    || v.matches('(').count() > v.matches(')').count()
                    || v.is_empty()
            };
            for _ in 0..64 {
                if !open(&value) {
                    break;
                }
                let Some(next) = lines.next() else { break };
                value.push(' ');
                value.push_str(next.trim());
            }
            match key.as_str() {
                "OBJECT" => objects.push(value.to_ascii_uppercase()),
                "END_OBJECT" => {
                    objects.pop();
                }
                _ if objects.iter().all(|o| {
                    matches!(o.as_str(), "IMAGE" | "IMAGE_MAP_PROJECTION" | "UNCOMPRESSED_FILE")
                }) =>
                {
                    let value = (key, value);
                    if objects.is_empty() { keys.push(value) } else { keys.insert(0, value) }
                }
                _ => {}
            }
        }
        Label { keys }
    }

    fn find(&self, key: &str) -> Option<&str> {
        self.keys.iter().find(|(k, _)| k == key).map(|(_, value)| value.trim())
    }

    fn get(&self, key: &str) -> Result<&str, TerrainError> {
        self.find(key).ok_or_else(|| malformed(NAME, key, "missing"))
    }

    fn real(&self, key: &str) -> Result<Option<f64>, TerrainError> {
        let known =
            self.find(key).filter(|t| !["\"N/A\"", "N/A", "NULL", "\"NULL\"", "UNK", "\"UNK\""].contains(t));
        known.map(|t| number(NAME, key, split_unit(t).0)).transpose()
    }

    fn whole(&self, key: &str) -> Result<Option<u64>, TerrainError> {
        let read = |t: &str| {
            let text = split_unit(t).0;
            text.parse().map_err(|_| {
                malformed(NAME, key, format!("{:?} is not a whole number from 0", shortened(text)))
            })
        };
        self.find(key).map(read).transpose()
    }

    fn needed(&self, key: &str) -> Result<u64, TerrainError> {
        self.whole(key)?.ok_or_else(|| malformed(NAME, key, "missing"))
    }
}
