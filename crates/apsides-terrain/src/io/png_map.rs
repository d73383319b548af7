//! Grey PNG pictures as maps.

use std::io::{BufReader, Read, Seek};

use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::malformed;
use super::sample::{Order, Sample};
use super::source::{Head, Store};
use crate::TerrainError;

pub(super) const NAME: &str = "PNG";

pub(super) fn open<R: Read + Seek>(
    reader: R,
    len: u64,
    max_pixels: u64,
) -> Result<(Head, Store<R>), TerrainError> {
    let damaged = |e: png::DecodingError| malformed(NAME, "picture", e.to_string());
    // Texts and colour profiles are not looked at: a small limit keeps them small.
    let mut decoder = Decoder::new_with_limits(BufReader::new(reader), Limits { bytes: 1 << 26 });
    decoder.set_transformations(Transformations::IDENTITY);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let info = decoder.read_header_info().map_err(damaged)?;
    let (rows, cols) = (u64::from(info.height), u64::from(info.width));
    let sample = match (info.color_type, info.bit_depth) {
        (ColorType::Grayscale, BitDepth::Eight) => Sample::U8,
        (ColorType::Grayscale, BitDepth::Sixteen) => Sample::U16,
        (colour, depth) => {
            return Err(TerrainError::Unsupported {
                format: NAME,
                feature: format!("{colour:?} with {} bits", depth as u8),
                supported: "grey without transparency with 8 or 16 bits",
            });
        }
    };
    if rows * cols > max_pixels {
        return Err(TerrainError::TooLarge { rows, cols, limit: max_pixels });
    }
    // 258 bytes from two bits of deflate.
    if rows * cols * sample.size() as u64 > len.saturating_mul(1032) {
        let problem = format!("{rows} x {cols} pixels do not fit into the {len} bytes of the file");
        return Err(malformed(NAME, "size of the map", problem));
    }
    let mut reader = decoder.read_info().map_err(damaged)?;
    let size = reader.output_buffer_size().ok_or_else(|| malformed(NAME, "size of the map", "too large"))?;
    let mut bytes = vec![0; size];
    reader.next_frame(&mut bytes).map_err(damaged)?;
    let mut held = vec![f64::NAN; (rows * cols) as usize];
    sample.decode(&bytes, Order::Big, &mut held);
    Ok((Head::plain(NAME, rows, cols, sample), Store::Held(held)))
}
