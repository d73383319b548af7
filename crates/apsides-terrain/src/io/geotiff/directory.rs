//! The first image file directory of a TIFF.
//!
//! Nothing is allocated for more bytes than the file has.

use std::io::{Read, Seek};

use super::super::sample::Order;
use super::super::{bytes_at, malformed, unreadable};
use super::NAME;
use crate::TerrainError;

/// Most entries of a directory; the baseline has some thirty tags.
const MOST_ENTRIES: u64 = 1024;
/// Most bytes of the value of one tag.
const LONGEST_VALUE: u64 = 1 << 27;

pub(super) struct Directory {
    pub(super) order: Order,
    entries: Vec<Entry>,
}

struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    /// The value, or nothing where no reader of maps looks at it.
    bytes: Vec<u8>,
}

impl Directory {
    /// Reads the first directory of a file of `len` bytes and the values of `tags`.
    pub(super) fn read<R: Read + Seek>(
        reader: &mut R,
        len: u64,
        tags: &[u16],
    ) -> Result<Directory, TerrainError> {
        let head = exactly(reader, 0, 8, "header")?;
        let order = if head.starts_with(b"MM") { Order::Big } else { Order::Little };
        let big = order.bits(&head[2..4]) == 43;
        let (first, width) = if big {
            if order.bits(&head[4..8])
                != order.bits(&if order == Order::Big { [0, 8, 0, 0] } else { [8, 0, 0, 0] })
            {
                return Err(malformed(NAME, "header", "offsets must have 8 bytes in a BigTIFF"));
            }
            (order.bits(&exactly(reader, 8, 8, "header")?), 20)
        } else {
            (order.bits(&head[4..8]), 12)
        };
        let prefix = if big { 8 } else { 2 };
        let count = order.bits(&exactly(reader, first, prefix, "directory")?);
        if count == 0 || count > MOST_ENTRIES {
            let problem = format!("{count} entries: 1 to {MOST_ENTRIES} are allowed");
            return Err(malformed(NAME, "directory", problem));
        }
        let table = exactly(reader, first + prefix, count * width, "directory")?;
        let mut entries: Vec<Entry> = Vec::with_capacity(count as usize);
        for entry in table.chunks_exact(width as usize) {
            let tag = order.bits(&entry[..2]) as u16;
            let kind = order.bits(&entry[2..4]) as u16;
            let (count, inline) = entry[4..].split_at(if big { 8 } else { 4 });
            let count = order.bits(count);
            let place = || format!("tag {tag}");
            if entries.iter().any(|e| e.tag == tag) {
                return Err(malformed(NAME, place(), "stated twice"));
            }
            let size = count.checked_mul(size_of_kind(kind)).filter(|&s| s <= len.min(LONGEST_VALUE));
            let size = size.ok_or_else(|| {
                malformed(NAME, place(), format!("{count} values do not fit into a file of {len} bytes"))
            })?;
            let bytes = if size <= inline.len() as u64 {
                inline[..size as usize].to_vec()
            } else if tags.contains(&tag) {
                exactly(reader, order.bits(inline), size, &place())?
            } else {
                Vec::new()
            };
            entries.push(Entry { tag, kind, count, bytes });
        }
        Ok(Directory { order, entries })
    }

    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|e| e.tag == tag)
    }

    pub(super) fn contains(&self, tag: u16) -> bool {
        self.entry(tag).is_some()
    }

    /// Whole numbers of a tag (BYTE, SHORT, LONG, LONG8); none if it is absent.
    pub(super) fn whole(&self, tag: u16) -> Result<Option<Vec<u64>>, TerrainError> {
        let Some(entry) = self.entry(tag) else { return Ok(None) };
        if !matches!(entry.kind, 1 | 3 | 4 | 16) {
            return Err(malformed(NAME, format!("tag {tag}"), "whole numbers are needed"));
        }
        let size = size_of_kind(entry.kind) as usize;
        Ok(Some(entry.bytes.chunks_exact(size).map(|b| self.order.bits(b)).collect()))
    }

    /// The one whole number of a tag; `default` if it is absent.
    pub(super) fn single(&self, tag: u16, default: Option<u64>) -> Result<u64, TerrainError> {
        match (self.whole(tag)?.as_deref(), default) {
            (Some([value]), _) => Ok(*value),
            (None, Some(value)) => Ok(value),
            (None, None) => Err(malformed(NAME, format!("tag {tag}"), "missing")),
            (Some(values), _) => {
                Err(malformed(NAME, format!("tag {tag}"), format!("{} values instead of one", values.len())))
            }
        }
    }

    /// Finite real numbers of a tag (DOUBLE); none if it is absent.
    pub(super) fn reals(&self, tag: u16) -> Result<Option<Vec<f64>>, TerrainError> {
        let Some(entry) = self.entry(tag) else { return Ok(None) };
        let values: Vec<f64> =
            entry.bytes.chunks_exact(8).map(|b| f64::from_bits(self.order.bits(b))).collect();
        if entry.kind != 12 || !values.iter().all(|v| v.is_finite()) {
            return Err(malformed(NAME, format!("tag {tag}"), "finite DOUBLE numbers are needed"));
        }
        Ok(Some(values))
    }

    /// Text of a tag (ASCII), up to the closing zero; none if it is absent.
    pub(super) fn text(&self, tag: u16) -> Result<Option<String>, TerrainError> {
        let Some(entry) = self.entry(tag) else { return Ok(None) };
        if entry.kind != 2 || (entry.count > 0 && entry.bytes.is_empty()) {
            return Err(malformed(NAME, format!("tag {tag}"), "text is needed"));
        }
        let end = entry.bytes.iter().position(|&b| b == 0).unwrap_or(entry.bytes.len());
        Ok(Some(String::from_utf8_lossy(&entry.bytes[..end]).into_owned()))
    }
}

/// Size of a value of a field type of TIFF 6.0 or BigTIFF; unknown types count as bytes.
fn size_of_kind(kind: u16) -> u64 {
    match kind {
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 1,
    }
}

fn exactly<R: Read + Seek>(
    reader: &mut R,
    at: u64,
    count: u64,
    place: &str,
) -> Result<Vec<u8>, TerrainError> {
    let bytes = bytes_at(reader, at, count).map_err(|e| unreadable(NAME, place, e))?;
    if (bytes.len() as u64) < count {
        return Err(malformed(NAME, place, "the file ends early"));
    }
    Ok(bytes)
}
