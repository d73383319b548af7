//! Damaged, absurd and hostile files: a clear error, bounded memory, no panic.

use std::io::{Cursor, Read, Seek, SeekFrom, Write};

use apsides_terrain::TerrainError;
use apsides_terrain::io::{ReadOptions, Windows, read, read_labelled};
use flate2::write::ZlibEncoder;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::samples::{ASCII, PDS4, Tag, Tiff, keys, npy, pds3, pds4_data, png};
use super::{message, read_at_1m, read_bytes};

/// Small files of every format and layout.
fn seeds() -> Vec<Vec<u8>> {
    let values: Vec<f64> = (0..20 * 18).map(|k| (k % 50) as f64).collect();
    let base = Tiff::new(20, 18, values);
    let mut seeds = Vec::new();
    for (compression, predictor, tile, kind) in [
        (1, 1, (4, None), (32, 3)),
        (8, 1, (4, None), (16, 2)),
        (8, 3, (16, Some(16)), (32, 3)),
        (32773, 1, (5, None), (8, 1)),
        (8, 2, (16, Some(16)), (32, 1)),
        (1, 1, (16, Some(16)), (64, 3)),
        (1, 3, (16, Some(16)), (64, 3)),
        (5, 2, (16, Some(16)), (16, 1)),
    ] {
        for (big_endian, big) in [(false, false), (true, true)] {
            let mut file = Tiff { compression, predictor, tile, kind, big_endian, big, ..base.clone() };
            file.tags.push(Tag::Text(42113, "7"));
            file.tags.push(keys(&[(1024, 1), (1025, 2)]));
            seeds.push(file.bytes());
        }
    }
    let mut lzw = Cursor::new(Vec::new());
    let encoder = tiff::encoder::TiffEncoder::new(&mut lzw).unwrap();
    let mut encoder = encoder.with_compression(tiff::encoder::Compression::Lzw);
    let grey: Vec<u16> = (0..360).map(|k| k % 41).collect();
    encoder.write_image::<tiff::encoder::colortype::Gray16>(18, 20, &grey).unwrap();
    seeds.push(lzw.into_inner());
    seeds.push(ASCII.as_bytes().to_vec());
    seeds.push(npy(1, "<f4", false, "(4, 4)", &[1; 64]));
    seeds.push(npy(2, ">i2", true, "(4, 8)", &[1; 64]));
    seeds.push(pds3());
    seeds.push(png(8, 8, true, &[3; 128]));
    seeds.push(png(8, 8, false, &[3; 64]));
    seeds
}

/// Bits flipped, bytes replaced, parts cut off, moved or taken from another file.
fn mutated(random: &mut Xoshiro256PlusPlus, file: &[u8], other: &[u8]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    let below = |random: &mut Xoshiro256PlusPlus, n: usize| (random.next_u64() % n.max(1) as u64) as usize;
    for _ in 0..1 + below(random, 4) {
        let at = below(random, bytes.len());
        match below(random, 6) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << below(random, 8),
            1 if !bytes.is_empty() => bytes[at] = [0, 0xff, 0x7f, 0x80, 1][below(random, 5)],
            2 => bytes.truncate(at),
            3 => {
                let from = below(random, other.len());
                let count = below(random, (other.len() - from).min(64) + 1);
                bytes.splice(at..(at + count).min(bytes.len()), other[from..from + count].iter().copied());
            }
            4 => {
                let count = below(random, bytes.len() - at + 1);
                bytes.drain(at..at + count.min(8));
            }
            _ => {
                // A word of a directory or a header.
                let word = [0, u32::MAX, 1 << 31, 0x7fff_ffff, 65536][below(random, 5)];
                let end = (at + 4).min(bytes.len());
                bytes[at..end].copy_from_slice(&word.to_le_bytes()[..end - at]);
            }
        }
    }
    bytes
}

#[test]
fn ten_thousand_mutated_files_neither_panic_nor_take_memory() {
    let begin = std::time::Instant::now();
    let seeds = seeds();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let options = ReadOptions { pixel_m: Some(1.0), max_pixels: 1 << 20, ..ReadOptions::default() };
    let (mut sound, mut refused, mut most) = (0, 0, 0);
    for k in 0..10_000 {
        let file = &seeds[k % seeds.len()];
        let other = &seeds[(random.next_u64() % seeds.len() as u64) as usize];
        let bytes = mutated(&mut random, file, other);
        let options = if k % 2 == 0 { options } else { ReadOptions { pixel_m: None, ..options } };
        let mut result = None;
        let memory = allocation_counter::measure(|| result = Some(read(Cursor::new(&bytes), &options)));
        most = most.max(memory.bytes_max);
        let result = result.unwrap();
        match &result {
            Ok(map) => assert!(map.geometry().pixels() <= 1 << 20),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
        if result.is_ok() {
            sound += 1
        } else {
            refused += 1
        }
        if let Ok(mut windows) = Windows::open(Cursor::new(&bytes), &options) {
            let g = *windows.geometry();
            let _ = windows.window(g.rows() - 1, g.cols() - 1, 1, 1);
            let _ = windows.window(0, 0, g.rows().min(3), g.cols().min(3));
        }
    }
    // Labels apart from their rasters.
    let options = ReadOptions { pixel_m: None, ..options };
    for _ in 0..1000 {
        let label = mutated(&mut random, PDS4.as_bytes(), &pds3());
        let data = mutated(&mut random, &pds4_data(), &[0xff; 16]);
        let _ = read_labelled(&label, Cursor::new(&data), &options);
        let label = mutated(&mut random, &pds3()[..1024], PDS4.as_bytes());
        let _ = read_labelled(&label, Cursor::new(&pds3()[1024..]), &options);
    }
    println!("{sound} read, {refused} refused, {:.1} s, {most} bytes at once", begin.elapsed().as_secs_f64());
    // 2^20 pixels of 12 bytes, and what the largest of the files (some kilobytes) can expand to.
    assert!(most < 1 << 25, "{most} bytes");
    assert!(sound > 500 && refused > 2500, "{sound} {refused}");
}

#[test]
fn every_truncation_is_an_error() {
    for seed in seeds() {
        for length in 0..seed.len() {
            // White space after the last number may go, and so may the end of a compressed stream or of a directory.
            let result = read_at_1m(&seed[..length]);
            if length < seed.len() / 2 {
                assert!(result.is_err(), "{length} of {}", seed.len());
            }
        }
    }
}

#[test]
fn absurd_dimensions_are_refused_before_memory_is_taken() {
    let mut file = Tiff::new(2, 2, vec![0.0; 4]);
    file.tags.extend([Tag::Long(256, vec![1 << 31]), Tag::Long(257, vec![1 << 31])]);
    for compression in [1, 8] {
        file.compression = compression;
        assert!(read_bytes(&file.bytes()).is_err());
    }
    // As many pixels as allowed, from a few bytes.
    file.tags.truncate(2);
    file.tags.extend([
        Tag::Long(256, vec![1 << 14]),
        Tag::Long(257, vec![1 << 14]),
        Tag::Long(278, vec![1 << 14]),
    ]);
    assert!(message(read_bytes(&file.bytes())).contains("strips or tiles of 16384 x 16384"));
    file.compression = 1;
    assert!(message(read_bytes(&file.bytes())).contains("do not fit"));
    for side in [0, 1] {
        let mut file = Tiff::new(2, 2, vec![0.0; 4]);
        file.tags.push(Tag::Long(256 + side, vec![0]));
        assert!(matches!(read_bytes(&file.bytes()), Err(TerrainError::Shape { .. })));
    }
}

#[test]
fn more_pixels_than_allowed_are_refused() {
    let options = ReadOptions { max_pixels: 100, pixel_m: Some(1.0), ..ReadOptions::default() };
    for bytes in [
        Tiff::new(20, 20, vec![1.0; 400]).bytes(),
        npy(1, "<f4", false, "(20, 20)", &[1; 1600]),
        png(20, 20, false, &[1; 400]),
        format!("ncols 20\nnrows 20\nxllcorner 0\nyllcorner 0\ncellsize 1\n{}", "1 ".repeat(400))
            .into_bytes(),
    ] {
        assert!(matches!(
            read(Cursor::new(&bytes), &options),
            Err(TerrainError::TooLarge { limit: 100, .. })
        ));
    }
    let mut windows =
        Windows::open(Cursor::new(Tiff::new(20, 20, vec![1.0; 400]).bytes()), &options).unwrap();
    assert!(windows.window(0, 0, 10, 10).is_ok());
    assert!(matches!(windows.window(0, 0, 11, 10), Err(TerrainError::TooLarge { .. })));
}

#[test]
fn a_map_of_gaps_alone_is_an_error_and_one_pixel_is_not() {
    let mut file = Tiff::new(3, 3, vec![-1.0; 9]);
    file.tags.push(Tag::Text(42113, "-1"));
    assert!(matches!(read_bytes(&file.bytes()), Err(TerrainError::Empty { pixels: 9 })));
    assert!(matches!(
        read_bytes(&Tiff::new(2, 1, vec![f64::NAN; 2]).bytes()),
        Err(TerrainError::Empty { .. })
    ));
    for compression in [1, 8, 32773] {
        let file = Tiff { compression, ..Tiff::new(1, 1, vec![4.0]) };
        assert_eq!(read_bytes(&file.bytes()).unwrap().height(0, 0), Some(4.0));
    }
}

#[test]
fn a_file_in_the_other_byte_order_than_stated_is_refused() {
    for (big_endian, name) in [(false, *b"MM\0*"), (true, *b"II*\0")] {
        let mut bytes = Tiff { big_endian, ..Tiff::new(4, 4, vec![1.0; 16]) }.bytes();
        bytes[..4].copy_from_slice(&name);
        assert!(matches!(read_bytes(&bytes), Err(TerrainError::Malformed { .. })));
    }
}

/// A stream of zeros: 1 GiB from 1 MiB would need this much.
fn bomb(bytes: usize) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    let zeros = vec![0; 1 << 20];
    (0..bytes >> 20).for_each(|_| encoder.write_all(&zeros).unwrap());
    encoder.finish().unwrap()
}

#[test]
fn compressed_bombs_stay_within_the_size_of_the_map() {
    // A strip that would inflate to 64 MiB in a map of 16 pixels: only those are taken.
    let mut file = Tiff { compression: 8, ..Tiff::new(4, 4, vec![1.0; 16]) };
    let mut bytes = file.bytes();
    let stream = bomb(1 << 26);
    assert!(stream.len() < 70_000);
    let at = bytes.len() as u32;
    bytes.extend(&stream);
    file.tags.extend([Tag::Long(273, vec![at]), Tag::Long(279, vec![stream.len() as u32])]);
    let mut whole = file.bytes();
    whole.resize(at as usize, 0);
    whole.extend(&stream);
    let map = read_bytes(&whole);
    assert_eq!(map.unwrap().height(3, 3), Some(0.0));
    // The same strip for a map of 2^28 pixels: more than one strip may hold.
    file.tags.extend([
        Tag::Long(256, vec![1 << 14]),
        Tag::Long(257, vec![1 << 14]),
        Tag::Long(278, vec![1 << 14]),
    ]);
    let mut whole = file.bytes();
    whole.resize(at as usize, 0);
    whole.extend(&stream);
    assert!(message(read_bytes(&whole)).contains("at most 256 MiB"));
    // A picture whose header promises more than its data can hold.
    let mut picture = png(8, 8, true, &[3; 128]);
    picture[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = crc32(&picture[12..29]);
    picture[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(message(read_at_1m(&picture)).contains("do not fit"));
}

/// Check sum of PNG (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    };
    !bytes.iter().fold(u32::MAX, step)
}

/// A reader that fails after some bytes.
struct Failing(Cursor<Vec<u8>>, u64);

impl Read for Failing {
    fn read(&mut self, buf: &mut [u8]) -> std::io::Result<usize> {
        if self.0.position() >= self.1 {
            return Err(std::io::Error::other("the disk is gone"));
        }
        self.0.read(buf)
    }
}

impl Seek for Failing {
    fn seek(&mut self, pos: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(pos)
    }
}

#[test]
fn a_failing_reader_is_reported() {
    let bytes = Tiff::new(20, 20, vec![1.0; 400]).bytes();
    let text = message(read(Failing(Cursor::new(bytes), 1000), &ReadOptions::default()));
    assert!(text.contains("the disk is gone"), "{text}");
}
