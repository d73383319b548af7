//! Compression and predictors of TIFF 6.0 (sections 9, 13, 14) and of its technical note 3 (floating-point predictor); zstd (RFC 8878).

use std::io::Read;

use flate2::bufread::ZlibDecoder;
use ruzstd::decoding::StreamingDecoder;
use weezl::LzwStatus;
use weezl::decode::Decoder;

use super::super::sample::Order;
use super::Compression;

/// Fills `out` from compressed bytes. What follows in the stream is not looked at.
pub(super) fn unpack(compression: Compression, packed: &[u8], out: &mut [u8]) -> Result<(), String> {
    match compression {
        Compression::None => {
            let stored = packed.get(..out.len()).ok_or("the stream ends early")?;
            out.copy_from_slice(stored);
            Ok(())
        }
        Compression::Deflate => ZlibDecoder::new(packed).read_exact(out).map_err(|e| e.to_string()),
        Compression::Lzw => unpack_lzw(packed, out),
        Compression::PackBits => unpack_bits(packed, out),
        Compression::Zstd => zstd(packed)?.read_exact(out).map_err(|e| e.to_string()),
        Compression::Lerc(_) => Err("LERC has numbers, no bytes".to_owned()),
    }
}

/// Most bytes that a zstd stream may look back, 2^27: the level with the longest window has that.
const LONGEST_WINDOW: u64 = 1 << 27;

/// The bytes of a frame of zstd.
pub(super) fn zstd(packed: &[u8]) -> Result<impl Read, String> {
    StreamingDecoder::new_with_max_window_size(packed, LONGEST_WINDOW).map_err(|e| e.to_string())
}

fn unpack_lzw(mut packed: &[u8], mut out: &mut [u8]) -> Result<(), String> {
    let mut decoder = Decoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
    while !out.is_empty() {
        let step = decoder.decode_bytes(packed, out);
        packed = &packed[step.consumed_in..];
        out = &mut out[step.consumed_out..];
        let stuck = step.consumed_in == 0 && step.consumed_out == 0;
        match step.status {
            Err(error) => return Err(error.to_string()),
            Ok(LzwStatus::Done) if !out.is_empty() => return Err("the stream ends early".to_owned()),
            Ok(_) if stuck => return Err("the stream ends early".to_owned()),
            Ok(_) => {}
        }
    }
    Ok(())
}

fn unpack_bits(mut packed: &[u8], mut out: &mut [u8]) -> Result<(), String> {
    while !out.is_empty() {
        let (&head, rest) = packed.split_first().ok_or("the stream ends early")?;
        packed = rest;
        match head {
            0..=127 => {
                // A run may go beyond the rows that are needed.
                let (run, rest) =
                    packed.split_at_checked(usize::from(head) + 1).ok_or("the stream ends early")?;
                let count = run.len().min(out.len());
                out[..count].copy_from_slice(&run[..count]);
                out = &mut out[count..];
                packed = rest;
            }
            128 => {}
            129..=255 => {
                let (&byte, rest) = packed.split_first().ok_or("the stream ends early")?;
                let count = (257 - usize::from(head)).min(out.len());
                out[..count].fill(byte);
                out = &mut out[count..];
                packed = rest;
            }
        }
    }
    Ok(())
}

/// Undoes the horizontal predictor in a row of numbers of `size` bytes, which stay in their order. Reals are summed as the integers of
/// their bits, as libtiff and GDAL do.
pub(super) fn sum_numbers(row: &mut [u8], size: usize, order: Order) {
    let mut last = 0u64;
    for number in row.chunks_exact_mut(size) {
        last = last.wrapping_add(order.bits(number));
        let bytes = last.to_le_bytes();
        for (k, byte) in number.iter_mut().enumerate() {
            *byte = bytes[if order == Order::Little { k } else { size - 1 - k }];
        }
    }
}

/// Undoes the floating-point predictor in a row of reals of `size` bytes, which become big-endian. `scratch` is as long as the row.
pub(super) fn sum_planes(row: &mut [u8], size: usize, scratch: &mut [u8]) {
    let mut last = 0u8;
    for (sum, byte) in scratch.iter_mut().zip(&*row) {
        last = last.wrapping_add(*byte);
        *sum = last;
    }
    let count = row.len() / size;
    for (k, number) in row.chunks_exact_mut(size).enumerate() {
        for (plane, byte) in number.iter_mut().enumerate() {
            *byte = scratch[plane * count + k];
        }
    }
}
