//! Strips and tiles of LERC (<https://github.com/Esri/lerc>), as libtiff writes them: a blob each, packed once more if the parameters say so.

use std::io::Read;

use flate2::bufread::ZlibDecoder;
use lerc_core::PixelData;

use super::super::sample::{Order, Sample};
use super::{LARGEST, LercPacking, codec};

/// The numbers of a strip or tile.
pub(super) struct Form {
    pub(super) sample: Sample,
    pub(super) order: Order,
    pub(super) cols: usize,
    /// Rows of a whole strip or tile; the last strip may have fewer.
    pub(super) rows: usize,
}

/// Decodes a strip or tile to bytes in the order of the file, of which the first `rows` rows are kept; pixels without a number become NaN.
///
/// The numbers of a blob are those of the file's bytes read in little-endian order, in big-endian files too: libtiff swaps bytes before
/// it packs and after it unpacks.
pub(super) fn decode(
    packing: LercPacking,
    packed: &[u8],
    form: Form,
    rows: usize,
) -> Result<Vec<u8>, String> {
    let Form { sample, order, cols, rows: most_rows } = form;
    // A blob is hardly longer than its numbers.
    let longest = (2 * most_rows as u64 * cols as u64 * sample.size() as u64 + 4096).min(LARGEST);
    let mut unpacked = Vec::new();
    let unpacking = match packing {
        LercPacking::None => None,
        LercPacking::Deflate => Some(ZlibDecoder::new(packed).take(longest).read_to_end(&mut unpacked)),
        LercPacking::Zstd => Some(codec::zstd(packed)?.take(longest).read_to_end(&mut unpacked)),
    };
    let blob = if unpacking.transpose().map_err(|e| e.to_string())?.is_some() { &unpacked } else { packed };
    let info = lerc_reader::inspect_first(blob).map_err(|e| e.to_string())?;
    let (width, height, bands) = (info.width as usize, info.height as usize, info.depth);
    if bands != 1 || width != cols || !(rows..=most_rows).contains(&height) {
        return Err(format!(
            "a blob of {height} x {width} pixels and {bands} bands instead of {most_rows} x {cols} and 1"
        ));
    }
    let decoded = lerc_reader::decode_first(blob).map_err(|e| e.to_string())?;
    let kept = Kept { count: rows * cols, mask: decoded.mask.as_deref() };
    let bytes = match (sample, &decoded.pixels) {
        (Sample::I8, PixelData::I8(v)) => kept.integers(v, i8::to_le_bytes)?,
        (Sample::U8, PixelData::U8(v)) => kept.integers(v, u8::to_le_bytes)?,
        (Sample::I16, PixelData::I16(v)) => kept.integers(v, i16::to_le_bytes)?,
        (Sample::U16, PixelData::U16(v)) => kept.integers(v, u16::to_le_bytes)?,
        (Sample::I32, PixelData::I32(v)) => kept.integers(v, i32::to_le_bytes)?,
        (Sample::U32, PixelData::U32(v)) => kept.integers(v, u32::to_le_bytes)?,
        (Sample::F32, PixelData::F32(v)) => {
            let gap = f32::NAN.to_bits();
            let gap = if order == Order::Little { gap } else { gap.swap_bytes() };
            kept.bytes(v, f32::from_bits(gap), f32::to_le_bytes)
        }
        (Sample::F64, PixelData::F64(v)) => {
            let gap = f64::NAN.to_bits();
            let gap = if order == Order::Little { gap } else { gap.swap_bytes() };
            kept.bytes(v, f64::from_bits(gap), f64::to_le_bytes)
        }
        (_, other) => return Err(format!("a blob of {:?} numbers instead of {sample:?}", other.data_type())),
    };
    if bytes.len() < kept.count * sample.size() {
        return Err("the blob ends early".to_owned());
    }
    Ok(bytes)
}

/// The first pixels of a blob, and which of them have a number.
struct Kept<'a> {
    count: usize,
    mask: Option<&'a [u8]>,
}

impl Kept<'_> {
    fn valid(&self, k: usize) -> bool {
        self.mask.is_none_or(|mask| mask.get(k).is_some_and(|&v| v != 0))
    }

    fn bytes<T: Copy, const N: usize>(&self, values: &[T], gap: T, to_bytes: fn(T) -> [u8; N]) -> Vec<u8> {
        let kept = values.iter().take(self.count).enumerate();
        kept.flat_map(|(k, &v)| to_bytes(if self.valid(k) { v } else { gap })).collect()
    }

    /// Integers have no number that stands for a gap.
    fn integers<T: Copy + Default, const N: usize>(
        &self,
        values: &[T],
        to_bytes: fn(T) -> [u8; N],
    ) -> Result<Vec<u8>, String> {
        if !(0..self.count).all(|k| self.valid(k)) {
            return Err("pixels without a number among integers".to_owned());
        }
        Ok(self.bytes(values, T::default(), to_bytes))
    }
}
